//! Optimal protocols shared by every table and part of a run: each transition and time is solved once.

use std::sync::OnceLock;

use super::sheet::Work;
use crate::grid::{Point, Quantity};
use crate::model::{Law, Transition};
use crate::protocol::Solved;
use crate::protocol::optimal::{self, Optimum};

/// What the optimal protocol depends on.
pub const OPTIMUM_AXES: &[Quantity] =
    &[Quantity::Time, Quantity::A, Quantity::B, Quantity::InitialVelocity, Quantity::FinalVelocity];

/// The transition of a point that holds at least `a`, `b`, `v_i` and `v_f`.
pub fn transition(point: &Point) -> Transition {
    Transition {
        law: Law { a: point[Quantity::A], b: point[Quantity::B] },
        v_i: point[Quantity::InitialVelocity],
        v_f: point[Quantity::FinalVelocity],
    }
}

/// The store of optimal protocols, by tuple number.
#[derive(Debug)]
pub struct Optima {
    slots: Vec<OnceLock<Solved<Optimum>>>,
    bounded: bool,
    rtol: f64,
}

impl Optima {
    /// Most tuples that are kept over a whole run (about 100 MB); a grid of more keeps none beyond its part.
    pub const MOST_KEPT: u64 = 1 << 20;

    /// A store for `tuples` different transitions and times, each solved to `rtol`, with `v >= 1` where `bounded`.
    pub fn new(tuples: u64, bounded: bool, rtol: f64) -> Optima {
        let kept = if tuples <= Self::MOST_KEPT { tuples as usize } else { 0 };
        Optima { slots: std::iter::repeat_with(OnceLock::new).take(kept).collect(), bounded, rtol }
    }

    /// The optimal protocol of tuple number `tuple`, which `point` belongs to; the work is that of this call alone.
    pub fn get(&self, tuple: u64, point: &Point) -> (Solved<Optimum>, Work) {
        let mut work = Work::default();
        let mut solve = || {
            let solved = optimal::solve(&transition(point), point[Quantity::Time], self.bounded, self.rtol);
            work = Work { optima: 1, ..Work::from(solved.effort) };
            solved
        };
        let solved = match usize::try_from(tuple).ok().and_then(|tuple| self.slots.get(tuple)) {
            Some(slot) => *slot.get_or_init(solve),
            None => solve(),
        };
        (solved, work)
    }
}
