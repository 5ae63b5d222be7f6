//! The commands as a user meets them: words, exit codes, interruption.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{LANDSCAPE, MATERIAL, files};
use slipsweep::dataset::{Folder, Footer, Layout, encode};
use slipsweep::protocol::Status;
use slipsweep::sweep::{Plan, Sweep};
use slipsweep::table::ColumnBuffer;

fn slipsweep(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
    command.current_dir(folder);
    command
}

fn write_spec(folder: &Path, axes: &str, tables: &str) {
    fs::write(folder.join("spec.toml"), format!("name = \"test\"\n[axes]\n{axes}\n{tables}")).expect("is writable");
}

#[test]
fn run_reports_the_answers_of_a_physicist() {
    let folder = tempfile::tempdir().expect("is writable");
    write_spec(folder.path(), LANDSCAPE, "[tables.gap]\n[tables.best_cubic]\n[tables.optimal]\n[tables.crossover]\n");
    let output = slipsweep(folder.path()).args(["run", "spec.toml"]).output().expect("runs");
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""));
    let text = String::from_utf8_lossy(&output.stdout);
    for line in [
        "gap: 482,403 rows (",
        "  least gap of the rows with status ok:\n  at a = 0.03 mu_0, b = 0.05 mu_0, v_i = 3 v_0, v_f = 100 v_0\n",
        "best_cubic: 3 rows (3 ok)",
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
    assert!(text.contains("  2 of 2 parts kept\n"), "{text}");
    assert!(text.contains("nothing to compute: every part exists\n"), "{text}");
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
    let layout = Layout::new(request.table, &request.projection, &sweep.grid);
    let mut buffer = ColumnBuffer::new(layout.columns.len());
    buffer.resize(2);
    buffer.status = vec![Status::Ok, Status::NotConverged];
    let footer = Footer::new(&Plan::new(&sweep).manifest(&sweep), "optimal", 0..2);
    let (bytes, _) = encode(&layout, &request.row_index, &buffer, &footer).expect("is encoded");
    let part = Folder::new(&folder.path().join("results"), "test").part("optimal", 0);
    fs::write(part, bytes).expect("is writable");

    let message = "error: 1 row not_converged\n".to_owned();
    assert_eq!(run(&["--strict"]), (Some(3), message.clone()));
    assert_eq!(run(&["--strict", "--quiet"]), (Some(3), message.clone()));
    assert_eq!(run(&["--strict", "--quiet", "--shard", "0/1"]), (Some(3), message));
    assert_eq!(run(&["--strict", "--quiet", "--shard", "0/2"]).0, Some(0));
    assert_eq!(run(&[]), (Some(0), String::new()));
}

/// Rows under ceilings, with derivatives or of another law have optima of their own.
#[test]
fn plan_counts_shared_optima_alone() {
    let folder = tempfile::tempdir().expect("is writable");
    let optima = |axes: &str, tables: &str| {
        write_spec(folder.path(), &format!("{MATERIAL}t_f = [0.02, 0.03]\n{axes}"), tables);
        Plan::new(&Sweep::load(&folder.path().join("spec.toml")).expect("is legal")).optima
    };
    let optimal = "[tables.optimal]\n";
    let (work, gap) = ("[tables.shortcut]\ncolumns = [\"work\"]\n", "[tables.shortcut]\ncolumns = [\"gap\"]\n");
    for (axes, tables, expected) in [
        ("", optimal, 2),
        ("v_ceiling = [300.0, 400.0]\n", optimal, 0),
        ("v_ceiling = { linspace = [300.0, 400.0, 3] }\n", optimal, 0),
        ("v_ceiling = [300.0, inf]\n", optimal, 2),
        ("v_ceiling = [300.0, inf]\ntau_ceiling = 1.05\n", optimal, 0),
        ("v_ceiling = { expr = \"4 * v_f\" }\n", optimal, 2),
        ("v_ceiling = 600.0\nlaw = [\"slip\", \"prz\"]\n", optimal, 0),
        ("", "[tables.optimal]\ncolumns = [\"work\", \"dwork_da\"]\n", 0),
        ("", work, 0),
        ("", gap, 2),
        ("family = \"bounded_friction\"\ntau_ceiling = 1.6\n", gap, 0),
        ("family = [\"bounded_friction\", \"step\"]\ntau_ceiling = 1.6\n", gap, 2),
    ] {
        assert_eq!(optima(axes, tables), expected, "{axes}{tables}");
    }
    // Each block counts by itself.
    let block = |ceiling: &str| format!("[[block]]\n[block.axes]\n{MATERIAL}t_f = [0.02, 0.03]\n{ceiling}\n");
    for (second, expected) in [("tau_ceiling = 1.05", 0), ("tau_ceiling = inf", 2)] {
        let blocks = block("v_ceiling = 300.0") + &block(second);
        fs::write(folder.path().join("spec.toml"), format!("name = \"test\"\n{blocks}{optimal}")).expect("is writable");
        let sweep = Sweep::load(&folder.path().join("spec.toml")).expect("is legal");
        assert_eq!(Plan::new(&sweep).optima, expected, "{second}");
    }
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
    // More than can be kept are not shared.
    write_spec(
        folder.path(),
        &axes.replace("v_f = 100.0", "v_f = { linspace = [10.0, 100.0, 1000000] }"),
        "[tables.gap]\n",
    );
    let output = slipsweep(folder.path()).args(["plan", "spec.toml"]).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("1,000,000,000,000,000") && !text.contains("shared:"), "{text}");
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
    for table in ["gap", "gap_histogram", "stability"] {
        let output = slipsweep(Path::new(".")).args(["tables", table]).output().expect("runs");
        let one = String::from_utf8_lossy(&output.stdout);
        assert!(one.starts_with(&format!("{table}: ")) && text.contains(&*one) && !one.contains("\n\n"), "{one}");
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
    let axes = LANDSCAPE.replace("[0.02, 0.037, 0.049]", "{ linspace = [0.02, 0.049, 40] }");
    write_spec(folder.path(), &axes, "[tables.gap]\ncolumns = [\"gap\"]\nrtol = 1e-6\n");
    let whole = folder.path().join("whole");
    let output = slipsweep(folder.path()).args(["run", "spec.toml", "--out", "whole"]).output().expect("runs");
    assert_eq!(output.status.code(), Some(0));

    for (name, code) in [("INT", 130), ("TERM", 143)] {
        // A busy machine stretches seconds: one prompt end of five is required, everything else of each.
        let attempt = |number| interrupt(folder.path(), &format!("{name}-{number}"), name, code, &whole);
        assert!((0..5).filter_map(attempt).any(|seconds| seconds < Duration::from_secs(1)));
    }
}

/// Runs `spec.toml` of `folder` into `out`, sends `signal` after the first part, goes on to the end, and compares with the
/// dataset `whole`. Returns how long the run lived on after the signal; `None` if it was complete before the signal came.
#[cfg(unix)]
fn interrupt(folder: &Path, out: &str, signal: &str, code: i32, whole: &Path) -> Option<Duration> {
    let broken = folder.join(out);
    let mut child = slipsweep(folder)
        .args(["run", "spec.toml", "--out", out])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    while !broken.join("test/gap/part-000000.parquet").is_file() {
        if child.try_wait().expect("can be asked").is_some() {
            return None;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let kill = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().expect("runs");
    let sent = Instant::now();
    assert!(kill.success());
    let output = child.wait_with_output().expect("ends");
    let elapsed = sent.elapsed();
    if output.status.success() {
        return None;
    }
    assert_eq!(output.status.code(), Some(code));
    let (all, some) = (files(whole), files(&broken));
    let parts = |files: &std::collections::BTreeMap<_, _>| files.len() - 1;
    let message = format!("stopped; {} of {} parts finished; the same command continues\n", parts(&some), parts(&all));
    // A machine so busy that the run took ten seconds has lines of progress first.
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.ends_with(&message), "{said}");
    assert!(some.len() > 1 && some.len() < all.len(), "{} of {}", some.len(), all.len());
    assert!(some.iter().all(|(path, bytes)| all.get(path) == Some(bytes)));
    let output = slipsweep(folder).args(["run", "spec.toml", "--out", out]).output().expect("runs");
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(files(&broken), all);
    Some(elapsed)
}

/// What `output.rs` does not try: an answer that is lost is a failure of every command, and of the help.
#[cfg(target_os = "linux")]
#[test]
fn regress_no_command_loses_its_answer() {
    let folder = tempfile::tempdir().expect("is writable");
    write_spec(folder.path(), &format!("t_f = [0.02, 0.03]\n{MATERIAL}"), "[tables.optimal]\n");
    let sh = |arguments: &[&str], target: &str| {
        let script = format!("exec \"$0\" \"$@\" {target}");
        let mut shell = Command::new("sh");
        shell.args(["-c", &script, env!("CARGO_BIN_EXE_slipsweep")]).args(arguments).current_dir(folder.path());
        let output = shell.output().expect("runs");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    // A command without output loses nothing.
    assert_eq!(sh(&["run", "spec.toml", "--quiet"], ">&-"), (Some(0), String::new()));
    let commands: [&[&str]; 7] = [
        &["verify", "results/test"],
        &["query", "results/test", "SELECT t_f FROM optimal", "--format", "jsonl"],
        &["schema"],
        &["completions", "bash"],
        &["man"],
        &["run", "--help"],
        &["--version"],
    ];
    for arguments in commands {
        let closed = "error: cannot write to standard output: it is closed\n".to_owned();
        assert_eq!(sh(arguments, ">&-"), (Some(2), closed), "{arguments:?}");
        let full = "error: cannot write to standard output: No space left on device (os error 28)\n".to_owned();
        assert_eq!(sh(arguments, "> /dev/full"), (Some(2), full), "{arguments:?}");
        assert_eq!(sh(arguments, "> /dev/null"), (Some(0), String::new()), "{arguments:?}");
    }
}

/// A command that only reads ends at once, and reports that nothing has changed.
#[cfg(unix)]
#[test]
fn a_command_that_reads_can_be_stopped() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = format!("{MATERIAL}t_f = {{ linspace = [0.01, 0.1, 1000] }}\n")
        .replace("v_f = 100.0", "v_f = { linspace = [10.0, 100.0, 1000] }");
    let axes = axes.replace("v_i = 3.0", "v_i = { linspace = [1.5, 9.0, 1000] }");
    fs::write(
        folder.path().join("spec.toml"),
        format!("name = \"test\"\nwhere = \"t_f * v_f * v_i > 3\"\n[axes]\n{axes}[tables.optimal]\n"),
    )
    .expect("is writable");
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let mut command = slipsweep(folder.path());
        let child =
            command.args(["plan", "spec.toml"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("runs");
        // Time to begin; what it has to do takes seconds.
        std::thread::sleep(Duration::from_millis(500));
        let kill = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().expect("runs");
        assert!(kill.success());
        let output = child.wait_with_output().expect("ends");
        let reported = String::from_utf8_lossy(&output.stderr);
        assert_eq!(
            (output.status.code(), reported.as_ref()),
            (Some(code), "stopped while reading the spec; nothing has changed\n")
        );
    }
}

/// Both exit codes of a run that is stopped stand where a user looks for them.
#[test]
fn exit_codes_are_documented() {
    let folder = tempfile::tempdir().expect("is writable");
    let help = slipsweep(folder.path()).arg("--help").output().expect("runs").stdout;
    let help = String::from_utf8_lossy(&help).into_owned();
    let page = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/commands.md")).expect("is there");
    for code in [0, 1, 2, 3, 75, 130, 143] {
        assert!(help.contains(&format!("\n  {code:<5}")), "{code} in {help}");
        assert!(page.contains(&format!("\n| {code} |")), "{code}");
    }
}

/// More than any disk has: refused before anything is written, with both numbers and the way out.
#[test]
fn a_dataset_that_cannot_fit_is_refused() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = "t_f = { linspace = [0.01, 1.0, 100000] }\na = 0.03\nb = { linspace = [0.02, 0.05, 100000] }\nv_i = 3.0\n\
                v_f = { geomspace = [10.0, 1000.0, 100000] }\n";
    write_spec(folder.path(), axes, "[tables.optimal]\n");
    let output = slipsweep(folder.path()).args(["run", "spec.toml"]).output().expect("runs");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{message}");
    let (found, help) = message.split_once("\n  help: ").expect("has help");
    assert!(found.starts_with("error: results/test: about ") && found.contains("PB to write, but "), "{message}");
    assert!(found.ends_with(" free on the disk"), "{message}");
    assert_eq!(help, "write less, with `reduce` or fewer `columns`, or write elsewhere with --out DIR\n");
    assert!(!folder.path().join("results").exists());
    let output = slipsweep(folder.path()).args(["plan", "spec.toml"]).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("1,000,000,000,000,000") && text.contains("\ndoes not fit: results: about "), "{text}");
}

/// What a block costs is not what a row costs: 20,000 blocks were said to take minutes.
#[test]
fn blocks_are_no_rows_to_a_plan() {
    let folder = tempfile::tempdir().expect("is writable");
    let mut spec = "name = \"test\"\n[tables.optimal]\n".to_owned();
    for block in 0..20_000 {
        let t_f = 0.02 + 1e-6 * f64::from(block);
        spec.push_str(&format!("[[block]]\n[block.axes]\nt_f = {t_f:?}\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n"));
    }
    fs::write(folder.path().join("spec.toml"), spec).expect("is writable");
    let output = slipsweep(folder.path()).args(["plan", "spec.toml"]).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stdout);
    let total = text.lines().find_map(|line| line.strip_prefix("total: ")).expect("is printed");
    let time = total.split("on disk, ").nth(1).expect("is printed");
    assert!(time.contains(" s on "), "{total}");
}

/// Of a run that ends at once the start of the process is most: a plan does not name milliseconds.
#[test]
fn plans_of_short_runs_are_bounds() {
    let folder = tempfile::tempdir().expect("is writable");
    write_spec(folder.path(), "t_f = 0.02\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0", "[tables.optimal]\n");
    let output = slipsweep(folder.path()).args(["plan", "spec.toml"]).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains(" on disk, less than 0.3 s on "), "{text}");
}
