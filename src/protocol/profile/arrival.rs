//! How far theta is from its target at the end, as a function of `c`, and the root of it.
//!
//! With the slip that is left, `R(t) = int_t^t_f v dt`, the miss `g = theta(t_f)/theta_1 - 1` is
//!
//! ```text
//! g = (theta_0/theta_1 - 1) e^-R(0) + int_0^t_f (1/theta_1 - v) e^-R dt
//! ```
//!
//! Between steady states its terms are small where the protocol is close to steady sliding at `v_f`, so the root keeps
//! its digits where theta merely follows `1/v`. Near `t_min` the root hangs on the little that theta loses to `v - 1`,
//!
//! ```text
//! P = int_0^t_f (v - 1) theta_b e^-R dt = (1 - 1/v_f)(1 - e^-(t_f - t_min)),    theta_b = 1 - (1 - 1/v_i) e^-t,
//! ```
//!
//! whose terms are all positive. Both are integrated backwards from `t_f`, until `e^-R` leaves nothing.

use multiversion::multiversion;

use super::Exponent;
use super::curve::{Curve, MOST_PANELS, Panel, places};
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};
use crate::numerics::root::{Probe, newton};
use crate::protocol::Effort;

/// What does not change with `c`.
#[derive(Debug, Clone, Copy)]
pub struct Problem<E> {
    curve: Curve<E>,
    /// `v` at the end.
    v_1: f64,
    /// `theta_0/theta_1 - 1`.
    fall: f64,
    /// `1/theta_1 - v_1`.
    pull: f64,
    /// `ln(theta_b/theta_1)` at the end, with `theta_b` the contact lifetime for `v = floor` throughout: positive.
    pub required: f64,
    /// A bound on the integral without `e^-R`.
    most: f64,
    /// Whether `t_f` is so close to `t_min` that the second form is the better one; it needs the next two.
    tight: bool,
    v_i: f64,
    /// `theta_b` at the end.
    free: f64,
}

/// Integrals behind a place, in the direction from `t_f` to 0.
#[derive(Debug, Clone, Copy)]
struct Behind {
    /// `v` at the place.
    v: f64,
    /// Slip `int v dt` and its derivative with respect to `-c`.
    slip: f64,
    turn: f64,
    /// The integral of the form, and its derivative with respect to `c`.
    sum: f64,
    slope: f64,
}

impl<E: Exponent> Problem<E> {
    /// From steady sliding at `v_i` to steady sliding at `v_f`, with `v > 1`; `spare` is `t_f - t_min`, positive.
    pub fn steady(v_i: f64, v_f: f64, curve: Curve<E>, spare: f64, tight: bool) -> Problem<E> {
        let gain = curve.w_f * exp_m1(-spare);
        Problem {
            curve,
            v_1: v_f,
            fall: (v_f - v_i) / v_i,
            pull: 0.0,
            required: ln_1p(-gain),
            most: 1.0 + v_f * curve.t_f + v_f / v_i,
            tight,
            v_i,
            free: (1.0 - gain) / v_f,
        }
    }

    /// From any theta to any other: `fall = theta_0/theta_1 - 1`, `pull = 1/theta_1 - v_1`, and `room =
    /// ln(theta_b/theta_1)` with `theta_b` the contact lifetime at the end for `v = floor` throughout.
    pub fn between(theta_1: f64, fall: f64, pull: f64, room: f64, curve: Curve<E>) -> Problem<E> {
        let v_1 = curve.floor + curve.w_f;
        let most = 1.0 + (1.0 + v_1 * theta_1) * curve.t_f / theta_1 + (1.0 + fall);
        Problem { curve, v_1, fall, pull, required: room, most, tight: false, v_i: v_1, free: 1.0 }
    }

    /// `c` of the member that arrives, good to `rtol`; the search begins at `start`.
    pub fn solve(&self, start: f64, rtol: f64, reach: f64, effort: &mut Effort) -> Option<f64> {
        let required = self.required;
        // Newton's step doubles the digits.
        let enough = (0.1 * rtol).sqrt();
        let probe = |c: f64| {
            let curve = self.curve.with(c);
            let behind = self.behind(&curve, rtol, reach, effort)?;
            // So fast that the rest of theta is a rounding error of the sum.
            if !self.tight && 1.0 + behind.sum < LOST {
                return None;
            }
            let steep = c > 0.0;
            let step = if self.tight {
                let lost = -ln_1p(-behind.sum / self.free);
                let slope = -behind.slope / (self.free - behind.sum);
                let ratio = required / lost;
                if steep { E::settle(ratio) * lost / slope } else { ln(ratio) * lost / slope }
            } else {
                let gain = ln_1p(behind.sum);
                let slope = behind.slope / (1.0 + behind.sum);
                let left = 1.0 - gain / required;
                if steep { gain * left / slope } else { -ln_1p(-gain / required) * required * left / slope }
            };
            let scale = curve.exponent.unit();
            Some(Probe { value: step / scale, slope: 1.0 / scale })
        };
        newton(probe, start, (f64::NEG_INFINITY, f64::INFINITY), false, enough).map(|root| root.x)
    }

    /// The integrals over the whole protocol; `None` where the velocity is so large that theta ends at 0,
    /// or numbers leave the range of a double.
    fn behind(&self, curve: &Curve<E>, rtol: f64, reach: f64, effort: &mut Effort) -> Option<Behind> {
        let rule = radau();
        let mut behind = Behind { v: self.v_1, slip: 0.0, turn: 0.0, sum: 0.0, slope: 0.0 };
        let mut count = 0;
        effort.quadratures += 1;
        let scale = curve.exponent.size();
        for stretch in curve.stretches().backward() {
            let mut d = stretch.from;
            while d != stretch.to {
                let panel = curve.panel(&stretch, d, reach);
                let panel = curve.cut(panel, behind.v, curve.last(&panel), reach);
                let sound = panel.to != d && !panel.to.is_nan() && behind.slip <= MOST_SLIP;
                if !sound || count == MOST_PANELS {
                    return None;
                }
                count += 1;
                effort.nodes += NODES as u32;
                let (left, counts) = if self.tight {
                    tight(self, curve, &panel, rule, &mut behind);
                    (1.0, behind.sum)
                } else {
                    loose(self, curve, &panel, rule, &mut behind);
                    (self.most, behind.slope * scale)
                };
                if exp(-behind.slip) * left <= NOTHING * rtol * counts {
                    return Some(behind);
                }
                d = panel.to;
            }
        }
        if !self.tight {
            let start = self.fall * exp(-behind.slip);
            behind.sum += start;
            behind.slope += start * behind.turn;
        }
        Some(behind)
    }

    /// Adds the part of one panel.
    #[inline(always)]
    fn add<const TIGHT: bool>(&self, curve: &Curve<E>, panel: &Panel, rule: &Radau, behind: &mut Behind) {
        let (x, z) = places(panel, rule);
        let (w, excess) = curve.surpluses(&x, &z);
        let h = curve.t_f * (panel.to - panel.from).abs();
        let (mut v, mut lean) = ([0.0; NODES], [0.0; NODES]);
        for j in 0..NODES {
            v[j] = h * (curve.floor + w[j]);
            lean[j] = E::lean(x[j], z[j]) * w[j];
        }
        let slip = rule.integrals(&v);
        let turn = rule.integrals(&lean);
        let (mut sum, mut slope) = ([0.0; NODES], [0.0; NODES]);
        for j in 0..NODES {
            let weight = h * rule.w[j] * exp(-(behind.slip + slip[j]));
            let q = behind.turn + h * turn[j];
            if TIGHT {
                let aged = (1.0 - (self.v_i - 1.0) * exp_m1(-curve.t_f * x[j])) / self.v_i;
                let part = weight * w[j] * aged;
                sum[j] = part;
                slope[j] = part * (q - E::lean(x[j], z[j]));
            } else {
                let missing = self.pull - excess[j];
                sum[j] = weight * missing;
                slope[j] = weight * (lean[j] + q * missing);
            }
        }
        behind.v = curve.floor + w[NODES - 1];
        behind.slip += slip[NODES - 1];
        behind.turn += h * turn[NODES - 1];
        behind.sum += total(&sum);
        behind.slope += total(&slope);
    }
}

/// `theta(t_f)/theta_1` below which its digits are lost.
const LOST: f64 = 1e-6;

/// What is left behind a slip that ends the integration, in units of the accuracy.
const NOTHING: f64 = 1e-3;

/// No slip that is left over is larger: `theta(t_f) >= e^-R/v_i` is above 1e-308.
const MOST_SLIP: f64 = 700.0;

/// The sum over the nodes, in one fixed order.
#[inline(always)]
pub(super) fn total(values: &Nodes) -> f64 {
    let mut sum = *values;
    let mut width = NODES / 2;
    while width > 0 {
        for j in 0..width {
            sum[j] += sum[j + width];
        }
        width /= 2;
    }
    sum[0]
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn tight<E: Exponent>(problem: &Problem<E>, curve: &Curve<E>, panel: &Panel, rule: &Radau, behind: &mut Behind) {
    problem.add::<true>(curve, panel, rule, behind);
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn loose<E: Exponent>(problem: &Problem<E>, curve: &Curve<E>, panel: &Panel, rule: &Radau, behind: &mut Behind) {
    problem.add::<false>(curve, panel, rule, behind);
}
