//! What a row means: the tables, one file each, and what they have in common.

mod best_cubic;
mod column;
mod column_buffer;
mod compliant;
mod crossover;
mod failpoint;
mod gap;
mod memo;
mod optimal;
mod optimum_cache;
mod reduced;
mod regularised;
mod repeated_rows;
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
pub use reduced::MOST_SORTED;
pub use repeated_rows::RepeatedRows;

/// A table: what its rows depend on, what they hold and how they are computed.
pub trait Table: Sync {
    /// Its name in specs and its folder's name.
    fn name(&self) -> &'static str;

    /// What a row is, in one line.
    fn doc(&self) -> &'static str;

    /// The quantities that a row depends on; its first columns, in the order of [`Quantity::ALL`].
    fn axes(&self) -> &'static [Quantity];

    /// The columns after the axes, without `status`.
    fn columns(&self) -> &'static [Column];

    /// Rows of a part: fixed, so that the bytes of a part depend on the spec alone.
    fn rows_per_part(&self) -> u64;

    /// What a row costs on average, in nanoseconds of one processor: fixed, for it decides which shard has which part. Only how tables
    /// compare matters.
    fn cost(&self) -> u64;

    /// Whether the selected columns need the optimal protocol of every row, shared through [`OptimumCache`].
    fn needs_optimum(&self, projection: &Projection) -> bool;

    /// Relative accuracy where the spec gives the table none of its own; that of the whole sweep if `None`.
    fn default_rtol(&self) -> Option<f64> {
        None
    }

    /// What a simpler theory says of one of its columns, if it does.
    fn prediction(&self) -> Option<Prediction> {
        None
    }

    /// Computes `rows` into `buffer`, which has the columns of the selection and as many rows: every cell is written.
    fn compute(&self, job: &Job<'_>, rows: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped>;
}

/// A table of which everything is known in advance.
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

/// What a simpler theory says of a column of words: a summary counts it against what was found.
#[derive(Debug, Clone, Copy)]
pub struct Prediction {
    /// The column.
    pub column: &'static str,
    /// The theory, in a few words.
    pub theory: &'static str,
    /// A word that may be found where it is not predicted.
    pub surprise: &'static str,
    /// Why that may be.
    pub why: &'static str,
    /// The axes that it depends on.
    pub axes: &'static [Quantity],
    /// The word that it predicts at a point.
    pub word: fn(&Point) -> &'static str,
}

/// Every table, in the order in which they are listed. A new table is a file and a line here.
pub const ALL: [&dyn Table; 9] = [
    &gap::GAP,
    &best_cubic::BEST_CUBIC,
    &optimal::OPTIMAL,
    &crossover::CROSSOVER,
    &shortcut::SHORTCUT,
    &stability::STABILITY,
    &step_response::StepResponse,
    &compliant::COMPLIANT,
    &regularised::REGULARISED,
];

/// Ways to reduce the landscapes of `gap`, by the word that a spec has for each, and the tables that hold what comes of them.
pub const REDUCED: [(&str, &dyn Table); 3] =
    [("min", &reduced::MINIMUM), ("quantiles", &reduced::QUANTILES), ("histogram", &reduced::HISTOGRAM)];

/// The table of this name, also one of [`REDUCED`].
pub fn find(name: &str) -> Option<&'static dyn Table> {
    ALL.into_iter().chain(REDUCED.map(|(_, table)| table)).find(|table| table.name() == name)
}

/// What a table needs to compute any of its rows.
#[derive(Debug)]
pub struct Job<'a> {
    /// The grid of the sweep.
    pub grid: &'a Grid,
    /// The rows of the table.
    pub rows: &'a RowIndex,
    /// The different optimal problems among its rows.
    pub tuples: Tuples,
    /// Its rows that are there more than once, if any are.
    pub repeated_rows: Option<RepeatedRows>,
    /// Of a table that reduces landscapes: their rows, those of one of its rows side by side, in the order of its rows.
    pub members: Option<&'a RowIndex>,
    /// The columns asked for.
    pub projection: &'a Projection,
    /// What the values of each of them are multiplied by to be in the units of the grid.
    pub sizes: &'a [f64],
    /// Whether optimal protocols obey `v >= 1`.
    pub bounded: bool,
    /// Relative accuracy of the table.
    pub rtol: f64,
    /// The shared optimal protocols.
    pub optimum_cache: &'a OptimumCache,
    /// How far the run is, and whether to stop.
    pub signal: &'a Signal,
}
