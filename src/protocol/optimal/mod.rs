//! The optimal protocol: least work of friction from `(v_i, 1/v_i)` to `(v_f, 1/v_f)` in time `t_f`.
//!
//! It is a quadrature and one scalar root (docs/derivations.md): a regular `arc` along which `C` is conserved, under the
//! bound `v >= 1` after time at the `floor`; the family of such `extremal`s has one parameter, in which the time is monotone.

mod arc;
mod bounds;
mod ceiling;
mod clamp;
mod constrained;
pub mod crossover;
mod extremal;
mod feasible;
mod feedback;
mod floor;
mod guess;
mod lifetime;
mod motion;
mod route;
mod search;
mod slopes;

use super::{Motion, Solved, SolverStats, Status};
use crate::model::Transition;
use crate::numerics::LONG_ROUNDING_RTOL;
use ceiling::Ceilings;
use constrained::Constrained;
use extremal::Problem;
use guess::Guess;
use lifetime::Lifetime;
use motion::OptimalMotion;
use search::{FreeOptimum, Time};

pub use bounds::Bounds;
pub use feasible::{acceleration_time_at_ceiling, feasible_times, least_tau_ceiling, least_v_ceiling, obstacle};
pub(super) use feedback::{Position, feedback};
pub use feedback::{feedback_at, motion_from};
pub(super) use route::{PathPoint, PathSegment, Route, lag_at_bound};

/// The start of the optimal protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Strategy {
    /// Jumps up: `v(0+) > v_i`.
    SpeedUp,
    /// Jumps down, but stays off the bound: `1 < v(0+) <= v_i`.
    SlowDown,
    /// Starts on the bound `v = 1`.
    Floor,
    /// At `v = 1`, then on the ceiling of the velocity.
    WaitJerk,
    /// On the ceiling of the velocity, then at `v = 1`.
    JerkWait,
    /// Alternates between both bounds ever faster, so that theta rests.
    Chatter,
    /// Off the bounds, where the state of the slip law rises faster than at `v = 1`.
    Rise,
}

impl Strategy {
    /// The names in tables, in the order of the strategies.
    pub const NAMES: [&'static str; 7] =
        ["speed_up", "slow_down", "floor", "wait_jerk", "jerk_wait", "chatter", "rise"];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        Strategy::NAMES[self as usize]
    }
}

/// The optimal protocol of one transition in one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optimum {
    /// Least work `W*` (scaled: `mu_0 sigma l`).
    pub work: f64,
    /// Velocity just after the start, `v(0+)`.
    pub v_start: f64,
    /// Velocity just before the end, `v(t_f-)`.
    pub v_end: f64,
    /// Time at the floor `v = 1`.
    pub time_at_floor: f64,
    /// Time at the ceiling of the velocity.
    pub time_at_v_ceiling: f64,
    /// Time at the ceiling of friction.
    pub time_at_tau_ceiling: f64,
    /// `dW*/dt_f = -C`, the Hamiltonian.
    pub hamiltonian: f64,
    /// Largest contact lifetime on the way.
    pub theta_max: f64,
    /// Largest friction on the way.
    pub friction_max: f64,
    /// The start.
    pub strategy: Strategy,
}

/// Derivatives of the least work `W*`; that by `t_f` is [`Optimum::hamiltonian`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slopes {
    /// `dW*/da`.
    pub a: f64,
    /// `dW*/db`.
    pub b: f64,
    /// `dW*/dv_i`.
    pub v_i: f64,
    /// `dW*/dv_f`.
    pub v_f: f64,
    /// By the ceiling of the velocity, at most 0; 0 where it does not bind.
    pub v_ceiling: f64,
    /// By the ceiling of friction, at most 0; 0 where it does not bind.
    pub tau_ceiling: f64,
}

/// The kind of an arc of an optimal protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum ArcKind {
    /// Off all bounds.
    Free,
    /// At the floor `v = 1`.
    Floor,
    /// At the ceiling of the velocity.
    VCeiling,
    /// At the ceiling of friction.
    TauCeiling,
}

impl ArcKind {
    /// The names in tables, in the order of the kinds.
    pub const NAMES: [&'static str; 4] = ["free", "floor", "v_ceiling", "tau_ceiling"];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        ArcKind::NAMES[self as usize]
    }
}

/// The closed-loop law at one contact lifetime and time left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedbackPoint {
    /// Velocity of the optimal protocol now.
    pub v: f64,
    /// Least work of the time left.
    pub work_to_go: f64,
    /// Derivative of `work_to_go` with respect to theta.
    pub costate: f64,
    /// `dv/dtheta` at fixed time left.
    pub gain: f64,
    /// The arc now.
    pub arc: ArcKind,
}

/// Why no protocol obeys the bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Obstacle {
    /// An argument is outside its domain.
    Domain,
    /// `t_f` is below `t_least`.
    TooFast {
        /// The least feasible time.
        t_least: f64,
    },
    /// `t_f` is above `t_most`.
    TooSlow {
        /// The greatest feasible time.
        t_most: f64,
    },
    /// The ceiling of the velocity is too low for every `t_f`.
    VCeiling {
        /// Every feasible ceiling is above it, or at it.
        above: f64,
    },
    /// The ceiling of friction is too low for every `t_f`.
    TauCeiling {
        /// Every feasible ceiling is above it, or at it.
        above: f64,
    },
}

/// Solves one optimal protocol to relative accuracy `rtol` under `bounds`; `true` or `false` stands for the floor alone.
///
/// `Infeasible` where no protocol is fast enough under the bound (`t_f < t_min`), or where an argument is outside its
/// domain (`a > 0`, `b >= 0`, `v_i, v_f > 1`, `t_f > 0`, all finite). Without the bound, `BelowBound` where `v(0+) <
/// 1`. `Unproven` where `tau <= max(0, b - a)` somewhere, unless `tau_ss >= 2 (b - a)` at both ends; `NegativeFriction` where
/// `tau < 0`; an extremal that falls below the bound where it is unproven has no numbers.
pub fn solve(transition: &Transition, t_f: f64, bounds: impl Into<Bounds>, rtol: f64) -> Solved<Optimum> {
    let bounds = bounds.into();
    if !bounds.has_ceilings() {
        return free(transition, t_f, bounds.floor, rtol).map_or(INFEASIBLE, |(_, (solved, _))| solved);
    }
    let Some((problem, ceilings)) = posed(transition, t_f, &bounds) else { return INFEASIBLE };
    constrained::find(&problem, &ceilings, Time::since(&problem, t_f), rtol).solved
}

const INFEASIBLE: Solved<Optimum> =
    Solved::without_numbers(Status::Infeasible, SolverStats { quadratures: 0, nodes: 0 });

/// The optimal protocol and the derivatives of its work; `None` at the least time of a deceleration.
///
/// At the border of the feasible region they are the limits from inside. Steady sliding on both ceilings at once is a corner:
/// all but that by `v_i` are NaN.
pub fn slopes(
    transition: &Transition,
    t_f: f64,
    bounds: impl Into<Bounds>,
    rtol: f64,
) -> (Solved<Optimum>, Option<Slopes>) {
    let Some((problem, ceilings)) = posed(transition, t_f, &bounds.into()) else { return (INFEASIBLE, None) };
    let Constrained { mut solved, path, sitting } =
        constrained::find(&problem, &ceilings, Time::since(&problem, t_f), rtol);
    let tolerance = search::quadrature_tolerance(rtol);
    let slopes = slopes::slopes(&problem, path.as_ref(), sitting, tolerance, &mut solved.stats);
    (solved, slopes)
}

/// The problem without ceilings, its optimum and the extremal of that; `None` outside the domain.
fn free(transition: &Transition, t_f: f64, bounded: bool, rtol: f64) -> Option<(Problem, FreeOptimum)> {
    let problem = Problem::of(transition, bounded).filter(|_| t_f > 0.0 && t_f.is_finite())?;
    let time = Time::since(&problem, t_f);
    Some((problem, search::free(&problem, time, rtol, &Guess::of(&problem, time.beyond))))
}

/// The problem and its ceilings; `None` outside the domain.
fn posed(transition: &Transition, t_f: f64, bounds: &Bounds) -> Option<(Problem, Ceilings)> {
    let problem = Problem::of(transition, bounds.floor)?;
    let inside = t_f > 0.0 && t_f.is_finite() && bounds.is_valid();
    let &Transition { law, v_i, v_f } = transition;
    inside.then(|| (problem, Ceilings::new(law, [v_i, v_f], problem.depth(), bounds)))
}

/// The optimal protocol and its motion.
///
/// Time is good to `rtol`, or 1e-12 if that is less, of `t_f`; on the arc also of what is left of it. `v`, `theta` and
/// `friction` belong to the extremal to a few units in the last place. The costate `beta` is the one of the Hamiltonian
/// `H = tau v - beta theta' = -C`, so `beta = -dV/dtheta` with `V(theta, time left)` the least work: `1 + a + a ln v +
/// b ln theta + beta theta = 0` on the arc, and `beta = (C + tau)/(1 - theta)` on the bound `v = 1`, continuous where
/// the arc begins.
pub fn motion(
    transition: &Transition,
    t_f: f64,
    bounds: impl Into<Bounds>,
    rtol: f64,
) -> (Solved<Optimum>, Option<Box<dyn Motion>>) {
    let Some((problem, ceilings)) = posed(transition, t_f, &bounds.into()) else { return (INFEASIBLE, None) };
    motion_of(&problem, &ceilings, t_f, rtol)
}

fn motion_of(
    problem: &Problem,
    ceilings: &Ceilings,
    t_f: f64,
    rtol: f64,
) -> (Solved<Optimum>, Option<Box<dyn Motion>>) {
    let found = constrained::find(problem, ceilings, Time::since(problem, t_f), rtol.min(MOTION_RTOL));
    let motion = found.solved.value.map(|_| OptimalMotion::new(problem, t_f, &found));
    (found.solved, motion.map(|motion| Box::new(motion) as Box<dyn Motion>))
}

/// The optimal protocol and its path.
pub(super) fn route(transition: &Transition, t_f: f64, bounded: bool, rtol: f64) -> (Solved<Optimum>, Option<Route>) {
    let Some((problem, (solved, member))) = free(transition, t_f, bounded, rtol.min(MOTION_RTOL)) else {
        return (INFEASIBLE, None);
    };
    (solved, solved.value.map(|_| Route::new(&problem, t_f, member.map(|(extremal, _)| extremal))))
}

/// Accuracy of every motion and of the feedback along one: the time on the arc is what is left of `t_f` after the floor arc. Derived: the rounding
/// of such sums, a hundredth of the default `rtol`.
pub(super) const MOTION_RTOL: f64 = LONG_ROUNDING_RTOL;

/// The least time in which there is a protocol with `v >= 1`, or `v > 0` without the bound; 0 for an acceleration.
pub fn shortest_time(transition: &Transition, bounded: bool) -> Option<f64> {
    Some(Problem::of(transition, bounded)?.t_min())
}

impl Problem {
    /// The problem of a transition between steady states; `None` outside the domain.
    fn of(transition: &Transition, bounded: bool) -> Option<Problem> {
        let &Transition { law, v_i, v_f } = transition;
        let inside = law.a > 0.0 && law.b >= 0.0 && v_i > 1.0 && v_f > 1.0;
        let finite = law.a.is_finite() && law.b.is_finite() && v_i.is_finite() && v_f.is_finite();
        (inside && finite).then(|| Problem::between(transition, bounded))
    }

    /// The problem of a transition between steady states, which may lie at `v = 1`.
    fn between(&Transition { law, v_i, v_f }: &Transition, bounded: bool) -> Problem {
        let (from, to) = (Lifetime::steady(v_i), Lifetime::steady(v_f));
        Problem { law, from, to, fall: (v_f - v_i) / v_i, bounded }
    }
}
