//! The velocity over the protocol, and the panels that resolve it.
//!
//! Positions are distances from the nearer end in units of the duration. They resolve layers much thinner than the
//! rounding of `x`.

use super::Exponent;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::radau::{NODES, Nodes, Radau};

/// Velocity of one member, `v = floor + w_f e^f`.
#[derive(Debug, Clone, Copy)]
pub struct VelocityCurve<E> {
    /// Lower bound of the velocity: 1 or 0.
    pub floor: f64,
    /// `v_1 - floor`, at the end.
    pub w_f: f64,
    /// Duration.
    pub t_f: f64,
    pub exponent: E,
    /// `ln(v_1 - floor)`.
    ln_w_f: f64,
    /// Greatest reference level of `ln(v - floor)`.
    max_level: f64,
}

/// End of the protocol from which a distance is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProtocolEnd {
    Start,
    End,
}

/// Quadrature panel: a range of distances from an end, in the order of integration.
#[derive(Debug, Clone, Copy)]
pub struct CurvePanel {
    pub side: ProtocolEnd,
    pub from: f64,
    pub to: f64,
}

/// Both halves of a protocol in the order of time, each measured from its end.
pub const HALVES: [CurvePanel; 2] = [
    CurvePanel { side: ProtocolEnd::Start, from: 0.0, to: 0.5 },
    CurvePanel { side: ProtocolEnd::End, from: 0.5, to: 0.0 },
];

impl<E: Exponent> VelocityCurve<E> {
    /// Velocity that ends at `floor + w_f` after a time `t_f`.
    pub fn new(floor: f64, w_f: f64, t_f: f64, exponent: E) -> VelocityCurve<E> {
        // The relative error of v - floor does not count where it is small compared with the floor, or changes theta little.
        let max_level = if floor > 0.0 { 0.0 } else { -ln(t_f) };
        VelocityCurve { floor, w_f, t_f, exponent, ln_w_f: ln(w_f), max_level }
    }

    /// The curve resolved down to where `v - floor` is small compared with `value`.
    pub fn resolved_to(self, value: f64) -> VelocityCurve<E> {
        VelocityCurve { max_level: self.max_level.min(ln(value)), ..self }
    }

    /// The curve with the parameter `c`.
    pub fn with(self, c: f64) -> VelocityCurve<E> {
        VelocityCurve { exponent: self.exponent.with(c), ..self }
    }

    /// `v - floor` at a distance from an end.
    pub fn above_floor(&self, side: ProtocolEnd, d: f64) -> f64 {
        let (x, z) = x_and_z(side, d);
        self.w_f * exp(self.exponent.value(x, z))
    }

    /// `v - floor` at the nodes, and `v - v_1` with full relative accuracy where it is small.
    #[inline(always)]
    pub fn above_floor_at_nodes(&self, x: &Nodes, z: &Nodes) -> (Nodes, Nodes) {
        let mut e = [0.0; NODES];
        for j in 0..NODES {
            e[j] = self.exponent.value(x[j], z[j]);
        }
        let (mut w, mut excess) = ([0.0; NODES], [0.0; NODES]);
        if e.iter().all(|e| e.abs() < 1.0) {
            for j in 0..NODES {
                excess[j] = self.w_f * exp_m1(e[j]);
                w[j] = self.w_f + excess[j];
            }
        } else {
            for j in 0..NODES {
                w[j] = self.w_f * exp(e[j]);
                excess[j] = w[j] - self.w_f;
            }
        }
        (w, excess)
    }

    /// `ln(v - floor)`.
    fn level(&self, x: f64, z: f64) -> f64 {
        self.ln_w_f + self.exponent.value(x, z)
    }

    /// `ln(v - floor)` at the higher end, at most `max_level`: values far below are negligible.
    fn reference_level(&self) -> f64 {
        self.ln_w_f.max(self.level(0.0, 1.0)).min(self.max_level)
    }

    /// Next panel of a range, from `d` on, over which the exponent varies by `panel_variation`, or by more where
    /// `v - floor` is so small that its relative error does not count.
    pub fn panel(&self, range: &CurvePanel, d: f64, panel_variation: f64) -> CurvePanel {
        let CurvePanel { side, to, .. } = *range;
        let (x, z) = x_and_z(side, d);
        let e = self.level(x, z) - self.reference_level();
        let along = if (side == ProtocolEnd::Start) == (to > d) { 1.0 } else { -1.0 };
        let slope = along * self.exponent.slope(x, z);
        // The interpolation error of NODES nodes is proportional to the NODESth power of the variation, times v - floor.
        let n = NODES as f64;
        let slack = (-e / n).max(0.0);
        let variation = if slope < 0.0 {
            panel_variation * (1.0 + slack)
        } else {
            panel_variation * ((1.0 + slack) / (1.0 + panel_variation / n)).max(1.0)
        };
        let h = self.exponent.distance_of_variation(x, z, variation);
        let left = (to - d).abs();
        CurvePanel { side, from: d, to: if h >= left { to } else { d + h * (to - d) / left } }
    }

    /// `v` at the end of a panel.
    pub fn last(&self, panel: &CurvePanel) -> f64 {
        self.floor + self.above_floor(panel.side, panel.to)
    }

    /// Duration of a panel times the greater velocity of its ends: an upper bound of its slip where `v` is monotone.
    pub fn stiffness(&self, panel: &CurvePanel, first: f64, last: f64) -> f64 {
        self.t_f * (panel.to - panel.from).abs() * first.max(last)
    }

    /// The panel, shortened so that its stiffness is about `panel_variation` at most; `first` and `last` are the
    /// velocities at its ends.
    pub fn limit_slip(&self, panel: CurvePanel, first: f64, last: f64, panel_variation: f64) -> CurvePanel {
        if self.stiffness(&panel, first, last) <= panel_variation {
            return panel;
        }
        let length = (panel.to - panel.from).abs();
        let mut h = panel_variation / (self.t_f * first);
        if last > first {
            // h v(h) = h_0 v(0) with v exponential: the slip as a start, then a Newton step, which ends below.
            let rate = ln(last / first) / length;
            let slip = ln_1p(rate * h) / rate;
            h = slip * (1.0 - (ln(slip / h) + rate * slip) / (1.0 + rate * slip));
        }
        panel.shortened(h)
    }
}

/// `x` and `z` at a distance from an end.
#[inline(always)]
pub fn x_and_z(side: ProtocolEnd, d: f64) -> (f64, f64) {
    match side {
        ProtocolEnd::Start => (d, 1.0 - d),
        ProtocolEnd::End => (1.0 - d, d),
    }
}

/// `x` and `z` at the nodes of a panel.
#[inline(always)]
pub fn x_and_z_at_nodes(panel: &CurvePanel, rule: &Radau) -> (Nodes, Nodes) {
    let (mut near, mut far) = ([0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        near[j] = panel.from * rule.rest[j] + panel.to * rule.u[j];
        far[j] = 1.0 - near[j];
    }
    match panel.side {
        ProtocolEnd::Start => (near, far),
        ProtocolEnd::End => (far, near),
    }
}

impl CurvePanel {
    pub fn reversed(&self) -> CurvePanel {
        CurvePanel { side: self.side, from: self.to, to: self.from }
    }

    /// The panel, shortened to `longest` if it is longer.
    pub fn shortened(&self, longest: f64) -> CurvePanel {
        let length = (self.to - self.from).abs();
        if length <= longest {
            *self
        } else {
            CurvePanel { to: self.from + longest * (self.to - self.from) / length, ..*self }
        }
    }
}
