//! Plans of one panel for each of many shortcuts at a time: zeros and power maps, which suffice for most of a landscape, without branches.
//!
//! The estimate of [`rules`](super::rules), restricted to cheap maps: the plain rule, and the maps `x = r ± s^2`, `s^4`, `s^8` about the
//! projection of the limiting zero onto the real axis beyond the nearer end. If that needs many nodes, the interval is cut in two. If that does
//! not help either, `rules` plans the shortcut.

use multiversion::multiversion;

use super::bins::BINS;
use super::path::{Ends, Path};
use super::rules::{
    MAX_CHEAP_NODES, MAX_ZERO_DISTANCE, MIN_THETA_PAIR, NodeThresholds, THETA_ZEROS, ZEROS, cut, is_near_start,
    polished, rough_zeros,
};
use super::{PerShortcut, SPAN_SHORTCUTS};
use crate::numerics::lanes::LANES;

/// One panel for each shortcut.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PlannedPanels {
    /// The bin of the number of nodes; none from [`BINS`] on.
    pub bin: [u32; SPAN_SHORTCUTS],
    /// log2 of the power.
    pub squarings: PerShortcut,
    /// The end of the panel at which the map begins: +1 the upper, -1 the lower.
    pub side: PerShortcut,
    /// Distance of the centre of the map beyond that end.
    pub gap: PerShortcut,
    /// Bounds of the mapped variable.
    pub from: PerShortcut,
    pub to: PerShortcut,
    /// The best cut of a panel with too many nodes.
    pub cut: PerShortcut,
}

/// log2 of the greatest power. Chosen: the powers 2, 4 and 8 of docs/numerical-methods.md.
pub(super) const MAX_SQUARINGS: u32 = 3;

/// Least half distance of a pair of zeros of n that is known to some digits. Derived: the root of the rounding of the discriminant, times 100.
const MIN_PAIR: f64 = 1e-6;

/// Least distance of a real zero beyond an end with enough digits for a map. Derived: six digits remain.
pub(super) const MIN_GAP: f64 = 1e-10;

/// Indices of zeros that may be complex, each followed by its conjugate or by another real zero; all others are real.
pub(super) const PAIRS: [usize; 2] = [1, 3];

/// The zeros of theta and of n of some shortcuts in the closed upper half plane; a conjugate pair occurs once.
pub(super) struct Places<const N: usize> {
    pub re: [[f64; N]; ZEROS],
    pub im: [[f64; N]; ZEROS],
    /// Above 0 where the zeros are too inaccurate for a plan.
    pub doubt: [f64; N],
}

impl<const N: usize> Places<N> {
    /// The zeros of the shortcuts `(a_2[i], a_3[i])`.
    #[inline(always)]
    pub fn of(ends: &Ends, a_2: &[f64; N], a_3: &[f64; N]) -> Places<N> {
        let mut places = Places { re: [[0.0; N]; ZEROS], im: [[0.0; N]; ZEROS], doubt: [0.0; N] };
        for i in 0..N {
            let (theta, n) = Path::new(ends, a_2[i], a_3[i]).about_end();
            let zeros = rough_zeros(theta, n);
            for k in 0..ZEROS {
                (places.re[k][i], places.im[k][i]) = (zeros.re[k], zeros.im[k]);
            }
        }
        places.polish_near_start(ends, a_2, a_3);
        places.mark_close_pairs();
        // A pair is counted once.
        for k in PAIRS {
            for i in 0..N {
                let (place, height) = (places.re[k + 1][i], places.im[k + 1][i]);
                places.re[k + 1][i] = if height > 0.0 { MAX_ZERO_DISTANCE } else { place };
                places.im[k + 1][i] = 0.0;
            }
        }
        places
    }

    /// Corrects zeros for which the expansion about the end has too few digits.
    #[inline(always)]
    fn polish_near_start(&mut self, ends: &Ends, a_2: &[f64; N], a_3: &[f64; N]) {
        let Places { re, im, .. } = self;
        let mut close = [0.0; N];
        for k in 0..ZEROS {
            for i in 0..N {
                close[i] += if is_near_start(re[k][i], im[k][i]) { 1.0 } else { 0.0 };
            }
        }
        for i in (0..N).filter(|&i| close[i] > 0.0) {
            let (theta, [n0, n1, n2]) = Path::new(ends, a_2[i], a_3[i]).about_start();
            for k in 0..ZEROS {
                let c = if k < THETA_ZEROS { theta } else { [n0, n1, n2, 0.0] };
                if is_near_start(re[k][i], im[k][i]) {
                    (re[k][i], im[k][i]) = polished(&c, re[k][i], im[k][i]);
                }
            }
        }
    }

    /// Marks pairs near the real axis as doubtful, since the closed forms do not determine their distance from it.
    #[inline(always)]
    fn mark_close_pairs(&mut self) {
        let Places { re, im, doubt } = self;
        for k in 0..ZEROS {
            let least = if k < THETA_ZEROS { MIN_THETA_PAIR } else { MIN_PAIR };
            for i in 0..N {
                let close = (re[k][i] > 0.0) & (re[k][i] < 1.0) & (im[k][i] < least);
                doubt[i] += if close { 1.0 } else { 0.0 };
            }
        }
    }

    /// The zero of each shortcut that limits a plain rule over `[low[i], high[i]]`: the square of the sum of its distances from both ends, and
    /// its projection onto the real axis.
    #[inline(always)]
    pub fn nearest(&self, low: &[f64; N], high: &[f64; N]) -> [[f64; N]; 2] {
        let (mut least, mut shadow) = ([f64::MAX; N], [0.0; N]);
        for k in 0..ZEROS {
            for i in 0..N {
                let (u, v, y) = (self.re[k][i] - low[i], self.re[k][i] - high[i], self.im[k][i]);
                let (u_square, v_square) = (u * u + y * y, v * v + y * y);
                // A real zero needs no square root.
                let product = if PAIRS.contains(&k) { (u_square * v_square).sqrt() } else { (u * v).abs() };
                let square = u_square + v_square + 2.0 * product;
                let nearer = square < least[i];
                least[i] = if nearer { square } else { least[i] };
                shadow[i] = if nearer { self.re[k][i] } else { shadow[i] };
            }
        }
        [least, shadow]
    }
}

/// The square root `x + iy`, with positive `x`, of a number given by modulus and real part: returns `x` and the square of the sum of its
/// distances from `a` and `b`.
#[inline(always)]
pub(super) fn rooted(size: f64, real: f64, a: f64, b: f64) -> (f64, f64) {
    // |sqrt z|^2 = |z| and Re sqrt z = sqrt((|z| + Re z)/2).
    let x = (0.5 * (size + real)).sqrt();
    let u = size + a * (a - 2.0 * x);
    let v = size + b * (b - 2.0 * x);
    // Rounding may make the square of a distance negative.
    let product = u * v;
    (x, u + v + 2.0 * (if product > 0.0 { product } else { 0.0 }).sqrt())
}

/// Chooses panels over `[low[i], high[i]]` of feasible shortcuts; one bound is an end of `[0, 1]`.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub(super) fn plan(
    ends: &Ends,
    [a_2, a_3, low, high]: [&PerShortcut; 4],
    accuracy: &NodeThresholds,
    plan: &mut PlannedPanels,
) {
    let places = Places::of(ends, a_2, a_3);
    // The plain rule, and end and centre of a possibly better map.
    let [least, shadow] = places.nearest(low, high);
    let Places { re, im, mut doubt } = places;
    let [mut focal, mut side, mut gap] = [[0.0; SPAN_SHORTCUTS]; 3];
    for i in 0..SPAN_SHORTCUTS {
        let (low, high) = (low[i], high[i]);
        focal[i] = 2.0 * least[i].sqrt() / (high - low);
        let upper = shadow[i] + shadow[i] > low + high;
        let beyond = if upper { shadow[i] - high } else { low - shadow[i] };
        side[i] = if upper { 1.0 } else { -1.0 };
        gap[i] = if beyond > 0.0 { beyond } else { 0.0 };
        // A zero beyond the end is given by its distance from 1.
        let blurred = upper & (high == 1.0) & (gap[i] > 0.0) & (gap[i] < MIN_GAP);
        doubt[i] += if blurred { 1.0 } else { 0.0 };
    }
    // Real part and modulus of a zero determine its distances from real points.
    let (mut real, mut size) = ([[0.0; SPAN_SHORTCUTS]; ZEROS], [[0.0; SPAN_SHORTCUTS]; ZEROS]);
    for k in 0..ZEROS {
        for i in 0..SPAN_SHORTCUTS {
            let end = if side[i] > 0.0 { high[i] - re[k][i] } else { re[k][i] - low[i] };
            let (x, y) = (gap[i] + end, im[k][i]);
            real[k][i] = x;
            size[k][i] = if PAIRS.contains(&k) { (x * x + y * y).sqrt() } else { x.abs() };
        }
    }
    let cheap = accuracy.enough(MAX_CHEAP_NODES);
    let Powers { squarings, from, to } = powers([real, size], &gap, [low, high], cheap, &mut focal);
    let bin = bins(accuracy, &focal);
    for i in 0..SPAN_SHORTCUTS {
        let (low, high) = (low[i], high[i]);
        plan.cut[i] = cut(low, high, shadow[i]);
        let straight = squarings[i] == 0.0;
        // Over all of [0, 1] a plain rule begins at the end with the smaller theta.
        let steady = if ends.rise.high < 0.0 { 1.0 } else { -1.0 };
        let whole = (low == 0.0) & (high == 1.0);
        let side = if straight & whole { steady } else { side[i] };
        let gap = if straight { 0.0 } else { gap[i] };
        (plan.squarings[i], plan.side[i], plan.gap[i]) = (squarings[i], side, gap);
        (plan.from[i], plan.to[i]) = (from[i], to[i]);
        // The polynomials are expanded about an end of [0, 1].
        let other = if low == 0.0 { -1.0 } else { 1.0 };
        let centre = if whole { side } else { other };
        let near = (if side > 0.0 { high } else { low }) - if centre > 0.0 { 1.0 } else { 0.0 };
        let far = near - side * (high - low);
        let sound = Path::new(ends, a_2[i], a_3[i]).is_sound(centre > 0.0, near, far, accuracy);
        plan.bin[i] = if sound & (doubt[i] == 0.0) { bin[i] as u32 } else { BINS as u32 };
    }
}

/// The maps of least effort.
struct Powers {
    /// log2 of the powers.
    squarings: PerShortcut,
    /// Bounds of the mapped variable.
    from: PerShortcut,
    to: PerShortcut,
}

/// The power of each map from the real parts and moduli of the zeros relative to its centre; increases `focal` where a power helps. Powers
/// beyond the square are tried where the sum is not `cheap`.
#[inline(always)]
fn powers(
    [mut real, mut size]: [[PerShortcut; ZEROS]; 2],
    gap: &PerShortcut,
    [low, high]: [&PerShortcut; 2],
    cheap: f64,
    focal: &mut PerShortcut,
) -> Powers {
    let length: PerShortcut = std::array::from_fn(|i| high[i] - low[i]);
    let mut powers = Powers { squarings: [0.0; SPAN_SHORTCUTS], from: [0.0; SPAN_SHORTCUTS], to: length };
    let (mut near, mut far) = (*gap, length);
    for i in 0..SPAN_SHORTCUTS {
        far[i] += gap[i];
    }
    for level in 1..=MAX_SQUARINGS {
        // Each shortcut decides for itself, whatever the others need. A square costs no more than a plain rule, but differences from a distant centre
        // lose digits. A larger power increases the distance from the centre, but hardly from other zeros.
        let open: [bool; SPAN_SHORTCUTS] = std::array::from_fn(|i| {
            if level == 1 {
                return gap[i] <= length[i];
            }
            let is_limited = focal[i] - 2.0 > 2.0 * near[i] / (far[i] - near[i]);
            (focal[i] < cheap) & (powers.squarings[i] == f64::from(level - 1)) & is_limited
        });
        if open == [false; SPAN_SHORTCUTS] {
            break;
        }
        for i in 0..SPAN_SHORTCUTS {
            (near[i], far[i]) = (near[i].sqrt(), far[i].sqrt());
        }
        let mut least = [f64::MAX; SPAN_SHORTCUTS];
        for k in 0..ZEROS {
            for i in 0..SPAN_SHORTCUTS {
                let square = size[k][i];
                let (x, sum) = rooted(square, real[k][i], near[i], far[i]);
                (real[k][i], size[k][i]) = (x, square.sqrt());
                least[i] = if sum < least[i] { sum } else { least[i] };
            }
        }
        for i in 0..SPAN_SHORTCUTS {
            let reached = 2.0 * least[i].sqrt() / (far[i] - near[i]);
            let better = open[i] & (reached > focal[i]);
            focal[i] = if better { reached } else { focal[i] };
            powers.squarings[i] = if better { f64::from(level) } else { powers.squarings[i] };
            powers.from[i] = if better { near[i] } else { powers.from[i] };
            powers.to[i] = if better { far[i] } else { powers.to[i] };
        }
    }
    powers
}

/// The bin of each focal sum: the number of descending limits above it.
#[inline(always)]
fn bins(accuracy: &NodeThresholds, focal: &PerShortcut) -> PerShortcut {
    let mut bin = [0.0; SPAN_SHORTCUTS];
    for (bins, focals) in bin.chunks_exact_mut(LANES).zip(focal.chunks_exact(LANES)) {
        let mut counts = [0.0; LANES];
        for limit in &accuracy.focal[..BINS] {
            for i in 0..LANES {
                counts[i] += if focals[i] >= *limit { 0.0 } else { 1.0 };
            }
        }
        bins.copy_from_slice(&counts);
    }
    bin
}
