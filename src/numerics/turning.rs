//! The turning function `U(w)`: the real-analytic solution of `U - 1 - ln U = w^2/2` with the sign of `U - 1` equal to
//! the sign of `w`.
//!
//! `U` joins both real branches of the Lambert function at their branch point: `U = -W_k(-exp(-1 - w^2/2))` with `k =
//! 0` for `w <= 0` and `k = -1` for `w >= 0`. It is the velocity of a particle that falls back from a turning point,
//! hence the name. Its nearest singularities are at `w = 2 sqrt(pi) e^(±3 pi i/4)`.
//!
//! Three formulas cover the real line. Each lane of a vector uses the formula of its own argument, so a result never depends on its neighbours.

use super::elementary::{exp, ln, polynomial};

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

/// `U / x` for `w <= -1`, with `x = exp(-1 - w^2/2)`, in powers of `s = 1 - sqrt(1 - e x)`: the square root removes the branch point at `w = 0`,
/// so degree 14 has an error of 1e-17. Made by `tests/reference/coefficients.py`.
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

/// `ln U` for `w >= 1` in powers of `w/(w + 11)`: interpolated where this is at most 0.4; beyond, the error is negligible compared with `U`.
/// Made by `tests/reference/coefficients.py`.
const LN_U_FAR: [f64; 4] = [0.005525334715095086, 10.884780968207572, -8.4436137582789, 6.8186052209486885];

/// The turning function at one argument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turning {
    /// `ln U`, in `(-inf, inf)`.
    pub ln_u: f64,
    /// `U - 1`.
    pub excess: f64,
    /// `(U - 1)/w`, positive; 1 at `w = 0`. Its reciprocal is `d(ln U)/dw`.
    pub slope: f64,
}

/// `ln U`, `U - 1` and `(U - 1)/w` at `w`, each to a few units in the last place, for `|w| < 1e150`.
///
/// The derivative of `ln U` is `1/slope`, since `(1 - 1/U) dU = w dw`.
pub fn turning(w: f64) -> Turning {
    let Turnings { ln_u: [ln_u], excess: [excess], over: [over], under: [under], .. } = turning_lanes(&[w]);
    Turning { ln_u, excess, slope: over / under }
}

/// The turning function at several arguments side by side.
#[derive(Debug, Clone, Copy)]
pub struct Turnings<const N: usize> {
    /// `ln U`.
    pub ln_u: [f64; N],
    /// `U`, with all its digits where it is small.
    pub u: [f64; N],
    /// `U - 1`.
    pub excess: [f64; N],
    /// Numerator of `(U - 1)/w = over/under`, so that a division by this slope is the only division.
    pub over: [f64; N],
    /// Denominator of `(U - 1)/w`.
    pub under: [f64; N],
}

/// [`turning`] for several arguments at once, with identical bits.
#[inline(always)]
pub fn turning_lanes<const N: usize>(w: &[f64; N]) -> Turnings<N> {
    let (mut rises, mut falls, mut turns) = (false, false, false);
    for &w in w {
        rises |= w <= -1.0;
        falls |= w >= 1.0;
        turns |= (w > -1.0) & (w < 1.0);
    }
    let mut found = Turnings { ln_u: [0.0; N], u: [0.0; N], excess: [0.0; N], over: [0.0; N], under: [0.0; N] };
    // Each loop calls its formula by name: through a parameter the formula would not be inlined, and its lanes not vectorised.
    match (rises, turns, falls) {
        (false, _, false) => {
            for (i, &w) in w.iter().enumerate() {
                found.set(i, near(w));
            }
        }
        (false, false, true) => {
            for (i, &w) in w.iter().enumerate() {
                found.set(i, falling(w));
            }
        }
        (false, true, true) => {
            for (i, &w) in w.iter().enumerate() {
                found.set(i, near_or_falling(w));
            }
        }
        (true, false, false) => {
            for (i, &w) in w.iter().enumerate() {
                found.set(i, rising(w));
            }
        }
        (true, ..) => {
            for (i, &w) in w.iter().enumerate() {
                found.set(i, any(w));
            }
        }
    }
    found
}

/// On both sides of the border at 1: evaluates both formulas, each on an argument in its range, and selects one.
#[inline(always)]
fn near_or_falling(w: f64) -> Lane {
    choose(w < 1.0, near(if w < 1.0 { w } else { 0.5 }), falling(if w < 1.0 { 1.0 } else { w }))
}

/// Evaluates all three formulas and selects one.
#[inline(always)]
fn any(w: f64) -> Lane {
    let rises = w <= -1.0;
    choose(rises, rising(if rises { w } else { -1.0 }), near_or_falling(if rises { 0.5 } else { w }))
}

impl<const N: usize> Turnings<N> {
    #[inline(always)]
    fn set(&mut self, i: usize, place: Lane) {
        (self.ln_u[i], self.u[i], self.excess[i]) = (place.ln_u, place.u, place.excess);
        (self.over[i], self.under[i]) = (place.over, place.under);
    }
}

/// One element of [`Turnings`].
struct Lane {
    ln_u: f64,
    u: f64,
    excess: f64,
    over: f64,
    under: f64,
}

/// Selects one of two values without a branch.
#[inline(always)]
fn choose(first: bool, one: Lane, other: Lane) -> Lane {
    Lane {
        ln_u: if first { one.ln_u } else { other.ln_u },
        u: if first { one.u } else { other.u },
        excess: if first { one.excess } else { other.excess },
        over: if first { one.over } else { other.over },
        under: if first { one.under } else { other.under },
    }
}

/// `|w| < 1`: a polynomial for `ln U / w`; then `(U - 1)/w = ln U / w + w/2` needs no exponential.
#[inline(always)]
fn near(w: f64) -> Lane {
    let q = polynomial(&LN_U_OVER_W, w);
    let slope = q + 0.5 * w;
    let excess = w * slope;
    Lane { ln_u: w * q, u: 1.0 + excess, excess, over: slope, under: 1.0 }
}

/// `w <= -1`, theta rises: `U = x (1 + ...)` is small, and `ln U = -1 - w^2/2 + U`.
#[inline(always)]
fn rising(w: f64) -> Lane {
    let e = 0.5 * w * w;
    let g = exp(-e);
    let s = g / (1.0 + (1.0 - g).sqrt());
    let u = g * std::f64::consts::E.recip() * polynomial(&U_OVER_X, s);
    Lane { ln_u: u - (1.0 + e), u, excess: u - 1.0, over: u - 1.0, under: w }
}

/// `w >= 1`, theta falls. A guess with an error below 1.3e-4, corrected by the reversed series of `U - 1 - ln U` about it, with one logarithm in
/// total.
#[inline(always)]
fn falling(w: f64) -> Lane {
    let e = 0.5 * w * w;
    let guess = 1.0 + far_excess(w, e);
    let d = guess - 1.0;
    let inverse = 1.0 / d;
    let ln_guess = ln(guess);
    // U = guess (1 + x): d x + x^2/2 - x^3/3 + x^4/4 = d y.
    let y = (e - d + ln_guess) * inverse;
    let second = -0.5 * inverse;
    let third = inverse * (1.0 / 3.0 + 0.5 * inverse);
    let fourth = -inverse * (0.25 + inverse * (5.0 / 6.0 + 0.625 * inverse));
    let x = y * (1.0 + y * (second + y * (third + y * fourth)));
    let excess = d + guess * x;
    let ln_u = ln_guess + x * (1.0 - x * (0.5 - x * (1.0 / 3.0)));
    Lane { ln_u, u: 1.0 + excess, excess, over: excess, under: w }
}

/// `U - 1` for `w >= 1` and `e = w^2/2`, within 1.3e-4 of `U`.
#[inline(always)]
fn far_excess(w: f64, e: f64) -> f64 {
    let far = w / (w + 11.0);
    let [c0, c1, c2, c3] = LN_U_FAR;
    e + (c0 + far * (c1 + far * (c2 + far * c3)))
}

/// `U - 1` for `w >= 0` and `e = w^2/2`, within 1e-3 of `U` and without a logarithm.
#[inline(always)]
pub fn rough_excess(w: f64, e: f64) -> f64 {
    let near = w * (1.0 + w * (1.0 / 3.0 + w * (1.0 / 36.0 - w * (1.0 / 270.0))));
    let far = far_excess(w, e);
    if w < 1.0 { near } else { far }
}
