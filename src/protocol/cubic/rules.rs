//! Which quadrature a shortcut needs: chosen from the zeros of theta and of `1 - theta'` before the first node is
//! spent.
//!
//! The integrand of the work has poles where `theta = 0` and logarithms where `theta = 0` or `theta' = 1`. On an
//! interval, Gauss-Legendre converges like `rho^(-2n)`, `rho` the Bernstein ellipse through the nearest singularity.
//! Where that is slow, a change of variable moves the singularities away: `x = r ± s^p` about a real zero `r` beyond an
//! end (roots only, no transcendental function), or `x = c + h sinh y` over a complex pair `c ± i h`. Where neither
//! does, the interval is cut.

use multiversion::multiversion;

use super::path::Path;
use crate::numerics::cubic::{self, cubic_zeros, quadratic_zeros};
use crate::numerics::elementary::{exp, ln, ln_1p};
use crate::numerics::lanes::{LANES, Lanes, least};

/// A change of variable on a panel, relative to a `centre`: `delta = x - centre`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Map {
    /// `delta = s`.
    Line,
    /// `delta = side (gap - s^(2^squarings))`: about a zero at `centre + side gap` beyond the end `centre`, `side =
    /// ±1`.
    Power {
        /// Which end: +1 the upper, -1 the lower.
        side: f64,
        /// Distance of the zero from the end.
        gap: f64,
        /// log2 of the power.
        squarings: u32,
    },
    /// `delta = height sinh s`.
    Sinh {
        /// Imaginary part of the pair above `centre`.
        height: f64,
    },
}

/// One panel of a quadrature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Panel {
    /// Expansion point of the polynomials.
    pub centre: f64,
    pub map: Map,
    /// Bounds of the mapped variable.
    pub from: f64,
    pub to: f64,
    /// Gauss nodes.
    pub nodes: usize,
}

/// Nodes that are taken without looking for a better map: the search costs as much as some sixteen nodes.
const PLAIN: usize = 32;
/// Nodes from which the sinh map is tried.
const POOR: usize = 40;
/// Nodes beyond which a panel is cut.
const LONG: usize = 80;
/// Most nodes of one panel.
const MOST_NODES: usize = 256;
/// Depth of cutting: a panel is never shorter than `2^-12` of its parent's share.
const DEEPEST: u32 = 12;
/// Safety of the estimate: `e^MARGIN` stands for the residues' share in the integral.
const MARGIN: f64 = 3.5;

/// The accuracy asked for, as the focal sums (see [`focal`]) from which a number of nodes is enough.
#[derive(Debug, Clone)]
pub(super) struct Accuracy {
    /// Element `i` is for `(i + 1) LANES` nodes; falling.
    focal: [f64; MOST_NODES / LANES],
}

impl Accuracy {
    /// For a relative accuracy `tolerance`.
    pub fn new(tolerance: f64) -> Accuracy {
        let digits = MARGIN - ln(tolerance);
        let mut focal = [0.0; MOST_NODES / LANES];
        for (i, focal) in focal.iter_mut().enumerate() {
            // rho + 1/rho with rho^(2 nodes) = e^digits.
            let ln_rho = 0.5 * digits / ((i + 1) * LANES) as f64;
            *focal = exp(ln_rho) + exp(-ln_rho);
        }
        Accuracy { focal }
    }

    /// The focal sum from which `nodes` are enough.
    #[inline(always)]
    pub fn enough(&self, nodes: usize) -> f64 {
        self.focal[nodes / LANES - 1]
    }

    /// The nodes that a focal sum asks for; `MOST_NODES` where that is not enough.
    pub fn nodes(&self, focal: f64) -> usize {
        let more = self.focal.iter().position(|&enough| focal >= enough);
        more.map_or(MOST_NODES, |i| (i + 1) * LANES)
    }
}

/// The zeros of theta and of `1 - theta'` of one shortcut, filled up to a full set of lanes with places too far away to
/// matter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Zeros {
    re: Lanes,
    im: Lanes,
}

/// Zeros of theta and of `1 - theta'`: three and two.
pub(super) const ZEROS: usize = 5;

/// Zeros are not put farther away than this.
pub(super) const FAR: f64 = 1e9;

/// Zeros of theta and of `1 - theta'` for several shortcuts side by side: cheaper than [`Zeros::of`], and not as good
/// for a close pair at the start.
#[inline(always)]
pub(super) fn zeros(path: &Path) -> cubic::Zeros<ZEROS> {
    let (theta, n) = path.about_end();
    let (q, r) = (cubic_zeros(theta), quadratic_zeros(n));
    let (mut re, mut im) =
        ([q.re[0], q.re[1], q.re[2], r.re[0], r.re[1]], [q.im[0], q.im[1], q.im[2], r.im[0], r.im[1]]);
    let start = path.about_start().0;
    for k in 0..ZEROS {
        let (u, y) = (clamp(re[k]), clamp(im[k]));
        // A zero close to the start, where theta may be as small, lost its digits in the expansion about the end.
        let x = 1.0 + u;
        let near = k < 3 && u < -0.5;
        let (x_start, y_start) = polished(&start, x, y);
        re[k] = if near { x_start } else { x };
        im[k] = if near { y_start } else { y };
    }
    cubic::Zeros { re, im }
}

/// One Newton step towards the zero of a cubic near `x + iy`; a step that is no mere correction is not taken.
#[inline(always)]
fn polished(c: &[f64; 4], x: f64, y: f64) -> (f64, f64) {
    let [c0, c1, c2, c3] = *c;
    // Value and derivative by Horner's scheme: complex, with imaginary parts factored as i y.
    let (p, q) = (c2 + c3 * x, c3);
    let (p, q) = (c1 + p * x - q * y * y, p + q * x);
    let (value, value_i) = (c0 + p * x - q * y * y, p + q * x);
    let (slope, slope_i) = (c1 + x * (2.0 * c2 + 3.0 * c3 * x) - 3.0 * c3 * y * y, 2.0 * c2 + 6.0 * c3 * x);
    let (value_i, slope_i) = (value_i * y, slope_i * y);
    let norm = slope * slope + slope_i * slope_i + f64::MIN_POSITIVE;
    let step = (value * slope + value_i * slope_i) / norm;
    let step_i = (value_i * slope - value * slope_i) / norm;
    let small = step.abs() + step_i.abs() < LARGEST_CORRECTION;
    (if small { x - step } else { x }, if small { (y - step_i).abs() } else { y })
}

/// Zeros are found to a few digits of the farthest; what is left to correct is less than this.
const LARGEST_CORRECTION: f64 = 1e-3;

/// `x` within `[-FAR, FAR]`; what is not a number is far away.
#[inline(always)]
fn clamp(x: f64) -> f64 {
    let x = if x < FAR { x } else { FAR };
    if x > -FAR { x } else { -FAR }
}

impl Zeros {
    /// The zeros of one shortcut: those of theta from its expansions about the start and about the end, each good on
    /// its own side.
    pub fn of(path: &Path) -> Zeros {
        let (theta, n) = path.about_end();
        let (start, end, turns) = (cubic_zeros(path.about_start().0), cubic_zeros(theta), quadratic_zeros(n));
        let mut zeros = Zeros { re: [FAR; LANES], im: [0.0; LANES] };
        for k in 0..3 {
            // The sides overlap, so that none is lost between them.
            if start.re[k] < 0.6 {
                (zeros.re[k], zeros.im[k]) = (clamp(start.re[k]), clamp(start.im[k]));
            }
            if end.re[k] > -0.6 {
                (zeros.re[3 + k], zeros.im[3 + k]) = (1.0 + clamp(end.re[k]), clamp(end.im[k]));
            }
        }
        for k in 0..2 {
            (zeros.re[6 + k], zeros.im[6 + k]) = (1.0 + clamp(turns.re[k]), clamp(turns.im[k]));
        }
        zeros
    }
}

/// Appends the panels that integrate over `[low, high]`.
pub(super) fn choose(zeros: &Zeros, low: f64, high: f64, accuracy: &Accuracy, depth: u32, panels: &mut Vec<Panel>) {
    let (mut panel, focal) = best_panel(zeros, low, high, accuracy);
    panel.nodes = accuracy.nodes(focal);
    if panel.nodes > LONG && depth < DEEPEST {
        let cut = cut_at(zeros, low, high);
        choose(zeros, low, cut, accuracy, depth + 1, panels);
        choose(zeros, cut, high, accuracy, depth + 1, panels);
    } else {
        panels.push(panel);
    }
}

/// The map with the largest Bernstein ellipse, and its focal sum. A costlier map must be clearly better: `focal - 2`
/// goes like the inverse square of the number of nodes.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn best_panel(zeros: &Zeros, low: f64, high: f64, accuracy: &Accuracy) -> (Panel, f64) {
    let mut best = line(zeros, low, high);
    let mut largest = 2.0;
    let plain = accuracy.enough(PLAIN);
    let gaps = [real_gap(zeros, high, 1.0), real_gap(zeros, low, -1.0)];
    let (nearest, gap, other) = if gaps[0] <= gaps[1] { (1.0, gaps[0], gaps[1]) } else { (-1.0, gaps[1], gaps[0]) };
    // A real zero this near rules the plain rule out before its ellipse is computed.
    let hopeless = 2.0 + 4.0 * gap / (high - low) < plain;
    if !hopeless {
        largest = focal(&zeros.re, &zeros.im, low, high);
        if largest >= plain {
            return (best, largest);
        }
    }
    for (side, gap) in [(nearest, gap), (-nearest, other)] {
        power(zeros, low, high, side, gap, plain, &mut best, &mut largest);
        if largest >= plain {
            return (best, largest);
        }
    }
    if hopeless {
        let straight = focal(&zeros.re, &zeros.im, low, high);
        if straight > largest {
            (best, largest) = (line(zeros, low, high), straight);
        }
    }
    if largest < accuracy.enough(POOR) {
        sinh(zeros, low, high, &mut best, &mut largest);
    }
    (best, largest)
}

/// The straight rule, expanded about the end that is nearer to the most hindering zero: the polynomials are small
/// there.
#[inline(always)]
fn line(zeros: &Zeros, low: f64, high: f64) -> Panel {
    let centre = if 2.0 * zeros.re[hindrance(zeros, low, high)] > low + high { high } else { low };
    Panel { centre, map: Map::Line, from: low - centre, to: high - centre, nodes: 0 }
}

/// The least sum of the distances of the places `(re, im)` from both ends of `[from, to]`, in units of half its length:
/// 2 on the interval itself.
#[inline(always)]
fn focal(re: &Lanes, im: &Lanes, from: f64, to: f64) -> f64 {
    2.0 * least(&distances(re, im, from, to)) / (to - from).abs()
}

/// The sums of the distances from both ends.
#[inline(always)]
fn distances(re: &Lanes, im: &Lanes, from: f64, to: f64) -> Lanes {
    let mut sums = [0.0; LANES];
    for i in 0..LANES {
        let (u, v, y2) = (re[i] - from, re[i] - to, im[i] * im[i]);
        sums[i] = (u * u + y2).sqrt() + (v * v + y2).sqrt();
    }
    sums
}

/// Distance of the nearest real zero beyond the end on that side.
#[inline(always)]
fn real_gap(zeros: &Zeros, end: f64, side: f64) -> f64 {
    let mut gaps = zeros.re.map(|re| side * (re - end));
    for (gap, im) in gaps.iter_mut().zip(zeros.im) {
        *gap = if im == 0.0 && *gap > 0.0 { *gap } else { FAR };
    }
    least(&gaps)
}

/// Tries the power maps about the real zero a `gap` beyond the upper (`side = 1`) or the lower end, as long as they
/// gain.
#[allow(clippy::too_many_arguments)]
#[inline(always)]
fn power(zeros: &Zeros, low: f64, high: f64, side: f64, gap: f64, plain: f64, best: &mut Panel, largest: &mut f64) {
    let end = if side > 0.0 { high } else { low };
    let length = high - low;
    if gap > 0.5 * length {
        return;
    }
    // Distances from the zero, to be rooted again and again.
    let (mut near, mut far) = (gap, gap + length);
    let (mut re, mut im) = (zeros.re.map(|re| gap + side * (end - re)), zeros.im);
    for squarings in 1..=3 {
        (near, far) = (near.sqrt(), far.sqrt());
        for i in 0..LANES {
            (re[i], im[i]) = complex_sqrt(re[i], im[i]);
        }
        // The zero itself is mapped to 0.
        let image = focal(&re, &im, near, far).min(2.0 * (near + far) / (far - near));
        if image - 2.0 <= 1.2 * (*largest - 2.0) {
            return;
        }
        *largest = image;
        *best = Panel { centre: end, map: Map::Power { side, gap, squarings }, from: near, to: far, nodes: 0 };
        if image >= plain {
            return;
        }
    }
}

/// Tries the sinh map over the complex pair that hinders most.
#[inline(always)]
fn sinh(zeros: &Zeros, low: f64, high: f64, best: &mut Panel, largest: &mut f64) {
    let hindrance = hindrance(zeros, low, high);
    let (centre, height) = (zeros.re[hindrance], zeros.im[hindrance]);
    if height == 0.0 {
        return;
    }
    let (from, to) = (asinh((low - centre) / height), asinh((high - centre) / height));
    let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        (re[i], im[i]) = complex_asinh((zeros.re[i] - centre) / height, zeros.im[i] / height);
    }
    let image = focal(&re, &im, from, to);
    if image - 2.0 > 2.0 * (*largest - 2.0) {
        *largest = image;
        *best = Panel { centre, map: Map::Sinh { height }, from, to, nodes: 0 };
    }
}

/// The zero with the smallest ellipse.
#[inline(always)]
fn hindrance(zeros: &Zeros, low: f64, high: f64) -> usize {
    let sums = distances(&zeros.re, &zeros.im, low, high);
    (1..LANES).fold(0, |best, i| if sums[i] < sums[best] { i } else { best })
}

/// Where to cut: below the hindrance if that lies inside, else in the middle.
fn cut_at(zeros: &Zeros, low: f64, high: f64) -> f64 {
    let length = high - low;
    let re = zeros.re[hindrance(zeros, low, high)];
    if re > low + 0.05 * length && re < high - 0.05 * length { re } else { 0.5 * (low + high) }
}

/// The square root in the first quadrant or on its border, for `im >= 0` up to the sign of `im`.
#[inline(always)]
pub(super) fn complex_sqrt(re: f64, im: f64) -> (f64, f64) {
    let size = (re * re + im * im).sqrt();
    let root = (0.5 * (size + re.abs())).sqrt();
    // The smallest normal number keeps 0/0 away.
    let other = 0.5 * im.abs() / (root + f64::MIN_POSITIVE);
    if re >= 0.0 { (root, other) } else { (other, root) }
}

fn asinh(x: f64) -> f64 {
    let t = x.abs();
    ln_1p(t + t * t / (1.0 + (1.0 + t * t).sqrt())).copysign(x)
}

/// `asinh(x + iy)` for `y >= 0`, up to the signs that the estimate does not need.
fn complex_asinh(x: f64, y: f64) -> (f64, f64) {
    // asinh z = ln(z + sqrt(1 + z^2)), with the sign of x taken out so that nothing cancels.
    let t = x.abs();
    let (re, im) = complex_sqrt(1.0 + (t - y) * (t + y), 2.0 * t * y);
    let (re, im) = (t + re, y + im);
    let size = re * re + im * im;
    ((0.5 * ln(size.max(1e-300))).copysign(x), libm::atan2(im, re))
}
