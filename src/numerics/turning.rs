//! The turning function `U(w)`: the real-analytic solution of `U - 1 - ln U = w^2/2` with the sign of `U - 1` equal to
//! the sign of `w`.
//!
//! `U` joins both real branches of the Lambert function at their branch point: `U = -W_k(-exp(-1 - w^2/2))` with `k =
//! 0` for `w <= 0` and `k = -1` for `w >= 0`. It is the velocity of a particle that falls back from a turning point,
//! hence the name. Its nearest singularities are at `|w| = 2 sqrt(pi)`, on the four diagonals of the complex plane.
//!
//! Three formulas cover the line. Each lane of a vector takes the one of its own argument, so a result never depends on
//! its neighbours.

use super::elementary::{exp, ln};
use super::lanes::{LANES, Lanes};

/// `ln U / w` on `|w| <= 1`: Chebyshev interpolant of degree 18 (truncation 1e-17), in powers of `w`.
/// Made by `tests/reference/coefficients.py`.
const LN_U_OVER_W: [f64; 19] = [
    1.0,
    -0.16666666666666669,
    0.027777777777777776,
    -0.003703703703702983,
    0.00023148148148158097,
    5.878894766509244e-05,
    -2.5536449149293435e-05,
    4.899079075931468e-06,
    -2.428275986734816e-07,
    -1.8540667196844605e-07,
    7.542459114003726e-08,
    -1.4720458147456178e-08,
    5.161285205620786e-10,
    7.311360877924562e-10,
    -2.923351988633389e-10,
    5.894498529765329e-11,
    -1.343223940139809e-12,
    -4.204783857883461e-12,
    1.2288955865958112e-12,
];

/// `U / x` for `w <= -1`, with `x = exp(-1 - w^2/2)`, in powers of `s = 1 - sqrt(1 - e x)`: the square root moves the
/// branch point at `w = 0` out of the way, so degree 14 leaves 1e-17. Made by `tests/reference/coefficients.py`.
const U_OVER_X: [f64; 15] = [
    1.0,
    0.7357588823428842,
    0.4441322582483074,
    0.25011242575562853,
    0.13611997804951137,
    0.07262108942074143,
    0.03824881821372522,
    0.01996532234006309,
    0.010363230665994585,
    0.005299786051375101,
    0.00292188635300834,
    0.0009247334170975625,
    0.001630982272654859,
    -0.0007169475388810523,
    0.0008663289439595966,
];

/// The turning function at one argument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turning {
    /// `ln U`, in `(-inf, inf)`.
    pub ln_u: f64,
    /// `(U - 1)/w`, positive; 1 at `w = 0`. Its reciprocal is `d(ln U)/dw`.
    pub slope: f64,
}

/// `ln U` and `(U - 1)/w` at `w`, each to a few units in the last place, for `|w| < 1e150`.
///
/// The derivative of `ln U` is `1/slope`, since `(1 - 1/U) dU = w dw`.
pub fn turning(w: f64) -> Turning {
    let (ln_u, slope) = if w <= -1.0 {
        rising(w)
    } else if w < 1.0 {
        near(w)
    } else {
        falling(w)
    };
    Turning { ln_u, slope }
}

/// [`turning`] of eight arguments at once: `(ln U, (U - 1)/w)`, with the same bits as one by one.
#[inline(always)]
pub fn turning_lanes(w: &Lanes) -> (Lanes, Lanes) {
    let (mut least, mut greatest) = (w[0], w[0]);
    for &w in w {
        least = if w < least { w } else { least };
        greatest = if w > greatest { w } else { greatest };
    }
    let mut ln_u = [0.0; LANES];
    let mut slope = [0.0; LANES];
    if least > -1.0 && greatest < 1.0 {
        for i in 0..LANES {
            (ln_u[i], slope[i]) = near(w[i]);
        }
    } else if least >= 1.0 {
        for i in 0..LANES {
            (ln_u[i], slope[i]) = falling(w[i]);
        }
    } else if greatest <= -1.0 {
        for i in 0..LANES {
            (ln_u[i], slope[i]) = rising(w[i]);
        }
    } else {
        mixed(w, &mut ln_u, &mut slope);
    }
    (ln_u, slope)
}

/// Lanes on both sides of a seam: all three formulas, each on arguments clamped into its range, then a choice per lane.
#[inline(always)]
fn mixed(w: &Lanes, ln_u: &mut Lanes, slope: &mut Lanes) {
    for i in 0..LANES {
        let (z_near, h_near) = near(if w[i].abs() < 1.0 { w[i] } else { 0.5 });
        let (z_falling, h_falling) = falling(if w[i] >= 1.0 { w[i] } else { 1.0 });
        let (z_rising, h_rising) = rising(if w[i] <= -1.0 { w[i] } else { -1.0 });
        let (z_far, h_far) = if w[i] >= 1.0 { (z_falling, h_falling) } else { (z_rising, h_rising) };
        let inside = w[i].abs() < 1.0;
        ln_u[i] = if inside { z_near } else { z_far };
        slope[i] = if inside { h_near } else { h_far };
    }
}

/// `|w| < 1`: a polynomial for `ln U / w`; then `(U - 1)/w = ln U / w + w/2` needs no exponential.
#[inline(always)]
fn near(w: f64) -> (f64, f64) {
    let q = horner(&LN_U_OVER_W, w);
    (w * q, q + 0.5 * w)
}

/// `w <= -1`, theta rises: `U = x (1 + ...)` is small, and `ln U = -1 - w^2/2 + U`.
#[inline(always)]
fn rising(w: f64) -> (f64, f64) {
    let e = 0.5 * w * w;
    let g = exp(-e);
    let s = g / (1.0 + (1.0 - g).sqrt());
    let u = g * std::f64::consts::E.recip() * horner(&U_OVER_X, s);
    (u - (1.0 + e), (u - 1.0) / w)
}

/// `w >= 1`, theta falls: two Halley steps on `U - 1 - e - ln U` from a rational guess that is within 0.6 % everywhere.
/// The second step is so short that its logarithm serves for the result too.
#[inline(always)]
fn falling(w: f64) -> (f64, f64) {
    let e = 0.5 * w * w;
    let guess = 1.0 + e + 6.0 * w / (6.0 + w);
    let u = guess - halley(guess, ln(guess), e);
    let ln_u = ln(u);
    let step = halley(u, ln_u, e);
    let q = step / u;
    (ln_u - q * (1.0 + 0.5 * q), (u - step - 1.0) / w)
}

/// What Halley's method (order three) subtracts from `u` to solve `U - 1 - ln U = e`.
#[inline(always)]
fn halley(u: f64, ln_u: f64, e: f64) -> f64 {
    let d = u - 1.0;
    let r = d - e - ln_u;
    r * u * d / (d * d - 0.5 * r)
}

#[inline(always)]
fn horner<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    let mut sum = coefficients[N - 1];
    for i in (0..N - 1).rev() {
        sum = sum * x + coefficients[i];
    }
    sum
}
