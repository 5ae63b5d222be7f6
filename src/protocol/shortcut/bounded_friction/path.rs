//! A member of the family for one `alpha_3`, and its integration in the direction in which theta contracts.
//!
//! The variable is `w = ln(theta/theta_0)` with `theta_0 = 1/v_0` at the nearer end:
//!
//! ```text
//! w' = v_0 (e^-w - v/v_0),    ln(v/v_0) = f - (b/a) w,    f = (tau - tau_0)/a.
//! ```
//!
//! Positions are distances `d` from the nearer end, in units of `t_f`. They resolve layers much thinner than the rounding
//! of `x`, and small changes keep their digits.

use std::cmp::Ordering;

use super::panel::{FrictionPanel, NodeFriction, SolvedPanel, collocate};
use crate::model::Transition;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};
use crate::protocol::SolverStats;
use crate::protocol::shortcut::Case;

/// End of the path from which a distance is measured, in the direction of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PathEnd {
    Start,
    End,
}

/// Halves of a path in the direction of integration: the nearer end, and the distances from it.
const HALVES: [(PathEnd, f64, f64); 2] = [(PathEnd::Start, 0.0, 0.5), (PathEnd::End, 0.5, 0.0)];

/// Quantities at an end.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndState {
    /// Velocity `v_0`, which is `1/theta_0`.
    pub v: f64,
    /// Friction.
    friction: f64,
    /// Margin `tau_M - tau`.
    pub margin: f64,
    /// Slope of `ln R^x` inwards.
    l: f64,
    /// `w` for theta at the other end.
    other: f64,
}

/// A member of the family for one `alpha_3`.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionPath {
    pub alpha: f64,
    pub forward: bool,
    pub t_f: f64,
    pub a: f64,
    /// Ratio `b/a`.
    pub ratio: f64,
    /// `1 - b/a`.
    pub kappa: f64,
    /// Size of `w`: the smaller of 1 and its change from end to end.
    size: f64,
    pub accelerates: bool,
    /// Time beyond the shortest one, that of `v = 0` or of `tau = tau_M`.
    pub spare: f64,
    /// The ends in the direction of integration.
    end_states: [EndState; 2],
}

/// Result of a pass along a path.
#[derive(Debug, Clone, Default)]
pub(super) struct Pass {
    pub panels: Vec<FrictionPanel>,
    /// `w` at the end: 0 if it arrives.
    pub w: f64,
    /// Derivative of `w` with respect to `alpha_3`.
    pub w_by_alpha: f64,
    /// Greatest derivative of `ln v` with respect to `alpha_3` on the path.
    pub max_ln_v_by_alpha: f64,
    /// The greatest of these over `1 + ln^2(theta v)` where slip is slow.
    pub max_visible_by_alpha: f64,
    /// The integral that is the spare time if the path arrives.
    excess: f64,
    /// Slip `int v dt`.
    slip: f64,
    /// Change of `w` for a change by 1 in every panel before, and the greatest such change of `ln v` on the path.
    errors: f64,
    pub max_errors: f64,
}

/// Spare time, fraction of that in which theta changes at the end, below which it determines `alpha_3`. Chosen: one digit.
const SPARE_TIME_FRACTION: f64 = 0.1;

/// Fall of `w` below both ends at which theta counts as 0. Chosen: `e^-25` is 1.4e-11, a seventh of the default `rtol`.
const MAX_LN_THETA_FALL: f64 = 25.0;

/// Exponent of `tau_M - tau`, at most: it stays within the range of a double. Chosen: `e^400` is 5e173.
const MAX_EXPONENT: f64 = 400.0;

/// Panels of one pass, at most. Chosen: far more than a path that arrives takes.
const MAX_PANELS: usize = 1000;

impl FrictionPath {
    pub fn new(case: &Case, margins: (f64, f64), ln_r: f64, log_ratio: f64, spare: f64) -> FrictionPath {
        let Transition { law, v_i, v_f } = case.transition;
        let end_state = |v: f64, margin: f64, l: f64, other: f64| EndState {
            v,
            friction: 1.0 + (law.a - law.b) * ln(v),
            margin,
            l,
            other,
        };
        let forward = law.b <= law.a;
        let ends = [end_state(v_i, margins.0, ln_r, log_ratio), end_state(v_f, margins.1, -ln_r, -log_ratio)];
        FrictionPath {
            alpha: 0.0,
            forward,
            t_f: case.t_f,
            a: law.a,
            ratio: law.b / law.a,
            kappa: (law.a - law.b) / law.a,
            size: if log_ratio == 0.0 { 1.0 } else { log_ratio.abs().min(1.0) },
            accelerates: v_f > v_i,
            spare,
            end_states: if forward { ends } else { [ends[1], ends[0]] },
        }
    }

    /// Scale of `alpha_3`: a change by it changes `ln v` by about a quarter.
    pub fn alpha_scale(&self) -> f64 {
        ln_1p(self.size * self.a / self.end_states[0].margin.max(self.end_states[1].margin))
    }

    /// The path integrated in the other direction.
    pub fn reversed(self) -> FrictionPath {
        let [first, last] = self.end_states;
        FrictionPath { forward: !self.forward, end_states: [last, first], ..self }
    }

    /// The path with another `alpha_3`.
    pub fn with(self, alpha: f64) -> FrictionPath {
        FrictionPath { alpha, ..self }
    }

    /// Quantities at an end.
    #[inline(always)]
    pub fn end_state(&self, side: PathEnd) -> &EndState {
        &self.end_states[side as usize]
    }

    /// Residual at the end, which rises with `alpha_3`, and its derivative.
    ///
    /// Where the time is almost the shortest, theta hardly depends on `alpha_3`, and the integral determines it.
    pub fn residual(&self, end: &Pass) -> (f64, f64) {
        let rise = if self.forward { 1.0 } else { -1.0 };
        if self.is_close() {
            let fall = if self.accelerates { 1.0 } else { -1.0 };
            (fall * ln(end.excess / self.spare), rise * self.time_per_w(end.w) * end.w_by_alpha / end.excess)
        } else {
            // Theta is the most linear: where it falls to 0, it does so on a line.
            (rise * exp_m1(end.w) / self.size, rise * exp(end.w) * end.w_by_alpha / self.size)
        }
    }

    /// Whether the integral determines `alpha_3` better than theta.
    fn is_close(&self) -> bool {
        self.spare < SPARE_TIME_FRACTION * self.time_per_w(0.0).min(self.t_f)
    }

    /// Change of the integral for a change of `w` by 1 at the end.
    fn time_per_w(&self, w: f64) -> f64 {
        let theta = exp(w) / self.end_states[1].v;
        if self.accelerates { theta / exp_m1(self.ln_theta_v_at_ceiling(PathEnd::End, w)) } else { theta }
    }

    /// `ln[(tau_M - tau)/margin]` with the margin of this end; the sum of `alpha_3` and `ln R` is exact where they cancel.
    #[inline(always)]
    pub fn exponent(&self, end_state: &EndState, d: f64) -> f64 {
        let exponent = d * ((end_state.l + self.alpha) - self.alpha * d);
        if exponent < MAX_EXPONENT { exponent } else { MAX_EXPONENT }
    }

    /// Friction at a distance from an end, within the range of a double.
    #[inline(always)]
    pub fn friction(&self, side: PathEnd, d: f64) -> f64 {
        let end_state = self.end_state(side);
        end_state.friction - end_state.margin * exp_m1(self.exponent(end_state, d))
    }

    /// `z = ln(theta v)` at a distance from an end, for this `w`.
    #[inline(always)]
    pub fn ln_theta_v(&self, side: PathEnd, d: f64, w: f64) -> f64 {
        let end_state = self.end_state(side);
        -end_state.margin / self.a * exp_m1(self.exponent(end_state, d)) + self.kappa * w
    }

    /// Velocity at a distance from an end, for this `w`.
    #[inline(always)]
    pub fn velocity(&self, side: PathEnd, d: f64, w: f64) -> f64 {
        self.end_state(side).v * exp(self.ln_theta_v(side, d, w) - w)
    }

    /// `ln(theta v)` at friction `tau_M`, at least that of both ends.
    #[inline(always)]
    fn ln_theta_v_at_ceiling(&self, side: PathEnd, w: f64) -> f64 {
        let [start, end] = self.end_states;
        (self.end_state(side).margin / self.a + self.kappa * w).max(start.margin.min(end.margin) / self.a)
    }

    /// Least and greatest friction: at the ends, or at the vertex of the parabola.
    pub fn friction_range(&self) -> (f64, f64) {
        let [start, end] = self.end_states;
        let vertex = 0.5 + 0.5 * start.l / self.alpha;
        let inside = vertex > 0.0 && vertex < 1.0;
        let inner = if inside { self.friction(PathEnd::Start, vertex) } else { start.friction };
        (start.friction.min(end.friction).min(inner), start.friction.max(end.friction).max(inner))
    }

    /// Rate of theta in units of `theta_0`, `v_0 t_f`; negative for backward integration.
    #[inline(always)]
    pub fn theta_rate(&self, end_state: &EndState) -> f64 {
        if self.forward { self.t_f * end_state.v } else { -self.t_f * end_state.v }
    }

    /// Slope of `ln v` in the direction of integration, for this `w`.
    pub fn ln_v_slope(&self, side: PathEnd, d: f64, w: f64) -> f64 {
        let end_state = self.end_state(side);
        let slope = end_state.l + self.alpha * (1.0 - 2.0 * d);
        let along = if side == PathEnd::Start { slope } else { -slope };
        let rate = -self.theta_rate(end_state) * exp(-w) * exp_m1(self.ln_theta_v(side, d, w));
        -end_state.margin * exp(self.exponent(end_state, d)) / self.a * along - self.ratio * rate
    }

    /// Slip over a panel, and its part of the integral that is the spare time if the path arrives, with their error estimates.
    #[inline(always)]
    pub fn integrals(&self, panel: &FrictionPanel, friction: &NodeFriction, rule: &Radau) -> [(f64, f64); 2] {
        let time = self.t_f * (panel.to - panel.from).abs();
        let (mut v, mut excess) = ([0.0; NODES], [0.0; NODES]);
        for j in 0..NODES {
            let w = panel.w[j];
            let theta_v = exp(friction.scaled[j] + self.kappa * w);
            v[j] = time * self.end_state(panel.side).v * theta_v * exp(-w);
            excess[j] = time * theta_v;
            if self.accelerates {
                let at_ceiling = self.ln_theta_v_at_ceiling(panel.side, w);
                // The rest is 0 but where the least ln(theta v) counts.
                let rest = at_ceiling - (self.end_state(panel.side).margin / self.a + self.kappa * w);
                excess[j] = time * exp_m1(-friction.room[j] - rest) / exp_m1(-at_ceiling);
            }
        }
        let integral = |values: &Nodes| {
            let sum: f64 = values.iter().zip(&rule.w).map(|(value, w)| value * w).sum();
            (sum, rule.unresolved(values))
        };
        [integral(&v), integral(&excess)]
    }

    /// Integrates along the path, every velocity to `accuracy`.
    ///
    /// # Errors
    ///
    /// `Less` where theta falls to 0 forwards or velocity overflows, as `alpha_3` is too small; `Greater` where theta falls to 0 backwards.
    pub fn pass(&self, accuracy: f64, stats: &mut SolverStats) -> Result<Pass, Ordering> {
        let mut pass = Pass::default();
        let mut h = self.first_panel();
        // A velocity carries the error of `ln theta` b/a times.
        let tolerance = accuracy * self.size / (1.0 + self.ratio);
        stats.quadratures += 1;
        for (side, from, to) in HALVES {
            let end_state = self.end_state(side);
            if side == PathEnd::End {
                pass.w += end_state.other;
            }
            let least = end_state.other.min(0.0) - MAX_LN_THETA_FALL;
            let mut d = from;
            while d != to {
                let left = (to - d).abs();
                let next = if 1.0001 * h >= left { to } else { d + h * (to - d).signum() };
                if next == d || pass.w < least || pass.panels.len() == MAX_PANELS {
                    let overflows = pass.w >= least && self.ln_theta_v(side, d, pass.w) > 0.0;
                    return Err(if overflows || self.forward { Ordering::Less } else { Ordering::Greater });
                }
                stats.nodes += NODES as u32;
                let start = [pass.w, pass.w_by_alpha];
                let Some(found) = collocate(self, side, (d, next), start, tolerance, radau()) else {
                    h *= 0.25;
                    continue;
                };
                let error = (found.error / tolerance).max(self.integration_error(&pass, &found) / accuracy);
                h = h.min(left) * (0.8 * root_of_order(1.0 / error.max(1e-20))).clamp(0.2, 5.0);
                if error <= 1.0 {
                    d = next;
                    self.add(&mut pass, found);
                }
            }
        }
        Ok(pass)
    }

    /// Error of the integrals over a panel, relative to those up to its end.
    fn integration_error(&self, pass: &Pass, found: &SolvedPanel) -> f64 {
        let slip = found.slip.1 / (pass.slip + found.slip.0);
        let excess = found.excess.1 / self.spare.max(pass.excess + found.excess.0);
        slip.max(excess)
    }

    /// Adds a panel.
    fn add(&self, pass: &mut Pass, SolvedPanel { panel, w_by_alpha, slip, excess, growth, .. }: SolvedPanel) {
        let (end_state, d) = (self.end_state(panel.side), panel.to);
        let by_friction = end_state.margin / self.a * d * (1.0 - d) * exp(self.exponent(end_state, d));
        (pass.w, pass.w_by_alpha) = (panel.w[NODES - 1], w_by_alpha);
        let ln_v_by_alpha = (by_friction + self.ratio * w_by_alpha).abs();
        // The rounding of a velocity of near nothing hardly counts.
        let ageing = self.ln_theta_v(panel.side, d, pass.w).min(0.0);
        pass.max_ln_v_by_alpha = pass.max_ln_v_by_alpha.max(ln_v_by_alpha);
        pass.max_visible_by_alpha = pass.max_visible_by_alpha.max(ln_v_by_alpha / (1.0 + ageing * ageing));
        pass.errors = 1.0 + growth * pass.errors;
        pass.max_errors = pass.max_errors.max((1.0 + self.ratio) * pass.errors);
        pass.slip += slip.0;
        pass.excess += excess.0;
        pass.panels.push(panel);
    }

    /// Length of the first panel, from the exponent and the rate of theta.
    fn first_panel(&self) -> f64 {
        let end_state = self.end_state(PathEnd::Start);
        let layer = (end_state.l.abs() + self.alpha.abs()) * (1.0 + end_state.margin / self.a);
        (2.0 / (layer + self.t_f * end_state.v + 1.0)).min(1.0)
    }
}

/// Growth of a panel for a growth `x` of its error: `x^(1/16)`, close to the root of the order.
fn root_of_order(x: f64) -> f64 {
    x.sqrt().sqrt().sqrt().sqrt()
}
