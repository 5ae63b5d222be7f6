//! The ceilings: where they lie, and arcs on them.
//!
//! Both ceilings bound `z = ln u`: at `theta = theta_1 e^y` the velocity allows `z_v + y` and friction `z_tau + kappa y`,
//! `kappa = 1 - b/a` (docs/derivations.md, "Ceilings").

use super::clamp::Gap;
use super::lifetime::Lifetime;
use super::{ArcKind, Bounds};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_and_m1, exp_m1, ln, ln_1p};
use crate::numerics::gauss::rule;

/// The ceilings of a problem that ends in steady sliding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ceilings {
    pub law: Law,
    /// Ceiling of the velocity; infinite for none.
    pub v: f64,
    /// Ceiling of friction; infinite for none.
    pub tau: f64,
    /// `ln u` at `theta_1` on the ceiling of the velocity.
    pub z_v: f64,
    /// `ln u` at `theta_1` on the ceiling of friction.
    pub z_tau: f64,
    /// `1 - b/a`.
    pub kappa: f64,
}

impl Ceilings {
    /// The ceilings over the lifetime `to` of steady sliding at `v_f`. Only differences to the ceilings enter.
    pub fn new(law: Law, to: Lifetime, v_f: f64, bounds: &Bounds) -> Ceilings {
        let &Bounds { v_ceiling: v, tau_ceiling: tau, .. } = bounds;
        Ceilings {
            law,
            v,
            tau,
            z_v: ln_ratio(v, v - v_f, v_f),
            z_tau: ((tau - 1.0) - (law.b - law.a) * to.ln) / law.a,
            kappa: (law.a - law.b) / law.a,
        }
    }

    /// The largest `ln u` at `y`.
    pub fn cap(&self, y: f64) -> f64 {
        (self.z_v + y).min(self.z_tau + self.kappa * y)
    }

    /// `ln u` on one of the ceilings.
    pub fn cap_of(&self, kind: ArcKind, y: f64) -> f64 {
        if kind == ArcKind::VCeiling { self.z_v + y } else { self.z_tau + self.kappa * y }
    }

    /// Below this `y` the velocity binds before friction.
    pub fn crossing(&self) -> f64 {
        let gap = self.z_tau - self.z_v;
        let Law { a, b } = self.law;
        if b == 0.0 || gap.is_infinite() || gap.is_nan() {
            if gap > 0.0 { f64::INFINITY } else { f64::NEG_INFINITY }
        } else {
            gap * a / b
        }
    }

    /// The arcs on the ceilings between two lifetimes `theta_1 e^y`, of greater and of smaller theta: from `y_hi`, where
    /// theta is `theta_hi`, to `y_lo`.
    pub fn arcs(&self, theta_hi: f64, y_hi: f64, y_lo: f64) -> [Option<CeilingArc>; 2] {
        let across = self.crossing().max(y_lo).min(y_hi);
        [(ArcKind::TauCeiling, y_hi, across), (ArcKind::VCeiling, across, y_lo)].map(|(kind, from, to)| {
            let theta_hi = theta_hi * exp(from - y_hi);
            (from > to).then(|| self.arc(kind, theta_hi, from - to, self.cap_of(kind, from), self.cap_of(kind, to)))
        })
    }

    /// An arc on one ceiling.
    pub fn arc(&self, kind: ArcKind, theta_hi: f64, length: f64, z_hi: f64, z_lo: f64) -> CeilingArc {
        let ln_z = ln(z_hi.abs().min(z_lo.abs()));
        CeilingArc { ceilings: *self, kind, theta_hi, length, z_hi, z_lo, ln_z }
    }
}

/// `ln(v/v_f)` from the difference of both.
pub(super) fn ln_ratio(v: f64, above: f64, v_f: f64) -> f64 {
    if v == f64::INFINITY {
        f64::INFINITY
    } else if v < 0.5 * v_f {
        ln(v / v_f)
    } else {
        ln_1p(above / v_f)
    }
}

/// An arc on a ceiling, along which theta goes one way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CeilingArc {
    ceilings: Ceilings,
    pub kind: ArcKind,
    /// Contact lifetime at the end of greater theta.
    pub theta_hi: f64,
    /// `ln` of the greater over the smaller theta.
    pub length: f64,
    /// `ln u` at the end of greater theta.
    pub z_hi: f64,
    /// `ln u` at the end of smaller theta.
    pub z_lo: f64,
    /// Logarithm of the smaller of their absolute values, which may be too small for a number.
    pub ln_z: f64,
}

/// Nodes of a panel on a ceiling.
pub(super) const NODES: usize = 16;

/// Integrals over time along an arc on a ceiling.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct CeilingSums {
    pub time: f64,
    /// Work of friction.
    pub work: f64,
    /// Slip, `int v dt`.
    pub slip: f64,
    /// `int v ln theta dt`.
    pub state: f64,
    /// Integral of the multiplier.
    pub price: f64,
    /// Integral of the multiplier times `ln v`.
    pub price_ln_v: f64,
    /// Integral of the multiplier times `ln theta`.
    pub price_ln_theta: f64,
    pub nodes: u32,
}

/// Place and weight of a node on a ceiling.
pub(super) struct CeilingNode {
    /// `ln(theta_hi/theta)`.
    pub depth: f64,
    pub z: f64,
    /// Its weight in time.
    pub dt: f64,
}

impl CeilingArc {
    /// Whether theta falls along it.
    pub fn falls(&self) -> bool {
        self.z_hi + self.z_lo > 0.0
    }

    /// `d ln u/d ln theta`.
    pub fn rise(&self) -> f64 {
        if self.kind == ArcKind::VCeiling { 1.0 } else { self.ceilings.kappa }
    }

    /// Duration.
    pub fn time(&self) -> f64 {
        match self.kind {
            ArcKind::VCeiling => self.length_v().abs() / self.ceilings.v,
            _ if self.ceilings.kappa == 0.0 => {
                let theta_lo = self.theta_hi * exp(-self.length);
                theta_lo * exp_m1(self.length) / exp_m1(self.z_hi).abs()
            }
            _ => {
                let mut time = 0.0;
                let lingered = self.linger(|node| time += node.dt);
                time + lingered
            }
        }
    }

    /// `ln` of `x = u - 1` at the end of greater theta over that at the other, on the ceiling of the velocity.
    fn length_v(&self) -> f64 {
        let (u, x) = exp_and_m1(self.z_lo);
        ln_1p(u * exp_m1(self.length) / x)
    }

    /// Visits the nodes of the arc.
    pub fn visit(&self, mut node: impl FnMut(&CeilingNode)) -> f64 {
        match self.kind {
            ArcKind::VCeiling => {
                self.visit_v(&mut node);
                0.0
            }
            _ => self.linger(node),
        }
    }

    /// On the ceiling of the velocity: in `ln x`, `x = u - 1`, whose singularities are `pi` off the real axis.
    fn visit_v(&self, node: &mut impl FnMut(&CeilingNode)) {
        let length = self.length_v();
        let x_lo = exp_m1(self.z_lo);
        let v = self.ceilings.v;
        panels(0.0, length, PANEL_V, |s, weight| {
            let z = ln_1p(x_lo * exp(s));
            node(&CeilingNode { depth: self.z_hi - z, z, dt: weight.abs() / v });
        });
    }

    /// On the ceiling of friction, in two charts: `ln |z|` near `u = 1`, `ln theta` beyond. Returns what time is spent
    /// closer to `u = 1` than that shows.
    fn linger(&self, mut node: impl FnMut(&CeilingNode)) -> f64 {
        let slope = self.ceilings.kappa.abs();
        // s counts ln theta from the end where |z| is least.
        let high_first = self.z_hi.abs() <= self.z_lo.abs();
        let sign = 1f64.copysign(if self.z_hi == 0.0 { self.z_lo } else { self.z_hi });
        let least = if high_first { self.z_hi.abs() } else { self.z_lo.abs() };
        let mut visit = |s: f64, size: f64, weight: f64| {
            let depth = if high_first { s } else { self.length - s };
            let z = sign * size;
            let theta = self.theta_hi * exp(-depth);
            node(&CeilingNode { depth, z, dt: theta * weight / exp_m1(z).abs() });
        };
        if slope == 0.0 {
            panels(0.0, self.length, 1.0, |s, weight| visit(s, least, weight));
            return 0.0;
        }
        let near = slope.min(1.0);
        let mut start = 0.0;
        let mut lingered = 0.0;
        if self.ln_z < ln(0.5 * near) {
            let greatest = (least + slope * self.length).min(near);
            let from = self.ln_z.max(LN_TINY);
            if self.ln_z < from {
                let theta = if high_first { self.theta_hi } else { self.theta_hi * exp(-self.length) };
                lingered = theta / slope * (from - self.ln_z);
            }
            panels(from, ln(greatest), PANEL_NEAR, |zeta, weight| {
                let size = exp(zeta);
                visit(((size - least) / slope).max(0.0), size, weight * size / slope);
            });
            start = (greatest - least) / slope;
        }
        let panel = 2.0 * (1.0 / slope).min(1.0).min((least + slope * start) / slope);
        // What is this much farther from u = 1 takes no time, where theta falls on the way there.
        let end = if high_first && sign > 0.0 { self.length.min(start + NOTHING / slope) } else { self.length };
        if end > start {
            panels(start, end, panel, |s, weight| visit(s, least + slope * s, weight));
        }
        lingered
    }

    /// Time, work and slip; the prices as well if `G` is given.
    pub fn sums(&self, gap: Option<&Gap>) -> CeilingSums {
        let ln_theta_hi = ln(self.theta_hi);
        let Law { a, b } = self.ceilings.law;
        let mut sums = CeilingSums::default();
        let of_v = self.kind == ArcKind::VCeiling;
        let lingered = self.visit(|&CeilingNode { depth, z, dt }| {
            let ln_theta = ln_theta_hi - depth;
            let (u, excess) = exp_and_m1(z);
            let v = if of_v { self.ceilings.v } else { u * exp(-ln_theta) };
            let ln_v = z - ln_theta;
            let friction = if of_v { 1.0 + a * ln_v + b * ln_theta } else { self.ceilings.tau };
            sums.time += dt;
            sums.slip += v * dt;
            sums.work += friction * v * dt;
            sums.state += v * ln_theta * dt;
            sums.nodes += 1;
            if let Some(gap) = gap {
                // Positive: gap and u - 1 differ in sign on both kinds of leg.
                let price = -gap.value(depth) / excess * if of_v { 1.0 } else { v / a } * dt;
                sums.price += price;
                sums.price_ln_v += price * ln_v;
                sums.price_ln_theta += price * ln_theta;
            }
        });
        if lingered > 0.0 {
            // Steady sliding on the ceiling, at one lifetime, where G/(u - 1) has a limit.
            let depth = if self.z_hi.abs() <= self.z_lo.abs() { 0.0 } else { self.length };
            let ln_theta = ln_theta_hi - depth;
            let slip = lingered * exp(-ln_theta);
            sums.time += lingered;
            sums.slip += slip;
            sums.work += self.ceilings.tau * slip;
            sums.state += ln_theta * slip;
            if let Some(gap) = gap {
                let price = (b - a + gap.pull(depth)) / (a * self.ceilings.kappa) * slip;
                sums.price += price;
                sums.price_ln_v -= price * ln_theta;
                sums.price_ln_theta += price * ln_theta;
            }
        }
        sums
    }
}

/// `ln |z|` below which `theta` and `z/(e^z - 1)` no longer change.
const LN_TINY: f64 = -42.0;

/// Fraction `e^-NOTHING` of an integral that rounding hides.
const NOTHING: f64 = 45.0;

/// Longest panel in `ln x` on the ceiling of the velocity: the singularities at `pi i` leave `3.4^-32` of 16 nodes.
const PANEL_V: f64 = 4.0;

/// Longest panel in `ln |z|`: the singularities at `ln 2 pi + pi i/2` leave `4^-32`.
const PANEL_NEAR: f64 = 3.0;

/// Gauss rules on equal panels, none longer than `longest`.
fn panels(from: f64, to: f64, longest: f64, mut node: impl FnMut(f64, f64)) {
    let count = ((to - from).abs() / longest).ceil().max(1.0);
    let half = 0.5 * (to - from) / count;
    let rule = rule(NODES);
    for panel in 0..count as u32 {
        let middle = from + half * f64::from(2 * panel + 1);
        for (x, w) in rule.x.iter().zip(&rule.w) {
            node(middle + half * x, half * w);
        }
    }
}
