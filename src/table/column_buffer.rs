//! The cells of a range of rows, column by column, before they are written.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

use super::Column;
use crate::protocol::Status;

/// The cells that a part consists of, axes apart.
///
/// A missing number is NaN in here, and null outside: no solver returns NaN as a result. A label is the index of its word, a flag 1 or 0.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnBuffer {
    /// The columns that were asked for, in their order.
    pub columns: Vec<Vec<f64>>,
    /// The status of each row.
    pub status: Vec<Status>,
}

impl ColumnBuffer {
    /// A sheet of `columns` columns and no row.
    pub fn new(columns: usize) -> ColumnBuffer {
        ColumnBuffer { columns: vec![Vec::new(); columns], status: Vec::new() }
    }

    /// Makes it `rows` rows long, for another part; what the cells hold then means nothing.
    pub fn resize(&mut self, rows: usize) {
        self.columns.iter_mut().for_each(|column| column.resize(rows, f64::NAN));
        self.status.resize(rows, Status::NotConverged);
    }
}

/// Which columns of a table are asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Projection(Vec<usize>);

impl Projection {
    /// The columns of these indices, in the order of the table.
    pub fn new(mut indices: Vec<usize>) -> Projection {
        indices.sort_unstable();
        indices.dedup();
        Projection(indices)
    }

    /// Those of `columns` that are written where a spec names none.
    pub fn usual(columns: &[Column]) -> Projection {
        Projection((0..columns.len()).filter(|&index| !columns[index].optional).collect())
    }

    /// The indices, ascending.
    pub fn indices(&self) -> &[usize] {
        &self.0
    }

    /// Whether the column of this index is asked for.
    pub fn has(&self, index: usize) -> bool {
        self.0.binary_search(&index).is_ok()
    }

    /// Whether any of these is.
    pub fn has_any(&self, indices: impl IntoIterator<Item = usize>) -> bool {
        indices.into_iter().any(|index| self.has(index))
    }
}

/// Work that was spent, exactly and the same on every machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RunStats {
    /// Optimal protocols solved for `W*`.
    pub optima: u64,
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

/// The line between a run and whoever watches it: how far it is, and whether it should stop.
#[derive(Debug, Default)]
pub struct Signal {
    stop: AtomicBool,
    rows: AtomicU64,
    kept: AtomicU64,
    phase: AtomicU8,
}

/// What a run is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// It checks the parts that are there.
    Checking,
    /// It computes rows.
    Computing,
    /// It writes the last parts.
    Writing,
}

impl Signal {
    /// Asks the run to stop soon.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Rows computed so far.
    pub fn rows(&self) -> u64 {
        self.rows.load(Ordering::Relaxed)
    }

    /// Rows of parts that were there already and are sound.
    pub fn kept(&self) -> u64 {
        self.kept.load(Ordering::Relaxed)
    }

    /// Counts `rows` more rows that are kept.
    pub fn keep(&self, rows: u64) {
        self.kept.fetch_add(rows, Ordering::Relaxed);
    }

    /// What the run is doing.
    pub fn phase(&self) -> Phase {
        match self.phase.load(Ordering::Relaxed) {
            phase if phase == Phase::Checking as u8 => Phase::Checking,
            phase if phase == Phase::Computing as u8 => Phase::Computing,
            _ => Phase::Writing,
        }
    }

    /// Notes what the run is doing.
    pub fn enter(&self, phase: Phase) {
        self.phase.store(phase as u8, Ordering::Relaxed);
    }

    /// Counts `rows` more rows.
    pub fn advance(&self, rows: u64) {
        self.rows.fetch_add(rows, Ordering::Relaxed);
    }

    /// An error once the run should stop.
    pub fn check(&self) -> Result<(), Stopped> {
        if self.stop.load(Ordering::Relaxed) { Err(Stopped) } else { Ok(()) }
    }
}

/// The run was asked to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped")]
pub struct Stopped;
