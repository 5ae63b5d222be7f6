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

/// Where it leads to a pipe, such as /dev/stdout, or to nothing, a link stays.
#[cfg(unix)]
#[test]
fn regress_a_link_is_followed_and_never_replaced() {
    let folder = folder();
    let question = ["query", "results/test", "SELECT count(*) AS n FROM gap", "--format", "csv", "--out"];
    for (target, found) in [("/proc/self/fd/1", "n\n10000\n"), ("answer.csv", "")] {
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(target, &link).expect("is writable");
        let output = through(folder.path(), "\"$@\" | cat", &[&question[..], &["link"]].concat());
        assert!(output.status.success() && String::from_utf8_lossy(&output.stdout).starts_with(found), "{output:?}");
        assert_eq!(fs::read_link(&link).expect("is a link").as_os_str(), target);
        fs::remove_file(&link).expect("is there");
    }
    assert_eq!(fs::read_to_string(folder.path().join("answer.csv")).expect("is there"), "n\n10000\n");
}

#[test]
fn pictures_and_pages_go_to_standard_output() {
    let folder = folder();
    for (arguments, start) in [
        (&["plot", "results/test", "--table", "gap", "--out", "-"][..], "<svg"),
        (&["report", "results/test", "--out", "-"], "<!doctype html>"),
    ] {
        let output = through(folder.path(), "\"$@\"", arguments);
        assert!(output.status.success() && output.stdout.starts_with(start.as_bytes()), "{arguments:?}");
    }
    let output = through(folder.path(), "\"$@\"", &["run", "spec.toml", "--out", "-"]);
    assert_eq!(output.status.code(), Some(1));
}
