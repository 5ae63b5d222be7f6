//! `slipsweep trace` as a user meets it: words, files, pipes, exit codes.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use slipsweep::protocol::shortcut;
use slipsweep::trace::COLUMNS;

const UP: &[&str] = &["--t-f", "0.02", "--a", "0.03", "--b", "0.05", "--v-i", "3", "--v-f", "100"];
const DOWN: &[&str] = &["--t-f", "0.39", "--a", "0.03", "--b", "0.05", "--v-i", "100", "--v-f", "3"];

fn command(folder: &Path, arguments: &[&[&str]]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
    command.current_dir(folder).arg("trace").args(arguments.concat());
    command
}

fn trace(folder: &Path, arguments: &[&[&str]]) -> Output {
    command(folder, arguments).output().expect("runs")
}

/// Standard output of a trace that succeeds without a word of complaint.
fn shown(arguments: &[&[&str]]) -> String {
    let output = trace(Path::new("."), arguments);
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""));
    String::from_utf8(output.stdout).expect("is text")
}

/// The rows of a trace as CSV, without the comments above them.
fn csv(arguments: &[&[&str]]) -> String {
    let text = shown(&[arguments, &[&["--format", "csv"]]].concat());
    text.lines().filter(|line| !line.starts_with('#')).fold(String::new(), |text, line| text + line + "\n")
}

/// First line of the complaint of a trace that fails, with its exit code.
fn complaint(arguments: &[&[&str]]) -> (Option<i32>, String) {
    let output = trace(Path::new("."), arguments);
    assert!(output.stdout.is_empty());
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), text.lines().next().unwrap_or_default().to_owned())
}

#[test]
fn a_table_names_its_columns_and_units() {
    let text = shown(&[&["optimal"], UP]);
    let head = "optimal: least work of friction of all protocols; v may jump at both ends\n  \
                at t_f = 0.02, a = 0.03, b = 0.05, v_i = 3, v_f = 100\n  \
                hamiltonian = 2.59678653: dW*/dt_f\n  \
                time_at_floor = 0: time spent on the velocity floor v = v_0\n  \
                work = 3.80811142, v_min = 19.9230141, v_max = 3392.16787\n  \
                status ok\n  \
                117 rows; linear interpolation errs by up to 0.0001 of the range of a column, and by up to 0.01 of v and theta\n\n  \
                t               v           theta         tau          beta\n  \
                l/v_0           v_0         l/v_0         mu_0 sigma   mu_0 sigma v_0\n  \
                0               3           0.333333333   0.978027754  -\n  \
                0               19.9230141  0.333333333   1.03482565   -3.19447696\n";
    assert!(text.starts_with(head), "{text}");
    assert!(text.ends_with("\n  0.02            100         0.01          0.907896596  -\n"), "{text}");
    let below = shown(&[&["cubic"], &["--t-f", "0.5"], &DOWN[2..]]);
    assert!(
        below.contains("  status below_bound: v < 1 somewhere, outside the range of the friction law\n"),
        "{below}"
    );
}

#[test]
fn csv_reads_back_the_same_numbers_and_parquet_too() {
    let folder = tempfile::tempdir().expect("is writable");
    for name in ["optimal", "best_cubic", "bounded_velocity", "compliant"] {
        let csv = csv(&[&[name], UP, &["--out", "-"]]);
        let output = trace(folder.path(), &[&[name], UP, &["--out", "trace.parquet"]]);
        assert_eq!(output.status.code(), Some(0));
        assert!(String::from_utf8_lossy(&output.stdout).ends_with("\nwritten to trace.parquet\n"));
        let extra = match name {
            "optimal" => "beta",
            "compliant" => "v_c",
            _ => "",
        };
        let columns: Vec<_> =
            COLUMNS.iter().filter(|column| column.name == extra || !["v_c", "beta"].contains(&column.name)).collect();
        let mut lines = csv.lines();
        let names: Vec<&str> = columns.iter().map(|column| column.name).collect();
        assert_eq!(lines.next(), Some(names.join(",").as_str()));
        let rows: Vec<Vec<Option<f64>>> =
            lines.map(|line| line.split(',').map(|cell| cell.parse().ok()).collect()).collect();

        let file = File::open(folder.path().join("trace.parquet")).expect("is there");
        let builder = ParquetRecordBatchReaderBuilder::try_new(file).expect("is Parquet");
        let schema = builder.schema().clone();
        for (field, column) in schema.fields().iter().zip(columns) {
            assert_eq!(field.name(), column.name);
            assert_eq!(field.metadata()["description"], column.doc);
            assert!(!field.metadata()["unit"].is_empty());
            assert_eq!(field.is_nullable(), column.name == "beta");
        }
        let entries = builder.metadata().file_metadata().key_value_metadata().cloned().unwrap_or_default();
        let entry = |key: &str| {
            let found = entries.iter().find(|entry| entry.key == format!("slipsweep.{key}"));
            found.and_then(|entry| entry.value.clone()).unwrap_or_default()
        };
        assert_eq!(["protocol", "t_f", "v_f", "rtol"].map(entry), [name, "0.02", "100.0", "1e-10"]);
        assert_eq!((entry("version"), entry("status")), (env!("CARGO_PKG_VERSION").to_owned(), "ok".to_owned()));
        let batches: Vec<_> = builder.build().expect("is readable").collect::<Result<_, _>>().expect("is readable");
        assert_eq!(batches.len(), 1);
        for (place, values) in batches[0].columns().iter().enumerate() {
            let found: Vec<Option<f64>> = values.as_primitive::<Float64Type>().iter().collect();
            assert_eq!(found, rows.iter().map(|row| row[place]).collect::<Vec<_>>(), "{name} {place}");
        }
        // Parquet to a pipe is the same file.
        let piped = trace(folder.path(), &[&[name], UP, &["--format", "parquet"]]);
        assert_eq!(piped.stdout, fs::read(folder.path().join("trace.parquet")).expect("is there"));
    }
    assert_eq!(fs::read_dir(folder.path()).expect("is readable").count(), 1);
}

#[test]
fn regress_pulses_whose_durations_do_not_sum_to_the_duration_are_traced() {
    let pulses = ["--law", "prz", "--t-f", "1.3", "--a", "0.03", "--b", "0.05", "--v-i", "3", "--v-f", "3.1"];
    let csv = csv(&[&["optimal", "--v-ceiling", "1000"], &pulses]);
    let rows: Vec<&str> = csv.lines().skip(1).collect();
    assert!(rows.len() > 100 && rows.len() < 1000, "{}", rows.len());
    assert!(rows.last().is_some_and(|row| row.starts_with("1.3,3.1,")), "{csv}");
}

#[test]
fn points_are_equally_spaced() {
    let csv = csv(&[&["step"], UP, &["--points", "3"]]);
    let times: Vec<&str> = csv.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    assert_eq!(times, ["0.0", "0.0", "0.01", "0.02"]);
}

#[test]
fn coefficients_are_scaled_with_the_duration() {
    let free = csv(&[&["gap"], UP, &["--alpha-2", "-0.12", "--alpha-3", "-0.068"]]);
    let start: Vec<f64> =
        free.lines().nth(2).expect("has rows").split(',').map(|cell| cell.parse().expect("is a number")).collect();
    // v = (1 - theta')/theta with theta' = -0.12/t_f.
    assert!((start[1] - 3.0 * (1.0 + 0.12 / 0.02)).abs() < 1e-12, "{start:?}");
}

#[test]
fn what_does_not_exist_states_which_bound() {
    let t_min = "0.3954147722546";
    for name in ["optimal", "best_cubic", "bounded_velocity", "compliant"] {
        let (code, text) = complaint(&[&[name], DOWN]);
        assert!(code == Some(1) && text.starts_with(&format!("error: no `{name}` protocol: ")), "{text}");
        assert!(text.contains(&format!("the least is t_min = {t_min}")), "{text}");
    }
    let low = complaint(&[&["bounded_friction", "--tau-ceiling", "0.9"], UP]);
    let expected = "error: no `bounded_friction` protocol: tau_ceiling must be above the friction of both ends, 0.978";
    assert!(low.0 == Some(1) && low.1.starts_with(expected), "{low:?}");
    let steep = complaint(&[&["gap", "--alpha-2", "3", "--alpha-3", "0"], UP]);
    let expected = "error: no `gap` protocol: v or theta would not stay positive";
    assert_eq!(steep, (Some(1), expected.to_owned()));
}

#[test]
fn wrong_arguments_get_one_clear_message() {
    const FROM: &str = "error: invalid value 'theta=0.3' for '--from <STATE>': expected theta=THETA,t_left=TIME";
    let cases: [(&[&[&str]], &str); 15] = [
        (&[&["optimal", "--t-f", "1"]], "error: `optimal` needs --a, --b, --v-i, --v-f"),
        (&[&["cubic", "--tau-ceiling", "2"], UP], "error: `cubic` takes no --tau-ceiling"),
        (&[&["cubic", "--disturb", "theta=+10% at 0.25"], UP], "error: `cubic` takes no --disturb"),
        (&[&["optimal", "--from", "theta=0.3"], &UP[2..6], &UP[8..]], FROM),
        (&[&["cubic", "--friction", "regularised"], UP], "error: `cubic` does not support regularised friction"),
        (
            &[&["optimal", "--friction", "regularised", "--law", "slip"], UP],
            "error: regularised friction takes no --law",
        ),
        (
            &[&["optimal", "--friction", "Log"], UP],
            "error: invalid value 'Log' for '--friction <FORM>': expected log, regularised",
        ),
        (&[&["cubic", "--unbounded"], UP], "error: `cubic` takes no --unbounded"),
        (&[&["gap", "--alpha-2", "0"], UP], "error: `gap` needs --alpha-3"),
        (
            &[&["optimal", "--t-f", "-1"], &UP[2..]],
            "error: invalid value '-1' for '--t-f <T>': expected 1e-20 <= t_f <= 1e20, in units of l/v_0",
        ),
        (
            &[&["optimal", "--t-f", "soon"], &UP[2..]],
            "error: invalid value 'soon' for '--t-f <T>': not a number; expected 1e-20 <= t_f <= 1e20, in units of l/v_0",
        ),
        (
            &[&["optimal", "--rtol", "1"], UP],
            "error: invalid value '1' for '--rtol <R>': expected 1e-13 <= rtol <= 1e-2",
        ),
        (
            &[&["optimal", "--points", "1"], UP],
            "error: invalid value '1' for '--points <N>': expected a whole number from 2 to 10000000",
        ),
        (&[&["optimum"], UP], "error: invalid value 'optimum' for '<PROTOCOL|DATASET>'"),
        (&[&["optimal", "--out", "x.dat"], UP], "error: --out x.dat: the ending is none of .csv, .parquet, .txt"),
    ];
    for (arguments, expected) in cases {
        assert_eq!(complaint(arguments), (Some(1), expected.to_owned()));
    }
}

#[test]
fn help_lists_every_protocol_with_its_meaning() {
    let text = shown(&[&["--help"]]);
    for (name, doc) in slipsweep::trace::names() {
        assert!(text.lines().any(|line| line.contains(&format!("- {name}:")) && line.ends_with(doc)), "{name}\n{text}");
    }
    assert!(shortcut::FAMILIES.iter().all(|family| text.contains(family.name)));
}

#[test]
fn a_reader_that_has_had_enough_is_no_failure() {
    for format in ["table", "csv", "parquet"] {
        let mut child = command(Path::new("."), &[&["optimal"], UP, &["--points", "100000", "--format", format]])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("runs");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("ends");
        assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0), "{format}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure_and_devices_stay_what_they_are() {
    use std::os::unix::fs::FileTypeExt;

    let full = "error: /dev/full: cannot write: No space left on device (os error 28)";
    for format in ["table", "csv", "parquet"] {
        let to_file = complaint(&[&["optimal"], UP, &["--format", format, "--out", "/dev/full"]]);
        assert_eq!(to_file, (Some(2), full.to_owned()));
        let device = File::options().write(true).open("/dev/full").expect("is there");
        let piped = command(Path::new("."), &[&["optimal"], UP, &["--format", format]])
            .stdout(device)
            .stderr(Stdio::piped())
            .output()
            .expect("runs");
        let expected = "error: cannot write to standard output: No space left on device (os error 28)\n";
        assert_eq!((piped.status.code(), String::from_utf8_lossy(&piped.stderr).as_ref()), (Some(2), expected));
    }
    assert!(fs::metadata("/dev/full").expect("is there").file_type().is_char_device());
}

#[test]
fn a_file_is_replaced_whole_or_left_as_it_was() {
    let folder = tempfile::tempdir().expect("is writable");
    let path = folder.path().join("trace.csv");
    fs::write(&path, "before").expect("is writable");
    let absent = trace(folder.path(), &[&["optimal"], DOWN, &["--out", "trace.csv"]]);
    assert_eq!(absent.status.code(), Some(1));
    assert_eq!(fs::read_to_string(&path).expect("is there"), "before");
    let done = trace(folder.path(), &[&["optimal"], UP, &["--out", "trace.csv"]]);
    assert_eq!(done.status.code(), Some(0));
    assert_eq!(fs::read_to_string(&path).expect("is there"), shown(&[&["optimal"], UP, &["--format", "csv"]]));
    let nowhere = complaint(&[&["optimal"], UP, &["--out", "no/such/folder/trace.csv"]]);
    let expected = "error: no/such/folder/trace.csv: cannot write: No such file or directory (os error 2)";
    assert_eq!(nowhere, (Some(2), expected.to_owned()));
}

/// A table of the paper's shortcut on a spring: v within [1e5, 4.31e6], the control negative in between.
#[test]
fn paper_control_of_the_smooth_shortcut_turns_negative() {
    let spring = ["compliant", "--t-f", "3.1e-6", "--a", "0.005", "--b", "0.01", "--v-i", "1e5", "--v-f", "3.2e6"];
    let csv = csv(&[&spring, &["--k", "7.5e-3", "--m", "2.5e-16"]]);
    let column = |place: usize| -> Vec<f64> {
        csv.lines()
            .skip(1)
            .map(|line| line.split(',').nth(place).and_then(|cell| cell.parse().ok()).expect("is a number"))
            .collect()
    };
    let range =
        |values: Vec<f64>| values.into_iter().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    let ((v_min, v_max), (control_min, _)) = (range(column(1)), range(column(4)));
    assert!((v_min / 1e5 - 1.0).abs() < 1e-15);
    assert!((v_max / 4.31e6 - 1.0).abs() < 1e-3 && control_min < -5e5, "{v_max} {control_min}");
    // A rigid spring follows its far end.
    let rigid = self::csv(&[&spring]);
    for line in rigid.lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("is a number")).collect();
        assert!((cells[1] / cells[4] - 1.0).abs() < 1e-14, "{line}");
    }
}

/// The response to a step: overshoot to 6.5585 `v_f`, and no jump of the velocity at either end.
#[test]
fn paper_step_on_a_spring_overshoots() {
    let spring = ["step_response", "--t-f", "1e-5", "--a", "0.005", "--b", "0.01", "--v-i", "1e5", "--v-f", "3.2e6"];
    let text = shown(&[&spring, &["--k", "7.5e-3", "--m", "2.5e-16"]]);
    assert!(text.starts_with(
        "step_response: the control velocity jumps to v_f and stays there; the block on its spring up to t_f\n"
    ));
    let csv = csv(&[&spring, &["--k", "7.5e-3", "--m", "2.5e-16"]]);
    let rows: Vec<Vec<f64>> = csv
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().expect("is a number")).collect())
        .collect();
    let peak = rows.iter().map(|row| row[1]).fold(0.0, f64::max);
    assert!((peak / 3.2e6 - 6.5585).abs() < 1e-3, "{peak}");
    // Before and after the jump of the control velocity the block is the same.
    assert!(rows[0].iter().zip(&rows[1]).take(4).all(|(before, after)| (before - after).abs() <= 1e-15 * before));
    assert_eq!((rows[0][4], rows[1][4]), (1e5, 3.2e6));
    let last = rows.last().expect("has rows");
    assert!(last[0] == 1e-5 && (last[1] / 3.2e6 - 1.0).abs() > 0.01, "{last:?}");
}

/// A step response spans decades: rows that are good to the range of a column alone would make corners on a logarithmic axis. The second one is
/// stick-slip, in which the block is slower than a trillionth of its greatest velocity.
#[test]
fn regress_slow_velocities_are_good_to_a_hundredth_of_themselves() {
    for (case, decades) in [
        ("--t-f 3.1e-6 --a 0.005 --b 0.01 --v-i 1e5 --v-f 3.2e6 --k 7.5e-3 --m 2.5e-16", 3.0),
        ("--t-f 0.1 --a 0.0129 --b 0.01935 --v-i 10 --v-f 1000 --k 8.687e-4 --m 8.06e-17", 12.0),
    ] {
        let rows = |more: &[&str]| -> Vec<Vec<f64>> {
            let csv = csv(&[&["step_response"], &case.split(' ').collect::<Vec<_>>()[..], more]);
            csv.lines()
                .skip(1)
                .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
                .collect()
        };
        let (fewest, spaced) = (rows(&[]), rows(&["--points", "2001"]));
        let (mut slowest, mut fastest) = (f64::INFINITY, 0.0_f64);
        for here in &spaced[2..2001] {
            let next = fewest.partition_point(|row| row[0] < here[0]);
            let (from, to) = (&fewest[next - 1], &fewest[next]);
            let fraction = (here[0] - from[0]) / (to[0] - from[0]);
            for column in [1, 2] {
                let line = from[column] + fraction * (to[column] - from[column]);
                assert!((line / here[column] - 1.0).abs() <= 0.01, "{here:?} {line}");
            }
            (slowest, fastest) = (slowest.min(here[1]), fastest.max(here[1]));
        }
        fastest = fewest.iter().map(|row| row[1]).fold(fastest, f64::max);
        assert!(slowest < fastest / 10.0_f64.powf(decades), "{slowest} {fastest}");
    }
}

/// A dataset in SI units with a row of every table that has a path, and one that is infeasible.
fn dataset(folder: &Path) {
    let spec = r#"name = "rows"
[model]
units = "si"
mu_0 = 0.6
l = 1e-6
v_0 = 1e-9
normal_stress = 1e6
[axes]
t_f = [2e1, 3e2]
a = 0.018
b = 0.03
v_i = [3e-9, 1e-7]
v_f = 5e-9
alpha_2 = { linspace = [-0.01, 0.01, 3], unit = "1/t_f" }
alpha_3 = { linspace = [-0.01, 0.01, 3], unit = "1/t_f^2" }
k = 1e11
m = 0.0
delta_t = 1.0
family = ["step", "bounded_velocity"]
[tables.gap]
[tables.optimal]
[tables.best_cubic]
[tables.shortcut]
[tables.compliant]
[tables.regularised]
[tables.step_response]
[tables.crossover]
"#;
    fs::write(folder.join("rows.toml"), spec).expect("is writable");
    let run = Command::new(env!("CARGO_BIN_EXE_slipsweep"))
        .current_dir(folder)
        .args(["run", "rows.toml", "--quiet"])
        .output();
    let run = run.expect("runs");
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
}

/// A row is traced as the protocol that its numbers name, in the units of its dataset.
#[test]
fn a_row_over_time_is_the_protocol_of_its_numbers() {
    let folder = tempfile::tempdir().expect("is writable");
    dataset(folder.path());
    let run = |arguments: &[&str]| trace(folder.path(), &[&["results/rows"], arguments]);
    let text = |output: Output| String::from_utf8(output.stdout).expect("is text");
    for table in ["gap", "optimal", "best_cubic", "shortcut", "compliant", "regularised"] {
        let output = run(&[table, "--row", "0", "--format", "csv"]);
        assert_eq!(output.status.code(), Some(0), "{table}: {}", String::from_utf8_lossy(&output.stderr));
        let found = text(output);
        let fact = |key: &str| {
            let start = format!("# {key} = ");
            found.lines().find_map(|line| line.strip_prefix(&start)).map(str::to_owned)
        };
        assert_eq!(fact("v_i").as_deref(), Some("3e-9"), "{table}: {found}");
        assert_eq!((fact("table").as_deref(), fact("row").as_deref()), (Some(table), Some("0")));
        assert!(fact("units").is_some_and(|units| units.starts_with("s, m/s, s, Pa")), "{found}");
        // It begins at v_i and its work is that of the row.
        let first = found.lines().find(|line| line.starts_with("0.0,")).expect("has rows");
        let v: f64 = first.split(',').nth(1).and_then(|cell| cell.parse().ok()).expect("is a number");
        assert!((v / 3e-9 - 1.0).abs() < 1e-9, "{table}: {first}");
        let part = folder.path().join(format!("results/rows/{table}/part-000000.parquet"));
        let row = slipsweep::dataset::frame::row(&part, 0).expect("is there");
        let work = row.iter().find(|(name, _)| name == "work").map(|(_, cell)| cell.clone());
        let slipsweep::dataset::Cell::Number(work) = work.expect("is a column") else { panic!("{table}: no work") };
        let reported: f64 = fact("work").and_then(|work| work.parse().ok()).expect("is a number");
        assert!((reported / work - 1.0).abs() < 1e-9, "{table}: {reported} {work}");
    }
    let by_words = run(&["optimal", "--where", "t_f=300, v_i=3e-9", "--format", "csv"]);
    assert_eq!(text(by_words), text(run(&["optimal", "--row", "2", "--format", "csv"])));
    let step = text(run(&["step_response", "--row", "0", "--t-f", "100"]));
    assert!(step.contains("t_f = 100 s") && step.contains("row 0 of table step_response of rows"), "{step}");
    // The picture of a CSV names the protocol and its parameters.
    assert_eq!(run(&["optimal", "--row", "0", "--out", "row.csv"]).status.code(), Some(0));
    let plot =
        Command::new(env!("CARGO_BIN_EXE_slipsweep")).current_dir(folder.path()).args(["plot", "row.csv"]).output();
    assert_eq!(plot.expect("runs").status.code(), Some(0));
    let picture = fs::read_to_string(folder.path().join("row.svg")).expect("is there");
    assert!(picture.contains("optimal") && picture.contains("3\u{d7}10") || picture.contains("3e-9"), "no parameters");
}

#[test]
fn a_row_without_a_path_states_why() {
    let folder = tempfile::tempdir().expect("is writable");
    dataset(folder.path());
    let complaint = |arguments: &[&str]| {
        let output = trace(folder.path(), &[&["results/rows"], arguments]);
        assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{arguments:?}");
        String::from_utf8(output.stderr).expect("is text")
    };
    let cases: [(&[&str], &str); 10] = [
        (&[], "error: results/rows: a dataset without a table\n"),
        (&["optimal"], "error: results/rows: which row of `optimal`?\n  expected: --row N, from 0 to 3, or --where"),
        (&["optimal", "--row", "4"], "error: results/rows: no row 4 in `optimal`\n  expected: a row from 0 to 3\n"),
        (
            &["optimal", "--row", "1"],
            "error: results/rows: row 1 of `optimal`: t_f = 20 s is too short for v >= v_0: the least is ",
        ),
        (
            &["optimal", "--where", "t_f>0"],
            "error: results/rows: several rows of `optimal` meet --where \"t_f>0\"\n  found: rows 0, 1, 2, 3\n",
        ),
        (
            &["optimal", "--where", "t_f=7"],
            "error: --where t_f = 7: no row of the table `optimal` meets this\n  found: t_f = ",
        ),
        (&["optimal", "--where", "t_g=7"], "error: --where: the table `optimal` has no column `t_g`\n"),
        (&["optimol", "--row", "1"], "error: results/rows: no table `optimol`\n"),
        (&["crossover", "--row", "0"], "error: a row of table `crossover` has no path over time\n"),
        (
            &["optimal", "--row", "0", "--a", "0.1"],
            "error: --a: not for a row of a dataset, which has its own parameters\n",
        ),
    ];
    for (arguments, expected) in cases {
        let found = complaint(arguments);
        assert!(found.starts_with(expected), "{arguments:?}: {found}");
    }
    // In SI the last time is the duration of the row, to the last digit.
    for t_f in ["2e1", "3e2"] {
        let condition = format!("t_f={t_f}, v_i=3e-9");
        let arguments = ["results/rows", "optimal", "--where", &condition, "--points", "7", "--format", "csv"];
        let output = trace(folder.path(), &[&arguments]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let last = text.lines().last().and_then(|line| line.split(',').next()).and_then(|t| t.parse::<f64>().ok());
        assert_eq!(last, t_f.parse::<f64>().ok(), "{text}");
    }
    // The summary of a table without a feasible row has the reason, too.
    let spec = "name = \"slow\"\n[axes]\nt_f = 1e-3\na = 0.03\nb = 0.05\nv_i = 100.0\nv_f = 3.0\n[tables.optimal]\n";
    fs::write(folder.path().join("slow.toml"), spec).expect("is writable");
    for arguments in [["run", "slow.toml"], ["summary", "results/slow"]] {
        let output = Command::new(env!("CARGO_BIN_EXE_slipsweep"))
            .current_dir(folder.path())
            .args(arguments)
            .output()
            .expect("runs");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(text.contains("  row 0 is infeasible: t_f = 0.001 is too short for v >= 1: the least is "), "{text}");
    }
    assert!(complaint(&["optimal", "--where", "t_f=7"]).contains("\n  help: the nearest rows have --where \"t_f="));
    assert!(complaint(&["optimal", "--where", "t_f>0"]).contains("help: --row 0, or a further condition"));
    assert!(complaint(&["step_response", "--row", "0"]).contains("has no duration of its own\n  help: add --t-f T"));
}

/// The paper's case with theta 10 % up at a quarter of the time: the closed loop arrives, for 0.103 more work.
#[test]
fn a_disturbance_compares_both_loops() {
    let disturbed = |change: &str, more: &[&str]| shown(&[&["optimal", "--disturb", change], UP, more]);
    let text = disturbed("theta=+10% at 0.25", &[]);
    assert!(text.contains("open loop, v(t) as planned: work +0.015604623, terminal_error 0.0873898599\n"), "{text}");
    assert!(text.contains("closed loop, v(theta, t_left): work +0.102887655, terminal_error 0\n"), "{text}");
    // The closed loop ends at theta_f.
    let end = |text: &str| -> f64 {
        let last = text.lines().last().expect("has rows");
        last.split_whitespace().nth(2).expect("has theta").parse().expect("is a number")
    };
    assert_eq!(end(&text), 0.01);
    let open = disturbed("theta=+10% at 0.25", &["--loop", "open"]);
    assert!((end(&open) / 0.01 - 1.0873898599).abs() < 1e-8, "{open}");
    // No disturbance changes nothing.
    let none = disturbed("theta=0% at 0.25", &[]);
    assert!(none.contains("v(theta, t_left): work +0, terminal_error 0\n"), "{none}");
}

/// A disturbed row of a dataset is the disturbed protocol of its numbers, in the units of the dataset.
#[test]
fn a_disturbed_row_has_the_units_of_its_dataset() {
    let folder = tempfile::tempdir().expect("is writable");
    dataset(folder.path());
    let facts = |arguments: &[&str]| {
        let disturb = ["--disturb", "theta=+10% at 0.25", "--loop", "open", "--format", "csv"];
        let output = trace(folder.path(), &[arguments, &disturb]);
        let text = String::from_utf8(output.stdout).expect("is text");
        let number = |key: &str| -> f64 {
            let line = text.lines().find_map(|line| line.strip_prefix(&format!("# {key} = ")));
            line.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("no {key}: {text}"))
        };
        ["disturbed_at", "extra_work", "terminal_error"].map(number)
    };
    let row = facts(&["results/rows", "optimal", "--row", "0"]);
    let scaled = facts(&["optimal", "--t-f", "0.02", "--a", "0.03", "--b", "0.05", "--v-i", "3", "--v-f", "5"]);
    // l/v_0 = 1000 s, mu_0 sigma l = 0.6 J/m^2.
    for ((row, scaled), unit) in row.into_iter().zip(scaled).zip([1e3, 0.6, 1.0]) {
        assert!((row / (scaled * unit) - 1.0).abs() < 1e-9, "{row} {scaled}");
    }
    let text = trace(folder.path(), &[&["results/rows", "optimal", "--row", "0", "--disturb", "theta=+10% at 0.25"]]);
    let text = String::from_utf8(text.stdout).expect("is text");
    assert!(text.contains("at t = 5 s; extra work") && text.contains(" J/m^2, terminal_error "), "{text}");
    let other =
        trace(folder.path(), &[&["results/rows", "best_cubic", "--row", "0", "--disturb", "theta=+10% at 0.25"]]);
    assert!(String::from_utf8_lossy(&other.stderr).starts_with("error: --disturb: "), "{other:?}");
}

/// The rest of an optimal protocol is the optimal protocol from its state.
#[test]
fn a_protocol_from_a_state_is_the_rest_of_the_whole() {
    let from = shown(&[&["optimal", "--from", "theta=0.3333333333333333,t_left=0.02"], &UP[2..6], &UP[8..]]);
    let whole = shown(&[&["optimal"], UP]);
    let work = |text: &str| text.lines().find(|line| line.trim_start().starts_with("work = ")).map(str::to_owned);
    assert_eq!(work(&from), work(&whole));
}

#[test]
fn the_law_is_stated_if_it_is_given() {
    let spring: &[&str] = &["--k", "0.03", "--m", "0", "--points", "2"];
    let laws = |law: &[&str]| {
        let text = shown(&[&["step_response"], UP, spring, law]);
        let csv = shown(&[&["step_response"], UP, spring, law, &["--format", "csv"]]);
        let stated = csv.lines().filter_map(|line| line.strip_prefix("# law = ")).collect::<String>();
        (text.contains(&format!(", law {stated}\n")), stated)
    };
    assert_eq!(laws(&[]), (false, String::new()));
    for law in ["ageing", "slip", "prz"] {
        assert_eq!(laws(&["--law", law]), (true, law.to_owned()));
    }
    let ageing = shown(&[&["optimal"], UP, &["--law", "ageing"]]);
    assert!(ageing.contains("v_f = 100, law ageing\n"), "{ageing}");
}

#[test]
fn ceilings_are_kept_or_named() {
    let capped = shown(&[&["optimal", "--v-ceiling", "300"], UP]);
    assert!(capped.contains("v_max = 300\n") && capped.contains("time_at_v_ceiling = 0.00890981447"), "{capped}");
    let refused = trace(Path::new("."), &[&["optimal", "--v-ceiling", "150"], UP]);
    assert_eq!(refused.status.code(), Some(1));
    // 0.030566449857803817, rounded up.
    assert_eq!(
        String::from_utf8_lossy(&refused.stderr),
        "error: no `optimal` protocol: t_f = 0.02 is too short under these ceilings: the least is 0.0305665\n  \
         help: raise --t-f to at least 0.0305665, or raise the ceilings\n"
    );
    shown(&[&["optimal", "--v-ceiling", "150", "--t-f", "0.0305665"], &UP[2..]]);
}

/// On the border, where theta rises as fast as the law allows, rounded coefficients lie outside of the admissible set.
#[test]
fn regress_a_best_cubic_on_the_border_has_a_trace() {
    let text = shown(&[
        &[
            "best_cubic",
            "--law",
            "slip",
            "--v-ceiling",
            "1e11",
            "--a",
            "0.00696833478195458",
            "--b",
            "0.004695163778909756",
        ],
        &["--v-i", "10.319731237181962", "--v-f", "659.3628922320387", "--t-f", "0.6343788610944021"],
    ]);
    assert!(text.contains("work = 9.25942615, v_min = 2.561544") && text.contains("status ok\n"), "{text}");
}

/// Friction of steady sliding after the protocol is below 0, that on the way is not.
#[test]
fn regress_friction_after_the_protocol_does_not_count() {
    let text = shown(&[
        &[
            "gap",
            "--law",
            "prz",
            "--a",
            "0.066243221839499",
            "--b",
            "0.42895778470710894",
            "--t-f",
            "0.41516991857292784",
        ],
        &["--v-i", "7.996693541709595", "--v-f", "17.057858962737615"],
        &["--alpha-2", "-0.014090279963449685", "--alpha-3", "0.677576172926355"],
    ]);
    assert!(text.contains("status ok\n"), "{text}");
}

/// The comments of a CSV have the units.
#[test]
fn head_and_query_show_the_units_of_a_trace_in_csv() {
    let folder = tempfile::tempdir().expect("is writable");
    assert!(trace(folder.path(), &[&["optimal"], UP, &["--out", "t.csv"]]).status.success());
    for arguments in [&["head", "t.csv", "-n", "1"][..], &["query", "t.csv", "SELECT tau, v AS speed FROM t LIMIT 1"]] {
        let mut program = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
        let output = program.current_dir(folder.path()).args(arguments).output().expect("runs");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && text.contains("mu_0 sigma") && text.contains("v_0"), "{text}{output:?}");
    }
}
