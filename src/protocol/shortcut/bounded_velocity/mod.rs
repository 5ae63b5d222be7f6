//! `bounded_velocity`: `v > 1` by construction.
//!
//! `v = 1 + (v_i - 1) exp[L t/t_f - alpha_3 (t_f - t) t]` with `L = ln((v_f - 1)/(v_i - 1))`; `alpha_3` brings theta to
//! `1/v_f` at `t_f`. theta(t_f) rises strictly with `alpha_3`, so there is one member if `t_f` is above `t_min =
//! ln(v_f/v_i) + ln((v_i - 1)/(v_f - 1))`, the ageing time at `v = 1`, and none otherwise. The unknown is `c = alpha_3
//! t_f^2`.
//!
//! Conditioning. With the remaining slip `R(t) = int_t^t_f v dt`, `dc/d ln t_f = -N/M`, where `N = int e^-R theta'
//! dt` and `M = int e^-R theta (v - 1) x (1 - x) dt`. Near `t_min`, `N` tends to `t_min (1 - 1/v_f)` and `c` is
//! proportional to `1/(t_f - t_min)`. There the condition number of `alpha_3` in `t_f` and in `t_min` is
//! `t_f/(t_f - t_min)`. For short times `c` is asymptotic to `4 ln t_f`, for long times to `-L`. It never passes 0: since
//! `int e^-R v'/v^2 dt = 0`, `v'` changes its sign, so the vertex of the exponent lies inside and `|c| > |L|`.

mod parabola;

use super::{Case, Family, Obstacle, Shortcut};
use crate::model::Transition;
use crate::numerics::elementary::{ln, ln_near_1};
use crate::protocol::profile::{
    self, ArrivalProblem, InitialState, ProtocolEnd, ResolvedPanel, ResolvedProfile, WorkAndFriction, integrate_theta,
};
use crate::protocol::{Motion, SolverStats};
use parabola::Parabola;

/// Velocity of a member.
type Curve = profile::VelocityCurve<Parabola>;

/// The family `bounded_velocity`.
pub(super) const FAMILY: Family = Family {
    name: "bounded_velocity",
    doc: "v > 1 by construction, v continuous at both ends",
    alpha: Some("alpha_3 in v = 1 + (v_i - 1) exp[ln((v_f - 1)/(v_i - 1)) t/t_f - alpha_3 (t_f - t) t]"),
    uses_tau_ceiling: false,
    arrives: true,
    solve,
    motion,
};

/// Relative error of theta, fraction of what friction may have. Chosen: a digit is left for other errors.
const THETA_FRACTION: f64 = 0.1;

/// Finest accuracy of theta. Chosen: some hundred roundings.
const FINEST_RTOL: f64 = 1e-14;

fn solve(case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<Shortcut, Obstacle> {
    let curve = member(case, rtol, stats)?;
    let Transition { law, v_i, v_f } = case.transition;
    if v_i == v_f {
        let friction = 1.0 + (law.a - law.b) * ln(v_i);
        return Ok(Shortcut {
            alpha: Some(0.0),
            work: friction * v_i * case.t_f,
            v_min: v_i,
            v_max: v_i,
            friction_max: friction,
            friction_min: friction,
            miss: 0.0,
        });
    }
    let mut totals_at = |rtol: f64| {
        let mut totals = WorkAndFriction::NONE;
        follow(&curve, case, rtol, stats, |panel| panel.add_to(&law, &curve, rtol, &mut totals)).map(|()| totals)
    };
    let mut totals = totals_at(rtol)?;
    // The greatest friction may be the small rest of terms that cancel: `b ln theta` has b times the relative error of theta.
    let size = totals.friction.high.abs();
    if size < law.b {
        totals = totals_at((THETA_FRACTION * rtol * size / law.b).max(FINEST_RTOL))?;
    }
    if !totals.work.is_finite() {
        return Err(Obstacle::NotConverged);
    }
    let vertex = curve.exponent.vertex().map_or(v_i, |x| 1.0 + curve.above_floor(ProtocolEnd::Start, x));
    Ok(Shortcut {
        alpha: Some(curve.exponent.c / case.t_f / case.t_f),
        work: totals.work,
        v_min: v_i.min(v_f).min(vertex),
        v_max: v_i.max(v_f).max(vertex),
        friction_max: totals.friction.high,
        friction_min: totals.friction.low,
        miss: 0.0,
    })
}

fn motion(case: &Case, rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
    let mut stats = SolverStats::default();
    let curve = member(case, rtol, &mut stats)?;
    let mut panels = Vec::new();
    follow(&curve, case, rtol, &mut stats, |panel| panels.push(*panel))?;
    Ok(Box::new(ResolvedProfile { law: case.transition.law, curve, panels }))
}

/// Integrates theta along the member, and hands the panels to `visit`.
fn follow(
    curve: &Curve,
    case: &Case,
    rtol: f64,
    stats: &mut SolverStats,
    visit: impl FnMut(&ResolvedPanel),
) -> Result<(), Obstacle> {
    let Transition { v_i, v_f, .. } = case.transition;
    let ends = (InitialState::steady(v_i), 1.0 / v_f);
    integrate_theta(curve, ends, rtol, stats, visit).ok_or(Obstacle::NotConverged)
}

/// Velocity of the member that solves the case.
fn member(case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<Curve, Obstacle> {
    let (Transition { v_i, v_f, .. }, t_f) = (case.transition, case.t_f);
    if v_i == 1.0 || v_f == 1.0 {
        return Err(Obstacle::End);
    }
    // Negative for an acceleration.
    let t_min = case.transition.ageing_time();
    if t_f <= t_min {
        return Err(Obstacle::Time { t_min });
    }
    let (w_i, w_f) = (v_i - 1.0, v_f - 1.0);
    let l = ln_near_1((v_f - v_i) / w_i, w_f / w_i);
    // Near v = 1, theta depends on values of v - 1 of the size of that at the end.
    let curve = Curve::new(1.0, w_f, t_f, Parabola { l, c: 0.0 }).resolved_to(w_f);
    if v_i == v_f {
        return Ok(curve);
    }
    let (spare, near_t_min) = (t_f - t_min, t_f < 2.0 * t_min);
    let problem = ArrivalProblem::steady(v_i, v_f, curve, spare, near_t_min);
    let start = if near_t_min { 2.0 * t_f / spare } else { guess(w_i, w_f, l, t_f, problem.required) };
    let c = problem.solve(start, rtol, stats).ok_or(Obstacle::NotConverged)?;
    Ok(curve.with(c))
}

/// Initial guess of `c`: a bump of area `required`, by Laplace's method; the steady case has its vertex at the end.
fn guess(w_i: f64, w_f: f64, l: f64, t_f: f64, required: f64) -> f64 {
    let excess = ln(required / (t_f * (w_i * w_f * std::f64::consts::PI).sqrt()));
    let mut y = (4.0 * excess).max(1.0);
    for _ in 0..3 {
        y = (4.0 * excess + 2.0 * ln(y) - l * l / y).max(1.0);
    }
    if y > l.abs() { -y } else { -l }
}
