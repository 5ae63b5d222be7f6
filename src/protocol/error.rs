//! How far a work may be off: told by a second solve, as fine as there is.
//!
//! Quadratures converge geometrically, so what they leave is the distance from a finer one but for a small share of it,
//! and rounding is a few units in the last place of what the work is made of.

use crate::model::{Law, Transition};
use crate::numerics::elementary::ln;
use crate::protocol::optimal::{self, Optimum};
use crate::protocol::shortcut::{Case, Family, Shortcut};
use crate::protocol::{Solved, SolverStats, Status};

/// The accuracy of the second solve, the finest that solvers tell from rounding.
pub const FINEST: f64 = 1e-15;

/// What a solve to [`FINEST`] leaves beside rounding is at most this share of its distance from a coarser one.
const LEFT_BY_FINEST: f64 = 0.25;

/// Rounding of a sum of some hundred positive terms, each good to a few units in the last place.
const ROUNDING: f64 = 20.0 * f64::EPSILON;

/// Bound of the error of a number that is `found`, and `finest` by a solve to [`FINEST`]; `scale` is the size of what
/// it is a sum of.
pub fn bound(found: f64, finest: f64, scale: f64) -> f64 {
    (1.0 + LEFT_BY_FINEST) * (found - finest).abs() + ROUNDING * scale.abs()
}

/// Bound of the error of the work of a free cubic shortcut of least velocity `v_min` in time `t_f`: its sum without
/// logarithms is rounded twice as much, and slow sliding and a long theta may take friction to 0 and below, which leaves
/// less than its terms along the way.
pub fn of_shortcut(transition: &Transition, t_f: f64, v_min: f64, work: f64, finest: f64) -> f64 {
    let Transition { law: Law { a, b }, v_i, v_f } = *transition;
    let terms = 1.0 + a * (-ln(v_min)).max(0.0) + b * ln(v_i.max(v_f));
    bound(work, finest, 2.0 * terms * work.abs().max(v_min * t_f))
}

/// Bound of the error of a gap `found`, and `finest` by a solve to [`FINEST`], that is a difference of two sums of
/// about the size `replaced`.
pub fn of_excess(found: f64, finest: f64, replaced: f64) -> f64 {
    bound(found, finest, found.abs() + 0.5 * replaced.abs())
}

/// Bound of the error of the work of `optimum`, found by [`optimal::solve`] with the same arguments; `None` where there
/// is no finer one.
///
/// A work that is a small difference is as sensitive to `t_f` as `dW*/dt_f` says, so that rounding of times counts.
pub fn of_optimum(transition: &Transition, t_f: f64, bounded: bool, optimum: &Optimum) -> (Option<f64>, SolverStats) {
    let Solved { status, value, stats } = optimal::solve(transition, t_f, bounded, FINEST);
    let finest = value.filter(|_| status != Status::NotConverged);
    let scale = optimum.work.abs() + 0.25 * (optimum.hamiltonian * t_f).abs();
    (finest.map(|finest| bound(optimum.work, finest.work, scale)), stats)
}

/// Bound of the error of the work of a `member` of a family, found with the same case; `None` where there is no finer
/// one.
///
/// A third one, given a little more time, tells what rounding of the time makes of a member that has hardly any to
/// spare. Where friction is bounded, theta and `v` are powers `e^((tau - 1)/a)`, whose exponent is rounded; the factor by which
/// velocities far apart raise that was measured.
pub fn of_member(family: &dyn Family, case: &Case, member: &Shortcut, stats: &mut SolverStats) -> Option<f64> {
    let finest = family.solve(case, FINEST, stats).ok()?;
    let Transition { law: Law { a, b }, v_i, v_f } = case.transition;
    let (exponent, delay) = if family.heeds_tau_ceiling() {
        (0.05 * (0.25 * ln(v_f / v_i)).powi(4).max(1.0) * (case.tau_ceiling.abs() + b) / a, 1.5 * ROUNDING)
    } else {
        (0.0, 0.5 * ROUNDING)
    };
    let later = Case { t_f: case.t_f * (1.0 + delay), ..*case };
    let late = (family.solve(&later, FINEST, stats).ok()?.work - finest.work).abs();
    Some(late + bound(member.work, finest.work, (1.0 + exponent) * member.work))
}

/// Bound of the error of the gap `(work - least)/least` of two works with errors.
pub fn of_gap((work, error): (f64, f64), (least, error_least): (f64, f64)) -> f64 {
    (error + (work / least).abs() * error_least) / least.abs() + f64::EPSILON * (work / least).abs().max(1.0)
}
