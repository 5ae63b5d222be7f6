//! The tables: one file for each, and their common trait.

mod best_cubic;
mod column;
mod column_buffer;
mod compliant;
mod crossover;
mod failpoint;
mod feedback;
mod gap;
mod memo;
mod optimal;
mod optimum_cache;
mod reduced;
mod regularised;
mod rows;
mod shortcut;
mod stability;
mod step_response;

use std::ops::Range;

use crate::grid::{Grid, Point, Quantity, RowIndex, Tuples};

pub use column::{Column, Field, Kind, STATUS, STATUS_DOC, columns, number, place};
pub use column_buffer::{ColumnBuffer, Phase, Projection, RunStats, Signal, Stopped};
pub use optimum_cache::{OPTIMUM_AXES, OptimumCache};
#[cfg(feature = "plot")]
pub(crate) use reduced::EDGES as HISTOGRAM_EDGES;
pub use reduced::MAX_SORTED;

/// A table: the axes of its rows, its columns and its computation.
pub trait Table: Sync {
    /// Its name in specs, and the name of its folder.
    fn name(&self) -> &'static str;

    /// The meaning of a row, in one line.
    fn doc(&self) -> &'static str;

    /// The axes of the table, which are its first columns, in the order of [`Quantity::ALL`].
    fn axes(&self) -> &'static [Quantity];

    /// The columns after the axes, without `status`.
    fn columns(&self) -> &'static [Column];

    /// Rows of a part. A fixed number: the bytes of a part depend on the spec alone.
    fn rows_per_part(&self) -> u64;

    /// Mean cost of a row, in nanoseconds of one processor. A fixed number: the distribution of parts over shards depends on the ratios of
    /// these costs.
    fn cost(&self) -> u64;

    /// Whether the projected columns need the optimal protocol of every row, from [`OptimumCache`].
    fn needs_optimum(&self, projection: &Projection) -> bool;

    /// Default relative accuracy of the table; `None`: that of the sweep.
    fn default_rtol(&self) -> Option<f64> {
        None
    }

    /// The prediction of linear theory for one of its columns, if any.
    fn prediction(&self) -> Option<Prediction> {
        None
    }

    /// Computes `rows` into `buffer`, which has the projected columns and this number of rows. Writes every cell.
    ///
    /// # Errors
    /// [`Stopped`] if the run was stopped.
    fn compute(&self, job: &Job<'_>, rows: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped>;
}

/// A table of constant properties.
pub struct Definition {
    name: &'static str,
    doc: &'static str,
    axes: &'static [Quantity],
    columns: &'static [Column],
    rows_per_part: u64,
    cost: u64,
    needs_optimum: fn(&Projection) -> bool,
    compute: fn(&Job<'_>, Range<u64>, &mut ColumnBuffer) -> Result<RunStats, Stopped>,
}

impl Table for Definition {
    fn name(&self) -> &'static str {
        self.name
    }

    fn doc(&self) -> &'static str {
        self.doc
    }

    fn axes(&self) -> &'static [Quantity] {
        self.axes
    }

    fn columns(&self) -> &'static [Column] {
        self.columns
    }

    fn rows_per_part(&self) -> u64 {
        self.rows_per_part
    }

    fn cost(&self) -> u64 {
        self.cost
    }

    fn needs_optimum(&self, projection: &Projection) -> bool {
        (self.needs_optimum)(projection)
    }

    fn compute(&self, job: &Job<'_>, rows: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
        (self.compute)(job, rows, buffer)
    }
}

/// The prediction of a simpler theory for a column of words. The summary counts agreement.
#[derive(Debug, Clone, Copy)]
pub struct Prediction {
    /// The column.
    pub column: &'static str,
    /// The theory, in a few words.
    pub theory: &'static str,
    /// A word that may occur against the prediction.
    pub surprise: &'static str,
    /// The reason.
    pub why: &'static str,
    /// The axes of the prediction.
    pub axes: &'static [Quantity],
    /// The predicted word at a point.
    pub word: fn(&Point) -> &'static str,
}

/// Every table, in the order of listings. A new table needs a file and a line here.
pub const ALL: [&dyn Table; 10] = [
    &gap::GAP,
    &best_cubic::BEST_CUBIC,
    &optimal::OPTIMAL,
    &feedback::FEEDBACK,
    &crossover::CROSSOVER,
    &shortcut::SHORTCUT,
    &stability::STABILITY,
    &step_response::StepResponse,
    &compliant::COMPLIANT,
    &regularised::REGULARISED,
];

/// The reductions of `gap`: the word in a spec, and the table that it writes.
pub const REDUCED: [(&str, &dyn Table); 3] =
    [("min", &reduced::MINIMUM), ("quantiles", &reduced::QUANTILES), ("histogram", &reduced::HISTOGRAM)];

/// The table with this name, including those of [`REDUCED`].
pub fn find(name: &str) -> Option<&'static dyn Table> {
    ALL.into_iter().chain(REDUCED.map(|(_, table)| table)).find(|table| table.name() == name)
}

/// The input of [`Table::compute`].
#[derive(Debug)]
pub struct Job<'a> {
    /// The grid of the sweep.
    pub grid: &'a Grid,
    /// The rows of the table.
    pub rows: &'a RowIndex,
    /// The different optimal problems among its rows.
    pub tuples: Tuples,
    /// The landscape rows of a reduced table, contiguous for each of its rows.
    pub members: Option<&'a RowIndex>,
    /// The projected columns.
    pub projection: &'a Projection,
    /// The factor of each projected column from the units of the model to those of the grid.
    pub sizes: &'a [f64],
    /// Whether optimal protocols obey `v >= 1`.
    pub bounded: bool,
    /// Relative accuracy of the table.
    pub rtol: f64,
    /// The cache of optimal protocols.
    pub optimum_cache: &'a OptimumCache,
    /// Progress, and the request to stop.
    pub signal: &'a Signal,
}
