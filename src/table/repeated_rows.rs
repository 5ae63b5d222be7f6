//! The memo of repeated rows: a row that a spec requests several times is computed once in a run.

use std::sync::Arc;

use super::column_buffer::RunStats;
use super::memo::Memo;
use crate::grid::Tuples;
use crate::protocol::Status;

/// The memo of a table that has several rows with equal values on all axes.
#[derive(Debug)]
pub struct RepeatedRows {
    /// The number of each row among the different rows.
    pub tuples: Tuples,
    rows: Memo<u64, (Status, Arc<[f64]>)>,
}

impl RepeatedRows {
    /// Greatest number of different rows in the memo; larger tables compute every row.
    const MAX_CACHED: u64 = 1 << 18;

    /// The memo of a table whose rows have these tuples of axis values; `None` if no row repeats.
    pub fn among(tuples: Tuples) -> Option<RepeatedRows> {
        let worthwhile = tuples.repeat() && tuples.span() <= Self::MAX_CACHED;
        worthwhile.then(|| RepeatedRows { tuples, rows: Memo::default() })
    }

    /// Copies row number `tuple` into `cells`, computed by `compute` if it is unknown. Returns the statistics of this call.
    pub fn get(
        &self,
        tuple: u64,
        cells: &mut [f64],
        compute: impl FnOnce(&mut [f64]) -> (Status, RunStats),
    ) -> (Status, RunStats) {
        let mut work = RunStats::default();
        let (status, known) = self.rows.get(tuple, || {
            let (status, spent) = compute(cells);
            work = spent;
            (status, (&*cells).into())
        });
        cells.copy_from_slice(&known);
        (status, work)
    }
}
