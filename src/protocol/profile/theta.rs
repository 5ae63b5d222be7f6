//! Theta along a member, panel by panel in the order of time, with work and the range of friction.
//!
//! `theta' = 1 - theta v` contracts forwards. Where the slip of a panel is small, theta has a closed form with positive
//! terms. Where the slip is large, theta follows `1/v` and does not depend on its start: Radau collocation gives
//! `theta'` at the nodes.

use multiversion::multiversion;
use nalgebra::{SMatrix, SVector};

use super::arrival::total;
use super::curve::{CurvePanel, HALVES, ProtocolEnd, VelocityCurve, x_and_z, x_and_z_at_nodes};
use super::{Exponent, panel_variation};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};
use crate::numerics::{LONG_ROUNDING_RTOL, MAX_PANELS};
use crate::protocol::SolverStats;
use crate::protocol::control::{Tolerance, ValueRange};

/// Panel with theta at its start, and with `v` and theta at its nodes.
#[derive(Debug, Clone, Copy)]
pub struct ResolvedPanel {
    pub panel: CurvePanel,
    theta_start: f64,
    theta: Nodes,
    /// `theta'` at the start and at the nodes, accurate where it is small compared with 1.
    rate_start: f64,
    rate: Nodes,
    v: Nodes,
}

/// Work and range of friction along a member.
#[derive(Debug, Clone, Copy)]
pub struct WorkAndFriction {
    pub work: f64,
    pub friction: ValueRange,
}

impl WorkAndFriction {
    /// No work yet.
    pub const NONE: WorkAndFriction = WorkAndFriction { work: 0.0, friction: ValueRange::NONE };
}

/// State at the start of an integration.
#[derive(Debug, Clone, Copy)]
pub struct InitialState {
    /// Velocity.
    pub v: f64,
    /// State variable.
    pub theta: f64,
    /// `theta'`, accurate where it is small compared with 1.
    pub rate: f64,
}

impl InitialState {
    /// Steady sliding at `v`.
    pub fn steady(v: f64) -> InitialState {
        InitialState { v, theta: 1.0 / v, rate: 0.0 }
    }
}

/// Integrates theta along the curve, and hands every panel to `visit`; `None` where numbers leave the range of a double, and where theta does not
/// arrive at `theta_1`: a test of the root by an independent route.
pub fn integrate_theta<E: Exponent>(
    curve: &VelocityCurve<E>,
    (start, theta_1): (InitialState, f64),
    rtol: f64,
    stats: &mut SolverStats,
    mut visit: impl FnMut(&ResolvedPanel),
) -> Option<()> {
    let (rule, panel_variation) = (radau(), E::INTERPOLATION * panel_variation(rtol));
    let InitialState { mut v, mut theta, mut rate } = start;
    // Slip since theta last left the slow solution: at the start, or where v changes too fast.
    let mut slip = 0.0;
    let mut count = 0;
    stats.quadratures += 1;
    for range in HALVES {
        let mut d = range.from;
        while d != range.to {
            let mut panel = curve.panel(&range, d, panel_variation);
            if lag(curve, range.side, d, v) > MAX_LAG {
                slip = 0.0;
            }
            let forgotten = slip >= ln(1.0 / rtol) + 3.0;
            let last = curve.last(&panel);
            let stiff = forgotten && curve.stiffness(&panel, v, last) > panel_variation;
            panel = if stiff {
                curve.panel(&range, d, STIFF_VARIATION * panel_variation)
            } else {
                // Since theta' <= 1, a zero of theta lies at least theta back in time: ln theta is smooth on that scale.
                curve.limit_slip(panel, v, last, panel_variation).shortened(panel_variation * theta / curve.t_f)
            };
            if panel.to == d || panel.to.is_nan() || count == MAX_PANELS {
                return None;
            }
            count += 1;
            stats.nodes += NODES as u32;
            let (resolved, slipped) = resolve(curve, panel, [v, theta, rate], stiff, rule);
            visit(&resolved);
            v = resolved.v[NODES - 1];
            theta = resolved.theta[NODES - 1];
            rate = resolved.rate[NODES - 1];
            slip += slipped;
            d = panel.to;
        }
    }
    ((theta / theta_1 - 1.0).abs() <= 10.0 * rtol + LONG_ROUNDING_RTOL).then_some(())
}

/// Relative change of `v` in the relaxation time of theta: the relative distance of theta from `1/v` on the slow solution.
fn lag<E: Exponent>(curve: &VelocityCurve<E>, side: ProtocolEnd, d: f64, v: f64) -> f64 {
    let (x, z) = x_and_z(side, d);
    curve.exponent.slope(x, z).abs() * (v - curve.floor) / (v * v * curve.t_f)
}

/// Lag at which theta stays on the slow solution, at most. Chosen: the deviation is exponentially small in the inverse lag.
const MAX_LAG: f64 = 0.02;

/// Variation of the exponent over a panel with collocation, fraction of that with a closed form. Chosen: collocation needs shorter panels for the same accuracy.
const STIFF_VARIATION: f64 = 0.6;

/// `theta'` below which `1 - theta v` loses a digit or more. Derived: `1 - theta v` is `theta'`, and its terms are of size 1.
const MAX_CANCELLING_RATE: f64 = 0.1;

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn resolve<E: Exponent>(
    curve: &VelocityCurve<E>,
    panel: CurvePanel,
    start: [f64; 3],
    stiff: bool,
    rule: &Radau,
) -> (ResolvedPanel, f64) {
    let [v_start, theta_start, rate_start] = start;
    let (x, z) = x_and_z_at_nodes(&panel, rule);
    let (w, _) = curve.above_floor_at_nodes(&x, &z);
    let h = curve.t_f * (panel.to - panel.from).abs();
    let v = w.map(|w| curve.floor + w);
    let slip = rule.integrals(&v).map(|slip| h * slip);
    let (mut theta, mut rate) = ([0.0; NODES], [0.0; NODES]);
    if stiff {
        // v - v_start, with full relative accuracy where it is small.
        let level = |x: f64, z: f64| curve.exponent.value(x, z);
        let (x_0, z_0) = x_and_z(panel.side, panel.from);
        let before = level(x_0, z_0);
        let w_start = curve.w_f * exp(before);
        let mut gained = [0.0; NODES];
        for j in 0..NODES {
            let change = level(x[j], z[j]) - before;
            gained[j] = if change.abs() < 1.0 { w_start * exp_m1(change) } else { w[j] - w_start };
        }
        rate = collocate(rule, h, &v, &gained, v_start, rate_start);
        for j in 0..NODES {
            theta[j] = (1.0 - rate[j]) / v[j];
        }
    } else {
        let mut growth = [0.0; NODES];
        for j in 0..NODES {
            growth[j] = exp(slip[j]);
        }
        let gained = rule.integrals(&growth);
        for j in 0..NODES {
            theta[j] = (theta_start + h * gained[j]) / growth[j];
            rate[j] = 1.0 - theta[j] * v[j];
        }
        // Near steady sliding that difference cancels: theta'' = -v theta' - v' theta keeps its digits.
        if rate.iter().fold(rate_start.abs(), |most, rate| most.max(rate.abs())) < MAX_CANCELLING_RATE {
            let length = (panel.to - panel.from).abs();
            let mut loss = [0.0; NODES];
            for j in 0..NODES {
                loss[j] = growth[j] * theta[j] * w[j] * length * curve.exponent.slope(x[j], z[j]);
            }
            let lost = rule.integrals(&loss);
            for j in 0..NODES {
                rate[j] = (rate_start - lost[j]) / growth[j];
            }
        }
    }
    (ResolvedPanel { panel, theta_start, theta, rate_start, rate, v }, slip[NODES - 1])
}

/// `theta'` at the nodes of a panel of length `h`, from `rate/v + h A rate = 1/v - theta_start` divided by `h`. With
/// `gained = v - v_start` the right side keeps its digits for small changes.
#[inline(always)]
fn collocate(rule: &Radau, h: f64, v: &Nodes, gained: &Nodes, v_start: f64, rate_start: f64) -> Nodes {
    let matrix =
        SMatrix::<f64, NODES, NODES>::from_fn(|j, k| rule.columns[k][j] + if j == k { 1.0 / (h * v[j]) } else { 0.0 });
    let mut right = SVector::<f64, NODES>::from_fn(|j, _| (rate_start - gained[j] / v[j]) / (h * v_start));
    // The Radau matrix has its spectrum in the right half-plane, so the sum is regular.
    matrix.lu().solve_mut(&mut right);
    right.into()
}

impl ResolvedPanel {
    /// Duration of the panel.
    pub fn duration<E: Exponent>(&self, curve: &VelocityCurve<E>) -> f64 {
        curve.t_f * (self.panel.to - self.panel.from).abs()
    }

    /// `x` and `z` at the fraction `u` of the panel.
    #[inline(always)]
    pub fn x_and_z(&self, u: f64) -> (f64, f64) {
        x_and_z(self.panel.side, self.panel.from * (1.0 - u) + self.panel.to * u)
    }

    /// Theta at the fraction `u` of the panel.
    pub fn theta(&self, u: f64) -> f64 {
        radau().interpolate(Some(self.theta_start), &self.theta, u)
    }

    /// `theta'` at the fraction `u` of the panel.
    pub fn rate(&self, u: f64) -> f64 {
        radau().interpolate(Some(self.rate_start), &self.rate, u)
    }

    /// `theta''` at the start and at the nodes of a panel of this duration, as slopes of the interpolated `theta'`. The
    /// terms of `-theta' v - theta v'` cancel where theta follows `1/v`.
    pub fn theta_seconds(&self, duration: f64) -> (f64, Nodes) {
        let rule = radau();
        let gained = self.rate.map(|rate| rate - self.rate_start);
        (rule.slope_at_0(&gained) / duration, rule.slopes(&gained).map(|slope| slope / duration))
    }

    /// The nodes, as fractions of the panel, with theta and `theta'`.
    pub fn nodes(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        radau().u.into_iter().zip(self.theta).zip(self.rate).map(|((u, theta), rate)| (u, theta, rate))
    }

    /// Adds the work of the panel, and extends the range of friction, its extremes to `rtol` of the greater one.
    pub fn add_to<E: Exponent>(&self, law: &Law, curve: &VelocityCurve<E>, rtol: f64, totals: &mut WorkAndFriction) {
        let (friction, slope, power) = frictions(law, curve, self, radau());
        totals.work += self.duration(curve) * power;
        let at = |u: f64| {
            let (x, z) = self.x_and_z(u);
            let (v, theta) = (curve.floor + curve.w_f * exp(curve.exponent.value(x, z)), self.theta(u));
            [friction_at(law, v, theta), self.slope(law, curve, u, [v, theta, self.rate(u)])]
        };
        let mut before = (0.0, at(0.0));
        for ((u, friction), slope) in radau().u.into_iter().zip(friction).zip(slope) {
            let after = (u, [friction, slope]);
            totals.friction.add_interval(before, after, Tolerance::OfRange(rtol), &at);
            before = after;
        }
    }

    /// Slope of friction, `dtau/du = a v'/v + b theta'/theta`.
    #[inline(always)]
    fn slope<E: Exponent>(&self, law: &Law, curve: &VelocityCurve<E>, u: f64, [v, theta, rate]: [f64; 3]) -> f64 {
        let (x, z) = self.x_and_z(u);
        let length = (self.panel.to - self.panel.from).abs();
        length * (law.a * curve.exponent.slope(x, z) * (1.0 - curve.floor / v) + law.b * curve.t_f * rate / theta)
    }
}

/// Friction `tau = 1 + a ln v + b ln theta`.
#[inline(always)]
pub fn friction_at(law: &Law, v: f64, theta: f64) -> f64 {
    1.0 + law.a * ln(v) + law.b * ln(theta)
}

/// Friction and its slope at the nodes, and `int tau v du`.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn frictions<E: Exponent>(
    law: &Law,
    curve: &VelocityCurve<E>,
    resolved: &ResolvedPanel,
    rule: &Radau,
) -> (Nodes, Nodes, f64) {
    let ResolvedPanel { v, theta, rate, .. } = resolved;
    let (mut tau, mut slope, mut power) = ([0.0; NODES], [0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        tau[j] = friction_at(law, v[j], theta[j]);
        power[j] = rule.w[j] * tau[j] * v[j];
    }
    for j in 0..NODES {
        slope[j] = resolved.slope(law, curve, rule.u[j], [v[j], theta[j], rate[j]]);
    }
    (tau, slope, total(&power))
}
