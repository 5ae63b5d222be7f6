//! The definitions of tables, axes and columns, from which Python makes functions, docstrings and stubs.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use slipsweep::grid::{Quantity, Scale};
use slipsweep::model::Units;
use slipsweep::table::{self, Column, Kind, Table};
use slipsweep::trace;

/// Every table: its name, meaning, axes and columns.
#[pyfunction]
pub fn tables(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let tables: Vec<_> = table::ALL.into_iter().map(|table| definition(py, table)).collect::<PyResult<_>>()?;
    PyList::new(py, tables)
}

fn definition<'py>(py: Python<'py>, table: &Table) -> PyResult<Bound<'py, PyDict>> {
    let axes = Quantity::ALL.into_iter().filter(|axis| table.axes().contains(axis));
    let axes: Vec<_> = axes.map(|quantity| axis(py, quantity)).collect::<PyResult<_>>()?;
    let columns: Vec<_> = table.columns().iter().map(|one| column(py, one)).collect::<PyResult<_>>()?;
    let dict = PyDict::new(py);
    dict.set_item("name", table.name())?;
    dict.set_item("doc", table.doc())?;
    dict.set_item("default_rtol", table.default_rtol())?;
    dict.set_item("axes", axes)?;
    dict.set_item("columns", columns)?;
    Ok(dict)
}

fn axis(py: Python<'_>, quantity: Quantity) -> PyResult<Bound<'_, PyDict>> {
    let default = match quantity.default().as_slice() {
        [one] if quantity.words().is_empty() && !quantity.is_tacit() => Some(*one),
        _ => None,
    };
    let dict = PyDict::new(py);
    dict.set_item("name", quantity.name())?;
    dict.set_item("doc", quantity.doc())?;
    dict.set_item("unit", quantity.unit(Scale::Model))?;
    dict.set_item("scales", quantity.scales().iter().map(|scale| quantity.unit(*scale)).collect::<Vec<_>>())?;
    dict.set_item("range", quantity.domain().to_string())?;
    dict.set_item("words", quantity.words())?;
    dict.set_item("default", default)?;
    dict.set_item("default_count", quantity.default().len())?;
    dict.set_item("is_tacit", quantity.is_tacit())?;
    Ok(dict)
}

fn column<'py>(py: Python<'py>, column: &Column) -> PyResult<Bound<'py, PyDict>> {
    let (unit, words, kind) = match column.kind {
        Kind::Number(unit) => (Units::Scaled.name(unit), Vec::new(), "number"),
        // As in a call: relative to the duration where the table has no such axis.
        Kind::Quantity(quantity) => (quantity.unit(Scale::Duration), Vec::new(), "number"),
        Kind::Label(words) => ("", words.to_vec(), "word"),
        Kind::Flag => ("", Vec::new(), "flag"),
    };
    let dict = PyDict::new(py);
    dict.set_item("name", column.name)?;
    dict.set_item("doc", column.doc)?;
    dict.set_item("unit", unit)?;
    dict.set_item("kind", kind)?;
    dict.set_item("words", words)?;
    dict.set_item("is_optional", column.optional)?;
    Ok(dict)
}

/// The protocols that can be traced, with their meanings.
#[pyfunction]
pub fn protocols() -> Vec<(&'static str, &'static str)> {
    trace::names().collect()
}
