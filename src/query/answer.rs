//! The answer to a query: its columns, and its rows batch by batch.

use std::io::{self, Write};
use std::sync::Arc;

use arrow_array::types::Int32Type;
use arrow_array::{Array, ArrayRef, BooleanArray, DictionaryArray, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow_schema::Schema;
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use polars::prelude::{
    AnyValue, Column, DataFrame, DataType, IntoLazy, LazyFrame, PolarsError, PolarsResult, Series, SortMultipleOptions,
};
use polars_io::SerWriter;
use polars_io::prelude::CsvWriter;
use rayon::prelude::*;

use super::comparisons::Comparisons;
use super::plan;
use super::scan::{Files, append};
use super::streaming::{GroupPlan, Key, PARTS, StreamPlan};
use crate::dataset::{Cell, field, guarded};

/// Rows of a batch. Chosen: few enough that a reader sees the first ones soon.
const BATCH_ROWS: usize = 1 << 14;

/// Rows of partial answers that are merged before more are computed. Chosen: ten columns of 2^22 doubles are 336 MB.
const MAX_PARTIAL_ROWS: usize = 1 << 22;

/// An answer, computed while it is read.
pub struct Answer {
    /// The names of its columns.
    pub columns: Vec<String>,
    /// The units of its columns; empty if unknown.
    pub units: Vec<String>,
    /// Comparisons of its query that may be mistakes.
    pub comparisons: Comparisons,
    pub(super) frame: LazyFrame,
    /// Its computation part by part, if possible.
    pub(super) streaming: Option<StreamPlan>,
}

/// The format of an answer in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A line with the names of the columns, then a line for each row; a missing value is empty.
    Csv,
    /// A JSON object for each row, on a line; a missing value is null.
    JsonLines,
    /// Parquet.
    Parquet,
}

/// The error of an answer.
#[derive(Debug, thiserror::Error)]
pub enum AnswerError {
    /// The query failed.
    #[error("the query failed: {0}")]
    Failed(#[from] PolarsError),
    /// The answer cannot be written.
    #[error(transparent)]
    Write(#[from] io::Error),
}

impl From<ParquetError> for AnswerError {
    fn from(error: ParquetError) -> AnswerError {
        AnswerError::Failed(PolarsError::ComputeError(error.to_string().into()))
    }
}

type BatchHandler<'a> = &'a mut dyn FnMut(&DataFrame) -> Result<(), AnswerError>;

impl Answer {
    /// Passes its rows to `take`, some thousands at a time, and returns their number.
    ///
    /// # Errors
    ///
    /// If the answer cannot be computed, or `take` fails.
    pub fn rows(self, mut take: impl FnMut(Vec<Vec<Cell>>) -> io::Result<()>) -> Result<usize, AnswerError> {
        self.for_each_batch(&mut |batch| {
            let columns: Vec<Vec<Cell>> = batch.columns().iter().map(cells).collect();
            let mut columns: Vec<_> = columns.into_iter().map(Vec::into_iter).collect();
            let row = || columns.iter_mut().filter_map(Iterator::next).collect();
            Ok(take(std::iter::repeat_with(row).take(batch.height()).collect())?)
        })
    }

    /// Writes the answer to `out`, and returns the number of its rows.
    ///
    /// # Errors
    ///
    /// If the answer cannot be computed or written.
    pub fn write(self, format: Format, out: &mut dyn Write) -> Result<usize, AnswerError> {
        let mut first = true;
        let rows = match format {
            Format::Csv => self.for_each_batch(&mut |batch| {
                let mut bytes = Vec::new();
                let header = std::mem::take(&mut first);
                without_lists(batch, "CSV")?;
                CsvWriter::new(&mut bytes).include_header(header).finish(&mut batch.clone())?;
                Ok(out.write_all(&bytes)?)
            })?,
            Format::JsonLines => self.for_each_batch(&mut |batch| Ok(out.write_all(json_lines(batch).as_bytes())?))?,
            Format::Parquet => {
                let units = self.units.clone();
                let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
                let mut writer: Option<ArrowWriter<Vec<u8>>> = None;
                let rows = self.for_each_batch(&mut |batch| {
                    without_lists(batch, "a Parquet answer")?;
                    let batch = record_batch(batch, &units)?;
                    let writer = match &mut writer {
                        Some(writer) => writer,
                        none => {
                            none.insert(ArrowWriter::try_new(Vec::new(), batch.schema(), Some(properties.clone()))?)
                        }
                    };
                    writer.write(&batch)?;
                    Ok(out.write_all(&std::mem::take(writer.inner_mut()))?)
                })?;
                if let Some(writer) = writer {
                    out.write_all(&writer.into_inner()?)?;
                }
                rows
            }
        };
        out.flush()?;
        Ok(rows)
    }

    /// Computes the answer on all threads and passes it on batch by batch: at least one batch, even without rows. Returns the number of rows.
    fn for_each_batch(self, take: BatchHandler) -> Result<usize, AnswerError> {
        let Answer { frame, streaming, .. } = self;
        let mut rows = 0;
        let take: BatchHandler = &mut |batch| {
            rows += batch.height();
            take(batch)
        };
        match streaming {
            Some(streaming) if streaming.groups.is_none() && streaming.keys.is_empty() => stream(&streaming, take),
            Some(streaming) => match guarded(|| combine(&streaming)) {
                Some(Ok(found)) => pass_on(&found, take),
                // An answer that cannot be merged may be computed at once; if that fails, its error is reported.
                _ => pass_on(&whole(frame)?, take),
            },
            None => pass_on(&whole(frame)?, take),
        }?;
        Ok(rows)
    }
}

fn whole(frame: LazyFrame) -> PolarsResult<DataFrame> {
    guarded(|| frame.collect()).unwrap_or_else(|| Err(unsupported()))
}

/// The error for a panic of polars.
fn unsupported() -> PolarsError {
    PolarsError::ComputeError("polars does not support it".into())
}

/// Passes `found` on, batch by batch.
fn pass_on(found: &DataFrame, take: BatchHandler) -> Result<(), AnswerError> {
    (0..found.height().max(1)).step_by(BATCH_ROWS).try_for_each(|start| take(&found.slice(start as i64, BATCH_ROWS)))
}

/// Number of batches in progress. Chosen: several for each thread, so that no thread waits long for another.
fn at_once() -> usize {
    4 * rayon::current_num_threads()
}

/// The results of `parts`, in their order.
fn partial_answers(parts: &[Files], streaming: &StreamPlan) -> PolarsResult<Vec<DataFrame>> {
    let answer = |part: &Files| match &streaming.groups {
        Some(GroupPlan { columns: Some(groups), .. }) => part.groups(groups),
        _ => guarded(|| plan([(streaming.table.as_str(), part.frame()?)], &streaming.partial)?.collect())
            .unwrap_or_else(|| Err(unsupported())),
    };
    parts.par_iter().map(answer).collect()
}

/// Passes rows on as they are read.
fn stream(streaming: &StreamPlan, take: BatchHandler) -> Result<(), AnswerError> {
    let mut skip = streaming.offset;
    let mut left = streaming.limit;
    let mut first = true;
    for wave in streaming.files.parts().chunks(at_once()) {
        for mut found in partial_answers(wave, streaming)? {
            let skipped = skip.min(found.height());
            skip -= skipped;
            found = found.slice(skipped as i64, left.unwrap_or(usize::MAX));
            left = left.map(|left| left - found.height());
            if std::mem::take(&mut first) || found.height() > 0 {
                pass_on(&found, take)?;
            }
        }
        if left == Some(0) {
            break;
        }
    }
    Ok(())
}

/// The answer, merged from partial answers.
fn combine(streaming: &StreamPlan) -> PolarsResult<DataFrame> {
    let most = streaming.limit.map(|limit| limit.saturating_add(streaming.offset));
    let mut parts = DataFrame::default();
    for wave in streaming.files.parts().chunks(at_once()) {
        for part in partial_answers(wave, streaming)? {
            let part = if streaming.groups.is_some() { part } else { ordered(part, &streaming.keys, 0, most)? };
            append(&mut parts, part)?;
        }
        if parts.height() > MAX_PARTIAL_ROWS {
            parts = merged(parts, streaming, most)?;
        }
    }
    parts = merged(parts, streaming, most)?;
    if let Some(GroupPlan { finish, .. }) = &streaming.groups {
        parts = plan([(PARTS, parts.lazy())], finish)?.collect()?;
    }
    ordered(parts, &streaming.keys, streaming.offset, streaming.limit)?
        .select(streaming.names.iter().map(String::as_str))
}

fn merged(parts: DataFrame, streaming: &StreamPlan, most: Option<usize>) -> PolarsResult<DataFrame> {
    match &streaming.groups {
        Some(GroupPlan { merge, .. }) => plan([(PARTS, parts.lazy())], merge)?.collect(),
        None => ordered(parts, &streaming.keys, 0, most),
    }
}

/// `rows` in the order of their columns `__k0`, ...: at most `limit` rows after the first `offset`.
fn ordered(rows: DataFrame, keys: &[Key], offset: usize, limit: Option<usize>) -> PolarsResult<DataFrame> {
    let rows = if keys.is_empty() {
        rows
    } else {
        let names: Vec<String> = (0..keys.len()).map(|place| format!("__k{place}")).collect();
        let options = SortMultipleOptions::default()
            .with_order_descending_multi(keys.iter().map(|key| key.descending).collect::<Vec<_>>())
            .with_nulls_last_multi(keys.iter().map(|key| key.nulls_last).collect::<Vec<_>>())
            .with_maintain_order(true);
        let mut frame = rows.lazy().sort(names, options);
        if let Some(limit) = limit {
            let most = u32::try_from(limit.saturating_add(offset)).unwrap_or(u32::MAX);
            frame = frame.limit(most);
        }
        frame.collect()?
    };
    Ok(rows.slice(i64::try_from(offset).unwrap_or(i64::MAX), limit.unwrap_or(usize::MAX)))
}

/// The cells of a column.
fn cells(column: &Column) -> Vec<Cell> {
    let series = column.as_materialized_series().rechunk();
    series
        .iter()
        .map(|value| match value {
            AnyValue::Null => Cell::Missing,
            AnyValue::Float64(number) => Cell::Number(number),
            AnyValue::Float32(number) => Cell::Number(f64::from(number)),
            other => Cell::Word(other.str_value().into_owned()),
        })
        .collect()
}

/// A JSON object for each row.
fn json_lines(batch: &DataFrame) -> String {
    let columns: Vec<(String, Series)> = batch
        .columns()
        .iter()
        .map(|column| {
            let name = serde_json::Value::String(column.name().to_string()).to_string();
            (name, column.as_materialized_series().rechunk())
        })
        .collect();
    let mut cells: Vec<_> = columns.iter().map(|(name, series)| (name, series.iter())).collect();
    let mut text = String::new();
    for _ in 0..batch.height() {
        let row: Vec<String> = cells
            .iter_mut()
            .map(|(name, cells)| format!("{name}:{}", cells.next().map_or(serde_json::Value::Null, |cell| json(&cell))))
            .collect();
        text.push_str(&format!("{{{}}}\n", row.join(",")));
    }
    text
}

fn json(value: &AnyValue) -> serde_json::Value {
    match value {
        AnyValue::Null => serde_json::Value::Null,
        AnyValue::Boolean(flag) => (*flag).into(),
        AnyValue::Float64(number) => json_number(*number),
        AnyValue::Float32(number) => json_number(f64::from(*number)),
        AnyValue::UInt64(number) => (*number).into(),
        AnyValue::List(cells) => cells.iter().map(|cell| json(&cell)).collect::<Vec<_>>().into(),
        other => match other.extract::<i64>().filter(|_| other.dtype().is_integer()) {
            Some(number) => number.into(),
            None => other.str_value().into_owned().into(),
        },
    }
}

/// A number as JSON; numbers that are not finite become words: "inf", "-inf", "NaN".
fn json_number(number: f64) -> serde_json::Value {
    if number.is_finite() { number.into() } else { number.to_string().into() }
}

/// Checks that no column contains lists, which the format does not support.
fn without_lists(batch: &DataFrame, format: &str) -> PolarsResult<()> {
    let Some(list) = batch.columns().iter().find(|column| column.dtype().is_nested()) else { return Ok(()) };
    let (name, format) = (list.name(), format);
    Err(PolarsError::ComputeError(
        format!("column `{name}` holds lists, which {format} does not: use --format jsonl").into(),
    ))
}

/// A batch as a record batch for Parquet, with units.
fn record_batch(batch: &DataFrame, units: &[String]) -> Result<RecordBatch, AnswerError> {
    let (mut fields, mut arrays) = (Vec::new(), Vec::new());
    for (column, unit) in batch.columns().iter().zip(units) {
        let series = column.as_materialized_series();
        let array: ArrayRef = match column.dtype() {
            kind if kind.is_float() => {
                Arc::new(series.cast(&DataType::Float64)?.f64()?.iter().collect::<Float64Array>())
            }
            kind if kind.is_integer() => {
                Arc::new(series.strict_cast(&DataType::Int64)?.i64()?.iter().collect::<Int64Array>())
            }
            DataType::Boolean => Arc::new(series.bool()?.iter().collect::<BooleanArray>()),
            kind if kind.is_categorical() => {
                let text = series.cast(&DataType::String)?;
                Arc::new(text.str()?.iter().collect::<DictionaryArray<Int32Type>>())
            }
            _ => {
                let word = |value: AnyValue| match value {
                    AnyValue::Null => None,
                    other => Some(other.str_value().into_owned()),
                };
                Arc::new(series.rechunk().iter().map(word).collect::<StringArray>())
            }
        };
        fields.push(field(column.name(), array.data_type().clone(), true, unit, ""));
        arrays.push(array);
    }
    Ok(RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays).map_err(ParquetError::from)?)
}
