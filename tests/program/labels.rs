//! Labels: columns of text in a file of points, which go into every table and change no number.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, RecordBatch, StringArray};

use crate::common::{files, numbers, read, run, words, write_batch};
use polars::prelude::DataFrame;
use slipsweep::sweep::Sweep;

const CASES: &str = "material,a,sample_id,b\n\
                     granite,0.03,g1,0.05\n\
                     \"gabbro, wet\",0.03,,0.04\n\
                     \"\"\"dry\"\" granite\",0.02,g3,0.05\n\
                     granite,0.03,g1,0.05\n";

const AXES: &str = "[axes]\nt_f = [0.02, 0.037]\nv_i = 3.0\nv_f = 100.0\nk = [1e-3, 1e-2]\n";

const TABLES: &str = "[tables.optimal]\n[tables.crossover]\n[tables.stability]\n";

/// The sweep of these points, with the axes and tables above unless `rest` has others.
fn sweep(folder: &Path, cases: &str, rest: &str) -> Sweep {
    fs::write(folder.join("cases.csv"), cases).expect("is writable");
    let path = folder.join("spec.toml");
    fs::write(&path, format!("name = \"test\"\n{rest}")).expect("is writable");
    Sweep::load(&path).expect("is a legal spec")
}

fn spec() -> String {
    format!("points = \"cases.csv\"\n{AXES}{TABLES}")
}

fn names(frame: &DataFrame) -> Vec<&str> {
    frame.get_column_names().into_iter().map(|name| name.as_str()).collect()
}

#[test]
fn labels_follow_the_axes_in_every_table_and_change_no_number() {
    let folder = tempfile::tempdir().expect("is writable");
    run(&sweep(folder.path(), CASES, &spec()), &folder.path().join("with"), 2);
    let plain = "a,b\n0.03,0.05\n0.03,0.04\n0.02,0.05\n0.03,0.05\n";
    run(&sweep(folder.path(), plain, &spec()), &folder.path().join("without"), 2);
    // Points that differ in nothing but their label, or in empty, have rows of their own.
    let materials = ["granite", "gabbro, wet", "\"dry\" granite", "granite"];
    let samples = ["g1", "", "g3", "g1"];
    for (table, axes, each) in [("optimal", 7, 2), ("crossover", 4, 1), ("stability", 6, 2)] {
        let (with, without) = ["with", "without"].map(|out| read(&folder.path().join(out), table)).into();
        let expected = |labels: [&str; 4]| labels.map(|label| vec![label.to_owned(); each]).concat();
        // t_f and k vary faster than the points.
        assert_eq!(words(&with, "material"), expected(materials), "{table}");
        assert_eq!(words(&with, "sample_id"), expected(samples), "{table}");
        assert_eq!(names(&with)[axes..axes + 2], ["material", "sample_id"], "{table}");
        let bare = with.drop("material").and_then(|frame| frame.drop("sample_id")).expect("are there");
        assert!(bare.equals_missing(&without), "{table}");
    }
}

#[test]
fn bytes_with_labels_do_not_depend_on_threads_and_batches_are_the_parts() {
    let folder = tempfile::tempdir().expect("is writable");
    // More than one group of rows, words that repeat, and one that no row of the first group has.
    let lines = (0..40_000).map(|row| format!("{},s{}\n", 0.02 + 1e-7 * f64::from(row), row / 3));
    let cases: String = std::iter::once("a,sample\n".to_owned()).chain(lines).collect();
    let rest =
        "points = \"cases.csv\"\n[axes]\nb = 0.05\nv_i = 3.0\nv_f = 100.0\nk = [1e-3, 1e-2]\n[tables.stability]\n";
    let sweep = sweep(folder.path(), &cases, rest);
    let made = [1, 3].map(|threads| {
        let out = folder.path().join(threads.to_string());
        run(&sweep, &out, threads);
        files(&out)
    });
    assert_eq!(made[0], made[1]);
    let frame = read(&folder.path().join("1"), "stability");
    let expected: Vec<String> = (0..80_000).map(|row| format!("s{}", row / 6)).collect();
    assert_eq!(words(&frame, "sample"), expected);
    let batches = sweep.batches("stability").expect("is requested").map(|batch| batch.expect("is computed"));
    let labels: Vec<String> = batches
        .flat_map(|batch| {
            let column = batch.column_by_name("sample").expect("is there");
            let text = arrow_array::cast::AsArray::as_dictionary::<arrow_array::types::Int32Type>(column);
            let text = text.downcast_dict::<arrow_array::StringArray>().expect("holds words");
            text.into_iter().map(|word| word.expect("is there").to_owned()).collect::<Vec<_>>()
        })
        .collect();
    assert_eq!(labels, expected);
}

#[test]
fn only_tables_whose_rows_distinguish_the_points_have_labels() {
    let folder = tempfile::tempdir().expect("is writable");
    let cases = "k,machine\n1e-3,soft\n1e-2,stiff\n";
    let axes = "[axes]\nt_f = 0.02\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n";
    run(&sweep(folder.path(), cases, &format!("points = \"cases.csv\"\n{axes}{TABLES}")), folder.path(), 1);
    assert!(!names(&read(folder.path(), "optimal")).contains(&"machine"));
    assert_eq!(words(&read(folder.path(), "stability"), "machine"), ["soft", "stiff"]);
}

#[test]
fn blocks_without_a_label_have_none_in_their_rows() {
    let folder = tempfile::tempdir().expect("is writable");
    let rest = "a = 0.03\nv_i = 3.0\nv_f = [50.0, 100.0]\n";
    let blocks = format!(
        "[[block]]\n[block.axes]\nb = 0.05\n{rest}[[block]]\npoints = \"cases.csv\"\n[block.axes]\n{rest}[tables.crossover]\n"
    );
    let sweep = sweep(folder.path(), "b,rock\n0.04,granite\n0.05,gabbro\n", &blocks);
    run(&sweep, folder.path(), 1);
    let frame = read(folder.path(), "crossover");
    assert_eq!(words(&frame, "rock"), ["", "", "granite", "granite", "gabbro", "gabbro"]);
    assert_eq!(numbers(&frame, "t_cross")[..2], numbers(&frame, "t_cross")[4..]);
}

#[test]
fn conditions_compare_labels_with_words() {
    let folder = tempfile::tempdir().expect("is writable");
    let samples = |condition: &str, tables: &str| {
        let rest = format!("points = \"cases.csv\"\nwhere = \"{condition}\"\n{AXES}{tables}");
        let out = folder.path().join(condition.replace(' ', "_"));
        run(&sweep(folder.path(), CASES, &rest), &out, 1);
        let table = tables.trim_matches(['[', ']', '\n']).strip_prefix("tables.").expect("is a table");
        let frame = read(&out, table);
        words(&frame, "material").into_iter().zip(words(&frame, "sample_id")).map(|(a, b)| format!("{a} {b}")).collect()
    };
    let crossover = |condition: &str| -> Vec<String> { samples(condition, "[tables.crossover]\n") };
    assert_eq!(crossover("material = 'granite'"), ["granite g1", "granite g1"]);
    assert_eq!(crossover("sample_id <> 'g1'"), ["gabbro, wet ", "\"dry\" granite g3"]);
    assert_eq!(crossover("sample_id in ('g1', 'g3') and not (a = 0.03)"), ["\"dry\" granite g3"]);
    // Along with an axis that the table depends on, and one that it does not.
    let optimal: Vec<String> = samples("material = 'granite' or t_f = 0.02", "[tables.optimal]\n");
    assert_eq!(optimal, ["granite g1", "granite g1", "gabbro, wet ", "\"dry\" granite g3", "granite g1", "granite g1"]);
    assert_eq!(crossover("material = 'granite' and k > 1e-2 or sample_id = 'g3'"), ["\"dry\" granite g3"]);
}

#[test]
fn labels_of_a_parquet_file_are_those_of_csv_and_belong_to_the_identity() {
    let folder = tempfile::tempdir().expect("is writable");
    let csv = sweep(folder.path(), CASES, &spec());
    let materials = ["granite", "gabbro, wet", "\"dry\" granite", "granite"];
    let samples = [Some("g1"), None, Some("g3"), Some("g1")];
    let numbers = |numbers: [f64; 4]| -> ArrayRef { Arc::new(Float64Array::from(numbers.to_vec())) };
    let words = |words: Vec<Option<&str>>| -> ArrayRef { Arc::new(StringArray::from(words)) };
    let cases = RecordBatch::try_from_iter([
        ("material", words(materials.map(Some).to_vec())),
        ("a", numbers([0.03, 0.03, 0.02, 0.03])),
        ("sample_id", words(samples.to_vec())),
        ("b", numbers([0.05, 0.04, 0.05, 0.05])),
    ]);
    write_batch(&folder.path().join("cases.parquet"), &cases.expect("is a table"));
    let parquet = sweep(folder.path(), CASES, &spec().replace(".csv", ".parquet"));
    assert_eq!(csv.grid, parquet.grid);
    assert_eq!(csv.hash(&csv.requests[0]), parquet.hash(&parquet.requests[0]));
    let other = sweep(folder.path(), &CASES.replace("g3", "g4"), &spec());
    assert_ne!(csv.hash(&csv.requests[0]), other.hash(&other.requests[0]));
}

#[test]
fn commands_show_labels_as_words() {
    let folder = tempfile::tempdir().expect("is writable");
    run(&sweep(folder.path(), CASES, &spec()), &folder.path().join("results"), 0);
    let printed = |arguments: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
        let output = program.current_dir(folder.path()).args(arguments).output().expect("runs");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).expect("is text")
    };
    let head = printed(&["head", "results/test", "crossover"]);
    assert!(head.lines().nth(1).is_some_and(|names| names.contains("v_f  material       sample_id")), "{head}");
    assert!(head.contains("gabbro, wet"), "{head}");
    let question = "SELECT material, count(*) AS n FROM optimal WHERE material = 'granite' GROUP BY material";
    assert_eq!(printed(&["query", "results/test", question, "--format", "csv"]), "material,n\ngranite,4\n");
}

/// Quotes make a number a label; a scale of the model is none.
#[test]
fn numbers_in_quotes_are_labels_and_scales_are_none() {
    let folder = tempfile::tempdir().expect("is writable");
    run(&sweep(folder.path(), "core,a,b\n\"101\",0.03,0.05\n\"102\",0.03,0.04\n", &spec()), folder.path(), 1);
    assert_eq!(words(&read(folder.path(), "crossover"), "core"), ["101", "102"]);
    let refused = |cases: &str| {
        fs::write(folder.path().join("cases.csv"), cases).expect("is writable");
        let path = folder.path().join("other.toml");
        fs::write(&path, format!("name = \"other\"\n{}", spec())).expect("is writable");
        Sweep::load(&path).err().expect("is refused").to_string()
    };
    let scale = refused("mu_0,a,b\n0.6,0.03,0.05\n");
    assert!(scale.contains("unknown axis `mu_0`"), "{scale}");
    let empty = refused("core,a,b\n");
    assert!(empty.contains("no points") && !empty.contains("unknown"), "{empty}");
}

/// Lines have the colours of the label that `--color` names, each of its words once in the legend; an empty cell has a name, too.
#[test]
fn lines_are_coloured_by_one_label() {
    let folder = tempfile::tempdir().expect("is writable");
    run(&sweep(folder.path(), CASES, &spec()), &folder.path().join("results"), 0);
    let legend = |label: &str| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
        program.current_dir(folder.path()).args(["plot", "results/test", "--table", "optimal", "--out", "p.svg"]);
        let output = program.args(["--x", "t_f", "--y", "work", "--color", label]).output().expect("runs");
        assert!(output.status.success(), "{output:?}");
        fs::read_to_string(folder.path().join("p.svg")).expect("is text")
    };
    let by_sample = legend("sample_id");
    for (words, count) in [("g1<", 1), ("g3<", 1), ("no sample_id<", 1), ("granite", 0)] {
        assert_eq!(by_sample.matches(words).count(), count, "{words}: {by_sample}");
    }
    let by_material = legend("material");
    for (words, count) in [(">granite<", 1), ("gabbro, wet<", 1), ("g1<", 0)] {
        assert_eq!(by_material.matches(words).count(), count, "{words}: {by_material}");
    }
}

/// The reader of Parquet takes a dot in a name as the name of a field of a group.
#[test]
fn regress_labels_with_dots_and_spaces_can_be_read() {
    let folder = tempfile::tempdir().expect("is writable");
    let cases = CASES.replace("sample_id", "Sample No.");
    run(&sweep(folder.path(), &cases, &spec()), &folder.path().join("results"), 0);
    assert_eq!(words(&read(&folder.path().join("results"), "crossover"), "Sample No."), ["g1", "", "g3", "g1"]);
    let question = "SELECT \"Sample No.\" AS \"its.name\", a FROM crossover WHERE \"Sample No.\" = 'g3'";
    for arguments in [
        &["head", "results/test"][..],
        &["query", "results/test", question, "--out", "answer.parquet"],
        &["head", "answer.parquet"],
        &["plot", "results/test", "--table", "optimal", "--where", "Sample No.=g1", "--out", "p.svg"],
        &["trace", "results/test", "optimal", "--row", "5"],
    ] {
        let mut program = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
        let output = program.current_dir(folder.path()).args(arguments).output().expect("runs");
        assert!(output.status.success(), "{arguments:?}: {output:?}");
        if arguments[0] == "trace" {
            let text = String::from_utf8(output.stdout).expect("is text");
            assert!(text.contains("row 5 of table optimal of test: \"dry\" granite, g3\n"), "{text}");
        }
    }
    let mut program = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
    let output =
        program.current_dir(folder.path()).args(["query", "results/test", "SELECT Sample FROM crossover"]).output();
    let message = String::from_utf8(output.expect("runs").stderr).expect("is text");
    assert!(message.contains("a name with spaces goes in double quotes: \"Sample No.\""), "{message}");
}
