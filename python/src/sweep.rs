//! A checked spec, its plan and its run.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use slipsweep::cli::text;
use slipsweep::dataset::Folder;
use slipsweep::sweep::{self, Plan, SpecError, estimate};
use slipsweep::table::{Phase, Signal};

use crate::compute;
use crate::error;
use crate::rows::Rows;
use crate::threads::{self, interruptible, stopper};

/// A checked spec.
#[pyclass(frozen, module = "slipsweep._core")]
pub struct Sweep(Arc<sweep::Sweep>);

/// Faults of a spec that no file holds: their lines are not those of anything that the caller wrote.
fn without_line(fault: SpecError) -> SpecError {
    fault.each(|fault| fault.line = None)
}

#[pymethods]
impl Sweep {
    /// The spec in a TOML file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Sweep> {
        let sweep = interruptible(py, || (), move || sweep::Sweep::load(&path))?;
        Ok(Sweep(Arc::new(sweep.map_err(|fault| error::spec(&fault))?)))
    }

    /// The spec in `text`, made from a dict; its files are relative to `folder`.
    #[staticmethod]
    fn parse(py: Python<'_>, text: String, folder: PathBuf) -> PyResult<Sweep> {
        let sweep = interruptible(py, || (), move || sweep::Sweep::parse(&text, &folder))?;
        Ok(Sweep(Arc::new(sweep.map_err(|fault| error::spec(&without_line(fault)))?)))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn description(&self) -> &str {
        &self.0.description
    }

    #[getter]
    fn text(&self) -> &str {
        &self.0.text
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.iter().map(ToString::to_string).collect()
    }

    /// Name and rows of every table.
    #[getter]
    fn tables(&self) -> Vec<(&'static str, u64)> {
        self.0.requests.iter().map(|request| (request.table.name(), request.rows)).collect()
    }

    /// What `slipsweep plan` prints, from a sample written below `out`.
    fn plan(&self, py: Python<'_>, out: PathBuf) -> PyResult<String> {
        let sweep = self.0.clone();
        let work = move || {
            estimate(&sweep, &out).map(|estimates| format!("{}\n{}", sweep.name, text::plan(&sweep, &estimates, 0.0)))
        };
        interruptible(py, || (), work)?.map_err(|error| error::run(&error))
    }

    /// The rows of a table in memory.
    fn rows(&self, py: Python<'_>, table: &str) -> PyResult<Rows> {
        let known: Vec<String> = self.tables().into_iter().map(|(name, _)| name.to_owned()).collect();
        let request = known.iter().position(|name| name == table);
        let request = request.ok_or_else(|| error::missing("table", table, &known))?;
        compute::rows(py, self.0.clone(), request)
    }

    /// Computes the missing parts of the dataset in `out`, and calls `progress` with the phase, the rows done and all rows. Returns the folder.
    fn run(&self, py: Python<'_>, out: PathBuf, threads: usize, progress: Option<Py<PyAny>>) -> PyResult<PathBuf> {
        let folder = Folder::new(&out, &self.0.name);
        let path = folder.path().to_owned();
        let rows = self.0.requests.iter().map(|request| request.rows).fold(0_u64, u64::saturating_add);
        let signal = Arc::new(Signal::default());
        let (sweep, its) = (self.0.clone(), signal.clone());
        let work = move || sweep::run(&sweep, &folder, threads, &its);
        let look = |py: Python<'_>| match &progress {
            Some(progress) => {
                let phase = match signal.phase() {
                    Phase::Checking => "checking",
                    Phase::Computing => "computing",
                    Phase::Writing => "writing",
                };
                progress.call1(py, (phase, signal.rows() + signal.kept(), rows)).map(drop)
            }
            None => Ok(()),
        };
        let done = threads::run(py, stopper(&signal), look, work)?;
        done.map(|_| path).map_err(|error| error::run(&error))
    }

    /// Rows that a run would compute or keep.
    #[getter]
    fn row_count(&self) -> u64 {
        Plan::new(&self.0).tables.iter().map(|table| table.rows).fold(0, u64::saturating_add)
    }
}
