//! The records as a Parquet table.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use arrow_array::{ArrayRef, BooleanArray, Float64Array, RecordBatch, StringArray, UInt32Array};
use parquet::arrow::ArrowWriter;

use super::measure::Record;

/// Writes one row a record; `ln` is the time of one logarithm, in nanoseconds.
pub fn write(path: &Path, records: &[&Record], ln: f64) -> Result<(), Box<dyn std::error::Error>> {
    let words = |of: fn(&Record) -> &str| {
        Arc::new(StringArray::from_iter_values(records.iter().map(|record| of(record)))) as ArrayRef
    };
    let numbers = |of: &dyn Fn(&Record) -> Option<f64>| {
        Arc::new(Float64Array::from_iter(records.iter().map(|record| of(record)))) as ArrayRef
    };
    let counts = |of: fn(&Record) -> usize| {
        Arc::new(UInt32Array::from_iter_values(records.iter().map(|record| of(record) as u32))) as ArrayRef
    };
    let error = |i: usize| numbers(&|record| Some(record.errors[i]).filter(|error| error.is_finite()));
    let batch = RecordBatch::try_from_iter_with_nullable([
        ("subject", words(|record| record.subject), false),
        ("cases", words(|record| record.cases), false),
        ("method", words(|record| &record.method), false),
        ("ours", Arc::new(BooleanArray::from_iter(records.iter().map(|record| Some(record.ours)))), false),
        ("setting", words(|record| &record.setting), false),
        ("tolerance", numbers(&|record| record.tolerance), true),
        ("count", counts(|record| record.count), false),
        ("failures", counts(|record| record.failures), false),
        ("ns", numbers(&|record| Some(record.ns)), false),
        ("in_ln", numbers(&|record| Some(record.ns / ln)), false),
        ("error_median", error(0), true),
        ("error_95", error(1), true),
        ("error_worst", error(2), true),
    ])?;
    let mut writer = ArrowWriter::try_new(File::create(path)?, batch.schema(), None)?;
    writer.write(&batch)?;
    writer.close()?;
    Ok(())
}
