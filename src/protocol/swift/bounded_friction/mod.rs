//! `bounded_friction`: `tau < tau_M` by construction.
//!
//! `tau = tau_M - (tau_M - tau_i) R^x e^(alpha_3 x (1 - x))` with `x = t/t_f` and `R = (tau_M - tau_f)/(tau_M - tau_i)`
//! falls strictly with `alpha_3` at every inner `x`. By comparison `theta' = 1 - theta^(1 - b/a) e^((tau - 1)/a)` makes
//! `theta(t_f)` from `theta(0) = 1/v_i` rise strictly with `alpha_3`. Its limits are that of `tau = tau_M` throughout and
//! that of `v = 0`, which is `1/v_i + t_f`. So there is one member if `1/v_f` lies strictly between them, none otherwise.
//! Read backwards from `t_f`, `theta(0)` falls with `alpha_3`, and the conditions are the same.
//!
//! `d(theta')/d(theta) = (b/a - 1) v`: theta is integrated forwards for `b <= a` and backwards for `b > a`, as both
//! contract.

mod course;
mod motion;

use super::{Case, Family, Obstacle, Swift};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::gauss::rule;
use crate::numerics::root::{Probe, newton};
use crate::protocol::{Effort, Motion};
use course::{Course, Extent, Panel, Stop};
use motion::Resolution;

/// The family.
pub struct BoundedFriction;

impl Family for BoundedFriction {
    fn name(&self) -> &'static str {
        "bounded_friction"
    }

    fn doc(&self) -> &'static str {
        "tau < tau_max by construction, v continuous at both ends"
    }

    fn alpha(&self) -> Option<&'static str> {
        Some("alpha_3 in tau = tau_max - (tau_max - tau_i) R^x exp[alpha_3 x (1 - x)], x = t/t_f")
    }

    fn heeds_tau_max(&self) -> bool {
        true
    }

    fn solve(&self, case: &Case, rtol: f64, effort: &mut Effort) -> Result<Swift, Obstacle> {
        let mut extent = None;
        let course = member(case, rtol, effort, |course, panel| match panel {
            Some(panel) => extent.get_or_insert_with(|| Extent::new(&case.transition)).add(course, panel),
            None => extent = None,
        })?;
        let extent = extent.unwrap_or_else(|| Extent::steady(&course, case.transition.v_i));
        if !extent.work.is_finite() {
            return Err(Obstacle::NotConverged);
        }
        Ok(Swift {
            alpha: Some(course.alpha),
            work: extent.work,
            v_min: extent.v_min,
            v_max: extent.v_max,
            friction_max: course.friction_max(),
            miss: 0.0,
        })
    }

    fn motion(&self, case: &Case, rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
        let mut panels = Vec::new();
        let mut course = member(case, rtol, &mut Effort::default(), |_, panel| match panel {
            Some(panel) => panels.push(*panel),
            None => panels.clear(),
        })?;
        if panels.is_empty() {
            // Steady sliding: one panel tells it all.
            let again = course.pass(0.1 * rtol, &mut Effort::default(), |panel| panels.push(*panel));
            again.map_err(|_| Obstacle::NotConverged)?;
            course.alpha = 0.0;
        }
        if !course.forward {
            panels.reverse();
        }
        Ok(Box::new(Resolution { course, panels }))
    }
}

/// Tolerance of the first search.
const COARSE: f64 = 1e-4;

/// Most passes after the first search: Newton's method needs two or three.
const MOST_PASSES: u32 = 12;

/// Tolerance of the last pass, in units of rtol.
const LAST: f64 = 1e-3;

/// What rounding of `ln theta` may leave of the target.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The course of the member that solves the case; the panels of its last pass go to `visit`, `None` when a pass begins.
/// No panel is visited where the protocol is steady sliding.
fn member(
    case: &Case,
    rtol: f64,
    effort: &mut Effort,
    mut visit: impl FnMut(&Course, Option<&Panel>),
) -> Result<Course, Obstacle> {
    let (law, v_i, v_f, t_f) = (case.transition.law, case.transition.v_i, case.transition.v_f, case.t_f);
    let sound = law.a > 0.0 && law.b >= 0.0 && t_f > 0.0 && v_i >= 1.0 && v_f >= 1.0;
    if !sound || ![law.a, law.b, t_f, v_i, v_f, case.tau_max].iter().all(|x| x.is_finite()) {
        return Err(Obstacle::Domain);
    }
    // Distances to the bound; their difference is known better than either.
    let room = case.tau_max - 1.0;
    let (gap_i, gap_f) = (room - (law.a - law.b) * ln(v_i), room - (law.a - law.b) * ln(v_f));
    if gap_i <= 0.0 || gap_f <= 0.0 {
        return Err(Obstacle::FrictionAtEnds { friction: case.tau_max - gap_i.min(gap_f) });
    }
    let change = (v_i - v_f) / v_f;
    let log_ratio = if change.abs() < 0.5 { ln_1p(change) } else { ln(v_i / v_f) };
    let share = (law.a - law.b) * log_ratio / gap_i;
    let ln_r = if share.abs() < 0.5 { ln_1p(share) } else { ln(gap_f / gap_i) };
    let course = Course::new(case, (gap_i, gap_f), ln_r);
    if v_i == v_f {
        return Ok(course);
    }
    if t_f <= (v_i - v_f) / v_f / v_i {
        return Err(Obstacle::Velocity);
    }
    if v_f > v_i && t_f <= fastest(law, (v_i, v_f), (gap_i, gap_f), effort) {
        return Err(Obstacle::Friction);
    }
    let mut course = course.with(search(&course, effort).ok_or(Obstacle::NotConverged)?);
    let mut last_pass = false;
    for _ in 0..MOST_PASSES {
        let pass = |panel: &Panel| {
            if last_pass {
                visit(&course, Some(panel));
            }
        };
        // The last pass tells the extremes too, which lie between the nodes.
        let tolerance = if last_pass { LAST } else { 0.1 } * rtol;
        let end = course.pass(tolerance, effort, pass).map_err(|_| Obstacle::NotConverged)?;
        let (_, step) = course.miss(&end);
        // Rounding of ln theta allows no better, whatever alpha then is worth.
        let rounding = ROUNDING * (1.0 + course.target.abs()) / end.turn.abs();
        let within = |share: f64| step.abs() <= (share * course.alpha.abs()).max(rounding);
        if last_pass && within(0.5 * rtol) {
            return Ok(course);
        }
        // Newton's method doubles the digits.
        let next = within(rtol.sqrt());
        if !step.is_finite() {
            return Err(Obstacle::NotConverged);
        }
        course = course.with(course.alpha + step);
        last_pass = next;
        visit(&course, None);
    }
    Err(Obstacle::NotConverged)
}

/// The time in which an acceleration arrives with `tau = tau_M` throughout, `int e^y/(e^z - 1) dy` over `y = ln theta`.
///
/// `z = ln(theta v)` is linear in `y` there, from `gap_i/a` to `gap_f/a`; panels double with `z`, so that the pole at
/// `z = 0` stays away.
fn fastest(law: Law, (v_i, v_f): (f64, f64), (gap_i, gap_f): (f64, f64), effort: &mut Effort) -> f64 {
    let rule = rule(24);
    let (z_i, z_f) = (gap_i / law.a, gap_f / law.a);
    let span = ln(v_f / v_i);
    let growth = (z_f / z_i).abs().max(z_i / z_f);
    let panels = (1.5 * ln(growth) + span).ceil().clamp(1.0, 400.0);
    effort.quadratures += 1;
    let mut time = 0.0;
    for panel in 0..panels as u32 {
        let place = |s: f64| {
            // Geometric in z, or even in y where z hardly changes.
            let share = (f64::from(panel) + s) / panels;
            if growth > 2.0 { z_i * (exp_m1(share * ln(z_f / z_i)) / (z_f - z_i)) } else { share }
        };
        let (low, high) = (place(0.0), place(1.0));
        effort.nodes += rule.x.len() as u32;
        for (x, w) in rule.x.iter().zip(&rule.w) {
            let share = low + 0.5 * (high - low) * (1.0 + x);
            let z = z_i + share * (z_f - z_i);
            time += 0.5 * (high - low) * w * span * exp(-share * span) / v_i / exp_m1(z);
        }
    }
    time
}

/// `alpha_3` to [`COARSE`].
fn search(course: &Course, effort: &mut Effort) -> Option<f64> {
    let unit = course.unit();
    let mut gave_up = false;
    let probe = |x: f64| {
        let course = course.with(unit * x);
        let end = match course.pass(COARSE, effort, |_| ()) {
            Ok(end) => end,
            // Theta too small: too little of alpha forwards, too much of it backwards.
            Err(Stop::Lost) => {
                return Some(Probe { value: if course.forward { -f64::MAX } else { f64::MAX }, slope: 0.0 });
            }
            Err(Stop::GaveUp) => {
                gave_up = true;
                return Some(Probe { value: 0.0, slope: 0.0 });
            }
        };
        let (miss, step) = course.miss(&end);
        // In units of the change that alpha bears; a step that doubles alpha is far enough.
        let scale = 1.0 + x.abs();
        let bounded = (step / unit).clamp(-FARTHEST * scale, FARTHEST * scale);
        let wrong = bounded.is_nan() || (bounded < 0.0) != (miss > 0.0);
        let value = if wrong { miss } else { -bounded / scale };
        Some(Probe { value, slope: if wrong { 0.0 } else { 1.0 / scale } })
    };
    let root = newton(probe, 0.0, (f64::NEG_INFINITY, f64::INFINITY), false, 1e-3);
    root.filter(|_| !gave_up).map(|root| unit * root.x)
}

/// Longest step of the search, in units of what alpha bears.
const FARTHEST: f64 = 4.0;
