//! A range of rows as an Arrow record batch.

use std::ops::Range;
use std::sync::Arc;

use arrow_array::types::Int32Type;
use arrow_array::{ArrayRef, BooleanArray, DictionaryArray, Float64Array, Int32Array, RecordBatch, StringArray};
use arrow_buffer::NullBuffer;
use arrow_schema::ArrowError;

use super::layout::Layout;
use crate::grid::RowIndex;
use crate::protocol::Status;
use crate::table::{ColumnBuffer, Kind};

/// The rows `rows` of a table, whose cells are in `buffer`, with the columns and types of a part on disk. Numbers are not copied; a missing one
/// is null, and NaN below that.
///
/// # Errors
///
/// A column that does not fit the layout.
pub fn batch(
    layout: &Layout,
    row_index: &RowIndex,
    rows: Range<u64>,
    buffer: ColumnBuffer,
) -> Result<RecordBatch, ArrowError> {
    let view = row_index.view(rows.clone());
    let mut columns: Vec<ArrayRef> = Vec::with_capacity(layout.schema.fields().len());
    for axis in &layout.axes {
        let cells = view.runs(*axis, rows.clone()).map_or_else(Vec::new, |runs| runs.cells(rows.clone()));
        let words = axis.words();
        columns.push(if words.is_empty() { Arc::new(Float64Array::from(cells)) } else { labels(&words, &cells)? });
    }
    for name in &layout.labels {
        let runs = view.label(name, rows.clone());
        let cells = runs.iter().flat_map(|(word, length)| std::iter::repeat_n(*word, *length));
        columns.push(Arc::new(cells.collect::<DictionaryArray<Int32Type>>()));
    }
    for (column, cells) in layout.columns.iter().zip(buffer.columns) {
        columns.push(match column.kind {
            Kind::Number(_) | Kind::Quantity(_) => Arc::new(numbers(cells)),
            Kind::Label(words) => labels(words, &cells)?,
            Kind::Flag => Arc::new(cells.iter().map(|&cell| Some(some(cell)? != 0.0)).collect::<BooleanArray>()),
        });
    }
    let status: Vec<f64> = buffer.status.iter().map(|&status| f64::from(status as u8)).collect();
    columns.push(labels(&Status::ALL.map(Status::name), &status)?);
    RecordBatch::try_new(layout.schema.clone(), columns)
}

/// Numbers, null where there is none.
fn numbers(cells: Vec<f64>) -> Float64Array {
    let are_all = cells.iter().all(|cell| !cell.is_nan());
    let nulls = (!are_all).then(|| NullBuffer::from_iter(cells.iter().map(|cell| !cell.is_nan())));
    Float64Array::new(cells.into(), nulls)
}

/// A dictionary array of words from their indices.
fn labels(words: &[&str], places: &[f64]) -> Result<ArrayRef, ArrowError> {
    let keys: Int32Array = places.iter().map(|&place| Some(some(place)? as i32)).collect();
    let words = Arc::new(StringArray::from(words.to_vec()));
    Ok(Arc::new(DictionaryArray::<Int32Type>::try_new(keys, words)?))
}

/// The number of a cell; `None` for NaN.
fn some(cell: f64) -> Option<f64> {
    (!cell.is_nan()).then_some(cell)
}
