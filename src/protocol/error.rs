//! Error bounds of works, from a second solve at the tightest tolerance.
//!
//! Quadratures converge geometrically, so their error is the distance from a finer one, up to a small fraction. Rounding is a few units in the
//! last place of the terms of the work.

use crate::model::{Law, Transition};
use crate::numerics::elementary::ln;
use crate::protocol::optimal::{self, Bounds, Optimum};
use crate::protocol::shortcut::{Case, Family, Shortcut};
use crate::protocol::{Solved, SolverStats, Status};

/// Relative tolerance of the second solve: the tightest above rounding. Chosen: nine roundings of 1.1e-16.
pub const TIGHTEST_RTOL: f64 = 1e-15;

/// Greatest error of a solve to [`TIGHTEST_RTOL`] without rounding, as a fraction of its distance from a coarser one. Measured: with it 999 of 1000 errors are within their bounds (`tests/solver/error.rs`).
const ERROR_OF_TIGHTEST: f64 = 0.25;

/// Relative rounding error of a sum of some hundred positive terms, each accurate to a few units in the last place. Measured: as [`ERROR_OF_TIGHTEST`].
const ROUNDING: f64 = 20.0 * f64::EPSILON;

/// Error bound of the number `found`, if a solve to [`TIGHTEST_RTOL`] gives `finest`; `scale` is the size of its terms.
pub fn bound(found: f64, finest: f64, scale: f64) -> f64 {
    (1.0 + ERROR_OF_TIGHTEST) * (found - finest).abs() + ROUNDING * scale.abs()
}

/// Error bound of the work of a free cubic shortcut of least velocity `v_min` in time `t_f`.
///
/// Its sum without logarithms has twice the rounding. In slow sliding with large theta friction may be negative, so that the work is smaller
/// than its terms.
pub fn of_shortcut(transition: &Transition, t_f: f64, v_min: f64, work: f64, finest: f64) -> f64 {
    let Transition { law: Law { a, b }, v_i, v_f } = *transition;
    let terms = 1.0 + a * (-ln(v_min)).max(0.0) + b * ln(v_i.max(v_f));
    bound(work, finest, 2.0 * terms * work.abs().max(v_min * t_f))
}

/// Error bound of the gap `found`, if a solve to [`TIGHTEST_RTOL`] gives `finest`: a difference of two sums of about the size `replaced`.
pub fn of_excess(found: f64, finest: f64, replaced: f64) -> f64 {
    bound(found, finest, found.abs() + 0.5 * replaced.abs())
}

/// Error bound of the work of `optimum`, found by [`optimal::solve`] with these arguments; `None` if the second solve fails.
///
/// The sensitivity to `t_f` is `dW*/dt_f`, so that the rounding of times matters if the work is a small difference. Under ceilings so does the
/// rounding of theta at the ends: without them their difference is computed from `v_i - v_f`.
pub fn of_optimum(
    transition: &Transition,
    t_f: f64,
    bounds: impl Into<Bounds>,
    optimum: &Optimum,
) -> (Option<f64>, SolverStats) {
    let bounds = bounds.into();
    let Solved { status, value, stats } = optimal::solve(transition, t_f, bounds, TIGHTEST_RTOL);
    let finest = value.filter(|_| status != Status::NotConverged);
    let scale = optimum.work.abs() + 0.25 * (optimum.hamiltonian * t_f).abs();
    let ends = if bounds.has_ceilings() { 2.0 * f64::EPSILON * of_ends(transition, optimum) } else { 0.0 };
    (finest.map(|finest| ends + bound(optimum.work, finest.work, scale)), stats)
}

/// Sensitivity of the work to a relative change of theta at both ends: the sum of `|p| theta` with `H = tau v + p (1 - theta v)`. An end in
/// steady sliding counts nothing: the work changes with the time spent there.
fn of_ends(transition: &Transition, optimum: &Optimum) -> f64 {
    let &Transition { law: Law { a, b }, v_i, v_f } = transition;
    let of_end = |(steady, v): (f64, f64)| {
        let tau = 1.0 + a * ln(v) - b * ln(steady);
        ((optimum.hamiltonian - tau * v) / (steady - v)).abs()
    };
    [(v_i, optimum.v_start), (v_f, optimum.v_end)].map(of_end).into_iter().filter(|size| size.is_finite()).sum()
}

/// Error bound of the work of a `member` of a family, found for this case; `None` if the second solve fails.
///
/// A third solve with a slightly longer duration measures the effect of its rounding, which matters near `t_min`. With bounded friction, theta
/// and `v` are powers `e^((tau - 1)/a)` with a rounded exponent. The factor for very different velocities is measured.
pub fn of_member(family: &Family, case: &Case, member: &Shortcut, stats: &mut SolverStats) -> Option<f64> {
    let finest = family.solve(case, TIGHTEST_RTOL, stats).ok()?;
    let Transition { law: Law { a, b }, v_i, v_f } = case.transition;
    let (exponent, delay) = if family.uses_tau_ceiling {
        // Without a ceiling tau itself is rounded.
        let tau = if case.tau_ceiling.is_finite() { case.tau_ceiling } else { member.friction_max };
        (0.05 * (0.25 * ln(v_f / v_i)).powi(4).max(1.0) * (tau.abs() + b) / a, 1.5 * ROUNDING)
    } else {
        (0.0, 0.5 * ROUNDING)
    };
    let later = Case { t_f: case.t_f * (1.0 + delay), ..*case };
    let late = (family.solve(&later, TIGHTEST_RTOL, stats).ok()?.work - finest.work).abs();
    Some(late + bound(member.work, finest.work, (1.0 + exponent) * member.work))
}

/// Error bound of the gap `(work - least)/least` of two works with errors.
pub fn of_gap((work, error): (f64, f64), (least, error_least): (f64, f64)) -> f64 {
    (error + (work / least).abs() * error_least) / least.abs() + f64::EPSILON * (work / least).abs().max(1.0)
}
