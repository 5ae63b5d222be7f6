//! How far theta is from its target at the end, as a function of `c`, and the root of it.
//!
//! With the slip that is left, `R(t) = int_t^t_f v dt`, the miss `g = v_f theta(t_f) - 1` is
//!
//! ```text
//! g = (v_f - v_i)/v_i e^-R(0) + int_0^t_f (v_f - v) e^-R dt
//! ```
//!
//! Its terms are small where the protocol is close to steady sliding at `v_f`, so the root keeps its digits where theta
//! merely follows `1/v`. Near `t_min` the root hangs on the little that theta loses to `v - 1`,
//!
//! ```text
//! P = int_0^t_f (v - 1) theta_0 e^-R dt = (1 - 1/v_f)(1 - e^-(t_f - t_min)),    theta_0 = 1 - (1 - 1/v_i) e^-t,
//! ```
//!
//! whose terms are all positive. Both are integrated backwards from `t_f`, until `e^-R` leaves nothing.

use multiversion::multiversion;

use super::curve::{Curve, MOST_PANELS, Panel};
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};
use crate::numerics::root::{Probe, newton};
use crate::protocol::Effort;

/// What does not change with `c`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Problem {
    pub v_i: f64,
    pub v_f: f64,
    pub curve: Curve,
    /// `t_f - t_min`, positive.
    pub spare: f64,
    /// Whether `t_f` is so close to `t_min` that the second form is the better one.
    pub tight: bool,
}

/// Integrals behind a place, in the direction from `t_f` to 0.
#[derive(Debug, Clone, Copy)]
struct Behind {
    /// `v` at the place.
    v: f64,
    /// Slip `int v dt` and its derivative `int x (1 - x)(v - 1) dt` with respect to `-c`.
    slip: f64,
    turn: f64,
    /// The integral of the form, and its derivative with respect to `c`.
    sum: f64,
    slope: f64,
}

impl Problem {
    /// `c` of the member that arrives, good to `rtol`.
    pub fn solve(&self, rtol: f64, reach: f64, effort: &mut Effort) -> Option<f64> {
        // How much slower theta is to end than along v = 1, as an exponent: ln(theta_0(t_f) v_f).
        let required = ln_1p(-self.curve.w_f * exp_m1(-self.spare));
        let free = (1.0 - self.curve.w_f * exp_m1(-self.spare)) / self.v_f;
        // Newton's step doubles the digits.
        let enough = (0.1 * rtol).sqrt();
        let probe = |c: f64| {
            let curve = self.curve.with(c);
            let behind = self.behind(&curve, rtol, reach, effort)?;
            let steep = c > 0.0;
            let step = if self.tight {
                let lost = -ln_1p(-behind.sum / free);
                let slope = -behind.slope / (free - behind.sum);
                let ratio = required / lost;
                if steep { (1.0 - 1.0 / ratio) * lost / slope } else { ln(ratio) * lost / slope }
            } else {
                let gain = ln_1p(behind.sum);
                let slope = behind.slope / (1.0 + behind.sum);
                let left = 1.0 - gain / required;
                if steep { gain * left / slope } else { -ln_1p(-gain / required) * required * left / slope }
            };
            // In units of the change that c bears.
            let scale = if c < 0.0 { 1.0 } else { c.abs() + self.curve.l.abs() };
            let scale = scale.min(c.abs() + self.curve.l.abs());
            Some(Probe { value: step / scale, slope: 1.0 / scale })
        };
        newton(probe, self.guess(required), (f64::NEG_INFINITY, f64::INFINITY), false, enough).map(|root| root.x)
    }

    /// A start for the search.
    fn guess(&self, required: f64) -> f64 {
        let Curve { w_i, w_f, l, t_f, .. } = self.curve;
        if self.tight {
            return 2.0 * t_f / self.spare;
        }
        // A bump of area `required`, by Laplace's method; the steady case has its vertex at the end.
        let excess = ln(required / (t_f * (w_i * w_f * std::f64::consts::PI).sqrt()));
        let mut y = (4.0 * excess).max(1.0);
        for _ in 0..3 {
            y = (4.0 * excess + 2.0 * ln(y) - l * l / y).max(1.0);
        }
        if y > l.abs() { -y } else { -l }
    }

    /// The integrals over the whole protocol; `None` where the velocity is so large that theta ends at 0,
    /// or numbers leave the range of a double.
    fn behind(&self, curve: &Curve, rtol: f64, reach: f64, effort: &mut Effort) -> Option<Behind> {
        let rule = radau();
        let mut behind = Behind { v: self.v_f, slip: 0.0, turn: 0.0, sum: 0.0, slope: 0.0 };
        let mut count = 0;
        effort.quadratures += 1;
        // Bounds on the integrals without e^-R.
        let most = 1.0 + self.v_f * curve.t_f + self.v_f / self.v_i;
        let scale = curve.c.abs() + curve.l.abs();
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
                    (most, behind.slope * scale)
                };
                if exp(-behind.slip) * left <= NOTHING * rtol * counts {
                    return Some(behind);
                }
                d = panel.to;
            }
        }
        if !self.tight {
            let start = (self.v_f - self.v_i) / self.v_i * exp(-behind.slip);
            behind.sum += start;
            behind.slope += start * behind.turn;
        }
        Some(behind)
    }

    /// Adds the part of one panel.
    #[inline(always)]
    fn add<const TIGHT: bool>(&self, curve: &Curve, panel: &Panel, rule: &Radau, behind: &mut Behind) {
        let (x, z) = Curve::places(panel, rule);
        let (w, excess) = curve.surpluses(&x, &z);
        let h = curve.t_f * (panel.to - panel.from).abs();
        let (mut v, mut xzw) = ([0.0; NODES], [0.0; NODES]);
        for j in 0..NODES {
            v[j] = h * (1.0 + w[j]);
            xzw[j] = x[j] * z[j] * w[j];
        }
        let slip = rule.integrals(&v);
        let turn = rule.integrals(&xzw);
        let (mut sum, mut slope) = ([0.0; NODES], [0.0; NODES]);
        for j in 0..NODES {
            let weight = h * rule.w[j] * exp(-(behind.slip + slip[j]));
            let q = behind.turn + h * turn[j];
            if TIGHT {
                let aged = (1.0 - (self.v_i - 1.0) * exp_m1(-curve.t_f * x[j])) / self.v_i;
                let part = weight * w[j] * aged;
                sum[j] = part;
                slope[j] = part * (q - x[j] * z[j]);
            } else {
                sum[j] = -weight * excess[j];
                slope[j] = weight * (xzw[j] - q * excess[j]);
            }
        }
        behind.v = 1.0 + w[NODES - 1];
        behind.slip += slip[NODES - 1];
        behind.turn += h * turn[NODES - 1];
        behind.sum += total(&sum);
        behind.slope += total(&slope);
    }
}

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
fn tight(problem: &Problem, curve: &Curve, panel: &Panel, rule: &Radau, behind: &mut Behind) {
    problem.add::<true>(curve, panel, rule, behind);
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn loose(problem: &Problem, curve: &Curve, panel: &Panel, rule: &Radau, behind: &mut Behind) {
    problem.add::<false>(curve, panel, rule, behind);
}
