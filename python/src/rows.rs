//! Rows of a table in memory: Arrow by the PyCapsule interface, and the buffers of its columns.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock};

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, ArrayRef, Float64Array, RecordBatch, StructArray};
use arrow_ipc::reader::StreamReader;
use arrow_ipc::writer::StreamWriter;
use arrow_schema::{ArrowError, DataType};
use pyo3::exceptions::PyValueError;
use pyo3::ffi;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule};
use pyo3_arrow::ffi::ArrayIterator;
use slipsweep::dataset::{Concurrency, Folder, Footer, Layout, encode};
use slipsweep::plot::table::Source;
use slipsweep::protocol::Status;
use slipsweep::sweep::{Plan, Sweep};
use slipsweep::table::{ColumnBuffer, Kind};

use crate::dataset::{PlotArguments, svg};
use crate::error::{self, defect};
use crate::threads::interruptible;

/// The values of a column: bytes that NumPy reads without a copy.
#[pyclass(frozen, module = "slipsweep._core")]
pub struct Buffer(arrow_buffer::Buffer);

#[pymethods]
impl Buffer {
    #[allow(unsafe_code)]
    unsafe fn __getbuffer__(slf: PyRef<'_, Self>, view: *mut ffi::Py_buffer, flags: std::ffi::c_int) -> PyResult<()> {
        let (bytes, length) = (slf.0.as_ptr(), slf.0.len());
        // The view owns a reference to this object, which owns the bytes and never changes them.
        let filled = unsafe {
            ffi::PyBuffer_FillInfo(view, slf.as_ptr(), bytes as *mut std::ffi::c_void, length as isize, 1, flags)
        };
        if filled == 0 { Ok(()) } else { Err(PyErr::fetch(slf.py())) }
    }
}

/// Name, unit, meaning and type of a column, and whether cells may be missing.
type Field = (String, String, String, &'static str, bool);

/// A number, or a word.
#[derive(IntoPyObject)]
pub enum Cell {
    Number(f64),
    Word(&'static str),
}

/// The origin of computed rows, and the numbers of a single row before a request for Arrow.
struct Computed {
    sweep: Arc<Sweep>,
    request: usize,
    buffer: Mutex<Option<ColumnBuffer>>,
}

/// Rows of a table.
#[pyclass(frozen, module = "slipsweep._core")]
pub struct Rows {
    computed: Option<Computed>,
    batch: OnceLock<RecordBatch>,
    length: usize,
}

impl Rows {
    /// The rows of a requested table of a sweep.
    pub fn computed(sweep: Arc<Sweep>, request: usize, batch: RecordBatch) -> Rows {
        let length = batch.num_rows();
        let computed = Computed { sweep, request, buffer: Mutex::default() };
        Rows { computed: Some(computed), batch: OnceLock::from(batch), length }
    }

    /// The columns before their conversion to Arrow, which takes as long as a single row.
    pub fn single(sweep: Arc<Sweep>, request: usize, buffer: ColumnBuffer) -> Rows {
        let length = buffer.status.len();
        let computed = Computed { sweep, request, buffer: Mutex::new(Some(buffer)) };
        Rows { computed: Some(computed), batch: OnceLock::new(), length }
    }

    /// Rows that were read.
    pub fn read(batch: RecordBatch) -> Rows {
        let length = batch.num_rows();
        Rows { computed: None, batch: OnceLock::from(batch), length }
    }

    fn batch(&self) -> PyResult<&RecordBatch> {
        if let (None, Some(computed)) = (self.batch.get(), &self.computed) {
            let mut buffer = computed.buffer.lock().map_err(defect)?;
            // Another thread may have been faster.
            if let Some(buffer) = buffer.take() {
                let request = &computed.sweep.requests[computed.request];
                let batch = computed.sweep.record_batch(request, buffer).map_err(defect)?;
                let _ = self.batch.set(batch);
            }
        }
        self.batch.get().ok_or_else(|| defect("rows without content"))
    }

    fn array(&self, name: &str) -> PyResult<&ArrayRef> {
        let batch = self.batch()?;
        batch.column_by_name(name).ok_or_else(|| {
            let known: Vec<String> = batch.schema().fields().iter().map(|field| field.name().clone()).collect();
            error::missing("column", name, &known)
        })
    }
}

#[pymethods]
impl Rows {
    fn __len__(&self) -> usize {
        self.length
    }

    /// Every column.
    fn fields(&self) -> PyResult<Vec<Field>> {
        let schema = self.batch()?.schema();
        let fields = schema.fields().iter().map(|field| {
            let entry = |key: &str| field.metadata().get(key).cloned().unwrap_or_default();
            let kind = match field.data_type() {
                DataType::Float64 => "number",
                DataType::Boolean => "flag",
                _ => "word",
            };
            (field.name().clone(), entry("unit"), entry("description"), kind, field.is_nullable())
        });
        Ok(fields.collect())
    }

    /// The cell of a column of a single row; `None` where only Arrow has it.
    fn only(&self, name: &str) -> PyResult<Option<Cell>> {
        let Some(Computed { sweep, request, buffer }) = self.computed.as_ref().filter(|_| self.length == 1) else {
            return Ok(None);
        };
        let buffer = buffer.lock().map_err(defect)?;
        let Some(buffer) = buffer.as_ref() else { return Ok(None) };
        let request = &sweep.requests[*request];
        let columns = request.table.columns();
        let place = request.projection.indices().iter().position(|&index| columns[index].name == name);
        // An axis of the same name comes first.
        let Some(place) = place.filter(|_| !request.table.axes().iter().any(|axis| axis.name() == name)) else {
            return Ok((name == "status").then(|| Cell::Word(buffer.status[0].name())));
        };
        let cell = buffer.columns[place][0];
        Ok(match columns[request.projection.indices()[place]].kind {
            Kind::Number(_) | Kind::Quantity(_) => Some(Cell::Number(cell)),
            Kind::Label(words) => (!cell.is_nan()).then(|| Cell::Word(words[cell as usize])),
            Kind::Flag => None,
        })
    }

    /// The values of a column of numbers, NaN where there is none; or the places of words or flags, -1 where there is none, and the words.
    fn column(&self, name: &str) -> PyResult<(Buffer, Option<Vec<String>>)> {
        let array = self.array(name)?;
        if let Some(numbers) = array.as_primitive_opt::<Float64Type>() {
            return Ok((Buffer(numbers.values().inner().clone()), None));
        }
        if let Some(flags) = array.as_boolean_opt() {
            let places: Vec<i32> = flags.iter().map(|flag| flag.map_or(-1, i32::from)).collect();
            return Ok((Buffer(places.into()), Some(["False", "True"].map(str::to_owned).into())));
        }
        let words = array.as_dictionary_opt::<Int32Type>().ok_or_else(|| defect("a column of another type"))?;
        let values = words.values().as_string_opt::<i32>().ok_or_else(|| defect("words of another type"))?;
        let texts = values.iter().map(|word| word.unwrap_or_default().to_owned()).collect();
        let keys = words.keys();
        let places = match keys.null_count() {
            0 => keys.values().inner().clone(),
            _ => keys.iter().map(|key| key.unwrap_or(-1)).collect::<Vec<i32>>().into(),
        };
        Ok((Buffer(places), Some(texts)))
    }

    /// The rows in the stream format of Arrow, for another process.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let batch = self.batch()?;
        let mut writer = StreamWriter::try_new(Vec::new(), batch.schema_ref()).map_err(defect)?;
        writer.write(batch).map_err(defect)?;
        Ok(PyBytes::new(py, &writer.into_inner().map_err(defect)?))
    }

    /// The rows that `to_bytes` gave.
    #[staticmethod]
    fn from_bytes(data: &[u8]) -> PyResult<Rows> {
        let mut reader = StreamReader::try_new(data, None).map_err(defect)?;
        let batch = reader.next().ok_or_else(|| defect("rows without content"))?.map_err(defect)?;
        Ok(Rows::read(with_nan(batch).map_err(defect)?))
    }

    /// The first `count` rows.
    fn head(&self, count: usize) -> PyResult<Rows> {
        let batch = self.batch()?;
        Ok(Rows::read(batch.slice(0, count.min(batch.num_rows()))))
    }

    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyCapsule>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let rows = StructArray::from(self.batch()?.clone());
        let field = arrow_schema::Field::new_struct("", rows.fields().clone(), false);
        let batches: [Result<ArrayRef, ArrowError>; 1] = [Ok(Arc::new(rows))];
        let reader = ArrayIterator::new(batches, Arc::new(field));
        Ok(pyo3_arrow::ffi::to_stream_pycapsule(py, Box::new(reader), requested_schema)?)
    }

    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        Ok(pyo3_arrow::ffi::to_schema_pycapsule(py, self.batch()?.schema().as_ref())?)
    }

    /// The picture of computed rows, drawn from a dataset in `folder`, which is empty and temporary.
    fn plot(&self, py: Python<'_>, folder: PathBuf, arguments: PlotArguments) -> PyResult<String> {
        let computed = self.computed.as_ref().ok_or_else(|| PyValueError::new_err("these rows have no picture"))?;
        let (sweep, request, batch) = (computed.sweep.clone(), computed.request, self.batch()?.clone());
        interruptible(py, || (), move || drawn(&sweep, request, &batch, (&folder, &arguments)))?
    }
}

/// The picture of computed rows, from a dataset that is written to the folder.
fn drawn(
    sweep: &Sweep,
    request: usize,
    batch: &RecordBatch,
    (folder, arguments): (&Path, &PlotArguments),
) -> PyResult<String> {
    let request = &sweep.requests[request];
    let buffer = column_buffer(batch, request.projection.indices().len())?;
    let mut manifest = Plan::new(sweep).manifest(sweep);
    let (bounded, friction) = (sweep.bounded, sweep.friction.name());
    manifest.spec = format!("[model]\nvelocity_bound = {bounded}\nfriction = \"{friction}\"\n");
    manifest.tables.retain(|table| table.name == request.table.name());
    let folder = Folder::new(folder, "rows");
    let session = folder.open(&manifest, Concurrency::Alone).map_err(|error| error::dataset(&error))?;
    let layout = Layout::new(request.table, &request.projection, &sweep.grid);
    let name = request.table.name();
    for table in &manifest.tables {
        for part in 0..table.parts {
            let rows = table.rows_of(part);
            let range = rows.start as usize..rows.end as usize;
            let columns = buffer.columns.iter().map(|column| column[range.clone()].to_vec()).collect();
            let cells = ColumnBuffer { columns, status: buffer.status[range.clone()].to_vec() };
            let footer = Footer::new(&session.manifest, name, rows);
            let (bytes, _) = encode(&layout, &request.row_index, &cells, &footer).map_err(defect)?;
            session.write_part(name, part, &bytes).map_err(|error| error::dataset(&error))?;
        }
    }
    svg(&Source::new(folder.clone(), manifest, sweep.grid.units), name, arguments)
}

/// The last `columns` columns before the status, and the status, as the engine has them.
fn column_buffer(batch: &RecordBatch, columns: usize) -> PyResult<ColumnBuffer> {
    let end = batch.num_columns() - 1;
    let cells = |array: &ArrayRef| -> PyResult<Vec<f64>> {
        if let Some(numbers) = array.as_primitive_opt::<Float64Type>() {
            return Ok(numbers.values().to_vec());
        }
        if let Some(flags) = array.as_boolean_opt() {
            return Ok(flags.iter().map(|flag| flag.map_or(f64::NAN, |flag| f64::from(u8::from(flag)))).collect());
        }
        let words = array.as_dictionary_opt::<Int32Type>().ok_or_else(|| defect("a column of another type"))?;
        Ok(words.keys().iter().map(|key| key.map_or(f64::NAN, f64::from)).collect())
    };
    let status = cells(batch.column(end))?.into_iter().map(|place| Status::ALL[place as usize]).collect();
    let columns = batch.columns()[end - columns..end].iter().map(cells).collect::<PyResult<_>>()?;
    Ok(ColumnBuffer { columns, status })
}

/// A batch whose missing numbers are NaN below the null, as computed ones are.
///
/// # Errors
///
/// If the columns are not those of its schema.
pub fn with_nan(batch: RecordBatch) -> Result<RecordBatch, ArrowError> {
    let filled = batch.columns().iter().map(|array| match array.as_primitive_opt::<Float64Type>() {
        Some(numbers) if numbers.null_count() > 0 => {
            let values: Vec<f64> = numbers.iter().map(|number| number.unwrap_or(f64::NAN)).collect();
            Arc::new(Float64Array::new(values.into(), numbers.nulls().cloned())) as ArrayRef
        }
        _ => array.clone(),
    });
    RecordBatch::try_new(batch.schema(), filled.collect())
}
