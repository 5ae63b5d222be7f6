//! How much a small error grows over a shortcut that runs open loop: the fundamental matrix of the linearised flow.
//!
//! A shortcut is told to the spring as `v_c(t)`, so an error of the state obeys the equations of motion linearised
//! about the protocol. In the scaled variables `q = ln v`, `y = ln theta` and `p = k s/a`, in each of which 1 is a
//! change of the velocity by a factor of e,
//!
//! ```text
//! dq' = kappa (dp - dq - (b/a) dy) - (v'/v) dq,    dy' = -dy/theta - v dq,    dp' = -(k/a) v dq,    kappa = a/(m v).
//! ```
//!
//! Without mass `dq = dp - (b/a) dy` follows the other two. With a rigid spring `dq = 0` and `dp = (b/a) dy`, which
//! leaves `dy' = -dy/theta`. The decay rate `kappa` spans many decades: collocation at the Radau nodes damps what is
//! fast and follows what is slow.

use crate::numerics::elementary::exp;
use crate::numerics::elimination::eliminate;
use crate::numerics::radau::{NODES, Radau, radau};
use crate::protocol::compliant::Path;
use crate::protocol::{Jet, Slider};
use crate::stability::Followed;

/// The fundamental matrix, by columns; only as many rows and columns as there are states count.
type Matrix = [[f64; 3]; 3];

/// Largest factor by which a small error of the state at the start has grown at the end, both measured by the Euclidean
/// norm of `(ln v, ln theta, k s/a)`, good to `rtol`, or fewer digits where it is far below 1: the largest singular
/// value of the fundamental matrix. Where some of the three follow the others, the error at the start is one of those
/// others alone, so that the limits `m -> 0` and `k -> inf` are reached.
///
/// 0 below 1e-30. None where that takes more than 3,000 steps, the flow swinging too often, and beyond the range of doubles.
pub fn amplification(path: &Path, rtol: f64) -> Followed {
    let mut steps = 0;
    let number = growth(path, rtol, &mut steps).filter(|growth| growth.is_finite());
    let number = number.map(|growth| if growth < FORGOTTEN { 0.0 } else { growth });
    Followed { number, steps }
}

/// Least amplification that is given, a factor: about the square of the rounding of a double. Every step leaves rounding in
/// the flow, which decays at the slowest rate from there on, so that of a flow far below nothing else may be left: a
/// solution in high precision found 47 % of error at 1e-138.
const FORGOTTEN: f64 = 1e-30;

fn growth(path: &Path, rtol: f64, steps: &mut u32) -> Option<f64> {
    let rule = radau();
    let slider = &path.slider;
    let ratio = slider.law.b / slider.law.a;
    if slider.k == f64::INFINITY {
        return Some((1.0 + ratio * ratio).sqrt() * decay(path, rule));
    }
    let states = if slider.m > 0.0 { 3 } else { 2 };
    let mut flow: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut workspace = Workspace::new(states);
    let mut h = first(slider, &path.jet(0, 0.0));
    let tolerance = (1e-3 * rtol).max(1e-15);
    for piece in 0..path.pieces() {
        let span = path.span(piece);
        let mut from = 0.0;
        while from < 1.0 {
            if *steps == MOST_STEPS {
                return None;
            }
            *steps += 1;
            let to = if from + 1.0001 * h / span >= 1.0 { 1.0 } else { from + h / span };
            let (next, error) = workspace.step(path, piece, (from, to), &flow, rule)?;
            // What the end lacks is of a higher order than what the nodes lack.
            let error = error * error.sqrt();
            let change = 0.8 * sixteenth((tolerance / error.max(1e-30)).min(1e16));
            if error > tolerance {
                h = (to - from) * span * change.clamp(0.2, 0.8);
            } else {
                flow = next;
                h = ((to - from) * span * change.clamp(0.5, 4.0)).max(if to == 1.0 { h } else { 0.0 });
                from = to;
            }
        }
    }
    if states == 2 {
        // ln v follows.
        flow.iter_mut().for_each(|column| column[2] = column[1] - ratio * column[0]);
    }
    Some(norm(flow, states))
}

/// More steps than any flow takes that swings less than some thousand times.
const MOST_STEPS: u32 = 3_000;

/// `exp(-int dt/theta)`, by which an error of `ln theta` decays under a given velocity.
fn decay(path: &Path, rule: &Radau) -> f64 {
    let exponent = |piece| {
        let sum: f64 = rule.u.iter().zip(&rule.w).map(|(&u, w)| w / path.jet(piece, u).theta).sum();
        path.span(piece) * sum
    };
    exp(-(0..path.pieces()).map(exponent).sum::<f64>())
}

/// A first step: what the rates at the start allow.
fn first(slider: &Slider, jet: &Jet) -> f64 {
    let v = jet.v[0];
    let swing = if slider.m > 0.0 { (slider.k / slider.m).sqrt().min(slider.law.a / slider.m / v) } else { 0.0 };
    1.0 / (swing + v * (1.0 + slider.k / slider.law.a) + 1.0 / jet.theta)
}

/// The root by which a step follows from an error.
fn sixteenth(x: f64) -> f64 {
    x.sqrt().sqrt().sqrt().sqrt()
}

/// Room for the equations of one step.
struct Workspace {
    states: usize,
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl Workspace {
    fn new(states: usize) -> Workspace {
        let rows = NODES * states;
        Workspace { states, matrix: vec![0.0; rows * rows], right: vec![0.0; rows * states] }
    }

    /// The flow after a step over a part of a piece, and the share of it that the nodes do not resolve.
    fn step(
        &mut self,
        path: &Path,
        piece: usize,
        (from, to): (f64, f64),
        flow: &Matrix,
        rule: &Radau,
    ) -> Option<(Matrix, f64)> {
        let n = self.states;
        let rows = NODES * n;
        let h = (to - from) * path.span(piece);
        let rates: [Matrix; NODES] = std::array::from_fn(|j| {
            rates(&path.slider, &path.jet(piece, from * rule.rest[j] + to * rule.u[j])).map(|row| row.map(|r| h * r))
        });
        // X(u_j) - sum_k A_jk M_k X(u_k) = X(0).
        for j in 0..NODES {
            for i in 0..n {
                let row = &mut self.matrix[(j * n + i) * rows..][..rows];
                for (k, (entries, rates)) in row.chunks_exact_mut(n).zip(&rates).enumerate() {
                    entries.iter_mut().zip(&rates[i]).for_each(|(entry, rate)| *entry = -rule.columns[k][j] * rate);
                }
                row[j * n + i] += 1.0;
                self.right[(j * n + i) * n..][..n].iter_mut().zip(flow).for_each(|(x, column)| *x = column[i]);
            }
        }
        eliminate(&mut self.matrix, &mut self.right, rows)?;
        let mut error = 0.0f64;
        let mut next = *flow;
        for (column, (next, before)) in next.iter_mut().zip(flow).take(n).enumerate() {
            let values: [[f64; 3]; NODES] = std::array::from_fn(|j| {
                std::array::from_fn(|i| if i < n { self.right[(j * n + i) * n + column] } else { 0.0 })
            });
            *next = values[NODES - 1];
            let size = length(before).max(length(next));
            let change = |i: usize| rule.unresolved(&std::array::from_fn(|j| dot(&rates[j][i], &values[j])));
            error = (0..n).map(change).fold(error, |error, change| error.max(change / size));
        }
        (error.is_finite() && next.iter().flatten().all(|x| x.is_finite())).then_some((next, error))
    }
}

/// The linearised flow, row by row.
fn rates(slider: &Slider, jet: &Jet) -> Matrix {
    let ratio = slider.law.b / slider.law.a;
    let v = jet.v[0];
    let pull = slider.k / slider.law.a * v;
    let aging = 1.0 / jet.theta;
    if slider.m > 0.0 {
        let kappa = slider.law.a / slider.m / v;
        let grow = jet.v[1] / v;
        [[-kappa - grow, -ratio * kappa, kappa], [-v, -aging, 0.0], [-pull, 0.0, 0.0]]
    } else {
        [[ratio * v - aging, -v, 0.0], [ratio * pull, -pull, 0.0], [0.0; 3]]
    }
}

/// Without squares of what is large.
fn length(column: &[f64; 3]) -> f64 {
    let size = column.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    if size == 0.0 || !size.is_finite() {
        return size;
    }
    let scaled = column.map(|x| x / size);
    size * dot(&scaled, &scaled).sqrt()
}

fn dot(x: &[f64; 3], y: &[f64; 3]) -> f64 {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

/// The largest singular value of the first `n` columns, by rotations that make the columns orthogonal (one-sided Jacobi
/// method).
fn norm(mut flow: Matrix, n: usize) -> f64 {
    let size = flow.iter().take(n).flatten().fold(0.0, |size: f64, x| size.max(x.abs()));
    if size == 0.0 {
        return 0.0;
    }
    flow.iter_mut().flatten().for_each(|x| *x /= size);
    for _ in 0..MOST_SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().filter(|&(_, q)| q < n) {
            let dot = dot(&flow[p], &flow[q]);
            if dot == 0.0 {
                continue;
            }
            let (first, second) = (length(&flow[p]), length(&flow[q]));
            let zeta = (second - first) * (second + first) / (2.0 * dot);
            let tangent = 1f64.copysign(zeta) / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
            let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
            let (left, right) = flow.split_at_mut(q);
            for (x, y) in left[p].iter_mut().zip(&mut right[0]) {
                (*x, *y) = (cosine * (*x - tangent * *y), cosine * (*y + tangent * *x));
            }
        }
    }
    size * flow.iter().take(n).map(length).fold(0.0, f64::max)
}

/// Sweeps after which three columns are orthogonal to the last digits.
const MOST_SWEEPS: u32 = 10;
