//! A trace as CSV and as Parquet.

use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, RecordBatch};
use arrow_schema::{ArrowError, DataType, Schema};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::Result;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;

use super::{COLUMNS, Trace, unit};
use crate::dataset::field;
use crate::model::Units;

/// CSV with comments `# key = value`: version, `facts` and units of the columns. Then follow the names of the columns and a line for each
/// moment. Numbers have the fewest digits that determine them; missing numbers are empty. The trace is in `units`.
pub fn csv(trace: &Trace, units: &Units, facts: &[(String, String)], version: &str) -> String {
    let columns = trace.columns();
    let of_columns: Vec<&str> = columns.iter().map(|&column| units.name(unit(column))).collect();
    let mut text = format!("# slipsweep = {version}\n");
    for (key, value) in facts {
        text.push_str(&format!("# {key} = {value}\n"));
    }
    text.push_str(&format!("# units = {}\n", of_columns.join(", ")));
    let names: Vec<&str> = columns.iter().map(|&column| COLUMNS[column].name).collect();
    text.push_str(&names.join(","));
    text.push('\n');
    for moment in &trace.moments {
        let cells: Vec<String> = columns
            .iter()
            .map(|&column| Trace::value(moment, column).map_or(String::new(), |value| format!("{value:?}")))
            .collect();
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// A Parquet file with units and meanings in the metadata of the fields, and `facts` and version in the metadata of the file. Its bytes are
/// equal on every machine. The trace is in `units`.
///
/// # Errors
/// If the file cannot be encoded.
pub fn parquet(trace: &Trace, units: &Units, facts: &[(String, String)], version: &str) -> Result<Vec<u8>> {
    let rows = record_batch(trace, units)?;
    let entry = |key: &str, value: &str| KeyValue::new(format!("slipsweep.{key}"), value.to_owned());
    let mut entries = vec![entry("version", version)];
    entries.extend(facts.iter().map(|(key, value)| entry(key, value)));
    let properties = WriterProperties::builder()
        .set_created_by(format!("slipsweep version {version}"))
        .set_key_value_metadata(Some(entries))
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .set_dictionary_enabled(false)
        .build();
    let mut file = ArrowWriter::try_new(Vec::new(), rows.schema(), Some(properties))?;
    file.write(&rows)?;
    file.into_inner()
}

/// An Arrow record batch: units and meanings in the metadata of the fields. The trace is in `units`.
///
/// # Errors
/// If the columns do not fit each other.
pub fn record_batch(trace: &Trace, units: &Units) -> std::result::Result<RecordBatch, ArrowError> {
    let columns = trace.columns();
    let fields = columns.iter().map(|&place| {
        let column = &COLUMNS[place];
        // The costate has no value before and after the protocol.
        field(column.name, DataType::Float64, column.name == "beta", units.name(unit(place)), column.doc)
    });
    let schema = Arc::new(Schema::new(fields.collect::<Vec<_>>()));
    let cells = |&column: &usize| -> ArrayRef {
        Arc::new(trace.moments.iter().map(|moment| Trace::value(moment, column)).collect::<Float64Array>())
    };
    RecordBatch::try_new(schema, columns.iter().map(cells).collect())
}
