//! The quadrature of a shortcut, determined in advance from the zeros of theta and of `1 - theta'`.
//!
//! The integrand of the work has poles where `theta = 0` and logarithms where `theta = 0` or `theta' = 1`. On an interval, Gauss-Legendre
//! converges like `rho^(-2n)`, `rho` the Bernstein ellipse through the nearest singularity. If that is slow, a change of variable increases the
//! distance of the singularities: `x = r ± s^p` about a real zero `r` beyond an end (roots only, no transcendental function), or `x = c + h sinh
//! y` near a complex pair `c ± i h`. If neither helps, the interval is cut.

use multiversion::multiversion;

use super::bins::BINS;
use super::path::Path;
use crate::model::Law;
use crate::numerics::cubic::{self, cubic_zeros, quadratic_zeros};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::{exp, ln, ln_1p};
use crate::numerics::gauss::rule;
use crate::numerics::lanes::{LANES, Lanes, least};

/// A change of variable on a panel, relative to a `centre`: `delta = x - centre`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum PanelMap {
    /// `delta = s`.
    Line,
    /// `delta = side (gap - s^(2^squarings))`: about a zero at `centre + side gap` beyond the end `centre`, `side =
    /// ±1`.
    Power {
        /// The end: +1 the upper, -1 the lower.
        side: f64,
        /// Distance of the zero from the end.
        gap: f64,
        /// log2 of the power.
        squarings: u32,
    },
    /// `delta = height sinh s`.
    Sinh {
        /// Imaginary part of the pair at `centre`.
        height: f64,
    },
}

impl PanelMap {
    /// `delta` at `s`, and its derivative.
    #[inline(always)]
    pub fn place(self, s: f64) -> (f64, f64) {
        match self {
            PanelMap::Line => (s, 1.0),
            PanelMap::Power { side, gap, squarings } => {
                let (mut power, mut jacobian) = (s, 1.0);
                for _ in 0..squarings {
                    jacobian *= 2.0 * power;
                    power *= power;
                }
                (side * (gap - power), jacobian)
            }
            PanelMap::Sinh { height } => {
                let q = exp(s);
                let inverse = 1.0 / q;
                (0.5 * height * (q - inverse), 0.5 * height * (q + inverse))
            }
        }
    }
}

/// One panel of a quadrature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MappedPanel {
    /// Expansion point of the polynomials.
    pub centre: f64,
    pub map: PanelMap,
    /// Bounds of the mapped variable.
    pub from: f64,
    pub to: f64,
    /// Gauss nodes.
    pub nodes: usize,
}

impl MappedPanel {
    /// Visits the distance from the centre and the weight of every node.
    pub fn each_node(&self, mut visit: impl FnMut(f64, f64)) {
        let rule = rule(self.nodes);
        let (middle, half) = (0.5 * (self.from + self.to), 0.5 * (self.to - self.from));
        for (x, w) in rule.x.iter().zip(&rule.w) {
            let (delta, jacobian) = self.map.place(middle + half * x);
            visit(delta, half * w * jacobian);
        }
    }
}

/// Number of nodes up to which no better map is searched. Measured: the search costs as much as about sixteen nodes, and a larger power cannot save
/// many (`cargo bench --bench landscape`).
pub(super) const MAX_CHEAP_NODES: usize = 32;
/// Number of nodes above which a panel is cut: that of the last bin.
const MAX_UNCUT_NODES: usize = BINS * NODE_STEP;
/// Greatest number of nodes of a panel. Chosen: more than any panel needs after cuts.
const MAX_NODES: usize = 256;
/// Step of the number of nodes. Chosen: half of the lanes; a smaller step has more bins to fill, a larger one more spare nodes.
pub(super) const NODE_STEP: usize = 4;
/// Greatest depth of cuts: a panel is never shorter than `2^-12` of its parent. Chosen: it only ends the recursion.
const MAX_DEPTH: u32 = 12;
/// Safety margin of the estimate: `e^LN_SAFETY_FACTOR` bounds the ratio of the residues to the integral. Measured: `tests/budgets.csv` has the remaining
/// errors.
const LN_SAFETY_FACTOR: f64 = 3.5;

/// The requested accuracy, as the focal sums (see [`focal`]) from which a number of nodes suffices.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NodeThresholds {
    /// The focal sums from which nodes suffice: element `i` belongs to `(i + 1) NODE_STEP` nodes; descending.
    pub focal: [f64; MAX_NODES / NODE_STEP],
    /// ln rho from which [`NODE_STEP`] nodes suffice.
    pub pace: f64,
    /// Greatest relative error of theta.
    pub rounding: f64,
    /// Greatest relative error of n, through its logarithm; 0 if sums without logarithms lose too many digits.
    pub slight: f64,
    /// Greatest slip at constant velocity for which sums without logarithms keep enough digits.
    pub longest: f64,
}

/// The focal sums from which [`NODE_STEP`] nodes suffice for `tolerance`, then twice as many, and so on.
fn focal_sums(tolerance: f64) -> [f64; MAX_NODES / NODE_STEP] {
    let mut focal = [0.0; MAX_NODES / NODE_STEP];
    for (i, focal) in focal.iter_mut().enumerate() {
        // rho + 1/rho.
        let ln_rho = pace(tolerance) / (i + 1) as f64;
        *focal = exp(ln_rho) + exp(-ln_rho);
    }
    focal
}

/// ln rho from which [`NODE_STEP`] nodes suffice for `tolerance`: `rho^(2 nodes) = e^digits`.
fn pace(tolerance: f64) -> f64 {
    0.5 * (LN_SAFETY_FACTOR - ln(tolerance)) / NODE_STEP as f64
}

impl NodeThresholds {
    /// The accuracy for a relative `tolerance` of the work, with a slip of at most `most`.
    pub fn new(tolerance: f64, law: Law, most: f64) -> NodeThresholds {
        let rounding = 0.1 * tolerance;
        // Without logarithms `tau` is a difference of terms that grow like the slip.
        let longest = rounding / ((law.b - law.a).abs() * f64::EPSILON);
        // A pair of zeros that needs no cut is at least as far from the real axis as the height of the smallest ellipse, in units of half the
        // panel; theta there is at least of the order of its square.
        let height = 0.5 * (LN_SAFETY_FACTOR - ln(tolerance)) / MAX_UNCUT_NODES as f64;
        let slight = if most <= longest * (0.25 * height * height) { rounding / law.a } else { 0.0 };
        NodeThresholds { focal: focal_sums(tolerance), pace: pace(tolerance), rounding, slight, longest }
    }

    /// The focal sum from which `nodes` suffice.
    #[inline(always)]
    pub fn enough(&self, nodes: usize) -> f64 {
        self.focal[nodes / NODE_STEP - 1]
    }

    /// The number of nodes for a focal sum, a multiple of [`LANES`]; `MAX_NODES` if more would be needed.
    pub fn nodes(&self, focal: f64) -> usize {
        let more = self.focal.iter().position(|&enough| focal >= enough);
        more.map_or(MAX_NODES, |i| ((i + 1) * NODE_STEP).next_multiple_of(LANES))
    }
}

/// The zeros of theta and of `1 - theta'` of one shortcut, padded to all lanes with very distant points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Zeros {
    pub re: Lanes,
    pub im: Lanes,
    /// Real parts minus 1, with all digits of a zero near the end.
    from_end: Lanes,
}

/// Number of zeros: three of theta and two of `1 - theta'`.
pub(super) const ZEROS: usize = 5;

/// Number of zeros of theta, which come first.
pub(super) const THETA_ZEROS: usize = 3;

/// Greatest distance of a zero. Chosen: farther zeros have no effect.
pub(super) const MAX_ZERO_DISTANCE: f64 = 1e9;

/// The zeros of several shortcuts, from the expansion about the end; zeros near the start are not yet [`polished`].
#[inline(always)]
pub(super) fn rough_zeros(theta: [f64; 4], n: [f64; 3]) -> cubic::Zeros<ZEROS> {
    let (q, r) = (cubic_zeros(theta), quadratic_zeros(n));
    let (mut re, mut im) =
        ([q.re[0], q.re[1], q.re[2], r.re[0], r.re[1]], [q.im[0], q.im[1], q.im[2], r.im[0], r.im[1]]);
    for k in 0..ZEROS {
        (re[k], im[k]) = (1.0 + clamp(re[k]), clamp(im[k]));
    }
    cubic::Zeros { re, im }
}

/// Whether a zero is so close to the start that the expansion about the end loses too many digits.
#[inline(always)]
pub(super) fn is_near_start(x: f64, y: f64) -> bool {
    (x.abs() < 0.1) & (y < 0.1)
}

/// The zero of a cubic near `x + iy` after a Newton step, unless the step is too large for a correction.
#[inline(always)]
pub(super) fn polished(c: &[f64; 4], x: f64, y: f64) -> (f64, f64) {
    let [c0, c1, c2, c3] = *c;
    // Value and derivative by Horner's scheme: complex, with imaginary parts factored as i y.
    let (p, q) = (c2 + c3 * x, c3);
    let (p, q) = (c1 + p * x - q * y * y, p + q * x);
    let (value, value_i) = (c0 + p * x - q * y * y, p + q * x);
    let (slope, slope_i) = (c1 + x * (2.0 * c2 + 3.0 * c3 * x) - 3.0 * c3 * y * y, 2.0 * c2 + 6.0 * c3 * x);
    let (value_i, slope_i) = (value_i * y, slope_i * y);
    let norm = slope * slope + slope_i * slope_i + f64::MIN_POSITIVE;
    let scale = 1.0 / norm;
    let step = (value * slope + value_i * slope_i) * scale;
    let step_i = (value_i * slope - value * slope_i) * scale;
    let small = step.abs() + step_i.abs() < MAX_CORRECTION;
    if small { (x - step, (y - step_i).abs()) } else { (x, y) }
}

/// Greatest relative correction of a zero by a Newton step. Chosen: the closed forms give some digits of every zero.
const MAX_CORRECTION: f64 = 1e-3;

/// `x` clamped to `[-MAX_ZERO_DISTANCE, MAX_ZERO_DISTANCE]`; NaN is far away.
#[inline(always)]
fn clamp(x: f64) -> f64 {
    let x = if x < MAX_ZERO_DISTANCE { x } else { MAX_ZERO_DISTANCE };
    if x > -MAX_ZERO_DISTANCE { x } else { -MAX_ZERO_DISTANCE }
}

impl Zeros {
    /// The zeros of one shortcut.
    pub fn of(path: &Path) -> Zeros {
        let mut zeros =
            Zeros { re: [MAX_ZERO_DISTANCE; LANES], im: [0.0; LANES], from_end: [MAX_ZERO_DISTANCE; LANES] };
        let [first, second, third] = path.exact_theta().zeros();
        let [fourth, fifth] = path.zeros_of_n();
        for (k, (re, im)) in [first, second, third, fourth, fifth].into_iter().enumerate() {
            (zeros.re[k], zeros.im[k]) = (clamp(re.high), clamp(im));
            zeros.from_end[k] = clamp((re - DoubleDouble::new(1.0)).high);
        }
        zeros
    }

    /// Real parts minus `place`.
    fn from(&self, place: f64) -> Lanes {
        if place == 1.0 { self.from_end } else { self.re.map(|re| re - place) }
    }
}

/// Least half distance of a pair of zeros of theta that is known to some digits. Derived: the error of the closed form is below half of this.
pub(super) const MIN_THETA_PAIR: f64 = 0.03;

/// Appends the panels that integrate over `[low, high]`.
pub(super) fn choose(
    zeros: &Zeros,
    low: f64,
    high: f64,
    accuracy: &NodeThresholds,
    depth: u32,
    panels: &mut Vec<MappedPanel>,
) {
    let (mut panel, focal) = best_panel(zeros, low, high, accuracy);
    panel.nodes = accuracy.nodes(focal);
    if panel.nodes > MAX_UNCUT_NODES && depth < MAX_DEPTH {
        let cut = cut(low, high, zeros.re[hindrance(zeros, low, high)]);
        choose(zeros, low, cut, accuracy, depth + 1, panels);
        choose(zeros, cut, high, accuracy, depth + 1, panels);
    } else {
        panels.push(panel);
    }
}

/// The map with the largest Bernstein ellipse, and its focal sum. A more expensive map must be clearly better: `focal - 2` scales like the
/// inverse square of the number of nodes.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn best_panel(zeros: &Zeros, low: f64, high: f64, accuracy: &NodeThresholds) -> (MappedPanel, f64) {
    let mut best = (line(zeros, low, high), focal(&zeros.re, &zeros.im, low, high));
    let plain = accuracy.enough(MAX_CHEAP_NODES);
    if best.1 >= plain {
        return best;
    }
    let gaps = [real_gap(zeros, high, 1.0), real_gap(zeros, low, -1.0)];
    let (nearest, gap, other) = if gaps[0] <= gaps[1] { (1.0, gaps[0], gaps[1]) } else { (-1.0, gaps[1], gaps[0]) };
    for (side, gap) in [(nearest, gap), (-nearest, other)] {
        best = power(zeros, [low, high], (side, gap), plain, best);
        if best.1 >= plain {
            return best;
        }
    }
    sinh(zeros, low, high, best)
}

/// The plain rule, expanded about the end nearer to the limiting zero, where the polynomials are small.
#[inline(always)]
fn line(zeros: &Zeros, low: f64, high: f64) -> MappedPanel {
    let centre = if 2.0 * zeros.re[hindrance(zeros, low, high)] > low + high { high } else { low };
    MappedPanel { centre, map: PanelMap::Line, from: low - centre, to: high - centre, nodes: 0 }
}

/// The focal sum: the least sum of the distances of the points `(re, im)` from both ends of `[from, to]`, in units of half its length; 2 on the
/// interval itself.
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
    let mut gaps = zeros.from(end).map(|distance| side * distance);
    for (gap, im) in gaps.iter_mut().zip(zeros.im) {
        *gap = if im == 0.0 && *gap > 0.0 { *gap } else { MAX_ZERO_DISTANCE };
    }
    least(&gaps)
}

/// The better of a panel and the power maps about a real zero `gap` beyond the upper (`side = 1`) or the lower end, with focal sums. Higher
/// powers are tried as long as they help.
#[inline(always)]
fn power(
    zeros: &Zeros,
    [low, high]: [f64; 2],
    (side, gap): (f64, f64),
    plain: f64,
    mut best: (MappedPanel, f64),
) -> (MappedPanel, f64) {
    let end = if side > 0.0 { high } else { low };
    let length = high - low;
    if gap > 0.5 * length {
        return best;
    }
    // Distances from the zero, of which roots are taken repeatedly.
    let (mut near, mut far) = (gap, gap + length);
    let (mut re, mut im) = (zeros.from(end).map(|distance| gap - side * distance), zeros.im);
    for squarings in 1..=3 {
        (near, far) = (near.sqrt(), far.sqrt());
        for i in 0..LANES {
            (re[i], im[i]) = complex_sqrt(re[i], im[i]);
        }
        // The zero itself is mapped to 0.
        let image = focal(&re, &im, near, far).min(2.0 * (near + far) / (far - near));
        if image - 2.0 <= 1.2 * (best.1 - 2.0) {
            break;
        }
        best = (
            MappedPanel { centre: end, map: PanelMap::Power { side, gap, squarings }, from: near, to: far, nodes: 0 },
            image,
        );
        if image >= plain {
            break;
        }
    }
    best
}

/// The better of a panel and the sinh map about the limiting complex pair, with focal sums.
#[inline(always)]
fn sinh(zeros: &Zeros, low: f64, high: f64, best: (MappedPanel, f64)) -> (MappedPanel, f64) {
    let hindrance = hindrance(zeros, low, high);
    let (centre, height) = (zeros.re[hindrance], zeros.im[hindrance]);
    if height == 0.0 {
        return best;
    }
    let (from, to) = (asinh((low - centre) / height), asinh((high - centre) / height));
    let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        (re[i], im[i]) = complex_asinh((zeros.re[i] - centre) / height, zeros.im[i] / height);
    }
    // sinh(i pi - y) = sinh y: each zero has two images that matter.
    let (other_re, other_im) = (re.map(|re| -re), im.map(|im| std::f64::consts::PI - im));
    let image = focal(&re, &im, from, to).min(focal(&other_re, &other_im, from, to));
    let panel = MappedPanel { centre, map: PanelMap::Sinh { height }, from, to, nodes: 0 };
    if image - 2.0 > 2.0 * (best.1 - 2.0) { (panel, image) } else { best }
}

/// The zero with the smallest ellipse.
#[inline(always)]
fn hindrance(zeros: &Zeros, low: f64, high: f64) -> usize {
    let sums = distances(&zeros.re, &zeros.im, low, high);
    (1..LANES).fold(0, |best, i| if sums[i] < sums[best] { i } else { best })
}

/// The best cut of a panel: below the nearest zero if that lies inside, else in the middle.
#[inline(always)]
pub(super) fn cut(low: f64, high: f64, shadow: f64) -> f64 {
    let edge = 0.05 * (high - low);
    if (shadow > low + edge) & (shadow < high - edge) { shadow } else { 0.5 * (low + high) }
}

/// The square root in the closed first quadrant, for `im >= 0`, up to the sign of `im`.
#[inline(always)]
fn complex_sqrt(re: f64, im: f64) -> (f64, f64) {
    let size = (re * re + im * im).sqrt();
    let root = (0.5 * (size + re.abs())).sqrt();
    // The smallest normal number prevents 0/0.
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
