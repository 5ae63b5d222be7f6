//! `slipsweep verify`: a sound dataset passes, a planted error is found and named, and unchecked rows are reported.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use arrow_array::{Float64Array, RecordBatch};

use crate::common::{batch, run, sweep, write_batch};
use slipsweep::dataset::Folder;
use slipsweep::sweep::Sweep;

const AXES: &str = "t_f = [0.02, 0.3, 0.41]\na = 0.03\nb = [0.01, 0.03, 0.05]\nv_i = 3.0\nv_f = [100.0, 2.0]\n\
                    alpha_2 = { linspace = [-0.2, 0.2, 3], unit = \"1/t_f\" }\nalpha_3 = 0.0\ntau_ceiling = 1.6\nk = [0.01, 0.03]\nm = 1e-5\n";

const TABLES: &str =
    "[tables.gap]\n[tables.best_cubic]\n[tables.optimal]\n[tables.crossover]\n[tables.shortcut]\n[tables.stability]\n";

fn verify(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
    command.arg("verify").arg("test").args(arguments).current_dir(folder).output().expect("runs")
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn a_sound_dataset_passes() {
    let folder = tempfile::tempdir().expect("is writable");
    run(&sweep(folder.path(), AXES, TABLES), folder.path(), 2);
    let output = verify(folder.path(), &["--sample", "1000"]);
    assert_eq!(output.status.code(), Some(0), "{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
    for table in [
        "gap: 54 rows",
        "best_cubic: 18 rows",
        "optimal: 18 rows",
        "crossover: 6 rows",
        "shortcut: 72 rows",
        "stability: 12 rows",
    ] {
        assert!(text(&output).contains(table), "{}", text(&output));
    }
    // The same seed draws the same rows, another seed others.
    let sample = |seed| text(&verify(folder.path(), &["--sample", "5", "--seed", seed]));
    assert_eq!(sample("1"), sample("1"));
    assert_ne!(sample("1"), sample("2"));
}

/// Changes one value of a column by 1e-7 of itself, in the first row that has one, and returns the row.
fn corrupt(folder: &Path, table: &str, column: &str) -> usize {
    change(folder, table, column, 1.0 + 1e-7)
}

/// Multiplies one value of a column, in the first row that has one, and returns the row.
fn change(folder: &Path, table: &str, column: &str, factor: f64) -> usize {
    let path = Folder::new(folder, "test").part(table, 0);
    let rows = batch(&path);
    // `best_cubic` has result columns of the same names as axes: none of those is used here.
    let place = rows.schema().index_of(column).expect("is there");
    let mut values: Vec<Option<f64>> = rows.column(place).as_primitive::<Float64Type>().iter().collect();
    let row = values.iter().position(Option::is_some).expect("has a value");
    values[row] = values[row].map(|value| value * factor);
    let mut columns = rows.columns().to_vec();
    columns[place] = Arc::new(Float64Array::from(values));
    write_batch(&path, &RecordBatch::try_new(rows.schema(), columns).expect("is a table"));
    row
}

#[test]
fn a_planted_error_is_found_and_named() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, TABLES);
    for (table, column) in [
        ("gap", "work"),
        ("gap", "v_min"),
        ("gap", "work_optimal"),
        ("best_cubic", "work"),
        ("optimal", "work"),
        ("optimal", "v_start"),
        ("optimal", "v_end"),
        ("optimal", "hamiltonian"),
        ("optimal", "theta_max"),
        ("crossover", "t_cross"),
        ("crossover", "work_at_t_cheapest"),
        ("crossover", "t_min"),
        ("shortcut", "alpha"),
        ("shortcut", "work"),
        ("shortcut", "v_max"),
        ("shortcut", "friction_max"),
        ("stability", "k_c_f"),
        ("stability", "growth_rate"),
        ("stability", "frequency"),
    ] {
        run(&sweep, folder.path(), 2);
        let row = corrupt(folder.path(), table, column);
        let output = verify(folder.path(), &["--sample", "1000"]);
        assert_eq!(output.status.code(), Some(3), "{table}.{column}: {}", text(&output));
        let text = text(&output);
        let section = text.split("\n\n").find(|section| section.starts_with(table)).expect("has a section");
        assert!(section.contains(&format!("row {row}: ")), "{table}.{column}: {section}");
        let line = section.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        let line = line.into_iter().find(|cells| cells.first() == Some(&column)).expect("has the column");
        assert!(line[4].parse::<f64>().is_ok_and(|greatest| greatest > 10.0), "{table}.{column}: {section}");
        fs::remove_file(Folder::new(folder.path(), "test").part(table, 0)).expect("is there");
    }
}

/// Decelerations with a window without hold, and members that do not exist for each of their reasons.
const EDGES: &str = "t_f = [1e-4, 1e-3, 0.02, 0.3]\na = 0.03\nb = [0.01, 0.03, 0.05]\nv_i = 3.0\n\
                     v_f = [2.98, 3.0, 30.0]\ntau_ceiling = [0.9, 1.2, 3.0, inf]\n";

#[test]
fn windows_and_missing_members_are_decided_again() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(
        folder.path(),
        EDGES,
        "[tables.crossover]\n[tables.shortcut]\ncolumns = [\"alpha\", \"work\", \"bound\"]\n",
    );
    run(&sweep, folder.path(), 2);
    let output = verify(folder.path(), &["--sample", "10000"]);
    assert_eq!(output.status.code(), Some(0), "{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
    let text_of = |table: &str, output: &Output| {
        let text = text(output);
        text.split("\n\n").find(|section| section.starts_with(table)).expect("has a section").to_owned()
    };
    assert!(text_of("crossover", &output).contains("t_free_out"), "{}", text(&output));
    assert!(text_of("shortcut", &output).contains("status"), "{}", text(&output));
    for (table, column, factor, blamed) in
        [("crossover", "t_free_in", 1.0 + 1e-7, "t_free_in"), ("shortcut", "t_f", 1e3, "status")]
    {
        let part = Folder::new(folder.path(), "test").part(table, 0);
        let sound = fs::read(&part).expect("is there");
        change(folder.path(), table, column, factor);
        let output = verify(folder.path(), &["--sample", "10000"]);
        assert_eq!(output.status.code(), Some(3), "{table}.{column}: {}", text(&output));
        let section = text_of(table, &output);
        let line = section.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        let line = line.into_iter().find(|cells| cells.first() == Some(&blamed)).expect("has the column");
        assert!(line[4].parse::<f64>().is_ok_and(|greatest| greatest > 10.0), "{table}.{column}: {section}");
        fs::write(&part, sound).expect("is writable");
    }
}

/// What a run has finished before it was stopped can be audited.
#[test]
fn the_parts_that_are_there_are_audited() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = "t_f = [0.02, 0.03, 0.037]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n\
                alpha_2 = { linspace = [-0.2, 0.2, 500], unit = \"1/t_f\" }\nalpha_3 = { linspace = [0.0, 0.1, 500] }\n";
    run(&sweep(folder.path(), axes, "[tables.gap]\n"), folder.path(), 2);
    fs::remove_file(Folder::new(folder.path(), "test").part("gap", 1)).expect("is there");
    let output = verify(folder.path(), &["--sample", "30"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    assert!(text(&output).contains("their part is missing"), "{}", text(&output));
}

#[test]
fn a_folder_without_a_dataset_is_refused() {
    let folder = tempfile::tempdir().expect("is writable");
    assert_eq!(verify(folder.path(), &[]).status.code(), Some(1));
    run(&sweep(folder.path(), AXES, "[tables.optimal]\n"), folder.path(), 1);
    assert_eq!(verify(folder.path(), &["--sample", "0"]).status.code(), Some(1));
    fs::remove_file(Folder::new(folder.path(), "test").part("optimal", 0)).expect("is there");
    let output = verify(folder.path(), &[]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("part is missing") && message.contains("run the sweep again"), "{message}");
}

/// Steps that settle, and that end on limit cycles, with the shortcut and the optimum on the same springs.
const SPRINGS: &str = "t_f = [0.02, 0.5]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = [100.0, 2.0]\nk = [0.01, 0.1, inf]\n\
                       m = [1e-5, 0.0]\ndt = [1e-3, 0.0]\ndelta_t = 2e-3\n";

#[test]
fn motions_are_followed_again() {
    // Columns besides the changed ones, and the factor of one value of each.
    type Numbers<'a> = &'a [(&'a str, f64)];
    let tables: [(&str, &str, &str, Numbers<'_>); 4] = [
        ("stability", "", "[\"hopf_type\"]", &[("m", 1e-3)]),
        (
            "step_response",
            "rtol = 1e-8",
            "[\"outcome\", \"stick_slip\", \"v_peak\", \"v_trough\", \"t_peak\", \"settling_time\", \"period\", \"cycle_peak\", \
             \"cycle_trough\", \"first_lyapunov_coefficient\"]",
            &[
                ("v_peak", 1.0 + 1e-6),
                ("v_trough", 1.0 + 1e-5),
                ("t_peak", 1.0 + 1e-6),
                ("settling_time", 1.0 + 1e-4),
                ("period", 1.0 + 1e-6),
                ("cycle_peak", 1.0 + 1e-6),
                ("cycle_trough", 1.0 + 1e-5),
                ("first_lyapunov_coefficient", 1.0 + 1e-6),
            ],
        ),
        (
            "compliant",
            "",
            "[\"v_c_min\", \"v_c_max\", \"amplification\", \"sampling_error\", \"open_loop_error\"]",
            &[
                ("v_c_min", 1.0 + 1e-7),
                ("v_c_max", 1.0 + 1e-7),
                ("amplification", 1.0 + 1e-7),
                ("sampling_error", 1.0 + 1e-3),
                ("open_loop_error", 1e9),
            ],
        ),
        (
            "regularised",
            "",
            "[\"work\", \"gap\", \"v_min\", \"v_max\", \"v_c_min\", \"v_c_max\"]",
            &[
                ("work", 1.0 + 1e-7),
                ("gap", 1.0 + 1e-6),
                ("v_min", 1.0 + 1e-7),
                ("v_max", 1.0 + 1e-7),
                ("v_c_min", 1.0 + 1e-7),
                ("v_c_max", 1.0 + 1e-7),
            ],
        ),
    ];
    for (table, rtol, columns, changed) in tables {
        let folder = tempfile::tempdir().expect("is writable");
        run(
            &sweep(folder.path(), SPRINGS, &format!("[tables.{table}]\n{rtol}\ncolumns = {columns}\n")),
            folder.path(),
            2,
        );
        let output = verify(folder.path(), &["--sample", "1000"]);
        assert_eq!(output.status.code(), Some(0), "{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
        for (column, factor) in changed {
            change(folder.path(), table, column, *factor);
        }
        let output = verify(folder.path(), &["--sample", "1000"]);
        assert_eq!(output.status.code(), Some(3), "{table}: {}", text(&output));
        for (column, _) in changed {
            let blamed = if *column == "m" { "hopf_type" } else { column };
            let text = text(&output);
            let mut lines = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
            let line = lines.find(|cells| cells.first() == Some(&blamed)).expect("has the column");
            assert!(line[4].parse::<f64>().is_ok_and(|greatest| greatest > 10.0), "{table}.{column}: {text}");
        }
    }
}

/// Two landscapes with finite gaps and one without, in odd units.
const LANDSCAPES: &str = "alpha_3 = { linspace = [-0.5, 0.5, 41], unit = \"1/t_f^2\" }\nt_f = [2e-5, 40.0]\na = 0.003\nb = 0.005\n\
                          v_i = 3e-9\nv_f = [100e-9, 2e-9]\nalpha_2 = { linspace = [-0.5, 0.5, 43], unit = \"1/t_f\" }\n\
                          [model]\nunits = \"si\"\nmu_0 = 0.1\nl = 1e-6\nv_0 = 1e-9\nnormal_stress = 1e6\n";

#[test]
fn reduced_landscapes_are_recomputed() {
    let folder = tempfile::tempdir().expect("is writable");
    for (reduce, columns) in [
        ("min", &["shortcuts", "alpha_2", "work", "gap", "v_min"][..]),
        ("quantiles", &["shortcuts", "gap_min", "gap_q25", "gap_max"]),
        ("histogram", &["shortcuts", "below_1e_8", "from_1e_3"]),
    ] {
        let table = format!("gap_{reduce}");
        run(&sweep(folder.path(), LANDSCAPES, &format!("[tables.gap]\nreduce = \"{reduce}\"\n")), folder.path(), 2);
        let output = verify(folder.path(), &[]);
        let said = format!("{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
        assert_eq!(output.status.code(), Some(0), "{said}");
        assert!(said.starts_with(&format!("{table}: 4 rows sampled, rtol 1e-10\n")), "{said}");
        let part = Folder::new(folder.path(), "test").part(&table, 0);
        let sound = fs::read(&part).expect("is there");
        for column in columns {
            // A column that is 0 everywhere cannot be changed by a factor.
            let factor = if column.starts_with("below") { f64::NAN } else { 1.0 + 1e-7 };
            change(folder.path(), &table, column, factor);
            let output = verify(folder.path(), &[]);
            assert_eq!(output.status.code(), Some(3), "{table}.{column}: {}", text(&output));
            let line = text(&output).lines().any(|line| line.contains(&format!(": {column} differs by ")));
            assert!(line, "{table}.{column}: {}", text(&output));
            fs::write(&part, &sound).expect("is writable");
        }
        fs::remove_dir_all(folder.path().join("test")).expect("is there");
    }
}

#[test]
fn regress_coefficients_in_a_file_of_points_are_not_relative() {
    let folder = tempfile::tempdir().expect("is writable");
    let points = "t_f,a,b,v_i,v_f,alpha_2,alpha_3\n0.02,0.03,0.05,3,100,0.1,0.2\n0.03,0.03,0.05,3,100,0.1,0.2\n";
    fs::write(folder.path().join("cases.csv"), points).expect("is writable");
    let spec = folder.path().join("spec.toml");
    fs::write(&spec, "name = \"test\"\npoints = \"cases.csv\"\n[tables.gap]\n[tables.best_cubic]\n")
        .expect("is writable");
    run(&Sweep::load(&spec).expect("is legal"), folder.path(), 1);
    let output = verify(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
}
