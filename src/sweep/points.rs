//! `points`: a file of points whose columns are axes that vary together.

use std::path::Path;

use super::error::{SpecError, unknown};
use crate::grid::{Axis, Factor, Quantity, Scale, Values};

/// Reads the points of a CSV file; values of coefficients are in the units of the model.
pub fn read(path: &Path) -> Result<Factor, SpecError> {
    let fault = |found: String, expected: &str, help: &str| SpecError::new("points", found, expected, help);
    let name = path.display();
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("csv")) {
        return Err(fault(
            format!("{name}: not a CSV file"),
            "a file whose name ends in .csv",
            "write the points as CSV",
        ));
    }
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_path(path).map_err(|error| {
            fault(
                format!("cannot read {name}: {}", cause(&error)),
                "a readable file",
                "check the path; it is relative to the spec",
            )
        })?;
    let headers = reader.headers().map_err(|error| broken(&name, &error))?.clone();
    let mut axes: Vec<(Quantity, Vec<f64>)> = Vec::new();
    for header in &headers {
        let Some(quantity) = Quantity::from_name(header) else {
            let known = Quantity::ALL.map(Quantity::name);
            let error = unknown("points".to_owned(), "axis", header, &known);
            return Err(SpecError { found: format!("{name}:1: {}", error.found), ..error });
        };
        if axes.iter().any(|(other, _)| *other == quantity) {
            return Err(fault(
                format!("{name}:1: column `{header}` is there twice"),
                "each axis once",
                "remove one of the two",
            ));
        }
        axes.push((quantity, Vec::new()));
    }
    for record in reader.records() {
        let record = record.map_err(|error| broken(&name, &error))?;
        let line = record.position().map_or(0, csv::Position::line);
        for ((quantity, values), cell) in axes.iter_mut().zip(&record) {
            let place = format!("{name}:{line}: column `{}`", quantity.name());
            let value: f64 = cell.parse().map_err(|_| {
                fault(format!("{place}: `{cell}` is not a number"), "a number such as 0.03 or 1e-3", "correct the cell")
            })?;
            if !quantity.domain().contains(value) {
                return Err(fault(
                    format!("{place}: {value:?} is out of range"),
                    quantity.domain().text,
                    "correct the cell",
                ));
            }
            values.push(value);
        }
    }
    if axes.first().is_none_or(|(_, values)| values.is_empty()) {
        return Err(fault(
            format!("{name}: no points"),
            "a header and at least one line of values",
            "add points, or remove `points`",
        ));
    }
    let axes = axes
        .into_iter()
        .map(|(quantity, values)| Axis { quantity, scale: Scale::Model, values: Values::List(values) })
        .collect();
    Ok(Factor { axes })
}

/// What the system says, without the path that the message names already.
fn cause(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::Io(error) => error.to_string(),
        _ => error.to_string(),
    }
}

fn broken(name: &impl std::fmt::Display, error: &csv::Error) -> SpecError {
    let found = match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let line = pos.as_ref().map_or(0, csv::Position::line);
            format!("{name}:{line}: {len} cells in a file of {expected_len} columns")
        }
        csv::ErrorKind::Utf8 { pos, .. } => {
            format!("{name}:{}: not UTF-8 text", pos.as_ref().map_or(0, csv::Position::line))
        }
        _ => format!("cannot read {name}: {}", cause(error)),
    };
    SpecError::new("points", found, "CSV: a header of axis names, then one point a line", "correct the file")
}
