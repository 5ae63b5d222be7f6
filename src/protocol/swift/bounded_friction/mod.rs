//! `bounded_friction`: `tau < tau_M` by construction.
//!
//! `tau = tau_M - (tau_M - tau_i) R^x e^(alpha_3 x (1 - x))` with `x = t/t_f` and `R = (tau_M - tau_f)/(tau_M - tau_i)`
//! falls strictly with `alpha_3` at every inner `x`. By comparison `theta' = 1 - theta^(1 - b/a) e^((tau - 1)/a)` makes
//! `theta(t_f)` from `theta(0) = 1/v_i` rise strictly with `alpha_3`. Its limits are that of `tau = tau_M` throughout
//! and that of `v = 0`, which is `1/v_i + t_f`. So there is one member if `1/v_f` lies strictly between them, none
//! otherwise. Read backwards from `t_f`, `theta(0)` falls with `alpha_3`, and the conditions are the same.
//!
//! As `tau_M` grows, `alpha_3` tends to 0 and friction to a parabola in time, `tau_i + (tau_f - tau_i) x + A x (1 -
//! x)`, which is the member for an infinite `tau_M`: there is no bound.
//!
//! `d(theta')/d(theta) = (b/a - 1) v`: theta is integrated forwards for `b <= a` and backwards for `b > a`, as both
//! contract. Where the time is just long enough, theta arrives whatever `alpha_3` is, but for little. Then the time to
//! spare is compared with what takes it: the slip `int theta v dt` beyond the time of `v = 0`, and beyond that of
//! `tau = tau_M`, with `z_M = ln(theta v)` for friction `tau_M`,
//!
//! ```text
//! int [1 - e^(-(tau_M - tau)/a)]/[1 - e^(-z_M)] dt.
//! ```
//!
//! Both are sums of positive terms and fall like `1/|alpha_3|`.

mod course;
mod extent;
mod gap;
mod motion;
mod panel;

use super::{Case, Family, Obstacle, Swift};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::gauss::rule;
use crate::numerics::root::{Probe, newton};
use crate::protocol::{Effort, Motion};
use course::{Course, Measure, Stop};
use extent::Extent;
use gap::gap;
use motion::Resolution;
use panel::Panel;

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
            alpha: Some(if case.tau_max == f64::INFINITY { 0.0 } else { course.alpha }),
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
            let again = course.pass(0.1 * rtol, Some(rtol), &mut Effort::default(), |panel| panels.push(*panel));
            again.map_err(|_| Obstacle::NotConverged)?;
            course.alpha = 0.0;
        }
        if !course.forward {
            panels.reverse();
        }
        Ok(Box::new(Resolution { course, panels }))
    }
}

/// Stands for an infinite distance from the bound.
const FAR: f64 = 1e100;

/// Below this share of [`Course::worth`] the time to spare is what a course is measured by.
const CLOSE: f64 = 0.1;

/// Tolerance of the first search.
const COARSE: f64 = 1e-4;

/// Most passes after the first search: Newton's method needs two or three, and a dozen more where theta has all but
/// relaxed at the end.
const MOST_PASSES: u32 = 40;

/// Tolerance of the nodes of the last pass, in units of rtol.
const LAST: f64 = 0.1;

/// Least tolerance of nodes: rounding allows no less.
const FINEST: f64 = 1e-13;

/// What rounding of `w` may leave of the target.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

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
    if !sound || ![law.a, law.b, t_f, v_i, v_f].iter().all(|x| x.is_finite()) || case.tau_max.is_nan() {
        return Err(Obstacle::Domain);
    }
    let unbounded = case.tau_max == f64::INFINITY;
    let distance = |v: f64| if unbounded { FAR } else { gap(law, case.tau_max, v) };
    let (gap_i, gap_f) = (distance(v_i), distance(v_f));
    if gap_i <= 0.0 || gap_f <= 0.0 {
        return Err(Obstacle::FrictionAtEnds { friction: case.tau_max - gap_i.min(gap_f) });
    }
    let change = (v_i - v_f) / v_f;
    let log_ratio = if change.abs() < 0.5 { ln_1p(change) } else { ln(v_i / v_f) };
    let share = (law.a - law.b) * log_ratio / gap_i;
    let ln_r = if share.abs() < 0.5 { ln_1p(share) } else { ln(gap_f / gap_i) };
    if v_i == v_f {
        return Ok(Course::new(case, (gap_i, gap_f), ln_r, log_ratio, Measure::Level));
    }
    // Time beyond that of v = 0 or that of tau = tau_M.
    let accelerates = v_f > v_i;
    let spare =
        t_f - if accelerates { fastest(law, (v_i, v_f), (gap_i, gap_f), effort) } else { (v_i - v_f) / v_f / v_i };
    if spare <= 0.0 {
        return Err(if accelerates { Obstacle::Friction } else { Obstacle::Velocity });
    }
    let measure = if accelerates { Measure::Lag { spare } } else { Measure::Slip { spare } };
    let course = Course::new(case, (gap_i, gap_f), ln_r, log_ratio, measure);
    let course = if spare < CLOSE * course.worth(0.0) { course } else { course.by_level() };
    let alpha = match course.measure {
        Measure::Level => search(&course, effort),
        Measure::Slip { .. } => close(&course, 2.0 * t_f / spare, effort),
        Measure::Lag { .. } => close(&course, -2.0 * t_f / spare, effort),
    };
    let mut course = course.with(alpha.ok_or(Obstacle::NotConverged)?);
    let (mut last_pass, mut before, mut tolerance) = (false, f64::INFINITY, 0.1 * rtol);
    for _ in 0..MOST_PASSES {
        let pass = |panel: &Panel| {
            if last_pass {
                visit(&course, Some(panel));
            }
        };
        // The last pass tells the work and the extremes too, which lie between the nodes.
        let nodes = (LAST * rtol).max(FINEST);
        let (within_pass, work) =
            if last_pass { (tolerance.min(nodes * nodes.sqrt()), Some(nodes)) } else { (tolerance, None) };
        let end = course.pass(within_pass, work, effort, pass).map_err(|_| Obstacle::NotConverged)?;
        let (_, step) = course.miss(&end);
        let scale = course.scale(&end);
        let within = |share: f64| step.abs() <= share * scale;
        // Rounding allows no better, once Newton's method no longer gains.
        let spent = step.abs() <= ROUNDING * course.rounding(&end) && step.abs() >= 0.5 * before;
        if last_pass && (within(0.5 * rtol) || spent) {
            return Ok(course);
        }
        if !step.is_finite() {
            return Err(Obstacle::NotConverged);
        }
        // What a panel may lack for the end to be as good as the step that is to come.
        let share = 5.0 * rtol * scale * course.precision(&end);
        tolerance = share.clamp(FINEST * FINEST.sqrt(), 0.1 * rtol);
        // Newton's method doubles the digits.
        last_pass = within(rtol.sqrt()) || spent;
        before = step.abs();
        course = course.with(course.alpha + step);
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
        let end = match course.pass(COARSE, None, effort, |_| ()) {
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
        if wrong {
            return Some(Probe { value: miss, slope: 0.0 });
        }
        // A step that is small beside alpha may still lead beyond a theta that is about to be lost.
        let weight = (1.0 / scale).max(FAR_OFF * miss.abs() / bounded.abs());
        Some(Probe { value: -bounded * weight, slope: weight })
    };
    let root = newton(probe, 0.0, (f64::NEG_INFINITY, f64::INFINITY), false, 1e-3);
    root.filter(|_| !gave_up).map(|root| unit * root.x)
}

/// What a theta at the end that is off by itself counts, beside the relative change of `alpha_3` that ends the search.
const FAR_OFF: f64 = 2e-3;

/// Longest step of the search, in units of what alpha bears.
const FARTHEST: f64 = 4.0;

/// `alpha_3` to [`COARSE`] where the time is just long enough: far out, where the layers at the ends shrink like
/// `1/alpha_3`, from a start in units of [`Course::unit`].
fn close(course: &Course, start: f64, effort: &mut Effort) -> Option<f64> {
    let unit = course.unit();
    let mut gave_up = false;
    let place = |q: f64| 0.5 * unit * (exp_m1(q) - exp_m1(-q));
    let probe = |q: f64| {
        let course = course.with(place(q));
        match course.pass(COARSE, None, effort, |_| ()) {
            Ok(end) => {
                let (value, step) = course.miss(&end);
                let stretch = 0.5 * unit * (exp(q) + exp(-q));
                Some(Probe { value, slope: (-value / step * stretch).max(0.0) })
            }
            Err(Stop::Lost) => Some(Probe { value: if course.forward { -f64::MAX } else { f64::MAX }, slope: 0.0 }),
            Err(Stop::GaveUp) => {
                gave_up = true;
                Some(Probe { value: 0.0, slope: 0.0 })
            }
        }
    };
    let start = start.signum() * ln_1p(2.0 * start.abs());
    let root = newton(probe, start, (-FARTHEST_OUT, FARTHEST_OUT), false, 1e-3);
    root.filter(|_| !gave_up).map(|root| place(root.x))
}

/// Logarithm of the greatest `alpha_3` in units of [`Course::unit`].
const FARTHEST_OUT: f64 = 100.0;
