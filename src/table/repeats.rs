//! Rows that a spec asks for more than once: each is computed once a run and written as often as asked.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::sheet::Work;
use crate::grid::{Projection, Quantity, Tuples};
use crate::protocol::Status;

/// A row once it is computed.
type Row = OnceLock<(Status, Box<[f64]>)>;

/// The rows of a table that has several with the same values on all axes.
#[derive(Debug)]
pub struct Repeats {
    /// The number of each row among those that differ.
    pub tuples: Tuples,
    rows: Mutex<HashMap<u64, Arc<Row>>>,
}

impl Repeats {
    /// Most different rows that are kept over a run; a table of more computes each as often as it is asked for.
    const MOST_KEPT: u64 = 1 << 18;

    /// Those of a table over `axes`; `None` where no list names a value twice.
    pub fn among(rows: &Projection, axes: &[Quantity]) -> Option<Repeats> {
        let tuples = rows.tuples(axes);
        let worthwhile = tuples.repeat() && tuples.span() <= Self::MOST_KEPT;
        worthwhile.then(|| Repeats { tuples, rows: Mutex::default() })
    }

    /// The row of number `tuple`, into `cells`; `compute` fills them if it is not known yet. The work is that of this call alone.
    pub fn get(
        &self,
        tuple: u64,
        cells: &mut [f64],
        compute: impl FnOnce(&mut [f64]) -> (Status, Work),
    ) -> (Status, Work) {
        let mut rows = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        let row = rows.entry(tuple).or_default().clone();
        drop(rows);
        let mut work = Work::default();
        let (status, known) = row.get_or_init(|| {
            let (status, spent) = compute(cells);
            work = spent;
            (status, (&*cells).into())
        });
        cells.copy_from_slice(known);
        (*status, work)
    }
}
