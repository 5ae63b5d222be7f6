//! What README, docs and examples say: their commands run and print what is shown, their links lead somewhere, the glossary knows every name.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use slipsweep::grid::Quantity;
use slipsweep::sweep::Sweep;
use slipsweep::table;
use slipsweep::trace;

fn repository() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The documents of the repository, relative to it.
fn documents() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> =
        ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "examples/README.md"].map(PathBuf::from).into();
    let docs = fs::read_dir(repository().join("docs")).expect("is there").map(|entry| entry.expect("is readable"));
    let docs = docs.map(|entry| Path::new("docs").join(entry.file_name()));
    found.extend(docs.filter(|path| path.extension().is_some_and(|ending| ending == "md")));
    found.sort();
    found
}

fn text(document: &Path) -> String {
    fs::read_to_string(repository().join(document)).expect("is readable")
}

/// The code blocks of a language.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let opening = format!("```{language}\n");
    let ends = text.split(&opening).skip(1);
    ends.filter_map(|rest| rest.split("\n```").next()).map(str::to_owned).collect()
}

#[test]
fn commands_run() {
    let program = Path::new(env!("CARGO_BIN_EXE_slipsweep")).parent().expect("is in a folder");
    let path = env::join_paths(
        [program.to_owned()].into_iter().chain(env::split_paths(&env::var_os("PATH").unwrap_or_default())),
    );
    let path = path.expect("has no colon");
    let mut documents_with_commands = 0;
    for document in documents().iter().filter(|document| !document.ends_with("CONTRIBUTING.md")) {
        let script = blocks(&text(document), "sh").join("\n");
        if script.is_empty() {
            continue;
        }
        documents_with_commands += 1;
        assert!(script.contains("slipsweep "), "{}", document.display());
        let folder = tempfile::tempdir().expect("is writable");
        if document == Path::new("README.md") {
            // The first of its two commands, which builds the program besides.
            let mut first = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
            let first = first.arg("run").arg(repository().join("sweeps/landscape.toml")).current_dir(folder.path());
            assert!(first.output().expect("runs").status.success());
        }
        let mut bash = Command::new("bash");
        let bash = bash.args(["-euo", "pipefail", "-c", &script]).current_dir(folder.path()).env("PATH", &path);
        let output = bash.output().expect("runs");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && stderr.is_empty(), "{}: {stderr}", document.display());
        // What is shown of the output is what comes out.
        let stdout = String::from_utf8_lossy(&output.stdout);
        for shown in blocks(&text(document), "text") {
            assert!(stdout.contains(&shown), "{}:\n{shown}\n{stdout}", document.display());
        }
    }
    assert!(documents_with_commands >= 4);
}

#[test]
fn specs_are_legal() {
    let mut specs = 0;
    for document in documents() {
        for spec in blocks(&text(&document), "toml").iter().filter(|block| block.starts_with("name = ")) {
            if let Err(error) = Sweep::parse(spec, Path::new(".")) {
                panic!("{}: {error}", document.display());
            }
            specs += 1;
        }
    }
    assert!(specs >= 2);
}

/// The specs in a folder and those below it.
fn specs_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("is there").map(|entry| entry.expect("is readable").path());
    let (folders, files): (Vec<PathBuf>, Vec<PathBuf>) = entries.partition(|path| path.is_dir());
    let below = folders.iter().flat_map(|folder| specs_in(folder));
    files.into_iter().filter(|path| path.extension().is_some_and(|ending| ending == "toml")).chain(below).collect()
}

/// Documents can be followed in one clone, in any order: a dataset of one name comes from one spec.
#[test]
fn names_of_datasets_do_not_collide() {
    let named =
        |text: &str| text.lines().find_map(|line| Some(line.strip_prefix("name = \"")?.split('"').next()?.to_owned()));
    let mut datasets: Vec<(String, String)> = Vec::new();
    for path in specs_in(&repository().join("sweeps")) {
        let spec = fs::read_to_string(&path).expect("is readable");
        datasets.push((named(&spec).expect("has a name"), spec));
    }
    for document in documents() {
        let text = text(&document);
        let begun = |line: &str| Some(line.strip_prefix("slipsweep init ")?.split(' ').next()?.to_owned());
        // Of the examples, which are followed in their own folder, the datasets go elsewhere.
        for block in blocks(&text, "sh").iter().filter(|block| !block.contains("--out answers")) {
            let written = block.split("<<END\n").skip(1).filter_map(|rest| rest.split("\nEND").next());
            datasets.extend(written.filter_map(|spec| Some((named(spec)?, spec.to_owned()))));
            datasets.extend(block.lines().filter_map(begun).map(|name| (name, document.display().to_string())));
        }
        let specs = blocks(&text, "toml").into_iter().filter(|block| block.starts_with("name = "));
        datasets.extend(specs.map(|spec| (named(&spec).expect("has a name"), spec)));
    }
    assert!(datasets.len() >= 16, "{datasets:?}");
    for (name, spec) in &datasets {
        assert!(datasets.iter().all(|(other, same)| other != name || same == spec), "two datasets `{name}`: {spec}");
    }
}

#[test]
fn links_lead_somewhere() {
    for document in documents() {
        let text = text(&document);
        for rest in text.split("](").skip(1) {
            let target = rest.split(')').next().unwrap_or_default();
            if target.contains("://") {
                continue;
            }
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let folder = repository().join(&document);
            let path =
                if file.is_empty() { folder.clone() } else { folder.parent().expect("is in a folder").join(file) };
            assert!(path.exists(), "{}: {target}", document.display());
            if !anchor.is_empty() {
                let headings = fs::read_to_string(&path).expect("is a document");
                let words = |line: &str| {
                    let kept = line.trim_start_matches('#').trim().to_lowercase();
                    kept.chars()
                        .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
                        .collect::<String>()
                        .replace(' ', "-")
                };
                assert!(headings.lines().any(|line| line.starts_with('#') && words(line) == anchor), "{target}");
            }
        }
    }
}

#[test]
fn the_least_compiler_is_the_one_of_the_manifest() {
    let sentence = concat!("With a Rust toolchain (", env!("CARGO_PKG_RUST_VERSION"), " or later)");
    assert!(text(Path::new("README.md")).contains(sentence), "README.md: expected `{sentence}`");
}

#[test]
fn the_book_has_every_page() {
    let summary = text(Path::new("docs/SUMMARY.md"));
    for document in documents().iter().filter(|document| document.starts_with("docs")) {
        let name = document.file_name().expect("is a file").to_string_lossy();
        assert!(name == "SUMMARY.md" || summary.contains(&format!("]({name})")), "{name} is not in docs/SUMMARY.md");
    }
}

#[test]
fn the_glossary_knows_every_name() {
    let glossary = text(Path::new("docs/glossary.md"));
    let columns =
        table::ALL.into_iter().flat_map(|table| table.columns()).chain(&trace::COLUMNS).map(|column| column.name);
    for name in Quantity::ALL.map(Quantity::name).into_iter().chain(columns) {
        assert!(glossary.contains(&format!("`{name}`")), "`{name}` is not in docs/glossary.md");
    }
}
