//! The names of the contract: old ones are gone. The words of comments: each states what its item is.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The list of old names, relative to the repository.
const LIST: &str = "tests/program/old_names.txt";

/// Files that may have old names: the list, the history, and the comparison of two versions.
const EXEMPT: [&str; 3] = [LIST, "CHANGELOG.md", "tests/compare/run"];

/// A name of an earlier version of the contract.
#[derive(Debug)]
struct OldName<'a> {
    name: &'a str,
    replacement: &'a str,
}

impl<'a> OldName<'a> {
    /// The entry of a line of the list.
    fn parse(line: &'a str) -> OldName<'a> {
        let (name, replacement) =
            line.split_once(" -> ").unwrap_or_else(|| panic!("{LIST}: `{line}` is not OLD -> NEW"));
        OldName { name, replacement }
    }

    /// The numbers of the lines of `text` with the name.
    fn lines(&self, text: &str) -> Vec<usize> {
        text.lines().zip(1..).filter(|(line, _)| self.is_in(line)).map(|(_, number)| number).collect()
    }

    /// Whether `line` has the name; an end that is a letter, a digit or `_` must be the end of an identifier.
    fn is_in(&self, line: &str) -> bool {
        line.match_indices(self.name).any(|(start, found)| {
            let (before, after) = (&line[..start], &line[start + found.len()..]);
            let starts = !found.starts_with(is_of_identifier) || !before.ends_with(is_of_identifier);
            starts && (!found.ends_with(is_of_identifier) || !after.starts_with(is_of_identifier))
        })
    }
}

fn is_of_identifier(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_'
}

/// The tracked files, relative to the repository.
fn tracked() -> Vec<PathBuf> {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed = Command::new("git").args(["ls-files", "-z"]).current_dir(repository).output().expect("git runs");
    assert!(listed.status.success(), "{}", String::from_utf8_lossy(&listed.stderr));
    let listed = String::from_utf8(listed.stdout).expect("names are text");
    // A file that is deleted and not committed yet is still listed.
    listed.split_terminator('\0').map(PathBuf::from).filter(|path| repository.join(path).is_file()).collect()
}

#[test]
fn old_names_are_gone() {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR"));
    let list = fs::read_to_string(repository.join(LIST)).expect("is readable");
    let entries = list.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    let old: Vec<OldName<'_>> = entries.map(OldName::parse).collect();
    assert!(old.len() >= 20, "{old:?}");
    let mut found = Vec::new();
    // Seeds of the fuzzer are specs of any kind.
    for path in tracked().iter().filter(|path| !path.starts_with("fuzz/corpus")) {
        let name = path.to_string_lossy();
        if EXEMPT.contains(&&*name) {
            continue;
        }
        // Of binary files only the path counts.
        let text = String::from_utf8(fs::read(repository.join(path)).expect("is readable")).unwrap_or_default();
        for old in &old {
            let line = |number: usize| format!("{name}:{number}: {} is now {}", old.name, old.replacement);
            found.extend(old.lines(&text).into_iter().map(line));
            if old.is_in(&name) {
                found.push(format!("{name}: {} is now {}", old.name, old.replacement));
            }
        }
    }
    assert!(found.is_empty(), "{} old names:\n{}", found.len(), found.join("\n"));
}

/// The rule for the ends of a name can fail.
#[test]
fn a_name_is_a_whole_identifier_and_a_quoted_one_is_literal() {
    let is_in = |name: &str, line: &str| OldName { name, replacement: "" }.is_in(line);
    assert!(is_in("gop", "[tables.gop]") && is_in("gop", "src/gop/mod.rs"));
    assert!(!is_in("gop", "gop_friction") && !is_in("gop", "gops"));
    assert!(is_in("tables.gop", "[tables.gop]") && !is_in("tables.gop", "[tables.gop_cubic]"));
    assert!(is_in("`gop`", "the strategy `gop`.") && !is_in("`gop`", "gop"));
}

#[test]
fn no_comment_begins_with_a_comparison() {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR"));
    let is_code = |path: &&PathBuf| {
        path.extension().is_some_and(|end| ["rs", "py", "pyi", "toml"].iter().any(|code| end == *code))
    };
    let mut found = Vec::new();
    for path in tracked().iter().filter(is_code) {
        let text = String::from_utf8(fs::read(repository.join(path)).expect("is readable")).unwrap_or_default();
        for (line, number) in text.lines().zip(1..) {
            let line = line.trim_start();
            let is_comment = ["//", "#", "\"\"\""].iter().any(|sign| line.starts_with(sign));
            if is_comment && line.trim_start_matches(|sign: char| !sign.is_alphabetic()).starts_with("The same") {
                found.push(format!("{}:{number}: {line}", path.display()));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}
