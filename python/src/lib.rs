//! The extension module of the Python package: arguments in, a call of the library, Arrow out.
//!
//! Python sources in `slipsweep` make functions and classes of it; nothing here knows a table or an axis by name.

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

mod compute;
mod dataset;
mod definitions;
mod error;
mod rows;
mod sweep;
mod threads;
mod trace;

use pyo3::prelude::*;

/// The extension module.
#[pymodule(gil_used = false)]
mod _core {
    use std::ffi::OsString;

    use pyo3::prelude::*;

    #[pymodule_export]
    use super::compute::compute;
    #[pymodule_export]
    use super::dataset::{Dataset, picture};
    #[pymodule_export]
    use super::definitions::{protocols, tables};
    #[pymodule_export]
    use super::rows::{Buffer, Rows};
    #[pymodule_export]
    use super::sweep::Sweep;
    #[pymodule_export]
    use super::trace::{Trace, plot_traces, trace};

    /// Runs the command line; returns the exit code.
    #[pyfunction]
    fn main(py: Python<'_>, arguments: Vec<OsString>, stdout_is_closed: bool) -> u8 {
        py.detach(|| slipsweep::cli::main_of(arguments.into_iter(), stdout_is_closed))
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
