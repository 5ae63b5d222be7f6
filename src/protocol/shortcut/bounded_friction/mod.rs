//! `bounded_friction`: `tau < tau_M` by construction.
//!
//! `tau = tau_M - (tau_M - tau_i) R^x e^(alpha_3 x (1 - x))` with `x = t/t_f` and `R = (tau_M - tau_f)/(tau_M - tau_i)`
//! falls strictly with `alpha_3` at every inner `x`. By comparison for `theta' = 1 - theta^(1 - b/a) e^((tau - 1)/a)`,
//! `theta(t_f)` from `theta(0) = 1/v_i` rises strictly with `alpha_3`. Its limits are its values for `tau = tau_M`
//! throughout and for `v = 0`, the latter `1/v_i + t_f`. There is one member if `1/v_f` lies strictly between them, none
//! otherwise. Backwards from `t_f`, `theta(0)` falls with `alpha_3`, under equal conditions.
//!
//! As `tau_M` grows, `alpha_3` tends to 0 and friction to a parabola in time, `tau_i + (tau_f - tau_i) x + A x (1 -
//! x)`. This is the member for an infinite `tau_M`, that is, without bound.
//!
//! `d(theta')/d(theta) = (b/a - 1) v`: theta is integrated forwards for `b <= a` and backwards for `b > a`, as both
//! contract. Where the time is just long enough, theta at the end hardly depends on `alpha_3`. Then the equation is for
//! the spare time. Beyond the time of `v = 0` it equals the slip `int theta v dt`. Beyond the time of `tau = tau_M` it
//! equals, with `z_M = ln(theta v)` for friction `tau_M`,
//!
//! ```text
//! int [1 - e^(-(tau_M - tau)/a)]/[1 - e^(-z_M)] dt.
//! ```
//!
//! Both are sums of positive terms and fall like `1/|alpha_3|`.
//!
//! In a standstill, theta does not depend on either end. There both ends are integrated to a point in the standstill,
//! and the slip of both is compared with the spare time.

mod motion;
mod panel;
mod path;
mod work_and_velocity;

use super::{Case, Family, Obstacle, Shortcut};
use crate::model::{Transition, friction_margin};
use crate::numerics::elementary::{exp, exp_m1, ln_1p, ln_near_1};
use crate::numerics::root::{Probe, newton};
use crate::numerics::{MAX_SQUARABLE, MAX_STEPS, NEGLIGIBLE_LN, ROUNDING_RTOL, TIGHT_RTOL};
use crate::protocol::optimal::acceleration_time_at_ceiling;
use crate::protocol::{Motion, SolverStats};
use motion::BoundedFrictionMotion;
use panel::FrictionPanel;
use path::{FrictionPath, PassFailure, PassResult, Residual, WorkTolerance};
use work_and_velocity::WorkAndVelocity;

/// The family `bounded_friction`.
pub(super) const FAMILY: Family = Family {
    name: "bounded_friction",
    doc: "tau < tau_ceiling by construction, v continuous at both ends",
    alpha: Some("alpha_3 in tau = tau_ceiling - (tau_ceiling - tau_i) R^x exp[alpha_3 x (1 - x)], x = t/t_f"),
    uses_tau_ceiling: true,
    arrives: true,
    solve,
    motion,
};

fn solve(case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<Shortcut, Obstacle> {
    let (path, panels) = member(case, rtol, stats)?;
    let WorkAndVelocity { work, v, .. } = match case.transition {
        Transition { v_i, v_f, .. } if v_i == v_f => WorkAndVelocity::steady(&path, v_i),
        transition => WorkAndVelocity::of(&transition, &path, &panels),
    };
    if !work.is_finite() {
        return Err(Obstacle::NotConverged);
    }
    Ok(Shortcut {
        alpha: Some(if case.tau_ceiling == f64::INFINITY { 0.0 } else { path.alpha }),
        work,
        v_min: v.low,
        v_max: v.high,
        friction_max: path.friction_max().min(case.tau_ceiling),
        friction_min: path.friction_min(),
        miss: 0.0,
    })
}

fn motion(case: &Case, rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
    let (path, panels) = member(case, rtol, &mut SolverStats::default())?;
    // Panels of backward integration come after those of forward integration, in reverse order.
    let (mut panels, backward): (Vec<FrictionPanel>, Vec<FrictionPanel>) =
        panels.into_iter().partition(|panel| panel.forward);
    panels.extend(backward.into_iter().rev());
    Ok(Box::new(BoundedFrictionMotion { path, panels }))
}

/// Spare time, fraction of [`FrictionPath::time_per_w`], below which it is the residual. Chosen; the budgets of `shortcut` judge it.
const SPARE_TIME_FRACTION: f64 = 0.1;

/// Duration of a standstill, fraction of `t_f`, above which the residual is two-sided. Chosen; the budgets of `shortcut` judge it.
const STANDSTILL_FRACTION: f64 = 0.1;

/// Logarithm of the ratio of the velocities above which they count as far apart, and `b/a` times it. Chosen; the budgets of `shortcut` judge it.
const MIN_LN_RATIO: f64 = 7.0;
const MIN_LN_THETA_RATIO: f64 = 1e3;

/// Growth of errors above which another residual is tried. Chosen; the budgets of `shortcut` judge it.
const MAX_ERROR_GROWTH: f64 = 1e3;

/// Relative rounding of theta at which a pass fails, if the requested tolerance is tighter: while other residuals are
/// left, and for the last. Chosen: a tenth of the default `rtol`, and ten times it.
const LOW_NOISE: f64 = 1e-11;
const MAX_NOISE: f64 = 1e-9;

/// The path of the member that solves the case, and its panels.
fn member(case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<(FrictionPath, Vec<FrictionPanel>), Obstacle> {
    let Transition { law, v_i, v_f } = case.transition;
    let (t_f, rtol) = (case.t_f, rtol.min(SEARCH_TOLERANCE));
    if case.tau_ceiling.is_nan() {
        return Err(Obstacle::Domain);
    }
    let unbounded = case.tau_ceiling == f64::INFINITY;
    let distance = |v: f64| if unbounded { MAX_SQUARABLE } else { friction_margin(law, case.tau_ceiling, v) };
    let (margin_i, margin_f) = (distance(v_i), distance(v_f));
    if margin_i <= 0.0 || margin_f <= 0.0 {
        return Err(Obstacle::FrictionAtEnds { friction: case.tau_ceiling - margin_i.min(margin_f) });
    }
    let change = (v_i - v_f) / v_f;
    let log_ratio = ln_near_1(change, v_i / v_f);
    let fraction = (law.a - law.b) * log_ratio / margin_i;
    let ln_r = ln_near_1(fraction, margin_f / margin_i);
    let by_theta = FrictionPath::new(case, (margin_i, margin_f), ln_r, log_ratio);
    if v_i == v_f {
        let (_, panels) = last_pass(&by_theta, (rtol, 0.1 * rtol, 0.0), stats).map_err(|_| Obstacle::NotConverged)?;
        return Ok((by_theta, panels));
    }
    // Spare time, beyond the time of v = 0 or of tau = tau_M.
    let accelerates = v_f > v_i;
    let spare = t_f
        - if accelerates {
            acceleration_time_at_ceiling(&case.transition, case.tau_ceiling).ok_or(Obstacle::Friction)?
        } else {
            (v_i - v_f) / v_i * (1.0 / v_f)
        };
    if spare <= 0.0 {
        return Err(if accelerates { Obstacle::Friction } else { Obstacle::Velocity });
    }
    let order = paths(by_theta, case, spare, log_ratio);
    // Rounding of the time, at the greater velocity.
    let time_rounding = 100.0 * f64::EPSILON * t_f * v_i.max(v_f);
    let low_noise = LOW_NOISE.max(rtol);
    let rounds = [(low_noise, MAX_ERROR_GROWTH), (MAX_NOISE.max(rtol).max(time_rounding), f64::INFINITY)];
    let mut best: Option<Refined> = None;
    for (max_noise, max_growth) in rounds {
        for path in &order {
            let found =
                search(path, max_growth, stats).and_then(|alpha| refine(path.with(alpha), (rtol, max_noise), stats));
            best = match (best, found) {
                (Some(best), Some(found)) if found.error >= best.error => Some(best),
                (best, found) => found.or(best),
            };
            // Where rounding leaves more, another residual may be better conditioned.
            if let Some(Refined { path, panels, .. }) = best.take_if(|best| best.error <= 0.5 * low_noise) {
                return Ok((path, panels));
            }
        }
    }
    best.map(|Refined { path, panels, .. }| (path, panels)).ok_or(Obstacle::NotConverged)
}

/// The paths of `case` for each residual and direction, in the order in which they are tried. `spare` is the time beyond that of `v = 0` or of
/// `tau = tau_M`, `log_ratio` that of the velocities.
fn paths(by_theta: FrictionPath, case: &Case, spare: f64, log_ratio: f64) -> Vec<FrictionPath> {
    let Transition { law, v_i, v_f } = case.transition;
    let (t_f, accelerates) = (case.t_f, v_f > v_i);
    let residual = if accelerates { Residual::TimeLoss } else { Residual::Slip };
    let by_time = by_theta.with_residual(residual, spare);
    let is_close = spare < SPARE_TIME_FRACTION * by_time.time_per_w(0.0).min(t_f);
    // From a standstill theta grows, and errors decay forwards.
    let by_time = if accelerates { by_time } else { by_time.towards(true) };
    let both_ways = by_theta.towards(true).with_residual(Residual::TwoSidedSlip, spare);
    // The loss of digits in a standstill grows with the ratio of the velocities, and b/a times where theta runs away.
    let far = log_ratio > MIN_LN_RATIO || log_ratio * law.b > MIN_LN_THETA_RATIO * law.a;
    let stands_still = !accelerates && far && t_f - spare > STANDSTILL_FRACTION * t_f;
    let (times, thetas) = ([by_time, by_time.reversed()], [by_theta, by_theta.reversed()]);
    let both_ways = if accelerates { &[][..] } else { &[both_ways] };
    let mut order =
        if is_close { [&times, &thetas[..], both_ways].concat() } else { [&thetas, both_ways, &times].concat() };
    if stands_still {
        order.sort_by_key(|path| path.residual != Residual::TwoSidedSlip);
    }
    order
}

/// Tolerance at the nodes of the last pass, in units of `rtol`. Chosen: the rest is left for the other errors of the row.
const LAST_PASS_FRACTION: f64 = 0.1;

/// The pass that gives the work too, and the extremes, which lie between the nodes; `expected` is about the work.
fn last_pass(
    path: &FrictionPath,
    (rtol, tolerance, expected): (f64, f64, f64),
    stats: &mut SolverStats,
) -> Result<(PassResult, Vec<FrictionPanel>), PassFailure> {
    let accuracy = (LAST_PASS_FRACTION * rtol).max(TIGHT_RTOL);
    // A velocity carries the error of `ln theta` b/a times.
    let nodes = accuracy / (1.0 + path.ratio);
    let inside = nodes * nodes.sqrt() * (1.0 + path.ratio);
    path.pass(tolerance.min(inside), Some(WorkTolerance { accuracy, expected }), stats)
}

/// A path that arrives.
struct Refined {
    path: FrictionPath,
    panels: Vec<FrictionPanel>,
    /// What rounding and integration leave of the error of `alpha_3`, as the relative change of some velocity.
    error: f64,
}

/// Refines a path to the one that arrives; `None` where this fails.
fn refine(mut path: FrictionPath, (rtol, max_noise): (f64, f64), stats: &mut SolverStats) -> Option<Refined> {
    let (mut is_last, mut before, mut tolerance, mut expected) = (false, f64::INFINITY, 0.1 * rtol, 0.0);
    for _ in 0..MAX_STEPS {
        let (end, panels) = if is_last {
            last_pass(&path, (rtol, tolerance, 0.5 * expected), stats)
        } else {
            path.pass(tolerance, None, stats)
        }
        .ok()?;
        expected = end.work;
        let (_, step) = path.residual_and_step(&end);
        let scale = path.alpha_resolution(&end);
        let within = |fraction: f64| step.abs() <= fraction * scale;
        // Newton's method has converged to rounding. Where neighbouring doubles differ by more, another residual may be
        // better conditioned.
        let are_neighbours = step.abs() <= f64::EPSILON * path.alpha.abs();
        let rounding = path.rounding(&end);
        let spent = step.abs() <= 2.0 * ROUNDING_RTOL * rounding * path.spare_rounding(&end)
            && step.abs() >= 0.5 * before
            || are_neighbours && within(0.5 * LOW_NOISE)
            || path.alpha + step == path.alpha;
        if end.noise * f64::EPSILON > max_noise {
            return None;
        }
        if is_last && (within(0.5 * rtol) || spent) {
            // A sum that hardly depends on alpha determines it no better than its own error does.
            let relative_error = if path.residual == Residual::LnTheta { 0.0 } else { tolerance };
            let error = step.abs().max(f64::EPSILON.max(relative_error) * rounding) / scale;
            return (error <= max_noise).then_some(Refined { path, panels, error });
        }
        if !step.is_finite() || is_last && are_neighbours {
            return None;
        }
        // Tolerance of a panel for which the error at the end is that of the next step.
        let next_tolerance = if path.residual == Residual::LnTheta {
            5.0 * rtol * scale * end.w_by_alpha.abs() / (end.errors * path.size)
        } else {
            0.1 * rtol * (scale / path.alpha.abs()).min(1.0)
        };
        tolerance = next_tolerance.clamp(f64::MIN_POSITIVE, 0.1 * rtol);
        // Newton's method doubles the digits.
        is_last = within(rtol.sqrt()) || spent;
        before = step.abs();
        path = path.with(path.alpha + step);
    }
    None
}

/// Tolerance of the passes of the search, and loosest accuracy of a solution. Measured: a looser one saves no time, and a few searches fail.
const SEARCH_TOLERANCE: f64 = 1e-4;

/// Relative change of `alpha_3` that ends the search, and of some velocity in the last step, at most. Chosen: from three digits Newton's method takes
/// two or three passes.
const NEWTON_CHANGE: f64 = 1e-3;

/// Weight of a relative error of 1 of theta at the end, in the step that ends the search. Chosen; the budgets of `shortcut` judge it.
const RESIDUAL_WEIGHT: f64 = 0.1;

/// Step of the search, in units of [`FrictionPath::alpha_scale`] and of `1 + alpha_3`, at most. Chosen; the budgets of `shortcut` judge it.
const MAX_SEARCH_STEP: f64 = 4.0;

/// `alpha_3` to [`SEARCH_TOLERANCE`], by Newton's method; `None` where it fails, or where errors grow too much.
///
/// Where the time is just long enough, layers at the ends have the width `1/alpha_3`: the search is in `asinh` of `alpha_3`.
fn search(path: &FrictionPath, max_growth: f64, stats: &mut SolverStats) -> Option<f64> {
    let alpha_scale = path.alpha_scale();
    let is_near = path.residual == Residual::LnTheta;
    let (mut gave_up, mut errors) = (false, f64::INFINITY);
    let alpha_at = |q: f64| alpha_scale * if is_near { q } else { 0.5 * (exp_m1(q) - exp_m1(-q)) };
    let probe = |q: f64| {
        let path = path.with(alpha_at(q));
        let end = match path.pass(SEARCH_TOLERANCE, None, stats) {
            Ok((end, _)) => end,
            Err(PassFailure::AlphaTooSmall) => return Some(Probe { value: -f64::MAX, slope: 0.0 }),
            Err(PassFailure::AlphaTooLarge) => return Some(Probe { value: f64::MAX, slope: 0.0 }),
            Err(PassFailure::NotConverged) => {
                gave_up = true;
                return Some(Probe { value: 0.0, slope: 0.0 });
            }
        };
        errors = end.errors;
        let (value, step) = path.residual_and_step(&end);
        if !is_near {
            let alpha_by_q = 0.5 * alpha_scale * (exp(q) + exp(-q));
            return Some(Probe { value, slope: (-value / step * alpha_by_q).max(0.0) });
        }
        // A step at most doubles alpha.
        let scale = 1.0 + q.abs();
        let step = (step / alpha_scale).clamp(-MAX_SEARCH_STEP * scale, MAX_SEARCH_STEP * scale);
        if step.is_nan() || (step < 0.0) != (value > 0.0) {
            return Some(Probe { value, slope: 0.0 });
        }
        // A step that is small compared with alpha may still pass the point where theta falls to 0. Theta may arrive almost
        // independently of alpha: the growth of errors vanishes beyond.
        let most = if errors > max_growth { 2.0 * NEWTON_CHANGE } else { RESIDUAL_WEIGHT * value.abs() / path.size };
        let weight = (1.0 / scale).max(most / step.abs());
        Some(Probe { value: -step * weight, slope: weight })
    };
    let far = ln_1p(4.0 * path.t_f / path.spare);
    let (start, most) = match path.residual {
        Residual::LnTheta => (0.0, f64::INFINITY),
        Residual::Slip | Residual::TwoSidedSlip => (far, NEGLIGIBLE_LN),
        Residual::TimeLoss => (-far, NEGLIGIBLE_LN),
    };
    let root = newton(probe, start, (-most, most), false, NEWTON_CHANGE)?;
    (!gave_up && errors <= max_growth).then(|| alpha_at(root.x))
}
