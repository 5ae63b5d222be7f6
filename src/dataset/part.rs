//! One part: a range of rows as the bytes of a Parquet file.

use std::sync::Arc;

use arrow_array::types::Int32Type;
use arrow_array::{ArrayRef, DictionaryArray, Float64Array, Int32Array, RecordBatch, StringArray};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;

use super::footer::Footer;
use super::layout::Layout;
use crate::grid::Projection;
use crate::protocol::Status;
use crate::table::{Kind, Sheet};

/// The bytes of a part, the same on every machine.
pub fn encode(layout: &Layout, grid: &Projection<'_>, sheet: &Sheet, footer: &Footer) -> Result<Vec<u8>, ParquetError> {
    let mut arrays: Vec<ArrayRef> = Vec::new();
    for axis in &layout.axes {
        let Some(runs) = grid.runs(*axis, footer.rows.clone()) else { continue };
        let values = runs.values();
        let mut cells = Vec::with_capacity(sheet.status.len());
        for (value, length) in runs.over(footer.rows.clone()) {
            cells.resize(cells.len() + length, values[value]);
        }
        arrays.push(Arc::new(Float64Array::from(cells)));
    }
    for (column, cells) in layout.columns.iter().zip(&sheet.columns) {
        arrays.push(match column.kind {
            Kind::Number(_) | Kind::Quantity(_) => {
                Arc::new(Float64Array::from_iter(cells.iter().map(|&cell| (!cell.is_nan()).then_some(cell))))
            }
            Kind::Label(words) => {
                labels(cells.iter().map(|&cell| (!cell.is_nan()).then_some(cell as i32)).collect(), words)?
            }
        });
    }
    let status = sheet.status.iter().map(|&status| Some(status as i32)).collect();
    arrays.push(labels(status, &Status::ALL.map(Status::name))?);
    let batch = RecordBatch::try_new(layout.schema.clone(), arrays)?;
    let properties = WriterProperties::builder()
        .set_created_by(format!("slipsweep {}", env!("CARGO_PKG_VERSION")))
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(1)?))
        .set_key_value_metadata(Some(footer.entries()))
        .build();
    let mut writer = ArrowWriter::try_new(Vec::new(), layout.schema.clone(), Some(properties))?;
    writer.write(&batch)?;
    writer.into_inner()
}

fn labels(keys: Int32Array, words: &[&str]) -> Result<ArrayRef, ParquetError> {
    let words = Arc::new(StringArray::from(words.to_vec()));
    Ok(Arc::new(DictionaryArray::<Int32Type>::try_new(keys, words)?))
}
