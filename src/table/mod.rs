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

use crate::grid::{Block, Grid, Point, Quantity, RowIndex, Tuples};
use crate::model::Friction;
use crate::protocol::Status;

pub use column::{Column, Field, Kind, STATUS, STATUS_DOC, columns, number};
pub use column_buffer::{ColumnBuffer, Phase, Projection, RunStats, Signal, Stopped};
pub use optimum_cache::{OPTIMUM_AXES, OptimumCache, uncapped_optimum};
#[cfg(feature = "plot")]
pub(crate) use reduced::EDGES as HISTOGRAM_EDGES;
pub use reduced::MAX_SORTED;
#[cfg(feature = "read")]
pub(crate) use {compliant::slider, optimum_cache::transition};

/// A table: the axes of its rows, its columns and its computation.
pub struct Table {
    name: &'static str,
    doc: &'static str,
    axes: &'static [Quantity],
    columns: &'static [Column],
    rows_per_part: u64,
    cost: u64,
    needs_optimum: fn(&Projection, &Block) -> bool,
    compute: fn(&Job<'_>, Range<u64>, &mut ColumnBuffer) -> Result<RunStats, Stopped>,
}

impl Table {
    /// Its name in specs, and the name of its folder.
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// The meaning of a row, in one line.
    pub fn doc(&self) -> &'static str {
        self.doc
    }

    /// The axes of the table, which are its first columns, in the order of [`Quantity::ALL`].
    pub fn axes(&self) -> &'static [Quantity] {
        self.axes
    }

    /// The columns after the axes, without `status`.
    pub fn columns(&self) -> &'static [Column] {
        self.columns
    }

    /// Rows of a part. A fixed number: the bytes of a part depend on the spec alone.
    pub fn rows_per_part(&self) -> u64 {
        self.rows_per_part
    }

    /// Mean cost of a row, in nanoseconds of one processor. A fixed number: the distribution of parts over shards depends on the ratios of
    /// these costs.
    pub fn cost(&self) -> u64 {
        self.cost
    }

    /// Whether rows of `block` need an optimal protocol from [`OptimumCache`] for the projected columns.
    pub fn needs_optimum(&self, projection: &Projection, block: &Block) -> bool {
        (self.needs_optimum)(projection, block)
    }

    /// Default relative accuracy of the table; `None`: that of the sweep.
    pub fn default_rtol(&self) -> Option<f64> {
        self.is_simulated().then_some(step_response::DEFAULT_RTOL)
    }

    /// The prediction of linear theory for one of its columns, if any.
    pub fn prediction(&self) -> Option<Prediction> {
        self.is_simulated().then_some(step_response::PREDICTION)
    }

    /// Whether its rows are simulations.
    fn is_simulated(&self) -> bool {
        std::ptr::eq(self, &step_response::STEP_RESPONSE)
    }

    /// Computes `rows` into `buffer`, which has the projected columns and this number of rows. Writes every cell.
    ///
    /// # Errors
    /// [`Stopped`] if the run was stopped.
    pub fn compute(&self, job: &Job<'_>, rows: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
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
    /// Words that may occur against the prediction, each with the reason.
    pub surprises: &'static [(&'static str, &'static str)],
    /// The axes of the prediction.
    pub axes: &'static [Quantity],
    /// The predicted word at a point.
    pub word: fn(&Point) -> &'static str,
}

/// Every table, in the order of listings. A new table needs a file and a line here.
pub const ALL: [&Table; 10] = [
    &gap::GAP,
    &best_cubic::BEST_CUBIC,
    &optimal::OPTIMAL,
    &feedback::FEEDBACK,
    &crossover::CROSSOVER,
    &shortcut::SHORTCUT,
    &stability::STABILITY,
    &step_response::STEP_RESPONSE,
    &compliant::COMPLIANT,
    &regularised::REGULARISED,
];

/// The reductions of `gap`: the word in a spec, and the table that it writes.
pub const REDUCED: [(&str, &Table); 3] =
    [("min", &reduced::MINIMUM), ("quantiles", &reduced::QUANTILES), ("histogram", &reduced::HISTOGRAM)];

/// The table with this name, including those of [`REDUCED`].
pub fn find(name: &str) -> Option<&'static Table> {
    ALL.into_iter().chain(REDUCED.map(|(_, table)| table)).find(|table| table.name() == name)
}

/// Whether the table with this name is one of [`REDUCED`].
pub fn is_reduced(name: &str) -> bool {
    REDUCED.iter().any(|(_, table)| table.name() == name)
}

/// The words that `column` of a table can have; empty for a number, and for a label of a file of points.
pub fn vocabulary(table: &str, column: &str) -> Vec<&'static str> {
    if column == STATUS {
        return Status::ALL.iter().map(|status| status.name()).collect();
    }
    if let Some(quantity) = Quantity::from_name(column) {
        return quantity.words();
    }
    match find(table)
        .and_then(|table| table.columns().iter().find(|known| known.name == column))
        .map(|column| column.kind)
    {
        Some(Kind::Label(words)) => words.to_vec(),
        _ => Vec::new(),
    }
}

/// `table` over a grid: without the axis `law` and without a velocity ceiling, `gap` and `best_cubic` have neither axis.
pub fn over(table: &'static Table, has_laws: bool) -> &'static Table {
    static GAP_OF_AGEING: Table = gap::GAP_OF_AGEING;
    static BEST_CUBIC_OF_AGEING: Table = best_cubic::BEST_CUBIC_OF_AGEING;
    match table.name() {
        "gap" if !has_laws => &GAP_OF_AGEING,
        "best_cubic" if !has_laws => &BEST_CUBIC_OF_AGEING,
        _ => table,
    }
}

/// `column` as a table over `grid` has it: without the words of other laws than ageing if the grid has no axis `law`.
pub fn written(column: Column, grid: &Grid) -> Column {
    match column.kind {
        Kind::Label(words) if std::ptr::eq(words, optimal::STRATEGIES) && grid.scale(Quantity::Law).is_none() => {
            Column { kind: Kind::Label(optimal::STRATEGIES_OF_AGEING), ..column }
        }
        _ => column,
    }
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
    /// Whether optimal protocols obey `v >= 1`.
    pub bounded: bool,
    /// Form of the direct effect of friction.
    pub friction: Friction,
    /// Relative accuracy of the table.
    pub rtol: f64,
    /// The cache of optimal protocols.
    pub optimum_cache: &'a OptimumCache,
    /// Progress, and the request to stop.
    pub signal: &'a Signal,
}
