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
use crate::numerics::elementary::{ln, ln_1p};
use crate::numerics::root::{Probe, newton};
use crate::protocol::{Effort, Motion};
use course::{Course, Extent};
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
        let course = member(case, rtol, effort)?;
        let mut extent = Extent::new(&course);
        let end = course.pass(0.1 * rtol, effort, |panel| extent.add(&course, panel)).ok_or(Obstacle::NotConverged)?;
        let reached = (end.level - course.target).abs() <= 10.0 * rtol + ROUNDING * (1.0 + course.target.abs());
        if !reached || !extent.work.is_finite() {
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
        let mut effort = Effort::default();
        let course = member(case, rtol, &mut effort)?;
        let mut panels = Vec::new();
        course.pass(0.1 * rtol, &mut effort, |panel| panels.push(*panel)).ok_or(Obstacle::NotConverged)?;
        if !course.forward {
            panels.reverse();
        }
        Ok(Box::new(Resolution { course, panels }))
    }
}

/// What rounding may cost of `ln theta` at the end.
const ROUNDING: f64 = 1e-12;

/// Tolerance of the first search, and of the first look at `tau = tau_M`.
const COARSE: f64 = 1e-4;

/// The course of the member that solves the case.
fn member(case: &Case, rtol: f64, effort: &mut Effort) -> Result<Course, Obstacle> {
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
    if !reaches(&course, rtol, effort)? {
        return Err(Obstacle::Friction);
    }
    let first = search(&course, COARSE, effort).ok_or(Obstacle::NotConverged)?;
    search(&course.with(first), 0.1 * rtol, effort).map(|alpha| course.with(alpha)).ok_or(Obstacle::NotConverged)
}

/// Whether `tau = tau_M` throughout is more than fast enough.
fn reaches(course: &Course, rtol: f64, effort: &mut Effort) -> Result<bool, Obstacle> {
    let limit = course.with(f64::NEG_INFINITY);
    for tolerance in [COARSE, 0.01 * rtol] {
        let Some(end) = limit.pass(tolerance, effort, |_| ()) else { return Ok(true) };
        let excess = limit.excess(&end);
        if excess.abs() > 100.0 * tolerance {
            return Ok(excess < 0.0);
        }
        if tolerance < COARSE {
            return Ok(excess < 0.0);
        }
    }
    Err(Obstacle::NotConverged)
}

/// `alpha_3` from the one of the course on.
fn search(course: &Course, tolerance: f64, effort: &mut Effort) -> Option<f64> {
    let probe = |alpha: f64| {
        let course = course.with(alpha);
        // Theta too small: too little of alpha forwards, too much of it backwards.
        let lost = if course.forward { -f64::MAX } else { f64::MAX };
        let Some(end) = course.pass(tolerance, effort, |_| ()) else { return Some(Probe { value: lost, slope: 0.0 }) };
        let slope = if course.forward { end.turn } else { -end.turn };
        let scale = 1.0 + alpha.abs();
        // In units of the change that alpha bears.
        let step = course.excess(&end) / slope;
        Some(Probe { value: step / scale, slope: 1.0 / scale })
    };
    newton(probe, course.alpha, (f64::NEG_INFINITY, f64::INFINITY), false, (10.0 * tolerance).sqrt().min(1e-2))
        .map(|root| root.x)
}
