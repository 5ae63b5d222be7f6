//! The first ten minutes: `init`, help with examples, completions, manual pages, and what a run suggests.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn slipsweep(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slipsweep")).current_dir(folder).args(arguments).output().expect("runs")
}

/// What a command prints that ends well and quietly.
fn printed(folder: &Path, arguments: &[&str]) -> String {
    let output = slipsweep(folder, arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}\n{stderr}");
    String::from_utf8(output.stdout).expect("is text")
}

/// The commands under `next:`, as arguments of slipsweep.
fn suggested(text: &str) -> Vec<Vec<String>> {
    let (_, next) = text.split_once("next:\n").expect("suggests something");
    next.lines()
        .map(|line| {
            let (plain, quoted) = line.split_once(" \"").unwrap_or((line, ""));
            let words = plain.split_whitespace().map(str::to_owned);
            let mut words: Vec<String> = words.chain([quoted.trim_end_matches('"').to_owned()]).collect();
            words.retain(|word| !word.is_empty());
            assert_eq!(words.remove(0), "slipsweep");
            words
        })
        .collect()
}

#[test]
fn every_question_begins_with_a_spec_that_runs() {
    let folder = tempfile::tempdir().expect("is writable");
    for question in ["landscape", "crossover", "families", "stick-slip"] {
        let name = format!("my-{question}");
        let text = printed(folder.path(), &["init", &name, "--question", question]);
        let spec = fs::read_to_string(folder.path().join(format!("{name}.toml"))).expect("was written");
        assert!(spec.starts_with("#:schema ./slipsweep.schema.json\n# ") && !spec.contains("NAME"), "{spec}");
        let suggested_first = suggested(&text);
        assert_eq!(suggested_first.len(), 2);
        for command in suggested_first {
            let arguments: Vec<&str> = command.iter().map(String::as_str).collect();
            let output = printed(folder.path(), &arguments);
            if command[0] != "run" {
                continue;
            }
            assert!(!output.contains("not_converged"), "{output}");
            for command in suggested(&output) {
                let arguments: Vec<&str> = command.iter().map(String::as_str).collect();
                assert!(!printed(folder.path(), &arguments).is_empty(), "{command:?}");
            }
        }
    }
    let schema = fs::read_to_string(folder.path().join("slipsweep.schema.json")).expect("was written");
    assert_eq!(schema, printed(folder.path(), &["schema"]));
}

#[test]
fn existing_files_are_not_overwritten() {
    let folder = tempfile::tempdir().expect("is writable");
    fs::write(folder.path().join("mine.toml"), "mine").expect("is writable");
    fs::write(folder.path().join("slipsweep.schema.json"), "of another version").expect("is writable");
    for name in ["mine", "mine.toml"] {
        let output = slipsweep(folder.path(), &["init", name]);
        let message = "error: mine.toml: exists already\n  expected: a new name\n  help: choose another name, or remove the file\n";
        assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(1), message));
    }
    assert_eq!(fs::read_to_string(folder.path().join("mine.toml")).expect("is there"), "mine");
    let refused = |name: &str| {
        let output = slipsweep(folder.path(), &["init", name]);
        assert_eq!(output.status.code(), Some(1), "{name}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let rule = "  expected: at most 200 letters from a to z, digits, '-', '_' and '.', the first not '.'\n  help: choose another name\n";
    assert_eq!(refused("my spec"), format!("error: `my spec` cannot name a folder\n{rule}"));
    assert_eq!(refused("a\"b"), format!("error: `a\"b` cannot name a folder\n{rule}"));
    assert_eq!(refused(".."), format!("error: `..`: `` cannot name a folder\n{rule}"));
    // In a folder that is there, and a second time, when it is there as it would be written.
    fs::create_dir(folder.path().join("specs")).expect("is writable");
    for _ in 0..2 {
        assert!(printed(folder.path(), &["init", "specs/other"]).contains("slipsweep run specs/other.toml\n"));
    }
    // The schema is generated: that of another version gives way.
    printed(folder.path(), &["init", "other"]);
    assert!(fs::read_to_string(folder.path().join("slipsweep.schema.json")).expect("is there").starts_with('{'));
}

/// The names of all commands, as `--help` lists them.
fn commands() -> Vec<String> {
    let help = printed(Path::new("."), &["--help"]);
    let (_, list) = help.split_once("Commands:\n").expect("lists commands");
    let lines = list.lines().take_while(|line| !line.is_empty());
    let names = lines.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = names.filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

#[test]
fn every_help_shows_an_example() {
    let commands = commands();
    assert!(commands.len() >= 12, "{commands:?}");
    for command in &commands {
        let help = printed(Path::new("."), &[command, "--help"]);
        let (_, examples) = help.split_once("\nExample").unwrap_or_else(|| panic!("no example of {command}"));
        assert!(examples.contains(&format!("\n  slipsweep {command}")), "{examples}");
    }
}

#[test]
fn manual_pages_and_completions_know_every_command() {
    let page = printed(Path::new("."), &["man"]);
    assert!(page.contains(".TH slipsweep 1"), "{page}");
    for command in commands() {
        assert!(page.contains(&format!("slipsweep\\-{command}(1)")), "{command}\n{page}");
        let own = printed(Path::new("."), &["man", &command]);
        assert!(own.contains(&format!(".TH slipsweep-{command} 1")) && own.contains("Example"), "{own}");
        for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
            assert!(printed(Path::new("."), &["completions", shell]).contains(&command), "{shell} {command}");
        }
    }
    let output = slipsweep(Path::new("."), &["man", "rnu"]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && stderr.starts_with("error: no command `rnu`\n"), "{stderr}");
    assert!(stderr.ends_with("help: did you mean `run`?\n"), "{stderr}");
}
