//! Columns of a table, read part by part, so that memory does not grow with the table.

use std::fs::File;
use std::path::Path;

use arrow_array::RecordBatchReader;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::arrow::{ProjectionMask, parquet_to_arrow_schema};
use parquet::errors::ParquetError;
use parquet::file::metadata::{ParquetMetaDataReader, RowGroupMetaData};
use parquet::file::statistics::Statistics;
use parquet::schema::types::SchemaDescriptor;

pub use super::cell::Cells;

use super::cell::Cell;
use super::guard::{coded, sound};
use crate::file;

/// Rows decoded in one batch. Chosen: a batch fits the cache of a core.
const ROWS_AT_ONCE: usize = 1 << 14;

/// Name and unit of a column of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heading {
    /// Its name.
    pub name: String,
    /// Its unit; empty for words and flags.
    pub unit: String,
    /// Whether it contains numbers; otherwise words, or flags as `true` and `false`.
    pub is_number: bool,
}

/// Some columns of some rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Number of rows.
    pub height: usize,
    /// The requested columns in order, each with its name.
    pub columns: Vec<(String, Cells)>,
}

/// One row: names and values of its cells.
pub type Row = Vec<(String, Cell)>;

impl Frame {
    /// The cells of a column; `None` if it was not requested.
    pub fn column(&self, name: &str) -> Option<&Cells> {
        self.columns.iter().find(|(known, _)| known == name).map(|(_, cells)| cells)
    }

    /// A row.
    pub fn row(&self, row: usize) -> Row {
        self.columns.iter().map(|(name, cells)| (name.clone(), cells.cell(row))).collect()
    }
}

/// The error of reading columns: a file is damaged or not a Parquet file.
#[derive(Debug, thiserror::Error)]
#[error("{path}: cannot be read as Parquet: {reason}")]
#[allow(missing_docs)]
pub struct FrameError {
    pub path: String,
    pub reason: String,
}

fn wrong(path: &Path, reason: impl std::fmt::Display) -> FrameError {
    FrameError { path: path.display().to_string(), reason: reason.to_string() }
}

/// The entries of a footer: keys and values.
pub type Facts = Vec<(String, String)>;

/// The columns of a Parquet file, and the entries of its footer.
///
/// # Errors
///
/// A file that cannot be read.
pub fn headings(path: &Path) -> Result<(Vec<Heading>, Facts), FrameError> {
    let read = || -> Result<_, ParquetError> {
        let metadata = ParquetMetaDataReader::new().parse_and_finish(&file::open(path)?)?;
        let footer = metadata.file_metadata();
        let schema = parquet_to_arrow_schema(footer.schema_descr(), footer.key_value_metadata())?;
        Ok((schema, footer.key_value_metadata().cloned().unwrap_or_default()))
    };
    let (schema, entries) = sound(read).map_err(|error| wrong(path, error))?;
    let heading = |field: &arrow_schema::FieldRef| {
        let unit = field.metadata().get("unit").cloned().unwrap_or_default();
        let is_number = field.data_type().is_numeric();
        Heading { name: field.name().clone(), unit, is_number }
    };
    let entries = entries.into_iter().filter_map(|entry| Some((entry.key, entry.value?))).collect();
    Ok((schema.fields().iter().map(heading).collect(), entries))
}

/// The columns `names` of a Parquet file.
///
/// # Errors
///
/// A file that cannot be read, or a column that it does not have.
pub fn read(path: &Path, names: &[&str]) -> Result<Frame, FrameError> {
    open(path, Some(names), |all| all)
}

/// Decides from the least and the greatest number of each column whether to read a row group; a column without numbers has none.
pub type Keep<'a> = &'a dyn Fn(&dyn Fn(&str) -> Option<(f64, f64)>) -> bool;

/// The columns `names` of the row groups of a Parquet file that `keep` selects.
///
/// # Errors
///
/// A file that cannot be read, or a column that it does not have.
pub fn read_where(path: &Path, names: &[&str], keep: Keep<'_>) -> Result<Frame, FrameError> {
    open(path, Some(names), |all| {
        let groups = all.metadata().row_groups().iter().enumerate();
        let kept = groups.filter(|(_, group)| keep(&|name| range(group, name))).map(|(place, _)| place).collect();
        all.with_row_groups(kept)
    })
}

/// All columns of a Parquet file.
///
/// # Errors
///
/// A file that cannot be read.
pub fn read_all(path: &Path) -> Result<Frame, FrameError> {
    open(path, None, |all| all)
}

/// The least and the greatest number of a column of a row group.
fn range(group: &RowGroupMetaData, name: &str) -> Option<(f64, f64)> {
    let column = group.columns().iter().find(|column| column.column_path().string() == name)?;
    match column.statistics()? {
        Statistics::Double(range) => Some((*range.min_opt()?, *range.max_opt()?)),
        _ => None,
    }
}

/// One row of a Parquet file, with all its columns.
///
/// # Errors
/// If the file cannot be read, or has no such row.
pub fn row(path: &Path, row: usize) -> Result<Row, FrameError> {
    let frame = open(path, None, |all| all.with_offset(row).with_limit(1))?;
    if frame.height == 1 { Ok(frame.row(0)) } else { Err(wrong(path, format!("it has no row {row}"))) }
}

/// The columns `names` of a file. `ProjectionMask::columns` takes a dot in a name as the name of a field of a group.
pub fn projection(schema: &SchemaDescriptor, names: &[&str]) -> ProjectionMask {
    let fields = schema.root_schema().get_fields().iter().enumerate();
    ProjectionMask::roots(schema, fields.filter(|(_, field)| names.contains(&field.name())).map(|(place, _)| place))
}

/// A reader of some rows of a file, or all.
type Builder = ParquetRecordBatchReaderBuilder<File>;

/// Reads some or all columns of the rows that `select` selects.
fn open(path: &Path, names: Option<&[&str]>, select: impl FnOnce(Builder) -> Builder) -> Result<Frame, FrameError> {
    let read = || -> Result<Frame, ParquetError> {
        let file = file::open(path)?;
        let metadata = coded(&file)?;
        let mut builder = select(Builder::new_with_metadata(file, metadata).with_batch_size(ROWS_AT_ONCE));
        if let Some(names) = names {
            let mask = projection(builder.parquet_schema(), names);
            builder = builder.with_projection(mask);
        }
        let reader = builder.build()?;
        let fields = reader.schema();
        let names: Vec<&str> = match names {
            Some(names) => names.to_vec(),
            None => fields.fields().iter().map(|field| field.name().as_str()).collect(),
        };
        let mut places = Vec::new();
        let mut columns = Vec::new();
        for name in names {
            let (place, field) = fields
                .column_with_name(name)
                .ok_or_else(|| ParquetError::General(format!("it has no column `{name}`")))?;
            let cells = Cells::none(field.data_type()).ok_or_else(|| {
                ParquetError::General(format!("column `{name}` is {}, which no table has", field.data_type()))
            })?;
            places.push(place);
            columns.push((name.to_owned(), cells));
        }
        let mut height = 0;
        for batch in reader {
            let batch = batch?;
            height += batch.num_rows();
            for ((_, cells), &place) in columns.iter_mut().zip(&places) {
                cells.extend(batch.column(place));
            }
        }
        Ok(Frame { height, columns })
    };
    sound(read).map_err(|error| wrong(path, error))
}
