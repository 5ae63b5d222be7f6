//! A table over arguments of a function.

use std::ffi::CString;
use std::sync::Arc;

use pyo3::buffer::PyBuffer;
use pyo3::exceptions::{PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyInt, PyList, PyString};
use slipsweep::grid::{Quantity, Scale};
use slipsweep::sweep::{Direct, Given, ModelSpec, Sweep, word};
use slipsweep::table::{self, Signal};

use crate::error;
use crate::rows::Rows;
use crate::threads::{interruptible, stopper};

/// Cost up to which a row is computed on the thread of the caller, in nanoseconds. Chosen: twice the time that it takes to wake another thread and
/// to be woken by it.
const MAX_INLINE_NS: u64 = 50_000;

/// Values of an axis up to which the thread of the caller checks them. Chosen: they take less than a millisecond.
const MAX_INLINE_VALUES: usize = 10_000;

/// Levels of the stack from here to the caller of a function of a table.
const CALLER: i32 = 3;

/// Model and units: the keys of `[model]` in a spec.
type Model = (bool, String, String, Option<f64>, Option<f64>, Option<f64>, Option<f64>);

/// Whether coefficients are relative to the duration; the columns, the accuracy, model and units.
type Options = (bool, Option<Vec<String>>, Option<f64>, Option<Model>);

/// A table and its rows. `values` has those of each axis of the table, `None` for the default; `grid` those of the axes of a product.
#[pyfunction]
pub fn compute(
    py: Python<'_>,
    name: &str,
    values: Vec<Bound<'_, PyAny>>,
    grid: Vec<(String, Bound<'_, PyAny>)>,
    options: Options,
) -> PyResult<Rows> {
    let (is_relative, columns, rtol, model) = options;
    let known = || table::ALL.iter().map(|table| table.name().to_owned()).collect::<Vec<_>>();
    let table = table::ALL.into_iter().find(|table| table.name() == name);
    let table = table.ok_or_else(|| error::missing("table", name, &known()))?;
    let points = given(Quantity::ALL.into_iter().filter(|axis| table.axes().contains(axis)).zip(&values))?;
    let grid = grid.iter().map(|(name, value)| Ok((known_axis(name)?, value))).collect::<PyResult<Vec<_>>>()?;
    let grid = given(grid.into_iter())?;
    let is_short = points.iter().chain(&grid).all(|(_, values)| values.len() <= MAX_INLINE_VALUES);
    let scale = if is_relative { Scale::Duration } else { Scale::Model };
    let model = model.map_or_else(ModelSpec::default, model_of);
    let checked = move || {
        let columns = columns.as_deref();
        Sweep::direct(Direct { table, points, grid, scale, model, rtol, columns })
    };
    let sweep = if is_short { checked() } else { interruptible(py, || (), checked)? };
    let sweep = Arc::new(sweep.map_err(|error| error::spec(&error))?);
    for warning in &sweep.warnings {
        let text = CString::new(warning.to_string()).map_err(error::defect)?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, CALLER)?;
    }
    rows(py, sweep, 0)
}

/// The rows of a requested table of a sweep.
pub fn rows(py: Python<'_>, sweep: Arc<Sweep>, request: usize) -> PyResult<Rows> {
    let signal = Arc::new(Signal::default());
    let cheap = |request: &slipsweep::sweep::Request| request.rows <= 1 && request.table.cost() <= MAX_INLINE_NS;
    if cheap(&sweep.requests[request]) {
        let buffer = sweep.rows(&sweep.requests[request], &signal).map_err(|error| error::rows(&error))?;
        return Ok(Rows::single(sweep, request, buffer));
    }
    let (ours, its) = (sweep.clone(), signal.clone());
    let work = move || {
        let request = &ours.requests[request];
        ours.rows(request, &its).map(|buffer| ours.record_batch(request, buffer))
    };
    let batch = interruptible(py, stopper(&signal), work)?.map_err(|error| error::rows(&error))?;
    Ok(Rows::computed(sweep, request, batch.map_err(error::defect)?))
}

fn model_of((velocity_bound, friction, units, mu_0, l, v_0, normal_stress): Model) -> ModelSpec {
    ModelSpec { velocity_bound, friction, units, mu_0, l, v_0, normal_stress }
}

/// The axis of a product.
fn known_axis(name: &str) -> PyResult<Quantity> {
    let known = Quantity::ALL.map(Quantity::name).join(", ");
    Quantity::from_name(name).ok_or_else(|| {
        PyValueError::new_err(format!("grid: unknown axis `{name}`\n  expected: {known}\n  help: correct the name"))
    })
}

fn given<'a, 'py: 'a>(values: impl Iterator<Item = (Quantity, &'a Bound<'py, PyAny>)>) -> PyResult<Given> {
    let values = values.filter(|(_, value)| !value.is_none());
    values.map(|(quantity, value)| Ok((quantity, numbers(quantity, value)?))).collect()
}

/// A number, a word, a list of words, or a contiguous array of doubles.
fn numbers(quantity: Quantity, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let place = |text: &str| word(quantity.name(), quantity, text).map_err(|error| error::spec(&error));
    let is_number = || !quantity.words().is_empty();
    if value.is_instance_of::<PyFloat>() || value.is_instance_of::<PyInt>() {
        if is_number() {
            return Err(error::spec(&wrong(quantity, &value.to_string())));
        }
        return Ok(vec![value.extract()?]);
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(vec![place(&text.to_cow()?)?]);
    }
    if let Ok(words) = value.cast::<PyList>() {
        return words.iter().map(|text| place(&text.cast::<PyString>()?.to_cow()?)).collect();
    }
    if is_number() {
        return Err(error::spec(&wrong(quantity, "numbers")));
    }
    PyBuffer::<f64>::get(value)?.to_vec(value.py())
}

/// The fault of a number for a word.
fn wrong(quantity: Quantity, found: &str) -> slipsweep::sweep::SpecError {
    let words = quantity.words().join(", ");
    slipsweep::sweep::SpecError::new(
        quantity.name(),
        format!("found {found}"),
        format!("one of {words}"),
        "write a word",
    )
}
