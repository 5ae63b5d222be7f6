//! One protocol over time.

use pyo3::prelude::*;
use slipsweep::cli::text::{Traced, traced};
use slipsweep::plot::trace::{TraceFile, figure};
use slipsweep::plot::{COLUMN, PAGE};
use slipsweep::trace::record_batch;

use crate::error::{self, defect};
use crate::rows::Rows;
use crate::threads::interruptible;

/// A protocol over time.
#[pyclass(frozen, module = "slipsweep._core")]
pub struct Trace(Traced);

/// The protocol that the arguments of `slipsweep trace` name.
#[pyfunction]
pub fn trace(py: Python<'_>, arguments: Vec<String>) -> PyResult<Trace> {
    let traced = interruptible(py, || (), move || traced(&arguments))?;
    traced.map(Trace).map_err(|failure| error::command(&failure))
}

#[pymethods]
impl Trace {
    /// Protocol, parameters, work and status in a few lines.
    #[getter]
    fn header(&self) -> &str {
        &self.0.header
    }

    /// Its facts as keys and values.
    #[getter]
    fn facts(&self) -> Vec<(String, String)> {
        self.0.facts.clone()
    }

    /// The moments.
    fn rows(&self) -> PyResult<Rows> {
        let batch = record_batch(&self.0.trace, &self.0.units).map_err(defect)?;
        Ok(Rows::read(crate::rows::with_nan(batch).map_err(defect)?))
    }
}

/// The picture of traces as SVG.
#[pyfunction]
#[pyo3(signature = (traces, x=None, y=None, width=None))]
pub fn plot_traces(
    traces: Vec<PyRef<'_, Trace>>,
    x: Option<&str>,
    y: Option<&str>,
    width: Option<f64>,
) -> PyResult<String> {
    let files = traces.iter().map(|trace| TraceFile::of(&trace.0.trace, &trace.0.units, &trace.0.facts));
    let figure = figure(&files.collect::<Vec<_>>(), [x, y]).map_err(|error| error::plot(&error))?;
    let width = width.unwrap_or(if figure.columns > 1 { PAGE } else { COLUMN });
    Ok(figure.draw(width).svg)
}
