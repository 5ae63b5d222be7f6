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

mod friction_margin;
mod motion;
mod panel;
mod path;
mod work_and_velocity;

use super::{Case, Family, Obstacle, Shortcut};
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::gauss::rule;
use crate::numerics::root::{Probe, newton};
use crate::protocol::{Motion, SolverStats};
use friction_margin::friction_margin;
use motion::BoundedFrictionMotion;
use panel::Panel;
use path::{FrictionPath, PassFailure, Residual, WorkTolerance};
use work_and_velocity::WorkAndVelocity;

/// The family `bounded_friction`.
pub struct BoundedFriction;

impl Family for BoundedFriction {
    fn name(&self) -> &'static str {
        "bounded_friction"
    }

    fn doc(&self) -> &'static str {
        "tau < tau_ceiling by construction, v continuous at both ends"
    }

    fn alpha(&self) -> Option<&'static str> {
        Some("alpha_3 in tau = tau_ceiling - (tau_ceiling - tau_i) R^x exp[alpha_3 x (1 - x)], x = t/t_f")
    }

    fn uses_tau_ceiling(&self) -> bool {
        true
    }

    fn solve(&self, case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<Shortcut, Obstacle> {
        let mut totals = None;
        let path = member(case, rtol, stats, |path, panel| match panel {
            Some(panel) => totals.get_or_insert_with(|| WorkAndVelocity::new(&case.transition)).add(path, panel),
            None => totals = None,
        })?;
        let totals = totals.unwrap_or_else(|| WorkAndVelocity::steady(&path, case.transition.v_i));
        if !totals.work.is_finite() {
            return Err(Obstacle::NotConverged);
        }
        Ok(Shortcut {
            alpha: Some(if case.tau_ceiling == f64::INFINITY { 0.0 } else { path.alpha }),
            work: totals.work,
            v_min: totals.v_min,
            v_max: totals.v_max,
            friction_max: path.friction_max().min(case.tau_ceiling),
            friction_min: path.friction_min(),
            miss: 0.0,
        })
    }

    fn motion(&self, case: &Case, rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
        let mut panels = Vec::new();
        let mut path = member(case, rtol, &mut SolverStats::default(), |_, panel| match panel {
            Some(panel) => panels.push(*panel),
            None => panels.clear(),
        })?;
        if panels.is_empty() {
            // Steady sliding: one panel.
            let tolerances = (0.1 * rtol, 0.1 * rtol);
            let work = WorkTolerance { accuracy: rtol, expected: 0.0 };
            let again = path.pass(tolerances, Some(work), &mut SolverStats::default(), |_, panel| panels.push(*panel));
            again.map_err(|_| Obstacle::NotConverged)?;
            path.alpha = 0.0;
        }
        // Panels of backward integration come after those of forward integration, in reverse order.
        let (mut panels, backward): (Vec<Panel>, Vec<Panel>) = panels.into_iter().partition(|panel| panel.forward);
        panels.extend(backward.into_iter().rev());
        Ok(Box::new(BoundedFrictionMotion { path, panels }))
    }
}

/// Margin without a bound, in `mu_0 sigma`: stands for infinity.
const UNBOUNDED_MARGIN: f64 = 1e100;

/// Spare time, fraction of [`FrictionPath::time_per_w`], below which it is the residual. Chosen.
const SPARE_TIME_FRACTION: f64 = 0.1;

/// Duration of a standstill, fraction of `t_f`, above which the residual is two-sided. Chosen.
const STANDSTILL_FRACTION: f64 = 0.1;

/// Tolerance of the passes of the first search. Chosen.
const SEARCH_TOLERANCE: f64 = 1e-4;

/// Logarithm of the ratio of the velocities above which they count as far apart, and `b/a` times it. Chosen.
const MIN_LN_RATIO: f64 = 7.0;
const MIN_LN_THETA_RATIO: f64 = 1e3;

/// Relative change of `alpha_3` that ends the search. Chosen.
const SEARCH_RTOL: f64 = 1e-3;

/// Tolerance where errors grow in every direction. Chosen.
const FINE_RTOL: f64 = 1e-8;

/// Growth of errors above which the other direction is tried. Chosen.
const MAX_ERROR_GROWTH: f64 = 1e3;

/// Relative rounding of theta at which a pass fails, if the requested tolerance is tighter: while other residuals are
/// left, and for the last. Chosen.
const LOW_NOISE: f64 = 1e-11;
const MAX_NOISE: f64 = 1e-9;

/// Passes after the first search, at most. Chosen: Newton's method needs two or three, and a dozen more where theta has
/// almost relaxed at the end.
const MAX_PASSES: u32 = 40;

/// Relative change of some velocity in the last step, at most, while other residuals are left. Chosen.
const MAX_LAST_CHANGE: f64 = 1e-3;

/// Tolerance at the nodes of the last pass, in units of `rtol`. Chosen.
const LAST_PASS_FRACTION: f64 = 0.1;

/// Tolerance at the nodes, at least: rounding.
const MIN_TOLERANCE: f64 = 1e-13;

/// Relative error of the target from rounding of `w`, at most.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Path of the member that solves the case. `visit` receives the panels of the last pass, and `None` when a pass begins;
/// no panel for steady sliding.
fn member(
    case: &Case,
    rtol: f64,
    stats: &mut SolverStats,
    mut visit: impl FnMut(&FrictionPath, Option<&Panel>),
) -> Result<FrictionPath, Obstacle> {
    let (law, v_i, v_f, t_f) = (case.transition.law, case.transition.v_i, case.transition.v_f, case.t_f);
    let sound = law.a > 0.0 && law.b >= 0.0 && t_f > 0.0 && v_i >= 1.0 && v_f >= 1.0;
    if !sound || ![law.a, law.b, t_f, v_i, v_f].iter().all(|x| x.is_finite()) || case.tau_ceiling.is_nan() {
        return Err(Obstacle::Domain);
    }
    let unbounded = case.tau_ceiling == f64::INFINITY;
    let distance = |v: f64| if unbounded { UNBOUNDED_MARGIN } else { friction_margin(law, case.tau_ceiling, v) };
    let (margin_i, margin_f) = (distance(v_i), distance(v_f));
    if margin_i <= 0.0 || margin_f <= 0.0 {
        return Err(Obstacle::FrictionAtEnds { friction: case.tau_ceiling - margin_i.min(margin_f) });
    }
    let change = (v_i - v_f) / v_f;
    let log_ratio = if change.abs() < 0.5 { ln_1p(change) } else { ln(v_i / v_f) };
    let fraction = (law.a - law.b) * log_ratio / margin_i;
    let ln_r = if fraction.abs() < 0.5 { ln_1p(fraction) } else { ln(margin_f / margin_i) };
    if v_i == v_f {
        return Ok(FrictionPath::new(case, (margin_i, margin_f), ln_r, log_ratio, Residual::LnTheta));
    }
    // Spare time, beyond the time of v = 0 or of tau = tau_M.
    let accelerates = v_f > v_i;
    let spare = t_f
        - if accelerates {
            acceleration_time_at_ceiling(law.a, v_i, -log_ratio, (margin_i, margin_f), stats)
        } else {
            (v_i - v_f) / v_i * (1.0 / v_f)
        };
    if spare <= 0.0 {
        return Err(if accelerates { Obstacle::Friction } else { Obstacle::Velocity });
    }
    let residual = if accelerates { Residual::TimeLoss { spare } } else { Residual::Slip { spare } };
    let path = FrictionPath::new(case, (margin_i, margin_f), ln_r, log_ratio, residual);
    let is_close = spare < SPARE_TIME_FRACTION * path.time_per_w(0.0).min(t_f);
    // From a standstill theta grows, and errors decay forwards.
    let measured = if accelerates { path } else { path.towards(true) };
    let by_theta = path.with_residual(Residual::LnTheta);
    let two_sided = path.towards(true).with_residual(Residual::TwoSidedSlip { spare });
    let all = [measured, measured.reversed(), by_theta, by_theta.reversed(), two_sided];
    // The loss of digits in a standstill grows with the ratio of the velocities, and b/a times where theta runs away.
    let far = log_ratio > MIN_LN_RATIO || log_ratio * law.b > MIN_LN_THETA_RATIO * law.a;
    let standstill = !accelerates && far && t_f - spare > STANDSTILL_FRACTION * t_f;
    let order: &[usize] = match (standstill, is_close) {
        (true, true) => &[4, 0, 1, 2, 3],
        (true, false) => &[4, 2, 3, 0, 1],
        (false, true) => &[0, 1, 2, 3, 4],
        (false, false) => &[2, 3, 4, 0, 1],
    };
    let order = order.iter().filter(|&&index| !(accelerates && index == 4));
    let mut start = None;
    // Rounding of the time, at the greater velocity.
    let time_rounding = 100.0 * f64::EPSILON * t_f * v_i.max(v_f);
    let (low_noise, max_noise) = (LOW_NOISE.max(rtol), MAX_NOISE.max(rtol).max(time_rounding));
    // Where errors grow for every residual, a fine pass may arrive where a rough pass fails.
    let fine = rtol.min(FINE_RTOL);
    for (strict, max_noise, rtol) in
        [(true, low_noise, rtol), (true, max_noise, rtol), (false, max_noise, rtol), (false, max_noise, fine)]
    {
        for path in order.clone().map(|&index| all[index]) {
            let Some((alpha, errors)) = rough_alpha(&path, start, strict, stats) else { continue };
            start = start.or((path.residual == Residual::LnTheta || errors < MAX_ERROR_GROWTH).then_some(alpha));
            if strict && errors > MAX_ERROR_GROWTH {
                continue;
            }
            if let Some(found) = refine(path.with(alpha), (rtol, max_noise), strict, stats, &mut visit) {
                return Ok(found);
            }
        }
    }
    Err(Obstacle::NotConverged)
}

/// `alpha_3` to [`SEARCH_TOLERANCE`], and the growth of errors.
fn rough_alpha(path: &FrictionPath, start: Option<f64>, strict: bool, stats: &mut SolverStats) -> Option<(f64, f64)> {
    match path.residual {
        Residual::LnTheta => search(path, start.unwrap_or(0.0), strict, stats),
        Residual::Slip { spare } | Residual::TwoSidedSlip { spare } => {
            search_far_out_again(path, 2.0 * path.t_f / spare, strict, stats)
        }
        Residual::TimeLoss { spare } => search_far_out_again(path, -2.0 * path.t_f / spare, strict, stats),
    }
}

/// [`search_far_out`], repeated at a tighter tolerance where errors grow for the last residual.
fn search_far_out_again(path: &FrictionPath, start: f64, strict: bool, stats: &mut SolverStats) -> Option<(f64, f64)> {
    let (alpha, errors) = search_far_out(path, start, (SEARCH_TOLERANCE, SEARCH_RTOL), stats)?;
    if strict || errors < MAX_ERROR_GROWTH {
        return Some((alpha, errors));
    }
    let fine = ((SEARCH_TOLERANCE / errors).max(MIN_TOLERANCE), SEARCH_RTOL * SEARCH_RTOL);
    search_far_out(path, alpha / path.alpha_scale(), fine, stats).or(Some((alpha, errors)))
}

/// Refines a path to the one that arrives; `None` where this fails.
fn refine(
    mut path: FrictionPath,
    (rtol, max_noise): (f64, f64),
    strict: bool,
    stats: &mut SolverStats,
    visit: &mut impl FnMut(&FrictionPath, Option<&Panel>),
) -> Option<FrictionPath> {
    visit(&path, None);
    let (mut last_pass, mut before, mut tolerance, mut expected) = (false, f64::INFINITY, 0.1 * rtol, 0.0);
    for _ in 0..MAX_PASSES {
        let pass = |path: &FrictionPath, panel: &Panel| {
            if last_pass {
                visit(path, Some(panel));
            }
        };
        // The last pass gives the work too, and the extremes, which lie between the nodes.
        let nodes = (LAST_PASS_FRACTION * rtol).max(MIN_TOLERANCE);
        let fine = nodes * nodes.sqrt();
        let (within_pass, work) = if last_pass {
            ((tolerance.min(fine), fine), Some(WorkTolerance { accuracy: nodes, expected: 0.5 * expected }))
        } else {
            ((tolerance, 0.1 * rtol), None)
        };
        let end = path.pass(within_pass, work, stats, pass).ok()?;
        expected = end.work;
        let (_, step) = path.residual_and_step(&end);
        let scale = path.alpha_resolution(&end);
        let within = |fraction: f64| step.abs() <= fraction * scale;
        // Newton's method has converged to rounding; that of the bound and of alpha counts only for the last residual.
        let neighbours = step.abs() <= f64::EPSILON * path.alpha.abs();
        let rounding = path.rounding(&end).max(if strict { 0.0 } else { path.ln_r_rounding });
        let spent = step.abs() <= ROUNDING * rounding && step.abs() >= 0.5 * before
            || path.alpha + step == path.alpha
            || neighbours && !strict;
        if end.noise * f64::EPSILON > max_noise {
            return None;
        }
        // Slips that add up to the spare time are known to its rounding. Theta at the end may determine alpha better. The
        // rounding of t_f itself limits every residual.
        let is_lost_in_rounding = ROUNDING * path.lost_in_sum(&end) > 0.5 * rtol.max(LOW_NOISE) * scale;
        if strict && last_pass && is_lost_in_rounding {
            return None;
        }
        if last_pass && (within(0.5 * rtol) || spent) {
            // Where this residual depends on alpha by rounding only, it fails.
            return within(if strict { MAX_LAST_CHANGE } else { 1.0 }).then_some(path);
        }
        // Steps alternate between neighbouring doubles: another residual may be better conditioned.
        if !step.is_finite() || last_pass && neighbours {
            return None;
        }
        // Tolerance of a panel for which the error at the end is that of the next step.
        let tolerance_for_end = 5.0 * rtol * scale * path.precision(&end) / path.size;
        let next_tolerance = if path.residual == Residual::LnTheta {
            tolerance_for_end
        } else {
            0.1 * rtol * (scale / path.alpha.abs()).min(1.0)
        };
        tolerance = next_tolerance.clamp(f64::MIN_POSITIVE, 0.1 * rtol);
        // Newton's method doubles the digits.
        last_pass = within(rtol.sqrt()) || spent;
        before = step.abs();
        path = path.with(path.alpha + step);
        visit(&path, None);
    }
    None
}

/// Time of an acceleration with `tau = tau_M` throughout, `int e^y/(e^z - 1) dy` over `y = ln theta`, in `l/v_0`.
///
/// `z = ln(theta v)` is linear in `y`, from `margin_i/a` to `margin_f/a`. Panels double with `z`, which keeps the pole at
/// `z = 0` at a distance.
fn acceleration_time_at_ceiling(
    a: f64,
    v_i: f64,
    span: f64,
    (margin_i, margin_f): (f64, f64),
    stats: &mut SolverStats,
) -> f64 {
    let rule = rule(24);
    let (z_i, z_f) = (margin_i / a, margin_f / a);
    let growth = (z_f / z_i).abs().max(z_i / z_f);
    let panels = (1.5 * ln(growth) + span).ceil().clamp(1.0, 400.0);
    stats.quadratures += 1;
    let mut time = 0.0;
    for panel in 0..panels as u32 {
        // Fraction of the range of y, and z: geometric in z, or uniform in y where z hardly changes.
        let fraction_and_z = |s: f64| {
            if growth > 2.0 {
                let power = s * ln(z_f / z_i);
                (z_i * (exp_m1(power) / (z_f - z_i)), z_i * exp(power))
            } else {
                (s, z_i + s * (z_f - z_i))
            }
        };
        let (low, high) = (fraction_and_z(f64::from(panel) / panels), fraction_and_z(f64::from(panel + 1) / panels));
        stats.nodes += rule.x.len() as u32;
        for (x, w) in rule.x.iter().zip(&rule.w) {
            let between = |low: f64, high: f64| low + 0.5 * (high - low) * (1.0 + x);
            let (fraction, z) = (between(low.0, high.0), between(low.1, high.1));
            time += 0.5 * (high.0 - low.0) * w * span * exp(-fraction * span) / v_i / exp_m1(z);
        }
    }
    time
}

/// `alpha_3` to [`SEARCH_TOLERANCE`] from an initial guess, and the growth of errors.
fn search(path: &FrictionPath, start: f64, strict: bool, stats: &mut SolverStats) -> Option<(f64, f64)> {
    let alpha_scale = path.alpha_scale();
    let (mut gave_up, mut errors) = (false, f64::INFINITY);
    let probe = |x: f64| {
        let path = path.with(alpha_scale * x);
        let end = match path.pass((SEARCH_TOLERANCE, SEARCH_TOLERANCE), None, stats, |_, _| ()) {
            Ok(end) => end,
            Err(PassFailure::AlphaTooSmall) => return Some(Probe { value: -f64::MAX, slope: 0.0 }),
            Err(PassFailure::AlphaTooLarge) => return Some(Probe { value: f64::MAX, slope: 0.0 }),
            Err(PassFailure::NotConverged) => {
                gave_up = true;
                return Some(Probe { value: 0.0, slope: 0.0 });
            }
        };
        errors = end.errors;
        let (miss, step) = path.residual_and_step(&end);
        // In units of alpha_scale; a step at most doubles alpha.
        let scale = 1.0 + x.abs();
        let bounded = (step / alpha_scale).clamp(-MAX_SEARCH_STEP * scale, MAX_SEARCH_STEP * scale);
        let wrong = bounded.is_nan() || (bounded < 0.0) != (miss > 0.0);
        if wrong {
            return Some(Probe { value: miss, slope: 0.0 });
        }
        // A step that is small compared with alpha may still pass the point where theta falls to 0.
        let weight = (1.0 / scale).max(RESIDUAL_WEIGHT * miss.abs() / path.size / bounded.abs());
        // Theta may arrive almost independently of alpha: the growth of errors vanishes beyond.
        let weight =
            if strict && errors > MAX_ERROR_GROWTH { weight.max(2.0 * SEARCH_RTOL / bounded.abs()) } else { weight };
        Some(Probe { value: -bounded * weight, slope: weight })
    };
    let root = newton(probe, start / alpha_scale, (f64::NEG_INFINITY, f64::INFINITY), false, SEARCH_RTOL);
    root.filter(|_| !gave_up).map(|root| (alpha_scale * root.x, errors))
}

/// Weight of a relative error of 1 of theta at the end, in the step that ends the search. Chosen.
const RESIDUAL_WEIGHT: f64 = 0.1;

/// Step of the search, in units of [`FrictionPath::alpha_scale`], at most. Chosen.
const MAX_SEARCH_STEP: f64 = 4.0;

/// `alpha_3` to a tolerance where the time is just long enough and layers at the ends have the width `1/alpha_3`; from an
/// initial guess in units of [`FrictionPath::alpha_scale`].
fn search_far_out(
    path: &FrictionPath,
    start: f64,
    (tolerance, enough): (f64, f64),
    stats: &mut SolverStats,
) -> Option<(f64, f64)> {
    let alpha_scale = path.alpha_scale();
    let (mut gave_up, mut errors) = (false, f64::INFINITY);
    let alpha_at = |q: f64| 0.5 * alpha_scale * (exp_m1(q) - exp_m1(-q));
    let probe = |q: f64| {
        let path = path.with(alpha_at(q));
        match path.pass((tolerance, tolerance), None, stats, |_, _| ()) {
            Ok(end) => {
                errors = end.errors;
                let (value, step) = path.residual_and_step(&end);
                let alpha_by_q = 0.5 * alpha_scale * (exp(q) + exp(-q));
                Some(Probe { value, slope: (-value / step * alpha_by_q).max(0.0) })
            }
            Err(PassFailure::AlphaTooSmall) => Some(Probe { value: -f64::MAX, slope: 0.0 }),
            Err(PassFailure::AlphaTooLarge) => Some(Probe { value: f64::MAX, slope: 0.0 }),
            Err(PassFailure::NotConverged) => {
                gave_up = true;
                Some(Probe { value: 0.0, slope: 0.0 })
            }
        }
    };
    let start = start.signum() * ln_1p(2.0 * start.abs());
    let root = newton(probe, start, (-MAX_LN_ALPHA, MAX_LN_ALPHA), false, enough);
    root.filter(|_| !gave_up).map(|root| (alpha_at(root.x), errors))
}

/// `ln` of `alpha_3` in units of [`FrictionPath::alpha_scale`], at most. Chosen.
const MAX_LN_ALPHA: f64 = 100.0;
