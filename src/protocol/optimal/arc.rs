//! A regular arc of an extremal, and its quadrature: time, work and the derivative of time.
//!
//! Along an arc `C = a v + beta` is constant and `u = theta v` obeys `u - 1 - ln u = E(theta)` with `E = [1 + (b - a)
//! ln theta + C theta]/a`, so `theta' = 1 - U(w)`, `w^2 = 2 E` (docs/theory.md, "The optimum is a quadrature"). Two
//! charts cover every arc without cancellation; both refer `E` to a point where it is known:
//!
//! - the **turning chart** `theta = theta_h/(1 + X^2)`, `X < 0` while theta rises and `X > 0` while it falls, is
//!   analytic across the turning point and becomes `ln theta` far from it. `X = sigma sinh p` resolves the layer of
//!   width `sqrt a` around the turning point;
//! - the **direct chart** `y = ln(theta/theta_a)` is for arcs that stay a factor of two below their turning point, or
//!   have none.

use multiversion::multiversion;

use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::gauss::{Rule, rule};
use crate::numerics::lanes::{LANES, fold, least};
use crate::numerics::turning::{Turning, turning, turning_lanes};

/// The chart that an arc is drawn in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Chart {
    /// `theta = theta_h/(1 + X^2)` from `x_start` to `x_end`.
    Turning {
        /// Contact lifetime at the turning point.
        theta_h: f64,
        /// Signed coordinate of the start, negative where theta rises.
        x_start: f64,
        /// Signed coordinate of the end.
        x_end: f64,
        /// `x_end^2 - x_start^2`, free of cancellation.
        x_squares: f64,
    },
    /// `y = ln(theta/theta_a)` from `y_start` to `y_end`, one of which is the anchor `y = 0`.
    Direct {
        /// Contact lifetime at the anchor, the end of the arc with the larger theta.
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

/// What one quadrature yields.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sums {
    /// Duration of the arc.
    pub time: f64,
    /// `int u dt = time - (theta_end - theta_start)`: what the arc takes beyond the growth of theta at rest.
    pub lag: f64,
    /// Work of friction along it.
    pub work: f64,
    /// Turning chart: the interior part of `d time/d ln theta_h`. Direct chart: `d time/d z_a`.
    pub sensitivity: f64,
    /// `int u theta/(1 - u)^2 dt`, from which `d time/d ln u(end)` follows without cancellation where theta rises all
    /// the way.
    pub swing: f64,
    /// Least friction met at a node.
    pub friction_min: f64,
    /// Nodes spent.
    pub nodes: u32,
}

/// `phi(z) = e^z - 1 - z`, the left side of the turning equation, without cancellation near 0.
pub(super) fn phi(z: f64) -> f64 {
    if z.abs() < 0.25 {
        // 1/2 + z/6 + z^2/24 + …: thirteen terms leave 1e-17 of the first at |z| = 1/4.
        let mut term = 1.0;
        let mut sum = 1.0;
        for n in 3..15 {
            term *= z / f64::from(n);
            sum += term;
        }
        0.5 * z * z * sum
    } else {
        exp_m1(z) - z
    }
}

impl Arc {
    /// `c_h = -C theta_h = 1 + (b - a) ln theta_h`, the friction at the turning point (there `u = 1`).
    fn friction_at_turn(&self, theta_h: f64) -> f64 {
        1.0 + (self.law.b - self.law.a) * ln(theta_h)
    }

    /// The conserved `C`.
    pub fn c(&self) -> f64 {
        match self.chart {
            Chart::Turning { theta_h, .. } => -self.friction_at_turn(theta_h) / theta_h,
            Chart::Direct { theta_a, z_a, friction_a, .. } => (self.law.a * phi(z_a) - friction_a) / theta_a,
        }
    }

    /// Largest contact lifetime on the arc.
    pub fn theta_max(&self) -> f64 {
        match self.chart {
            Chart::Turning { theta_h, x_start, x_end, .. } => {
                let x = if x_start * x_end <= 0.0 { 0.0 } else { x_start.abs().min(x_end.abs()) };
                theta_h / (1.0 + x * x)
            }
            Chart::Direct { theta_a, .. } => theta_a,
        }
    }

    /// `ln u` and `(u - 1)/w` at the start and the end; `None` where `E < 0` (no such extremal).
    pub fn ends(&self) -> Option<(Turning, Turning)> {
        match self.chart {
            Chart::Turning { theta_h, x_start, x_end, .. } => {
                let c_h = self.friction_at_turn(theta_h);
                let at = |x: f64| {
                    let w = x * omega(&self.law, c_h, x * x);
                    w.is_finite().then(|| turning(w))
                };
                Some((at(x_start)?, at(x_end)?))
            }
            Chart::Direct { z_a, friction_a, y_start, y_end, .. } => {
                let phi_a = phi(z_a);
                let at = |y: f64| {
                    let e = direct_e(&self.law, phi_a, friction_a, y, exp(y));
                    (e >= 0.0).then(|| turning((2.0 * e).sqrt().copysign(z_a)))
                };
                Some((at(y_start)?, at(y_end)?))
            }
        }
    }

    /// Time, work and sensitivity to relative accuracy `tolerance`; `None` where the arc does not exist (`E < 0` on the
    /// way).
    pub fn sums(&self, tolerance: f64) -> Option<Sums> {
        let sums = match self.chart {
            Chart::Turning { theta_h, x_start, x_end, x_squares } => {
                self.turning_sums(theta_h, x_start, x_end, x_squares, tolerance)
            }
            Chart::Direct { theta_a, z_a, friction_a, y_start, y_end } => {
                self.direct_sums(theta_a, z_a, friction_a, y_start, y_end, tolerance)
            }
        };
        (sums.time.is_finite() && sums.work.is_finite()).then_some(sums)
    }

    fn turning_sums(&self, theta_h: f64, x_start: f64, x_end: f64, x_squares: f64, tolerance: f64) -> Sums {
        let (line, slice) = self.turning_line(theta_h, x_start, x_end, x_squares);
        panels(&line, tolerance, |middle, half, rule| turning_kernel(&slice, middle, half, rule))
    }

    /// The turning chart as a line in `p`.
    fn turning_line(&self, theta_h: f64, x_start: f64, x_end: f64, x_squares: f64) -> (Line<4>, TurningSlice) {
        let Law { a, b } = self.law;
        let c_h = self.friction_at_turn(theta_h);
        // Scale of the layer: w = X/layer near the turning point.
        let layer = (a / (2.0 * (c_h + a - b))).sqrt();
        let sigma = if LAYERS * layer < 1.0 { LAYERS * layer } else { 1.0 };
        let (s_start, s_end) = (x_start / sigma, x_end / sigma);
        let start = asinh(s_start);
        let length = if x_start * x_end > 0.0 {
            let (r_start, r_end) = ((1.0 + s_start * s_start).sqrt(), (1.0 + s_end * s_end).sqrt());
            asinh(x_squares / (sigma * sigma) / (s_end * r_start + s_start * r_end))
        } else {
            asinh(s_end) - start
        };
        let branch = 2.0 * std::f64::consts::PI.sqrt() * layer / sigma;
        let (re, im) = asinh_diagonal(branch);
        let (far_re, far_im) = (acosh_inverse(sigma), std::f64::consts::FRAC_PI_2);
        let singular = [(re, im), (-re, im), (far_re, far_im), (-far_re, far_im)];
        let slice = TurningSlice { law: self.law, theta_h, ln_theta_h: ln(theta_h), c_h, sigma };
        (Line { start, length, singular }, slice)
    }

    fn direct_sums(&self, theta_a: f64, z_a: f64, friction_a: f64, y_start: f64, y_end: f64, tolerance: f64) -> Sums {
        let (line, slice) = self.direct_line(theta_a, z_a, friction_a, y_start, y_end);
        panels(&line, tolerance, |middle, half, rule| direct_kernel(&slice, middle, half, rule))
    }

    /// The direct chart as a line in `y`.
    fn direct_line(&self, theta_a: f64, z_a: f64, friction_a: f64, y_start: f64, y_end: f64) -> (Line<2>, DirectSlice) {
        // The turning point lies at least ln 2 above the anchor; other zeros of E are complex.
        let singular = [(std::f64::consts::LN_2, 0.0), (y_end.min(y_start), std::f64::consts::FRAC_PI_2)];
        let slice = DirectSlice {
            law: self.law,
            theta_a,
            ln_theta_a: ln(theta_a),
            phi_a: phi(z_a),
            slope_a: exp_m1(z_a),
            friction_a,
            sign: 1f64.copysign(z_a),
        };
        (Line { start: y_start, length: y_end - y_start, singular }, slice)
    }

    /// The arc cut into equal pieces, in each of which few nodes yield the time from its ends to any place in it.
    pub fn pieces(&self) -> Pieces {
        let cut = |start, length, count, slice| Pieces { start, length, count, slice };
        match self.chart {
            Chart::Turning { theta_h, x_start, x_end, x_squares } => {
                let (line, slice) = self.turning_line(theta_h, x_start, x_end, x_squares);
                cut(
                    line.start,
                    line.length,
                    line.cut(PIECE_NODES as f64, MOST_PIECES, PIECE_TOLERANCE).0,
                    Slice::Turning(slice),
                )
            }
            Chart::Direct { theta_a, z_a, friction_a, y_start, y_end } => {
                let (line, slice) = self.direct_line(theta_a, z_a, friction_a, y_start, y_end);
                cut(
                    line.start,
                    line.length,
                    line.cut(PIECE_NODES as f64, MOST_PIECES, PIECE_TOLERANCE).0,
                    Slice::Direct(slice),
                )
            }
        }
    }
}

/// An arc along the coordinate of its chart, `[start, start + length]`.
struct Line<const N: usize> {
    start: f64,
    length: f64,
    /// Singularities as `(real, imaginary)` places in the upper half plane.
    singular: [(f64, f64); N],
}

impl<const N: usize> Line<N> {
    /// Into how many equal panels, up to `most_panels`, to cut so that none needs more than `most` nodes, and how many
    /// nodes they need.
    #[inline(always)]
    fn cut(&self, most: f64, most_panels: u32, tolerance: f64) -> (u32, f64) {
        let mut count = 1u32;
        loop {
            let half = 0.5 * self.length.abs() / f64::from(count);
            let mut needed = 0.0f64;
            for panel in 0..count {
                let middle = self.start + self.length * (f64::from(panel) + 0.5) / f64::from(count);
                needed = needed.max(nodes_needed(middle, half, &self.singular, tolerance));
            }
            if needed <= most || count >= most_panels {
                return (count, needed.min(most));
            }
            count *= 2;
        }
    }
}

/// An arc in equal pieces of its chart's coordinate.
pub(super) struct Pieces {
    start: f64,
    /// From the start to the end, signed.
    pub length: f64,
    /// How many.
    pub count: u32,
    slice: Slice,
}

enum Slice {
    Turning(TurningSlice),
    Direct(DirectSlice),
}

/// A place on an arc.
pub(super) struct Place {
    pub theta: f64,
    pub ln_theta: f64,
    pub ln_u: f64,
}

/// Nodes of a piece: a multiple of the lanes.
const PIECE_NODES: usize = 2 * LANES;

/// Most pieces of an arc.
const MOST_PIECES: u32 = 1024;

/// Relative accuracy of the time within a piece.
const PIECE_TOLERANCE: f64 = 1e-15;

impl Pieces {
    /// Time from one place to another of the same piece; places run from 0 at the start of the arc to 1 at its end.
    pub fn time(&self, from: f64, to: f64) -> f64 {
        self.sums(from, to).time
    }

    /// The sums of the arc from one place to another of the same piece.
    pub fn sums(&self, from: f64, to: f64) -> Sums {
        let (middle, half) = (self.start + 0.5 * (from + to) * self.length, 0.5 * (to - from) * self.length);
        let rule = rule(PIECE_NODES);
        match &self.slice {
            Slice::Turning(slice) => turning_kernel(slice, middle, half, rule),
            Slice::Direct(slice) => direct_kernel(slice, middle, half, rule),
        }
    }

    /// What is where, `place` as in [`Pieces::time`].
    pub fn at(&self, place: f64) -> Place {
        let along = self.start + place * self.length;
        match &self.slice {
            Slice::Turning(slice) => {
                let q = exp(along);
                let x = 0.5 * slice.sigma * (q - 1.0 / q);
                let x2 = x * x;
                let w = x * omega(&slice.law, slice.c_h, x2);
                let (theta, ln_theta) = (slice.theta_h / (1.0 + x2), slice.ln_theta_h - ln_1p(x2));
                Place { theta, ln_theta, ln_u: turning(w).ln_u }
            }
            Slice::Direct(slice) => {
                let grow = exp(along);
                let w = slice.sign * (2.0 * direct_e(&slice.law, slice.phi_a, slice.friction_a, along, grow)).sqrt();
                Place { theta: slice.theta_a * grow, ln_theta: slice.ln_theta_a + along, ln_u: turning(w).ln_u }
            }
        }
    }
}

/// Layers of the turning point to one unit of `sinh p`: balances the two kinds of singularity in the `p` plane.
const LAYERS: f64 = 1.5;

/// Nodes beyond which a panel is cut in two.
const MOST_NODES: f64 = 64.0;

/// Most panels of an arc.
const MOST_PANELS: u32 = 64;

/// Sums over equal panels of a line, with as many Gauss nodes as the nearest singularity asks for.
fn panels<const N: usize>(line: &Line<N>, tolerance: f64, kernel: impl Fn(f64, f64, &Rule) -> Sums) -> Sums {
    let &Line { start, length, .. } = line;
    let (count, nodes) = line.cut(MOST_NODES, MOST_PANELS, tolerance);
    let rule = rule(LANES * (nodes / LANES as f64).ceil().max(1.0) as usize);
    let half = 0.5 * length / f64::from(count);
    let mut total =
        Sums { time: 0.0, lag: 0.0, work: 0.0, sensitivity: 0.0, swing: 0.0, friction_min: f64::INFINITY, nodes: 0 };
    for panel in 0..count {
        let sums = kernel(start + half * f64::from(2 * panel + 1), half, rule);
        total.time += sums.time;
        total.lag += sums.lag;
        total.work += sums.work;
        total.sensitivity += sums.sensitivity;
        total.swing += sums.swing;
        total.friction_min = total.friction_min.min(sums.friction_min);
        total.nodes += sums.nodes;
    }
    total
}

/// Gauss nodes for relative accuracy `tolerance` on a panel: the Bernstein ellipse through the nearest singularity.
fn nodes_needed(middle: f64, half: f64, singular: &[(f64, f64)], tolerance: f64) -> f64 {
    let mut least = f64::INFINITY;
    for &(re, im) in singular {
        let (x, y) = ((re - middle) / half, im / half);
        let foci = ((x - 1.0) * (x - 1.0) + y * y).sqrt() + ((x + 1.0) * (x + 1.0) + y * y).sqrt();
        least = least.min(foci);
    }
    let rho = 0.5 * (least + (least * least - 4.0).max(0.0).sqrt());
    (-ln(tolerance) + MARGIN) / (2.0 * ln(rho.min(1e6)))
}

/// Safety of the node estimate: `e^MARGIN` is the ratio of the error constant to the integral.
const MARGIN: f64 = 2.0;

/// `asinh x` without cancellation.
fn asinh(x: f64) -> f64 {
    let t = x.abs();
    ln_1p(t + t * t / (1.0 + (1.0 + t * t).sqrt())).copysign(x)
}

/// `asinh(m e^{i pi/4})` as `(real, imaginary)`.
fn asinh_diagonal(m: f64) -> (f64, f64) {
    // sinh(x + iy) = sinh x cos y + i cosh x sin y with equal parts q = m/sqrt 2: sinh^2 x solves s^2 + s (1 - 2 q^2) -
    // q^2 = 0.
    let q2 = 0.5 * m * m;
    let h = 0.5 - q2;
    let root = (h * h + q2).sqrt();
    let s = if h > 0.0 { q2 / (root + h) } else { root - h };
    let sin_y = (q2 / (1.0 + s)).sqrt().min(1.0);
    (asinh(s.sqrt()), libm::asin(sin_y))
}

/// `acosh(1/sigma)` for `0 < sigma <= 1`.
fn acosh_inverse(sigma: f64) -> f64 {
    asinh(((1.0 - sigma) * (1.0 + sigma)).sqrt() / sigma)
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

/// Constants of the kernel of the turning chart.
struct TurningSlice {
    law: Law,
    theta_h: f64,
    ln_theta_h: f64,
    c_h: f64,
    sigma: f64,
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn turning_kernel(arc: &TurningSlice, middle: f64, half: f64, rule: &Rule) -> Sums {
    let Law { a, b } = arc.law;
    let (mut time, mut lag, mut work, mut sensitivity) = ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let (mut swing, mut friction_min) = ([0.0; LANES], [f64::INFINITY; LANES]);
    for (x, weight) in rule.x.chunks_exact(LANES).zip(rule.w.chunks_exact(LANES)) {
        let (mut w, mut om, mut x2, mut cosh, mut ln_theta) =
            ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let q = exp(middle + half * x[i]);
            let inverse = 1.0 / q;
            let big_x = 0.5 * arc.sigma * (q - inverse);
            cosh[i] = 0.5 * (q + inverse);
            x2[i] = big_x * big_x + 1e-280;
            let l = ln_1p(x2[i]);
            ln_theta[i] = arc.ln_theta_h - l;
            om[i] = (2.0 / a * (arc.c_h / (1.0 + x2[i]) + (a - b) * (l / x2[i]))).sqrt();
            w[i] = big_x * om[i];
        }
        let (z, slope) = turning_lanes(&w);
        for i in 0..LANES {
            // X/(u - 1), regular at the turning point.
            let ratio = 1.0 / (om[i] * slope[i]);
            let shrink = 1.0 / (1.0 + x2[i]);
            let g = weight[i] * cosh[i] * ratio * shrink;
            let d = w[i] * slope[i];
            let u = 1.0 + d;
            let friction = 1.0 + a * z[i] + (b - a) * ln_theta[i];
            let dt = g * shrink;
            time[i] += dt;
            lag[i] += dt * u;
            work[i] += g * u * friction;
            sensitivity[i] += dt * (1.0 - u * ratio * ratio * ((b - a) / a) * shrink);
            swing[i] += dt * shrink * u / (d * d);
            friction_min[i] = if friction < friction_min[i] { friction } else { friction_min[i] };
        }
    }
    let scale = 2.0 * arc.sigma * half;
    Sums {
        time: scale * arc.theta_h * fold(&time),
        lag: scale * arc.theta_h * fold(&lag),
        work: scale * fold(&work),
        sensitivity: scale * arc.theta_h * fold(&sensitivity),
        swing: scale * arc.theta_h * arc.theta_h * fold(&swing),
        friction_min: least(&friction_min),
        nodes: rule.x.len() as u32,
    }
}

/// Constants of the kernel of the direct chart.
struct DirectSlice {
    law: Law,
    theta_a: f64,
    ln_theta_a: f64,
    phi_a: f64,
    slope_a: f64,
    friction_a: f64,
    sign: f64,
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn direct_kernel(arc: &DirectSlice, middle: f64, half: f64, rule: &Rule) -> Sums {
    let Law { a, b } = arc.law;
    let (mut time, mut lag, mut work, mut sensitivity) = ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let mut friction_min = [f64::INFINITY; LANES];
    for (x, weight) in rule.x.chunks_exact(LANES).zip(rule.w.chunks_exact(LANES)) {
        let (mut w, mut grow, mut ln_theta) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let y = middle + half * x[i];
            grow[i] = exp(y);
            ln_theta[i] = arc.ln_theta_a + y;
            w[i] = arc.sign * (2.0 * direct_e(&arc.law, arc.phi_a, arc.friction_a, y, grow[i])).sqrt();
        }
        let (z, slope) = turning_lanes(&w);
        for i in 0..LANES {
            let d = w[i] * slope[i];
            let u = 1.0 + d;
            let dt = -weight[i] * grow[i] / d;
            let friction = 1.0 + a * z[i] + (b - a) * ln_theta[i];
            time[i] += dt;
            lag[i] += dt * u;
            work[i] -= weight[i] / d * u * friction;
            sensitivity[i] -= dt * grow[i] * u / (d * d);
            friction_min[i] = if friction < friction_min[i] { friction } else { friction_min[i] };
        }
    }
    Sums {
        time: half * arc.theta_a * fold(&time),
        lag: half * arc.theta_a * fold(&lag),
        work: half * fold(&work),
        sensitivity: half * arc.theta_a * arc.slope_a * fold(&sensitivity),
        swing: -half * arc.theta_a * arc.theta_a * fold(&sensitivity),
        friction_min: least(&friction_min),
        nodes: rule.x.len() as u32,
    }
}
