//! The columns of a range of rows in memory, and the state of a run: its counters and its signals.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

use super::Column;
use crate::protocol::Status;

/// The result columns of a range of rows.
///
/// NaN stands for a missing number, which is written as null; no solver returns NaN. A label is the index of its word, a flag 1 or 0.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnBuffer {
    /// The projected columns, in the order of the table.
    pub columns: Vec<Vec<f64>>,
    /// The status of each row.
    pub status: Vec<Status>,
}

impl ColumnBuffer {
    /// A buffer of `columns` columns without rows.
    pub fn new(columns: usize) -> ColumnBuffer {
        ColumnBuffer { columns: vec![Vec::new(); columns], status: Vec::new() }
    }

    /// Sets the length to `rows` rows. The cells have no defined value afterwards.
    pub fn resize(&mut self, rows: usize) {
        self.columns.iter_mut().for_each(|column| column.resize(rows, f64::NAN));
        self.status.resize(rows, Status::NotConverged);
    }
}

/// The requested columns of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Projection(Vec<usize>);

impl Projection {
    /// The columns with these indices, in the order of the table.
    pub fn new(mut indices: Vec<usize>) -> Projection {
        indices.sort_unstable();
        indices.dedup();
        Projection(indices)
    }

    /// The columns that a table has by default: all that are not optional.
    pub fn usual(columns: &[Column]) -> Projection {
        Projection((0..columns.len()).filter(|&index| !columns[index].optional).collect())
    }

    /// The indices, ascending.
    pub fn indices(&self) -> &[usize] {
        &self.0
    }

    /// Whether the column with this index is requested.
    pub fn has(&self, index: impl Into<usize>) -> bool {
        self.0.binary_search(&index.into()).is_ok()
    }

    /// Whether any of these columns is requested.
    pub fn has_any(&self, indices: impl IntoIterator<Item = impl Into<usize>>) -> bool {
        indices.into_iter().any(|index| self.has(index))
    }
}

/// Solver statistics of a run: exact counts, equal on every machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RunStats {
    /// Optimal protocols solved for `W*`.
    pub optima: u64,
    /// Optimal protocols solved for one row alone: under ceilings, with slopes, or from a state on the way.
    pub own_optima: u64,
    /// Landscapes prepared.
    pub landscapes: u64,
    /// Best shortcuts searched.
    pub best: u64,
    /// Shortcuts of a family solved.
    pub shortcuts: u64,
    /// Transitions whose crossover times were computed.
    pub crossovers: u64,
    /// Simulations of a block on a spring.
    pub simulations: u64,
    /// Steps of all simulations.
    pub steps: u64,
    /// Quadratures, all solves together.
    pub quadratures: u64,
    /// Quadrature nodes, all solves together.
    pub nodes: u64,
}

impl std::ops::AddAssign for RunStats {
    fn add_assign(&mut self, other: RunStats) {
        self.optima += other.optima;
        self.own_optima += other.own_optima;
        self.landscapes += other.landscapes;
        self.best += other.best;
        self.shortcuts += other.shortcuts;
        self.crossovers += other.crossovers;
        self.simulations += other.simulations;
        self.steps += other.steps;
        self.quadratures += other.quadratures;
        self.nodes += other.nodes;
    }
}

impl std::iter::Sum for RunStats {
    fn sum<I: Iterator<Item = RunStats>>(iter: I) -> RunStats {
        iter.fold(RunStats::default(), |mut sum, work| {
            sum += work;
            sum
        })
    }
}

impl From<crate::protocol::SolverStats> for RunStats {
    fn from(stats: crate::protocol::SolverStats) -> RunStats {
        RunStats { quadratures: stats.quadratures.into(), nodes: stats.nodes.into(), ..RunStats::default() }
    }
}

/// Progress of a run, and the request to stop it.
#[derive(Debug, Default)]
pub struct Signal {
    stop: AtomicBool,
    rows: AtomicU64,
    kept: AtomicU64,
    phase: AtomicU8,
}

/// The phase of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Existing parts are checked.
    Checking,
    /// Rows are computed.
    Computing,
    /// The last parts are written.
    Writing,
}

impl Signal {
    /// Requests the run to stop.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Rows computed so far.
    pub fn rows(&self) -> u64 {
        self.rows.load(Ordering::Relaxed)
    }

    /// Rows of existing parts that are intact.
    pub fn kept(&self) -> u64 {
        self.kept.load(Ordering::Relaxed)
    }

    /// Adds `rows` rows of an existing part.
    pub fn keep(&self, rows: u64) {
        self.kept.fetch_add(rows, Ordering::Relaxed);
    }

    /// The current phase.
    pub fn phase(&self) -> Phase {
        match self.phase.load(Ordering::Relaxed) {
            phase if phase == Phase::Checking as u8 => Phase::Checking,
            phase if phase == Phase::Computing as u8 => Phase::Computing,
            _ => Phase::Writing,
        }
    }

    /// Sets the phase.
    pub fn enter(&self, phase: Phase) {
        self.phase.store(phase as u8, Ordering::Relaxed);
    }

    /// Adds `rows` computed rows.
    pub fn advance(&self, rows: u64) {
        self.rows.fetch_add(rows, Ordering::Relaxed);
    }

    /// Checks for a request to stop.
    ///
    /// # Errors
    /// [`Stopped`] after [`Signal::stop`].
    pub fn check(&self) -> Result<(), Stopped> {
        if self.stop.load(Ordering::Relaxed) { Err(Stopped) } else { Ok(()) }
    }
}

/// The run was stopped on request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped")]
pub struct Stopped;
