//! The commands as a user meets them: words, exit codes, interruption.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{LANDSCAPE, MATERIAL, files};
use slipsweep::dataset::{Folder, Footer, Layout, encode};
use slipsweep::protocol::Status;
use slipsweep::sweep::{Plan, Sweep};
use slipsweep::table::Sheet;

fn slipsweep(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
    command.current_dir(folder);
    command
}

fn write_spec(folder: &Path, axes: &str, tables: &str) {
    fs::write(folder.join("spec.toml"), format!("name = \"test\"\n[axes]\n{axes}\n{tables}")).expect("is writable");
}

#[test]
fn run_tells_what_a_physicist_asks() {
    let folder = tempfile::tempdir().expect("is writable");
    write_spec(folder.path(), LANDSCAPE, "[tables.gap]\n[tables.best]\n[tables.optimal]\n[tables.crossover]\n");
    let output = slipsweep(folder.path()).args(["run", "spec.toml"]).output().expect("runs");
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""));
    let text = String::from_utf8_lossy(&output.stdout);
    for line in [
        "gap: 482,403 rows (",
        "  least gap among the rows that are ok:\n  at a = 0.03, b = 0.05, v_i = 3, v_f = 100\n",
        "best: 3 rows (3 ok)",
        "optimal: 3 rows (3 ok)",
        "crossover: 1 row (1 ok)",
        "0.0374184121",
        "0.0495500046",
        "work: 3 optimal protocols, 4 landscapes, 3 best shortcuts, 1 transition, ",
        "written to results/test\n",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    let again = slipsweep(folder.path()).args(["run", "spec.toml"]).output().expect("runs");
    let text = String::from_utf8_lossy(&again.stdout);
    assert!(text.contains("  2 of 2 parts kept from before\n"), "{text}");
    assert!(text.contains("nothing to compute: every part was there\n"), "{text}");
    let quiet = slipsweep(folder.path()).args(["run", "spec.toml", "--quiet", "--strict"]).output().expect("runs");
    assert_eq!((quiet.status.code(), quiet.stdout.len(), quiet.stderr.len()), (Some(0), 0, 0));
}

/// No row of ours fails in this way that we know of: one is planted in a part, which the next run keeps.
#[test]
fn strict_fails_where_a_row_is_not_converged() {
    let folder = tempfile::tempdir().expect("is writable");
    write_spec(folder.path(), &format!("t_f = [0.02, 0.03]\n{MATERIAL}"), "[tables.optimal]\n");
    let run = |arguments: &[&str]| {
        let output = slipsweep(folder.path()).args(["run", "spec.toml"]).args(arguments).output().expect("runs");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(run(&["--strict"]), (Some(0), String::new()));

    let sweep = Sweep::load(&folder.path().join("spec.toml")).expect("is legal");
    let request = &sweep.requests[0];
    let layout = Layout::new(request.table, &request.selection, &sweep.grid);
    let mut sheet = Sheet::new(layout.columns.len());
    sheet.resize(2);
    sheet.status = vec![Status::Ok, Status::NotConverged];
    let footer = Footer::new(&Plan::new(&sweep).manifest(&sweep), "optimal", 0..2);
    let bytes = encode(&layout, &request.projection, &sheet, &footer).expect("is encoded");
    Folder::new(&folder.path().join("results"), "test").write_part("optimal", 0, &bytes).expect("is writable");

    let message = "error: 1 row not_converged\n".to_owned();
    assert_eq!(run(&["--strict"]), (Some(3), message.clone()));
    assert_eq!(run(&["--strict", "--quiet"]), (Some(3), message.clone()));
    assert_eq!(run(&["--strict", "--quiet", "--shard", "0/1"]), (Some(3), message));
    assert_eq!(run(&["--strict", "--quiet", "--shard", "0/2"]).0, Some(0));
    assert_eq!(run(&[]), (Some(0), String::new()));
}

#[test]
fn plan_counts_without_running() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = LANDSCAPE.replace("401", "1000").replace("[0.02, 0.037, 0.049]", "{ geomspace = [0.001, 2.0, 1000] }");
    write_spec(folder.path(), &axes, "[tables.gap]\n[tables.optimal]\n");
    let output = slipsweep(folder.path()).args(["plan", "spec.toml"]).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("1,000,000,000  3,815"), "{text}");
    assert!(text.contains("shared: 1,000 optimal protocols solved once each"), "{text}");
    assert_eq!(files(folder.path()).len(), 1);
}

#[test]
fn tables_lists_every_column() {
    let output = slipsweep(Path::new(".")).arg("tables").output().expect("runs");
    let text = String::from_utf8_lossy(&output.stdout);
    for table in slipsweep::table::ALL {
        assert!(text.contains(&format!("{}: {}\n", table.name(), table.doc())));
        for column in table.columns() {
            assert!(text.lines().any(|line| line.trim_start().starts_with(column.name) && line.contains(column.doc)));
        }
    }
}

#[test]
fn a_reader_that_has_had_enough_is_no_failure() {
    let mut child =
        slipsweep(Path::new(".")).arg("tables").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("runs");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("ends");
    assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0));
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_whole_parts_and_goes_on() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = LANDSCAPE.replace("[0.02, 0.037, 0.049]", "{ linspace = [0.02, 0.049, 120] }");
    write_spec(folder.path(), &axes, "[tables.gap]\ncolumns = [\"gap\"]\nrtol = 1e-6\n");
    let whole = folder.path().join("whole");
    let output = slipsweep(folder.path()).args(["run", "spec.toml", "--out", "whole"]).output().expect("runs");
    assert_eq!(output.status.code(), Some(0));

    for (name, code) in [("INT", 130), ("TERM", 143)] {
        // A busy machine stretches seconds: one prompt end of five is asked for, everything else of each.
        let attempt = |number| interrupt(folder.path(), &format!("{name}-{number}"), name, code, &whole);
        assert!((0..5).map(attempt).any(|seconds| seconds < Duration::from_secs(1)));
    }
}

/// Runs `spec.toml` of `folder` into `out`, sends `signal` after the first part, goes on to the end, and compares with the
/// dataset `whole`. Returns how long the run lived on after the signal.
#[cfg(unix)]
fn interrupt(folder: &Path, out: &str, signal: &str, code: i32, whole: &Path) -> Duration {
    let broken = folder.join(out);
    let mut child = slipsweep(folder)
        .args(["run", "spec.toml", "--out", out])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    while !broken.join("test/gap/part-000000.parquet").is_file() {
        assert!(child.try_wait().expect("can be asked").is_none());
        std::thread::sleep(Duration::from_millis(1));
    }
    let kill = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().expect("runs");
    let sent = Instant::now();
    assert!(kill.success());
    let output = child.wait_with_output().expect("ends");
    let elapsed = sent.elapsed();
    assert_eq!(output.status.code(), Some(code));
    let (all, some) = (files(whole), files(&broken));
    let parts = |files: &std::collections::BTreeMap<_, _>| files.len() - 1;
    let message =
        format!("stopped; {} of {} parts finished: the same command goes on from there\n", parts(&some), parts(&all));
    // A machine so busy that the run took ten seconds has lines of progress first.
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.ends_with(&message), "{said}");
    assert!(some.len() > 1 && some.len() < all.len(), "{} of {}", some.len(), all.len());
    assert!(some.iter().all(|(path, bytes)| all.get(path) == Some(bytes)));
    let output = slipsweep(folder).args(["run", "spec.toml", "--out", out]).output().expect("runs");
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(files(&broken), all);
    elapsed
}
