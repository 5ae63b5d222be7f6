//! The velocity over the protocol, and the panels in which it is resolved.
//!
//! With `x = t/t_f`, `z = 1 - x`, `L = ln((v_f - 1)/(v_i - 1))` and `c = alpha_3 t_f^2` the velocity is `v = 1 + (v_f -
//! 1) exp(-z (L + c x))`: the exponent is a parabola, known before anything is computed. Places are distances from the
//! nearer end, so that layers much thinner than the rounding of `x` are seen.

use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::radau::{NODES, Nodes, Radau};

/// The velocity of one member.
#[derive(Debug, Clone, Copy)]
pub(super) struct Curve {
    /// `v_i - 1`.
    pub w_i: f64,
    /// `v_f - 1`.
    pub w_f: f64,
    /// `L`.
    pub l: f64,
    /// `c = alpha_3 t_f^2`.
    pub c: f64,
    pub t_f: f64,
    /// `ln(v_f - 1)`.
    ln_w_f: f64,
}

/// The end from which a place is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Side {
    Start,
    End,
}

/// A part of the protocol, from one distance to another in the order in which it is passed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Panel {
    pub side: Side,
    pub from: f64,
    pub to: f64,
}

/// Below `e^-QUIET` of the larger end (or of 1) the velocity is 1 in double precision, and so is what follows from it.
const QUIET: f64 = 45.0;

/// More panels than any case within the range of a double takes that is meant; the hardest take some hundreds.
pub(super) const MOST_PANELS: u32 = 10_000;

impl Curve {
    pub fn new(w_i: f64, w_f: f64, l: f64, t_f: f64) -> Curve {
        Curve { w_i, w_f, l, c: 0.0, t_f, ln_w_f: ln(w_f) }
    }

    /// The curve with another `c`.
    pub fn with(self, c: f64) -> Curve {
        Curve { c, ..self }
    }

    /// `ln((v - 1)/(v_f - 1))`.
    #[inline(always)]
    pub fn exponent(&self, x: f64, z: f64) -> f64 {
        -z * (self.l + self.c * x)
    }

    /// `x` and `z` at a distance from an end.
    #[inline(always)]
    pub fn place(side: Side, d: f64) -> (f64, f64) {
        match side {
            Side::Start => (d, 1.0 - d),
            Side::End => (1.0 - d, d),
        }
    }

    /// Slope of the exponent in `x`.
    #[inline(always)]
    pub fn slope(&self, x: f64, z: f64) -> f64 {
        self.l - self.c * (z - x)
    }

    /// `v - 1` at a distance from an end.
    pub fn surplus(&self, side: Side, d: f64) -> f64 {
        let (x, z) = Curve::place(side, d);
        self.w_f * exp(self.exponent(x, z))
    }

    /// `x` of the vertex of the parabola, if it lies inside.
    pub fn vertex(&self) -> Option<f64> {
        let x = 0.5 - 0.5 * self.l / self.c;
        (x > 0.0 && x < 1.0).then_some(x)
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

    /// `v - 1` at the nodes, and `v - v_f` with full relative accuracy where it is small.
    #[inline(always)]
    pub fn surpluses(&self, x: &Nodes, z: &Nodes) -> (Nodes, Nodes) {
        let mut e = [0.0; NODES];
        for j in 0..NODES {
            e[j] = self.exponent(x[j], z[j]);
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
    /// end. They meet at the bottom of a deep dip, else in the middle; what is quiet is a stretch of its own.
    pub fn stretches(&self) -> Stretches {
        let bottom = self.vertex().filter(|x| self.c > 0.0 && (0.25..=0.75).contains(x));
        let x = bottom.unwrap_or(0.5);
        let roof = self.roof();
        let depth = roof - QUIET;
        let quiet = self.c > 0.0 && self.level(x, 1.0 - x) < depth;
        let crossing = |rise: f64, slope: f64, end: f64| {
            // Nearer root of e0 + slope d + c d^2 = depth, written without cancellation; slope < 0.
            let fall = end - depth;
            let d = 2.0 * fall / (-slope + (slope * slope - 4.0 * self.c * fall).max(0.0).sqrt());
            if fall > 0.0 && d < rise { d } else { 0.0 }
        };
        let whole =
            |side, meeting| [Panel { side, from: 0.0, to: meeting }, Panel { side, from: meeting, to: meeting }];
        let parts = |side, meeting: f64, slope: f64, end: f64| {
            if !quiet {
                return whole(side, meeting);
            }
            let d = crossing(meeting, slope, end);
            [Panel { side, from: 0.0, to: d }, Panel { side, from: d, to: meeting }]
        };
        let [first, second] = parts(Side::Start, x, self.l - self.c, self.level(0.0, 1.0));
        let [fourth, third] = parts(Side::End, 1.0 - x, -(self.l + self.c), self.ln_w_f);
        Stretches { panels: [first, second, third.reversed(), fourth.reversed()] }
    }

    /// `ln(v - 1)`.
    fn level(&self, x: f64, z: f64) -> f64 {
        self.ln_w_f + self.exponent(x, z)
    }

    /// `ln(v - 1)` at the higher end, at most 0: what is far below does not count.
    fn roof(&self) -> f64 {
        self.ln_w_f.max(self.level(0.0, 1.0)).min(0.0)
    }

    /// The next panel of a stretch, from `d` on, over which the exponent varies by `reach`: by more where `v - 1` is so
    /// small that its relative error does not count.
    pub fn panel(&self, stretch: &Panel, d: f64, reach: f64) -> Panel {
        let Panel { side, to, .. } = *stretch;
        let (x, z) = Curve::place(side, d);
        let e = self.level(x, z) - self.roof();
        if e < -QUIET + 1.0 && self.level_at(side, to) - self.roof() < -QUIET + 1.0 && self.c > 0.0 {
            return Panel { side, from: d, to };
        }
        let along = if (side == Side::Start) == (to > d) { 1.0 } else { -1.0 };
        let slope = along * self.slope(x, z);
        // The interpolation error of NODES nodes goes like the NODESth power of the variation, times v - 1.
        let n = NODES as f64;
        let slack = (-e / n).max(0.0);
        let variation =
            if slope < 0.0 { reach * (1.0 + slack) } else { reach * ((1.0 + slack) / (1.0 + reach / n)).max(1.0) };
        let bend = self.c.abs();
        let h = 2.0 * variation / (slope.abs() + (slope * slope + 4.0 * bend * variation).sqrt());
        let left = (to - d).abs();
        Panel { side, from: d, to: if h >= left { to } else { d + h * (to - d) / left } }
    }

    fn level_at(&self, side: Side, d: f64) -> f64 {
        let (x, z) = Curve::place(side, d);
        self.level(x, z)
    }

    /// `v` at the end of a panel.
    pub fn last(&self, panel: &Panel) -> f64 {
        1.0 + self.surplus(panel.side, panel.to)
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

/// See [`Curve::stretches`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretches {
    panels: [Panel; 4],
}

impl Stretches {
    pub fn forward(&self) -> impl Iterator<Item = Panel> {
        self.panels.into_iter().filter(|panel| !panel.is_empty())
    }

    pub fn backward(&self) -> impl Iterator<Item = Panel> {
        self.panels.into_iter().rev().map(|panel| panel.reversed()).filter(|panel| !panel.is_empty())
    }
}
