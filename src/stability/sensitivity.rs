//! Amplification of a small error over an open-loop shortcut: the fundamental matrix of the linearised flow.
//!
//! The load point follows `v_c(t)`, so an error of the state obeys the equations of motion linearised about the protocol.
//! In the scaled variables `q = ln v`, `y = ln theta` and `p = k s/a`, in which 1 is a change by a factor of e,
//!
//! ```text
//! dq' = kappa (dp - dq - (b/a) dy) - (v'/v) dq,    dy' = -dy/theta - v dq,    dp' = -(k/a) v dq,    kappa = a/(m v).
//! ```
//!
//! Without mass `dq = dp - (b/a) dy` follows the other two. With a rigid spring `dq = 0`, `dp = (b/a) dy` and
//! `dy' = -dy/theta`. The decay rate `kappa` spans many decades: collocation at the Radau nodes damps fast modes and
//! resolves slow ones.

use nalgebra::{DMatrix, Matrix3};

use crate::numerics::elementary::exp;
use crate::numerics::radau::{NODES, Radau, radau, root_of_order};
use crate::numerics::{LONG_ROUNDING_RTOL, MIN_INVERTIBLE, TIGHT_RTOL};
use crate::protocol::compliant::{self, CompliantPath};
use crate::protocol::error::TIGHTEST_RTOL;
use crate::protocol::{Jet, SpringBlock};
use crate::stability::{CONFIRMATION_RATIO, OpenLoopResult};

/// Amplification of a small error of the state from start to end of the shortcut from `v_i` to `v_f` in `t_f`: the largest singular value of the
/// fundamental matrix.
///
/// The norm is the Euclidean norm of `(ln v, ln theta, k s/a)`. Where some of the three variables follow the others, the initial error is in the
/// others alone, which gives the limits `m -> 0` and `k -> inf`. The accuracy is `rtol`; 0 below 1e-12. `None` without a shortcut, where two runs do
/// not agree to `rtol`, for more than 3,000 steps of a run, and beyond the range of doubles.
pub fn amplification(slider: &SpringBlock, velocities: (f64, f64), t_f: f64, rtol: f64) -> OpenLoopResult {
    let mut steps = 0;
    let mut confirmed = || {
        let path = compliant::path(slider, velocities, t_f, (PATH_ACCURACY * rtol).max(TIGHT_RTOL)).ok()?;
        let rough = growth(&path, CONFIRMATION_RATIO * TIGHTEST_RTOL, &mut steps)?;
        let fine = growth(&path, TIGHTEST_RTOL, &mut steps).filter(|growth| growth.is_finite())?;
        let agree = (rough - fine).abs() <= rtol * fine.max(LONG_ROUNDING_RTOL);
        agree.then_some(if fine < LONG_ROUNDING_RTOL { 0.0 } else { fine })
    };
    OpenLoopResult { number: confirmed(), steps }
}

/// Accuracy of the shortcut, in units of `rtol`. Derived: the relative error of an amplification of `e^700`, the range of doubles, is 700 times that
/// of the velocity, whose logarithm contains `alpha` times up to some 30.
const PATH_ACCURACY: f64 = 1e-5;

/// The amplification by steps with an error of `tolerance`; adds their number to `count`.
fn growth(path: &CompliantPath, tolerance: f64, count: &mut u32) -> Option<f64> {
    let rule = radau();
    let slider = &path.slider;
    let ratio = slider.law.b / slider.law.a;
    if slider.k == f64::INFINITY {
        return Some((1.0 + ratio * ratio).sqrt() * decay(path, rule));
    }
    let states = if slider.m > 0.0 { 3 } else { 2 };
    let mut flow = DMatrix::identity(states, states);
    let mut h = first_step(slider, &path.jet(0, 0.0));
    let mut steps = 0;
    for panel in 0..path.panels() {
        let duration = path.panel_duration(panel);
        let mut from = 0.0;
        while from < 1.0 {
            if steps == MAX_STEPS {
                return None;
            }
            (steps, *count) = (steps + 1, *count + 1);
            let to = if from + 1.0001 * h / duration >= 1.0 { 1.0 } else { from + h / duration };
            let (next, error) = step(path, panel, (from, to), &flow, rule)?;
            // The order of the error at the end is higher than that at the nodes.
            let error = error * error.sqrt();
            let change = 0.8 * root_of_order((tolerance / error.max(1e-30)).min(1e16));
            if error > tolerance {
                h = (to - from) * duration * change.clamp(0.2, 0.8);
            } else {
                flow = next;
                if flow.amax() < MIN_INVERTIBLE {
                    return Some(0.0);
                }
                h = ((to - from) * duration * change.clamp(0.5, 4.0)).max(if to == 1.0 { h } else { 0.0 });
                from = to;
            }
        }
    }
    if states == 2 {
        // Row of ln v.
        let velocity = flow.row(1) - ratio * flow.row(0);
        flow = flow.insert_row(2, 0.0);
        flow.set_row(2, &velocity);
    }
    // Scaled, so that no square overflows.
    let largest = flow.amax();
    Some(if largest == 0.0 || !largest.is_finite() {
        largest
    } else {
        largest * (flow / largest).singular_values().max()
    })
}

/// Steps of the linearised flow, at most. Chosen: enough for some thousand oscillations.
const MAX_STEPS: u32 = 3_000;

/// Factor of an error in one step, at least. Derived: rounding relative to the start of a step is then below the default `rtol` of its end by three
/// digits.
const MIN_STEP_FACTOR: f64 = 1e-3;

/// Decay of an error of `ln theta` under a given velocity, `exp(-int dt/theta)`.
fn decay(path: &CompliantPath, rule: &Radau) -> f64 {
    let exponent = |panel| {
        let sum: f64 = rule.u.iter().zip(&rule.w).map(|(&u, w)| w / path.jet(panel, u).theta).sum();
        path.panel_duration(panel) * sum
    };
    exp(-(0..path.panels()).map(exponent).sum::<f64>())
}

/// First step, from the rates at the start, in `l/v_0`.
fn first_step(slider: &SpringBlock, jet: &Jet) -> f64 {
    let v = jet.v[0];
    let fastest = if slider.m > 0.0 { (slider.k / slider.m).sqrt().min(slider.law.a / slider.m / v) } else { 0.0 };
    1.0 / (fastest + v * (1.0 + slider.k / slider.law.a) + 1.0 / jet.theta)
}

/// Flow after a step within a panel, and the relative error estimate of the nodes.
fn step(
    path: &CompliantPath,
    panel: usize,
    (from, to): (f64, f64),
    flow: &DMatrix<f64>,
    rule: &Radau,
) -> Option<(DMatrix<f64>, f64)> {
    let n = flow.nrows();
    let h = (to - from) * path.panel_duration(panel);
    let rates: [Matrix3<f64>; NODES] =
        std::array::from_fn(|j| h * rates(&path.slider, &path.jet(panel, from * rule.rest[j] + to * rule.u[j])));
    // X(u_j) - sum_k A_jk M_k X(u_k) = X(0).
    let mut matrix = DMatrix::identity(NODES * n, NODES * n);
    let mut values = DMatrix::zeros(NODES * n, n);
    for j in 0..NODES {
        for (k, rates) in rates.iter().enumerate() {
            let mut block = matrix.view_mut((j * n, k * n), (n, n));
            block -= rule.columns[k][j] * rates.view((0, 0), (n, n));
        }
        values.view_mut((j * n, 0), (n, n)).copy_from(flow);
    }
    if !matrix.lu().solve_mut(&mut values) || values.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let next = values.rows((NODES - 1) * n, n).into_owned();
    let mut error = 0.0f64;
    for column in 0..n {
        let largest = next.column(column).amax();
        if largest < MIN_STEP_FACTOR * flow.column(column).amax() {
            return Some((next, 1.0));
        }
        for i in 0..n {
            let term = |j: usize, c: usize| rates[j][(i, c)] * values[(j * n + c, column)];
            let changes = std::array::from_fn(|j| (0..n).map(|c| term(j, c)).sum());
            // The terms of a fast variable that follows the others cancel.
            let size = |j: usize| (0..n).map(|c| term(j, c).abs()).sum::<f64>();
            let rounding = f64::EPSILON * (0..NODES).map(size).fold(0.0, f64::max);
            error = error.max((rule.unresolved(&changes) - rounding) / largest);
        }
    }
    error.is_finite().then_some((next, error))
}

/// Matrix of the linearised equations.
fn rates(slider: &SpringBlock, jet: &Jet) -> Matrix3<f64> {
    let ratio = slider.law.b / slider.law.a;
    let v = jet.v[0];
    let pull = slider.k / slider.law.a * v;
    let aging = 1.0 / jet.theta;
    if slider.m > 0.0 {
        let kappa = slider.law.a / slider.m / v;
        let grow = jet.v[1] / v;
        Matrix3::new(-kappa - grow, -ratio * kappa, kappa, -v, -aging, 0.0, -pull, 0.0, 0.0)
    } else {
        Matrix3::new(ratio * v - aging, -v, 0.0, ratio * pull, -pull, 0.0, 0.0, 0.0, 0.0)
    }
}
