//! `points`: a file of points whose columns are axes that vary together.

use std::fmt::Display;
use std::fs;
use std::path::Path;

use super::error::{SpecError, unknown};
use crate::grid::{Axis, Factor, Quantity, Scale, Values};

/// Reads the points of a CSV file: a header of axis names, then a point a line. Empty lines and lines that begin with # are passed over.
///
/// Values of coefficients are in the units of the model.
pub fn read(path: &Path) -> Result<Factor, SpecError> {
    let name = path.display();
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("csv")) {
        let (expected, help) = ("a file whose name ends in .csv", "write the points as CSV");
        return Err(fault(format!("{name}: not a CSV file"), expected, help));
    }
    let text = fs::read_to_string(path).map_err(|error| {
        fault(
            format!("cannot read {name}: {error}"),
            "a readable text file",
            "check the path; it is relative to the spec",
        )
    })?;
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(index, line)| (format!("{name}:{}", index + 1), line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let mut axes = match lines.next() {
        Some((place, line)) => header(&place, line)?,
        None => Vec::new(),
    };
    for (place, line) in lines {
        point(&place, line, &mut axes)?;
    }
    if axes.iter().all(|axis| axis.1.is_empty()) {
        let (expected, help) = ("a header and at least one line of values", "add points, or remove `points`");
        return Err(fault(format!("{name}: no points"), expected, help));
    }
    let axis = |(quantity, values)| Axis { quantity, scale: Scale::Model, values: Values::List(values) };
    Ok(Factor { axes: axes.into_iter().map(axis).collect() })
}

fn fault(found: impl Into<Box<str>>, expected: &str, help: &str) -> SpecError {
    SpecError::new("points", found, expected, help)
}

fn header(place: &impl Display, line: &str) -> Result<Vec<(Quantity, Vec<f64>)>, SpecError> {
    let mut axes: Vec<(Quantity, Vec<f64>)> = Vec::new();
    for cell in line.split(',') {
        // Some programs quote the names of columns.
        let name = cell.trim().trim_matches('"');
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
        let Ok(value) = cell.parse::<f64>() else {
            let found = format!("{place}: `{cell}` is not a number");
            return Err(fault(found, "a number such as 0.03 or 1e-3", "correct the cell"));
        };
        if !quantity.domain().contains(value) {
            let found = format!("{place}: {value:?} is out of range");
            return Err(fault(found, quantity.domain().text, "correct the cell"));
        }
        values.push(value);
    }
    Ok(())
}
