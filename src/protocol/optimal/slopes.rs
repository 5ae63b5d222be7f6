//! Derivatives of the least work along a path (envelope theorem), the costate and the gain of the feedback law.

use super::arc::{ArcPoint, Chart, omega, steady_friction};
use super::clamp::{ClampedPiece, Path};
use super::constrained::Sitting;
use super::extremal::Problem;
use super::lifetime::Lifetime;
use super::{ArcKind, Slopes, floor, motion};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1};
use crate::numerics::turning::turning;
use crate::protocol::SolverStats;

/// The derivatives of the work of `path`, then of steady sliding; quadratures are good to `tolerance`.
pub(super) fn slopes(
    problem: &Problem,
    path: Option<&Path>,
    sitting: Option<Sitting>,
    tolerance: f64,
    stats: &mut SolverStats,
) -> Option<Slopes> {
    let mut slopes = match path {
        Some(path) => along(problem, path, tolerance, stats)?,
        // Steady sliding all the time.
        None => {
            let v_i = -(problem.friction_end() + problem.law.a) * problem.from.theta;
            sitting.map(|_| Slopes { a: 0.0, b: 0.0, v_i, v_f: 0.0, v_ceiling: 0.0, tau_ceiling: 0.0 })?
        }
    };
    if let Some(sitting) = sitting {
        let Lifetime { theta, ln, .. } = problem.to;
        let (pressed, price) = sitting.multiplier(problem, sitting.time);
        let mut slip = sitting.time / theta;
        slopes.v_f = theta * (problem.friction_end() + problem.law.a + pressed);
        if sitting.kind == ArcKind::VCeiling && !price.is_nan() {
            slopes.v_ceiling = -price;
        } else {
            let price = price / (problem.law.a * theta);
            slip += price;
            slopes.tau_ceiling = -price;
        }
        (slopes.a, slopes.b) = (slopes.a - slip * ln, slopes.b + slip * ln);
        if price.is_nan() {
            slopes.v_ceiling = f64::NAN;
        }
    }
    Some(slopes)
}

fn along(problem: &Problem, path: &Path, tolerance: f64, stats: &mut SolverStats) -> Option<Slopes> {
    let held = path.extremal.time_at_floor;
    // At the floor ln v = 0, and the work is that of b = 1.
    let aged = floor::work(&Law { b: 1.0, ..problem.law }, problem.from, held) - held;
    let mut slopes = Slopes { a: 0.0, b: aged, v_i: 0.0, v_f: 0.0, v_ceiling: 0.0, tau_ceiling: 0.0 };
    for piece in path.pieces() {
        match piece {
            ClampedPiece::Free { arc, .. } => {
                let sums = arc.sums(tolerance)?;
                stats.quadratures += 1;
                stats.nodes += sums.nodes;
                slopes.a += sums.creep;
                slopes.b += sums.state;
            }
            ClampedPiece::Ceiling { arc, gap } => {
                let sums = arc.sums(gap);
                stats.nodes += sums.nodes;
                slopes.a += sums.creep;
                slopes.b += sums.state;
                if arc.kind == ArcKind::VCeiling {
                    slopes.v_ceiling -= sums.price;
                } else {
                    slopes.tau_ceiling -= sums.price;
                    slopes.a += sums.price_ln_v;
                    slopes.b += sums.price_ln_theta;
                }
            }
        }
    }
    let (theta_i, theta_f) = (problem.from.theta, problem.to.theta);
    slopes.v_i = -costate(problem, path)? * theta_i * theta_i;
    let last = path.pieces().last()?;
    slopes.v_f = pressure(problem.law, path.extremal.arc.c(), last, true) * theta_f * theta_f;
    Some(slopes)
}

/// Derivative of the work with respect to theta at the start.
pub(super) fn costate(problem: &Problem, path: &Path) -> Option<f64> {
    let held = path.extremal.time_at_floor;
    if held > 0.0 {
        return Some(-motion::Floor::new(problem, path.extremal.theta_s, held).costate_at_start());
    }
    Some(pressure(problem.law, path.extremal.arc.c(), path.pieces().next()?, false))
}

/// `(tau v + C)/(u - 1) = [tau + a - G/(u - 1)]/theta` at the start or at the end of a piece of a path of constant `c`.
fn pressure(law: Law, c: f64, piece: &ClampedPiece, at_end: bool) -> f64 {
    let at = piece.ends()[usize::from(at_end)];
    match piece {
        ClampedPiece::Free { .. } => costate_off_bounds(&law, c, &at),
        ClampedPiece::Ceiling { arc, gap } => {
            let gap = gap.value(arc, arc.end(arc.falls() != at_end));
            (at.friction(&law) + law.a - gap / exp_m1(at.ln_u)) / at.theta
        }
    }
}

/// `(tau + a)/theta = a v - C` on a free arc, by the sum of the smaller terms: the first cancels where `tau` is close to `-a`, the second where `v`
/// is large.
pub(super) fn costate_off_bounds(law: &Law, c: f64, point: &ArcPoint) -> f64 {
    let &ArcPoint { theta, ln_theta, ln_u } = point;
    let terms = [law.a * ln_u, (law.b - law.a) * ln_theta];
    let driven = law.a * exp(ln_u - ln_theta);
    if driven.max(c.abs()) * theta < 1.0 + terms[0].abs() + terms[1].abs() {
        driven - c
    } else {
        (1.0 + law.a + terms[0] + terms[1]) / theta
    }
}

/// `dv/dtheta` at the start, for a fixed time left, at the end of which it may wait.
pub(super) fn gain(problem: &Problem, path: &Path, waits: bool, tolerance: f64) -> Option<f64> {
    let Law { a, b } = problem.law;
    if path.extremal.time_at_floor > 0.0 {
        return Some(0.0);
    }
    let first = path.pieces().next()?;
    let start = first.ends()[0];
    let ArcPoint { theta, ln_u: z, .. } = start;
    let v = exp(z) / theta;
    match first.kind() {
        ArcKind::VCeiling => return Some(0.0),
        ArcKind::TauCeiling => return Some(-b * v / (a * theta)),
        _ => {}
    }
    let excess = exp_m1(z);
    let at_fixed_c = (start.friction(&problem.law) - b + a) / (a * theta);
    if waits {
        // C is that of the turn, whatever theta.
        return Some(-v / excess * at_fixed_c);
    }
    let (mut at_fixed_x, mut swing) = (0.0, 0.0);
    for (i, piece) in path.pieces().enumerate() {
        if let ClampedPiece::Free { arc, ends, .. } = piece {
            let sums = arc.sums(tolerance)?;
            let edge = |at: ArcPoint| at.theta / exp_m1(at.ln_u);
            at_fixed_x += sums.sensitivity + edge(ends[1]) - if i == 0 { 0.0 } else { edge(ends[0]) };
            swing += sums.swing;
        }
    }
    match path.extremal.arc.chart {
        Chart::Turning { theta_h, ln_theta_h, x_start, x_end, x_squares }
            if x_start * x_end <= 0.0 || x_squares.abs() > x_start.abs().min(x_end.abs()).powi(2) =>
        {
            // C of the turning point changes by k d ln theta_h; X/(u - 1) is regular at the turn.
            let c_h = steady_friction(&problem.law, ln_theta_h);
            let k = (c_h + a - b) / theta_h;
            let omega = omega(&problem.law, c_h, x_start * x_start);
            let turned = x_start / (omega * turning(x_start * omega).slope);
            let inner = k * k / (excess * k - theta * k / at_fixed_x);
            Some(-v / a * (a / theta + (a - b) * turned / theta_h + inner))
        }
        _ => Some(-v / excess * (at_fixed_c - theta / (excess * swing))),
    }
}
