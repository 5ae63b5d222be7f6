//! `points`: a file of points whose columns are axes that vary together.

use std::fmt::{self, Display, Formatter};
use std::fs;
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, ArrowPrimitiveType, PrimitiveArray, StringArray};
use arrow_schema::DataType;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder};

use super::error::{MOST_OF_NAME, SpecError, unknown};
use crate::dataset::{check_footer, check_pages, guarded};
use crate::grid::{Axis, Factor, Quantity, Scale, Values};
use crate::model::Units;
use crate::names::shown;

/// Reads the points of a CSV or Parquet file; values are in `units`, those of coefficients not relative to `t_f`.
pub fn read(path: &Path, units: &Units) -> Result<Factor, SpecError> {
    let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
    let axes = match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("csv") => csv(path, units)?,
        Some("parquet") => sound(path, units)?,
        _ => {
            let (expected, help) = ("a file whose name ends in .csv or .parquet", "write the points as CSV");
            return Err(fault(format!("{}: neither CSV nor Parquet", path.display()), expected, help));
        }
    };
    if axes.iter().all(|axis| axis.1.is_empty()) {
        let (expected, help) = ("axis names and at least one point", "add points, or remove `points`");
        return Err(fault(format!("{}: no points", path.display()), expected, help));
    }
    let axis = |(quantity, values)| Axis { quantity, scale: Scale::Model, values: Values::List(values) };
    Ok(Factor { axes: axes.into_iter().map(axis).collect() })
}

/// Most points of a file.
const MOST_POINTS: usize = 1 << 22;

/// Most bytes of a file.
const MOST_BYTES: u64 = 1 << 28;

/// Whether the file is one that can be taken into memory: no device, no folder, not too large.
fn check_size(path: &Path) -> Result<(), SpecError> {
    let file = fs::metadata(path).map_err(|error| unreadable(path, &error))?;
    if !file.is_file() {
        return Err(unreadable(path, &"not a file"));
    }
    if file.len() > MOST_BYTES {
        let found = format!("{}: {} bytes", path.display(), file.len());
        return Err(fault(found, &format!("at most {MOST_BYTES} bytes"), "take fewer points, or several sweeps"));
    }
    Ok(())
}

/// Whether there are no more than that many points.
fn check_count(path: &Path, count: usize) -> Result<(), SpecError> {
    if count <= MOST_POINTS {
        return Ok(());
    }
    let found = format!("{}: more than {MOST_POINTS} points", path.display());
    Err(fault(found, &format!("at most {MOST_POINTS}"), "take fewer points, or several sweeps"))
}

/// Columns of a file of points.
type Columns = Vec<(Quantity, Vec<f64>)>;

/// CSV: a header of axis names, then a point a line. Empty lines and lines that begin with # are passed over.
fn csv(path: &Path, units: &Units) -> Result<Columns, SpecError> {
    check_size(path)?;
    let bytes = fs::read(path).map_err(|error| unreadable(path, &error))?;
    let Ok(text) = String::from_utf8(bytes) else {
        return Err(fault(format!("{}: not in UTF-8", path.display()), "CSV in UTF-8", "save it as CSV in UTF-8"));
    };
    // Spreadsheets put a byte order mark in front, and quotes around cells.
    let mut lines = text
        .trim_start_matches('\u{feff}')
        .lines()
        .enumerate()
        .map(|(index, line)| (Line { file: path, number: index + 1 }, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let mut axes = match lines.next() {
        // Some programs quote the names of columns.
        Some((place, line)) => header(&place, line.split(',').map(|cell| cell.trim().trim_matches('"')))?,
        None => Vec::new(),
    };
    for (count, (place, line)) in lines.enumerate() {
        check_count(path, count + 1)?;
        point(&place, line, units, &mut axes)?;
    }
    Ok(axes)
}

/// Parquet, where damage that the reader did not think of is a fault like any other.
fn sound(path: &Path, units: &Units) -> Result<Columns, SpecError> {
    guarded(|| parquet(path, units)).unwrap_or_else(|| Err(unsound(path, &"it is damaged")))
}

fn unsound(path: &Path, error: &dyn Display) -> SpecError {
    let found = format!("cannot read {}: {error}", path.display());
    fault(found, "a Parquet file, uncompressed or with Snappy or Zstandard", "write it so, or as CSV")
}

/// Parquet: columns of numbers, or of text for axes of words, whose names are axes.
///
/// What Arrow or pandas add to a file about its types is not asked for: a column is what Parquet says that it is.
fn parquet(path: &Path, units: &Units) -> Result<Columns, SpecError> {
    let name = path.display();
    check_size(path)?;
    let unsound = |error: &dyn Display| unsound(path, error);
    let file = fs::File::open(path).map_err(|error| unreadable(path, &error))?;
    let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
    // What the file says of itself comes first: a few bytes can stand for any number of rows.
    let metadata = check_footer(&file).and_then(|()| {
        let metadata = ArrowReaderMetadata::load(&file, options)?;
        check_pages(&file, metadata.metadata()).map(|()| metadata)
    });
    let metadata = metadata.map_err(|error| unsound(&error))?;
    let reader = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata);
    let rows = reader.metadata().file_metadata().num_rows();
    check_count(path, usize::try_from(rows).unwrap_or(0))?;
    let mut axes = header(&name, reader.schema().fields().iter().map(|field| field.name().as_str()))?;
    for ((quantity, _), field) in axes.iter().zip(reader.schema().fields()) {
        let (kind, is_word) = (field.data_type(), !quantity.words().is_empty());
        if is_word != (*kind == DataType::Utf8) || !(is_word || kind.is_numeric()) {
            let held = if *kind == DataType::Utf8 { "words".to_owned() } else { kind.to_string() };
            let found = format!("{name}: column `{}` holds {held}", quantity.name());
            return Err(match is_word {
                true => fault(found, "words", "write the column as text"),
                false => fault(found, "numbers", "write the column as numbers"),
            });
        }
    }
    let reader = reader.with_batch_size(BATCH).build().map_err(|error| unsound(&error))?;
    let mut first = 0;
    for batch in reader {
        let batch = batch.map_err(|error| unsound(&error))?;
        check_count(path, first + batch.num_rows())?;
        for ((quantity, values), column) in axes.iter_mut().zip(batch.columns()) {
            let place = |row: usize| format!("{name}: row {} of column `{}`", first + row, quantity.name());
            if let Some(row) = (0..column.len()).find(|&row| column.is_null(row)) {
                let expected = if quantity.words().is_empty() { "a number" } else { "a word" };
                return Err(fault(format!("{}: no value", place(row)), expected, "fill in the value"));
            }
            let words = quantity.words();
            if let Some(text) = column.as_any().downcast_ref::<StringArray>() {
                for (row, cell) in text.iter().enumerate() {
                    values.push(word(|| place(row), &words, cell.unwrap_or_default())?);
                }
                continue;
            }
            let Some(numbers) = numbers(column) else {
                let found = format!("{name}: column `{}` holds {}", quantity.name(), column.data_type());
                return Err(fault(found, "numbers", "write the column as floating-point numbers"));
            };
            for (row, value) in numbers.into_iter().enumerate() {
                values.push(legal(|| place(row), units, *quantity, value)?);
            }
        }
        first += batch.num_rows();
    }
    Ok(axes)
}

/// Rows of a Parquet file that are held as it gives them.
const BATCH: usize = 1 << 16;

/// The values of a column of numbers, none of them null; `None` for decimals and halves.
fn numbers(column: &ArrayRef) -> Option<Vec<f64>> {
    fn all<T: ArrowPrimitiveType>(column: &ArrayRef, number: fn(T::Native) -> f64) -> Option<Vec<f64>> {
        let column: &PrimitiveArray<T> = column.as_primitive_opt()?;
        Some(column.values().iter().map(|value| number(*value)).collect())
    }
    match column.data_type() {
        DataType::Float64 => all::<Float64Type>(column, |x| x),
        DataType::Float32 => all::<Float32Type>(column, f64::from),
        DataType::Int8 => all::<Int8Type>(column, f64::from),
        DataType::Int16 => all::<Int16Type>(column, f64::from),
        DataType::Int32 => all::<Int32Type>(column, f64::from),
        DataType::Int64 => all::<Int64Type>(column, |x| x as f64),
        DataType::UInt8 => all::<UInt8Type>(column, f64::from),
        DataType::UInt16 => all::<UInt16Type>(column, f64::from),
        DataType::UInt32 => all::<UInt32Type>(column, f64::from),
        DataType::UInt64 => all::<UInt64Type>(column, |x| x as f64),
        _ => None,
    }
}

fn unreadable(path: &Path, error: &dyn Display) -> SpecError {
    let found = format!("cannot read {}: {error}", path.display());
    fault(found, "a readable file", "check the path; it is relative to the spec")
}

/// `value` if it is one that `quantity` can have.
fn legal(place: impl Fn() -> String, units: &Units, quantity: Quantity, value: f64) -> Result<f64, SpecError> {
    match super::units::legal(units, quantity, Scale::Model, value) {
        Ok(()) => Ok(value),
        Err(range) => Err(fault(format!("{}: {value:?} is out of range", place()), &range, "correct the value")),
    }
}

/// The place of `cell` among `words`.
fn word(place: impl Fn() -> String, words: &[&str], cell: &str) -> Result<f64, SpecError> {
    match words.iter().position(|word| *word == cell) {
        Some(number) => Ok(number as f64),
        None => {
            let found = format!("{}: unknown word `{}`", place(), shown(cell, MOST_OF_NAME));
            Err(fault(found, &words.join(", "), "correct the word"))
        }
    }
}

fn fault(found: impl Into<Box<str>>, expected: &str, help: &str) -> SpecError {
    SpecError::new("points", found, expected, help)
}

fn header<'a>(place: &impl Display, names: impl Iterator<Item = &'a str>) -> Result<Columns, SpecError> {
    let mut axes: Columns = Vec::new();
    for (number, name) in names.enumerate() {
        if name.is_empty() {
            let found = format!("{place}: column {} has no name", number + 1);
            return Err(fault(found, "the name of an axis over every column", "name it, or remove the column"));
        }
        let Some(quantity) = Quantity::from_name(name) else {
            if let Some(separator) = name.chars().find(|c| matches!(c, ';' | '\t' | '\r')) {
                let found = format!("{place}: columns or lines that end with {separator:?}");
                return Err(fault(found, "columns that end with commas, lines with newlines", "save it as such CSV"));
            }
            let error = unknown("points".to_owned(), "axis", name, &Quantity::ALL.map(Quantity::name));
            return Err(SpecError { found: format!("{place}: {}", error.found).into(), ..error });
        };
        if axes.iter().any(|(other, _)| *other == quantity) {
            let found = format!("{place}: column `{name}` is there twice");
            return Err(fault(found, "each axis once", "remove one of the two"));
        }
        axes.push((quantity, Vec::new()));
    }
    Ok(axes)
}

/// A line of a file, which is put into words only for a message: there are many.
struct Line<'a> {
    file: &'a Path,
    number: usize,
}

impl Display for Line<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file.display(), self.number)
    }
}

fn point(place: &Line<'_>, line: &str, units: &Units, axes: &mut [(Quantity, Vec<f64>)]) -> Result<(), SpecError> {
    let count = line.split(',').count();
    if count != axes.len() {
        let found = format!("{place}: {count} values under {} column names", axes.len());
        return Err(fault(found, "a value for each column", "correct the line"));
    }
    for ((quantity, values), cell) in axes.iter_mut().zip(line.split(',').map(str::trim)) {
        let place = || format!("{place}: column `{}`", quantity.name());
        let words = quantity.words();
        if !words.is_empty() {
            values.push(word(place, &words, cell.trim_matches('"'))?);
            continue;
        }
        let Ok(value) = cell.trim_matches('"').parse::<f64>() else {
            let found = format!("{}: `{}` is not a number", place(), shown(cell, MOST_OF_NAME));
            return Err(fault(found, "a number such as 0.03 or 1e-3", "correct the value"));
        };
        values.push(legal(place, units, *quantity, value)?);
    }
    Ok(())
}
