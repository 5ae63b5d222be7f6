//! Tables in memory are the tables on disk.

use std::fs::File;
use std::path::Path;

use crate::common::{LANDSCAPE, MATERIAL};
use arrow_array::RecordBatch;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use slipsweep::dataset::Folder;
use slipsweep::sweep::Sweep;

/// The parts of a table as they were written, one batch each.
fn written(folder: &Path, table: &str, parts: usize) -> Vec<RecordBatch> {
    let parts = (0..parts as u64).map(|part| Folder::at(folder).part(table, part));
    parts
        .map(|path| {
            let file = File::open(path).expect("was written");
            let reader = ParquetRecordBatchReaderBuilder::try_new(file).expect("is Parquet");
            let mut batches = reader.with_batch_size(1 << 20).build().expect("is Parquet");
            let all = batches.next().expect("has rows").expect("is readable");
            assert!(batches.next().is_none());
            all
        })
        .collect()
}

#[test]
fn batches_are_the_parts() {
    let folder = tempfile::tempdir().expect("is writable");
    // Two parts, nulls, numbers, words and flags between them.
    for (axes, tables) in [
        (LANDSCAPE.to_owned(), &["gap"][..]),
        (
            format!("t_f = [0.001, 0.02, 0.07]\n{MATERIAL}\nk = [1e-3, 1e-1]\n"),
            &["optimal", "shortcut", "stability", "step_response"],
        ),
    ] {
        let asked: String = tables.iter().map(|table| format!("[tables.{table}]\n")).collect();
        let sweep = crate::common::sweep(folder.path(), &axes, &asked);
        crate::common::run(&sweep, &folder.path().join("results"), 2);
        for table in tables {
            let batches = sweep.batches(table).expect("is requested");
            let schema = batches.schema();
            let batches: Vec<RecordBatch> = batches.collect::<Result<_, _>>().expect("are computed");
            let parts = written(&folder.path().join("results/test"), table, batches.len());
            for (batch, part) in batches.iter().zip(&parts) {
                assert_eq!(schema.fields(), part.schema().fields(), "{table}");
                assert_eq!(batch.columns(), part.columns(), "{table}");
            }
        }
        assert!(sweep.batches("best_cubic").is_none());
        std::fs::remove_dir_all(folder.path().join("results")).expect("was written");
    }
}

#[test]
fn a_wrong_spec_states_where() {
    let error = Sweep::parse("name = \"x\"\n[axes]\nv_i = 1.0\n[tables.optimum]\n", Path::new(".")).err();
    let message = "line 3: axes.v_i: 1.0 is out of range\n  expected: 1 < v_i <= 1e12\n  help: velocities are in units of v_0, above 1; \
                   for m/s, add `units = \"si\"` and the scales to [model]\n\
                   error: line 4: tables.optimum: unknown table `optimum`\n  expected: gap, best_cubic, optimal, feedback, \
                   crossover, shortcut, stability, step_response, compliant, regularised\n  help: did you mean `optimal`?";
    assert_eq!(error.expect("is refused").to_string(), message);
}
