//! One panel of a course: collocation of `w` at the Radau nodes.

use multiversion::multiversion;

use super::path::{FrictionPath, MILD, MOST_EXPONENT, Side};
use crate::numerics::elementary::{exp, exp_m1, ln_1p};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};

/// A panel with `w` at its start and nodes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Panel {
    /// Whether it was integrated forwards in time.
    pub forward: bool,
    pub side: Side,
    /// Distances from that end.
    pub from: f64,
    pub to: f64,
    pub start: f64,
    pub w: Nodes,
    /// `z = ln(theta v)` at the nodes, from the slope of `w` wherever that tells it better than friction does.
    pub z: Nodes,
    /// Whether it does at all nodes.
    pub follows: bool,
}

/// A panel solved.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub panel: Panel,
    /// Derivative of `w` by `alpha_3` at its end.
    pub turn: f64,
    /// Slip along it over the slip of steady sliding, `int v/v_0 dd`, and what the nodes lack of that.
    pub slid: f64,
    pub lack: f64,
    /// Rounding of `w` in units of the last place of 1: its own, and that of `z` as far as the slip passes it on.
    pub noise: f64,
    /// What a change of `w` at its start becomes at its end.
    pub growth: f64,
    /// An estimate of the error at its nodes.
    pub error: f64,
}

impl Panel {
    /// The place at a share `s` of the panel.
    pub fn place(&self, s: f64) -> f64 {
        self.from * (1.0 - s) + self.to * s
    }

    /// `w` there.
    pub fn level(&self, s: f64) -> f64 {
        radau().interpolate(self.start, &self.w, s)
    }

    /// `w` and `z` there.
    pub fn state(&self, path: &FrictionPath, s: f64) -> (f64, f64) {
        let w = self.level(s);
        let z = if self.follows { radau().follow(&self.z, s) } else { path.excess(self.side, self.place(s), w) };
        (w, z)
    }
}

/// Most steps of Newton's method on a panel.
const MOST_STEPS: usize = 10;

/// Share of the first change that quadrature may leave.
const INEXACT: f64 = 1e-3;

/// A change that shrinks no more below this, relative to what rounding makes of `w`, is rounding.
const STALLED: f64 = 100.0;

/// Greatest change of `w` that the guess for a panel may have.
const FARTHEST: f64 = 20.0;

/// The panel between two places of a side, from `w` and its derivative at the first, to `enough`; `None` where Newton's
/// method does not settle.
///
/// A step of Newton's method solves `delta = R + int slope delta dd`. Where the slope integrates to little, its
/// solution `R + int e^(S(d) - S(c)) slope R dc` needs no elimination; quadrature only makes the steps a little
/// inexact.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub(super) fn collocate(
    path: &FrictionPath,
    side: Side,
    (from, to): (f64, f64),
    [start, turn]: [f64; 2],
    enough: f64,
    rule: &Radau,
) -> Option<Found> {
    let anchor = path.anchor(side);
    let scale = (to - from).abs() * path.pace(anchor);
    let kappa = path.kappa;
    let (mut drive, mut lean, mut doubt) = ([0.0; NODES], [0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        let near = from * rule.rest[j] + to * rule.u[j];
        let e = path.exponent(anchor, near);
        drive[j] = path.drive(anchor, e);
        let distance = anchor.gap / path.a * exp(if e < MOST_EXPONENT { e } else { MOST_EXPONENT });
        lean[j] = -near * (1.0 - near) * distance;
        // The drive rounds, and so does its exponent.
        doubt[j] = drive[j].abs() + path.uncertainty(anchor, near) * distance;
    }
    let mut w = guess(path, side, from, start, scale, &drive, rule);
    let mut before = f64::INFINITY;
    for _ in 0..MOST_STEPS {
        let (mut rate, mut speed, mut slope, mut push) = ([0.0; NODES], [0.0; NODES], [0.0; NODES], [0.0; NODES]);
        let mut blur = [0.0; NODES];
        for j in 0..NODES {
            // theta v = e^z: the rate is a small difference wherever theta follows the velocity.
            let (inverse, excess) = (exp(-w[j]), exp_m1(drive[j] + kappa * w[j]));
            let v = inverse * (1.0 + excess);
            rate[j] = -scale * inverse * excess;
            speed[j] = scale.abs() * v;
            slope[j] = scale * inverse * (excess - kappa * (1.0 + excess));
            push[j] = -scale * v * lean[j];
            // Where theta relaxes, it forgets all but the last of what rounding makes of the drive.
            blur[j] = speed[j] * (doubt[j] + (kappa * w[j]).abs()) / (1.0 + slope[j].abs());
        }
        let sums = rule.integrals(&rate);
        let mut rest = [0.0; NODES];
        for j in 0..NODES {
            rest[j] = start - w[j] + sums[j];
        }
        let decay = rule.integrals(&slope);
        let mild = decay.iter().all(|s| s.abs() <= MILD);
        let (steps, last) = if mild {
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
            (steps, grow[NODES - 1] * (turn + rule.integrals(&pushed)[NODES - 1]))
        } else {
            let forced = rule.integrals(&push);
            let mut right: [[f64; 2]; NODES] = std::array::from_fn(|j| [rest[j], turn + forced[j]]);
            let mut matrix: [Nodes; NODES] = std::array::from_fn(|j| {
                std::array::from_fn(|k| f64::from(u8::from(j == k)) - rule.columns[k][j] * slope[k])
            });
            solve(&mut matrix, &mut right);
            (right.map(|pair| pair[0]), right[NODES - 1][1])
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
        let gain = if before.is_finite() { change / before } else { (1.0 + kappa.abs()) * change + INEXACT };
        let left = change * gain.min(1.0);
        let farthest = w.iter().fold(start.abs(), |most, w| most.max(w.abs()));
        let blurred: f64 = blur.iter().zip(&rule.w).map(|(blur, w)| blur * w).sum();
        let noise = farthest + blurred;
        let stalled = change <= STALLED * f64::EPSILON * noise && change >= 0.25 * before;
        before = change;
        if left <= enough || left <= f64::EPSILON * noise || stalled {
            let growth = exp(decay[NODES - 1]);
            let slid: f64 = speed.iter().zip(&rule.w).map(|(v, w)| v * w).sum();
            // What is left of them by rounding does not count.
            let count = (4 * NODES) as f64;
            let error = (count * rule.unresolved(&w) - count * f64::EPSILON * noise).max(0.0);
            let (z, follows, rounding) = excesses(&w, start, scale, kappa, (&drive, &doubt), rule);
            let mut uncertain = 0.0;
            for j in 0..NODES {
                speed[j] = scale.abs() * exp(z[j] - w[j]);
                uncertain += rule.w[j] * speed[j] * (1.0 + w[j].abs() + rounding[j]);
            }
            let lack = (rule.unresolved(&speed) - count * f64::EPSILON * uncertain).max(0.0);
            let panel = Panel { forward: path.forward, side, from, to, start, w, z, follows };
            return Some(Found { panel, turn: last, slid, lack, noise: 8.0 * noise, growth, error });
        }
    }
    None
}

/// `z` at the nodes, whether it is the slope of `w` that tells all of them, and their rounding.
///
/// `z = f + kappa w` is a small difference where theta follows the velocity; there `1 - e^z = theta'` is small, and the
/// slope of `w` tells it.
#[inline(always)]
fn excesses(
    w: &Nodes,
    start: f64,
    scale: f64,
    kappa: f64,
    (drive, doubt): (&Nodes, &Nodes),
    rule: &Radau,
) -> (Nodes, bool, Nodes) {
    let slopes = rule.slopes(&w.map(|w| w - start));
    let swing = w.iter().fold(0.0f64, |most, w| most.max((w - start).abs()));
    let (mut z, mut follows, mut rounding) = ([0.0; NODES], true, [0.0; NODES]);
    for j in 0..NODES {
        let gain = exp(w[j]) / scale;
        let told = slopes[j] * gain;
        let (by_friction, by_slope) = (doubt[j] + (kappa * w[j]).abs(), SLOPE_NOISE * swing * gain.abs());
        if by_slope < by_friction && told.abs() < 0.5 {
            (z[j], rounding[j]) = (ln_1p(-told), by_slope);
        } else {
            (z[j], rounding[j]) = (drive[j] + kappa * w[j], by_friction);
            follows = false;
        }
    }
    (z, follows, rounding)
}

/// Rounding of the slope of a polynomial through the nodes, in units of that of its values.
const SLOPE_NOISE: f64 = 300.0;

/// Where theta relaxes it comes to follow the drive, as `ln(theta v)` hardly changes; else it hardly changes itself.
#[inline(always)]
fn guess(path: &FrictionPath, side: Side, from: f64, start: f64, scale: f64, drive: &Nodes, rule: &Radau) -> Nodes {
    let anchor = path.anchor(side);
    let before = path.drive(anchor, path.exponent(anchor, from));
    let excess = exp_m1(before + path.kappa * start);
    let decay = -scale * exp(-start) * (excess - path.kappa * (1.0 + excess));
    if decay <= STILL {
        return [start; NODES];
    }
    // The slope relaxes from what it is to that of a drive that goes on evenly.
    let slope = -scale * exp(-start) * excess;
    let farthest = FARTHEST * path.kappa.abs();
    let mut w = [0.0; NODES];
    for j in 0..NODES {
        let followed = -(drive[j] - before).clamp(-farthest, farthest) / path.kappa;
        let passed = decay * rule.u[j];
        w[j] = start + followed - (slope * rule.u[j] - followed) * exp_m1(-passed) / passed;
    }
    w
}

/// Below this theta does not relax within a panel.
const STILL: f64 = 0.1;

/// Gaussian elimination with row pivots, two right-hand sides.
fn solve(matrix: &mut [Nodes; NODES], right: &mut [[f64; 2]; NODES]) {
    for k in 0..NODES {
        let mut pivot = k;
        for j in k + 1..NODES {
            if matrix[j][k].abs() > matrix[pivot][k].abs() {
                pivot = j;
            }
        }
        matrix.swap(k, pivot);
        right.swap(k, pivot);
        let (row, values) = (matrix[k], right[k]);
        let inverse = 1.0 / row[k];
        for j in k + 1..NODES {
            let factor = matrix[j][k] * inverse;
            for m in k..NODES {
                matrix[j][m] -= factor * row[m];
            }
            right[j][0] -= factor * values[0];
            right[j][1] -= factor * values[1];
        }
    }
    for k in (0..NODES).rev() {
        let inverse = 1.0 / matrix[k][k];
        let found = [right[k][0] * inverse, right[k][1] * inverse];
        right[k] = found;
        for j in 0..k {
            right[j][0] -= matrix[j][k] * found[0];
            right[j][1] -= matrix[j][k] * found[1];
        }
    }
}
