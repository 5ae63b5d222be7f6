//! Optimal protocols shared by every table and part of a run: each transition and time is solved once.

use std::sync::OnceLock;

use super::memo::Memo;
use super::{Job, RunStats};
use crate::grid::{Point, Quantity};
use crate::model::{Law, Transition};
use crate::protocol::optimal::{self, Optimum};
use crate::protocol::{Solved, Status, error};

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

/// Bound of the error of the work of an optimal protocol that was found for `point`, by a second solve; NaN where that
/// has none. The work is added.
pub fn work_error(job: &Job<'_>, point: &Point, optimum: &Optimum, work: &mut RunStats) -> f64 {
    let (bound, stats) = error::of_optimum(&transition(point), point[Quantity::Time], job.bounded, optimum);
    *work += RunStats { optima: 1, ..RunStats::from(stats) };
    bound.unwrap_or(f64::NAN)
}

/// The least work of any protocol, and how far above it one is.
pub struct Comparison {
    /// The least work; NaN where it is not known.
    pub work: f64,
    /// What the protocol takes beyond it, as a share of it.
    pub gap: f64,
    /// Bound of the error of the gap; NaN where it is not asked for.
    pub gap_error: f64,
    /// The status of the optimum; `Ok` where it is not asked for, and where a bound or the time rules it out.
    pub optimum: Status,
}

impl Comparison {
    /// Nothing is known.
    pub const NONE: Comparison = Comparison { work: f64::NAN, gap: f64::NAN, gap_error: f64::NAN, optimum: Status::Ok };
}

/// Compares a work, and the bound of its error, with the least one of the tuple that `point` belongs to; with the bound
/// of the error of the gap where it is `bounded`. What is solved for it is added to `work`.
pub fn compare(
    job: &Job<'_>,
    (tuple, point): (u64, &Point),
    (work_s, error): (f64, f64),
    bounded: bool,
    work: &mut RunStats,
) -> Comparison {
    let (optimum, spent) = job.optimum_cache.get(tuple, point);
    *work += spent;
    let status = if optimum.status == Status::Infeasible { Status::Ok } else { optimum.status };
    let Some(least) = optimum.value else { return Comparison { optimum: status, ..Comparison::NONE } };
    let gap_error = if bounded {
        error::of_gap((work_s, error), (least.work, work_error(job, point, &least, work)))
    } else {
        f64::NAN
    };
    Comparison { work: least.work, gap: (work_s - least.work) / least.work, gap_error, optimum: status }
}

/// An optimal protocol once it is solved.
type Slot = OnceLock<Solved<Optimum>>;

/// The store of optimal protocols, by tuple number.
#[derive(Debug)]
pub struct OptimumCache {
    slots: Slots,
    bounded: bool,
    rtol: f64,
}

#[derive(Debug)]
enum Slots {
    /// One for each number.
    Dense(Vec<Slot>),
    /// Only for the numbers that occur.
    Sparse(Memo<u64, Solved<Optimum>>),
}

impl OptimumCache {
    /// Most tuples that are kept over a whole run (about 100 MB); a grid of more keeps none beyond its part.
    pub const MOST_KEPT: u64 = 1 << 20;

    /// A store for `tuples` different transitions and times, each solved to `rtol`, with `v >= 1` where `bounded`.
    pub fn new(tuples: u64, bounded: bool, rtol: f64) -> OptimumCache {
        OptimumCache::among(tuples, tuples, bounded, rtol)
    }

    /// The same where their numbers lie below `span`, most of which may not occur.
    pub fn among(tuples: u64, span: u64, bounded: bool, rtol: f64) -> OptimumCache {
        let slots = if span > Self::MOST_KEPT && tuples <= Self::MOST_KEPT {
            Slots::Sparse(Memo::default())
        } else {
            let kept = if span <= Self::MOST_KEPT { span as usize } else { 0 };
            Slots::Dense(std::iter::repeat_with(OnceLock::new).take(kept).collect())
        };
        OptimumCache { slots, bounded, rtol }
    }

    /// The optimal protocol of tuple number `tuple`, which `point` belongs to; the work is that of this call alone.
    pub fn get(&self, tuple: u64, point: &Point) -> (Solved<Optimum>, RunStats) {
        let mut work = RunStats::default();
        let mut solve = || {
            let solved = optimal::solve(&transition(point), point[Quantity::Time], self.bounded, self.rtol);
            work = RunStats { optima: 1, ..RunStats::from(solved.stats) };
            solved
        };
        let solved = match &self.slots {
            Slots::Dense(slots) => match usize::try_from(tuple).ok().and_then(|tuple| slots.get(tuple)) {
                Some(slot) => *slot.get_or_init(solve),
                None => solve(),
            },
            Slots::Sparse(slots) => slots.get(tuple, solve),
        };
        (solved, work)
    }
}
