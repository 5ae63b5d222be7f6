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
//! contract. The other direction is tried where that has much rounding: theta loses digits where it falls over decades.
//!
//! The residual is theta at the end. Where the time is just long enough, that hardly depends on `alpha_3`. Then the
//! residual is the spare time. Beyond the time of `v = 0` it equals the slip `int theta v dt`. Beyond the time of
//! `tau = tau_M` it equals, with `z_M = ln(theta v)` for friction `tau_M`,
//!
//! ```text
//! int [1 - e^(-(tau_M - tau)/a)]/[1 - e^(-z_M)] dt.
//! ```
//!
//! Both are sums of positive terms and fall like `1/|alpha_3|`. Where `z_M` is below its values at both ends, it counts
//! as the lesser of them. This keeps the integral positive and a function of theta at the end.

mod friction_margin;
mod motion;
mod panel;
mod path;
mod work_and_velocity;

use std::cmp::Ordering;

use super::{Case, Family, Obstacle, Shortcut};
use crate::model::Transition;
use crate::numerics::adaptive::integrals;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::root::{Probe, newton};
use crate::protocol::{Motion, SolverStats};
use friction_margin::friction_margin;
use motion::BoundedFrictionMotion;
use path::{FrictionPath, Pass};
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
        let Member { path, pass, .. } = member(case, rtol, stats)?;
        let WorkAndVelocity { work, v_min, v_max } = WorkAndVelocity::of(&case.transition, &path, &pass.panels);
        if !work.is_finite() {
            return Err(Obstacle::NotConverged);
        }
        let (friction_min, friction_max) = path.friction_range();
        Ok(Shortcut {
            alpha: Some(if case.tau_ceiling == f64::INFINITY { 0.0 } else { path.alpha }),
            work,
            v_min,
            v_max,
            friction_max: friction_max.min(case.tau_ceiling),
            friction_min,
            miss: 0.0,
        })
    }

    fn motion(&self, case: &Case, rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
        let Member { path, pass: Pass { mut panels, .. }, .. } = member(case, rtol, &mut SolverStats::default())?;
        if !path.forward {
            panels.reverse();
        }
        Ok(Box::new(BoundedFrictionMotion { path, panels }))
    }
}

/// Margin without a bound, in `mu_0 sigma`: stands for infinity. Chosen: far above every friction, and its square is a double.
const UNBOUNDED_MARGIN: f64 = 1e100;

/// Whether the family is defined for a case.
fn is_in_domain(case: &Case) -> bool {
    let Transition { law, v_i, v_f } = case.transition;
    let is_inside = law.a > 0.0 && law.b >= 0.0 && case.t_f > 0.0 && v_i >= 1.0 && v_f >= 1.0;
    is_inside && [law.a, law.b, case.t_f, v_i, v_f].iter().all(|x| x.is_finite()) && !case.tau_ceiling.is_nan()
}

/// Relative change of some velocity in one more step, if the requested tolerance is tighter: above which the other direction is
/// tried, and at most. Chosen: a hundredth of the default `rtol`, and ten times it.
const LOW_NOISE: f64 = 1e-12;
const MAX_NOISE: f64 = 1e-9;

/// Member that solves a case.
struct Member {
    path: FrictionPath,
    pass: Pass,
    /// Relative change of some velocity in one more step.
    noise: f64,
}

/// The member that solves the case, from the direction in which theta contracts or, where that has much rounding, the other.
fn member(case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<Member, Obstacle> {
    let Transition { law, v_i, v_f } = case.transition;
    if !is_in_domain(case) {
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
    // Time beyond that of v = 0 or of tau = tau_M.
    let spare = case.t_f
        - if v_f > v_i {
            acceleration_time_at_ceiling(law.a, v_i, -log_ratio, (margin_i, margin_f), stats)
                .ok_or(Obstacle::NotConverged)?
        } else {
            (v_i - v_f) / v_i * (1.0 / v_f)
        };
    if spare <= 0.0 {
        return Err(if v_f > v_i { Obstacle::Friction } else { Obstacle::Velocity });
    }
    let path = FrictionPath::new(case, (margin_i, margin_f), ln_r, log_ratio, spare);
    if v_i == v_f {
        let pass = path.pass(ROUGH_ACCURACY, stats).map_err(|_| Obstacle::NotConverged)?;
        return Ok(Member { path, pass, noise: 0.0 });
    }
    let mut best = None;
    for path in [path, path.reversed()] {
        let found = search(&path, stats).and_then(|alpha| refine(path.with(alpha), rtol, stats));
        let rounding = |member: &Member| member.noise.max(f64::EPSILON * member.pass.max_errors);
        best = best.into_iter().chain(found).min_by(|x, y| rounding(x).total_cmp(&rounding(y)));
        if best.as_ref().is_some_and(|best| rounding(best) <= LOW_NOISE) {
            break;
        }
    }
    best.filter(|best| best.noise <= MAX_NOISE.max(rtol)).ok_or(Obstacle::NotConverged)
}

/// Time of an acceleration with `tau = tau_M` throughout, `int e^y/(e^z - 1) dy` over `y = ln theta`, in `l/v_0`.
///
/// `z = ln(theta v)` is linear in `y`, from `margin_i/a` to `margin_f/a`. The integral starts at the end that is closer to the pole at
/// `z = 0`.
fn acceleration_time_at_ceiling(
    a: f64,
    v_i: f64,
    span: f64,
    (margin_i, margin_f): (f64, f64),
    stats: &mut SolverStats,
) -> Option<f64> {
    let (z_i, z_f) = (margin_i / a, margin_f / a);
    let rate = |s: f64| {
        let (fallen, z) = if z_i < z_f { (s, z_i + s * (z_f - z_i)) } else { (1.0 - s, z_f + s * (z_i - z_f)) };
        Some([span * exp(-fallen * span) / v_i / exp_m1(z)])
    };
    let ([time], nodes) = integrals(rate, vec![(0.0, 1.0)], 1)?;
    stats.quadratures += 1;
    stats.nodes += nodes;
    Some(time)
}

/// Accuracy of velocities in the passes of the search. Chosen: the error at the end is of its power 3/2, less than [`SEARCH_RTOL`].
const ROUGH_ACCURACY: f64 = 1e-3;

/// Relative change of `alpha_3` that ends the search. Chosen: from three digits Newton's method takes two passes.
const SEARCH_RTOL: f64 = 1e-3;

/// Step of `asinh` of `alpha_3` in the search, at most. Chosen: a factor of 50 in `alpha_3`.
const MAX_SEARCH_STEP: f64 = 4.0;

/// `alpha_3` to [`SEARCH_RTOL`], by Newton's method.
///
/// Where the time is just long enough, layers at the ends have the width `1/alpha_3`: the search is in `asinh` of `alpha_3`.
fn search(path: &FrictionPath, stats: &mut SolverStats) -> Option<f64> {
    let alpha_scale = path.alpha_scale();
    let alpha_at = |q: f64| alpha_scale * 0.5 * (exp_m1(q) - exp_m1(-q));
    let mut before = f64::INFINITY;
    let probe = |q: f64| {
        let path = path.with(alpha_at(q));
        let end = match path.pass(ROUGH_ACCURACY, stats) {
            Ok(end) => end,
            Err(Ordering::Greater) => return Some(Probe { value: f64::MAX, slope: 0.0 }),
            Err(_) => return Some(Probe { value: -f64::MAX, slope: 0.0 }),
        };
        let (value, by_alpha) = path.residual(&end);
        let slope = by_alpha * 0.5 * alpha_scale * (exp(q) + exp(-q));
        // The step of q is its error.
        let step = (value / slope).clamp(-MAX_SEARCH_STEP, MAX_SEARCH_STEP);
        // Where theta falls exponentially, steps are small but do not shrink.
        let converges = step.abs() <= 0.1 * before && value.abs() <= 0.1;
        let weight = if converges { 1.0 } else { (2.0 * SEARCH_RTOL / step.abs()).max(1.0) };
        before = step.abs();
        Some(Probe { value: step * weight, slope: weight })
    };
    let far = ln_1p(4.0 * path.t_f / path.spare);
    let start = if path.accelerates { -far } else { far };
    let root = newton(probe, start, (f64::NEG_INFINITY, f64::INFINITY), false, SEARCH_RTOL)?;
    Some(alpha_at(root.x))
}

/// Passes after the search, at most. Chosen: Newton's method needs two or three.
const MAX_PASSES: u32 = 40;

/// Accuracy of the velocities of the last pass, in units of `rtol`. Chosen: the rest is left for the other errors of the row.
const LAST_PASS_FRACTION: f64 = 0.1;

/// Accuracy of the velocities, at least: rounding. Chosen: nine hundred roundings of 1.1e-16, the noise of a long path.
const MIN_ACCURACY: f64 = 1e-13;

/// Last step, in units of the accuracy of the velocities. Chosen: theta at the ends is then better than the velocities inside.
const LAST_STEP_FRACTION: f64 = 0.1;

/// Refines a path to the one that arrives, with its last pass; `None` where this fails.
fn refine(mut path: FrictionPath, rtol: f64, stats: &mut SolverStats) -> Option<Member> {
    let fine = (LAST_PASS_FRACTION * rtol).max(MIN_ACCURACY);
    // The error at the end is of the power 3/2.
    let (mut accuracy, mut before) = (exp(0.75 * ln(fine)), f64::INFINITY);
    for _ in 0..MAX_PASSES {
        let pass = path.pass(accuracy, stats).ok()?;
        let (value, by_alpha) = path.residual(&pass);
        let step = -value / by_alpha;
        let error = (step / path.alpha).abs().max(step.abs() * pass.max_ln_v_by_alpha);
        let is_fine = accuracy == fine;
        let stalls = step.abs() >= 0.5 * before || path.alpha + step == path.alpha;
        if is_fine && (error <= LAST_STEP_FRACTION * fine || stalls) {
            // A step within the tolerance is none of rounding.
            let noise = if error <= rtol { 0.0 } else { step.abs() * pass.max_visible_by_alpha };
            return Some(Member { path, pass, noise });
        }
        if !step.is_finite() {
            return None;
        }
        before = step.abs();
        if !is_fine && (stalls || error <= rtol.sqrt()) {
            (accuracy, before) = (fine, f64::INFINITY);
        }
        path = path.with(path.alpha + step);
    }
    None
}
