//! A part: a range of rows as the bytes of a Parquet file.

use std::sync::Arc;

use indexmap::IndexSet;
use parquet::arrow::{ArrowSchemaConverter, add_encoded_arrow_schema_to_metadata};
use parquet::errors::Result;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::ColumnDescPtr;
use zstd::bulk::Compressor;

use super::chunk::{Chunk, Runs};
use super::footer::Footer;
use super::layout::Layout;
use super::statistics::TableStatistics;
use super::{checksum, dictionary, flags, numbers};
use crate::grid::RowIndex;
use crate::protocol::Status;
use crate::table::{ColumnBuffer, Kind};

/// Rows of a row group, the unit that a reader skips by the statistics of a column. Chosen: a group of a column is half a megabyte, and a part has
/// four.
const ROWS_PER_GROUP: usize = 1 << 16;

/// Typical size of a landscape row, in bytes, for the initial buffer of a part.
const BYTES_PER_ROW: usize = 9;

/// Compression level; see docs/performance-internals.md.
pub const ZSTD_LEVEL: i32 = 1;

/// The bytes of a part with their checksums, equal on every machine; and the statistics of its rows, which the bytes contain.
///
/// # Errors
///
/// The error of the encoder.
pub fn encode(
    layout: &Layout,
    row_index: &RowIndex,
    buffer: &ColumnBuffer,
    footer: &Footer,
) -> Result<(Vec<u8>, TableStatistics)> {
    let statistics = TableStatistics::of(layout, row_index, footer.rows.clone(), buffer)?;
    let schema = ArrowSchemaConverter::new().convert(&layout.schema)?;
    let mut properties = WriterProperties::builder()
        .set_created_by(format!("slipsweep version {}", footer.build.version))
        .set_key_value_metadata(Some(footer.entries(&statistics)))
        .set_offset_index_disabled(true)
        .build();
    add_encoded_arrow_schema_to_metadata(&layout.schema, &mut properties);
    let mut file = SerializedFileWriter::new(
        Vec::with_capacity(buffer.status.len() * BYTES_PER_ROW),
        schema.root_schema_ptr(),
        Arc::new(properties),
    )?;
    let mut zstd = Compressor::new(ZSTD_LEVEL)?;
    let rows = buffer.status.len();
    let view = row_index.view(footer.rows.clone());
    for start in (0..rows).step_by(ROWS_PER_GROUP) {
        let range = start..rows.min(start + ROWS_PER_GROUP);
        let mut columns = schema.columns().iter().cloned();
        let mut group = Group { writer: file.next_row_group()?, next: || columns.next(), zstd: &mut zstd };
        let global = footer.rows.start + range.start as u64..footer.rows.start + range.end as u64;
        for axis in &layout.axes {
            if let Some(runs) = view.runs(*axis, global.clone()) {
                let (values, words) = (runs.values(), axis.words());
                let chunk = if words.is_empty() {
                    dictionary::numbers(values, runs.over(global.clone()), None)
                } else {
                    let codes = runs.over(global.clone()).map(|(step, length)| (values[step] as u32, length));
                    dictionary::words(&words, &codes.collect(), None)
                };
                group.splice(chunk)?;
            }
        }
        for name in &layout.labels {
            group.label(&view.label(name, global.clone()))?;
        }
        for (column, cells) in layout.columns.iter().zip(&buffer.columns) {
            let cells = &cells[range.clone()];
            match column.kind {
                Kind::Number(_) | Kind::Quantity(_) => group.numbers(cells)?,
                Kind::Label(words) => group.labels(words, cells)?,
                Kind::Flag => group.splice(flags::chunk(cells))?,
            }
        }
        group.status(&buffer.status[range])?;
        group.writer.close()?;
    }
    Ok((checksum::with_checksums(file.into_inner()?)?, statistics))
}

/// A row group under construction, and its remaining columns.
struct Group<'a, 'z, Next> {
    writer: SerializedRowGroupWriter<'a, Vec<u8>>,
    next: Next,
    zstd: &'a mut Compressor<'z>,
}

impl<Next: FnMut() -> Option<ColumnDescPtr>> Group<'_, '_, Next> {
    fn splice(&mut self, chunk: Chunk) -> Result<()> {
        let Some(column) = (self.next)() else { return Ok(()) };
        let (bytes, close) = chunk.encode(column, self.zstd)?;
        self.writer.append_column(&bytes, close)
    }

    /// Appends a column of numbers; NaN is null.
    fn numbers(&mut self, cells: &[f64]) -> Result<()> {
        self.splice(numbers::chunk(cells, &numbers::presence(cells)))
    }

    /// Appends a column of words, as indices; NaN is null.
    fn labels(&mut self, words: &[&str], cells: &[f64]) -> Result<()> {
        let codes = merge(cells.iter().filter(|cell| !cell.is_nan()).map(|&cell| (cell as u32, 1)));
        self.splice(dictionary::words(words, &codes, Some(&numbers::presence(cells))))
    }

    /// Appends a column of labels, as runs of words; `None` is null. The dictionary contains only the words of this row group, since a file of
    /// points may have millions.
    fn label(&mut self, runs: &[(Option<&str>, usize)]) -> Result<()> {
        let words: IndexSet<&str> = runs.iter().filter_map(|(word, _)| *word).collect();
        let code = |word: &str| words.get_index_of(word).map(|place| place as u32);
        let codes = merge(runs.iter().filter_map(|(word, length)| Some((code((*word)?)?, *length))));
        let presence = merge(runs.iter().map(|(word, length)| (u32::from(word.is_some()), *length)));
        let words: Vec<&str> = words.iter().copied().collect();
        self.splice(dictionary::words(&words, &codes, Some(&presence)))
    }

    fn status(&mut self, status: &[Status]) -> Result<()> {
        let codes = merge(status.iter().map(|&status| (status as u32, 1)));
        self.splice(dictionary::words(&Status::ALL.map(Status::name), &codes, None))
    }
}

/// Merges adjacent runs of equal codes.
fn merge(codes: impl Iterator<Item = (u32, usize)>) -> Runs {
    let mut runs: Runs = Vec::new();
    for (code, rows) in codes {
        match runs.last_mut() {
            Some((last, length)) if *last == code => *length += rows,
            _ => runs.push((code, rows)),
        }
    }
    runs
}
