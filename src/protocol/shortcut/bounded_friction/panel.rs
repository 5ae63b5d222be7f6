//! One panel of a path: collocation of `w` at the Radau nodes.

use multiversion::multiversion;
use nalgebra::SMatrix;

use super::path::{FrictionPath, MAX_EXPONENT, MAX_QUADRATURE_EXPONENT, PathEnd};
use crate::numerics::elementary::{exp, exp_m1, ln_1p};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};

/// Panel with `w` at its start and nodes.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionPanel {
    /// Whether it was integrated forwards in time.
    pub forward: bool,
    pub side: PathEnd,
    /// Distances from that end.
    pub from: f64,
    pub to: f64,
    pub start: f64,
    pub w: Nodes,
    /// `z = ln(theta v)` at the nodes, from the slope of `w` or from friction, whichever is more accurate.
    pub z: Nodes,
    /// Whether `z` is from the slope at all nodes.
    pub follows: bool,
}

/// Solved panel.
#[derive(Debug, Clone, Copy)]
pub(super) struct SolvedPanel {
    pub panel: FrictionPanel,
    /// Derivative of `w` with respect to `alpha_3` at the end.
    pub w_by_alpha: f64,
    /// Slip in units of that of steady sliding, `int v/v_0 dd`, and its error estimate.
    pub slip: f64,
    pub lack: f64,
    /// Rounding of `w` in units of the last place of 1: its own, and the propagated rounding of `z`.
    pub noise: f64,
    /// Amplification of a change of `w` from the start to the end.
    pub growth: f64,
    /// Error estimate of `w` at the nodes.
    pub error: f64,
}

impl FrictionPanel {
    /// Distance from the near end at the fraction `s` of the panel.
    pub fn distance(&self, s: f64) -> f64 {
        self.from * (1.0 - s) + self.to * s
    }

    /// `w` there.
    pub fn level(&self, s: f64) -> f64 {
        radau().interpolate(Some(self.start), &self.w, s)
    }

    /// `w` and `z` there.
    pub fn state(&self, path: &FrictionPath, s: f64) -> (f64, f64) {
        let w = self.level(s);
        let z = if self.follows {
            radau().interpolate(None, &self.z, s)
        } else {
            path.ln_theta_v(self.side, self.distance(s), w)
        };
        (w, z)
    }
}

/// Newton steps on a panel, at most. Chosen: quadratic convergence takes four or five.
const MAX_STEPS: usize = 10;

/// Error of the quadrature in the first step, fraction of the change, at most. Chosen: three digits of the step are correct.
const QUADRATURE_FRACTION: f64 = 1e-3;

/// Change below which a step that shrinks no more is rounding, in units of the rounding of `w`. Chosen: two digits above the rounding of one value.
const MAX_ROUNDINGS: f64 = 100.0;

/// Change of `w` in the initial guess of a panel, at most. Chosen: a factor of `e^20`, 5e8, of theta; Newton's method does the rest.
const MAX_GUESS_CHANGE: f64 = 20.0;

/// Solves the panel between two distances from an end, from `w` and its derivative at the first, to `tolerance`; `None`
/// where Newton's method does not converge.
///
/// A Newton step solves `delta = R + int slope delta dd`. Where the integral of the slope is small, its solution
/// `R + int e^(S(d) - S(c)) slope R dc` needs no elimination; the quadrature makes the steps slightly inexact.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub(super) fn collocate(
    path: &FrictionPath,
    side: PathEnd,
    (from, to): (f64, f64),
    [start, w_by_alpha]: [f64; 2],
    tolerance: f64,
    rule: &Radau,
) -> Option<SolvedPanel> {
    let end_state = path.end_state(side);
    let scale = (to - from).abs() * path.theta_rate(end_state);
    let kappa = path.kappa;
    let (mut scaled_friction, mut friction_sensitivity, mut doubt) = ([0.0; NODES], [0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        let d = from * rule.rest[j] + to * rule.u[j];
        let e = path.exponent(end_state, d);
        scaled_friction[j] = path.scaled_friction(end_state, e);
        let distance = end_state.margin / path.a * exp(if e < MAX_EXPONENT { e } else { MAX_EXPONENT });
        friction_sensitivity[j] = -d * (1.0 - d) * distance;
        // Rounding of the scaled friction and of its exponent.
        doubt[j] = scaled_friction[j].abs() + path.uncertainty(end_state, d) * distance;
    }
    let mut w = guess(path, (side, from), start, scale, &scaled_friction, rule);
    let mut before = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        let (mut rate, mut speed, mut slope, mut push) = ([0.0; NODES], [0.0; NODES], [0.0; NODES], [0.0; NODES]);
        let mut z_rounding = [0.0; NODES];
        for j in 0..NODES {
            // theta v = e^z: the rate is a small difference where theta follows the velocity.
            let (inverse, excess) = (exp(-w[j]), exp_m1(scaled_friction[j] + kappa * w[j]));
            let v = inverse * (1.0 + excess);
            rate[j] = -scale * inverse * excess;
            speed[j] = scale.abs() * v;
            slope[j] = scale * inverse * (excess - kappa * (1.0 + excess));
            push[j] = -scale * v * friction_sensitivity[j];
            // Where theta relaxes, only the last rounding errors of the scaled friction count.
            z_rounding[j] = speed[j] * (doubt[j] + (kappa * w[j]).abs()) / (1.0 + slope[j].abs());
        }
        let sums = rule.integrals(&rate);
        let mut rest = [0.0; NODES];
        for j in 0..NODES {
            rest[j] = start - w[j] + sums[j];
        }
        let decay = rule.integrals(&slope);
        let by_quadrature = decay.iter().all(|s| s.abs() <= MAX_QUADRATURE_EXPONENT);
        let (steps, last) = if by_quadrature {
            step_by_quadrature([&decay, &slope, &rest, &push], w_by_alpha, rule)
        } else {
            step_by_elimination([&slope, &rest, &push], w_by_alpha, rule)?
        };
        let mut change = 0.0f64;
        for j in 0..NODES {
            w[j] += steps[j];
            // A NaN stays.
            change = if steps[j].abs() <= change { change } else { steps[j].abs() };
        }
        if change.is_nan() || change > 50.0 {
            return None;
        }
        // The next change, if it shrinks as this one did.
        let gain =
            if before.is_finite() { change / before } else { (1.0 + kappa.abs()) * change + QUADRATURE_FRACTION };
        let left = change * gain.min(1.0);
        let largest = w.iter().fold(start.abs(), |most, w| most.max(w.abs()));
        let total_z_rounding: f64 = z_rounding.iter().zip(&rule.w).map(|(z_rounding, w)| z_rounding * w).sum();
        let noise = largest + total_z_rounding;
        let stalled = change <= MAX_ROUNDINGS * f64::EPSILON * noise && change >= 0.25 * before;
        before = change;
        if left <= tolerance || left <= f64::EPSILON * noise || stalled {
            let growth = exp(decay[NODES - 1]);
            let slip: f64 = speed.iter().zip(&rule.w).map(|(v, w)| v * w).sum();
            // Without the rounding of the coefficients.
            let count = (4 * NODES) as f64;
            let error = (count * rule.unresolved(&w) - count * f64::EPSILON * noise).max(0.0);
            let (z, follows, rounding) = excesses(&w, start, scale, kappa, (&scaled_friction, &doubt), rule);
            let mut uncertain = 0.0;
            for j in 0..NODES {
                speed[j] = scale.abs() * exp(z[j] - w[j]);
                uncertain += rule.w[j] * speed[j] * (1.0 + w[j].abs() + rounding[j]);
            }
            let lack = (rule.unresolved(&speed) - count * f64::EPSILON * uncertain).max(0.0);
            let panel = FrictionPanel { forward: path.forward, side, from, to, start, w, z, follows };
            return Some(SolvedPanel { panel, w_by_alpha: last, slip, lack, noise: 8.0 * noise, growth, error });
        }
    }
    None
}

/// A Newton step and the derivative by alpha at the last node, where the integral of the slope, `decay`, is small.
#[inline(always)]
fn step_by_quadrature([decay, slope, rest, push]: [&Nodes; 4], w_by_alpha: f64, rule: &Radau) -> (Nodes, f64) {
    let (mut grow, mut weighted, mut pushed) = ([0.0; NODES], [0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        grow[j] = exp(decay[j]);
        weighted[j] = slope[j] * rest[j] / grow[j];
        pushed[j] = push[j] / grow[j];
    }
    let sums = rule.integrals(&weighted);
    let mut steps = [0.0; NODES];
    for j in 0..NODES {
        steps[j] = rest[j] + grow[j] * sums[j];
    }
    (steps, grow[NODES - 1] * (w_by_alpha + rule.integrals(&pushed)[NODES - 1]))
}

/// A Newton step and the derivative by alpha at the last node; `None` where the matrix is singular.
#[inline(always)]
fn step_by_elimination([slope, rest, push]: [&Nodes; 3], w_by_alpha: f64, rule: &Radau) -> Option<(Nodes, f64)> {
    let forced = rule.integrals(push);
    let mut right = SMatrix::<f64, NODES, 2>::from_fn(|j, side| [rest[j], w_by_alpha + forced[j]][side]);
    let matrix =
        SMatrix::<f64, NODES, NODES>::from_fn(|j, k| f64::from(u8::from(j == k)) - rule.columns[k][j] * slope[k]);
    matrix.lu().solve_mut(&mut right).then(|| (std::array::from_fn(|j| right[(j, 0)]), right[(NODES - 1, 1)]))
}

/// `z` at the nodes, whether all are from the slope of `w`, and their rounding.
///
/// `z = f + kappa w` is a small difference where theta follows the velocity; there `1 - e^z = theta'` is small, and the
/// slope of `w` gives it.
#[inline(always)]
fn excesses(
    w: &Nodes,
    start: f64,
    scale: f64,
    kappa: f64,
    (scaled_friction, doubt): (&Nodes, &Nodes),
    rule: &Radau,
) -> (Nodes, bool, Nodes) {
    let slopes = rule.slopes(&w.map(|w| w - start));
    let amplitude = w.iter().fold(0.0f64, |most, w| most.max((w - start).abs()));
    let (mut z, mut follows, mut rounding) = ([0.0; NODES], true, [0.0; NODES]);
    for j in 0..NODES {
        let gain = exp(w[j]) / scale;
        let rate = slopes[j] * gain;
        let (by_friction, by_slope) = (doubt[j] + (kappa * w[j]).abs(), SLOPE_ROUNDING * amplitude * gain.abs());
        if by_slope < by_friction && rate.abs() < 0.5 {
            (z[j], rounding[j]) = (ln_1p(-rate), by_slope);
        } else {
            (z[j], rounding[j]) = (scaled_friction[j] + kappa * w[j], by_friction);
            follows = false;
        }
    }
    (z, follows, rounding)
}

/// Rounding of the slope of a polynomial through the nodes, in units of the rounding of its values. Chosen: the order of the sum of the weights.
const SLOPE_ROUNDING: f64 = 300.0;

/// Initial guess of `w`: relaxation towards constant `ln(theta v)` where theta relaxes, constant `w` elsewhere.
#[inline(always)]
fn guess(
    path: &FrictionPath,
    (side, from): (PathEnd, f64),
    start: f64,
    scale: f64,
    scaled_friction: &Nodes,
    rule: &Radau,
) -> Nodes {
    let end_state = path.end_state(side);
    let before = path.scaled_friction(end_state, path.exponent(end_state, from));
    let excess = exp_m1(before + path.kappa * start);
    let decay = -scale * exp(-start) * (excess - path.kappa * (1.0 + excess));
    if decay <= MIN_RELAXATION {
        return [start; NODES];
    }
    // The slope relaxes from its value at the start to that of a linear scaled friction.
    let slope = -scale * exp(-start) * excess;
    let largest = MAX_GUESS_CHANGE * path.kappa.abs();
    let mut w = [0.0; NODES];
    for j in 0..NODES {
        let followed = -(scaled_friction[j] - before).clamp(-largest, largest) / path.kappa;
        let passed = decay * rule.u[j];
        w[j] = start + followed - (slope * rule.u[j] - followed) * exp_m1(-passed) / passed;
    }
    w
}

/// Relaxation exponent of a panel below which theta counts as constant. Chosen: theta changes by less than a tenth of its distance from `1/v`.
const MIN_RELAXATION: f64 = 0.1;
