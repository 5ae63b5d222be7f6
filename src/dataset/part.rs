//! A part: a range of rows as the bytes of a Parquet file.

use std::iter;
use std::ops::Range;
use std::sync::Arc;

use indexmap::IndexSet;
use parquet::arrow::{ArrowSchemaConverter, add_encoded_arrow_schema_to_metadata};
use parquet::errors::Result;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use zstd::bulk::Compressor;

use super::chunk::{Chunk, Runs};
use super::footer::Footer;
use super::layout::Layout;
use super::statistics::TableStatistics;
use super::{checksum, dictionary, numbers};
use crate::grid::{RowIndex, View};
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
        .set_created_by(format!("slipsweep version {}", footer.manifest.build.version))
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
        let global = footer.rows.start + range.start as u64..footer.rows.start + range.end as u64;
        let mut group = file.next_row_group()?;
        for (chunk, column) in chunks(layout, &view, &global, buffer, &range).zip(schema.columns()) {
            let (bytes, close) = chunk.encode(column.clone(), &mut zstd)?;
            group.append_column(&bytes, close)?;
        }
        group.close()?;
    }
    Ok((checksum::with_checksums(file.into_inner()?)?, statistics))
}

/// The columns of a row group, one after another: the rows `global` of the table, at the places `rows` of `buffer`.
fn chunks<'a>(
    layout: &'a Layout,
    view: &'a View<'_>,
    global: &'a Range<u64>,
    buffer: &'a ColumnBuffer,
    rows: &'a Range<usize>,
) -> impl Iterator<Item = Chunk> + 'a {
    let axes = layout.axes.iter().filter_map(move |axis| {
        let (runs, words) = (view.runs(*axis, global.clone())?, axis.words());
        let (values, steps) = (runs.values(), runs.over(global.clone()));
        Some(if words.is_empty() {
            dictionary::numbers(values, steps, None)
        } else {
            let codes = steps.map(|(step, length)| (values[step] as u32, length));
            dictionary::words(&words, &codes.collect(), None)
        })
    });
    let labels = layout.labels.iter().map(move |name| label(&view.label(name, global.clone())));
    let columns = layout.columns.iter().zip(&buffer.columns).map(move |(column, cells)| {
        let cells = &cells[rows.clone()];
        match column.kind {
            Kind::Number(_) | Kind::Quantity(_) => numbers::chunk(cells),
            Kind::Label(words) => words_of(words, cells),
            Kind::Flag => numbers::flags(cells),
        }
    });
    let status = iter::once_with(move || status_of(&buffer.status[rows.clone()]));
    axes.chain(labels).chain(columns).chain(status)
}

/// A column of words, as indices; NaN is null.
fn words_of(words: &[&str], cells: &[f64]) -> Chunk {
    let codes = merge(cells.iter().filter(|cell| !cell.is_nan()).map(|&cell| (cell as u32, 1)));
    dictionary::words(words, &codes, Some(&numbers::presence(cells)))
}

/// A column of labels, as runs of words; `None` is null. The dictionary contains only the words of this row group, since a file of points may
/// have millions.
fn label(runs: &[(Option<&str>, usize)]) -> Chunk {
    let words: IndexSet<&str> = runs.iter().filter_map(|(word, _)| *word).collect();
    let code = |word: &str| words.get_index_of(word).map(|place| place as u32);
    let codes = merge(runs.iter().filter_map(|(word, length)| Some((code((*word)?)?, *length))));
    let presence = merge(runs.iter().map(|(word, length)| (u32::from(word.is_some()), *length)));
    let words: Vec<&str> = words.iter().copied().collect();
    dictionary::words(&words, &codes, Some(&presence))
}

fn status_of(status: &[Status]) -> Chunk {
    let codes = status.chunk_by(|one, next| one == next).map(|run| (run[0] as u32, run.len())).collect();
    dictionary::words(&Status::ALL.map(Status::name), &codes, None)
}

/// Merges adjacent runs of equal codes.
fn merge(codes: impl Iterator<Item = (u32, usize)>) -> Runs {
    let mut runs = Runs::new();
    for (code, rows) in codes {
        match runs.last_mut() {
            Some((last, total)) if *last == code => *total += rows,
            _ => runs.push((code, rows)),
        }
    }
    runs
}
