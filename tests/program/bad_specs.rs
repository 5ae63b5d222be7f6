//! Every way to get a spec wrong, each with the whole message that it earns: `tests/bad_specs/NAME.toml` and `NAME.txt`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn slipsweep(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slipsweep")).args(arguments).current_dir(folder).output().expect("runs")
}

fn names(extension: &str) -> BTreeSet<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_specs");
    let entries =
        fs::read_dir(folder).expect("is there").map(|entry| PathBuf::from(entry.expect("is readable").file_name()));
    entries
        .filter(|path| path.extension().is_some_and(|found| found == extension))
        .map(|path| path.file_stem().expect("has a name").to_string_lossy().into_owned())
        .collect()
}

#[test]
fn every_bad_spec_earns_its_message() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_specs");
    let out = tempfile::tempdir().expect("is writable");
    let specs = names("toml");
    assert!(specs.len() >= 40, "{}", specs.len());
    assert_eq!(specs, names("txt"));
    for name in specs {
        let expected = fs::read_to_string(folder.join(format!("{name}.txt"))).expect("is readable");
        for command in [&["run", "--out", &out.path().to_string_lossy()][..], &["plan"]] {
            let spec = format!("{name}.toml");
            let arguments = [command, &[&spec]].concat();
            let output = slipsweep(&arguments, &folder);
            assert_eq!(String::from_utf8_lossy(&output.stderr), expected, "{name}");
            assert_eq!(output.status.code(), Some(1), "{name}");
            assert!(output.stdout.is_empty(), "{name}");
        }
    }
    assert_eq!(fs::read_dir(out.path()).expect("is readable").count(), 0);
}

#[test]
fn a_spec_that_cannot_be_read() {
    let folder = tempfile::tempdir().expect("is writable");
    let output = slipsweep(&["run", "nowhere.toml"], folder.path());
    let message = "error: nowhere.toml: cannot read: No such file or directory (os error 2)\n  expected: a readable TOML file\n  \
                   help: check the path\n";
    assert_eq!(String::from_utf8_lossy(&output.stderr), message);
    assert_eq!(output.status.code(), Some(1));
}

const GOOD: &str = "name = \"good\"\n[axes]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = [100.0, 200.0]\n[tables.crossover]\n";

#[test]
fn a_place_that_cannot_be_written() {
    let folder = tempfile::tempdir().expect("is writable");
    fs::write(folder.path().join("good.toml"), GOOD).expect("is writable");
    fs::write(folder.path().join("file"), "").expect("is writable");
    let output = slipsweep(&["run", "good.toml", "--out", "file"], folder.path());
    let message = "error: file/good/manifest.json: cannot read: Not a directory (os error 20)\n  help: mend that, then run the same \
                   command again, which keeps what is finished; or write elsewhere with --out DIR\n";
    assert_eq!(String::from_utf8_lossy(&output.stderr), message);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_place_that_belongs_to_something_else() {
    let folder = tempfile::tempdir().expect("is writable");
    fs::create_dir_all(folder.path().join("results/good")).expect("is writable");
    fs::write(folder.path().join("results/good/notes.txt"), "mine").expect("is writable");
    fs::write(folder.path().join("good.toml"), GOOD).expect("is writable");
    let output = slipsweep(&["run", "good.toml"], folder.path());
    let message = "error: results/good: not a dataset, but not empty either\n  expected: an empty folder, or one with a manifest.json\n  \
                   help: change `name` in the spec, or write elsewhere with --out DIR\n";
    assert_eq!(String::from_utf8_lossy(&output.stderr), message);
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn wrong_arguments() {
    let folder = tempfile::tempdir().expect("is writable");
    for arguments in [&["run"][..], &["sweep"], &["run", "x.toml", "--threads", "0"], &["run", "x.toml", "--fast"], &[]]
    {
        assert_eq!(slipsweep(arguments, folder.path()).status.code(), Some(1), "{arguments:?}");
    }
    for arguments in [&["--help"][..], &["--version"], &["run", "--help"]] {
        assert_eq!(slipsweep(arguments, folder.path()).status.code(), Some(0), "{arguments:?}");
    }
}
