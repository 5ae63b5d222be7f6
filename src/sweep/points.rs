//! `points`: a file of points whose columns are axes that vary together.

use std::fmt::Display;
use std::fs;
use std::path::Path;

use polars::prelude::{DataType, ParquetReader, SerReader};

use super::error::{SpecError, unknown};
use crate::grid::{Axis, Factor, Quantity, Scale, Values};

/// Reads the points of a CSV or Parquet file; values of coefficients are in the units of the model.
pub fn read(path: &Path) -> Result<Factor, SpecError> {
    let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
    let axes = match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("csv") => csv(path)?,
        Some("parquet") => parquet(path)?,
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

/// Columns of a file of points.
type Columns = Vec<(Quantity, Vec<f64>)>;

/// CSV: a header of axis names, then a point a line. Empty lines and lines that begin with # are passed over.
fn csv(path: &Path) -> Result<Columns, SpecError> {
    let name = path.display();
    let text = fs::read_to_string(path).map_err(|error| unreadable(path, &error))?;
    // Spreadsheets put a byte order mark in front, and quotes around cells.
    let mut lines = text
        .trim_start_matches('\u{feff}')
        .lines()
        .enumerate()
        .map(|(index, line)| (format!("{name}:{}", index + 1), line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let mut axes = match lines.next() {
        // Some programs quote the names of columns.
        Some((place, line)) => header(&place, line.split(',').map(|cell| cell.trim().trim_matches('"')))?,
        None => Vec::new(),
    };
    for (place, line) in lines {
        point(&place, line, &mut axes)?;
    }
    Ok(axes)
}

/// Parquet: columns of numbers whose names are axes.
fn parquet(path: &Path) -> Result<Columns, SpecError> {
    let name = path.display();
    let file = fs::File::open(path).map_err(|error| unreadable(path, &error))?;
    let frame = ParquetReader::new(file).finish().map_err(|error| unreadable(path, &error))?;
    let mut axes = header(&name, frame.columns().iter().map(|column| column.name().as_str()))?;
    for ((quantity, values), column) in axes.iter_mut().zip(frame.columns()) {
        let words = quantity.words();
        if !words.is_empty() {
            let found = || format!("{name}: column `{}` holds {}", quantity.name(), column.dtype());
            let text =
                column.cast(&DataType::String).map_err(|_| fault(found(), "words", "write the column as text"))?;
            let text = text.str().map_err(|error| unreadable(path, &error))?;
            for (row, cell) in text.iter().enumerate() {
                let place = format!("{name}: row {row} of column `{}`", quantity.name());
                values.push(word(&place, &words, cell.unwrap_or_default())?);
            }
            continue;
        }
        let numbers = column.dtype().is_primitive_numeric().then(|| column.cast(&DataType::Float64));
        let Some(Ok(numbers)) = numbers else {
            let found = format!("{name}: column `{}` holds {}", quantity.name(), column.dtype());
            return Err(fault(found, "numbers", "write the column as numbers"));
        };
        let numbers = numbers.f64().map_err(|error| unreadable(path, &error))?;
        for (row, value) in numbers.iter().enumerate() {
            let place = format!("{name}: row {row} of column `{}`", quantity.name());
            let Some(value) = value else {
                return Err(fault(format!("{place}: no value"), "a number", "fill in the value"));
            };
            values.push(legal(&place, *quantity, value)?);
        }
    }
    Ok(axes)
}

fn unreadable(path: &Path, error: &dyn Display) -> SpecError {
    let found = format!("cannot read {}: {error}", path.display());
    fault(found, "a readable file", "check the path; it is relative to the spec")
}

fn legal(place: &dyn Display, quantity: Quantity, value: f64) -> Result<f64, SpecError> {
    if quantity.domain().contains(value) {
        return Ok(value);
    }
    Err(fault(format!("{place}: {value:?} is out of range"), quantity.domain().text, "correct the value"))
}

/// The place of `cell` among `words`.
fn word(place: &dyn Display, words: &[&str], cell: &str) -> Result<f64, SpecError> {
    match words.iter().position(|word| *word == cell) {
        Some(number) => Ok(number as f64),
        None => Err(fault(format!("{place}: unknown word `{cell}`"), &words.join(", "), "correct the word")),
    }
}

fn fault(found: impl Into<Box<str>>, expected: &str, help: &str) -> SpecError {
    SpecError::new("points", found, expected, help)
}

fn header<'a>(place: &impl Display, names: impl Iterator<Item = &'a str>) -> Result<Columns, SpecError> {
    let mut axes: Columns = Vec::new();
    for name in names {
        let Some(quantity) = Quantity::from_name(name) else {
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

fn point(place: &impl Display, line: &str, axes: &mut [(Quantity, Vec<f64>)]) -> Result<(), SpecError> {
    let cells: Vec<&str> = line.split(',').map(str::trim).collect();
    if cells.len() != axes.len() {
        let found = format!("{place}: {} values under {} column names", cells.len(), axes.len());
        return Err(fault(found, "a value for each column", "correct the line"));
    }
    for ((quantity, values), cell) in axes.iter_mut().zip(cells) {
        let place = format!("{place}: column `{}`", quantity.name());
        let words = quantity.words();
        if !words.is_empty() {
            values.push(word(&place, &words, cell.trim_matches('"'))?);
            continue;
        }
        let Ok(value) = cell.trim_matches('"').parse::<f64>() else {
            let found = format!("{place}: `{cell}` is not a number");
            return Err(fault(found, "a number such as 0.03 or 1e-3", "correct the value"));
        };
        values.push(legal(&place, *quantity, value)?);
    }
    Ok(())
}
