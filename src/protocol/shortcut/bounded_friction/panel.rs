//! One panel of a path: collocation of `w` at the Radau nodes.

use multiversion::multiversion;
use nalgebra::SMatrix;

use super::path::{FrictionPath, PathEnd};
use crate::numerics::elementary::{exp, exp_m1};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};

/// Panel with `w` at its start and nodes.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionPanel {
    pub side: PathEnd,
    /// Distances from that end.
    pub from: f64,
    pub to: f64,
    pub start: f64,
    pub w: Nodes,
}

/// Solved panel.
#[derive(Debug, Clone, Copy)]
pub(super) struct SolvedPanel {
    pub panel: FrictionPanel,
    /// Derivative of `w` with respect to `alpha_3` at the end.
    pub w_by_alpha: f64,
    /// Slip `int v dt`, in units of `l`, and its error estimate.
    pub slip: (f64, f64),
    /// The integral that is compared with the spare time, and its error estimate.
    pub excess: (f64, f64),
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
        radau().interpolate(self.start, &self.w, s)
    }
}

/// Friction at the nodes of a panel, in units of `a`.
pub(super) struct NodeFriction {
    /// Relative to that of the nearer end.
    pub scaled: Nodes,
    /// Distance from the ceiling.
    pub room: Nodes,
    /// Derivative with respect to `alpha_3`.
    by_alpha: Nodes,
}

/// Newton steps on a panel, at most. Chosen: quadratic convergence takes four or five.
const MAX_STEPS: usize = 10;

/// Error of the quadrature in a step, fraction of the change, at most. Chosen: three digits of the step are correct.
const QUADRATURE_FRACTION: f64 = 1e-3;

/// Integral of the slope up to which a Newton step needs no elimination. Chosen: quadrature at the nodes resolves `e^6`.
const MAX_QUADRATURE_EXPONENT: f64 = 6.0;

/// Ratio of the error of `w` to [`Radau::unresolved`], and rounding errors in it. Chosen: four a node.
const ERROR_FACTOR: f64 = (4 * NODES) as f64;

/// Solves the panel between two distances from an end, from `w` and its derivative at the first, to `tolerance` at the
/// nodes; `None` where Newton's method does not converge.
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
    let (scale, kappa) = ((to - from).abs() * path.theta_rate(path.end_state(side)), path.kappa);
    let friction = node_friction(path, side, (from, to), rule);
    let w = guess(path, (side, from), start, scale, &friction.scaled);
    let mut panel = FrictionPanel { side, from, to, start, w };
    // The first step leaves about its square.
    let mut before = 1.0 / (1.0 + kappa.abs());
    for _ in 0..MAX_STEPS {
        let w = &mut panel.w;
        let (mut rate, mut slip, mut slope, mut push) = ([0.0; NODES], [0.0; NODES], [0.0; NODES], [0.0; NODES]);
        for j in 0..NODES {
            // theta v = e^z: the rate is a small difference where theta follows the velocity.
            let (inverse, excess) = (scale * exp(-w[j]), exp_m1(friction.scaled[j] + kappa * w[j]));
            rate[j] = -inverse * excess;
            slip[j] = inverse * (1.0 + excess);
            slope[j] = inverse * excess - kappa * slip[j];
            push[j] = -slip[j] * friction.by_alpha[j];
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
        // The next change, if it shrinks as this one did. Theta that has almost relaxed at the end needs more digits of `w`.
        let left = change * (change / before).clamp(QUADRATURE_FRACTION, 1.0);
        let stalls = change >= 0.25 * before && change <= tolerance;
        before = change;
        if stalls || left <= (0.1 * tolerance * tolerance).max(f64::EPSILON * largest(&panel)) {
            // Where theta follows friction, it carries its rounding.
            let mut rounding = largest(&panel);
            for j in 0..NODES {
                let size = friction.scaled[j].abs() + (kappa * panel.w[j]).abs();
                rounding += rule.w[j] * slip[j].abs() * size / (1.0 + slope[j].abs());
            }
            let error = (ERROR_FACTOR * (rule.unresolved(&panel.w) - f64::EPSILON * rounding)).max(0.0);
            let [slip, excess] = path.integrals(&panel, &friction, rule);
            let growth = exp(decay[NODES - 1]);
            return Some(SolvedPanel { panel, w_by_alpha: last, slip, excess, growth, error });
        }
    }
    None
}

/// Greatest magnitude of `w` on a panel.
#[inline(always)]
fn largest(panel: &FrictionPanel) -> f64 {
    panel.w.iter().fold(panel.start.abs(), |most, w| most.max(w.abs()))
}

/// Friction at the nodes of the panel between two distances from an end.
#[inline(always)]
fn node_friction(path: &FrictionPath, side: PathEnd, (from, to): (f64, f64), rule: &Radau) -> NodeFriction {
    let end_state = path.end_state(side);
    let mut friction = NodeFriction { scaled: [0.0; NODES], room: [0.0; NODES], by_alpha: [0.0; NODES] };
    for j in 0..NODES {
        let d = from * rule.rest[j] + to * rule.u[j];
        let exponent = path.exponent(end_state, d);
        friction.scaled[j] = -end_state.margin / path.a * exp_m1(exponent);
        friction.room[j] = end_state.margin / path.a * exp(exponent);
        friction.by_alpha[j] = -d * (1.0 - d) * friction.room[j];
    }
    friction
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

/// Initial guess of `w`: that of constant `theta v` where theta relaxes, constant `w` elsewhere.
#[inline(always)]
fn guess(path: &FrictionPath, (side, from): (PathEnd, f64), start: f64, scale: f64, scaled_friction: &Nodes) -> Nodes {
    let z = path.ln_theta_v(side, from, start);
    let decay = -scale * exp(-start) * (exp_m1(z) - path.kappa * exp(z));
    let before = z - path.kappa * start;
    if decay <= 1.0 { [start; NODES] } else { scaled_friction.map(|f| start - (f - before) / path.kappa) }
}
