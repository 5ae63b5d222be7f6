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
    found.extend(pages());
    found.sort();
    found
}

/// The pages of the book, relative to the repository.
fn pages() -> Vec<PathBuf> {
    let in_folder = |folder: &Path| -> Vec<PathBuf> {
        let entries = fs::read_dir(repository().join(folder)).expect("exists").map(|entry| entry.expect("is readable"));
        entries.map(|entry| folder.join(entry.file_name())).collect()
    };
    let (folders, files): (Vec<PathBuf>, Vec<PathBuf>) =
        in_folder(Path::new("docs")).into_iter().partition(|path| repository().join(path).is_dir());
    let below = folders.iter().flat_map(|folder| in_folder(folder));
    files.into_iter().chain(below).filter(|path| path.extension().is_some_and(|ending| ending == "md")).collect()
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

/// A spec of a document: a block that begins with its name.
fn specs(text: &str) -> Vec<(String, String)> {
    let blocks = blocks(text, "toml").into_iter();
    let named = |spec: String| Some((spec.strip_prefix("name = \"")?.split('"').next()?.to_owned(), spec));
    blocks.filter_map(named).collect()
}

/// The pages that a newcomer follows first. `tests/consumer/documents.py` runs those of the whole book with a release build.
#[test]
fn commands_run() {
    let program = Path::new(env!("CARGO_BIN_EXE_slipsweep")).parent().expect("is in a folder");
    let path = env::join_paths(
        [program.to_owned()].into_iter().chain(env::split_paths(&env::var_os("PATH").unwrap_or_default())),
    );
    let path = path.expect("has no colon");
    for document in ["README.md", "docs/tutorial.md"].map(Path::new) {
        let text = text(document);
        let script = blocks(&text, "sh").join("\n");
        assert!(script.contains("slipsweep "), "{}", document.display());
        let folder = tempfile::tempdir().expect("is writable");
        for (name, spec) in specs(&text) {
            fs::write(folder.path().join(format!("{name}.toml")), spec).expect("is writable");
        }
        if document == Path::new("README.md") {
            // The first of its two commands, which also builds the program.
            let mut first = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
            let first = first.arg("run").arg(repository().join("sweeps/landscape.toml")).current_dir(folder.path());
            assert!(first.output().expect("runs").status.success());
        }
        let mut bash = Command::new("bash");
        let bash = bash.args(["-euo", "pipefail", "-c", &script]).current_dir(folder.path()).env("PATH", &path);
        let output = bash.output().expect("runs");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{}: {stderr}", document.display());
    }
}

#[test]
fn specs_are_legal() {
    let mut count = 0;
    for document in documents() {
        for (name, spec) in specs(&text(&document)) {
            // A spec with a file of points needs that file.
            if !spec.contains("points = ")
                && let Err(error) = Sweep::parse(&spec, Path::new("."))
            {
                panic!("{}: {name}: {error}", document.display());
            }
            count += 1;
        }
    }
    assert!(count >= 20, "{count}");
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
        datasets.extend(specs(&text));
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
    for page in pages() {
        let name = page.strip_prefix("docs").expect("is in docs").to_string_lossy();
        assert!(name == "SUMMARY.md" || summary.contains(&format!("]({name})")), "{name} is not in docs/SUMMARY.md");
    }
}

/// Every table and every command of the program has a page.
#[test]
fn the_book_has_a_page_for_every_table_and_command() {
    for table in table::ALL {
        assert!(repository().join(format!("docs/tables/{}.md", table.name())).is_file(), "{}", table.name());
    }
    let help = Command::new(env!("CARGO_BIN_EXE_slipsweep")).arg("--help").output().expect("runs");
    let help = String::from_utf8(help.stdout).expect("is text");
    let listed = help.split("Commands:\n").nth(1).expect("lists commands").split("\n\n").next().expect("ends");
    let names: Vec<&str> = listed.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() > 10, "{names:?}");
    for name in names.into_iter().filter(|name| *name != "help") {
        assert!(repository().join(format!("docs/commands/{name}.md")).is_file(), "docs/commands/{name}.md");
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
