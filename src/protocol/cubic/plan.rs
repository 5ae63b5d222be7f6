//! Plans of one panel for each of many shortcuts at a time: zeros and power maps, which suffice for most of a landscape, without branches.
//!
//! The estimate of [`rules`](super::rules), restricted to cheap maps: the plain rule, and the maps `x = r ± s^2`, `s^4`, `s^8` about the
//! projection of the limiting zero onto the real axis beyond the nearer end. If that needs many nodes, the interval is cut in two. If that does
//! not help either, `rules` plans the shortcut.

use multiversion::multiversion;

use super::bins::BINS;
use super::path::{Ends, Path};
use super::rules::{
    MAX_CHEAP_NODES, MAX_ZERO_DISTANCE, MIN_THETA_PAIR, NODE_STEP, NodeThresholds, THETA_ZEROS, ZEROS, cut,
    is_near_start, polished, rough_zeros,
};
use super::{PerShortcut, SPAN_SHORTCUTS};
use crate::numerics::lanes::LANES;
use crate::numerics::real::Real;

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
    /// 1 where a larger power might save nodes.
    pub deeper: PerShortcut,
    /// The best cut of a panel with too many nodes.
    pub cut: PerShortcut,
}

/// Single precision numbers of the widest vectors. Derived: half as long as doubles.
const SINGLE_LANES: usize = 2 * LANES;

/// log2 of the greatest power. Chosen: the powers 2, 4 and 8 of docs/numerical-methods.md.
pub(super) const MAX_SQUARINGS: u32 = 3;

/// Least half distance of a pair of zeros of n that is known to some digits. Derived: the root of the rounding of the discriminant, times 100.
const MIN_PAIR: f64 = 1e-6;

/// Least distance of a real zero beyond an end with enough digits for a map. Derived: six digits remain.
pub(super) const MIN_GAP: f64 = 1e-10;

/// Indices of zeros that may be complex, each followed by its conjugate or by another real zero; all others are real.
pub(super) const PAIRS: [usize; 2] = [1, 3];

/// Whether zeros have few digits; undecided shortcuts go to the next plan.
const fn is_coarse<T: Real>() -> bool {
    size_of::<T>() < size_of::<f64>()
}

/// Range of the coefficients of theta, relative to theta at the end, in which single precision neither overflows nor loses all digits of a zero.
/// Measured (`tests/solver/stress/landscape.rs`).
const THETA_RANGE: (f64, f64) = (1e-4, 3e3);

/// Range of the coefficients of n, relative to n at the end, for single precision. Chosen: cubes and squares stay within single precision.
const N_RANGE: (f64, f64) = (1e-10, 1e10);

/// Least squared distance of two zeros of theta, relative to their distance from the end. Derived: single precision loses half of its digits
/// there.
const MIN_PAIR_SQUARED: f64 = 1e-3;

/// Relative error of the focal sum minus 2 by zeros in single precision. Measured (`tests/solver/stress/landscape.rs`).
pub(super) const SINGLE_PRECISION_ERROR: f64 = 0.03;

/// Chooses the panels over `[0, 1]` of the feasible shortcuts `(a_2[i], a_3[i])` in single precision, with squares at most; `deeper` marks
/// shortcuts that need more.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub(super) fn plan(
    ends: &Ends,
    a_2: &PerShortcut,
    a_3: &PerShortcut,
    accuracy: &NodeThresholds,
    plan: &mut PlannedPanels,
) {
    panels::<f32, 1>(ends, [a_2, a_3, &[0.0; SPAN_SHORTCUTS], &[1.0; SPAN_SHORTCUTS]], accuracy, plan);
}

/// Chooses panels over `[low[i], high[i]]` with all powers; one bound is an end of `[0, 1]`.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub(super) fn plan_parts(ends: &Ends, parts: [&PerShortcut; 4], accuracy: &NodeThresholds, plan: &mut PlannedPanels) {
    panels::<f64, MAX_SQUARINGS>(ends, parts, accuracy, plan);
}

/// The zeros of theta and of n of each shortcut in the closed upper half plane; a conjugate pair occurs once.
pub(super) struct Places<T> {
    pub re: [[T; SPAN_SHORTCUTS]; ZEROS],
    pub im: [[T; SPAN_SHORTCUTS]; ZEROS],
    /// Above 0 where the zeros are too inaccurate for a plan.
    pub doubt: [f32; SPAN_SHORTCUTS],
}

/// The zeros of the shortcuts `(a_2[i], a_3[i])`.
#[inline(always)]
pub(super) fn places<T: Real>(ends: &Ends, a_2: &PerShortcut, a_3: &PerShortcut) -> Places<T> {
    let zero = T::of(0.0);
    let [mut q0, mut q1, mut q2, mut q3, mut n0, mut n1, mut n2] = [[zero; SPAN_SHORTCUTS]; 7];
    for i in 0..SPAN_SHORTCUTS {
        let (theta, n) = Path::new(ends, a_2[i], a_3[i]).about_end();
        (q0[i], q1[i], q2[i], q3[i]) = (T::of(theta[0]), T::of(theta[1]), T::of(theta[2]), T::of(theta[3]));
        (n0[i], n1[i], n2[i]) = (T::of(n[0]), T::of(n[1]), T::of(n[2]));
    }
    let (mut re, mut im) = ([[zero; SPAN_SHORTCUTS]; ZEROS], [[zero; SPAN_SHORTCUTS]; ZEROS]);
    let mut doubt = [0.0f32; SPAN_SHORTCUTS];
    for i in 0..SPAN_SHORTCUTS {
        let theta = [q0[i], q1[i], q2[i], q3[i]];
        let n = [n0[i], n1[i], n2[i]];
        let zeros = rough_zeros(theta, n);
        for k in 0..ZEROS {
            (re[k][i], im[k][i]) = (zeros.re[k], zeros.im[k]);
        }
        if is_coarse::<T>() {
            let (between, from_end) = (zeros.re[1] - zeros.re[2], zeros.re[1] - T::of(1.0));
            let square = between * between + T::of(4.0) * zeros.im[1] * zeros.im[1];
            let size = from_end * from_end + zeros.im[1] * zeros.im[1];
            let apart = square >= T::of(MIN_PAIR_SQUARED) * size;
            doubt[i] = if is_tame(theta, n) & apart { 0.0 } else { 1.0 };
        }
    }
    let mut places = Places { re, im, doubt };
    places.polish_near_start(ends, a_2, a_3);
    places.mark_close_pairs();
    // A pair is counted once.
    for k in PAIRS {
        for i in 0..SPAN_SHORTCUTS {
            let (place, height) = (places.re[k + 1][i], places.im[k + 1][i]);
            places.re[k + 1][i] = if height > zero { T::of(MAX_ZERO_DISTANCE) } else { place };
            places.im[k + 1][i] = zero;
        }
    }
    places
}

impl<T: Real> Places<T> {
    /// Corrects zeros for which the expansion about the end has too few digits.
    #[inline(always)]
    fn polish_near_start(&mut self, ends: &Ends, a_2: &PerShortcut, a_3: &PerShortcut) {
        let Places { re, im, doubt } = self;
        let mut close = [0.0f32; SPAN_SHORTCUTS];
        for k in 0..ZEROS {
            for i in 0..SPAN_SHORTCUTS {
                close[i] += if is_near_start(re[k][i], im[k][i]) { 1.0 } else { 0.0 };
            }
        }
        for i in (0..SPAN_SHORTCUTS).filter(|&i| close[i] > 0.0) {
            for k in 0..ZEROS {
                if is_near_start(re[k][i], im[k][i]) {
                    let (theta, [n0, n1, n2]) = Path::new(ends, a_2[i], a_3[i]).about_start();
                    let c = if k < THETA_ZEROS { theta } else { [n0, n1, n2, 0.0] };
                    match polished(&c.map(T::of), re[k][i], im[k][i]) {
                        Some(zero) => (re[k][i], im[k][i]) = zero,
                        None => doubt[i] += if is_coarse::<T>() { 1.0 } else { 0.0 },
                    }
                }
            }
        }
    }

    /// Marks pairs near the real axis as doubtful, since the closed forms do not determine their distance from it.
    #[inline(always)]
    fn mark_close_pairs(&mut self) {
        let Places { re, im, doubt } = self;
        for k in 0..ZEROS {
            let least = T::of(if k < THETA_ZEROS || is_coarse::<T>() { MIN_THETA_PAIR } else { MIN_PAIR });
            for i in 0..SPAN_SHORTCUTS {
                let close = (re[k][i] > T::of(0.0)) & (re[k][i] < T::of(1.0)) & (im[k][i] < least);
                doubt[i] += if close { 1.0 } else { 0.0 };
            }
        }
    }
}

/// The zero of each shortcut that limits a plain rule over `[low[i], high[i]]`: the square of the sum of its distances from both ends, and its
/// projection onto the real axis.
#[inline(always)]
pub(super) fn nearest<T: Real>(
    re: &[[T; SPAN_SHORTCUTS]; ZEROS],
    im: &[[T; SPAN_SHORTCUTS]; ZEROS],
    low: &PerShortcut,
    high: &PerShortcut,
) -> ([f32; SPAN_SHORTCUTS], [T; SPAN_SHORTCUTS]) {
    // The limiting zero determines the end and the centre. Single precision suffices for comparisons; positions of zeros keep all digits.
    let mut shadow = [T::of(0.0); SPAN_SHORTCUTS];
    let mut least = [f32::MAX; SPAN_SHORTCUTS];
    for k in 0..ZEROS {
        for i in 0..SPAN_SHORTCUTS {
            let (u, v) = ((re[k][i] - T::of(low[i])).narrow(), (re[k][i] - T::of(high[i])).narrow());
            let y = im[k][i].narrow();
            let (u_square, v_square) = (u * u + y * y, v * v + y * y);
            // A real zero needs no square root.
            let product = if PAIRS.contains(&k) { (u_square * v_square).sqrt() } else { (u * v).abs() };
            let square = u_square + v_square + 2.0 * product;
            let nearer = square < least[i];
            least[i] = if nearer { square } else { least[i] };
            shadow[i] = if nearer { re[k][i] } else { shadow[i] };
        }
    }
    (least, shadow)
}

/// The square root `x + iy`, with positive `x`, of a number given by modulus and real part: returns `x` and the square of the sum of its
/// distances from `a` and `b`.
#[inline(always)]
pub(super) fn rooted(size: f32, real: f32, a: f32, b: f32) -> (f32, f32) {
    // |sqrt z|^2 = |z| and Re sqrt z = sqrt((|z| + Re z)/2).
    let x = (0.5 * (size + real)).sqrt();
    let u = size + a * (a - 2.0 * x);
    let v = size + b * (b - 2.0 * x);
    // Rounding may make the square of a distance negative.
    let product = u * v;
    (x, u + v + 2.0 * (if product > 0.0 { product } else { 0.0 }).sqrt())
}

#[inline(always)]
fn panels<T: Real, const SQUARINGS: u32>(
    ends: &Ends,
    [a_2, a_3, low, high]: [&PerShortcut; 4],
    accuracy: &NodeThresholds,
    plan: &mut PlannedPanels,
) {
    let zero = T::of(0.0);
    let Places { re, im, mut doubt } = places::<T>(ends, a_2, a_3);
    // The plain rule, and end and centre of a possibly better map.
    let (least, shadow) = nearest(&re, &im, low, high);
    let mut focal = [0.0f32; SPAN_SHORTCUTS];
    let (mut side, mut gap) = ([zero; SPAN_SHORTCUTS], [zero; SPAN_SHORTCUTS]);
    for i in 0..SPAN_SHORTCUTS {
        let (low, high) = (T::of(low[i]), T::of(high[i]));
        focal[i] = 2.0 * least[i].sqrt() / (high - low).narrow();
        let upper = shadow[i] + shadow[i] > low + high;
        let beyond = if upper { shadow[i] - high } else { low - shadow[i] };
        side[i] = T::of(if upper { 1.0 } else { -1.0 });
        gap[i] = if beyond > zero { beyond } else { zero };
    }
    // Real part and modulus of a zero determine its distances from real points.
    let (mut real, mut size) = ([[0.0f32; SPAN_SHORTCUTS]; ZEROS], [[0.0f32; SPAN_SHORTCUTS]; ZEROS]);
    for k in 0..ZEROS {
        for i in 0..SPAN_SHORTCUTS {
            let end = if side[i] > zero { T::of(high[i]) - re[k][i] } else { re[k][i] - T::of(low[i]) };
            let (x, y) = ((gap[i] + end).narrow(), im[k][i].narrow());
            real[k][i] = x;
            size[k][i] = if PAIRS.contains(&k) { (x * x + y * y).sqrt() } else { x.abs() };
        }
    }
    // A zero beyond the end is given by its distance from 1.
    for i in 0..SPAN_SHORTCUTS {
        let blurred = (side[i] > zero) & (high[i] == 1.0) & (gap[i] > zero) & (gap[i] < T::of(MIN_GAP));
        doubt[i] += if blurred { 1.0 } else { 0.0 };
    }
    // A focal sum is reduced by the possible error of the zeros.
    let lost = if is_coarse::<T>() { SINGLE_PRECISION_ERROR } else { 0.0 };
    let steps = &accuracy.focal;
    let limits: [f32; BINS] = std::array::from_fn(|i| (steps[i] + lost * (steps[i] - 2.0)) as f32);
    let cheap = limits[MAX_CHEAP_NODES / NODE_STEP - 1];
    let Powers { squarings, short } = powers::<T, SQUARINGS>([real, size], &gap, [low, high], cheap, &mut focal);
    let bin = bins(&limits, &focal);
    for i in 0..SPAN_SHORTCUTS {
        let (low, high) = (low[i], high[i]);
        let length = high - low;
        plan.cut[i] = cut(low, high, shadow[i].wide());
        let straight = squarings[i] == 0.0;
        // Over all of [0, 1] a plain rule begins at the end with the smaller theta.
        let steady = if ends.rise.high < 0.0 { 1.0 } else { -1.0 };
        let whole = (low == 0.0) & (high == 1.0);
        let side = if straight & whole { steady } else { side[i].wide() };
        let gap = if straight { 0.0 } else { gap[i].wide() };
        (plan.squarings[i], plan.side[i], plan.gap[i]) = (f64::from(squarings[i]), side, gap);
        (plan.from[i], plan.to[i]) = (gap, gap + length);
        // The polynomials are expanded about an end of [0, 1].
        let other = if low == 0.0 { -1.0 } else { 1.0 };
        let centre = if whole { side } else { other };
        let near = (if side > 0.0 { high } else { low }) - if centre > 0.0 { 1.0 } else { 0.0 };
        let sound = Path::new(ends, a_2[i], a_3[i]).is_sound(centre > 0.0, near, near - side * length, accuracy);
        plan.bin[i] = if sound & (doubt[i] == 0.0) { bin[i] as u32 } else { BINS as u32 };
    }
    for i in 0..SPAN_SHORTCUTS {
        plan.deeper[i] = if (short[i] > 0.0) | (is_coarse::<T>() & (doubt[i] > 0.0)) { 1.0 } else { 0.0 };
    }
    map_bounds::<SQUARINGS>(plan, &squarings);
}

/// Maps the bounds of the panels to the variables of their powers.
#[inline(always)]
fn map_bounds<const SQUARINGS: u32>(plan: &mut PlannedPanels, squarings: &[f32; SPAN_SHORTCUTS]) {
    for level in 1..=SQUARINGS {
        for ((from, to), &squarings) in plan.from.iter_mut().zip(&mut plan.to).zip(squarings) {
            let more = squarings >= level as f32;
            *from = if more { from.sqrt() } else { *from };
            *to = if more { to.sqrt() } else { *to };
        }
    }
}

/// The powers of the maps.
struct Powers {
    /// log2 of the powers.
    squarings: [f32; SPAN_SHORTCUTS],
    /// 1 where a larger power might save nodes.
    short: [f32; SPAN_SHORTCUTS],
}

/// The power of each map from the real parts and moduli of the zeros relative to its centre; increases `focal` where a power helps. Powers
/// beyond the square are tried where the sum is not `cheap`.
#[inline(always)]
fn powers<T: Real, const SQUARINGS: u32>(
    [mut real, mut size]: [[[f32; SPAN_SHORTCUTS]; ZEROS]; 2],
    gap: &[T; SPAN_SHORTCUTS],
    [low, high]: [&PerShortcut; 2],
    cheap: f32,
    focal: &mut [f32; SPAN_SHORTCUTS],
) -> Powers {
    let (mut near, mut far) = (*gap, *gap);
    for i in 0..SPAN_SHORTCUTS {
        far[i] = gap[i] + (T::of(high[i]) - T::of(low[i]));
    }
    let mut squarings = [0.0f32; SPAN_SHORTCUTS];
    // Upper bound of the focal sum by the centre of the map, which is mapped to 0.
    let mut ceiling = [2.0f32; SPAN_SHORTCUTS];
    for level in 1..=SQUARINGS {
        if level > 1 && focal.iter().all(|&focal| focal >= cheap) {
            break;
        }
        let (mut a, mut b) = ([0.0f32; SPAN_SHORTCUTS], [0.0f32; SPAN_SHORTCUTS]);
        for i in 0..SPAN_SHORTCUTS {
            near[i] = near[i].sqrt();
            far[i] = far[i].sqrt();
            (a[i], b[i]) = (near[i].narrow(), far[i].narrow());
        }
        let mut least = [f32::MAX; SPAN_SHORTCUTS];
        for k in 0..ZEROS {
            for i in 0..SPAN_SHORTCUTS {
                let square = size[k][i];
                let (x, sum) = rooted(square, real[k][i], a[i], b[i]);
                (real[k][i], size[k][i]) = (x, square.sqrt());
                least[i] = if sum < least[i] { sum } else { least[i] };
            }
        }
        for i in 0..SPAN_SHORTCUTS {
            let reached = 2.0 * least[i].sqrt() / (b[i] - a[i]);
            // A square costs no more than a plain rule, but differences from a distant centre lose digits.
            let open = if level == 1 { gap[i].narrow() <= (high[i] - low[i]) as f32 } else { focal[i] < cheap };
            let better = open & (reached > focal[i]);
            focal[i] = if better { reached } else { focal[i] };
            squarings[i] = if better { level as f32 } else { squarings[i] };
            ceiling[i] = 2.0 * (a[i] + b[i]) / (b[i] - a[i]);
        }
    }
    let mut short = [0.0f32; SPAN_SHORTCUTS];
    for i in 0..SPAN_SHORTCUTS {
        // A larger power increases the distance from the centre, but hardly from other zeros.
        let near = focal[i] - 2.0 > 0.5 * (ceiling[i] - 2.0);
        short[i] = if (focal[i] < cheap) & (squarings[i] == SQUARINGS as f32) & near { 1.0 } else { 0.0 };
    }
    Powers { squarings, short }
}

/// The number of descending limits above each focal sum.
#[inline(always)]
fn bins(limits: &[f32; BINS], focal: &[f32; SPAN_SHORTCUTS]) -> [f32; SPAN_SHORTCUTS] {
    let mut bin = [0.0f32; SPAN_SHORTCUTS];
    for (bins, focals) in bin.chunks_exact_mut(SINGLE_LANES).zip(focal.chunks_exact(SINGLE_LANES)) {
        let mut counts = [0.0f32; SINGLE_LANES];
        for limit in limits {
            for i in 0..SINGLE_LANES {
                counts[i] += if focals[i] >= *limit { 0.0 } else { 1.0 };
            }
        }
        bins.copy_from_slice(&counts);
    }
    bin
}

/// Whether single precision suffices for estimates of the zeros of theta and n, from their expansions about the end.
#[inline(always)]
fn is_tame<T: Real>([q0, q1, q2, q3]: [T; 4], [n0, n1, n2]: [T; 3]) -> bool {
    let (theta, n) = (q1.abs() + q2.abs() + q3.abs(), n0.abs() + n1.abs() + n2.abs());
    (theta > T::of(THETA_RANGE.0) * q0)
        & (theta < T::of(THETA_RANGE.1) * q0)
        & (n > T::of(N_RANGE.0))
        & (n < T::of(N_RANGE.1))
}
