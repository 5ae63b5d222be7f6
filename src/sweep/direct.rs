//! A table over values in memory: a sweep without a spec, and the rows of a table without a file.

use std::path::PathBuf;
use std::sync::Arc;

use arrow_array::RecordBatch;
use arrow_schema::ArrowError;

use super::check::{self, Request, Sweep};
use super::error::{SpecError, refuse};
use super::laws;
use super::spec::{AccuracySpec, ModelSpec};
use super::units::{doubtful_axis, help, legal, units};
use crate::dataset::{Layout, batch};
use crate::grid::{Axis, Block, Factor, Grid, Quantity, Scale, Values};
use crate::model::{Friction, Units};
use crate::table::{self, ColumnBuffer, OPTIMUM_AXES, OptimumCache, Signal, Stopped, Table};

/// The values of some axes: words are given by their indices.
pub type Given = Vec<(Quantity, Vec<f64>)>;

/// A table and the values of its axes. Axes without values have their defaults, which vary fastest.
pub struct Direct<'a> {
    /// The table.
    pub table: &'static Table,
    /// Axes that vary together: each has one value, or as many as the others.
    pub points: Given,
    /// Axes that multiply the points, the last one fastest.
    pub grid: Given,
    /// Unit of the axes that can have one relative to the duration.
    pub scale: Scale,
    /// Model and units.
    pub model: ModelSpec,
    /// Relative accuracy; by default that of the table.
    pub rtol: Option<f64>,
    /// The columns; by default all that are not optional.
    pub columns: Option<&'a [String]>,
}

/// The error of rows in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RowsError {
    /// The computation was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The rows do not fit into memory.
    #[error("{rows} rows do not fit into memory\n  help: take fewer values, or run a sweep, which writes files")]
    Memory {
        /// Their number.
        rows: u64,
    },
}

/// Bytes of rows that are not compared with the memory of the machine. Chosen: every machine has them.
const MAX_UNCHECKED_BYTES: u64 = 1 << 28;

/// Bytes of memory that the system would give without swapping; `None` if it does not say.
pub(crate) fn available_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(1024 * line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?)
}

impl Sweep {
    /// The sweep of one table over values in memory.
    ///
    /// # Errors
    ///
    /// The fault of a value, as in a spec.
    pub fn direct(direct: Direct<'_>) -> Result<Sweep, SpecError> {
        let is_of_laws = |(axis, values): &(Quantity, Vec<f64>)| match axis {
            Quantity::Law => true,
            Quantity::VelocityCeiling => values[..] != [f64::INFINITY],
            _ => false,
        };
        let has_laws = direct.points.iter().chain(&direct.grid).any(is_of_laws);
        let mut direct = Direct { table: table::over(direct.table, has_laws), ..direct };
        // The value of no ceiling is no axis of a table without ceilings.
        let takes = |axis: &(Quantity, Vec<f64>)| {
            axis.0 != Quantity::VelocityCeiling || direct.table.axes().contains(&Quantity::VelocityCeiling)
        };
        direct.points.retain(takes);
        direct.grid.retain(takes);
        let units = units(&direct.model)?;
        let rtol = direct.rtol.or(direct.table.default_rtol()).unwrap_or_else(|| AccuracySpec::default().rtol);
        check::check_rtol("rtol", rtol)?;
        let projection = check::projection(direct.table, direct.table.name(), direct.columns)?;
        direct.check(&units)?;
        let friction = laws::friction(&direct.model)?;
        let (table, columns, has_floor) = (direct.table, direct.columns, direct.model.velocity_bound);
        let block = direct.block();
        laws::check("law", table, &block, has_floor)?;
        if friction == Friction::Regularised {
            laws::check_regularised("friction", table, columns, &block)?;
        }
        let grid = Grid { blocks: vec![Arc::new(block)], units };
        let row_index = grid.project(table.axes()).map_err(|_| check::too_many_rows(table.name().to_owned()))?;
        let axes = grid.blocks.iter().flat_map(|block| &block.factors).flat_map(|factor| &factor.axes);
        let warnings =
            axes.filter_map(|axis| doubtful_axis(axis.quantity.name().to_owned(), &grid.units, axis)).collect();
        let request = Request::new(table, projection, rtol, row_index, None);
        Ok(Sweep {
            name: table.name().to_owned(),
            description: String::new(),
            text: String::new(),
            folder: PathBuf::new(),
            grid,
            bounded: has_floor && friction == Friction::Log,
            friction,
            requests: vec![request],
            optimum_rows: None,
            warnings,
        })
    }

    /// All rows of a requested table, computed on the threads of the current pool.
    ///
    /// # Errors
    ///
    /// If the computation was stopped, or the rows do not fit into memory.
    pub fn rows(&self, request: &Request, signal: &Signal) -> Result<ColumnBuffer, RowsError> {
        let mut buffer = ColumnBuffer::new(request.projection.indices().len());
        let rows = usize::try_from(request.rows).unwrap_or(usize::MAX);
        let cells = 1 + buffer.columns.len() as u64 + request.table.axes().len() as u64;
        let bytes = request.rows.saturating_mul(8 * cells);
        let fits = bytes <= MAX_UNCHECKED_BYTES || available_bytes().is_none_or(|available| bytes <= available);
        if !fits || buffer.columns.iter_mut().any(|column| column.try_reserve_exact(rows).is_err()) {
            return Err(RowsError::Memory { rows: request.rows });
        }
        if rows == 0 {
            return Ok(buffer);
        }
        buffer.resize(rows);
        // Rows of a table over the axes of the optimum have an optimum each.
        let is_common = request.table.axes() != OPTIMUM_AXES && request.needs_optimum(&self.grid);
        let optima = if is_common { request.row_index.tuples(OPTIMUM_AXES).span() } else { 0 };
        let optimum_cache = OptimumCache::new(optima, optima);
        let job = self.job(request, &optimum_cache, signal);
        request.table.compute(&job, 0..request.rows, &mut buffer)?;
        Ok(buffer)
    }

    /// The rows of a requested table as one Arrow record batch, with the columns, types and units of the Parquet files of a run.
    ///
    /// # Errors
    ///
    /// If `buffer` does not hold the rows of this table.
    pub fn record_batch(&self, request: &Request, buffer: ColumnBuffer) -> Result<RecordBatch, ArrowError> {
        let layout = Layout::new(request.table, &request.projection, &self.grid);
        batch(&layout, &request.row_index, 0..request.rows, buffer)
    }
}

impl Direct<'_> {
    /// The unit of the values of `quantity`.
    fn scale_of(&self, quantity: Quantity) -> Scale {
        if quantity.has_scale() { self.scale } else { Scale::Model }
    }

    /// Checks that the table has these axes and no value is missing or out of range.
    fn check(&self, units: &Units) -> Result<(), SpecError> {
        let (name, takes) = (self.table.name(), self.table.axes());
        let given = || self.points.iter().chain(&self.grid);
        for (place, (quantity, values)) in given().enumerate() {
            let key = quantity.name();
            if !takes.contains(quantity) {
                return refuse(key, format!("`{name}` has no such axis"), check::expected_axes(takes), "remove it");
            }
            if given().take(place).any(|(other, _)| other == quantity) {
                return refuse(key, "an argument and an axis of `grid`", "each axis once", "remove one of the two");
            }
            for (place, &value) in values.iter().enumerate() {
                if let Err(expected) = legal(units, *quantity, self.scale_of(*quantity), value) {
                    let key = if values.len() == 1 { key.to_owned() } else { format!("{key}[{place}]") };
                    return refuse(key, format!("{value:?} is out of range"), expected, help(units, *quantity, value));
                }
            }
        }
        let is_missing = |axis: &&Quantity| axis.default().is_empty() && !given().any(|(given, _)| given == *axis);
        let missing: Vec<&str> = takes.iter().filter(is_missing).map(|axis| axis.name()).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let (found, help) =
            (format!("`{name}` needs {}", missing.join(", ")), format!("add {}=...", missing.join("=..., ")));
        refuse("", found, check::expected_axes(takes), help)
    }

    /// The factors: points that vary together, constants, axes of the grid, defaults.
    fn block(mut self) -> Block {
        let (points, grid) = (std::mem::take(&mut self.points), std::mem::take(&mut self.grid));
        let axis = |(quantity, values)| Axis { quantity, scale: self.scale_of(quantity), values: Values::List(values) };
        let factor = |axes: Vec<Axis>| Factor { axes, ..Factor::default() };
        let (constants, together): (Given, Given) = points.into_iter().partition(|(_, values)| values.len() == 1);
        let together: Vec<Axis> = together.into_iter().map(axis).collect();
        let mut factors: Vec<Factor> = Vec::with_capacity(self.table.axes().len());
        factors.extend((!together.is_empty()).then(|| factor(together)));
        factors.extend(constants.into_iter().chain(grid).map(|given| factor(vec![axis(given)])));
        for &quantity in self.table.axes() {
            if !quantity.is_tacit() && !factors.iter().any(|factor| factor.holds_any(&[quantity])) {
                factors.push(Factor::usual(quantity));
            }
        }
        Block { factors, ..Block::default() }
    }
}
