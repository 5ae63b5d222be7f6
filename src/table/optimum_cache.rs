//! The cache of optimal protocols. All tables and parts of a run share it: each transition and duration is solved once.

use std::sync::OnceLock;

use super::memo::Memo;
use super::{Job, RunStats};
use crate::grid::Quantity::{A, B, FinalVelocity, InitialVelocity, Time, VelocityCeiling};
use crate::grid::{Point, Quantity};
use crate::model::{Friction, Law, StateLaw, Transition};
use crate::protocol::optimal::{self, Bounds, Optimum};
use crate::protocol::{Solved, Status, arcsinh, error, relaxed};

/// The axes of the optimal protocol.
pub const OPTIMUM_AXES: &[Quantity] =
    &[Quantity::Time, Quantity::A, Quantity::B, Quantity::InitialVelocity, Quantity::FinalVelocity];

/// The axes of the optimal protocol under other laws of the state.
pub const LAW_AXES: &[Quantity] = &[Time, A, B, Quantity::Law, InitialVelocity, FinalVelocity, VelocityCeiling];

/// The transition of a point that holds at least `a`, `b`, `v_i` and `v_f`.
pub fn transition(point: &Point) -> Transition {
    Transition {
        law: Law { a: point[Quantity::A], b: point[Quantity::B] },
        v_i: point[Quantity::InitialVelocity],
        v_f: point[Quantity::FinalVelocity],
    }
}

/// The bounds of a row of a table with the axes `v_ceiling` and `tau_ceiling`.
pub fn with_ceilings(job: &Job<'_>, point: &Point) -> Bounds {
    let [v_ceiling, tau_ceiling] = [Quantity::VelocityCeiling, Quantity::FrictionCeiling].map(|axis| point[axis]);
    Bounds { floor: job.bounded, v_ceiling, tau_ceiling }
}

/// The optimal protocol of `point` without ceilings, with `v >= 1` if `bounded`.
pub fn uncapped_optimum(point: &Point, bounded: bool, friction: Friction, rtol: f64) -> Solved<Optimum> {
    let (transition, t_f) = (transition(point), point[Quantity::Time]);
    match friction {
        Friction::Log => optimal::solve(&transition, t_f, bounded, rtol),
        Friction::Regularised => arcsinh::solve(&transition, t_f).map(|found| found.optimum),
    }
}

/// The optimal protocol of `point`, of tuple number `tuple`, without ceilings: from the cache of the tables. Adds the solver statistics to
/// `work`.
pub fn cached_optimum(job: &Job<'_>, (tuple, point): (u64, &Point), work: &mut RunStats) -> Solved<Optimum> {
    job.optimum_cache.get(tuple, || {
        let solved = uncapped_optimum(point, job.bounded, job.friction, job.rtol);
        *work += RunStats { optima: 1, ..RunStats::from(solved.stats) };
        solved
    })
}

/// The optimal protocol of `point` under `bounds`: from the cache of the tables if there is no ceiling. `point` has tuple
/// number `tuple`. Adds the solver statistics to `work`.
pub fn optimum(job: &Job<'_>, (tuple, point): (u64, &Point), bounds: &Bounds, work: &mut RunStats) -> Solved<Optimum> {
    if !bounds.has_ceilings() {
        return cached_optimum(job, (tuple, point), work);
    }
    let solved = optimal::solve(&transition(point), point[Quantity::Time], bounds, job.rtol);
    *work += RunStats { own_optima: 1, ..RunStats::from(solved.stats) };
    solved
}

/// Error bound of the optimal work at `point`, from a second solve; NaN if that finds no optimum. Adds the solver statistics to `work`.
pub fn work_error(point: &Point, bounds: &Bounds, optimum: &Optimum, work: &mut RunStats) -> f64 {
    let (bound, stats) = error::of_optimum(&transition(point), point[Quantity::Time], bounds, optimum);
    *work += RunStats { optima: 1, ..RunStats::from(stats) };
    bound.unwrap_or(f64::NAN)
}

/// The least work of `point` under its law and velocity ceiling, with its error bound if `wanted`. Adds the solver statistics to `work`.
pub fn least_work(job: &Job<'_>, point: &Point, wanted: bool, work: &mut RunStats) -> Solved<(f64, f64)> {
    let (transition, t_f, v_ceiling) = (transition(point), point[Quantity::Time], point[Quantity::VelocityCeiling]);
    let solved = if point.state_law() != StateLaw::Ageing {
        let solved = relaxed::solve(point.state_law(), &transition, t_f, v_ceiling);
        solved.map(|found| (found.optimum.work, relaxed::work_error(&found, &transition, t_f)))
    } else if job.friction == Friction::Regularised {
        arcsinh::solve(&transition, t_f).map(|found| (found.optimum.work, f64::NAN))
    } else {
        let bounds = Bounds::new(job.bounded).with_v_ceiling(v_ceiling);
        let mut error = |optimum: &Optimum| if wanted { work_error(point, &bounds, optimum, work) } else { f64::NAN };
        optimal::solve(&transition, t_f, bounds, job.rtol).map(|optimum| (optimum.work, error(&optimum)))
    };
    *work += RunStats { own_optima: 1, ..RunStats::from(solved.stats) };
    solved
}

/// The least work of any protocol, and the gap of one protocol to it.
pub struct Comparison {
    /// The least work W*; NaN if unknown.
    pub work: f64,
    /// The gap (W - W*)/W*.
    pub gap: f64,
    /// Error bound of the gap; NaN if not requested.
    pub gap_error: f64,
    /// The status of the optimum; `Ok` if it is not requested or infeasible.
    pub optimum: Status,
}

impl Comparison {
    /// A comparison without values.
    pub const NONE: Comparison = Comparison { work: f64::NAN, gap: f64::NAN, gap_error: f64::NAN, optimum: Status::Ok };
}

/// Compares a work and its error bound with the least work of the tuple of `point` under `bounds`, if that is `wanted`; the second request is that of the
/// error bound of the gap. Adds the solver statistics to `work`.
pub fn compare(
    job: &Job<'_>,
    row: (u64, &Point),
    bounds: &Bounds,
    (work_s, error): (f64, f64),
    wanted: [bool; 2],
    work: &mut RunStats,
) -> Comparison {
    if !wanted[0] {
        return Comparison::NONE;
    }
    let optimum = optimum(job, row, bounds, work);
    let status = if optimum.status == Status::Infeasible { Status::Ok } else { optimum.status };
    let Some(least) = optimum.value else { return Comparison { optimum: status, ..Comparison::NONE } };
    let gap_error = if wanted[1] {
        error::of_gap((work_s, error), (least.work, work_error(row.1, bounds, &least, work)))
    } else {
        f64::NAN
    };
    Comparison { work: least.work, gap: (work_s - least.work) / least.work, gap_error, optimum: status }
}

/// An optimal protocol that is solved at most once.
type Slot = OnceLock<Solved<Optimum>>;

/// The cache of optimal protocols without ceilings, by tuple number.
#[derive(Debug)]
pub enum OptimumCache {
    /// A slot for each number.
    Dense(Vec<Slot>),
    /// A slot for each number that occurs.
    Sparse(Memo<u64, Solved<Optimum>>),
}

impl OptimumCache {
    /// Greatest number of tuples kept for a whole run. Chosen: about 100 MB; larger grids keep those of one part.
    pub const MAX_CACHED: u64 = 1 << 20;

    /// A cache for `tuples` different transitions and durations, with numbers below `span`.
    pub fn new(tuples: u64, span: u64) -> OptimumCache {
        if span > Self::MAX_CACHED && tuples <= Self::MAX_CACHED {
            return OptimumCache::Sparse(Memo::default());
        }
        let kept = if span <= Self::MAX_CACHED { span as usize } else { 0 };
        OptimumCache::Dense(std::iter::repeat_with(OnceLock::new).take(kept).collect())
    }

    /// The optimal protocol with this tuple number, from `solve` if it is unknown.
    fn get(&self, tuple: u64, solve: impl FnOnce() -> Solved<Optimum>) -> Solved<Optimum> {
        match self {
            OptimumCache::Dense(slots) => match usize::try_from(tuple).ok().and_then(|tuple| slots.get(tuple)) {
                Some(slot) => *slot.get_or_init(solve),
                None => solve(),
            },
            OptimumCache::Sparse(slots) => slots.get(tuple, solve),
        }
    }
}
