//! The closed-loop law: what the optimal protocol does now, from the contact lifetime and the time that is left.

use super::ceiling::Ceilings;
use super::constrained::{self, Constrained};
use super::extremal::Problem;
use super::guess::Guess;
use super::lifetime::Lifetime;
use super::search::{self, Time};
use super::{ArcKind, Bounds, FeedbackPoint, INFEASIBLE, Optimum, Strategy, slopes};
use crate::model::Law;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::{exp, ln_1p, phi};
use crate::protocol::{Motion, Solved, SolverStats, Status};

/// The closed-loop law: the optimal protocol from the contact lifetime `theta` to steady sliding at `v_f` in `t_left`.
///
/// `Infeasible` where no protocol arrives in time under the bounds, and outside the domain. For `theta >= 1`, older than any steady
/// state, it is the protocol without the floor: `BelowBound` where that is below 1.
pub fn feedback_at(
    law: Law,
    theta: f64,
    t_left: f64,
    v_f: f64,
    bounds: impl Into<Bounds>,
    rtol: f64,
) -> Solved<FeedbackPoint> {
    let Some((problem, ceilings)) = posed(law, theta, t_left, v_f, &bounds.into()) else {
        return Solved::without_numbers(Status::Infeasible, SolverStats::default());
    };
    let Constrained { solved, path, sitting } =
        constrained::find(&problem, &ceilings, Time::since(&problem, t_left), rtol);
    let Solved { status, value, stats } = solved;
    let Some(optimum) = value else { return Solved::without_numbers(status, stats) };
    let tolerance = search::quadrature_tolerance(rtol);
    let point = match &path {
        Some(path) => {
            let kind = path.pieces().next().map_or(ArcKind::Free, |piece| piece.kind());
            let arc = if optimum.time_at_floor > 0.0 { ArcKind::Floor } else { kind };
            let gain = slopes::gain(&problem, path, sitting.is_some(), tolerance);
            slopes::costate(&problem, path).zip(gain).map(|(costate, gain)| (costate, gain, arc))
        }
        // Without a path it is steady sliding, or the floor to the end: with less theta no protocol arrives.
        None => sitting.map(|sitting| ((problem.friction_end() + law.a) / theta, 0.0, sitting.kind)),
    };
    let Some((costate, gain, arc)) = point else {
        return Solved::without_numbers(Status::Infeasible, stats);
    };
    let value = FeedbackPoint { v: optimum.v_start, work_to_go: optimum.work, costate, gain, arc };
    Solved { status, value: Some(value), stats }
}

/// The problem from `theta` to steady sliding at `v_f`, and its ceilings; `None` outside the domain.
fn posed(law: Law, theta: f64, t_left: f64, v_f: f64, bounds: &Bounds) -> Option<(Problem, Ceilings)> {
    let numbers = [law.a, law.b, theta, t_left, v_f].iter().all(|x| x.is_finite());
    let inside = law.a > 0.0 && law.b >= 0.0 && theta > 0.0 && t_left > 0.0 && v_f > 1.0;
    if !(numbers && inside && bounds.is_valid()) {
        return None;
    }
    let fall = (DoubleDouble::product(theta, v_f) + DoubleDouble::new(-1.0)).high;
    let (from, to) = (Lifetime::with(theta, 1.0 - theta), Lifetime::steady(v_f));
    let problem = Problem { law, from, to, fall, bounded: bounds.floor && theta < 1.0 };
    Some((problem, Ceilings::new(law, [1.0 / theta, v_f], problem.depth(), bounds)))
}

/// The optimal protocol from the contact lifetime `theta` to steady sliding at `v_f` in `t_left`, and its motion.
pub fn motion_from(
    law: Law,
    theta: f64,
    t_left: f64,
    v_f: f64,
    bounds: impl Into<Bounds>,
    rtol: f64,
) -> (Solved<Optimum>, Option<Box<dyn Motion>>) {
    let Some((problem, ceilings)) = posed(law, theta, t_left, v_f, &bounds.into()) else { return (INFEASIBLE, None) };
    super::motion_of(&problem, &ceilings, t_left, rtol)
}

/// The optimal feedback: velocity and multipliers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feedback {
    /// Its velocity, which may be too small for a number.
    pub v: f64,
    /// Its logarithm.
    pub ln_v: f64,
    /// The multiplier of the floor: the derivative of the cost rate with respect to `v`; 0 above the floor.
    pub pressure: f64,
}

/// The start of an optimal protocol, on a path to steady sliding.
#[derive(Debug, Clone, Copy)]
pub struct Position {
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
pub fn feedback(
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
        // aged - ln(1 + aged) without cancellation.
        let parts = [margin / to.rest, phi(ln_1p(aged))];
        (parts[0] + parts[1], parts[0].abs() + parts[1] - problem.rest_beyond())
    } else {
        (time_left - problem.t_min(), time_left)
    };
    let rounding = ROUNDINGS * f64::EPSILON * size;
    let beyond = if bounded && beyond <= rounding { 0.0 } else { beyond };
    let time = Time { whole: time_left, beyond, doubt: rounding / beyond };
    let (solved, member) = search::free(&problem, time, rtol, &Guess::of(&problem, time.beyond));
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
        Some((extremal, _)) if optimum.strategy != Strategy::Floor => extremal.start - from.ln,
        _ => 0.0,
    };
    Some(Feedback { v: optimum.v_start, ln_v, pressure })
}

/// Roundings of the terms of which the time beyond the least one is a difference. Chosen: those of some dozen operations.
const ROUNDINGS: f64 = 64.0;
