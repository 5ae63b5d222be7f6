//! The principal branch of the Lambert function from its branch point on.

use super::elementary::{exp, rough_ln};
use super::lanes::Vector;

/// `E >= 1` with `E ln E - E + 1 = d`, that is `e^(1 + W_0((d - 1)/e))`, for `d >= 0`; to a dozen units in the last place.
pub fn above_branch(d: f64) -> f64 {
    if d <= NEAR_END { near_branches(Vector::splat(d)).0[0] } else { far_branch(d) }
}

/// One of both sums of a polynomial, of its even or its odd powers, in straight lines: the compiler would split the lanes of a loop.
macro_rules! sum {
    ($c:ident, $square:ident, $last:literal $(, $i:literal)*) => {{
        let sum = Vector::splat($c[$last]);
        $(let sum = sum * $square + Vector::splat($c[$i]);)*
        sum
    }};
}

/// [`above_branch`] in every lane for numbers up to [`NEAR_END`], to some units in the last place, without branches.
///
/// Close to the branch point `E` is a series in `p = sqrt(2 d)` (Corless et al., Advances in Computational Mathematics 5, 329, 1996, section 4). The
/// next singularity is at `p = -sqrt 2`, where the other branch ends in `E = 0`. All coefficients of the rational interpolant are positive, so that
/// no digits are lost.
#[inline(always)]
pub fn near_branches(d: Vector) -> Vector {
    let p = (d + d).map(f64::sqrt);
    let square = p * p;
    let even = sum!(NEAR_ABOVE, square, 10, 8, 6, 4, 2, 0);
    let odd = sum!(NEAR_ABOVE, square, 11, 9, 7, 5, 3, 1);
    let even_below = sum!(NEAR_BELOW, square, 10, 8, 6, 4, 2, 0);
    let odd_below = sum!(NEAR_BELOW, square, 9, 7, 5, 3, 1);
    (even + p * odd) / (even_below + p * odd_below)
}

/// [`above_branch`] for `d > NEAR_END`, without branches: one step of Halley's and one of Newton's method.
#[inline(always)]
pub fn far_branch(d: f64) -> f64 {
    let l = rough_ln(1.0 + (2.0 * d).sqrt());
    let [a_1, a_2, b_1, b_2] = GUESS;
    // ln E, and E.
    let y = (l + l * l * (a_1 + a_2 * l)) / (1.0 + l * (b_1 + b_2 * l));
    let e = exp(y);
    let newton = ((1.0 - y) * e + (d - 1.0)) / (y * e);
    let step = newton / (1.0 + 0.5 * newton * (1.0 + 1.0 / y));
    let (y, e) = (y + step, e + e * step * (1.0 + step * (0.5 + step * (1.0 / 6.0 + step * (1.0 / 24.0)))));
    e + ((1.0 - y) * e + (d - 1.0)) / y
}

/// Greatest `d` of [`near_branches`]. Chosen: `p = 20`, where `theta v = 23`, so that most paths lie below.
pub const NEAR_END: f64 = 200.0;

/// Numerator of `E` in powers of `p`, interpolated on `p <= 20` with a truncation of 1.5e-16. Made by `tests/reference/coefficients.py`.
const NEAR_ABOVE: [f64; 12] = [
    1.0,
    3.029078894777655,
    3.8248450936792073,
    2.6190667050743572,
    1.0616192287145296,
    0.2617745779483023,
    0.03903560590923276,
    0.0034098982236382054,
    0.0001643547148081372,
    3.952708867712939e-06,
    3.962649443703479e-08,
    1.1053722349208642e-10,
];

/// Denominator of `E`, with [`NEAR_ABOVE`].
const NEAR_BELOW: [f64; 11] = [
    1.0,
    2.029078894777651,
    1.6290995322350286,
    0.6656762459300891,
    0.14890434170439565,
    0.01836648909063818,
    0.0012057747359355496,
    3.8872411719431934e-05,
    5.270180322493817e-07,
    2.130195301253757e-09,
    4.766991243061628e-13,
];

/// Coefficients of `ln E/L` with `L = ln(1 + p)`: `(1 + a_1 L + a_2 L^2)/(1 + b_1 L + b_2 L^2)`. Fitted to `ln E <= 36`, where its error is 1.6e-4.
const GUESS: [f64; 4] = [0.7074810976002599, 0.15562451660492752, 0.5403412703865909, 0.07870485733359356];
