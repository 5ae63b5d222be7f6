//! A regular arc of an extremal, and its quadrature: time, work and the derivative of time.
//!
//! Along an arc `C = a v + beta` is constant and `u = theta v` obeys `u - 1 - ln u = E(theta)` with `E = [1 + (b - a)
//! ln theta + C theta]/a`, so `theta' = 1 - U(w)`, `w^2 = 2 E` (docs/derivations.md, "The optimum is a quadrature"). Two
//! charts cover every arc without cancellation; both refer `E` to a point where it is known:
//!
//! - the **turning chart** `theta = theta_h/(1 + X^2)`, `X < 0` while theta rises and `X > 0` while it falls, is
//!   analytic across the turning point and becomes `ln theta` far from it. `X = sigma sinh p` resolves the layer of
//!   width `sqrt a` around the turning point;
//! - the **direct chart** `y = ln(theta/theta_a)` is for arcs that stay a factor of two below their turning point, or
//!   have none.

use multiversion::multiversion;

use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p, ln_grown, phi, rough_ln};
use crate::numerics::gauss::{Rule, SHORT_NODES, rule};
use crate::numerics::lanes::{LANES, Lanes, fold, least};
use crate::numerics::turning::{Turning, turning, turning_lanes};
use crate::numerics::{self, MAX_SQUARABLE, ROUNDING_RTOL};

/// The chart that an arc is drawn in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Chart {
    /// `theta = theta_h/(1 + X^2)` from `x_start` to `x_end`.
    Turning {
        /// State variable at the turning point.
        theta_h: f64,
        /// Its logarithm.
        ln_theta_h: f64,
        /// Signed coordinate of the start, negative where theta rises.
        x_start: f64,
        /// Signed coordinate of the end.
        x_end: f64,
        /// `x_end^2 - x_start^2`, free of cancellation.
        x_squares: f64,
    },
    /// `y = ln(theta/theta_a)` from `y_start` to `y_end`, one of which is the anchor `y = 0`.
    Direct {
        /// State variable at the anchor, the end of the arc with the larger theta.
        theta_a: f64,
        /// `ln u` at the anchor.
        z_a: f64,
        /// Friction at the anchor with `u = 1`, `1 + (b - a) ln theta_a`.
        friction_a: f64,
        /// Coordinate of the start, at most 0.
        y_start: f64,
        /// Coordinate of the end, at most 0.
        y_end: f64,
    },
}

/// A regular arc: the law and its chart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Arc {
    pub law: Law,
    pub chart: Chart,
}

/// The result of one quadrature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sums {
    /// Duration of the arc.
    pub time: f64,
    /// `int u dt = time - (theta_end - theta_start)`: what the arc takes beyond the growth of theta at rest.
    pub lag: f64,
    /// Work of friction along it.
    pub work: f64,
    /// `int v ln v dt`.
    pub creep: f64,
    /// `int v ln theta dt`.
    pub state: f64,
    /// The interior part of `d time/d ln theta_h` in the turning chart; 0 in the direct chart.
    pub sensitivity: f64,
    /// `int u theta/(1 - u)^2 dt`, from which `d time/d ln u(end)` follows without cancellation where theta goes one
    /// way.
    pub swing: f64,
    /// Least friction met at a node.
    pub friction_min: f64,
    /// Nodes spent.
    pub nodes: u32,
}

impl Default for Sums {
    fn default() -> Sums {
        Sums {
            time: 0.0,
            lag: 0.0,
            work: 0.0,
            creep: 0.0,
            state: 0.0,
            sensitivity: 0.0,
            swing: 0.0,
            friction_min: f64::INFINITY,
            nodes: 0,
        }
    }
}

impl Sums {
    pub fn add(&mut self, other: &Sums) {
        self.time += other.time;
        self.lag += other.lag;
        self.work += other.work;
        self.creep += other.creep;
        self.state += other.state;
        self.sensitivity += other.sensitivity;
        self.swing += other.swing;
        self.friction_min = self.friction_min.min(other.friction_min);
        self.nodes += other.nodes;
    }
}

/// Least and greatest friction of a part of an arc with the constant `c` between two points: at one of them, or where it is
/// stationary in between.
///
/// With `tau = 1 + a ln u + (b - a) ln theta = a (u - 1) - C theta` the rate `theta tau' = tau + a - b u` vanishes where
/// `theta = (a - b) u/C`. There equation (2) of docs/derivations.md is `u - 1 - ln u = [1 + a - b + (b - a) ln((a - b)/C)]/b`,
/// and `tau = b u - a` is a minimum for `(u - 1)(b - a) < 0` and a maximum for `(u - 1)(b - a) > 0`.
pub(super) fn friction_range(law: &Law, c: f64, [start, end]: &[ArcPoint; 2]) -> [f64; 2] {
    let Law { a, b } = *law;
    let rate = |point: &ArcPoint| point.friction(law) + a - b * exp(point.ln_u);
    let ends = [start, end].map(|point| point.friction(law));
    let mut range = [ends[0].min(ends[1]), ends[0].max(ends[1])];
    let scale = (a - b) / c;
    if !(b > 0.0 && scale > 0.0 && scale.is_finite()) {
        return range;
    }
    // Where theta rises it is stationary once at the most, and where theta falls; the rate at the outer end has its sign there.
    let (rises, falls) = (start.ln_u < 0.0, end.ln_u > 0.0);
    let (dips, peaks) = if b > a {
        (rises && rate(start) < 0.0, falls && rate(end) < 0.0)
    } else {
        (falls && rate(end) > 0.0, rises && rate(start) > 0.0)
    };
    let rest = if dips || peaks { (1.0 + a - b + (b - a) * ln(scale)) / b } else { f64::NAN };
    if rest.is_nan() || rest < 0.0 {
        return range;
    }
    let stationary = |side: f64| {
        let Turning { ln_u, excess, .. } = turning((2.0 * rest).sqrt().copysign(side));
        let theta = scale * (1.0 + excess);
        let inside = if side < 0.0 {
            theta >= start.theta && (end.ln_u >= 0.0 || theta <= end.theta)
        } else {
            theta >= end.theta && (start.ln_u <= 0.0 || theta <= start.theta)
        };
        (inside && ln_u.is_finite()).then_some(b * (1.0 + excess) - a)
    };
    if dips && let Some(least) = stationary(a - b) {
        range[0] = range[0].min(least);
    }
    if peaks && let Some(greatest) = stationary(b - a) {
        range[1] = range[1].max(greatest);
    }
    range
}

/// Friction at a lifetime with `u = 1`. At the turning point it is `c_h = -C theta_h`.
pub(super) fn steady_friction(law: &Law, ln_theta: f64) -> f64 {
    1.0 + (law.b - law.a) * ln_theta
}

impl Arc {
    /// The conserved `C`.
    pub fn c(&self) -> f64 {
        match self.chart {
            Chart::Turning { theta_h, ln_theta_h, .. } => -steady_friction(&self.law, ln_theta_h) / theta_h,
            Chart::Direct { theta_a, z_a, friction_a, .. } => (self.law.a * phi(z_a) - friction_a) / theta_a,
        }
    }

    /// Largest state variable on the arc.
    pub fn theta_max(&self) -> f64 {
        match self.chart {
            Chart::Turning { theta_h, x_start, x_end, .. } => {
                let x = if x_start * x_end <= 0.0 { 0.0 } else { x_start.abs().min(x_end.abs()) };
                theta_h / (1.0 + x * x)
            }
            Chart::Direct { theta_a, .. } => theta_a,
        }
    }

    /// The start of the arc; `None` where `E < 0` (no such extremal).
    pub fn start(&self) -> Option<Turning> {
        let (Chart::Turning { x_start: start, .. } | Chart::Direct { y_start: start, .. }) = self.chart;
        self.edge(start)
    }

    /// The end of the arc; `None` where `E < 0`.
    pub fn end(&self) -> Option<Turning> {
        let (Chart::Turning { x_end: end, .. } | Chart::Direct { y_end: end, .. }) = self.chart;
        self.edge(end)
    }

    /// The integrands at a coordinate of the chart.
    fn edge(&self, at: f64) -> Option<Turning> {
        let w = match self.chart {
            Chart::Turning { ln_theta_h, .. } => at * omega(&self.law, steady_friction(&self.law, ln_theta_h), at * at),
            Chart::Direct { z_a, friction_a, .. } => {
                (2.0 * direct_e(&self.law, phi(z_a), friction_a, at, exp(at))).sqrt().copysign(z_a)
            }
        };
        w.is_finite().then(|| turning(w))
    }

    /// The quadrature to relative accuracy `tolerance`; `None` where the arc does not exist (`E < 0` on the way).
    pub fn sums(&self, tolerance: f64) -> Option<Sums> {
        let (line, slice) = self.line();
        let steep = self.law.b - self.law.a;
        let sums = line.sums(tolerance, steep, |middle, half, rule| slice.sums(middle, half, rule));
        (sums.time.is_finite() && sums.work.is_finite()).then_some(sums)
    }

    /// The arc as a line in the coordinate of its chart, `p` or `y`.
    #[inline(always)]
    fn line(&self) -> (Line, Slice) {
        match self.chart {
            Chart::Turning { theta_h, ln_theta_h, x_start, x_end, x_squares } => {
                self.turning_line(theta_h, ln_theta_h, x_start, x_end, x_squares)
            }
            Chart::Direct { theta_a, z_a, friction_a, y_start, y_end } => {
                self.direct_line(theta_a, z_a, friction_a, y_start, y_end)
            }
        }
    }

    fn turning_line(&self, theta_h: f64, ln_theta_h: f64, x_start: f64, x_end: f64, x_squares: f64) -> (Line, Slice) {
        let Law { a, b } = self.law;
        let c_h = steady_friction(&self.law, ln_theta_h);
        // Scale of the layer: w = X/layer near the turning point.
        let layer = (a / (2.0 * (c_h + a - b))).sqrt();
        let sigma = if LAYERS * layer < 1.0 { LAYERS * layer } else { 1.0 };
        let (s_start, s_end) = (x_start / sigma, x_end / sigma);
        let (r_start, r_end) = ((1.0 + s_start * s_start).sqrt(), (1.0 + s_end * s_end).sqrt());
        let start = asinh(s_start, r_start);
        let length = if x_start * x_end > 0.0 {
            let s = x_squares / (sigma * sigma * (s_end * r_start + s_start * r_end));
            asinh(s, (1.0 + s * s).sqrt())
        } else {
            asinh(s_end, r_end) - start
        };
        // Where theta rises, the branch points of U, in a wide layer farther away; where it falls, U has none.
        let (re, im) = BRANCH;
        // Where theta is infinite, X = i; for C > 0 E has another zero above theta_h, at |X| > sqrt(1 - kappa).
        let kappa = if c_h < 0.0 && a > b { -c_h / (a - b) } else { 0.0 };
        let nearest = (1.0 - kappa).max(0.0).sqrt();
        let (far_re, far_im) = if nearest < sigma {
            (0.0, nearest / sigma)
        } else {
            (acosh_inverse(sigma / nearest), std::f64::consts::FRAC_PI_2)
        };
        let low = if x_start + x_end > 0.0 { x_end } else { x_start };
        let below = last_zero(b - a, c_h, 1.0 + low * low)
            .map_or(f64::INFINITY, |x| asinh(x / sigma, (1.0 + x * x / (sigma * sigma)).sqrt()));
        let singular = [(-re, im), (far_re, far_im), (-far_re, far_im), (below.min(NO_SINGULARITY).copysign(low), 0.0)];
        let slice = TurningSlice { law: self.law, theta_h, ln_theta_h, c_h, sigma };
        (Line { start, length, singular }, Slice::Turning(slice))
    }

    fn direct_line(&self, theta_a: f64, z_a: f64, friction_a: f64, y_start: f64, y_end: f64) -> (Line, Slice) {
        let Law { a, b } = self.law;
        let phi_a = phi(z_a);
        let (low, c) = (y_start.min(y_end), a * phi_a - friction_a);
        // For C > 0 a pair of zeros of E lies above the arc; where theta rises, a branch point of U as well.
        let pair = zero_above(&self.law, friction_a, c, 0.0);
        let branch = if z_a < 0.0 { zero_above(&self.law, friction_a, c, std::f64::consts::TAU * a) } else { pair };
        let below = zero_below(b - a, friction_a, c, low);
        // The turning point lies at least ln 2 above the anchor.
        let singular = [(std::f64::consts::LN_2, 0.0), (below, 0.0), pair, branch];
        let slice = DirectSlice {
            law: self.law,
            theta_a,
            ln_theta_a: ln(theta_a),
            phi_a,
            friction_a,
            sign: 1f64.copysign(z_a),
        };
        (Line { start: y_start, length: y_end - y_start, singular }, Slice::Direct(slice))
    }

    /// The arc cut into equal pieces, in each of which few nodes yield the time from its ends to any place in it.
    pub fn pieces(&self) -> EqualSteps {
        let (line, slice) = self.line();
        let mut pieces = EqualSteps { start: line.start, length: line.length, count: line.pieces(), slice };
        // As in `sums`, more of them where friction falls below b - a.
        let (mut time, friction_min) = pieces.whole();
        while friction_min <= self.law.b - self.law.a && pieces.count < MAX_PIECES {
            pieces.count *= 2;
            let (finer, _) = pieces.whole();
            let change = (finer - time).abs();
            time = finer;
            if change <= AGREEMENT * time {
                break;
            }
        }
        pieces
    }
}

/// An arc along the coordinate of its chart, `[start, start + length]`.
struct Line {
    start: f64,
    length: f64,
    /// Singularities as `(real, imaginary)` places in the upper half plane.
    singular: [(f64, f64); 4],
}

impl Line {
    /// The number of pieces with few nodes.
    fn pieces(&self) -> u32 {
        self.cut(SHORT_NODES as f64, ROUNDING_RTOL).0
    }

    /// Into how many equal panels to cut so that none needs more than `most` nodes, and how many nodes they need.
    #[inline(always)]
    fn cut(&self, most: f64, tolerance: f64) -> (u32, f64) {
        let digits = -rough_ln(tolerance);
        let mut count = 1u32;
        loop {
            let half = 0.5 * self.length.abs() / f64::from(count);
            let mut needed = 0.0f64;
            for panel in 0..count {
                let middle = self.start + self.length * (f64::from(panel) + 0.5) / f64::from(count);
                needed = needed.max(nodes_needed(middle, half, &self.singular, digits));
            }
            if needed <= most || count >= MAX_PIECES {
                return (count, needed.min(most));
            }
            count *= 2;
        }
    }

    /// Sums over equal panels, with as many Gauss nodes as the nearest singularity needs; where friction falls to `steep`, `b - a`, over
    /// halved panels instead: there a zero of `E` may be close to an end.
    fn sums(&self, tolerance: f64, steep: f64, kernel: impl Fn(f64, f64, &Rule) -> Sums) -> Sums {
        let (count, nodes) = self.cut(MAX_NODES, tolerance);
        let rule = rule(LANES * (nodes as usize / LANES + 1));
        let half = 0.5 * self.length / f64::from(count);
        let mut total = Sums::default();
        for panel in 0..count {
            total.add(&kernel(self.start + half * f64::from(2 * panel + 1), half, rule));
        }
        if total.friction_min > steep { total } else { self.halved(tolerance, total, kernel) }
    }

    /// The sums after those `before`, over panels that are halved until two rules agree.
    fn halved(&self, tolerance: f64, before: Sums, kernel: impl Fn(f64, f64, &Rule) -> Sums) -> Sums {
        let (mut total, mut panels) =
            (Sums { nodes: before.nodes, ..Sums::default() }, vec![(self.start, self.length)]);
        for _ in 0..numerics::MAX_PANELS {
            let Some((start, length)) = panels.pop() else { break };
            let half = 0.5 * length;
            let [coarse, fine] = [2 * LANES, 4 * LANES].map(|nodes| kernel(start + half, half, rule(nodes)));
            // NaN, where there is no arc, stays. The lag may be far less than the time; it has the rounding of e^z, z down to -700.
            if (fine.time - coarse.time).abs() > tolerance.max(AGREEMENT) * before.time
                || (fine.lag - coarse.lag).abs() > tolerance.max(100.0 * AGREEMENT) * before.lag
            {
                panels.extend([(start + half, half), (start, half)]);
            } else {
                total.add(&fine);
            }
            total.nodes += coarse.nodes;
        }
        if panels.is_empty() { total } else { Sums { time: f64::NAN, ..total } }
    }
}

/// An arc in equal pieces of its chart's coordinate.
pub(super) struct EqualSteps {
    start: f64,
    /// From the start to the end, signed.
    pub length: f64,
    /// The number.
    pub count: u32,
    slice: Slice,
}

/// The constants of a chart's integrands.
enum Slice {
    Turning(TurningSlice),
    Direct(DirectSlice),
}

impl Slice {
    /// The sums of one panel.
    #[inline(always)]
    fn sums(&self, middle: f64, half: f64, rule: &Rule) -> Sums {
        match self {
            Slice::Turning(slice) => panel_sums(slice, &slice.law, middle, half, rule),
            Slice::Direct(slice) => panel_sums(slice, &slice.law, middle, half, rule),
        }
    }
}

/// A place on an arc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ArcPoint {
    pub theta: f64,
    pub ln_theta: f64,
    pub ln_u: f64,
}

impl ArcPoint {
    /// Friction there.
    pub fn friction(&self, law: &Law) -> f64 {
        1.0 + law.a * self.ln_u + (law.b - law.a) * self.ln_theta
    }
}

/// Most panels or pieces of an arc. Chosen: a limit on the work; doubling ends there.
const MAX_PIECES: u32 = 1024;

impl EqualSteps {
    /// The places at both ends of a piece; places run from 0 at the start of the arc to 1 at its end.
    pub fn edges_of(&self, piece: usize) -> [f64; 2] {
        [piece, piece + 1].map(|edge| edge as f64 / f64::from(self.count))
    }

    /// Those of all pieces.
    pub fn edges(&self) -> impl Iterator<Item = [f64; 2]> {
        (0..self.count as usize).map(|piece| self.edges_of(piece))
    }

    /// Time from one place to another of the same piece.
    pub fn time(&self, from: f64, to: f64) -> f64 {
        self.sums(from, to).time
    }

    /// Time of all pieces, and the least friction met.
    fn whole(&self) -> (f64, f64) {
        let all = self.edges().map(|[from, to]| self.sums(from, to));
        all.fold((0.0, f64::INFINITY), |(time, least), sums| (time + sums.time, least.min(sums.friction_min)))
    }

    /// The sums of the arc from one place to another of the same piece.
    pub fn sums(&self, from: f64, to: f64) -> Sums {
        let (middle, half) = (self.start + 0.5 * (from + to) * self.length, 0.5 * (to - from) * self.length);
        self.slice.sums(middle, half, rule(SHORT_NODES))
    }

    /// The point at `place`.
    pub fn at(&self, place: f64) -> ArcPoint {
        let along = self.start + place * self.length;
        match &self.slice {
            Slice::Turning(slice) => {
                let q = exp(along);
                let x = 0.5 * slice.sigma * (q - 1.0 / q);
                let x2 = x * x;
                let w = x * omega(&slice.law, slice.c_h, x2);
                let (theta, ln_theta) = (slice.theta_h / (1.0 + x2), slice.ln_theta_h - ln_1p(x2));
                ArcPoint { theta, ln_theta, ln_u: turning(w).ln_u }
            }
            Slice::Direct(slice) => {
                let grow = exp(along);
                let w = slice.sign * (2.0 * direct_e(&slice.law, slice.phi_a, slice.friction_a, along, grow)).sqrt();
                ArcPoint { theta: slice.theta_a * grow, ln_theta: slice.ln_theta_a + along, ln_u: turning(w).ln_u }
            }
        }
    }
}

/// Layers of the turning point to one unit of `sinh p`. Chosen: it balances the two kinds of singularity in the `p` plane.
const LAYERS: f64 = 1.5;

/// The branch points of `U` in the `p` plane, `asinh(2 sqrt(pi)/LAYERS e^(i pi/4))`, where the layer is narrow.
const BRANCH: (f64, f64) = (1.556165173207204, 0.7409303559311022);

/// Nodes beyond which a panel is divided in two. Chosen: halves need about half the nodes each; the budgets of `optimal` judge the error.
const MAX_NODES: f64 = 64.0;

/// Relative difference of two rules that is rounding. Chosen: a hundred roundings.
const AGREEMENT: f64 = 1e-14;

/// Gauss nodes for relative accuracy `e^-digits` on a panel: the Bernstein ellipse through the nearest singularity.
#[inline(always)]
fn nodes_needed(middle: f64, half: f64, singular: &[(f64, f64)], digits: f64) -> f64 {
    let scale = 1.0 / half;
    // Squares of the sums of the distances from both ends.
    let mut least = f64::INFINITY;
    for &(re, im) in singular {
        let (x, y) = ((re - middle) * scale, im * scale);
        let (near, far) = ((x - 1.0) * (x - 1.0) + y * y, (x + 1.0) * (x + 1.0) + y * y);
        let square = near + far + 2.0 * (near * far).sqrt();
        least = if square < least { square } else { least };
    }
    let rho = 0.5 * (least.sqrt() + (least - 4.0).max(0.0).sqrt());
    (digits + MARGIN) / (2.0 * rough_ln(rho.min(1e6)))
}

/// Distance that stands for no singularity, in half panels. Chosen: at a thousand the fewest nodes are enough.
const NO_SINGULARITY: f64 = 1e3;

/// The pair of zeros of `a E = friction_a + (b - a) y + c e^y` near the real axis, or of `a E - i shift`: a place of the
/// upper half plane, to some tenths, and not above it. For `c <= 0` there is none near an arc.
///
/// With `y = r + i s` it is where `c e^r cos s = -F` and `c e^r sin s = G`, of `F = friction_a + (b - a) r` and `G = shift +
/// (a - b) s`, so that `s = pi/2 + atan(F/G)`; each round shrinks the error of `r` to a third or less, mostly far less.
fn zero_above(law: &Law, friction_a: f64, c: f64, shift: f64) -> (f64, f64) {
    use std::f64::consts::{FRAC_PI_2, PI};
    let bend = law.a - law.b;
    // Friction is no less on the arc for b <= a, which leaves the pair beyond the anchor.
    if c <= 0.0 || (bend >= 0.0 && 2.0 * c <= friction_a) {
        return (NO_SINGULARITY, FRAC_PI_2);
    }
    let inverse = 1.0 / c;
    let (mut r, mut s) = (0.0, PI);
    for _ in 0..ROUNDS {
        let (force, side) = ((friction_a - bend * r).max(0.0), shift + bend * s);
        let size = (force * force + side * side).sqrt();
        r = rough_ln((inverse * size).clamp(1.0 / MAX_SQUARABLE, MAX_SQUARABLE));
        // Shafer's bound of the arcus tangens from below.
        s = if side > 0.0 { FRAC_PI_2 + 3.0 * force / (side + 2.0 * size) } else { PI };
    }
    (r, s)
}

/// Rounds of [`zero_above`]. Chosen: the number of nodes needs one digit of the distance.
const ROUNDS: u32 = 2;

/// A bound from above of the zero of `a E` below the arc in the direct chart, which reaches down to `low`; `slope` is `b
/// - a`.
fn zero_below(slope: f64, friction_a: f64, c: f64, low: f64) -> f64 {
    if slope <= 0.0 {
        return -NO_SINGULARITY;
    }
    let friction = friction_a + slope * low;
    // Below the arc a E is no steeper than there for C > 0, and than b - a for C < 0.
    let pull = c * exp(low);
    let steepest = (friction + pull) / (slope + pull.max(0.0));
    let distance = if c > 0.0 { steepest.max(friction / slope) } else { steepest };
    low - distance.max(CLOSEST)
}

/// The singularity in the turning chart, as `X`, with greatest square `grow - 1` on the arc; `None` if it is far.
///
/// With `x = ln(theta_h/theta)` it is where `x = k (1 - e^-x)`, `k = c_h/slope`.
fn last_zero(slope: f64, c_h: f64, grow: f64) -> Option<f64> {
    let k = c_h / slope;
    if slope <= 0.0 || k > HIGH + rough_ln(grow) {
        return None;
    }
    // Newton's method comes down to it from the right: x < k, and x < 2 (k - 1) since x/(1 - e^-x) > 1 + x/2.
    let above = k.min(2.0 * (k - 1.0)).max(CLOSEST);
    let rest = exp(-above);
    let x = above - (above - k * (1.0 - rest)) / (1.0 - k * rest);
    Some(exp_m1(x.max(rough_ln(grow) + CLOSEST)).sqrt())
}

/// Friction in units of `b - a` above which the zero of `E` below an arc is far from it. Chosen: one digit of the distance.
const HIGH: f64 = 4.0;

/// Zeros closer than this come with friction below `b - a`, where quadratures are refined until two agree. Chosen: there, the estimate requires the
/// most nodes.
const CLOSEST: f64 = 0.01;

/// Safety of the node estimate: `e^MARGIN` is the ratio of the error constant to the integral. Measured: the budgets of `optimal` (`cargo test --release --test
/// solver budgets`).
const MARGIN: f64 = 2.0;

/// `asinh x` without cancellation; `root` is `sqrt(1 + x^2)`.
fn asinh(x: f64, root: f64) -> f64 {
    let t = x.abs();
    // e^asinh t = t + root is the reciprocal of root - t.
    ln_grown(t + t * t / (1.0 + root), root - t).copysign(x)
}

/// `acosh(1/sigma)` for `0 < sigma <= 1`, to the digits of [`rough_ln`].
fn acosh_inverse(sigma: f64) -> f64 {
    rough_ln((1.0 + ((1.0 - sigma) * (1.0 + sigma)).sqrt()) / sigma)
}

/// `w/X = sqrt(2 E)/X` as a function of `X^2`: `a E = (a - b) ln(1 + X^2) + c_h X^2/(1 + X^2)`. NaN where `E < 0`.
#[inline(always)]
pub(super) fn omega(law: &Law, c_h: f64, x2: f64) -> f64 {
    // The tiny offset turns the removable 0/0 at X = 0 into 1.
    let x2 = x2 + 1e-280;
    (2.0 / law.a * (c_h / (1.0 + x2) + (law.a - law.b) * (ln_1p(x2) / x2))).sqrt()
}

/// `E` in the direct chart, `C theta_a = a phi_a - friction_a` put in so that a large `C` cancels nothing; `grow` is
/// `e^y`.
#[inline(always)]
fn direct_e(law: &Law, phi_a: f64, friction_a: f64, y: f64, grow: f64) -> f64 {
    phi_a * grow + ((law.b - law.a) * y - friction_a * exp_m1(y)) / law.a
}

/// Nodes that a kernel takes at once where there are as many: the operations of one half hide the latency of the other. Measured (`cargo bench
/// --bench optimal`).
const WIDE: usize = 2 * LANES;

/// The integrands at `N` nodes, a multiple of the lanes, times their weights; all but `u` and the logarithms.
struct Terms<const N: usize> {
    time: [f64; N],
    slip: [f64; N],
    sensitivity: [f64; N],
    swing: [f64; N],
    u: [f64; N],
    ln_u: [f64; N],
    ln_theta: [f64; N],
}

impl<const N: usize> Terms<N> {
    #[inline(always)]
    fn new() -> Terms<N> {
        let zero = [0.0; N];
        Terms { time: zero, slip: zero, sensitivity: zero, swing: zero, u: zero, ln_u: zero, ln_theta: zero }
    }
}

/// The integrands of a chart.
trait Integrands {
    /// Units of time, work, sensitivity and swing per half panel.
    fn units(&self) -> [f64; 4];

    fn at<const N: usize>(&self, middle: f64, half: f64, x: &[f64; N], weight: &[f64; N]) -> Terms<N>;
}

/// The sums of a kernel lane by lane: time, lag, work, creep, state, sensitivity and swing, and the least friction.
struct Tally([Lanes; 7], Lanes);

impl Tally {
    #[inline(always)]
    fn add<const N: usize>(&mut self, law: &Law, terms: &Terms<N>) {
        let Tally([time, lag, work, creep, state, sensitivity, swing], friction_min) = self;
        for first in (0..N).step_by(LANES) {
            for i in 0..LANES {
                let at = first + i;
                let friction = 1.0 + law.a * terms.ln_u[at] + (law.b - law.a) * terms.ln_theta[at];
                time[i] += terms.time[at];
                lag[i] += terms.time[at] * terms.u[at];
                work[i] += terms.slip[at] * friction;
                creep[i] += terms.slip[at] * (terms.ln_u[at] - terms.ln_theta[at]);
                state[i] += terms.slip[at] * terms.ln_theta[at];
                sensitivity[i] += terms.sensitivity[at];
                swing[i] += terms.swing[at];
                friction_min[i] = if friction < friction_min[i] { friction } else { friction_min[i] };
            }
        }
    }
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn panel_sums<I: Integrands>(integrands: &I, law: &Law, middle: f64, half: f64, rule: &Rule) -> Sums {
    let mut tally = Tally([[0.0; LANES]; 7], [f64::INFINITY; LANES]);
    let (x, x_last) = rule.x.as_chunks::<WIDE>();
    let (weight, weight_last) = rule.w.as_chunks::<WIDE>();
    for (x, weight) in x.iter().zip(weight) {
        tally.add(law, &integrands.at(middle, half, x, weight));
    }
    for (x, weight) in x_last.as_chunks::<LANES>().0.iter().zip(weight_last.as_chunks::<LANES>().0) {
        tally.add(law, &integrands.at(middle, half, x, weight));
    }
    let [of_time, of_work, of_sensitivity, of_swing] = integrands.units().map(|unit| unit * half);
    let [time, lag, work, creep, state, sensitivity, swing] = tally.0.map(|lanes| fold(&lanes));
    Sums {
        time: of_time * time,
        lag: of_time * lag,
        work: of_work * work,
        creep: of_work * creep,
        state: of_work * state,
        sensitivity: of_sensitivity * sensitivity,
        swing: of_swing * swing,
        friction_min: least(&tally.1),
        nodes: rule.x.len() as u32,
    }
}

/// Constants of the turning chart.
struct TurningSlice {
    law: Law,
    theta_h: f64,
    ln_theta_h: f64,
    c_h: f64,
    sigma: f64,
}

impl Integrands for TurningSlice {
    #[inline(always)]
    fn units(&self) -> [f64; 4] {
        let (unit, theta) = (2.0 * self.sigma, self.theta_h);
        [unit * theta, unit, unit * theta, unit * theta * theta]
    }

    #[inline(always)]
    fn at<const N: usize>(&self, middle: f64, half: f64, x: &[f64; N], weight: &[f64; N]) -> Terms<N> {
        let Law { a, b } = self.law;
        let (double, bend, slope) = (2.0 / a, (a - b) * (2.0 / a), (b - a) / a);
        let (mut w, mut om, mut inverse_x2) = ([0.0; N], [0.0; N], [0.0; N]);
        let (mut cosh, mut shrink) = ([0.0; N], [0.0; N]);
        let mut terms = Terms::new();
        for i in 0..N {
            let q = exp(middle + half * x[i]);
            let inverse = 1.0 / q;
            let big_x = 0.5 * self.sigma * (q - inverse);
            cosh[i] = 0.5 * (q + inverse);
            // The tiny offset turns the removable 0/0 at X = 0 into 1.
            let x2 = big_x * big_x + 1e-280;
            shrink[i] = 1.0 / (1.0 + x2);
            inverse_x2[i] = 1.0 / x2;
            let l = ln_grown(x2, shrink[i]);
            terms.ln_theta[i] = self.ln_theta_h - l;
            om[i] = (double * self.c_h * shrink[i] + bend * (l * inverse_x2[i])).sqrt();
            w[i] = big_x * om[i];
        }
        let found = turning_lanes(&w);
        for i in 0..N {
            // X/(u - 1), regular at the turning point.
            let ratio = found.under[i] / (om[i] * found.over[i]);
            let g = weight[i] * cosh[i] * ratio * shrink[i];
            let bent = found.u[i] * ratio * ratio * shrink[i];
            terms.time[i] = g * shrink[i];
            terms.slip[i] = g * found.u[i];
            terms.sensitivity[i] = terms.time[i] * (1.0 - bent * slope);
            terms.swing[i] = terms.time[i] * bent * inverse_x2[i];
        }
        (terms.u, terms.ln_u) = (found.u, found.ln_u);
        terms
    }
}

/// Constants of the direct chart.
struct DirectSlice {
    law: Law,
    theta_a: f64,
    ln_theta_a: f64,
    phi_a: f64,
    friction_a: f64,
    sign: f64,
}

impl Integrands for DirectSlice {
    #[inline(always)]
    fn units(&self) -> [f64; 4] {
        let theta = self.theta_a;
        [theta, 1.0, 0.0, -theta * theta]
    }

    #[inline(always)]
    fn at<const N: usize>(&self, middle: f64, half: f64, x: &[f64; N], weight: &[f64; N]) -> Terms<N> {
        let (mut w, mut grow) = ([0.0; N], [0.0; N]);
        let mut terms = Terms::new();
        for i in 0..N {
            let y = middle + half * x[i];
            grow[i] = exp(y);
            terms.ln_theta[i] = self.ln_theta_a + y;
            w[i] = self.sign * (2.0 * direct_e(&self.law, self.phi_a, self.friction_a, y, grow[i])).sqrt();
        }
        let found = turning_lanes(&w);
        for i in 0..N {
            let inverse = 1.0 / found.excess[i];
            terms.time[i] = -weight[i] * grow[i] * inverse;
            terms.slip[i] = -weight[i] * inverse * found.u[i];
            terms.swing[i] = -terms.time[i] * grow[i] * found.u[i] * inverse * inverse;
        }
        (terms.u, terms.ln_u) = (found.u, found.ln_u);
        terms
    }
}
