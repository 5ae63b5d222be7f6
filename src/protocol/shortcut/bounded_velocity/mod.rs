//! `bounded_velocity`: `v > 1` by construction.
//!
//! `v = 1 + (v_i - 1) exp[L t/t_f - alpha_3 (t_f - t) t]` with `L = ln((v_f - 1)/(v_i - 1))`; `alpha_3` brings theta to
//! `1/v_f` at `t_f`. Since theta(t_f) rises strictly with `alpha_3`, there is one member if `t_f` is above `t_min =
//! ln(v_f/v_i) + ln((v_i - 1)/(v_f - 1))`, the time that `v = 1` takes, and none otherwise. The unknown is `c = alpha_3
//! t_f^2`.
//!
//! Conditioning. With the slip `R(t) = int_t^t_f v dt` that is left, `dc/d ln t_f = -N/M`, where `N = int e^-R theta'
//! dt` and `M = int e^-R theta (v - 1) x (1 - x) dt`. Near `t_min`, `N` tends to `t_min (1 - 1/v_f)` and `c` goes like
//! `1/(t_f - t_min)`: a relative error of `t_f`, and the rounding of `t_min`, come out `t_f/(t_f - t_min)` times as
//! large in `alpha_3`. For short times `c` goes like `4 ln t_f`, for long ones it tends to `-L`. It never passes 0:
//! since `int e^-R v'/v^2 dt = 0`, `v'` changes its sign, so the vertex of the exponent lies inside and `|c| > |L|`.

mod parabola;

use super::{Case, Family, Obstacle, Shortcut};
use crate::model::Transition;
use crate::numerics::elementary::{ln, ln_1p};
use crate::protocol::profile::{self, Passage, Problem, Resolution, Resolved, Side, Start, pass, reach};
use crate::protocol::{Motion, SolverStats};
use parabola::Parabola;

/// The velocity of a member.
type Curve = profile::Curve<Parabola>;

/// The family.
pub struct BoundedVelocity;

impl Family for BoundedVelocity {
    fn name(&self) -> &'static str {
        "bounded_velocity"
    }

    fn doc(&self) -> &'static str {
        "v > 1 by construction, v continuous at both ends"
    }

    fn alpha(&self) -> Option<&'static str> {
        Some("alpha_3 in v = 1 + (v_i - 1) exp[ln((v_f - 1)/(v_i - 1)) t/t_f - alpha_3 (t_f - t) t]")
    }

    fn solve(&self, case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<Shortcut, Obstacle> {
        let curve = member(case, rtol, stats)?;
        let (law, v_i, v_f) = (case.transition.law, case.transition.v_i, case.transition.v_f);
        if v_i == v_f {
            let friction_max = 1.0 + (law.a - law.b) * ln(v_i);
            let work = friction_max * v_i * case.t_f;
            let friction_min = friction_max;
            return Ok(Shortcut {
                alpha: Some(0.0),
                work,
                v_min: v_i,
                v_max: v_i,
                friction_max,
                friction_min,
                miss: 0.0,
            });
        }
        let mut passage = Passage { work: 0.0, friction_max: f64::NEG_INFINITY, friction_min: f64::INFINITY };
        follow(&curve, case, rtol, stats, |panel| panel.gather(&law, &curve, rtol, &mut passage))?;
        if !passage.work.is_finite() {
            return Err(Obstacle::NotConverged);
        }
        let vertex = curve.exponent.vertex().map_or(v_i, |x| 1.0 + curve.surplus(Side::Start, x));
        Ok(Shortcut {
            alpha: Some(curve.exponent.c / case.t_f / case.t_f),
            work: passage.work,
            v_min: v_i.min(v_f).min(vertex),
            v_max: v_i.max(v_f).max(vertex),
            friction_max: passage.friction_max,
            friction_min: passage.friction_min,
            miss: 0.0,
        })
    }

    fn motion(&self, case: &Case, rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
        let mut stats = SolverStats::default();
        let curve = member(case, rtol, &mut stats)?;
        let mut panels = Vec::new();
        follow(&curve, case, rtol, &mut stats, |panel| panels.push(*panel))?;
        Ok(Box::new(Resolution { law: case.transition.law, curve, panels }))
    }
}

/// Passes along the member, and sees whether theta arrives: that the root is one is shown by another route than found
/// it.
fn follow(
    curve: &Curve,
    case: &Case,
    rtol: f64,
    stats: &mut SolverStats,
    visit: impl FnMut(&Resolved),
) -> Result<(), Obstacle> {
    let Transition { v_i, v_f, .. } = case.transition;
    // Theta is interpolated, which takes more nodes than a quadrature.
    let theta =
        pass(curve, Start::steady(v_i, true), rtol, 0.75 * reach(rtol), stats, visit).ok_or(Obstacle::NotConverged)?;
    let arrives = (theta * v_f - 1.0).abs() <= 10.0 * rtol + ROUNDING;
    if arrives { Ok(()) } else { Err(Obstacle::NotConverged) }
}

/// What rounding may cost of theta at the end.
const ROUNDING: f64 = 1e-12;

/// The velocity of the member that solves the case.
fn member(case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<Curve, Obstacle> {
    let (law, v_i, v_f, t_f) = (case.transition.law, case.transition.v_i, case.transition.v_f, case.t_f);
    let sound = law.a > 0.0 && law.b >= 0.0 && t_f > 0.0 && v_i >= 1.0 && v_f >= 1.0;
    if !sound || ![law.a, law.b, t_f, v_i, v_f].iter().all(|x| x.is_finite()) {
        return Err(Obstacle::Domain);
    }
    if v_i == 1.0 || v_f == 1.0 {
        return Err(Obstacle::End);
    }
    // Negative for an acceleration.
    let t_min = case.transition.ageing_time();
    if t_f <= t_min {
        return Err(Obstacle::Time { t_min });
    }
    let (w_i, w_f) = (v_i - 1.0, v_f - 1.0);
    let ratio = (v_f - v_i) / w_i;
    let l = if ratio > -0.5 { ln_1p(ratio) } else { ln(w_f / w_i) };
    // Next to v = 1 it is excesses of the size of that at the end that theta hangs on.
    let curve = Curve::new(1.0, w_f, t_f, Parabola { l, c: 0.0 }).resolved_to(w_f);
    if v_i == v_f {
        return Ok(curve);
    }
    let (spare, tight) = (t_f - t_min, t_f < 2.0 * t_min);
    let problem = Problem::steady(v_i, v_f, curve, spare, tight);
    let start = if tight { 2.0 * t_f / spare } else { guess(w_i, w_f, l, t_f, problem.required) };
    let c = problem.solve(start, rtol, reach(rtol), stats).ok_or(Obstacle::NotConverged)?;
    Ok(curve.with(c))
}

/// A start for the search: a bump of area `required`, by Laplace's method; the steady case has its vertex at the end.
fn guess(w_i: f64, w_f: f64, l: f64, t_f: f64, required: f64) -> f64 {
    let excess = ln(required / (t_f * (w_i * w_f * std::f64::consts::PI).sqrt()));
    let mut y = (4.0 * excess).max(1.0);
    for _ in 0..3 {
        y = (4.0 * excess + 2.0 * ln(y) - l * l / y).max(1.0);
    }
    if y > l.abs() { -y } else { -l }
}
