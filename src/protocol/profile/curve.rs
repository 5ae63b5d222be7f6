//! The velocity over the protocol, and the panels in which it is resolved.
//!
//! Places are distances from the nearer end in units of the duration, so that layers much thinner than the rounding of
//! `x` are seen.

use super::Exponent;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::radau::{NODES, Nodes, Radau};

/// The velocity of one member.
#[derive(Debug, Clone, Copy)]
pub struct Curve<E> {
    /// What the velocity stays above: 1 or 0.
    pub floor: f64,
    /// `v_1 - floor`, at the end.
    pub w_f: f64,
    /// Duration.
    pub t_f: f64,
    pub exponent: E,
    /// `ln(v_1 - floor)`.
    ln_w_f: f64,
    /// Greatest level that counts as high.
    cap: f64,
}

/// The end from which a place is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Side {
    Start,
    End,
}

/// A part of the protocol, from one distance to another in the order in which it is passed.
#[derive(Debug, Clone, Copy)]
pub struct Panel {
    pub side: Side,
    pub from: f64,
    pub to: f64,
}

/// Below `e^-QUIET` of the larger end (or of 1) the velocity is 1 in double precision, and so is what follows from it.
const QUIET: f64 = 45.0;

/// More panels than any case within the range of a double takes that is meant; the hardest take some hundreds.
pub const MOST_PANELS: u32 = 10_000;

impl<E: Exponent> Curve<E> {
    /// The velocity that ends at `floor + w_f` after a time `t_f`.
    pub fn new(floor: f64, w_f: f64, t_f: f64, exponent: E) -> Curve<E> {
        // Where v - floor is small beside the floor, or moves theta by little, its relative error does not count.
        let cap = if floor > 0.0 { 0.0 } else { -ln(t_f) };
        Curve { floor, w_f, t_f, exponent, ln_w_f: ln(w_f), cap }
    }

    /// The curve resolved down to where `v - floor` is small beside a value.
    pub fn resolved_to(self, value: f64) -> Curve<E> {
        Curve { cap: self.cap.min(ln(value)), ..self }
    }

    /// The curve with another parameter.
    pub fn with(self, c: f64) -> Curve<E> {
        Curve { exponent: self.exponent.with(c), ..self }
    }

    /// `v - floor` at a distance from an end.
    pub fn surplus(&self, side: Side, d: f64) -> f64 {
        let (x, z) = place(side, d);
        self.w_f * exp(self.exponent.value(x, z))
    }

    /// `v - floor` at the nodes, and `v - v_1` with full relative accuracy where it is small.
    #[inline(always)]
    pub fn surpluses(&self, x: &Nodes, z: &Nodes) -> (Nodes, Nodes) {
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

    /// The stretches of the protocol in the order of time: first those measured from the start, then those from the
    /// end.
    pub fn stretches(&self) -> Stretches {
        self.exponent.stretches(self.ln_w_f, self.roof() - QUIET)
    }

    /// `ln(v - floor)`.
    fn level(&self, x: f64, z: f64) -> f64 {
        self.ln_w_f + self.exponent.value(x, z)
    }

    /// `ln(v - floor)` at the higher end, at most the cap: what is far below does not count.
    fn roof(&self) -> f64 {
        self.ln_w_f.max(self.level(0.0, 1.0)).min(self.cap)
    }

    /// The next panel of a stretch, from `d` on, over which the exponent varies by `reach`: by more where `v - floor`
    /// is so small that its relative error does not count.
    pub fn panel(&self, stretch: &Panel, d: f64, reach: f64) -> Panel {
        let Panel { side, to, .. } = *stretch;
        let (x, z) = place(side, d);
        let e = self.level(x, z) - self.roof();
        if e < -QUIET + 1.0 && self.level_at(side, to) - self.roof() < -QUIET + 1.0 && self.exponent.dips() {
            return Panel { side, from: d, to };
        }
        let along = if (side == Side::Start) == (to > d) { 1.0 } else { -1.0 };
        let slope = along * self.exponent.slope(x, z);
        // The interpolation error of NODES nodes goes like the NODESth power of the variation, times v - floor.
        let n = NODES as f64;
        let slack = (-e / n).max(0.0);
        let variation =
            if slope < 0.0 { reach * (1.0 + slack) } else { reach * ((1.0 + slack) / (1.0 + reach / n)).max(1.0) };
        let h = self.exponent.stride(x, z, variation);
        let left = (to - d).abs();
        Panel { side, from: d, to: if h >= left { to } else { d + h * (to - d) / left } }
    }

    fn level_at(&self, side: Side, d: f64) -> f64 {
        let (x, z) = place(side, d);
        self.level(x, z)
    }

    /// `v` at the end of a panel.
    pub fn last(&self, panel: &Panel) -> f64 {
        self.floor + self.surplus(panel.side, panel.to)
    }

    /// Duration of a panel times the greater velocity of its ends, `first` and `last`: at least its slip where v is
    /// monotone.
    pub fn stiffness(&self, panel: &Panel, first: f64, last: f64) -> f64 {
        self.t_f * (panel.to - panel.from).abs() * first.max(last)
    }

    /// The panel, cut so that its stiffness is about `reach` at most; `first` and `last` are the velocities at its
    /// ends.
    pub fn cut(&self, panel: Panel, first: f64, last: f64, reach: f64) -> Panel {
        if self.stiffness(&panel, first, last) <= reach {
            return panel;
        }
        let length = (panel.to - panel.from).abs();
        let mut h = reach / (self.t_f * first);
        if last > first {
            // h v(h) = h_0 v(0) with v exponential: the slip as a start, then Newton's step, which ends below.
            let rate = ln(last / first) / length;
            let slip = ln_1p(rate * h) / rate;
            h = slip * (1.0 - (ln(slip / h) + rate * slip) / (1.0 + rate * slip));
        }
        panel.shortened(h)
    }
}

/// `x` and `z` at a distance from an end.
#[inline(always)]
pub fn place(side: Side, d: f64) -> (f64, f64) {
    match side {
        Side::Start => (d, 1.0 - d),
        Side::End => (1.0 - d, d),
    }
}

/// `x` and `z` at the nodes of a panel.
#[inline(always)]
pub fn places(panel: &Panel, rule: &Radau) -> (Nodes, Nodes) {
    let (mut near, mut far) = ([0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        near[j] = panel.from * rule.rest[j] + panel.to * rule.u[j];
        far[j] = 1.0 - near[j];
    }
    match panel.side {
        Side::Start => (near, far),
        Side::End => (far, near),
    }
}

impl Panel {
    pub fn reversed(&self) -> Panel {
        Panel { side: self.side, from: self.to, to: self.from }
    }

    /// The panel, no longer than `most`.
    pub fn shortened(&self, most: f64) -> Panel {
        let length = (self.to - self.from).abs();
        if length <= most { *self } else { Panel { to: self.from + most * (self.to - self.from) / length, ..*self } }
    }

    pub fn is_empty(&self) -> bool {
        self.from == self.to
    }
}

/// The parts of a protocol in the order of time, some of them empty.
#[derive(Debug, Clone, Copy)]
pub struct Stretches {
    pub panels: [Panel; 4],
}

impl Stretches {
    pub fn forward(&self) -> impl Iterator<Item = Panel> {
        self.panels.into_iter().filter(|panel| !panel.is_empty())
    }

    pub fn backward(&self) -> impl Iterator<Item = Panel> {
        self.panels.into_iter().rev().map(|panel| panel.reversed()).filter(|panel| !panel.is_empty())
    }
}
