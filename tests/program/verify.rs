//! `slipsweep verify`: a sound dataset passes, a planted error is found and named, and unchecked rows are reported.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, ArrayRef, DictionaryArray, Float64Array, RecordBatch, StringArray};

use crate::common::{batch, run, sweep, write_batch};
use slipsweep::dataset::Folder;
use slipsweep::sweep::Sweep;

const AXES: &str = "t_f = [0.02, 0.3, 0.41]\na = 0.03\nb = [0.01, 0.03, 0.05]\nv_i = 3.0\nv_f = [100.0, 2.0]\n\
                    alpha_2 = { linspace = [-0.2, 0.2, 3], unit = \"1/t_f\" }\nalpha_3 = 0.0\ntau_ceiling = 1.6\nk = [0.01, 0.03]\nm = 1e-5\n";

const TABLES: &str = "[tables.gap]\ncolumns = [\"work\", \"work_optimal\", \"gap\", \"v_min\", \"v_max\"]\n\
     [tables.best_cubic]\ncolumns = [\"alpha_2\", \"alpha_3\", \"work\", \"work_optimal\", \"gap\", \"v_min\", \"v_max\"]\n\
     [tables.optimal]\n[tables.crossover]\n[tables.shortcut]\n[tables.stability]\n";

fn verify(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
    command.arg("verify").arg("test").args(arguments).current_dir(folder).output().expect("runs")
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Whether an answer has a line for a table and its rows.
fn has_rows(output: &Output, table: &str, rows: &str) -> bool {
    text(output).lines().any(|line| line.split_whitespace().take(2).eq([table, rows]))
}

/// Whether an answer reports that a number of a column differs by too much.
fn blames(output: &Output, column: &str) -> bool {
    text(output).lines().any(|line| line.starts_with(&format!("  {column} differs by ")))
}

/// Whether `verify` compares a column.
fn compares(folder: &Path, table: &str, column: &str) -> bool {
    let manifest = Folder::new(folder, "test").manifest().expect("is readable").expect("is there");
    let audits = slipsweep::verify::verify(&folder.join("test"), &manifest, 10_000, 0).expect("is readable");
    audits.iter().any(|audit| audit.table == table && audit.worst.iter().any(|worst| worst.column == column))
}

#[test]
fn a_sound_dataset_passes() {
    let folder = tempfile::tempdir().expect("is writable");
    run(&sweep(folder.path(), AXES, TABLES), folder.path(), 2);
    let output = verify(folder.path(), &["--sample", "1000"]);
    assert_eq!(output.status.code(), Some(0), "{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
    for (table, rows) in [
        ("gap", "54"),
        ("best_cubic", "18"),
        ("optimal", "18"),
        ("crossover", "6"),
        ("shortcut", "72"),
        ("stability", "12"),
    ] {
        assert!(has_rows(&output, table, rows), "{}", text(&output));
    }
    assert!(text(&output).ends_with("\nno number differs by more than 10 rtol\n"), "{}", text(&output));
    // A seed determines the rows; another seed draws others.
    let sample = |seed| text(&verify(folder.path(), &["--sample", "5", "--seed", seed]));
    assert_eq!(sample("1"), sample("1"));
    assert_ne!(sample("1"), sample("2"));
}

/// Axes of landscapes under three laws: accelerations and decelerations that wait, turn, chatter and rise, and infeasible ones.
const LAW_AXES: &str = "law = [\"ageing\", \"slip\", \"prz\"]\nt_f = [0.1, 0.4, 1.2]\na = 0.03\nb = 0.05\nv_i = [4.0, 60.0]\nv_f = [80.0, 2.5]\n\
                        v_ceiling = 600.0\nalpha_2 = { linspace = [-0.2, 0.2, 3], unit = \"1/t_f\" }\nalpha_3 = { linspace = [-0.3, 0.3, 3], unit = \"1/t_f^2\" }\n";

#[test]
fn landscapes_of_other_laws_are_verified() {
    let folder = tempfile::tempdir().expect("is writable");
    let tables = "[tables.gap]\ncolumns = [\"work\", \"work_optimal\", \"gap\", \"v_min\", \"v_max\"]\n";
    run(&sweep(folder.path(), LAW_AXES, tables), folder.path(), 2);
    let output = verify(folder.path(), &["--sample", "1000"]);
    assert_eq!(output.status.code(), Some(0), "{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
    assert!(has_rows(&output, "gap", "324"), "{}", text(&output));
    for column in ["work", "v_min", "v_max"] {
        let folder = tempfile::tempdir().expect("is writable");
        run(&sweep(folder.path(), LAW_AXES, tables), folder.path(), 2);
        corrupt(folder.path(), "gap", column);
        let output = verify(folder.path(), &["--sample", "1000"]);
        assert_ne!(output.status.code(), Some(0), "{column}: {}", text(&output));
    }
}

#[test]
fn optima_of_other_laws_are_computed_again() {
    let numbers = ["work_bang_bang", "work_error", "v_ceiling_least", "dwork_dv_ceiling", "t_least", "chatter_duty"];
    let words = [("binding", "none"), ("bound", "too_slow")];
    let columns =
        [&numbers[..], &["work", "v_start", "theta_max", "dwork_db", "dwork_dv_i", "binding", "bound"]].concat();
    let table = format!("[tables.optimal]\ncolumns = {columns:?}\n");
    let folder = tempfile::tempdir().expect("is writable");
    let axes = "law = [\"slip\", \"prz\"]\nt_f = [0.1, 0.4, 1.2]\na = 0.03\nb = 0.05\nv_i = [4.0, 60.0]\nv_f = [80.0, 2.5]\nv_ceiling = 600.0\n";
    run(&sweep(folder.path(), axes, &table), folder.path(), 2);
    let output = verify(folder.path(), &["--sample", "1000"]);
    assert_eq!(output.status.code(), Some(0), "{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
    for column in numbers {
        corrupt(folder.path(), "optimal", column);
    }
    for (column, word) in words {
        reword(folder.path(), "optimal", column, word);
    }
    let output = verify(folder.path(), &["--sample", "1000"]);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    for column in numbers.into_iter().chain(words.map(|(column, _)| column)) {
        assert!(blames(&output, column), "{column}: {}", text(&output));
    }
}

/// The first one touches the floor; in the last one theta rises as fast as its law allows, over a small part of the time.
#[test]
fn regress_a_kink_of_the_velocity_raises_no_alarm() {
    for numbers in [
        "law = \"prz\"\nv_ceiling = 1e11\nt_f = 2.7864933045123653e-5\na = 0.008351037650061214\nb = 0.00898179060107469\n\
         v_i = 1340.115555332383\nv_f = 1493.4852129593085\n",
        "law = \"slip\"\nv_ceiling = 100.0\nt_f = 1.2\na = 0.03\nb = 0.02\nv_i = 4.0\nv_f = 2.5\n",
        "law = \"slip\"\nv_ceiling = 1e11\nt_f = 0.6343788610944021\na = 0.00696833478195458\nb = 0.004695163778909756\n\
         v_i = 10.319731237181962\nv_f = 659.3628922320387\n",
        "law = \"slip\"\nv_ceiling = 1e11\nt_f = 7.393719086659451e-7\na = 0.08280347164656897\nb = 0.0914967357499228\n\
         v_i = 42119.71859640789\nv_f = 243879.03381513085\n",
    ] {
        let folder = tempfile::tempdir().expect("is writable");
        run(&sweep(folder.path(), numbers, "[tables.best_cubic]\n"), folder.path(), 2);
        let output = verify(folder.path(), &[]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
        assert!(has_rows(&output, "best_cubic", "1"), "{}", text(&output));
    }
}

#[test]
fn best_cubic_shortcuts_of_other_laws_are_verified() {
    let tables = "[tables.best_cubic]\n";
    let folder = tempfile::tempdir().expect("is writable");
    run(&sweep(folder.path(), LAW_AXES, tables), folder.path(), 2);
    let output = verify(folder.path(), &["--sample", "1000"]);
    assert_eq!(output.status.code(), Some(0), "{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
    assert!(has_rows(&output, "best_cubic", "36"), "{}", text(&output));
    assert!(compares(folder.path(), "best_cubic", "beaten"));
    corrupt(folder.path(), "best_cubic", "work");
    assert_ne!(verify(folder.path(), &["--sample", "1000"]).status.code(), Some(0));
}

/// Changes one value of a column by 1e-7 of itself, in the first row that has one, and returns the row.
fn corrupt(folder: &Path, table: &str, column: &str) -> usize {
    change(folder, table, column, 1.0 + 1e-7)
}

/// Multiplies one value of a column, in the first row that has one, and returns the row.
fn change(folder: &Path, table: &str, column: &str, factor: f64) -> usize {
    let mut changed = 0;
    replace(folder, table, column, |values| {
        let mut values: Vec<Option<f64>> = values.as_primitive::<Float64Type>().iter().collect();
        changed = values.iter().position(Option::is_some).expect("has a value");
        values[changed] = values[changed].map(|value| value * factor);
        Arc::new(Float64Array::from(values))
    });
    changed
}

/// Replaces the first word of a column by another one.
fn reword(folder: &Path, table: &str, column: &str, word: &str) {
    replace(folder, table, column, |values| {
        let words = values.as_dictionary::<Int32Type>();
        let words = words.downcast_dict::<StringArray>().expect("has words");
        let mut words: Vec<Option<&str>> = words.into_iter().collect();
        let row = words.iter().position(Option::is_some).expect("has a word");
        assert_ne!(words[row], Some(word));
        words[row] = Some(word);
        Arc::new(words.into_iter().collect::<DictionaryArray<Int32Type>>())
    });
}

/// Replaces a column.
fn replace(folder: &Path, table: &str, column: &str, change: impl FnOnce(&dyn Array) -> ArrayRef) {
    let path = Folder::new(folder, "test").part(table, 0);
    let rows = batch(&path);
    // `best_cubic` has result columns of the same names as axes: none of those is used here.
    let place = rows.schema().index_of(column).expect("is there");
    let mut columns = rows.columns().to_vec();
    columns[place] = change(rows.column(place));
    write_batch(&path, &RecordBatch::try_new(rows.schema(), columns).expect("is a table"));
}

#[test]
fn a_planted_error_is_found_and_named() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, TABLES);
    for (table, column) in [
        ("gap", "work"),
        ("gap", "v_min"),
        ("gap", "v_max"),
        ("gap", "work_optimal"),
        ("best_cubic", "work"),
        ("best_cubic", "v_max"),
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
        assert!(text.contains(&format!("\n{table}, row {row}: ")), "{table}.{column}: {text}");
        assert!(blames(&output, column) && !text.contains("no number differs"), "{table}.{column}: {text}");
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
    assert!(compares(folder.path(), "crossover", "t_free_out") && compares(folder.path(), "shortcut", "status"));
    for (table, column, factor, blamed) in
        [("crossover", "t_free_in", 1.0 + 1e-7, "t_free_in"), ("shortcut", "t_f", 1e3, "status")]
    {
        let part = Folder::new(folder.path(), "test").part(table, 0);
        let sound = fs::read(&part).expect("is there");
        change(folder.path(), table, column, factor);
        let output = verify(folder.path(), &["--sample", "10000"]);
        assert_eq!(output.status.code(), Some(3), "{table}.{column}: {}", text(&output));
        assert!(blames(&output, blamed), "{table}.{column}: {}", text(&output));
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

    // Nor does a table without any part keep the others from being checked.
    let folder = tempfile::tempdir().expect("is writable");
    run(&sweep(folder.path(), AXES, "[tables.optimal]\n[tables.crossover]\n"), folder.path(), 1);
    fs::remove_file(Folder::new(folder.path(), "test").part("optimal", 0)).expect("is there");
    let output = verify(folder.path(), &[]);
    let text = text(&output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("\noptimal ") && text.contains("\ncrossover "), "{text}");
    assert!(text.contains("their part is missing") && text.contains(" none\n"), "{text}");

    // A damaged part is an error, after the other tables.
    fs::write(Folder::new(folder.path(), "test").part("optimal", 0), "PAR1").expect("is writable");
    let output = verify(folder.path(), &[]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(2) && has_rows(&output, "crossover", "6"), "{message}");
    assert!(message.contains("optimal/part-000000.parquet") && message.contains("\n  help: "), "{message}");
}

/// Without ceilings every state is feasible, and all rows are checked.
#[test]
fn feedback_without_ceilings_is_checked() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = "theta = [0.05, 0.5, 1.5]\nt_left = [0.01, 0.1, 2.0]\na = 0.03\nb = 0.05\nv_f = 10.0\n";
    run(&sweep(folder.path(), axes, "[tables.feedback]\n"), folder.path(), 1);
    let output = verify(folder.path(), &[]);
    assert!(output.status.success() && has_rows(&output, "feedback", "9"), "{}", text(&output));
    assert!(!text(&output).contains("not checked"), "{}", text(&output));
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
    assert!(message.contains("no row of the sample is in a part") && message.contains("`slipsweep run`"), "{message}");
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
            assert!(blames(&output, blamed), "{table}.{column}: {}", text(&output));
        }
    }
}

/// The first row waits at the floor, then is on both ceilings. Others are infeasible for each reason, sit on the ceiling, have no ceiling.
const CEILINGS: &str = "a = 0.03\nb = 0.05\nv_i = [3.0, 100.0]\nv_f = [100.0, 3.0]\nt_f = [0.08, 0.003, 0.7]\n\
                        v_ceiling = [400.0, 3.0, inf]\ntau_ceiling = [1.04, 0.9, inf]\n";

const STATES: &str = "theta = [0.2, 0.05]\nt_left = [0.01, 0.06]\na = 0.03\nb = 0.05\nv_f = 100.0\nv_ceiling = [1000.0, inf]\n\
                      tau_ceiling = [inf, 1.05]\n";

#[test]
fn optima_under_ceilings_are_integrated_again() {
    // The factor of one value of each column, and other words.
    type Numbers<'a> = &'a [(&'a str, f64)];
    type Words<'a> = &'a [(&'a str, &'a str)];
    const FINE: f64 = 1.0 + 1e-7;
    let optimal: Numbers<'_> = &[
        ("work", FINE),
        ("v_start", FINE),
        ("v_end", FINE),
        ("time_at_floor", FINE),
        ("time_at_v_ceiling", FINE),
        ("time_at_tau_ceiling", FINE),
        ("hamiltonian", FINE),
        ("theta_max", FINE),
        ("friction_max", FINE),
        ("t_least", FINE),
        ("v_ceiling_least", FINE),
        ("tau_ceiling_least", FINE),
        ("dwork_da", FINE),
        ("dwork_db", FINE),
        ("dwork_dv_i", FINE),
        ("dwork_dv_f", FINE),
        ("dwork_dv_ceiling", FINE),
        ("dwork_dtau_ceiling", FINE),
    ];
    let feedback: Numbers<'_> = &[("v", FINE), ("work_to_go", FINE), ("costate", FINE), ("gain", 1.001)];
    let words: Words<'_> = &[("strategy", "speed_up"), ("binding", "none"), ("bound", "too_slow")];
    let names = |numbers: Numbers<'_>, words: Words<'_>| {
        let names: Vec<String> = numbers
            .iter()
            .map(|(name, _)| *name)
            .chain(words.iter().map(|(name, _)| *name))
            .map(|name| format!("{name:?}"))
            .collect();
        names.join(", ")
    };
    let all = names(optimal, words) + ", \"work_error\"";
    for (axes, table, columns, numbers, words) in [
        (CEILINGS, "optimal", all, optimal, words),
        (STATES, "feedback", names(feedback, &[("arc", "")]), feedback, &[("arc", "floor")][..]),
    ] {
        let folder = tempfile::tempdir().expect("is writable");
        run(&sweep(folder.path(), axes, &format!("[tables.{table}]\ncolumns = [{columns}]\n")), folder.path(), 2);
        let output = verify(folder.path(), &["--sample", "1000"]);
        assert_eq!(output.status.code(), Some(0), "{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
        assert!(!text(&output).contains("integrator"), "{}", text(&output));
        numbers.iter().for_each(|(column, factor)| _ = change(folder.path(), table, column, *factor));
        words.iter().for_each(|(column, word)| reword(folder.path(), table, column, word));
        let output = verify(folder.path(), &["--sample", "1000"]);
        assert_eq!(output.status.code(), Some(3), "{table}: {}", text(&output));
        for column in numbers.iter().map(|(column, _)| column).chain(words.iter().map(|(column, _)| column)) {
            assert!(blames(&output, column), "{table}.{column}: {}", text(&output));
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
        assert_eq!(output.status.code(), Some(0), "{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
        assert!(has_rows(&output, &table, "4"), "{}", text(&output));
        let part = Folder::new(folder.path(), "test").part(&table, 0);
        let sound = fs::read(&part).expect("is there");
        for column in columns {
            // A column that is 0 everywhere cannot be changed by a factor.
            let factor = if column.starts_with("below") { f64::NAN } else { 1.0 + 1e-7 };
            change(folder.path(), &table, column, factor);
            let output = verify(folder.path(), &[]);
            assert_eq!(output.status.code(), Some(3), "{table}.{column}: {}", text(&output));
            assert!(blames(&output, column), "{table}.{column}: {}", text(&output));
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

/// Materials with friction of many and of few `a`, long and short, both ways.
const REGULARISED: &str = "t_f = [0.01, 0.35, 2.0]\na = [0.02, 0.2]\nb = [0.03, 0.25]\nv_i = [50.0, 3.0]\nv_f = [200.0, 4.0]\n\
                           alpha_2 = { linspace = [-0.01, 0.01, 3], unit = \"1/t_f\" }\nalpha_3 = 0.001\nk = 0.05\nm = 1e-6\n\
                           [model]\nfriction = \"regularised\"\n";

#[test]
fn regularised_friction_is_recomputed() {
    let folder = tempfile::tempdir().expect("is writable");
    run(&sweep(folder.path(), REGULARISED, "[tables.gap]\n[tables.optimal]\n[tables.stability]\n"), folder.path(), 2);
    let output = verify(folder.path(), &["--sample", "1000"]);
    assert_eq!(output.status.code(), Some(0), "{}{}", text(&output), String::from_utf8_lossy(&output.stderr));
    for (table, column) in [
        ("gap", "work"),
        ("gap", "work_optimal"),
        ("optimal", "work"),
        ("optimal", "v_start"),
        ("optimal", "hamiltonian"),
        ("stability", "k_c_f"),
        ("stability", "growth_rate"),
    ] {
        let part = Folder::new(folder.path(), "test").part(table, 0);
        let sound = fs::read(&part).expect("is there");
        corrupt(folder.path(), table, column);
        let output = verify(folder.path(), &["--sample", "1000"]);
        assert_eq!(output.status.code(), Some(3), "{table}.{column}: {}", text(&output));
        fs::write(&part, &sound).expect("is writable");
    }
}
