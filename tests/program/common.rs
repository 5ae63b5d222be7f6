//! What the tests of whole runs have in common: specs in a folder of their own, runs, and tables read back.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use arrow_array::RecordBatch;
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_schema::DataType;
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use polars::prelude::{BooleanChunked, Column, DataFrame, Float64Chunked, IntoColumn, NewChunkedArray, StringChunked};
use slipsweep::dataset::Folder;
use slipsweep::sweep::{self, Outcome, Sweep};
use slipsweep::table::Signal;

/// The paper's material and velocities.
pub const MATERIAL: &str = "a = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n";

/// The paper's landscape, 401 x 401 at three durations, two parts.
pub const LANDSCAPE: &str = "t_f = [0.02, 0.037, 0.049]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n\
                             alpha_2 = { linspace = [-0.5, 0.5, 401], unit = \"1/t_f\" }\n\
                             alpha_3 = { linspace = [-0.5, 0.5, 401], unit = \"1/t_f^2\" }\n";

/// Writes a spec named `test` with these axes and tables, and checks it.
pub fn sweep(folder: &Path, axes: &str, tables: &str) -> Sweep {
    let path = folder.join("spec.toml");
    fs::write(&path, format!("name = \"test\"\n[axes]\n{axes}\n{tables}")).expect("is writable");
    Sweep::load(&path).expect("is a legal spec")
}

/// Runs a sweep into `out` on `threads` threads.
pub fn run(sweep: &Sweep, out: &Path, threads: usize) -> Outcome {
    sweep::run(sweep, &Folder::new(out, &sweep.name), threads, &Signal::default()).expect("finishes")
}

/// All files below `folder`, by relative path.
pub fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(current) = folders.pop() {
        for entry in fs::read_dir(&current).expect("is readable") {
            let path = entry.expect("is readable").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("is below").to_owned();
                found.insert(name, fs::read(&path).expect("is readable"));
            }
        }
    }
    found
}

/// All rows of a table.
pub fn read(out: &Path, table: &str) -> DataFrame {
    let folder = out.join("test").join(table);
    let mut parts: Vec<PathBuf> =
        fs::read_dir(&folder).expect("is readable").map(|entry| entry.expect("is readable").path()).collect();
    parts.sort();
    let mut frames = parts.iter().map(|part| frame(&batch(part)));
    let first = frames.next().expect("has a part");
    frames.fold(first, |all, next| all.vstack(&next).expect("has the same columns"))
}

/// All rows of a Parquet file.
pub fn batch(path: &Path) -> RecordBatch {
    let file = fs::File::open(path).expect("is readable");
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).expect("is Parquet");
    let rows = usize::try_from(builder.metadata().file_metadata().num_rows()).expect("is a number");
    let mut batches = builder.with_batch_size(rows.max(1)).build().expect("is Parquet");
    let batch = batches.next().expect("has rows").expect("is readable");
    assert_eq!(batch.num_rows(), rows);
    batch
}

/// Writes the rows of a Parquet file.
pub fn write_batch(path: &Path, batch: &RecordBatch) {
    let file = fs::File::create(path).expect("is writable");
    let mut writer = ArrowWriter::try_new(file, batch.schema(), None).expect("is a table");
    writer.write(batch).expect("is writable");
    writer.close().expect("is writable");
}

/// The rows of a batch as polars has them.
fn frame(batch: &RecordBatch) -> DataFrame {
    let schema = batch.schema();
    let column = |(field, array): (&arrow_schema::FieldRef, &arrow_array::ArrayRef)| -> Column {
        let name = field.name().as_str().into();
        match field.data_type() {
            DataType::Float64 => {
                Float64Chunked::from_iter_options(name, array.as_primitive::<Float64Type>().iter()).into_column()
            }
            DataType::Boolean => BooleanChunked::from_iter_options(name, array.as_boolean().iter()).into_column(),
            _ => {
                let codes = array.as_dictionary::<Int32Type>();
                let words = codes.values().as_string::<i32>();
                let word = |key: Option<i32>| key.map(|key| words.value(usize::try_from(key).expect("is a place")));
                StringChunked::from_iter_options(name, codes.keys().iter().map(word)).into_column()
            }
        }
    };
    let columns = schema.fields().iter().zip(batch.columns()).map(column).collect();
    DataFrame::new(batch.num_rows(), columns).expect("is a table")
}

/// A column of numbers; `None` where null.
pub fn numbers(frame: &DataFrame, column: &str) -> Vec<Option<f64>> {
    frame.column(column).expect("is there").f64().expect("holds numbers").iter().collect()
}

/// A column of words; empty where null.
pub fn words(frame: &DataFrame, column: &str) -> Vec<String> {
    let words = frame.column(column).expect("is there").str().expect("holds words");
    words.iter().map(|word| word.unwrap_or_default().to_owned()).collect()
}
