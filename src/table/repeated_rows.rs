//! Rows that a spec requests more than once: each is computed once a run and written as often as requested.

use std::sync::Arc;

use super::column_buffer::RunStats;
use super::memo::Memo;
use crate::grid::{Quantity, RowIndex, Tuples};
use crate::protocol::Status;

/// The rows of a table that has several with the same values on all axes.
#[derive(Debug)]
pub struct RepeatedRows {
    /// The number of each row among those that differ.
    pub tuples: Tuples,
    rows: Memo<u64, (Status, Arc<[f64]>)>,
}

impl RepeatedRows {
    /// Most different rows that are kept over a run; a table of more computes each as often as it is requested.
    const MOST_KEPT: u64 = 1 << 18;

    /// Those of a table over `axes`; `None` where no list names a value twice.
    pub fn among(rows: &RowIndex, axes: &[Quantity]) -> Option<RepeatedRows> {
        let tuples = rows.tuples(axes);
        let worthwhile = tuples.repeat() && tuples.span() <= Self::MOST_KEPT;
        worthwhile.then(|| RepeatedRows { tuples, rows: Memo::default() })
    }

    /// The row of number `tuple`, into `cells`; `compute` fills them if it is not known yet. The work is that of this call alone.
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
