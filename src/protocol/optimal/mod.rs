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
mod floor;
mod guess;
mod lifetime;
mod motion;
mod route;
mod search;

use super::{Motion, Solved, SolverStats, Status};
use crate::model::{Law, Transition};
use crate::numerics::elementary::{exp, ln_1p};
use ceiling::Ceilings;
use extremal::Problem;
use lifetime::Lifetime;
use search::Time;

pub use bounds::Bounds;
pub(super) use motion::Optimal as Route;
pub(super) use route::{PathPoint, PathSegment, lag_at_bound};

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
}

impl Strategy {
    /// All strategies, in their order.
    pub const ALL: [Strategy; 3] = [Strategy::SpeedUp, Strategy::SlowDown, Strategy::Floor];

    /// The name that is written into tables.
    pub fn name(self) -> &'static str {
        match self {
            Strategy::SpeedUp => "speed_up",
            Strategy::SlowDown => "slow_down",
            Strategy::Floor => "floor",
        }
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
    /// All kinds, in their order.
    pub const ALL: [ArcKind; 4] = [ArcKind::Free, ArcKind::Floor, ArcKind::VCeiling, ArcKind::TauCeiling];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            ArcKind::Free => "free",
            ArcKind::Floor => "floor",
            ArcKind::VCeiling => "v_ceiling",
            ArcKind::TauCeiling => "tau_ceiling",
        }
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
/// 1`. `Unproven` where `tau <= max(0, b - a)` somewhere, `NegativeFriction` where `tau < 0`; an extremal that falls
/// below the bound there has no numbers.
pub fn solve(transition: &Transition, t_f: f64, bounds: impl Into<Bounds>, rtol: f64) -> Solved<Optimum> {
    let bounds = bounds.into();
    let problem = Problem::of(transition, bounds.floor).filter(|_| t_f > 0.0 && t_f.is_finite());
    let (Some(problem), true) = (problem, bounds.is_valid()) else { return INFEASIBLE };
    if !bounds.has_ceilings() {
        return search::solve(&problem, t_f, rtol);
    }
    let ceilings = Ceilings::new(transition.law, problem.to, transition.v_f, &bounds);
    constrained::find(&problem, &ceilings, Time::since(&problem, t_f), rtol).solved
}

const INFEASIBLE: Solved<Optimum> =
    Solved { status: Status::Infeasible, value: None, stats: SolverStats { quadratures: 0, nodes: 0 } };

const UNDONE: Solved<Optimum> =
    Solved { status: Status::NotConverged, value: None, stats: SolverStats { quadratures: 0, nodes: 0 } };

/// The optimal protocol and the derivatives of its work.
pub fn slopes(
    transition: &Transition,
    t_f: f64,
    bounds: impl Into<Bounds>,
    rtol: f64,
) -> (Solved<Optimum>, Option<Slopes>) {
    (solve(transition, t_f, bounds, rtol), None)
}

/// The least and the greatest feasible time under the bounds, each in closed form or one quadrature; the greatest is
/// infinite unless a ceiling keeps theta from rising. `None` where no time is feasible.
pub fn feasible_times(transition: &Transition, bounds: impl Into<Bounds>) -> Option<(f64, f64)> {
    let bounds = bounds.into();
    Some((shortest_time(transition, bounds.floor)?, f64::INFINITY))
}

/// The least ceiling of the velocity that allows `t_f`, with the other bounds as they are; `None` where no ceiling does.
pub fn least_v_ceiling(_transition: &Transition, _t_f: f64, _bounds: impl Into<Bounds>, _rtol: f64) -> Option<f64> {
    None
}

/// The least ceiling of friction that allows `t_f`, with the other bounds as they are; `None` where no ceiling does.
pub fn least_tau_ceiling(_transition: &Transition, _t_f: f64, _bounds: impl Into<Bounds>, _rtol: f64) -> Option<f64> {
    None
}

/// Why a protocol is infeasible; `None` for a feasible one.
pub fn obstacle(transition: &Transition, t_f: f64, bounds: impl Into<Bounds>) -> Option<Obstacle> {
    match shortest_time(transition, bounds.into().floor) {
        None => Some(Obstacle::Domain),
        Some(t_least) => (t_f < t_least).then_some(Obstacle::TooFast { t_least }),
    }
}

/// The closed-loop law: the optimal protocol from the contact lifetime `theta` to steady sliding at `v_f` in `t_left`.
pub fn feedback_at(
    _law: Law,
    _theta: f64,
    _t_left: f64,
    _v_f: f64,
    _bounds: impl Into<Bounds>,
    _rtol: f64,
) -> Solved<FeedbackPoint> {
    Solved { status: Status::NotConverged, value: None, stats: SolverStats::default() }
}

/// The optimal protocol from the contact lifetime `theta` to steady sliding at `v_f` in `t_left`, and its motion.
pub fn motion_from(
    _law: Law,
    _theta: f64,
    _t_left: f64,
    _v_f: f64,
    _bounds: impl Into<Bounds>,
    _rtol: f64,
) -> (Solved<Optimum>, Option<Box<dyn Motion>>) {
    (UNDONE, None)
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
    let bounds = bounds.into();
    if bounds.has_ceilings() {
        return (UNDONE, None);
    }
    let (solved, route) = route(transition, t_f, bounds.floor, rtol);
    (solved, route.map(|route| Box::new(route) as Box<dyn Motion>))
}

/// The optimal protocol and its path.
pub(super) fn route(transition: &Transition, t_f: f64, bounded: bool, rtol: f64) -> (Solved<Optimum>, Option<Route>) {
    let Some(problem) = Problem::of(transition, bounded).filter(|_| t_f > 0.0 && t_f.is_finite()) else {
        return (Solved { status: Status::Infeasible, value: None, stats: SolverStats::default() }, None);
    };
    let (solved, member) = search::find(&problem, t_f, rtol.min(MOTION_RTOL));
    let route = solved.value.map(|_| Route::new(&problem, t_f, member.map(|member| member.extremal)));
    (solved, route)
}

/// Accuracy of every motion: the time on the arc is what is left of `t_f` after the hold.
const MOTION_RTOL: f64 = 1e-12;

/// The least time in which there is a protocol with `v >= 1`, or `v > 0` without the bound; 0 for an acceleration.
pub fn shortest_time(transition: &Transition, bounded: bool) -> Option<f64> {
    Some(Problem::of(transition, bounded)?.t_min())
}

/// The optimal feedback: velocity and multipliers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Feedback {
    /// Its velocity, which may be too small for a number.
    pub v: f64,
    /// Its logarithm.
    pub ln_v: f64,
    /// The multiplier of the floor: the derivative of the cost rate with respect to `v`; 0 above the floor.
    pub pressure: f64,
}

/// The start of an optimal protocol, on a path to steady sliding.
#[derive(Debug, Clone, Copy)]
pub(super) struct Position {
    /// The contact lifetime.
    pub theta: f64,
    /// 1 less that.
    pub rest: f64,
    /// By how much the contact lifetime is above that of steady sliding at the end.
    pub drop: f64,
    pub time_left: f64,
    /// `drop`, and the time that is left by how much contacts age at first: times `1 - theta_1` under the bound. For a
    /// rise it is a small difference of the two.
    pub margin: f64,
}

/// Optimal feedback: what the optimal protocol does now, on the way to steady sliding at `v_f`. `None` where no protocol
/// arrives in time, or where the solver could not certify its answer.
pub(super) fn feedback(
    law: Law,
    v_f: f64,
    position: Position,
    bounded: bool,
    rtol: f64,
    stats: &mut SolverStats,
) -> Option<Feedback> {
    let to = Lifetime::steady(v_f);
    let Position { theta, rest, drop, time_left, margin } = position;
    // A change that no velocity shows, and none of theta.
    let unseen = drop.abs() <= f64::EPSILON * time_left.min(theta).min(rest);
    let drop = if unseen { 0.0 } else { drop };
    let from = Lifetime::with(theta, rest);
    let problem = Problem { law, from, to, fall: drop / to.theta, bounded };
    // The least time of a rise is -drop, or, under the bound, ln(1 - drop/(1 - theta_1)).
    let aged = -drop / to.rest;
    let (beyond, size) = if drop >= 0.0 {
        (time_left, time_left)
    } else if !bounded {
        (margin, margin)
    } else if aged < 0.5 {
        let parts = [margin / to.rest, above_ln_1p(aged)];
        (parts[0] + parts[1], parts[0].abs() + parts[1] - problem.rest_beyond())
    } else {
        (time_left - problem.t_min(), time_left)
    };
    let rounding = ROUNDINGS * f64::EPSILON * size;
    let beyond = if bounded && beyond <= rounding { 0.0 } else { beyond };
    let time = search::Time { whole: time_left, beyond, doubt: rounding / beyond };
    let (solved, member) = search::find_beyond(&problem, time, rtol);
    *stats += solved.stats;
    let optimum = solved.value?;
    let pressure = if optimum.strategy == Strategy::Floor {
        // On the bound -C = friction + V_theta (1 - theta), with the C of the arc that leaves it at theta_c, where 1 -
        // theta_c = (1 - theta) e^-t: nothing cancels near theta = 1.
        let held = optimum.time_at_floor;
        let released = from.aged(held);
        let grown = ln_1p(from.growth(held) / from.theta);
        let leaving = (1.0 + law.a + law.b * released.ln) * exp(-held) / released.theta;
        let friction = 1.0 + law.b * from.ln;
        let v_theta = leaving + law.b * grown / from.rest;
        (friction + law.a - v_theta * from.theta).max(0.0)
    } else {
        0.0
    };
    let ln_v = match member {
        Some(member) if optimum.strategy != Strategy::Floor => member.extremal.start - from.ln,
        _ => 0.0,
    };
    Some(Feedback { v: optimum.v_start, ln_v, pressure })
}

/// Roundings of what the time beyond the least one is a difference of.
const ROUNDINGS: f64 = 64.0;

/// `x - ln(1 + x)` for `0 <= x < 0.5`, without cancellation.
fn above_ln_1p(x: f64) -> f64 {
    // ln(1 + x) = 2 artanh s with s = x/(2 + x), and x - 2 s = s x.
    let s = x / (2.0 + x);
    let (square, mut power, mut sum) = (s * s, s, 0.0);
    for k in 1..16 {
        power *= square;
        sum += power / f64::from(2 * k + 1);
    }
    s * x - 2.0 * sum
}

impl Problem {
    /// The problem of a transition between steady states; `None` outside the domain.
    fn of(transition: &Transition, bounded: bool) -> Option<Problem> {
        let &Transition { law, v_i, v_f } = transition;
        let inside = law.a > 0.0 && law.b >= 0.0 && v_i > 1.0 && v_f > 1.0;
        let finite = law.a.is_finite() && law.b.is_finite() && v_i.is_finite() && v_f.is_finite();
        (inside && finite).then(|| Problem {
            law,
            from: Lifetime::steady(v_i),
            to: Lifetime::steady(v_f),
            fall: (v_f - v_i) / v_i,
            bounded,
        })
    }
}
