//! How far theta is from its target at the end, as a function of `c`, and the root of it.
//!
//! With the slip that is left, `R(t) = int_t^t_f v dt`, the miss `g = theta(t_f)/theta_1 - 1` is
//!
//! ```text
//! g = (theta_0/theta_1 - 1) e^-R(0) + int_0^t_f (1/theta_1 - v) e^-R dt
//! ```
//!
//! Between steady states its terms are small where the protocol is close to steady sliding at `v_f`, so the root keeps
//! its digits where theta merely follows `1/v`. Where theta loses little to `v - floor`, next to `t_min` above all, the root
//! hangs on that little,
//!
//! ```text
//! P = int_0^t_f (v - floor) theta_b e^-R dt = theta_b(t_f) - theta_1,
//! ```
//!
//! with `theta_b = 1 - (1 - theta_0) e^-t` for `floor = 1` and `theta_0 + t` for 0; all terms are positive. Both are
//! integrated backwards from `t_f`, until `e^-R` leaves nothing.

use multiversion::multiversion;

use super::Exponent;
use super::curve::{Curve, MOST_PANELS, Panel, places};
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};
use crate::numerics::root::{Probe, newton};
use crate::protocol::SolverStats;

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
    /// Whether theta loses so little to `v - floor` that the second form is the better one; it needs the next three.
    tight: bool,
    /// Theta at the start, and what it is short of 1.
    theta_0: f64,
    rest_0: f64,
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
            theta_0: 1.0 / v_i,
            rest_0: (v_i - 1.0) / v_i,
            free: (1.0 - gain) / v_f,
        }
    }

    /// From any theta to any other: `fall = theta_0/theta_1 - 1`, `pull = 1/theta_1 - v_1`, and `spare = theta_b -
    /// theta_1` with `theta_b` the contact lifetime at the end for `v = floor` throughout.
    pub fn between([theta_0, theta_1]: [f64; 2], fall: f64, pull: f64, spare: f64, curve: Curve<E>) -> Problem<E> {
        let v_1 = curve.floor + curve.w_f;
        Problem {
            curve,
            v_1,
            fall,
            pull,
            required: ln_1p(spare / theta_1),
            most: 1.0 + (1.0 + v_1 * theta_1) * curve.t_f / theta_1 + (1.0 + fall),
            tight: spare < theta_1,
            theta_0,
            rest_0: 1.0 - theta_0,
            free: theta_1 + spare,
        }
    }

    /// `theta_b` after a time.
    #[inline(always)]
    fn aged(&self, time: f64) -> f64 {
        self.theta_0 + if self.curve.floor > 0.0 { -self.rest_0 * exp_m1(-time) } else { time }
    }

    /// `c` of the member that arrives, good to `rtol`; the search begins at `start`.
    pub fn solve(&self, start: f64, rtol: f64, reach: f64, stats: &mut SolverStats) -> Option<f64> {
        let required = self.required;
        // Newton's step doubles the digits.
        let enough = (0.1 * rtol).sqrt();
        let probe = |c: f64| {
            let curve = self.curve.with(c);
            let behind = self.behind(&curve, rtol, reach, stats)?;
            // So fast that the rest of theta is a rounding error of the sum.
            let left = if self.tight { 1.0 - behind.sum / self.free } else { 1.0 + behind.sum };
            if left < LOST {
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
    fn behind(&self, curve: &Curve<E>, rtol: f64, reach: f64, stats: &mut SolverStats) -> Option<Behind> {
        let rule = radau();
        let mut behind = Behind { v: self.v_1, slip: 0.0, turn: 0.0, sum: 0.0, slope: 0.0 };
        let mut count = 0;
        stats.quadratures += 1;
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
                stats.nodes += NODES as u32;
                let (left, counts) = if self.tight {
                    tight(self, curve, &panel, rule, &mut behind);
                    (self.free, behind.sum)
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
                let part = weight * w[j] * self.aged(curve.t_f * x[j]);
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

/// Theta at the end, as a share of `theta_1` or of `theta_b`, below which its digits are lost.
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
