//! `summary`, `head` and `query` as a user meets them.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::common::{LANDSCAPE, MATERIAL};

/// A dataset of two tables, `gap` (two parts) and `optimal`, in a folder of its own.
fn dataset(axes: &str, tables: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = crate::common::sweep(folder.path(), axes, tables);
    crate::common::run(&sweep, &folder.path().join("results"), 0);
    folder
}

fn landscape() -> tempfile::TempDir {
    dataset(LANDSCAPE, "[tables.gap]\n[tables.optimal]\n")
}

fn small() -> tempfile::TempDir {
    dataset(&format!("t_f = [0.02, 0.037, 0.049]\n{MATERIAL}"), "[tables.optimal]\n[tables.best]\n")
}

fn slipsweep(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slipsweep")).current_dir(folder).args(arguments).output().expect("runs")
}

/// What a command prints that ends well and quietly.
fn printed(folder: &Path, arguments: &[&str]) -> String {
    let output = slipsweep(folder, arguments);
    assert_eq!(
        (output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()),
        (Some(0), ""),
        "{arguments:?}"
    );
    String::from_utf8(output.stdout).expect("is text")
}

/// The whole message and the exit code of a command that ends badly and prints nothing.
fn refused(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = slipsweep(folder, arguments);
    assert!(output.stdout.is_empty(), "{arguments:?}");
    (output.status.code().expect("ends by itself"), String::from_utf8(output.stderr).expect("is text"))
}

#[test]
fn summary_tells_what_the_run_told() {
    let folder = landscape();
    let run = printed(folder.path(), &["run", "spec.toml"]);
    let summary = printed(folder.path(), &["summary", "results/test"]);
    assert!(summary.starts_with("gap: 482,403 rows (") && summary.contains("optimal: 3 rows (3 ok)\n"), "{summary}");
    for line in summary.lines() {
        assert!(run.lines().any(|other| other == line), "{line}\n{run}");
    }
}

#[test]
fn what_is_missing_is_told() {
    let folder = landscape();
    let lost = folder.path().join("results/test/gap/part-000001.parquet");
    fs::remove_file(&lost).expect("was there");
    let summary = printed(folder.path(), &["summary", "results/test"]);
    assert!(summary.contains("  1 of 2 parts not there yet: `slipsweep run` makes what is missing\n"), "{summary}");
    let head = printed(folder.path(), &["head", "results/test", "gap", "-n", "0"]);
    assert!(
        head.starts_with("gap: 482,403 rows, each the work of a cubic shortcut") && head.contains("; 1 part missing\n")
    );
    let output = slipsweep(folder.path(), &["query", "results/test", "SELECT count(*) AS n FROM gap"]);
    assert_eq!(String::from_utf8_lossy(&output.stdout), "n\n262144\n");
    let note = "note: `gap` lacks 1 of 2 parts, which `slipsweep run` makes\n";
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), note));
}

#[test]
fn head_shows_names_units_and_rows() {
    let folder = small();
    let head = printed(folder.path(), &["head", "results/test", "optimal", "-n", "2"]);
    let expected = "\
optimal: 3 rows, each the protocol of least work
  t_f    a     b     v_i  v_f  work          v_start     v_end       hold_time  hamiltonian     theta_max    strategy  status
  l/v_0  mu_0  mu_0  v_0  v_0  mu_0 sigma l  v_0         v_0         l/v_0      mu_0 sigma v_0  l/v_0
  0.02   0.03  0.05  3    100  3.80811142    19.9230141  3392.16787  0          2.59678653      0.333333333  speed_up  ok
  0.037  0.03  0.05  3    100  3.85650171    3.12297925  3380.58505  0          2.93400965      0.333333333  speed_up  ok
";
    assert_eq!(head, expected);
    let all = printed(folder.path(), &["head", "results/test"]);
    assert!(all.starts_with("optimal: 3 rows") && all.contains("\n\nbest: 3 rows"), "{all}");
    // A trace is a table too, with the units that its Parquet file knows and a CSV file does not.
    let arguments = "trace optimal --t-f 0.02 --a 0.03 --b 0.05 --v-i 3 --v-f 100 --out";
    for (file, second) in [("o.parquet", "  l/v_0"), ("o-1.csv", "  0 ")] {
        let arguments: Vec<&str> = arguments.split(' ').chain([file]).collect();
        printed(folder.path(), &arguments);
        let head = printed(folder.path(), &["head", file]);
        let lines: Vec<&str> = head.lines().collect();
        assert!(lines[1].starts_with("  t ") && lines[2].starts_with(second), "{head}");
    }
    assert_eq!(printed(folder.path(), &["query", "o-1.csv", "SELECT max(v) AS v FROM o_1"]), "v\n3392.16787\n");
}

#[test]
fn queries_answer_in_every_format() {
    let folder = landscape();
    let least = "SELECT t_f, min(gap) AS gap, count(*) AS n FROM gap WHERE status = 'ok' GROUP BY t_f ORDER BY t_f";
    let table = "t_f    gap             n\n0.02   6.8168686e-7    68406\n0.037  0.000113236866  70885\n\
                 0.049  0.00062147271   72871\n";
    assert_eq!(printed(folder.path(), &["query", "results/test", least]), table);
    let join = "SELECT o.strategy, max(g.gap) > 0.1 AS large FROM gap g JOIN optimal o ON g.t_f = o.t_f \
                GROUP BY o.strategy ORDER BY o.strategy";
    let csv = printed(folder.path(), &["query", "results/test", join, "--format", "csv"]);
    assert_eq!(csv, "strategy,large\nslow_down,true\nspeed_up,true\n");
    let null = "SELECT t_f, gap, status FROM gap LIMIT 1";
    let json = printed(folder.path(), &["query", "results/test", null, "--format", "jsonl"]);
    assert_eq!(json, "{\"t_f\":0.02,\"gap\":null,\"status\":\"infeasible\"}\n");
    let nothing = printed(folder.path(), &["query", "results/test", "SELECT t_f, gap FROM gap LIMIT 0"]);
    assert_eq!(nothing, "t_f  gap\n");
    // A file says by its name what it holds, and can be asked again.
    for file in ["least.parquet", "least.csv"] {
        let arguments = ["query", "results/test", least, "--out", file];
        assert_eq!(printed(folder.path(), &arguments), format!("written to {file}\n"));
        assert_eq!(printed(folder.path(), &["query", file, "SELECT * FROM least"]), table);
    }
    printed(folder.path(), &["query", "results/test", least, "--out", "least.txt"]);
    assert_eq!(fs::read_to_string(folder.path().join("least.txt")).expect("is there"), table);
    // The parts of one table, and one part, know which table they are of.
    for (path, rows) in [("results/test/gap", 482_403), ("results/test/gap/part-000000.parquet", 262_144)] {
        let count = printed(folder.path(), &["query", path, "SELECT count(*) AS n FROM gap"]);
        assert_eq!(count, format!("n\n{rows}\n"));
    }
}

#[test]
fn a_reader_that_has_had_enough_is_no_failure() {
    let folder = landscape();
    for format in ["table", "csv", "jsonl", "parquet"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_slipsweep"))
            .current_dir(folder.path())
            .args(["query", "results/test", "SELECT gap FROM gap", "--format", format])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("runs");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("ends");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), stderr.as_ref()), (Some(0), ""), "{format}");
    }
}

#[test]
fn wrong_questions_are_answered_with_what_there_is() {
    let folder = small();
    let tables = "  expected: a SELECT from these tables:\n    \
                  optimal: t_f, a, b, v_i, v_f, work, v_start, v_end, hold_time, hamiltonian, theta_max, strategy, status\n    \
                  best: t_f, a, b, v_i, v_f, alpha_2, alpha_3, work, work_optimal, gap, v_min, status\n";
    let correct = "correct the query; text goes in 'single quotes', names with odd characters in \"double\" ones";
    for (question, found, help) in [
        ("SELECT worck FROM best", "no column `worck`", "did you mean `work`?"),
        ("SELECT temperature FROM best", "no column `temperature`", "choose one of these"),
        ("SELECT gap FROM bets", "no table `bets`", "did you mean `best`?"),
        ("SELEC gap FROM best", "not SQL: Expected: an SQL statement, found: SELEC at Line: 1, Column: 1", correct),
        ("SELECT frobnicate(gap) FROM best", "unsupported function 'frobnicate'", correct),
        ("", "not one statement", "write one SELECT"),
        ("DROP TABLE best", "this asks for nothing", "begin with SELECT"),
    ] {
        let expected = (1, format!("error: {found}\n{tables}  help: {help}\n"));
        assert_eq!(refused(folder.path(), &["query", "results/test", question]), expected, "{question}");
    }
    // Types that do not fit may show only while the rows are read.
    for (question, found) in [
        ("SELECT * FROM best WHERE gap = 'x'", "cannot compare string with numeric type (f64)"),
        ("SELECT sum(status) FROM best", "`sum` operation not supported for dtype `cat`"),
        ("SELECT gap FROM best WHERE status = 1", "cannot compare categorical with i32"),
        ("SELECT sqrt(status) FROM best", "cannot cast categorical types to Float64"),
    ] {
        let expected = (1, format!("error: {found}\n{tables}  help: {correct}\n"));
        assert_eq!(refused(folder.path(), &["query", "results/test", question]), expected, "{question}");
        assert_eq!(refused(folder.path(), &["query", "results/test", question, "--out", "none.csv"]), expected);
        assert!(!folder.path().join("none.csv").exists());
    }
}

#[test]
fn wrong_paths_and_names() {
    let folder = small();
    fs::create_dir(folder.path().join("empty")).expect("is writable");
    fs::write(folder.path().join("notes.txt"), "mine").expect("is writable");
    fs::write(folder.path().join("broken.parquet"), "PAR1").expect("is writable");
    let expected = "  expected: the folder of a dataset, such as results/NAME, or a Parquet or CSV file\n";
    for (path, found, help) in [
        ("nowhere", "there is no such file or folder", "check the path"),
        ("empty", "holds neither a manifest.json nor Parquet files", "name a folder that `slipsweep run` wrote"),
        ("notes.txt", "neither a folder nor a file that ends in .parquet or .csv", "check the path"),
    ] {
        let message = (1, format!("error: {path}: {found}\n{expected}  help: {help}\n"));
        assert_eq!(refused(folder.path(), &["query", path, "SELECT 1"]), message);
        assert_eq!(refused(folder.path(), &["head", path]), message);
    }
    let (code, message) = refused(folder.path(), &["head", "broken.parquet"]);
    assert!(code == 2 && message.starts_with("error: broken.parquet: cannot read: "), "{message}");
    let message =
        "error: results/test: no table `optima`\n  expected: optimal, best\n  help: did you mean `optimal`?\n";
    assert_eq!(refused(folder.path(), &["head", "results/test", "optima"]), (1, message.to_owned()));
    let message = "error: x.pdf ends in none of .csv, .jsonl, .parquet, .txt: add --format\n";
    assert_eq!(
        refused(folder.path(), &["query", "results/test", "SELECT 1", "--out", "x.pdf"]),
        (1, message.to_owned())
    );
    let message = "error: empty: not a dataset\n  expected: a folder with a manifest.json\n  \
                   help: name a folder that `slipsweep run` wrote\n";
    assert_eq!(refused(folder.path(), &["summary", "empty"]), (1, message.to_owned()));
}
