//! Which quadrature a shortcut needs: chosen from the zeros of theta and of `1 - theta'` before the first node is spent.
//!
//! The integrand of the work has poles where `theta = 0` and logarithms where `theta = 0` or `theta' = 1`. On an interval, Gauss-Legendre
//! converges like `rho^(-2n)`, `rho` the Bernstein ellipse through the nearest singularity. Where that is slow, a change of variable moves the
//! singularities away: `x = r ± s^p` about a real zero `r` beyond an end (roots only, no transcendental function), or `x = c + h sinh y` over a
//! complex pair `c ± i h`. Where neither does, the interval is cut.

use super::path::Path;
use crate::numerics::cubic::{Zero, cubic_zeros, quadratic_zeros};
use crate::numerics::elementary::{exp, ln, ln_1p};

/// A change of variable on a panel, relative to a `centre`: `delta = x - centre`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Map {
    /// `delta = s`.
    Line,
    /// `delta = side (gap - s^(2^squarings))`: about a zero at `centre + side gap` beyond the end `centre`, `side = ±1`.
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
    pub nodes: f64,
}

/// Nodes up to which the plain rule is taken without looking for a better one.
const PLAIN: f64 = 24.0;
/// Nodes beyond which a panel is cut if that helps.
const LONG: f64 = 80.0;
/// Most nodes of one panel.
pub(super) const MOST_NODES: f64 = 256.0;
/// Depth of cutting: a panel is never shorter than `2^-12` of its parent's share.
const DEEPEST: u32 = 12;
/// Safety of the estimate: `e^MARGIN` stands for the residues' share in the integral.
const MARGIN: f64 = 3.0;

/// The zeros of one shortcut.
pub(super) struct Zeros {
    all: [Option<Zero>; 5],
}

impl Zeros {
    /// Zeros of theta (from its expansion about `x = 1`, where it is smallest in an acceleration) and of `1 - theta'`.
    pub fn of(path: &Path) -> Zeros {
        let mut theta = cubic_zeros(path.theta.about(1.0));
        for zero in theta.iter_mut().flatten() {
            zero.re += 1.0;
        }
        let c = path.n.c.map(|c| c.high);
        let n = quadratic_zeros([c[0], c[1], c[2]]);
        let upper = |zero: Option<Zero>| zero.map(|z| Zero { re: z.re, im: z.im.abs() });
        Zeros { all: [upper(theta[0]), upper(theta[1]), upper(theta[2]), upper(n[0]), upper(n[1])] }
    }

    fn each(&self) -> impl Iterator<Item = Zero> + '_ {
        self.all.iter().flatten().copied()
    }
}

/// Appends the panels that integrate over `[low, high]` to relative accuracy `tolerance`.
pub(super) fn choose(zeros: &Zeros, low: f64, high: f64, tolerance: f64, depth: u32, panels: &mut Vec<Panel>) {
    let digits = MARGIN - ln(tolerance);
    let plain = line(zeros, low, high, digits);
    if plain.nodes <= PLAIN {
        panels.push(plain);
        return;
    }
    let mut best = plain;
    for side in [1.0, -1.0] {
        if let Some(panel) = power(zeros, low, high, side, digits).filter(|p| p.nodes < 0.9 * best.nodes) {
            best = panel;
        }
    }
    if best.nodes > PLAIN + 16.0 {
        if let Some(panel) = sinh(zeros, low, high, digits).filter(|p| p.nodes < 0.7 * best.nodes) {
            best = panel;
        }
    }
    if best.nodes > LONG && depth < DEEPEST {
        let cut = cut_at(zeros, low, high);
        choose(zeros, low, cut, tolerance, depth + 1, panels);
        choose(zeros, cut, high, tolerance, depth + 1, panels);
    } else {
        best.nodes = best.nodes.min(MOST_NODES);
        panels.push(best);
    }
}

/// Gauss nodes for `digits` (a natural logarithm) on `[from, to]` with singularities given by their sum of distances to the ends: the least sum of
/// the focal distances in units of the half length.
fn nodes(focal: f64, digits: f64) -> f64 {
    let rho = 0.5 * (focal + (focal * focal - 4.0).max(0.0).sqrt());
    digits / (2.0 * ln(rho.min(1e8).max(1.0 + 1e-12)))
}

/// Sum of the distances of `(re, im)` from both ends of `[from, to]`, in units of half its length: 2 on the interval.
fn focal(re: f64, im: f64, from: f64, to: f64) -> f64 {
    let (u, v) = (re - from, re - to);
    2.0 * ((u * u + im * im).sqrt() + (v * v + im * im).sqrt()) / (to - from).abs()
}

fn line(zeros: &Zeros, low: f64, high: f64, digits: f64) -> Panel {
    let least = zeros.each().map(|z| focal(z.re, z.im, low, high)).fold(f64::INFINITY, f64::min);
    Panel { centre: high, map: Map::Line, from: low - high, to: 0.0, nodes: nodes(least, digits) }
}

/// The best power map about the nearest real zero beyond the upper (`side = 1`) or the lower end.
fn power(zeros: &Zeros, low: f64, high: f64, side: f64, digits: f64) -> Option<Panel> {
    let end = if side > 0.0 { high } else { low };
    let gap = zeros
        .each()
        .filter(|z| z.im == 0.0)
        .map(|z| side * (z.re - end))
        .filter(|&gap| gap > 0.0)
        .fold(f64::INFINITY, f64::min);
    let length = high - low;
    if gap > 0.5 * length {
        return None;
    }
    // Distances from the zero, to be rooted again and again.
    let mut near = gap;
    let mut far = gap + length;
    let mut images: [Option<(f64, f64)>; 5] =
        zeros.all.map(|z| z.map(|z| (side * (end - z.re) + gap, side * z.im)));
    let mut best: Option<Panel> = None;
    for squarings in 1..=3 {
        (near, far) = (near.sqrt(), far.sqrt());
        for image in images.iter_mut().flatten() {
            *image = complex_sqrt(*image);
        }
        let least = images
            .iter()
            .flatten()
            .map(|&(re, im)| focal(re, im, near, far))
            .fold(focal(0.0, 0.0, near, far), f64::min);
        let count = nodes(least, digits);
        if best.is_none_or(|b| count < 0.9 * b.nodes) {
            best = Some(Panel { centre: end, map: Map::Power { side, gap, squarings }, from: near, to: far, nodes: count });
        }
    }
    best
}

/// The sinh map over the complex pair that hinders most.
fn sinh(zeros: &Zeros, low: f64, high: f64, digits: f64) -> Option<Panel> {
    let pair = hindrance(zeros, low, high).filter(|z| z.im > 0.0)?;
    let (centre, height) = (pair.re, pair.im);
    let (from, to) = (asinh((low - centre) / height), asinh((high - centre) / height));
    let least = zeros
        .each()
        .map(|z| {
            let (re, im) = complex_asinh((z.re - centre) / height, z.im / height);
            focal(re, im, from, to)
        })
        .fold(f64::INFINITY, f64::min);
    Some(Panel { centre, map: Map::Sinh { height }, from, to, nodes: nodes(least, digits) })
}

/// The zero with the smallest ellipse.
fn hindrance(zeros: &Zeros, low: f64, high: f64) -> Option<Zero> {
    let size = |z: &Zero| focal(z.re, z.im, low, high);
    zeros.each().min_by(|x, y| size(x).total_cmp(&size(y)))
}

/// Where to cut: below the hindrance if that lies inside, else in the middle.
fn cut_at(zeros: &Zeros, low: f64, high: f64) -> f64 {
    let length = high - low;
    match hindrance(zeros, low, high) {
        Some(z) if z.re > low + 0.05 * length && z.re < high - 0.05 * length => z.re,
        _ => 0.5 * (low + high),
    }
}

fn complex_sqrt((re, im): (f64, f64)) -> (f64, f64) {
    let size = (re * re + im * im).sqrt();
    let root = (0.5 * (size + re.abs())).sqrt();
    let other = if root > 0.0 { 0.5 * im.abs() / root } else { 0.0 };
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
    let (re, im) = complex_sqrt((1.0 + (t - y) * (t + y), 2.0 * t * y));
    let (re, im) = (t + re, y + im);
    let size = re * re + im * im;
    ((0.5 * ln(size.max(1e-300))).copysign(x), libm::atan2(im, re))
}

impl Map {
    /// The place and the Jacobian of the mapped variable: `(delta, d delta/ds)`.
    #[inline(always)]
    pub fn apply(&self, s: f64) -> (f64, f64) {
        match *self {
            Map::Line => (s, 1.0),
            Map::Power { side, gap, squarings } => {
                let mut power = s;
                let mut jacobian = 1.0;
                for _ in 0..squarings {
                    jacobian *= 2.0 * power;
                    power *= power;
                }
                (side * (gap - power), jacobian)
            }
            Map::Sinh { height } => {
                let q = exp(s);
                let inverse = 1.0 / q;
                (0.5 * height * (q - inverse), 0.5 * height * (q + inverse))
            }
        }
    }
}
