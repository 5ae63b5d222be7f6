//! The compliant shortcut: `v`, `v'` and `v''` continuous at both ends, so that a spring of finite stiffness can drive it.
//!
//! With `x = t/t_f`, `v = 1 + exp f` and
//!
//! ```text
//! f = ln(v_i - 1) + L (10 x^3 - 15 x^4 + 6 x^5) + alpha x^3 (1 - x)^3,    L = ln((v_f - 1)/(v_i - 1)),
//! ```
//!
//! `v' = v'' = 0` at both ends. Theta at the end falls strictly with `alpha`, from its value for `v = 1`: there is one
//! member if `t_f` is above `t_min`, and none otherwise. The control velocity `v_c = v + (tau' + m v'')/k` depends on
//! the spring; `alpha` and the work do not.
//!
//! Conditioning. Near `t_min` the layers at both ends have the width `(-alpha)^(-1/3)`, and the condition number of
//! `alpha` in `t_f` is `3 t_f/(t_f - t_min)`. For long times `alpha` tends to `10 L`, for which `v''' = 0` at the end.

mod path;

use super::control::{Tolerance, ValueRange};
use super::profile::{
    ArrivalProblem, Hermite, InitialState, ProtocolEnd, ResolvedPanel, ResolvedProfile, VelocityCurve, WorkAndFriction,
    integrate_theta,
};
use super::{Solved, SolverStats, SpringBlock, Status};
use crate::model::Transition;
use crate::numerics::elementary::{ln, ln_near_1};

pub use path::CompliantPath;

/// Compliant shortcut. Every number has the requested relative accuracy; both extremes of `v_c` are relative to the
/// greater one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compliant {
    /// Coefficient of the bump (dimensionless).
    pub alpha: f64,
    /// Work of friction, `int tau v dt`.
    pub work: f64,
    /// Least velocity.
    pub v_min: f64,
    /// Greatest velocity.
    pub v_max: f64,
    /// Least control velocity.
    pub control_min: f64,
    /// Greatest control velocity.
    pub control_max: f64,
}

/// Solves for the shortcut from `v_i` to `v_f` under `slider.law` within `t_f`.
///
/// `Infeasible` where `t_f` is not above `t_min`, or where an argument is outside its domain (`a > 0`, `b >= 0`, `v_i,
/// v_f > 1`, `t_f > 0`, `m >= 0`, all finite; `k > 0`). `NegativeFriction` where `tau < 0` somewhere.
pub fn solve(slider: &SpringBlock, (v_i, v_f): (f64, f64), t_f: f64, rtol: f64) -> Solved<Compliant> {
    let mut stats = SolverStats::default();
    let (mut totals, mut control) = (WorkAndFriction::NONE, ValueRange::NONE);
    let followed = follow(slider, (v_i, v_f), t_f, rtol, &mut stats, |curve, panel| {
        panel.add_to(&slider.law, curve, rtol, &mut totals);
        panel.range(curve, Tolerance::OfRange(rtol), &mut control, |jet, bend| {
            [slider.control(jet), slider.control_rate(jet, bend)]
        });
    });
    let curve = match followed {
        Ok(curve) => curve,
        Err(status) => return Solved { status, value: None, stats },
    };
    let extremum = curve.exponent.extremum().map_or(v_i, |x| 1.0 + curve.above_floor(ProtocolEnd::Start, x));
    let (v_min, v_max) = (v_i.min(v_f).min(extremum), v_i.max(v_f).max(extremum));
    if slider.k == f64::INFINITY {
        control = ValueRange { low: v_min, high: v_max };
    }
    let value = Compliant {
        // No negative zero.
        alpha: 0.0 - curve.exponent.c,
        work: totals.work,
        v_min,
        v_max,
        control_min: control.low,
        control_max: control.high,
    };
    let numbers = [value.work, value.v_max, value.control_min, value.control_max];
    if numbers.iter().all(|number| number.is_finite()) {
        Solved { status: Status::Ok.with_friction(totals.friction.low), value: Some(value), stats }
    } else {
        Solved { status: Status::NotConverged, value: None, stats }
    }
}

/// The shortcut over time.
///
/// # Errors
///
/// The status of [`solve`] where there is no shortcut.
pub fn path(slider: &SpringBlock, (v_i, v_f): (f64, f64), t_f: f64, rtol: f64) -> Result<CompliantPath, Status> {
    let mut panels = Vec::new();
    let mut stats = SolverStats::default();
    let curve = follow(slider, (v_i, v_f), t_f, rtol, &mut stats, |_, panel| panels.push(*panel))?;
    Ok(CompliantPath { slider: *slider, resolution: ResolvedProfile { law: slider.law, curve, panels } })
}

/// Finds the shortcut, and integrates theta along it.
fn follow(
    slider: &SpringBlock,
    (v_i, v_f): (f64, f64),
    t_f: f64,
    rtol: f64,
    stats: &mut SolverStats,
    mut visit: impl FnMut(&VelocityCurve<Hermite>, &ResolvedPanel),
) -> Result<VelocityCurve<Hermite>, Status> {
    let curve = member(slider, (v_i, v_f), t_f, rtol, stats)?;
    let ends = (InitialState::steady(v_i), 1.0 / v_f);
    let followed = integrate_theta(&curve, ends, rtol, stats, |panel| visit(&curve, panel));
    followed.map(|()| curve).ok_or(Status::NotConverged)
}

/// Velocity of the shortcut.
fn member(
    slider: &SpringBlock,
    (v_i, v_f): (f64, f64),
    t_f: f64,
    rtol: f64,
    stats: &mut SolverStats,
) -> Result<VelocityCurve<Hermite>, Status> {
    let &SpringBlock { law, k, m } = slider;
    let sound = law.a > 0.0 && law.b >= 0.0 && t_f > 0.0 && v_i > 1.0 && v_f > 1.0 && k > 0.0 && m >= 0.0;
    if !sound || ![law.a, law.b, t_f, v_i, v_f, m].iter().all(|x| x.is_finite()) {
        return Err(Status::Infeasible);
    }
    // Negative for an acceleration.
    let t_min = Transition { law, v_i, v_f }.ageing_time();
    if t_f <= t_min {
        return Err(Status::Infeasible);
    }
    let (w_i, w_f) = (v_i - 1.0, v_f - 1.0);
    let rise = ln_near_1((v_f - v_i) / w_i, w_f / w_i);
    let curve = VelocityCurve::new(1.0, w_f, t_f, Hermite::flat(rise));
    if v_i == v_f {
        return Ok(curve);
    }
    let (spare, near_t_min) = (t_f - t_min, t_f < 2.0 * t_min);
    let problem = ArrivalProblem::steady(v_i, v_f, curve, spare, near_t_min);
    // Near t_min, two layers whose slip is the spare time.
    let layers = 1.8 * t_f / spare;
    let start = if near_t_min { layers * layers * layers } else { guess(w_i, w_f, rise, t_f, problem.required) };
    let c = problem.solve(start, rtol, stats);
    c.map(|c| curve.with(c)).ok_or(Status::NotConverged)
}

/// Initial guess of `c`: a bump of area `required` about the middle, by Laplace's method; `-10 L` for a long protocol.
///
/// In the middle `x^3 (1 - x)^3` is 1/64 with the curvature -3/8, and the quintic has the slope `15/8 L`.
fn guess(w_i: f64, w_f: f64, rise: f64, t_f: f64, required: f64) -> f64 {
    let excess = ln(required / (t_f * (w_i * w_f).sqrt()));
    let height = |y: f64| (excess + 0.5 * ln(12.0 * y / std::f64::consts::PI) - 0.0732 * rise * rise / y).max(0.5);
    let y = height(height(height(excess.max(0.5))));
    if 64.0 * y > 10.0 * rise.abs() { -64.0 * y } else { -10.0 * rise }
}
