//! The smooth shortcut: `v`, `v'` and `v''` continuous at both ends, so that a spring of finite stiffness can drive it.
//!
//! With `x = t/t_f`, `v = 1 + exp f` and
//!
//! ```text
//! f = ln(v_i - 1) + L (10 x^3 - 15 x^4 + 6 x^5) + alpha x^3 (1 - x)^3,    L = ln((v_f - 1)/(v_i - 1)),
//! ```
//!
//! `v' = v'' = 0` at both ends. Theta at the end falls strictly with `alpha`, from its value for `v = 1`: there is one
//! member if `t_f` is above `t_min`, and none otherwise. Neither `alpha` nor the work depends on the spring; the
//! control `v_c = v + (tau' + m v'')/k` does.
//!
//! Conditioning. Near `t_min` the layers at both ends have the width `(-alpha)^(-1/3)`: a relative error of `t_f` comes
//! out `3 t_f/(t_f - t_min)` times as large in `alpha`. For long times `alpha` tends to `10 L`, for which `v''' = 0` at
//! the end.

mod path;

use super::control::{Extent, Tolerance};
use super::profile::{Curve, Hermite, Problem, Resolved, Side, Start, pass, reach};
use super::{Solved, SolverStats, SpringBlock, Status};
use crate::model::Transition;
use crate::numerics::elementary::{ln, ln_1p};

pub use path::Path;

/// A member, every number to the requested relative accuracy; those of `v_c` to that of the greater of the two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compliant {
    /// The coefficient of the shortcut (dimensionless).
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

/// Solves for the member of a transition from `v_i` to `v_f` under `slider.law` within `t_f`.
///
/// `Infeasible` where `t_f` is not above `t_min`, or where an argument is outside its domain (`a > 0`, `b >= 0`, `v_i,
/// v_f > 1`, `t_f > 0`, `m >= 0`, all finite; `k > 0`). `NegativeFriction` where `tau < 0` somewhere.
pub fn solve(slider: &SpringBlock, (v_i, v_f): (f64, f64), t_f: f64, rtol: f64) -> Solved<Compliant> {
    let mut stats = SolverStats::default();
    let mut range = Range { work: 0.0, friction_min: f64::INFINITY, control: Extent::NONE };
    let followed = follow(slider, (v_i, v_f), t_f, rtol, &mut stats, |curve, panel| {
        let (work, friction_min) = panel.sum(&slider.law, curve);
        range.work += work;
        range.friction_min = range.friction_min.min(friction_min);
        panel.range(curve, Tolerance::OfRange(rtol), &mut range.control, |jet, bend| {
            [slider.control(jet), slider.control_rate(jet, bend)]
        });
    });
    let curve = match followed {
        Ok(curve) => curve,
        Err(status) => return Solved { status, value: None, stats },
    };
    let turn = curve.exponent.turn().map_or(v_i, |x| 1.0 + curve.surplus(Side::Start, x));
    let (v_min, v_max) = (v_i.min(v_f).min(turn), v_i.max(v_f).max(turn));
    if slider.k == f64::INFINITY {
        range.control = Extent { low: v_min, high: v_max };
    }
    let value = Compliant {
        // 0 without a sign.
        alpha: 0.0 - curve.exponent.c,
        work: range.work,
        v_min,
        v_max,
        control_min: range.control.low,
        control_max: range.control.high,
    };
    let numbers = [value.work, value.v_max, value.control_min, value.control_max];
    if numbers.iter().all(|number| number.is_finite()) {
        Solved { status: Status::Ok.with_friction(range.friction_min), value: Some(value), stats }
    } else {
        Solved { status: Status::NotConverged, value: None, stats }
    }
}

/// The member over time; `Err` with the status that [`solve`] has where there is none.
pub fn path(slider: &SpringBlock, (v_i, v_f): (f64, f64), t_f: f64, rtol: f64) -> Result<Path, Status> {
    let mut panels = Vec::new();
    let mut stats = SolverStats::default();
    let curve = follow(slider, (v_i, v_f), t_f, rtol, &mut stats, |_, panel| panels.push(*panel))?;
    Ok(Path::new(*slider, curve, panels))
}

/// What is gathered along the way.
struct Range {
    work: f64,
    friction_min: f64,
    control: Extent,
}

/// Finds the member and passes along it, and sees whether theta arrives: that the root is one is shown by another route
/// than found it.
fn follow(
    slider: &SpringBlock,
    (v_i, v_f): (f64, f64),
    t_f: f64,
    rtol: f64,
    stats: &mut SolverStats,
    mut visit: impl FnMut(&Curve<Hermite>, &Resolved),
) -> Result<Curve<Hermite>, Status> {
    let curve = member(slider, (v_i, v_f), t_f, rtol, stats)?;
    let theta =
        pass(&curve, Start::steady(v_i, false), rtol, INTERPOLATION * reach(rtol), stats, |panel| visit(&curve, panel));
    let arrives = theta.is_some_and(|theta| (theta * v_f - 1.0).abs() <= 10.0 * rtol + ROUNDING);
    if arrives { Ok(curve) } else { Err(Status::NotConverged) }
}

/// Theta and its rate are interpolated, which takes more nodes than a quadrature.
const INTERPOLATION: f64 = 0.45;

/// What rounding may cost of theta at the end.
const ROUNDING: f64 = 1e-12;

/// The velocity of the member.
fn member(
    slider: &SpringBlock,
    (v_i, v_f): (f64, f64),
    t_f: f64,
    rtol: f64,
    stats: &mut SolverStats,
) -> Result<Curve<Hermite>, Status> {
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
    let ratio = (v_f - v_i) / w_i;
    let rise = if ratio > -0.5 { ln_1p(ratio) } else { ln(w_f / w_i) };
    let curve = Curve::new(1.0, w_f, t_f, Hermite::flat(rise));
    if v_i == v_f {
        return Ok(curve);
    }
    let (spare, tight) = (t_f - t_min, t_f < 2.0 * t_min);
    let problem = Problem::steady(v_i, v_f, curve, spare, tight);
    // Close to t_min, two layers whose slip is what there is to spare.
    let layers = 1.8 * t_f / spare;
    let start = if tight { layers * layers * layers } else { guess(w_i, w_f, rise, t_f, problem.required) };
    let c = problem.solve(start, rtol, reach(rtol), stats);
    c.map(|c| curve.with(c)).ok_or(Status::NotConverged)
}

/// A start for the search: a bump of area `required`, by Laplace's method, about the middle, where `x^3 (1 - x)^3` is
/// 1/64 with the curvature -3/8 and the quintic has the slope `15/8 L`; a long protocol takes `-10 L`.
fn guess(w_i: f64, w_f: f64, rise: f64, t_f: f64, required: f64) -> f64 {
    let excess = ln(required / (t_f * (w_i * w_f).sqrt()));
    let height = |y: f64| (excess + 0.5 * ln(12.0 * y / std::f64::consts::PI) - 0.0732 * rise * rise / y).max(0.5);
    let y = height(height(height(excess.max(0.5))));
    if 64.0 * y > 10.0 * rise.abs() { -64.0 * y } else { -10.0 * rise }
}
