//! The optimal protocol: least work of friction from `(v_i, 1/v_i)` to `(v_f, 1/v_f)` in time `t_f`.
//!
//! It is a quadrature and one scalar root (docs/derivations.md): a regular `arc` along which `C` is conserved, under the
//! bound `v >= 1` after time at the `floor`; the family of such `extremal`s has one parameter, in which the time is monotone.

mod arc;
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
use extremal::Problem;
use lifetime::Lifetime;

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
    /// Time spent on the bound `v = 1`.
    pub time_at_floor: f64,
    /// `dW*/dt_f = -C`, the Hamiltonian.
    pub hamiltonian: f64,
    /// Largest contact lifetime on the way.
    pub theta_max: f64,
    /// The start.
    pub strategy: Strategy,
}

/// Solves one optimal protocol to relative accuracy `rtol`, with `v >= 1` where `bounded`.
///
/// `Infeasible` where no protocol is fast enough under the bound (`t_f < t_min`), or where an argument is outside its
/// domain (`a > 0`, `b >= 0`, `v_i, v_f > 1`, `t_f > 0`, all finite). Without the bound, `BelowBound` where `v(0+) <
/// 1`. `Unproven` where `tau <= max(0, b - a)` somewhere, `NegativeFriction` where `tau < 0`; an extremal that falls
/// below the bound there has no numbers.
pub fn solve(transition: &Transition, t_f: f64, bounded: bool, rtol: f64) -> Solved<Optimum> {
    let Some(problem) = Problem::of(transition, bounded).filter(|_| t_f > 0.0 && t_f.is_finite()) else {
        return Solved { status: Status::Infeasible, value: None, stats: SolverStats::default() };
    };
    search::solve(&problem, t_f, rtol)
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
    bounded: bool,
    rtol: f64,
) -> (Solved<Optimum>, Option<Box<dyn Motion>>) {
    let (solved, route) = route(transition, t_f, bounded, rtol);
    (solved, route.map(|route| Box::new(route) as Box<dyn Motion>))
}

/// The optimal protocol and its path.
pub(super) fn route(transition: &Transition, t_f: f64, bounded: bool, rtol: f64) -> (Solved<Optimum>, Option<Route>) {
    let Some(problem) = Problem::of(transition, bounded).filter(|_| t_f > 0.0 && t_f.is_finite()) else {
        return (Solved { status: Status::Infeasible, value: None, stats: SolverStats::default() }, None);
    };
    let (solved, extremal) = search::find(&problem, t_f, rtol.min(MOTION_RTOL));
    let route = solved.value.map(|_| Route::new(&problem, t_f, extremal));
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
    let (solved, extremal) = search::find_beyond(&problem, time, rtol);
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
    let ln_v = match extremal {
        Some(extremal) if optimum.strategy != Strategy::Floor => extremal.start - from.ln,
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
