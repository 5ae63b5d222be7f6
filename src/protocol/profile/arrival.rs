//! The residual of theta at the end as a function of `c`, and its root.
//!
//! With the remaining slip `R(t) = int_t^t_f v dt`, the residual `g = theta(t_f)/theta_1 - 1` is
//!
//! ```text
//! g = (theta_0/theta_1 - 1) e^-R(0) + int_0^t_f (1/theta_1 - v) e^-R dt
//! ```
//!
//! Between steady states its terms are small where the protocol is close to steady sliding at `v_f`, so the root keeps
//! its digits where theta follows `1/v`. Where `v - floor` reduces theta little, as near `t_min`, the root depends on
//! this loss,
//!
//! ```text
//! P = int_0^t_f (v - floor) theta_b e^-R dt = theta_b(t_f) - theta_1,
//! ```
//!
//! with `theta_b = 1 - (1 - theta_0) e^-t` for `floor = 1` and `theta_0 + t` for 0; all terms are positive. Both are
//! integrated backwards from `t_f`, until `e^-R` is negligible.

use multiversion::multiversion;

use super::curve::{CurvePanel, HALVES, VelocityCurve, x_and_z_at_nodes};
use super::{Exponent, panel_variation};
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};
use crate::numerics::root::{Probe, newton};
use crate::numerics::{MAX_LN, MAX_PANELS};
use crate::protocol::SolverStats;

/// The equation for `c`: quantities that do not depend on it.
#[derive(Debug, Clone, Copy)]
pub struct ArrivalProblem<E> {
    curve: VelocityCurve<E>,
    /// `v` at the end.
    v_1: f64,
    /// `theta_0/theta_1 - 1`.
    fall: f64,
    /// `1/theta_1 - v_1`.
    pull: f64,
    /// `ln(theta_b/theta_1)` at the end, with `theta_b` the state variable for `v = floor` throughout: positive.
    pub required: f64,
    /// Upper bound of the integral without `e^-R`.
    max_integral: f64,
    /// Whether the loss `P` is the equation; it needs the next three.
    by_loss: bool,
    /// Theta at the start, and 1 less theta.
    theta_0: f64,
    rest_0: f64,
    /// `theta_b` at the end.
    free: f64,
}

/// Integrals from `t_f` back to a position.
#[derive(Debug, Clone, Copy)]
struct BackwardIntegrals {
    /// Velocity there.
    v: f64,
    /// Slip `int v dt`, and minus its derivative with respect to `c`.
    slip: f64,
    slip_by_c: f64,
    /// Integral of the equation, and its derivative with respect to `c`.
    sum: f64,
    slope: f64,
}

impl<E: Exponent> ArrivalProblem<E> {
    /// From steady sliding at `v_i` to steady sliding at `v_f`, with `v > 1`; `spare` is `t_f - t_min`, positive.
    pub fn steady(v_i: f64, v_f: f64, curve: VelocityCurve<E>, spare: f64, by_loss: bool) -> ArrivalProblem<E> {
        let gain = curve.w_f * exp_m1(-spare);
        ArrivalProblem {
            curve,
            v_1: v_f,
            fall: (v_f - v_i) / v_i,
            pull: 0.0,
            required: ln_1p(-gain),
            max_integral: 1.0 + v_f * curve.t_f + v_f / v_i,
            by_loss,
            theta_0: 1.0 / v_i,
            rest_0: (v_i - 1.0) / v_i,
            free: (1.0 - gain) / v_f,
        }
    }

    /// From `theta_0` to `theta_1`: `fall = theta_0/theta_1 - 1`, `pull = 1/theta_1 - v_1`, and `spare = theta_b -
    /// theta_1` with `theta_b` the state variable at the end for `v = floor` throughout.
    pub fn between(
        [theta_0, theta_1]: [f64; 2],
        fall: f64,
        pull: f64,
        spare: f64,
        curve: VelocityCurve<E>,
    ) -> ArrivalProblem<E> {
        let v_1 = curve.floor + curve.w_f;
        ArrivalProblem {
            curve,
            v_1,
            fall,
            pull,
            required: ln_1p(spare / theta_1),
            max_integral: 1.0 + (1.0 + v_1 * theta_1) * curve.t_f / theta_1 + (1.0 + fall),
            by_loss: spare < theta_1,
            theta_0,
            rest_0: 1.0 - theta_0,
            free: theta_1 + spare,
        }
    }

    /// State variable `theta_b` after a time.
    #[inline(always)]
    fn aged(&self, time: f64) -> f64 {
        self.theta_0 + if self.curve.floor > 0.0 { -self.rest_0 * exp_m1(-time) } else { time }
    }

    /// Parameter `c` of the member that arrives, to `rtol`; the search begins at `start`. `None` where it fails.
    pub fn solve(&self, start: f64, rtol: f64, stats: &mut SolverStats) -> Option<f64> {
        let (required, panel_variation) = (self.required, panel_variation(rtol));
        // The last Newton step doubles the digits.
        let enough = (0.1 * rtol).sqrt();
        let probe = |c: f64| {
            let curve = self.curve.with(c);
            let sums = self.backward_integrals(&curve, rtol, panel_variation, stats)?;
            // So fast that theta at the end is a rounding error of the sum.
            let left = if self.by_loss { 1.0 - sums.sum / self.free } else { 1.0 + sums.sum };
            if left < MIN_THETA_FRACTION {
                return None;
            }
            let steep = c > 0.0;
            let step = if self.by_loss {
                let lost = -ln_1p(-sums.sum / self.free);
                let slope = -sums.slope / (self.free - sums.sum);
                let ratio = required / lost;
                if steep { E::newton_step(ratio) * lost / slope } else { ln(ratio) * lost / slope }
            } else {
                let gain = ln_1p(sums.sum);
                let slope = sums.slope / (1.0 + sums.sum);
                let left = 1.0 - gain / required;
                if steep { gain * left / slope } else { -ln_1p(-gain / required) * required * left / slope }
            };
            let scale = curve.exponent.parameter_scale();
            Some(Probe { value: step / scale, slope: 1.0 / scale })
        };
        newton(probe, start, (f64::NEG_INFINITY, f64::INFINITY), false, enough).map(|root| root.x)
    }

    /// Integrals over the whole protocol; `None` where the velocity is so large that theta ends at 0, or numbers leave
    /// the range of a double.
    fn backward_integrals(
        &self,
        curve: &VelocityCurve<E>,
        rtol: f64,
        panel_variation: f64,
        stats: &mut SolverStats,
    ) -> Option<BackwardIntegrals> {
        let rule = radau();
        let mut sums = BackwardIntegrals { v: self.v_1, slip: 0.0, slip_by_c: 0.0, sum: 0.0, slope: 0.0 };
        let mut count = 0;
        stats.quadratures += 1;
        let scale = curve.exponent.size();
        for range in HALVES.map(|half| half.reversed()).into_iter().rev() {
            let mut d = range.from;
            while d != range.to {
                let panel = curve.panel(&range, d, panel_variation);
                let panel = curve.limit_slip(panel, sums.v, curve.last(&panel), panel_variation);
                let sound = panel.to != d && !panel.to.is_nan() && sums.slip <= MAX_LN;
                if !sound || count == MAX_PANELS {
                    return None;
                }
                count += 1;
                stats.nodes += NODES as u32;
                add(self, curve, &panel, rule, &mut sums);
                let (left, counts) =
                    if self.by_loss { (self.free, sums.sum) } else { (self.max_integral, sums.slope * scale) };
                if exp(-sums.slip) * left <= NEGLIGIBLE_REST * rtol * counts {
                    return Some(sums);
                }
                d = panel.to;
            }
        }
        if !self.by_loss {
            let start = self.fall * exp(-sums.slip);
            sums.sum += start;
            sums.slope += start * sums.slip_by_c;
        }
        Some(sums)
    }
}

/// Theta at the end, fraction of `theta_1` or of `theta_b`, at least. Chosen: six digits are lost there.
const MIN_THETA_FRACTION: f64 = 1e-6;

/// Bound of the remaining integral that ends the integration, in units of the tolerance. Chosen: a thousandth of it does not count among the other errors.
const NEGLIGIBLE_REST: f64 = 1e-3;

/// Sum over the nodes, in one fixed order.
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

/// Adds the integrals over one panel.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn add<E: Exponent>(
    problem: &ArrivalProblem<E>,
    curve: &VelocityCurve<E>,
    panel: &CurvePanel,
    rule: &Radau,
    sums: &mut BackwardIntegrals,
) {
    let (x, z) = x_and_z_at_nodes(panel, rule);
    let (w, excess) = curve.above_floor_at_nodes(&x, &z);
    let h = curve.t_f * (panel.to - panel.from).abs();
    let (mut v, mut sensitivity) = ([0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        v[j] = h * (curve.floor + w[j]);
        sensitivity[j] = E::sensitivity(x[j], z[j]) * w[j];
    }
    let slip = rule.integrals(&v);
    let slip_by_c = rule.integrals(&sensitivity);
    let (mut weight, mut q) = ([0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        weight[j] = h * rule.w[j] * exp(-(sums.slip + slip[j]));
        q[j] = sums.slip_by_c + h * slip_by_c[j];
    }
    let (mut sum, mut slope) = ([0.0; NODES], [0.0; NODES]);
    if problem.by_loss {
        for j in 0..NODES {
            sum[j] = weight[j] * w[j] * problem.aged(curve.t_f * x[j]);
            slope[j] = sum[j] * (q[j] - E::sensitivity(x[j], z[j]));
        }
    } else {
        for j in 0..NODES {
            let missing = problem.pull - excess[j];
            sum[j] = weight[j] * missing;
            slope[j] = weight[j] * (sensitivity[j] + q[j] * missing);
        }
    }
    sums.v = curve.floor + w[NODES - 1];
    sums.slip += slip[NODES - 1];
    sums.slip_by_c += h * slip_by_c[NODES - 1];
    sums.sum += total(&sum);
    sums.slope += total(&slope);
}
