//! The ceilings: where they lie, and arcs on them.
//!
//! Both ceilings bound `z = ln u`: at `theta = theta_1 e^y` the velocity allows `z_v + y` and friction `z_tau + kappa y`,
//! `kappa = 1 - b/a` (docs/derivations.md, "Ceilings").

use multiversion::multiversion;

use super::clamp::{Depth, Gap};
use super::{ArcKind, Bounds};
use crate::model::{Law, friction_margin};
use crate::numerics::elementary::{exp, exp_and_m1, exp_m1, ln, ln_1p};
use crate::numerics::gauss::{Rule, SHORT_NODES, rule};
use crate::numerics::lanes::{LANES, fold};
use crate::numerics::{MIN_INVERTIBLE, NEGLIGIBLE_LN};

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
    /// Both at `theta_0`, which is `theta_1 e^depth`: near it they keep more digits than from `theta_1`.
    pub z_start: [f64; 2],
    pub depth: f64,
    /// `1 - b/a`.
    pub kappa: f64,
}

impl Ceilings {
    /// The ceilings over the state variables of steady sliding at `v_0` and `v_1`, whose logarithms differ by `depth`. Only
    /// differences to the ceilings enter.
    pub fn new(law: Law, [v_0, v_1]: [f64; 2], depth: f64, bounds: &Bounds) -> Ceilings {
        let &Bounds { v_ceiling: v, tau_ceiling: tau, .. } = bounds;
        let z_of_v = |steady: f64| ln_ratio(v, v - steady, steady);
        let z_of_tau = |steady: f64| friction_margin(law, tau, steady) / law.a;
        Ceilings {
            law,
            v,
            tau,
            z_v: z_of_v(v_1),
            z_tau: z_of_tau(v_1),
            z_start: [z_of_v(v_0), z_of_tau(v_0)],
            depth,
            kappa: (law.a - law.b) / law.a,
        }
    }

    /// No ceilings.
    pub fn none(law: Law) -> Ceilings {
        let none = f64::INFINITY;
        let kappa = (law.a - law.b) / law.a;
        Ceilings { law, v: none, tau: none, z_v: none, z_tau: none, z_start: [none; 2], depth: 0.0, kappa }
    }

    /// The largest `ln u` at `y`.
    pub fn cap(&self, y: f64) -> f64 {
        self.cap_of(ArcKind::VCeiling, y).min(self.cap_of(ArcKind::TauCeiling, y))
    }

    /// `ln u` on one of the ceilings, from the nearer end.
    pub fn cap_of(&self, kind: ArcKind, y: f64) -> f64 {
        let above = y - self.depth;
        let (y, [z_v, z_tau]) = if above.abs() < y.abs() { (above, self.z_start) } else { (y, [self.z_v, self.z_tau]) };
        if kind == ArcKind::VCeiling { z_v + y } else { z_tau + self.kappa * y }
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
        let ln_z = [z_hi, z_lo].map(|z| ln(z.abs()));
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
    pub ceilings: Ceilings,
    pub kind: ArcKind,
    /// Contact lifetime at the end of greater theta.
    pub theta_hi: f64,
    /// `ln` of the greater over the smaller theta.
    pub length: f64,
    /// `ln u` at the end of greater theta.
    pub z_hi: f64,
    /// `ln u` at the end of smaller theta.
    pub z_lo: f64,
    /// Logarithms of their absolute values, which may be too small for a number.
    pub ln_z: [f64; 2],
}

/// Integrals over time along an arc on a ceiling.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct CeilingSums {
    /// `int v ln v dt`.
    pub creep: f64,
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

impl CeilingArc {
    /// Whether `|ln u|` is least at the end of greater theta.
    fn is_steady_at_high(&self) -> bool {
        let [high, low] = [self.z_hi, self.z_lo].map(f64::abs);
        high < low || high == low && self.ln_z[0] <= self.ln_z[1]
    }

    /// The least `ln |ln u|`.
    pub fn least_ln_z(&self) -> f64 {
        self.ln_z[usize::from(!self.is_steady_at_high())]
    }

    /// Whether theta falls along it.
    pub fn falls(&self) -> bool {
        self.z_hi + self.z_lo > 0.0
    }

    /// `d ln u/d ln theta`.
    pub fn rise(&self) -> f64 {
        if self.kind == ArcKind::VCeiling { 1.0 } else { self.ceilings.kappa }
    }

    /// The end of greater or of smaller theta.
    pub fn end(&self, high: bool) -> Depth {
        if high { Depth { below: 0.0, above: self.length } } else { Depth { below: self.length, above: 0.0 } }
    }

    /// Duration.
    pub fn time(&self) -> f64 {
        if self.kind == ArcKind::VCeiling {
            // ln of x = u - 1 at the end of greater theta over that at the other.
            let (u, x) = exp_and_m1(self.z_lo);
            return ln_1p(u * exp_m1(self.length) / x).abs() / self.ceilings.v;
        }
        let line = CeilingLine::of(self);
        line.lingered + self.theta_hi * line.sums(self).0[0]
    }

    /// Work of friction, and its nodes.
    pub fn work(&self) -> (f64, u32) {
        let Law { a, b } = self.ceilings.law;
        let line = CeilingLine::of(self);
        let ([time, depth, slip], nodes) = line.sums(self);
        let ln_theta = ln(self.theta_hi);
        let work = if self.kind == ArcKind::VCeiling {
            let friction = 1.0 + a * (self.z_hi - ln_theta) + b * ln_theta;
            self.ceilings.v * self.theta_hi * (friction * time - b * depth)
        } else {
            self.ceilings.tau * slip
        };
        // Steady sliding on the ceiling, at one lifetime.
        let ln_theta = ln_theta - if line.high_first { 0.0 } else { self.length };
        (work + (1.0 + (b - a) * ln_theta) * line.lingered * exp(-ln_theta), nodes)
    }

    /// Parts of the work, and the prices.
    pub fn sums(&self, gap: &Gap) -> CeilingSums {
        let ln_theta_hi = ln(self.theta_hi);
        let Law { a, b } = self.ceilings.law;
        let mut sums = CeilingSums::default();
        let of_v = self.kind == ArcKind::VCeiling;
        let line = CeilingLine::of(self);
        for chart in line.charts(self) {
            let mut add = |at: f64, weight: f64| {
                let (s, size, scale) = line.place(chart.near, at);
                let (near, far) = (s, self.length - s);
                let (below, above) = if line.high_first { (near, far) } else { (far, near) };
                let (z, ln_theta) = (line.sign * size, ln_theta_hi - below);
                let (u, excess) = exp_and_m1(z);
                let dt = self.theta_hi * exp(-below) * weight * scale / exp_m1(z).abs();
                let v = if of_v { self.ceilings.v } else { u * exp(-ln_theta) };
                let ln_v = z - ln_theta;
                sums.creep += v * ln_v * dt;
                sums.state += v * ln_theta * dt;
                sums.nodes += 1;
                // Positive: gap and u - 1 differ in sign on both kinds of arc.
                let gap = gap.value(self, Depth { below, above });
                let price = -gap / excess * if of_v { 1.0 } else { v / a } * dt;
                sums.price += price;
                sums.price_ln_v += price * ln_v;
                sums.price_ln_theta += price * ln_theta;
            };
            chart.panels(|middle, half, rule| {
                rule.x.iter().zip(&rule.w).for_each(|(x, w)| add(middle + half * x, half * w));
            });
        }
        let lingered = line.lingered;
        if lingered > 0.0 {
            // Steady sliding on the ceiling, at one lifetime, where G/(u - 1) has a limit.
            let depth = self.end(self.is_steady_at_high());
            let ln_theta = ln_theta_hi - depth.below;
            let slip = lingered * exp(-ln_theta);
            sums.creep -= ln_theta * slip;
            sums.state += ln_theta * slip;
            // G/(u - 1) tends to its limit over one unit of ln |z|.
            let late = exp_m1(-slip * self.rise().abs()) / self.rise().abs();
            let limit = (b - a + gap.pull(depth)) / (a * self.ceilings.kappa);
            let price = if of_v { 0.0 } else { limit * (slip + late) };
            sums.price += price;
            sums.price_ln_v -= price * ln_theta;
            sums.price_ln_theta += price * ln_theta;
        }
        sums
    }

    /// `ln |u - 1|` at the end of greater theta, and its change to the other: the coordinate of a motion.
    pub fn coordinates(&self) -> (f64, f64) {
        // ln(e^z - 1) = ln z for small z.
        let beyond = |z: f64| if z.abs() > MIN_INVERTIBLE { ln(exp_m1(z).abs() / z.abs()) } else { 0.0 };
        let (high, low) = (self.ln_z[0] + beyond(self.z_hi), self.ln_z[1] + beyond(self.z_lo));
        (high, low - high)
    }

    /// The parts before and after a place, from 0 at the start to 1 at the end.
    pub fn cut(&self, place: f64) -> [CeilingArc; 2] {
        let from_high = if self.falls() { place } else { 1.0 - place };
        let (high, change) = self.coordinates();
        let rise = self.rise();
        let at = high + from_high * change;
        let z = ln_1p(exp(at).copysign(self.z_hi + self.z_lo));
        // Where u hardly changes, theta is the coordinate.
        let even = change.abs() < self.length * LEAST_CHANGE;
        let depth = if even { from_high * self.length } else { ((self.z_hi - z) / rise).clamp(0.0, self.length) };
        let depth = if from_high <= 0.0 {
            0.0
        } else if from_high >= 1.0 {
            self.length
        } else {
            depth
        };
        let z = match depth {
            0.0 if from_high <= 0.0 => self.z_hi,
            _ if from_high >= 1.0 => self.z_lo,
            _ if even => self.z_hi - rise * depth,
            _ => z,
        };
        let ln_z = if at < ln(MIN_INVERTIBLE) && !even { at } else { ln(z.abs()) };
        // Close to u = 1 only the distance from it has digits.
        let from_z = !even && !self.is_steady_at_high();
        let above = if from_z { ((z - self.z_lo) / rise).clamp(0.0, self.length) } else { self.length - depth };
        let mut parts = [
            self.ceilings.arc(self.kind, self.theta_hi, depth, self.z_hi, z),
            self.ceilings.arc(self.kind, self.theta_hi * exp(-depth), above, z, self.z_lo),
        ];
        (parts[0].ln_z, parts[1].ln_z) = ([self.ln_z[0], ln_z], [ln_z, self.ln_z[1]]);
        if self.falls() { parts } else { [parts[1], parts[0]] }
    }
}

/// Change of `ln |u - 1|` for one of `ln theta` below which theta is the coordinate. Chosen: either determines a place to most digits there.
const LEAST_CHANGE: f64 = 0.1;

/// An arc on a ceiling as a line in `s`, `ln theta` from the end where `|z|` is least.
struct CeilingLine {
    length: f64,
    /// Whether `|z|` is least at the end of greater theta.
    high_first: bool,
    /// Sign of `z`, its least absolute value and the slope of that.
    sign: f64,
    least: f64,
    slope: f64,
    /// Time closer to `u = 1` than nodes show.
    lingered: f64,
}

/// A part of a line with its coordinate.
#[derive(Clone, Copy)]
struct CeilingChart {
    /// The coordinate is `ln |z|`, for the neighbourhood of `u = 1`, or `s`.
    near: bool,
    from: f64,
    to: f64,
    /// Longest panel.
    longest: f64,
}

impl CeilingLine {
    fn of(arc: &CeilingArc) -> CeilingLine {
        let (high_first, ln_z) = (arc.is_steady_at_high(), arc.least_ln_z());
        let slope = arc.rise().abs();
        // Closer to u = 1, theta and z/(e^z - 1) no longer change.
        let lingered = if ln_z < -NEGLIGIBLE_LN && slope > 0.0 {
            let theta = arc.theta_hi * if high_first { 1.0 } else { exp(-arc.length) };
            theta / slope * (arc.ln_z[usize::from(high_first)].min(-NEGLIGIBLE_LN) - ln_z)
        } else {
            0.0
        };
        CeilingLine {
            length: arc.length,
            high_first,
            sign: 1f64.copysign(arc.z_hi + arc.z_lo),
            least: arc.z_hi.abs().min(arc.z_lo.abs()),
            slope,
            lingered,
        }
    }

    /// Both charts; either may be empty.
    fn charts(&self, arc: &CeilingArc) -> [CeilingChart; 2] {
        let (slope, least) = (self.slope, self.least);
        if slope == 0.0 {
            let all = CeilingChart { near: false, from: 0.0, to: self.length, longest: 1.0 };
            return [CeilingChart { to: 0.0, ..all }, all];
        }
        let near = slope.min(1.0);
        let (mut from, mut to, mut start) = (0.0, 0.0, 0.0);
        // An arc that is short compared with its distance from u = 1 has its digits in s alone.
        let ln_z = arc.least_ln_z();
        if ln_z < -NEGLIGIBLE_LN || ln_z < ln(0.5 * near) && slope * self.length > MAX_PANEL * least {
            let greatest = (least + slope * self.length).min(near);
            (from, to) = (ln_z.max(-NEGLIGIBLE_LN), ln(greatest).max(-NEGLIGIBLE_LN));
            start = (greatest - least) / slope;
        }
        let longest = MAX_PANEL * (1.0 / slope).min(1.0).min((least + slope * start) / slope);
        // What is this much farther from u = 1 takes no time, where theta falls on the way there.
        let falls = self.high_first && self.sign > 0.0;
        let end = if falls { self.length.min(start + NEGLIGIBLE_LN / slope) } else { self.length };
        [
            CeilingChart { near: true, from, to, longest: MAX_PANEL },
            CeilingChart { near: false, from: start, to: end.max(start), longest },
        ]
    }

    /// `s`, `|z|` and `ds` over the change of the coordinate.
    #[inline(always)]
    fn place(&self, near: bool, at: f64) -> (f64, f64, f64) {
        if near {
            let size = exp(at);
            let s = (size - self.least) / self.slope;
            (if s > 0.0 { s } else { 0.0 }, size, size / self.slope)
        } else {
            (at, self.least + self.slope * at, 1.0)
        }
    }

    /// Time without what it lingers and its integral of the depth below the end of greater theta, both over theta there, and
    /// `int v dt`; then the nodes.
    fn sums(&self, arc: &CeilingArc) -> ([f64; 3], u32) {
        let (mut sums, mut nodes) = ([0.0; 3], 0);
        for chart in self.charts(arc) {
            chart.panels(|middle, half, rule| {
                if let (Some(x), Some(w)) = (rule.x.first_chunk(), rule.w.first_chunk()) {
                    let panel = ceiling_sums(self, chart.near, [middle, half], x, w);
                    for (sum, panel) in sums.iter_mut().zip(panel) {
                        *sum += half * panel;
                    }
                }
                nodes += SHORT_NODES as u32;
            });
        }
        (sums, nodes)
    }
}

/// Integrals over a panel of the middle and half length given, of `e^-depth/|e^z - 1|`, of that times the depth, and of
/// `e^z/|e^z - 1|`.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn ceiling_sums(
    line: &CeilingLine,
    near: bool,
    [middle, half]: [f64; 2],
    x: &[f64; SHORT_NODES],
    w: &[f64; SHORT_NODES],
) -> [f64; 3] {
    let (mut depth, mut size, mut scale) = ([0.0; SHORT_NODES], [0.0; SHORT_NODES], [0.0; SHORT_NODES]);
    for i in 0..SHORT_NODES {
        let (s, at, stretch) = line.place(near, middle + half * x[i]);
        depth[i] = if line.high_first { s } else { line.length - s };
        (size[i], scale[i]) = (at, stretch);
    }
    let (mut times, mut depths, mut slips) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for first in (0..SHORT_NODES).step_by(LANES) {
        let sums = times.iter_mut().zip(&mut depths).zip(&mut slips);
        for (lane, ((times, depths), slips)) in sums.enumerate() {
            let i = first + lane;
            let excess = exp_m1(line.sign * size[i]);
            let weight = w[i] * scale[i] / if excess < 0.0 { -excess } else { excess };
            let time = weight * exp(-depth[i]);
            *times += time;
            *depths += time * depth[i];
            *slips += weight * (1.0 + excess);
        }
    }
    [fold(&times), fold(&depths), fold(&slips)]
}

impl CeilingChart {
    /// Equal panels by middle and half length.
    fn panels(&self, mut panel: impl FnMut(f64, f64, &Rule)) {
        if self.from == self.to {
            return;
        }
        let count = ((self.to - self.from).abs() / self.longest).ceil().max(1.0);
        let half = 0.5 * (self.to - self.from) / count;
        let rule = rule(SHORT_NODES);
        for i in 0..count as u32 {
            panel(self.from + half * f64::from(2 * i + 1), half, rule);
        }
    }
}

/// Longest panel: near `u = 1` in `ln |z|`, else in `ln theta` in units of the distance from `u = 1` and of the change of `z` by 1. Derived:
/// the singularities leave `4^-32` (at `ln 2 pi + pi i/2`) and `3^-32`.
const MAX_PANEL: f64 = 3.0;
