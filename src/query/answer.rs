//! An answer: its columns, and its rows a piece at a time.

use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::mpsc::sync_channel;
use std::thread;

use polars::prelude::{
    AnyValue, Column, CsvWriter, DataFrame, Engine, JsonFormat, JsonWriter, LazyFrame, ParquetWriter, PlanCallback,
    PolarsError, PolarsResult, SchemaRef, SerWriter,
};

use crate::dataset::Cell;

/// Rows of a piece: enough to keep all threads busy, few enough to hold in memory.
const PIECE: NonZeroUsize = NonZeroUsize::MIN.saturating_add((1 << 14) - 1);

/// An answer that is found while it is read.
pub struct Answer {
    frame: LazyFrame,
    schema: SchemaRef,
}

/// How an answer is written to a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Names of the columns and then a line a row; nothing where there is no value.
    Csv,
    /// A JSON object a line; null where there is no value.
    JsonLines,
    /// Parquet.
    Parquet,
}

/// Why an answer did not reach its reader.
#[derive(Debug, thiserror::Error)]
pub enum AnswerError {
    /// It was not found to its end.
    #[error("the query failed: {0}")]
    Failed(PolarsError),
    /// It could not be written.
    #[error(transparent)]
    Write(#[from] io::Error),
}

impl From<PolarsError> for AnswerError {
    fn from(error: PolarsError) -> AnswerError {
        match &error {
            PolarsError::IO { error: inner, .. } => AnswerError::Write(io::Error::new(inner.kind(), error.to_string())),
            _ => AnswerError::Failed(error),
        }
    }
}

impl Answer {
    /// The answer that `frame` will give.
    pub(super) fn new(mut frame: LazyFrame) -> PolarsResult<Answer> {
        let schema = frame.collect_schema()?;
        Ok(Answer { frame, schema })
    }

    /// The names of its columns.
    pub fn columns(&self) -> Vec<String> {
        self.schema.iter_names().map(ToString::to_string).collect()
    }

    /// Hands its rows to `take`, some thousands at a time.
    pub fn rows(self, mut take: impl FnMut(Vec<Vec<Cell>>) -> io::Result<()>) -> Result<(), AnswerError> {
        self.pieces(|piece| {
            let columns: Vec<Vec<Cell>> = piece.columns().iter().map(cells).collect();
            let mut columns: Vec<_> = columns.into_iter().map(Vec::into_iter).collect();
            let row = || columns.iter_mut().filter_map(Iterator::next).collect();
            Ok(take(std::iter::repeat_with(row).take(piece.height()).collect())?)
        })
    }

    /// Writes it to `out`.
    pub fn write(self, format: Format, out: &mut dyn Write) -> Result<(), AnswerError> {
        let schema = self.schema.clone();
        match format {
            Format::Csv => {
                let mut bytes = Vec::new();
                let mut empty = DataFrame::empty_with_schema(&schema);
                CsvWriter::new(&mut bytes).finish(&mut empty)?;
                out.write_all(&bytes)?;
                self.pieces(|piece| {
                    bytes.clear();
                    CsvWriter::new(&mut bytes).include_header(false).finish(piece)?;
                    Ok(out.write_all(&bytes)?)
                })?;
            }
            Format::JsonLines => self.pieces(|piece| {
                let mut bytes = Vec::new();
                JsonWriter::new(&mut bytes).with_json_format(JsonFormat::JsonLines).finish(piece)?;
                Ok(out.write_all(&bytes)?)
            })?,
            Format::Parquet => {
                let failure = Mutex::new(None);
                let mut writer = ParquetWriter::new(Noting { out: &mut *out, failure: &failure }).batched(&schema)?;
                let written = self.pieces(|piece| Ok(writer.write_batch(piece)?));
                let written = written.and_then(|()| Ok(writer.finish().map(drop)?));
                let failure = failure.lock().ok().and_then(|mut failure| failure.take());
                failure.map_or(written, |error| Err(error.into()))?;
            }
        }
        Ok(out.flush()?)
    }

    /// Finds the answer on all threads and hands it over piece by piece, as fast as they are taken.
    fn pieces(self, mut take: impl FnMut(&mut DataFrame) -> Result<(), AnswerError>) -> Result<(), AnswerError> {
        let (send, pieces) = sync_channel(1);
        // Whoever does not want any more pieces hangs up, which stops the query.
        let give = PlanCallback::new(move |piece: DataFrame| Ok(send.send(piece).is_err()));
        let query = self.frame.sink_batches(give, true, Some(PIECE))?;
        thread::scope(|scope| {
            let finding = scope.spawn(move || query.collect_with_engine(Engine::Streaming));
            let taken = pieces.iter().try_for_each(|mut piece| {
                piece.rechunk_mut();
                take(&mut piece)
            });
            drop(pieces);
            let found = finding.join().unwrap_or_else(|_| {
                Err(PolarsError::ComputeError("it asks for something that is not supported".into()))
            });
            taken?;
            found.map(drop).map_err(AnswerError::from)
        })
    }
}

/// Notes how writing failed, which a Parquet writer tells as if the format were at fault.
struct Noting<'a> {
    out: &'a mut dyn Write,
    failure: &'a Mutex<Option<io::Error>>,
}

impl Noting<'_> {
    fn note<T>(&self, result: io::Result<T>) -> io::Result<T> {
        result.map_err(|error| {
            let kind = error.kind();
            if let Ok(mut failure) = self.failure.lock() {
                failure.get_or_insert(error);
            }
            kind.into()
        })
    }
}

impl Write for Noting<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes);
        self.note(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        let flushed = self.out.flush();
        self.note(flushed)
    }
}

/// The cells of a column.
fn cells(column: &Column) -> Vec<Cell> {
    let series = column.as_materialized_series();
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
