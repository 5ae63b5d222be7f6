//! One part: a range of rows as the bytes of a Parquet file.

use std::sync::Arc;

use parquet::arrow::{ArrowSchemaConverter, add_encoded_arrow_schema_to_metadata};
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::data_type::DoubleType;
use parquet::errors::Result;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::ColumnDescPtr;

use super::dictionary::{self, Chunk, Numbers};
use super::footer::Footer;
use super::layout::Layout;
use crate::grid::Projection;
use crate::protocol::Status;
use crate::table::{Kind, Sheet};

/// Rows of a row group: what a reader skips by the statistics of a column.
const ROWS_PER_GROUP: usize = 1 << 16;

/// What a row of a landscape takes about, so that the buffer of a part seldom grows.
const BYTES_PER_ROW: usize = 9;

/// Strength of compression; see docs/performance.md.
pub const ZSTD_LEVEL: i32 = 1;

/// The bytes of a part, the same on every machine.
pub fn encode(layout: &Layout, grid: &Projection<'_>, sheet: &Sheet, footer: &Footer) -> Result<Vec<u8>> {
    let schema = ArrowSchemaConverter::new().convert(&layout.schema)?;
    let mut properties = WriterProperties::builder()
        .set_created_by(format!("slipsweep version {}", footer.version))
        .set_key_value_metadata(Some(footer.entries()))
        .set_dictionary_enabled(false)
        .set_encoding(Encoding::BYTE_STREAM_SPLIT)
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(ZSTD_LEVEL)?))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true)
        .set_data_page_row_count_limit(ROWS_PER_GROUP)
        .build();
    add_encoded_arrow_schema_to_metadata(&layout.schema, &mut properties);
    let mut file = SerializedFileWriter::new(
        Vec::with_capacity(sheet.status.len() * BYTES_PER_ROW),
        schema.root_schema_ptr(),
        Arc::new(properties),
    )?;
    let rows = sheet.status.len();
    for start in (0..rows).step_by(ROWS_PER_GROUP) {
        let range = start..rows.min(start + ROWS_PER_GROUP);
        let mut columns = schema.columns().iter().cloned();
        let mut group = Group { writer: file.next_row_group()?, next: || columns.next() };
        let global = footer.rows.start + range.start as u64..footer.rows.start + range.end as u64;
        for axis in &layout.axes {
            if let Some(runs) = grid.runs(*axis, global.clone()) {
                let values = runs.values();
                group.axis(&values, &mut runs.over(global.clone()))?;
            }
        }
        for (column, cells) in layout.columns.iter().zip(&sheet.columns) {
            let cells = &cells[range.clone()];
            match column.kind {
                Kind::Number(_) | Kind::Quantity(_) => group.numbers(cells)?,
                Kind::Label(words) => group.labels(words, cells)?,
            }
        }
        group.status(&sheet.status[range])?;
        group.writer.close()?;
    }
    file.into_inner()
}

/// A row group in the making, and the columns that it still lacks.
struct Group<'a, Next> {
    writer: SerializedRowGroupWriter<'a, Vec<u8>>,
    next: Next,
}

impl<Next: FnMut() -> Option<ColumnDescPtr>> Group<'_, Next> {
    fn splice(&mut self, chunk: Chunk<'_>) -> Result<()> {
        let Some(column) = (self.next)() else { return Ok(()) };
        let (bytes, close) = chunk.encode(column)?;
        self.writer.append_column(&bytes, close)
    }

    /// An axis: `values`, and which of them for how many rows.
    fn axis(&mut self, values: &[f64], runs: &mut dyn Iterator<Item = (usize, usize)>) -> Result<()> {
        let mut numbers = Numbers::default();
        let code_of: Vec<u32> = values.iter().map(|&value| numbers.code(value)).collect();
        let codes: Vec<(u32, usize)> = runs.map(|(step, length)| (code_of[step], length)).collect();
        self.splice(numbers.chunk(&codes, None, 0))
    }

    /// Numbers, NaN where there is none.
    fn numbers(&mut self, cells: &[f64]) -> Result<()> {
        if let Some((numbers, codes, present)) = as_runs(cells) {
            let nulls = present.iter().filter(|run| run.0 == 0).map(|run| run.1 as u64).sum();
            return self.splice(numbers.chunk(&codes, Some(&present), nulls));
        }
        (self.next)();
        let levels: Vec<i16> = cells.iter().map(|cell| i16::from(!cell.is_nan())).collect();
        let mut values = Vec::with_capacity(cells.len());
        values.extend(cells.iter().filter(|cell| !cell.is_nan()));
        let Some(mut column) = self.writer.next_column()? else { return Ok(()) };
        column.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
        column.close()
    }

    /// Indices of `words`, NaN where there is none.
    fn labels(&mut self, words: &[&str], cells: &[f64]) -> Result<()> {
        let present = merge(cells.iter().map(|cell| u32::from(!cell.is_nan())));
        let codes = merge(cells.iter().filter(|cell| !cell.is_nan()).map(|&cell| cell as u32));
        let nulls = cells.iter().filter(|cell| cell.is_nan()).count() as u64;
        self.splice(dictionary::words(words, &codes, Some(&present), nulls))
    }

    fn status(&mut self, status: &[Status]) -> Result<()> {
        let codes = merge(status.iter().map(|&status| status as u32));
        self.splice(dictionary::words(&Status::ALL.map(Status::name), &codes, None, 0))
    }
}

/// Runs of equal values.
fn merge(codes: impl Iterator<Item = u32>) -> Vec<(u32, usize)> {
    let mut runs: Vec<(u32, usize)> = Vec::new();
    for code in codes {
        match runs.last_mut() {
            Some((last, length)) if *last == code => *length += 1,
            _ => runs.push((code, 1)),
        }
    }
    runs
}

type CodedRuns = (Numbers, Vec<(u32, usize)>, Vec<(u32, usize)>);

/// Numbers that repeat for long, such as the optimal work along a landscape, as a dictionary: its numbers, the runs of their codes, and
/// the runs of presence; `None` for a column that is better written number by number.
fn as_runs(cells: &[f64]) -> Option<CodedRuns> {
    let changes_allowed = cells.len().div_ceil(16);
    let mut runs: Vec<(u64, usize)> = Vec::new();
    for bits in cells.iter().filter(|cell| !cell.is_nan()).map(|cell| cell.to_bits()) {
        match runs.last_mut() {
            Some((last, length)) if *last == bits => *length += 1,
            _ => runs.push((bits, 1)),
        }
        if runs.len() > changes_allowed {
            return None;
        }
    }
    if runs.is_empty() {
        return None;
    }
    let mut numbers = Numbers::default();
    let codes = runs.into_iter().map(|(bits, length)| (numbers.code(f64::from_bits(bits)), length)).collect();
    Some((numbers, codes, merge(cells.iter().map(|cell| u32::from(!cell.is_nan())))))
}
