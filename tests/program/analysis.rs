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
    dataset(&format!("t_f = [0.02, 0.037, 0.049]\n{MATERIAL}"), "[tables.optimal]\n[tables.best_cubic]\n")
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
fn summary_repeats_the_report_of_the_run() {
    let folder = landscape();
    let run = printed(folder.path(), &["run", "spec.toml"]);
    let summary = printed(folder.path(), &["summary", "results/test"]);
    assert!(summary.starts_with("gap: 482,403 rows (") && summary.contains("optimal: 3 rows (3 ok)\n"), "{summary}");
    for line in summary.lines() {
        assert!(run.lines().any(|other| other == line), "{line}\n{run}");
    }
}

/// A table without parts, or with a damaged one, keeps no other table from being read.
#[test]
fn the_tables_that_are_there_are_read() {
    let folder = small();
    let part = |table: &str| folder.path().join(format!("results/test/{table}/part-000000.parquet"));
    fs::remove_file(part("optimal")).expect("is there");
    let output = slipsweep(folder.path(), &["head", "results/test"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("best_cubic: "));
    let note = "note: `optimal` has no parts yet; `slipsweep run` computes them\n";
    assert_eq!(String::from_utf8_lossy(&output.stderr), note);
    let message = "error: `optimal` has no parts yet\n  help: compute them with `slipsweep run`\n".to_owned();
    assert_eq!(refused(folder.path(), &["head", "results/test", "optimal"]), (1, message.clone()));
    assert_eq!(refused(folder.path(), &["query", "results/test", "SELECT * FROM optimal"]), (1, message));
    let query = ["query", "results/test", "SELECT count(*) AS n FROM best_cubic"];
    assert_eq!(printed(folder.path(), &query), "n\n3\n");

    fs::write(part("optimal"), "PAR1").expect("is writable");
    let output = slipsweep(folder.path(), &["head", "results/test"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("best_cubic: "));
    assert!(String::from_utf8_lossy(&output.stderr).contains("optimal/part-000000.parquet"));
    assert_eq!(refused(folder.path(), &["query", "results/test", "SELECT * FROM optimal"]).0, 2);
    assert_eq!(printed(folder.path(), &query), "n\n3\n");

    // The name of a dataset without its folder.
    let (code, message) = refused(folder.path(), &["head", "test"]);
    assert!(code == 1 && message.ends_with("did you mean `results/test`?\n"), "{message}");
}

/// A key of GROUP BY may have a new name with an aggregate of a column of the same name in another table.
#[test]
fn columns_of_joined_tables_are_grouped_under_new_names() {
    let folder = small();
    let query = |name: &str| {
        let (from, key) =
            ("FROM optimal o JOIN best_cubic c ON o.t_f = c.t_f", "GROUP BY c.work ORDER BY c.work LIMIT 1");
        format!("SELECT c.work AS {name}, max(o.work) AS most, count(*) AS n {from} {key}")
    };
    let asked = |sql: &str| printed(folder.path(), &["query", "results/test", sql, "--format", "csv"]);
    let least = asked(
        "SELECT min(c.work) AS least, min(o.work) AS most, 1 AS n FROM optimal o JOIN best_cubic c ON o.t_f = c.t_f",
    );
    assert_eq!(asked(&query("least")), least);
    assert_eq!(asked(&query("work")), least.replace("least", "work"));
    let words = "SELECT o.status, c.t_f, max(c.work) AS most FROM optimal o JOIN best_cubic c ON o.a = c.a GROUP BY o.status, c.t_f";
    assert_eq!(asked(words), asked(&format!("{words} ORDER BY o.status, c.t_f")));
    let (code, message) = refused(folder.path(), &["query", "results/test", &query("v_i")]);
    assert!(code == 1 && message.contains("choose a name after AS that no table has"), "{message}");
}

/// A comparison that holds for no row by mistake is noted.
#[test]
fn comparisons_with_unknown_words_or_rounded_numbers_are_noted() {
    let folder = small();
    let asked = |condition: &str, columns: &str| {
        let query = format!("SELECT {columns} FROM best_cubic WHERE {condition}");
        let output = slipsweep(folder.path(), &["query", "results/test", &query, "--format", "csv"]);
        assert_eq!(output.status.code(), Some(0), "{condition}");
        let text = |bytes| String::from_utf8(bytes).expect("is text");
        (text(output.stdout), text(output.stderr))
    };
    for condition in ["status = 'OK'", "status IN ('ok', 'OK') AND v_f = 3.5", "'OK' <> best_cubic.status"] {
        let (_, note) = asked(condition, "count(*) AS n");
        assert!(note.starts_with("note: `status` is never 'OK'; it is one of ok, below_bound, "), "{note}");
        assert_eq!(note.lines().count(), 1, "{note}");
    }
    assert_eq!(asked("t_f = 0.038", "t_f"), ("t_f\n".to_owned(), String::new()));
    let (answer, note) = asked("t_f = 0.03700001", "t_f");
    assert_eq!(answer, "t_f\n");
    let close = "t_f BETWEEN 0.03700001 * (1 - 1e-6) AND 0.03700001 * (1 + 1e-6)";
    assert_eq!(note, format!("note: `=` compares all digits of `t_f`; for a rounded number, write {close}\n"));
    assert_eq!(asked(&close.replace("0.03700001", "0.037"), "t_f"), ("t_f\n0.037\n".to_owned(), String::new()));
    // Also in a count; not for a number that no row has in more digits, or that a row has.
    assert!(asked("t_f = 0.03700001", "count(*)").1.starts_with("note: `=` compares all digits of `t_f`"));
    assert!(asked("gap = -0.03700001 OR t_f = 0.038", "count(*)").1.is_empty());
    // A negative number as the table of the terminal shows it.
    let shown = printed(folder.path(), &["query", "results/test", "SELECT min(alpha_2) AS x FROM best_cubic"]);
    let shown = shown.lines().last().expect("has a row").trim();
    let between = format!("alpha_2 BETWEEN {shown} * (1 + 1e-6) AND {shown} * (1 - 1e-6)\n");
    assert!(shown.starts_with('-') && asked(&format!("alpha_2 = {shown}"), "work").1.ends_with(&between), "{shown}");
    // A name after AS has words of its own.
    let renamed = "SELECT count(*) AS n FROM (SELECT 'good' AS status FROM best_cubic) AS t WHERE status = 'good'";
    assert_eq!(printed(folder.path(), &["query", "results/test", renamed]), "n\n3\n");
    for condition in ["status = 'ok'", "t_f = 0.037", "t_f = 0.038 OR v_i = 3"] {
        assert_eq!(asked(condition, "count(*) > 0 AS found"), ("found\ntrue\n".to_owned(), String::new()));
    }
}

#[test]
fn summaries_state_units() {
    let expected = "\
optimal: 3 rows (3 ok)
  at a = 0.03 mu_0, b = 0.05 mu_0, v_i = 3 v_0, v_f = 100 v_0, v_ceiling = inf v_0, tau_ceiling = inf mu_0 sigma
    t_f    work          v_start     v_end       time_at_floor  time_at_v_ceiling  time_at_tau_ceiling  hamiltonian     theta_max    strategy
    l/v_0  mu_0 sigma l  v_0         v_0         l/v_0          l/v_0              l/v_0                mu_0 sigma v_0  l/v_0
    0.02   3.80811142    19.9230141  3392.16787  0              0                  0                    2.59678653      0.333333333  speed_up
";
    let summary = printed(small().path(), &["summary", "results/test"]);
    assert!(summary.starts_with(expected), "{summary}");
    let summary = printed(landscape().path(), &["summary", "results/test"]);
    let units = |line: &&str| ["  gap ", "  v_min "].iter().any(|column| line.starts_with(column));
    let lines: Vec<Vec<&str>> = summary.lines().filter(units).map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(lines.iter().map(|line| line[..2].to_vec()).collect::<Vec<_>>(), [["gap", "1"], ["v_min", "v_0"]]);
}

#[test]
fn missing_parts_are_reported() {
    let folder = landscape();
    let lost = folder.path().join("results/test/gap/part-000001.parquet");
    fs::remove_file(&lost).expect("was there");
    let summary = printed(folder.path(), &["summary", "results/test"]);
    assert!(summary.contains("  1 of 2 parts missing: `slipsweep run` computes them\n"), "{summary}");
    let head = printed(folder.path(), &["head", "results/test", "gap", "-n", "0"]);
    let title = "gap: the work of a cubic shortcut and its gap to the optimum; 482,403 rows; 1 part missing\n";
    assert!(head.starts_with(title), "{head}");
    let output = slipsweep(folder.path(), &["query", "results/test", "SELECT count(*) AS n FROM gap"]);
    assert_eq!(String::from_utf8_lossy(&output.stdout), "n\n262144\n");
    let note = "note: `gap` lacks 1 of 2 parts, which `slipsweep run` computes\n";
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), note));
}

#[test]
fn head_shows_names_units_and_rows() {
    let folder = small();
    let head = printed(folder.path(), &["head", "results/test", "optimal", "-n", "2"]);
    let expected = "\
optimal: the protocol of least work; 3 rows
  t_f    a     b     v_i  v_f  v_ceiling  tau_ceiling  work          v_start     v_end       time_at_floor  time_at_v_ceiling  time_at_tau_ceiling  hamiltonian     theta_max    strategy  status
  l/v_0  mu_0  mu_0  v_0  v_0  v_0        mu_0 sigma   mu_0 sigma l  v_0         v_0         l/v_0          l/v_0              l/v_0                mu_0 sigma v_0  l/v_0
  0.02   0.03  0.05  3    100  inf        inf          3.80811142    19.9230141  3392.16787  0              0                  0                    2.59678653      0.333333333  speed_up  ok
  0.037  0.03  0.05  3    100  inf        inf          3.85650171    3.12297925  3380.58505  0              0                  0                    2.93400965      0.333333333  speed_up  ok
";
    assert_eq!(head, expected);
    let all = printed(folder.path(), &["head", "results/test"]);
    assert!(all.starts_with("optimal: the protocol") && all.contains("\n\nbest_cubic: the cubic shortcut"), "{all}");
    // A trace is a table too, with the units of its Parquet file or of the comments of a CSV file.
    let arguments = "trace optimal --t-f 0.02 --a 0.03 --b 0.05 --v-i 3 --v-f 100 --out";
    for file in ["o.parquet", "o-1.csv"] {
        let arguments: Vec<&str> = arguments.split(' ').chain([file]).collect();
        printed(folder.path(), &arguments);
        let head = printed(folder.path(), &["head", file]);
        let lines: Vec<&str> = head.lines().collect();
        assert!(lines[1].starts_with("  t ") && lines[2].starts_with("  l/v_0"), "{head}");
    }
    assert_eq!(printed(folder.path(), &["query", "o-1.csv", "SELECT max(v) AS v FROM o_1"]), "v\nv_0\n3392.16787\n");
}

#[test]
fn queries_answer_in_every_format() {
    let folder = landscape();
    let least = "SELECT t_f, min(gap) AS gap, count(*) AS n FROM gap WHERE status = 'ok' GROUP BY t_f ORDER BY t_f";
    let rows = "0.02   6.8168686e-7    68406\n0.037  0.000113236866  70885\n0.049  0.00062147271   72871\n";
    let [with_units, without] = ["l/v_0  1\n", ""].map(|units| format!("t_f    gap             n\n{units}{rows}"));
    assert_eq!(printed(folder.path(), &["query", "results/test", least]), with_units);
    let join = "SELECT o.strategy, max(g.gap) > 0.1 AS large FROM gap g JOIN optimal o ON g.t_f = o.t_f \
                GROUP BY o.strategy ORDER BY o.strategy";
    let csv = printed(folder.path(), &["query", "results/test", join, "--format", "csv"]);
    assert_eq!(csv, "strategy,large\nslow_down,true\nspeed_up,true\n");
    let null = "SELECT t_f, gap, status FROM gap LIMIT 1";
    let json = printed(folder.path(), &["query", "results/test", null, "--format", "jsonl"]);
    assert_eq!(json, "{\"t_f\":0.02,\"gap\":null,\"status\":\"infeasible\"}\n");
    let nothing = printed(folder.path(), &["query", "results/test", "SELECT t_f, gap FROM gap LIMIT 0"]);
    assert_eq!(nothing, "t_f    gap\nl/v_0  1\n");
    // The ending of a file selects its format, and the file can be queried again.
    for (file, table) in [("least.parquet", &with_units), ("least.csv", &without)] {
        let arguments = ["query", "results/test", least, "--out", file];
        assert_eq!(printed(folder.path(), &arguments), format!("written to {file}\n"));
        assert_eq!(printed(folder.path(), &["query", file, "SELECT * FROM least"]), *table);
    }
    printed(folder.path(), &["query", "results/test", least, "--out", "least.txt"]);
    assert_eq!(fs::read_to_string(folder.path().join("least.txt")).expect("is there"), with_units);
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
fn wrong_questions_are_answered_with_the_known_names() {
    let folder = small();
    let columns = "best_cubic: t_f, a, b, v_i, v_f, alpha_2, alpha_3, work, work_optimal, gap, v_min, status";
    let correct = "correct the query; text goes in 'single quotes', names with special characters in \"double\" ones";
    let types =
        "words can be compared and counted; arithmetic, sum and avg need numbers; CAST('inf' AS DOUBLE) is infinity";
    for (question, found, help) in [
        (
            "SELECT worck FROM best_cubic",
            &*format!("no column `worck`\n  expected: a column of {columns}"),
            "did you mean `work`?",
        ),
        (
            "SELECT c.worck FROM best_cubic AS c",
            &format!("no column `worck`\n  expected: a column of {columns}"),
            "did you mean `work`?",
        ),
        (
            "SELECT temperature FROM best_cubic",
            &format!("no column `temperature`\n  expected: a column of {columns}"),
            "choose one of these; text goes in single quotes: 'temperature'",
        ),
        (
            "SELECT v_max FROM best_cubic",
            &format!("no column `v_max`\n  expected: a column of {columns}"),
            "the dataset lacks this optional column; name it in `columns` of a spec with another `name`, and run that",
        ),
        (
            "SELECT gap FROM best_cubic WHERE t_f = inf",
            &format!("no column `inf`\n  expected: a column of {columns}"),
            "CAST('inf' AS DOUBLE) is this number",
        ),
        (
            "SELECT gap FROM best_cubi",
            "no table `best_cubi`\n  expected: optimal, best_cubic",
            "did you mean `best_cubic`?",
        ),
        (
            "SELEC gap FROM best_cubic",
            "not SQL: Expected: an SQL statement, found: SELEC at Line: 1, Column: 1",
            correct,
        ),
        ("SELECT frobnicate(gap) FROM best_cubic", "no function `frobnicate`", "choose another function"),
        ("SELECT mean(gap) FROM best_cubic", "no function `mean`", "write avg(x)"),
        ("", "the query is empty", "write one SELECT"),
        ("SELECT 1; SELECT 2", "several statements", "write one SELECT"),
        (
            "SHOW TABLES",
            "SHOW is not supported",
            "`slipsweep head DATASET` lists the tables with their columns; write one SELECT",
        ),
        (
            "SELECT t_f, gap FROM best_cubic GROUP BY t_f",
            "`gap` is neither in GROUP BY nor in an aggregate",
            "add it to GROUP BY, or write min(gap) or max(gap)",
        ),
        (
            "SELECT t_f, min(gap) FROM best_cubic",
            "`t_f` is neither in GROUP BY nor in an aggregate",
            "write min(gap) alone or with GROUP BY; for every row, write min(gap) OVER ()",
        ),
        (
            "SELECT COLUMNS('v_.*'), stddev_samp(gap) FROM best_cubic",
            "`COLUMNS('v_.*')` is neither in GROUP BY nor in an aggregate",
            "write stddev_samp(gap) alone or with GROUP BY; for every row, write stddev_samp(gap) OVER ()",
        ),
        (
            "SELECT *, 1 + count(*) FROM best_cubic",
            "`*` is neither in GROUP BY nor in an aggregate",
            "write count(*) alone or with GROUP BY; for every row, write count(*) OVER ()",
        ),
        (
            "SELECT count(*) FROM best_cubic ORDER BY t_f",
            "`t_f` is neither in GROUP BY nor in an aggregate",
            "write count(*) alone or with GROUP BY; for every row, write count(*) OVER ()",
        ),
        ("DROP TABLE best_cubic", "DROP is refused: `query` reads and never writes", "write one SELECT"),
    ] {
        let expected = (1, format!("error: {found}\n  help: {help}\n"));
        assert_eq!(refused(folder.path(), &["query", "results/test", question]), expected, "{question}");
    }
    // Types that do not fit may show only while the rows are read.
    let status = "; columns of words: status";
    for (question, words) in [
        ("SELECT * FROM best_cubic WHERE gap = 'x'", ""),
        ("SELECT sum(status) FROM best_cubic", status),
        ("SELECT gap FROM best_cubic WHERE status = 1", status),
        ("SELECT sqrt(status) FROM best_cubic", status),
        ("SELECT avg(status) FROM best_cubic", status),
        ("SELECT t_f + strategy FROM optimal WHERE status = 'ok'", "; columns of words: strategy, status"),
    ] {
        let found = format!("words in place of numbers, or numbers in place of words{words}");
        let expected = (1, format!("error: {found}\n  help: {types}\n"));
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
        "error: results/test: no table `optima`\n  expected: optimal, best_cubic\n  help: did you mean `optimal`?\n";
    assert_eq!(refused(folder.path(), &["head", "results/test", "optima"]), (1, message.to_owned()));
    let message = "error: --out x.pdf: the ending is none of .csv, .jsonl, .parquet, .txt\n  help: add --format\n";
    assert_eq!(
        refused(folder.path(), &["query", "results/test", "SELECT 1", "--out", "x.pdf"]),
        (1, message.to_owned())
    );
    let message = "error: empty: a folder without a dataset\n  expected: the folder of a dataset, such as \
                   results/NAME\n  help: name a folder that `slipsweep run` wrote\n";
    assert_eq!(refused(folder.path(), &["summary", "empty"]), (1, message.to_owned()));
}

#[test]
fn columns_without_a_name_are_named_as_in_duckdb() {
    let folder = small();
    for (question, names) in [
        ("SELECT min(gap), max(gap), count(*) FROM best_cubic", "min(gap),max(gap),count"),
        ("SELECT t_f, min(gap), min(gap) FROM best_cubic GROUP BY t_f", "t_f,min(gap),min(gap)_1"),
        ("SELECT gap * 2, -gap, round(gap, 3) FROM best_cubic", ""),
        (
            "SELECT a.work / b.work, max(b.gap) OVER (), a.gap FROM best_cubic a JOIN best_cubic b ON a.t_f = b.t_f ORDER BY a.work / b.work",
            "(a.work / b.work),max(b.gap) OVER (),gap",
        ),
        ("SELECT min(b.gap), count(*) AS n FROM best_cubic b ORDER BY n", "min(b.gap),n"),
        ("SELECT count(t_f), b.gap FROM best_cubic b GROUP BY b.gap", "count(t_f),gap"),
        ("SELECT * FROM (SELECT min(gap), max(gap) FROM best_cubic) AS both_of", "min(gap),max(gap)"),
    ] {
        let csv = printed(folder.path(), &["query", "results/test", question, "--format", "csv"]);
        let first = csv.lines().next().expect("has names");
        if names.is_empty() {
            assert!(first.starts_with("(gap * 2),"), "{first}");
        } else {
            assert_eq!(first, names, "{question}");
        }
    }
    // What is ordered by is the column of the answer.
    let question = "SELECT t_f, max(work) FROM best_cubic GROUP BY t_f ORDER BY max(work) DESC";
    let csv = printed(folder.path(), &["query", "results/test", question, "--format", "csv"]);
    let work: Vec<f64> = csv.lines().skip(1).filter_map(|line| line.split(',').nth(1)?.parse().ok()).collect();
    assert!(work.len() == 3 && work.is_sorted_by(|one, next| one >= next), "{csv}");
}

#[test]
fn words_and_logarithms_are_as_elsewhere() {
    let folder = landscape();
    let ask = |question: &str| printed(folder.path(), &["query", "results/test", question, "--format", "csv"]);
    let infeasible = ask("SELECT count(*) FROM gap WHERE status = 'infeasible'");
    assert_eq!(ask("SELECT count(*) FROM gap WHERE status LIKE 'inf%'"), infeasible);
    assert_eq!(ask("SELECT count(*) FROM gap g WHERE g.status LIKE 'inf%'"), infeasible);
    assert_eq!(ask("SELECT count(*) FROM gap WHERE upper(status) = 'INFEASIBLE'"), infeasible);
    assert_eq!(ask("SELECT log(v_f) AS x, log10(v_f) AS y FROM gap LIMIT 1"), "x,y\n2.0,2.0\n");
    let quoted = "SELECT count(*) FROM gap WHERE status = \"ok\"";
    let (code, message) = refused(folder.path(), &["query", "results/test", quoted]);
    let help = "  help: text goes in single quotes: 'ok'; double quotes are for names of columns\n";
    assert!(code == 1 && message.starts_with("error: no column `ok`\n") && message.ends_with(help), "{message}");
}

#[test]
fn an_answer_in_pieces_is_the_answer_at_once() {
    let folder = landscape();
    let ask = |question: &str| printed(folder.path(), &["query", "results/test", question, "--format", "csv"]);
    // Over a subquery a question is answered at once.
    for question in [
        "SELECT t_f, min(gap) AS x, max(gap) - min(gap) AS y, count(gap) AS n, count(*) AS m FROM {} WHERE alpha_2 > 0 \
         GROUP BY t_f HAVING count(*) > 10 ORDER BY t_f DESC",
        "SELECT status, count(*) AS n FROM {} GROUP BY status ORDER BY n DESC, status",
        "SELECT round(log10(gap)) AS decade, count(*) AS n FROM {} WHERE gap > 0 GROUP BY decade ORDER BY decade",
        "SELECT t_f, alpha_2, alpha_3, gap FROM {} WHERE status = 'ok' ORDER BY gap DESC, alpha_2, alpha_3 LIMIT 7 OFFSET 3",
        "SELECT t_f, gap FROM {} ORDER BY gap NULLS FIRST, t_f LIMIT 3",
        "SELECT alpha_2, alpha_3 FROM {} WHERE gap < 1e-3 LIMIT 5 OFFSET 20000",
        "SELECT min(gap) AS x, max(v_min) AS y, count(*) AS n FROM {} WHERE t_f > 0.03",
        "SELECT count(*) AS n, avg(gap) AS x, min(gap) AS y FROM {} WHERE t_f > 1",
        "SELECT t_f, status FROM {} GROUP BY t_f, status ORDER BY t_f, status",
    ] {
        let pieces = ask(&question.replace("{}", "gap"));
        assert_eq!(pieces, ask(&question.replace("{}", "(SELECT * FROM gap) AS all_of")), "{question}");
    }
    // Groups come in the order of their keys.
    let groups = "SELECT t_f, alpha_2, count(*) AS n FROM gap GROUP BY alpha_2, t_f";
    assert_eq!(ask(groups), ask(&format!("{groups} ORDER BY alpha_2, t_f")));
    let mean = |table: &str| -> Vec<f64> {
        let question = format!("SELECT t_f, avg(gap) AS x, sum(work) AS y FROM {table} GROUP BY t_f ORDER BY t_f");
        ask(&question).split([',', '\n']).skip(3).filter_map(|cell| cell.parse().ok()).collect()
    };
    let (pieces, whole) = (mean("gap"), mean("(SELECT * FROM gap) AS all_of"));
    assert_eq!(pieces.len(), 9);
    for (piece, whole) in pieces.iter().zip(&whole) {
        assert!((piece - whole).abs() <= 1e-12 * whole.abs(), "{piece} {whole}");
    }
}

/// What polars answers otherwise than SQL has it is refused, or spelt so that both agree.
#[test]
fn regress_answers_are_those_of_standard_sql() {
    let folder = small();
    let ask = |question: &str| printed(folder.path(), &["query", "results/test", question, "--format", "csv"]);
    for (question, answer) in [
        ("SELECT sum(gap) AS x, count(1) AS n FROM best_cubic WHERE t_f > 1", "x,n\n,0\n"),
        ("SELECT t_f, sum(gap) AS x FROM (SELECT * FROM best_cubic) AS b WHERE t_f > 1 GROUP BY t_f", "t_f,x\n"),
        ("SELECT count(1), count(*) FROM best_cubic", "count(1),count\n3,3\n"),
        ("SELECT count(*) FROM best_cubic WHERE t_f IN (1, (0.02), -3)", "count\n1\n"),
        (
            "SELECT b.t_f, o.strategy FROM best_cubic b JOIN optimal o ON b.t_f = o.t_f ORDER BY o.work LIMIT 1",
            "t_f,strategy\n0.02,speed_up\n",
        ),
        (
            "SELECT t_f, median(work) AS x FROM best_cubic WHERE t_f < 0.03 GROUP BY t_f ORDER BY t_f LIMIT 1",
            "t_f,x\n0.02,3.80811",
        ),
        ("WITH x AS (SELECT t_f FROM best_cubic) SELECT t_f FROM x ORDER BY t_f DESC LIMIT 1", "t_f\n0.049\n"),
        ("SELECT count(*) FROM best_cubic b LEFT JOIN optimal o ON b.t_f = o.t_f AND b.v_f = o.v_f", "count\n3\n"),
        ("SELECT count(*) FROM optimal WHERE strategy LIKE '%s%e%_%p%' AND strategy NOT LIKE '%x'", "count\n2\n"),
        ("SELECT v_f, count(*) AS n FROM optimal GROUP BY v_f HAVING n > 1 AND v_f > 10", "v_f,n\n100.0,3\n"),
        ("SELECT strategy AS s, count(*) AS n FROM optimal GROUP BY s HAVING s = 'speed_up'", "s,n\nspeed_up,2\n"),
        ("SELECT v_f, count(*) AS n FROM optimal GROUP BY 1 HAVING count(*) > 1", "v_f,n\n100.0,3\n"),
        ("SELECT t_f, max(work) AS work FROM optimal GROUP BY t_f HAVING work > 1e9", "t_f,work\n"),
    ] {
        let found = ask(question);
        assert!(found.starts_with(answer), "{question}: {found}");
    }
    for (question, found) in [
        ("SELECT sum(1) FROM best_cubic", "`sum(1)`: no column in it"),
        ("SELECT avg(2.5) FROM best_cubic GROUP BY t_f", "`avg(2.5)`: no column in it"),
        (
            "WITH best_cubic AS (SELECT t_f FROM optimal) SELECT * FROM best_cubic",
            "WITH best_cubic: a table has this name",
        ),
        (
            "SELECT count(*) FROM best_cubic b LEFT JOIN optimal o ON b.t_f = o.t_f AND o.t_f < 0.03",
            "ON b.t_f = o.t_f AND o.t_f < 0.03: an outer join compares columns with columns by =",
        ),
        (
            "SELECT count(*) FROM optimal WHERE max(work) > 3",
            "WHERE contains the aggregate `max(work)`, but it selects single rows",
        ),
        ("SELECT avg(work) OVER (ORDER BY t_f) AS x FROM optimal", "`avg(work) OVER (ORDER BY t_f)`: no running `avg`"),
        (
            "SELECT avg(work) OVER w AS x FROM optimal WINDOW w AS (ORDER BY t_f)",
            "`avg(work) OVER w`: no running `avg`",
        ),
        (
            "SELECT t_f, count(*) OVER (PARTITION BY v_f) AS x FROM optimal GROUP BY t_f, v_f",
            "`count(*) OVER (PARTITION BY v_f)`: OVER and GROUP BY in one SELECT",
        ),
        (
            "SELECT upper(status), length(status), count(*) FROM optimal GROUP BY upper(status), length(status)",
            "two keys of GROUP BY are functions of one column",
        ),
        (
            "SELECT b.t_f FROM best_cubic b SEMI JOIN optimal o ON b.t_f = o.t_f",
            "a part of the query is not supported, such as EXISTS, SEMI JOIN or a subquery in an expression",
        ),
    ] {
        let (code, message) = refused(folder.path(), &["query", "results/test", question]);
        assert!(code == 1 && message.starts_with(&format!("error: {found}\n")), "{question}: {message}");
    }
    // Lists go to JSON alone, and numbers that JSON has not are words.
    let lists = "SELECT v_f, array_agg(t_f) AS all_of FROM best_cubic GROUP BY v_f";
    for file in ["x.parquet", "x.csv"] {
        let (code, message) = refused(folder.path(), &["query", "results/test", lists, "--out", file]);
        assert!(
            code == 2 && message.contains("column `all_of` holds lists") && !message.contains("damaged"),
            "{message}"
        );
    }
    let json = printed(folder.path(), &["query", "results/test", lists, "--format", "jsonl"]);
    assert_eq!(json, "{\"v_f\":100.0,\"all_of\":[0.02,0.037,0.049]}\n");
    let infinite = "SELECT 1.0 / (t_f - t_f) AS x FROM best_cubic LIMIT 1";
    assert_eq!(printed(folder.path(), &["query", "results/test", infinite, "--format", "jsonl"]), "{\"x\":\"inf\"}\n");
}

#[test]
fn rows_without_numbers_lead_to_rows_with_numbers() {
    let folder = landscape();
    let head = printed(folder.path(), &["head", "results/test", "gap", "-n", "3"]);
    let (_, query) = head.split_once("  rows with numbers, if any: slipsweep query results/test \"").expect("a hint");
    let answer = printed(folder.path(), &["query", "results/test", query.trim_end().trim_end_matches('"')]);
    assert_eq!((answer.lines().count(), answer.matches(" ok").count()), (5, 3), "{answer}");
    assert!(!printed(folder.path(), &["head", "results/test", "optimal"]).contains("rows with numbers"));
}

#[test]
fn regress_a_part_in_the_place_of_another_is_refused() {
    let folder = landscape();
    let part = |number: u32| folder.path().join(format!("results/test/gap/part-00000{number}.parquet"));
    fs::copy(part(0), part(1)).expect("is writable");
    let commands: [&[&str]; 4] = [
        &["trace", "results/test", "gap", "--row", "400000"],
        // It checks the other parts.
        &["verify", "results/test", "--sample", "9"],
        &["summary", "results/test"],
        &["head", "results/test", "gap"],
    ];
    for command in commands {
        let output = slipsweep(folder.path(), command);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), output.stdout.is_empty()), (Some(2), command[0] != "verify"), "{command:?}");
        assert!(
            message.contains("it belongs to another place, sweep, version or numerics revision"),
            "{command:?}: {message}"
        );
    }
}

#[test]
fn regress_nulls_are_where_the_rules_put_them() {
    let folder = tempfile::tempdir().expect("is writable");
    fs::write(folder.path().join("w.csv"), "g,x,y\na,3,1\na,,2\na,1,3\nb,2,4\nb,,5\n").expect("is writable");
    for (question, answer) in [
        ("SELECT y, row_number() OVER (PARTITION BY g ORDER BY x) AS r FROM w", "y,r\n1,2\n2,3\n3,1\n4,1\n5,2\n"),
        ("SELECT y, row_number() OVER (PARTITION BY g ORDER BY x DESC) AS r FROM w", "y,r\n1,2\n2,1\n3,3\n4,2\n5,1\n"),
        (
            "SELECT y, row_number() OVER u AS r FROM w WINDOW u AS (PARTITION BY g ORDER BY x DESC NULLS LAST) QUALIFY r = 1",
            "y,r\n1,1\n4,1\n",
        ),
        ("SELECT y, sum(y) OVER (PARTITION BY g ORDER BY y DESC) AS s FROM w", "y,s\n1,6\n2,5\n3,3\n4,9\n5,5\n"),
        ("SELECT count(*) FROM w WHERE (x > 1) IS NOT TRUE", "count\n3\n"),
        ("SELECT count(*) FROM w WHERE (x > 1) IS NOT FALSE", "count\n4\n"),
        ("SELECT count(*) FROM w WHERE x IN (SELECT max(x) FROM w)", "count\n1\n"),
    ] {
        assert_eq!(printed(folder.path(), &["query", "w.csv", question, "--format", "csv"]), answer, "{question}");
    }
}

/// A unit comes from a column, not from its name.
#[test]
fn regress_units_of_subqueries() {
    let folder = small();
    for (question, units) in [
        ("SELECT m, 1 AS n FROM (SELECT min(work) AS m FROM optimal) AS x", "mu_0 sigma l"),
        ("SELECT x.t_f, x.work FROM (SELECT t_f * 1000 AS t_f, work FROM optimal) AS x", "mu_0 sigma l"),
        (
            "WITH t AS (SELECT v_f AS t_f, ln(work) AS work FROM optimal) SELECT t_f, min(work) FROM t GROUP BY t_f",
            "v_0",
        ),
        ("SELECT v_f, t_f FROM optimal UNION ALL SELECT v_i, work FROM optimal", "v_0"),
        ("SELECT b.*, o.work AS least FROM best_cubic b JOIN optimal o ON b.t_f = o.t_f", "l/v_0 mu_0 mu_0 v_0 v_0"),
        ("SELECT * REPLACE (t_f * 2 AS t_f) FROM optimal", "mu_0 mu_0 v_0 v_0 v_0"),
        ("SELECT * FROM optimal UNION ALL SELECT * FROM optimal", "l/v_0 mu_0 mu_0 v_0 v_0"),
        ("SELECT t_f, COLUMNS('v_[if]') FROM optimal UNION ALL SELECT t_f, v_f, work FROM optimal", "0.02 3 100"),
    ] {
        let answer = printed(folder.path(), &["query", "results/test", question]);
        let line = answer.lines().nth(1).unwrap_or_default();
        let found = line.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(found == units || question.contains('*') && found.starts_with(units), "{question}: {answer}");
    }
}

#[test]
fn files_of_different_columns_are_no_table() {
    let folder = small();
    fs::create_dir(folder.path().join("mixed")).expect("is writable");
    for (question, file) in
        [("SELECT t_f, gap AS x FROM best_cubic", "a"), ("SELECT t_f, status AS x FROM best_cubic", "b")]
    {
        printed(folder.path(), &["query", "results/test", question, "--out", &format!("mixed/{file}.parquet")]);
    }
    for question in ["SELECT count(*) FROM mixed WHERE x > 5", "SELECT count(x) FROM mixed", "SELECT x FROM mixed"] {
        let (code, message) = refused(folder.path(), &["query", "mixed", question]);
        assert!(code == 2 && message.contains("column `x` has the type cat, unlike in the first file"), "{message}");
    }
    assert_eq!(printed(folder.path(), &["query", "mixed", "SELECT count(t_f) FROM mixed"]), "count(t_f)\n6\n");
}

/// A lost manifest leaves a dataset a dataset.
#[test]
fn regress_a_dataset_without_a_manifest_is_read_and_kept() {
    let folder = small();
    fs::remove_file(folder.path().join("results/test/manifest.json")).expect("was there");
    let before = crate::common::files(&folder.path().join("results"));
    let arguments =
        ["query", "results/test", "SELECT * FROM best_cubic", "--out", "results/test/best_cubic/part-000000.parquet"];
    let (code, message) = refused(folder.path(), &arguments);
    assert!(code == 1 && message.contains("which only `slipsweep run` writes"), "{message}");
    for arguments in [vec!["plot", "results/test"], vec!["report", "results/test"], vec!["summary", "results/test"]] {
        let output = slipsweep(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{said}");
        assert!(said.contains("manifest.json is missing"), "{arguments:?}: {said}");
    }
    assert_eq!(crate::common::files(&folder.path().join("results")), before);
    // An answer does not replace the file that it is read from either.
    fs::write(folder.path().join("t.csv"), "t_f\n0.02\n").expect("is writable");
    let (code, message) = refused(folder.path(), &["query", "t.csv", "SELECT * FROM t", "--out", "./t.csv"]);
    assert!(code == 1 && message.contains("would replace the file that it is read from"), "{message}");
}

#[test]
fn nothing_but_the_dataset_is_read_and_nothing_is_written() {
    let folder = small();
    let root = folder.path().display();
    for question in [
        format!("SELECT * FROM read_parquet('{root}/results/test/best_cubic/part-000000.parquet')"),
        format!("SELECT * FROM read_csv('{root}/spec.toml')"),
        "SELECT * FROM read_parquet('http://127.0.0.1:9/x.parquet')".to_owned(),
        format!("SELECT * FROM '{root}/results/test/best_cubic/part-000000.parquet'"),
        "SELECT * FROM best_cubic JOIN read_csv('x.csv') AS x ON best.t_f = x.t_f".to_owned(),
        "DELETE FROM best_cubic".to_owned(),
        "TRUNCATE TABLE best_cubic".to_owned(),
        "CREATE TABLE copy AS SELECT * FROM best_cubic".to_owned(),
        "INSERT INTO best_cubic VALUES (1)".to_owned(),
        "SELECT * INTO copy FROM best_cubic".to_owned(),
        "EXPLAIN SELECT * FROM best_cubic".to_owned(),
        "SHOW TABLES".to_owned(),
        "SELECT * FROM best_cubic; SELECT * FROM best_cubic".to_owned(),
    ] {
        let (code, message) = refused(folder.path(), &["query", "results/test", &question]);
        assert!(code == 1 && message.contains("\n  help: "), "{question}: {message}");
    }
    // No answer replaces a part or a manifest.
    let before = crate::common::files(&folder.path().join("results"));
    for out in
        ["results/test/best_cubic/part-000000.parquet", "results/test/best/other.parquet", "results/test/manifest.json"]
    {
        let format = ["--format", "parquet"];
        let arguments = ["query", "results/test", "SELECT * FROM best_cubic", "--out", out];
        let (code, message) = refused(folder.path(), &[&arguments[..], &format[..]].concat());
        assert!(code == 1 && message.contains("which only `slipsweep run` writes"), "{message}");
    }
    assert_eq!(crate::common::files(&folder.path().join("results")), before);
}

#[test]
fn what_is_too_much_is_an_error() {
    let folder = small();
    // A cell longer than the widths of formats.
    let long = "SELECT string_agg(status, ',') AS x FROM best_cubic a CROSS JOIN best_cubic b CROSS JOIN best_cubic c CROSS JOIN best_cubic d CROSS JOIN best_cubic e \
                CROSS JOIN best_cubic f CROSS JOIN best_cubic g CROSS JOIN best_cubic h CROSS JOIN best_cubic i CROSS JOIN best_cubic j";
    let answered =
        slipsweep(folder.path(), &["query", "results/test", &long.replace("string_agg(status", "string_agg(a.status")]);
    let text = String::from_utf8_lossy(&answered.stdout).into_owned();
    assert!(answered.status.code() == Some(0) && text.len() > 65_535, "{answered:?}");
    // Thousands of terms are answered, or refused with a message.
    let terms = format!("SELECT gap + {} AS x FROM best_cubic", vec!["1"; 30_000].join(" + "));
    let output = slipsweep(folder.path(), &["query", "results/test", &terms]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    match output.status.code() {
        Some(0) => assert!(said.is_empty()),
        Some(2) => assert!(said.starts_with("error: the query ") && said.contains("\n  help: "), "{said}"),
        other => panic!("{other:?}: {said}"),
    }
}

#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_not_there_is_an_error() {
    let folder = landscape();
    // 10^11 rows in 4 GB.
    let command = format!(
        "ulimit -v 4000000; {} query results/test 'SELECT a.gap, b.gap FROM gap a CROSS JOIN gap b ORDER BY a.gap' --out x.csv",
        env!("CARGO_BIN_EXE_slipsweep")
    );
    let output = Command::new("sh").arg("-c").arg(command).current_dir(folder.path()).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(2) && said.starts_with("error: ") && said.contains("\n  help: "), "{said}");
    let left = fs::read_dir(folder.path()).expect("is readable").map(|entry| entry.expect("is readable").file_name());
    let left: Vec<_> =
        left.map(|name| name.to_string_lossy().into_owned()).filter(|name| name.contains("x.csv")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[cfg(unix)]
#[test]
fn a_query_that_is_stopped_leaves_no_file() {
    let folder = landscape();
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let question = "SELECT a.gap, b.gap AS other FROM gap a JOIN gap b ON a.t_f = b.t_f";
        let mut child = Command::new(env!("CARGO_BIN_EXE_slipsweep"))
            .current_dir(folder.path())
            .args(["query", "results/test", question, "--out", "x.csv"])
            .stderr(Stdio::piped())
            .spawn()
            .expect("runs");
        let is_ours = |name: &str| name.contains("x.csv");
        let files = || -> Vec<String> {
            let entries = fs::read_dir(folder.path()).expect("is readable");
            let names = entries.map(|entry| entry.expect("is readable").file_name().to_string_lossy().into_owned());
            names.filter(|name| is_ours(name)).collect()
        };
        let start = std::time::Instant::now();
        while files().is_empty() && start.elapsed().as_secs() < 30 {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        assert_eq!(files().len(), 1, "has begun");
        let sent = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status().expect("runs");
        assert!(sent.success());
        assert_eq!(child.wait().expect("ends").code(), Some(code));
        assert_eq!(files(), Vec::<String>::new(), "{signal}");
    }
}

#[test]
fn answers_have_units_and_files_that_are_half_are_refused() {
    let folder = small();
    let answer = printed(
        folder.path(),
        &["query", "results/test", "SELECT t_f, max(work), count(*) FROM optimal GROUP BY t_f ORDER BY t_f"],
    );
    let lines: Vec<Vec<&str>> = answer.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(lines[0], ["t_f", "max(work)", "count"]);
    assert_eq!(lines[1], ["l/v_0", "mu_0", "sigma", "l"]);
    assert_eq!(lines.len(), 5);
    fs::write(folder.path().join("half.csv"), "# made by hand\nname,x\n\"a,1\nb,2\n").expect("is writable");
    let (code, message) = refused(folder.path(), &["query", "half.csv", "SELECT * FROM half"]);
    assert!(code == 2 && message.contains("line 3: a quote is not closed"), "{message}");
    fs::write(folder.path().join("dates.csv"), "# made by hand\nday,x\n2024-02-30,1\n2024-03-01,2\n")
        .expect("is writable");
    let answer = printed(folder.path(), &["query", "dates.csv", "SELECT sum(x) AS x FROM dates", "--format", "csv"]);
    assert_eq!(answer, "x\n3\n");
}

/// A word has no number, and a table with semicolons is not CSV here.
#[test]
fn regress_words_have_no_number_and_columns_end_with_commas() {
    let folder = small();
    let (code, said) =
        refused(folder.path(), &["query", "results/test", "SELECT CAST(strategy AS INT) AS n FROM optimal"]);
    assert!(code > 0 && said.contains("speed_up") && !said.contains("Deprecation"), "{said}");
    fs::write(folder.path().join("log.csv"), "time;velocity\n1,5;2,5\n").expect("is writable");
    for arguments in [&["head", "log.csv"][..], &["query", "log.csv", "SELECT * FROM log"]] {
        let (code, said) = refused(folder.path(), arguments);
        assert!(code > 0 && said.contains("columns that end with ; or a tab"), "{said}");
    }
}
