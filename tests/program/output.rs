//! Long answers: a reader that has had enough, and no terminal.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// 10,000 rows, whose text fills a pipe many times.
const SPEC: &str = "name = \"test\"\n[axes]\nt_f = 0.02\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n\
                    alpha_2 = { linspace = [-0.5, 0.5, 100], unit = \"1/t_f\" }\n\
                    alpha_3 = { linspace = [-0.5, 0.5, 100], unit = \"1/t_f^2\" }\n[tables.gap]\n";

/// Every command that answers on standard output; the first one makes the dataset of the others.
const ANSWERS: [&[&str]; 8] = [
    &["run", "spec.toml"],
    &["plan", "spec.toml"],
    &["summary", "results/test"],
    &["query", "results/test", "SELECT * FROM gap", "--format", "csv"],
    &["head", "results/test", "gap", "-n", "10000"],
    &["tables"],
    &[
        "trace", "optimal", "--t-f", "0.02", "--a", "0.03", "--b", "0.05", "--v-i", "3", "--v-f", "100", "--points",
        "9000",
    ],
    &["status", "results/test"],
];

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("is writable");
    fs::write(folder.path().join("spec.toml"), SPEC).expect("is writable");
    assert_eq!(through(folder.path(), "\"$@\"", ANSWERS[0]).status.code(), Some(0));
    folder
}

/// A command as bash runs it in `line`, where it stands as `"$@"`.
fn through(folder: &Path, line: &str, arguments: &[&str]) -> Output {
    let mut bash = Command::new("bash");
    bash.current_dir(folder).stdin(Stdio::null()).args(["-o", "pipefail", "-c", line, "bash"]);
    bash.arg(env!("CARGO_BIN_EXE_slipsweep")).args(arguments).output().expect("runs")
}

#[test]
fn a_reader_that_has_had_enough_is_no_failure() {
    let folder = folder();
    for arguments in ANSWERS {
        let output = through(folder.path(), "\"$@\" | head -1", arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        // A busy machine may have lines of progress.
        assert!(output.status.code() == Some(0) && !stderr.contains("error"), "{arguments:?}: {stderr}");
        assert_eq!(output.stdout.iter().filter(|&&byte| byte == b'\n').count(), 1, "{arguments:?}");
    }
}

#[test]
fn without_a_terminal_text_is_plain() {
    let folder = folder();
    for arguments in ANSWERS {
        let output = through(folder.path(), "\"$@\"", arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
        let text = [output.stdout, output.stderr].concat();
        let control = text.iter().find(|byte| byte.is_ascii_control() && **byte != b'\n');
        assert!(!text.is_empty() && control.is_none(), "{arguments:?}: {control:?}");
    }
}
