//! One panel of a course: collocation of `w` at the Radau nodes.

use multiversion::multiversion;

use super::course::{Course, MILD, MOST_EXPONENT, QUIET, Side};
use crate::numerics::elementary::{exp, exp_m1};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};

/// A panel with `w` at its start and nodes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Panel {
    pub side: Side,
    /// Distances from that end.
    pub from: f64,
    pub to: f64,
    pub start: f64,
    pub w: Nodes,
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
    /// Rounding of `w` in units of the last place of 1: its own, and that of `f` as far as the slip passes it on.
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
}

/// Most steps of Newton's method on a panel.
const MOST_STEPS: usize = 10;

/// A change that shrinks no more below this, relative to `w`, is rounding.
const STALLED: f64 = 1e-12;

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
    course: &Course,
    side: Side,
    (from, to): (f64, f64),
    [start, turn]: [f64; 2],
    enough: f64,
    rule: &Radau,
) -> Option<Found> {
    let anchor = course.anchor(side);
    let scale = (to - from).abs() * course.pace(anchor);
    let ratio = course.ratio;
    let (mut drive, mut lean) = ([0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        let near = from * rule.rest[j] + to * rule.u[j];
        let far = 1.0 - near;
        let e = course.exponent(anchor, near, far);
        drive[j] = course.drive(anchor, e);
        lean[j] = -anchor.gap / course.a * near * far * exp(if e < MOST_EXPONENT { e } else { MOST_EXPONENT });
    }
    let mut w = guess(course, side, from, start, scale, &drive);
    // A first step from a guess is taken to gain a digit.
    let mut before = 1.0;
    for _ in 0..MOST_STEPS {
        let (mut rate, mut speed, mut slope, mut push) = ([0.0; NODES], [0.0; NODES], [0.0; NODES], [0.0; NODES]);
        for j in 0..NODES {
            // theta v = e^z: the rate is a small difference wherever theta follows the velocity.
            let (inverse, excess) = (exp(-w[j]), exp_m1(drive[j] + (1.0 - ratio) * w[j]));
            let v = inverse * (1.0 + excess);
            rate[j] = -scale * inverse * excess;
            speed[j] = scale.abs() * v;
            slope[j] = scale * (ratio * v - inverse);
            push[j] = -scale * v * lean[j];
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
        let left = change * (change / before).min(1.0);
        let stalled = change <= STALLED * (1.0 + start.abs()) && change >= 0.25 * before;
        before = change;
        if left <= enough || stalled {
            let panel = Panel { side, from, to, start, w };
            let growth = exp(decay[NODES - 1]);
            let slid: f64 = speed.iter().zip(&rule.w).map(|(v, w)| v * w).sum();
            // What is left of them by rounding does not count.
            let farthest = w.iter().fold(0.0f64, |most, w| most.max(w.abs()));
            let rounding = (4 * NODES) as f64 * f64::EPSILON * (1.0 + farthest);
            let error = ((4 * NODES) as f64 * rule.unresolved(&w) - rounding).max(0.0);
            let deepest = drive.iter().fold(0.0f64, |most, f| most.max(f.abs())).min(QUIET);
            let lack = (rule.unresolved(&speed) - rounding * (1.0 + ratio + deepest) * slid).max(0.0);
            let passed = drive.iter().zip(&speed).fold(0.0f64, |most, (f, v)| most.max(4.0 * f.abs() * v.min(1.0)));
            let noise = rounding / f64::EPSILON + passed;
            return Some(Found { panel, turn: last, slid, lack, noise, growth, error });
        }
    }
    None
}

/// Where theta relaxes fast it follows the drive, as `ln(theta v)` hardly changes; else it hardly changes itself.
#[inline(always)]
fn guess(course: &Course, side: Side, from: f64, start: f64, scale: f64, drive: &Nodes) -> Nodes {
    let anchor = course.anchor(side);
    let before = course.drive(anchor, course.exponent(anchor, from, 1.0 - from));
    let stiff = (scale * (course.ratio * exp(before - course.ratio * start) - exp(-start))).abs();
    if stiff <= MILD {
        return [start; NODES];
    }
    let share = 1.0 / (course.ratio - 1.0);
    drive.map(|drive| start + ((drive - before) * share).clamp(-FARTHEST, FARTHEST))
}

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
