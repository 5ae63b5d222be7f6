//! A shortcut driven open loop: how small errors grow, and where the block ends under a continuous or a sampled control.
//!
//! In the variables of the model, `v`, `theta` and the spring's length `s`, with the library's explicit integrator.

use super::formula_path::{FormulaPath, State};
use super::route::integrate;
use crate::protocol::SpringBlock;

/// A small error in `(ln v, ln theta, k s/a)`, column by column.
type Matrix = [[f64; 3]; 3];

/// The growth of errors.
#[derive(Debug, Clone, Copy)]
pub struct Growth {
    /// Greatest factor from the start to the end.
    pub whole: f64,
    /// Greatest factor from any time to the end.
    pub most: f64,
}

/// Relaxation time of the velocity, as a fraction of the protocol, below which an explicit integrator takes too many steps.
const MIN_RELAXATION_FRACTION: f64 = 1e-4;

/// Whether an explicit integrator cannot follow the block at its greatest velocity.
pub fn is_stiff(slider: &SpringBlock, least: f64, t_f: f64) -> bool {
    slider.m > 0.0 && slider.m * least / slider.law.a < MIN_RELAXATION_FRACTION * t_f
}

/// The growth of errors over a protocol of which `states` are known, `velocity(x)` at a fraction `x` of the time.
pub fn growth(
    slider: &SpringBlock,
    formula_path: &FormulaPath,
    states: &[State],
    velocity: impl Fn(f64) -> f64,
) -> Option<Growth> {
    let SpringBlock { law, k, m } = *slider;
    let (t_f, ratio) = (formula_path.t_f, law.b / law.a);
    // For each piece, the errors at its end for unit errors at its start.
    let piece = |pair: &[State]| {
        let (from, to) = (pair[0][2], pair[1][2]);
        let v = |x: f64| velocity(x);
        let mut columns: Matrix = [[0.0; 3]; 3];
        for (column, unit) in columns.iter_mut().zip(0..) {
            *column = if k == f64::INFINITY {
                let slope = |y: &[f64; 3]| [t_f * ((-y[0]).exp() - v(y[1])), 1.0, -t_f * (-y[0]).exp() * y[2]];
                if unit != 1 {
                    continue;
                }
                [0.0, integrate(slope, [pair[0][0], from, 1.0], (from, to))?[2], 0.0]
            } else if m > 0.0 {
                let slope = |y: &[f64; 5]| {
                    let (theta, v) = (y[0].exp(), v(y[1]));
                    let dv = (law.a * y[4] - law.a / v * y[2] - law.b / theta * y[3]) / m;
                    let (dtheta, dp) = (-v * y[3] - theta * y[2], -k / law.a * y[2]);
                    [t_f * (1.0 / theta - v), 1.0, t_f * dv, t_f * dtheta, t_f * dp]
                };
                let theta = pair[0][0].exp();
                let mut start = [pair[0][0], from, 0.0, 0.0, 0.0];
                start[2 + unit] = [v(from), theta, 1.0][unit];
                let end = integrate(slope, start, (from, to))?;
                [end[2] / v(to), end[3] / pair[1][0].exp(), end[4]]
            } else {
                if unit == 0 {
                    continue;
                }
                let slope = |y: &[f64; 4]| {
                    let (theta, v) = (y[0].exp(), v(y[1]));
                    let dv = v * (y[3] - ratio / theta * y[2]);
                    [t_f * (1.0 / theta - v), 1.0, t_f * (-v * y[2] - theta * dv), -t_f * k / law.a * dv]
                };
                let theta = pair[0][0].exp();
                let start = if unit == 1 { [pair[0][0], from, theta, 0.0] } else { [pair[0][0], from, 0.0, 1.0] };
                let end = integrate(slope, start, (from, to))?;
                let (y, p) = (end[2] / pair[1][0].exp(), end[3]);
                [0.0, y, p]
            };
        }
        Some(columns)
    };
    // Propagation from the end, where an error is itself.
    let mut after: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    if k == f64::INFINITY {
        after = [[0.0; 3], [0.0, 1.0, ratio], [0.0; 3]];
    } else if m == 0.0 {
        after = [[0.0; 3], [-ratio, 1.0, 0.0], [1.0, 0.0, 1.0]];
    }
    let mut most = norm(&after);
    for pair in states.windows(2).rev() {
        let before = piece(pair)?;
        after = before.map(|column| std::array::from_fn(|i| (0..3).map(|j| after[j][i] * column[j]).sum()));
        most = most.max(norm(&after));
    }
    let whole = norm(&after);
    (whole.is_finite() && most.is_finite()).then_some(Growth { whole, most })
}

/// The largest singular value, from powers of the product with the transpose, whose largest eigenvalue is its square.
fn norm(matrix: &Matrix) -> f64 {
    let size = matrix.iter().flatten().fold(0.0f64, |size, x| size.max(x.abs()));
    if size == 0.0 || !size.is_finite() {
        return size;
    }
    let mut square: Matrix = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..3).map(|r| matrix[i][r] / size * (matrix[j][r] / size)).sum())
    });
    let trace = |square: &Matrix| (0..3).map(|i| square[i][i]).sum::<f64>();
    // The trace of the 2^n-th power, as its 2^n-th root.
    let mut logarithm = 0.0;
    let mut fraction = 1.0;
    for _ in 0..60 {
        let factor = trace(&square);
        logarithm += fraction * factor.ln();
        fraction *= 0.5;
        let unit = square.map(|row| row.map(|x| x / factor));
        square = std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|r| unit[i][r] * unit[r][j]).sum()));
    }
    size * (0.5 * logarithm).exp()
}

/// A protocol as control of the spring, over the fraction `x` of the time.
pub struct ControlledProtocol<V, C> {
    pub slider: SpringBlock,
    pub v_i: f64,
    pub v_f: f64,
    pub t_f: f64,
    /// Its velocity.
    pub velocity: V,
    /// The control as a function of the fraction of the time and `ln theta`.
    pub control: C,
}

impl<V: Fn(f64) -> f64, C: Fn(f64, f64) -> f64> ControlledProtocol<V, C> {
    /// Distance from the target at the end, in `(ln v, ln theta, k s/a)`, of a block that starts in steady sliding, if the control is
    /// continuous, or sampled every `dt` and held.
    pub fn miss(&self, dt: Option<f64>) -> Option<f64> {
        let &ControlledProtocol { slider: SpringBlock { law, k, m }, v_i, v_f, t_f, .. } = self;
        let (ratio, pull) = (law.b / law.a, k / law.a);
        // p = (k s - tau_ss(v_f))/a, y = ln(theta v_f), x = ln(v/v_f), and ln theta of the protocol.
        let start = (v_i / v_f).ln();
        let mut state = [(1.0 - ratio) * start, -start, start];
        let mut aged = -v_i.ln();
        let legs = dt.map_or(1.0, |dt| (t_f / dt).ceil().max(1.0)) as u32;
        for leg in 0..legs {
            let at = |leg: u32| if leg == legs { 1.0 } else { dt.map_or(0.0, |dt| f64::from(leg) * dt / t_f) };
            let (from, span) = (at(leg), (0.0, at(leg + 1) - at(leg)));
            let held = dt.map(|_| (self.control)(from, aged));
            let control = |x: f64, aged: f64| held.unwrap_or_else(|| (self.control)(x, aged));
            let ageing = |x: f64, aged: f64| t_f * ((-aged).exp() - (self.velocity)(x));
            let [p, y, x] = state;
            (state, aged) = if k == f64::INFINITY {
                let slope = |s: &[f64; 3]| [t_f * ((-s[0]).exp() * v_f - control(s[1], s[2])), 1.0, ageing(s[1], s[2])];
                let [y, place, aged] = integrate(slope, [y, from, aged], span)?;
                let x = (control(place, aged) / v_f).ln();
                ([x + ratio * y, y, x], aged)
            } else if m > 0.0 {
                let slope = |s: &[f64; 5]| {
                    let v = v_f * s[2].exp();
                    let force = law.a * (s[0] - s[2] - ratio * s[1]) / (m * v);
                    let stretch = pull * (control(s[3], s[4]) - v);
                    [t_f * stretch, t_f * ((-s[1]).exp() * v_f - v), t_f * force, 1.0, ageing(s[3], s[4])]
                };
                let [p, y, x, _, aged] = integrate(slope, [p, y, x, from, aged], span)?;
                ([p, y, x], aged)
            } else {
                let slope = |s: &[f64; 4]| {
                    let v = v_f * (s[0] - ratio * s[1]).exp();
                    let stretch = pull * (control(s[2], s[3]) - v);
                    [t_f * stretch, t_f * ((-s[1]).exp() * v_f - v), 1.0, ageing(s[2], s[3])]
                };
                let [p, y, _, aged] = integrate(slope, [p, y, from, aged], span)?;
                ([p, y, p - ratio * y], aged)
            };
        }
        let distance = state.iter().map(|x| x * x).sum::<f64>().sqrt();
        distance.is_finite().then_some(distance)
    }
}
