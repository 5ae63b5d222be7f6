//! A dataset on disk: its tables, pictures, summary and audit.

use std::path::PathBuf;

use arrow_array::RecordBatch;
use arrow_select::concat::concat_batches;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;
use slipsweep::cli::text;
use slipsweep::dataset::{CheckDepth, Folder, Manifest, ManifestTable, Survey};
use slipsweep::plot::table::{Condition, Request, Source};
use slipsweep::plot::{COLUMN, Format, PAGE};
use slipsweep::sweep::units_of;
use slipsweep::table;
use slipsweep::verify::{VerifyError, verify};

use crate::error::{self, defect};
use crate::rows::{Rows, with_nan};
use crate::threads::interruptible;

/// The arguments of a picture: conditions, x, y, colour and width in millimetres.
pub type PlotArguments = (Vec<String>, Option<String>, Option<String>, Option<String>, Option<f64>);

/// The folder of a dataset.
#[pyclass(frozen, module = "slipsweep._core")]
pub struct Dataset {
    folder: Folder,
    manifest: Manifest,
}

impl Dataset {
    fn table(&self, name: &str) -> PyResult<ManifestTable> {
        let found = self.manifest.tables.iter().find(|table| table.name == name);
        found.cloned().ok_or_else(|| {
            let known: Vec<String> = self.manifest.tables.iter().map(|table| table.name.clone()).collect();
            error::missing("table", name, &known)
        })
    }
}

#[pymethods]
impl Dataset {
    /// The dataset in `path`.
    #[staticmethod]
    fn open(path: PathBuf) -> PyResult<Dataset> {
        let (folder, manifest) = slipsweep::cli::dataset(&path).map_err(|failure| error::command(&failure))?;
        Ok(Dataset { folder, manifest })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.manifest.name
    }

    #[getter]
    fn version(&self) -> &str {
        &self.manifest.build.version
    }

    #[getter]
    fn spec(&self) -> &str {
        &self.manifest.spec
    }

    /// Name, meaning and rows of every table.
    #[getter]
    fn tables(&self) -> Vec<(String, &'static str, u64)> {
        let doc = |name: &str| table::find(name).map_or("", |table| table.doc());
        self.manifest.tables.iter().map(|table| (table.name.clone(), doc(&table.name), table.rows)).collect()
    }

    /// The present files of a table, and the number of missing ones.
    fn parts(&self, py: Python<'_>, name: &str) -> PyResult<(Vec<PathBuf>, u64)> {
        let table = self.table(name)?;
        let (folder, manifest) = (self.folder.clone(), self.manifest.clone());
        let work = move || folder.verified(&manifest, &table);
        interruptible(py, || (), work)?.map_err(|error| error::dataset(&error))
    }

    /// The present rows of a table.
    fn rows(&self, py: Python<'_>, name: &str) -> PyResult<Rows> {
        let (paths, _) = self.parts(py, name)?;
        let read = move || -> Result<Option<RecordBatch>, String> {
            let parts: Result<Vec<Vec<RecordBatch>>, String> = paths.par_iter().map(read_part).collect();
            let batches: Vec<RecordBatch> = parts?.into_iter().flatten().collect();
            let Some(first) = batches.first() else { return Ok(None) };
            let whole = concat_batches(&first.schema(), &batches).and_then(with_nan);
            whole.map(Some).map_err(|error| error.to_string())
        };
        let rows = interruptible(py, || (), read)?.map_err(defect)?.map(Rows::read);
        rows.ok_or_else(|| {
            let help = "run the spec: it computes what is missing";
            PyValueError::new_err(format!("`{name}` has no rows yet\n  help: {help}"))
        })
    }

    /// The picture of a table as SVG.
    fn plot(&self, py: Python<'_>, name: String, arguments: PlotArguments) -> PyResult<String> {
        let units = units_of(&self.manifest.spec).map_err(|fault| error::spec(&fault))?;
        let source = Source::new(self.folder.clone(), self.manifest.clone(), units);
        interruptible(py, || (), move || svg(&source, &name, &arguments))?
    }

    /// What `slipsweep summary` prints.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        let (folder, manifest) = (self.folder.clone(), self.manifest.clone());
        let work = move || {
            let survey = Survey::new(&folder, &manifest, CheckDepth::Footer);
            let tables = survey.tables.iter().map(|table| text::summary(&table.name, table.rows, &table.statistics));
            tables.collect::<Vec<_>>().join("\n")
        };
        interruptible(py, || (), work)
    }

    /// What `slipsweep verify` prints, and how many numbers differ too much.
    fn verify(&self, py: Python<'_>, sample: u64, seed: u64) -> PyResult<(String, usize)> {
        let (path, manifest) = (self.folder.path().to_owned(), self.manifest.clone());
        let work = move || {
            let audits = verify(&path, &manifest, sample, seed)?;
            Ok::<_, VerifyError>((text::audit(&audits), audits.iter().map(|audit| audit.errors).sum()))
        };
        interruptible(py, || (), work)?.map_err(defect)
    }
}

/// The rows of a part.
fn read_part(path: &PathBuf) -> Result<Vec<RecordBatch>, String> {
    let wrong = |error: &dyn std::fmt::Display| format!("{}: cannot be read as Parquet: {error}", path.display());
    let file = std::fs::File::open(path).map_err(|error| wrong(&error))?;
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|error| wrong(&error))?;
    let rows = usize::try_from(builder.metadata().file_metadata().num_rows()).unwrap_or(0);
    let reader = builder.with_batch_size(rows.max(1)).build().map_err(|error| wrong(&error))?;
    reader.collect::<Result<_, _>>().map_err(|error| wrong(&error))
}

/// A picture of a table as SVG.
pub fn svg(source: &Source, table: &str, arguments: &PlotArguments) -> PyResult<String> {
    let (conditions, x, y, colour, width) = arguments;
    let mut all = Vec::new();
    for text in conditions {
        all.extend(Condition::all(text).map_err(|error| error::plot(&error))?);
    }
    let request = Request { conditions: all, x: x.clone(), y: y.clone(), colour: colour.clone() };
    let figure = source.figure(table, &request).map_err(|error| error::plot(&error))?;
    let width = width.unwrap_or(if figure.columns > 1 { PAGE } else { COLUMN });
    Ok(figure.draw(width).svg)
}

/// A picture as the bytes of a file, in the format of its ending.
#[pyfunction]
pub fn picture(svg: &str, path: PathBuf, dpi: f64) -> PyResult<Vec<u8>> {
    let format = Format::of(&path).ok_or_else(|| {
        let found = format!("{}: the name ends in none of .svg, .png, .pdf", path.display());
        PyValueError::new_err(format!("{found}\n  help: give it one of these endings"))
    })?;
    format.encode(svg, dpi).map_err(|error| error::plot(&error))
}
