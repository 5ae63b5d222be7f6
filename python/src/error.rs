//! Errors of the library as exceptions, with the text of the command line.

use pyo3::exceptions::{PyKeyError, PyMemoryError, PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use slipsweep::cli::Failure;
use slipsweep::dataset::DatasetError;
use slipsweep::plot::PlotError;
use slipsweep::sweep::{RowsError, RunError, SpecError};

/// A wrong value or spec.
pub fn spec(error: &SpecError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The failure of a command: exit code 1 means wrong input.
pub fn command(failure: &Failure) -> PyErr {
    let text = failure.message.trim_start_matches("error: ");
    // What follows is about the command line.
    let end = ["\n\nUsage:", "\n\nFor more information"].iter().filter_map(|start| text.find(start)).min();
    let text = text[..end.unwrap_or(text.len())].trim_end().to_owned();
    if failure.code == 1 { PyValueError::new_err(text) } else { PyRuntimeError::new_err(text) }
}

/// Rows that could not be computed.
pub fn rows(error: &RowsError) -> PyErr {
    match error {
        RowsError::Memory { .. } => PyMemoryError::new_err(error.to_string()),
        RowsError::Stopped(_) => PyRuntimeError::new_err(error.to_string()),
    }
}

/// A run that did not finish.
pub fn run(error: &RunError) -> PyErr {
    match error {
        RunError::Dataset(error) => dataset(error),
        RunError::Parts(_) => PyValueError::new_err(error.to_string()),
        _ => PyRuntimeError::new_err(error.to_string()),
    }
}

/// A dataset that cannot be read or written.
pub fn dataset(error: &DatasetError) -> PyErr {
    let text = error.to_string();
    match error {
        DatasetError::Foreign { .. }
        | DatasetError::OtherSpec { .. }
        | DatasetError::OtherTables { .. }
        | DatasetError::ForeignPart { .. }
        | DatasetError::Occupied { .. } => PyValueError::new_err(text),
        DatasetError::Io { .. } => PyOSError::new_err(text),
        _ => PyRuntimeError::new_err(text),
    }
}

/// A picture that cannot be drawn.
pub fn plot(error: &PlotError) -> PyErr {
    match error {
        PlotError::Part(_) | PlotError::Trace(_) => PyRuntimeError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// A name that is not among `known`, in one line: Python shows a `KeyError` with escapes.
pub fn missing(what: &str, name: &str, known: &[String]) -> PyErr {
    PyKeyError::new_err(format!("no {what} `{name}`; expected {}", known.join(", ")))
}

/// Anything that is a defect of the package or of a file.
pub fn defect(error: impl std::fmt::Display) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}
