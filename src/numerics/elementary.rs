//! `ln`, `ln_1p`, `exp` and `exp_m1` without branches, for loops that the compiler turns into vector instructions.
//!
//! Plain IEEE arithmetic and integer operations on bits: no fused multiply-add, no call into the system's library. So a
//! result has the same bits on every machine and at every vector width, which the functions of the standard library do
//! not promise. Errors stay below one unit in the last place for `ln`, `ln_1p` and `exp`, below two for `exp_m1`
//! (asserted in `tests/solver/numerics.rs`).

/// Leading 41 bits of ln 2: its product with an exponent is exact.
const LN_2_HIGH: f64 = f64::from_bits(0x3FE6_2E42_FEFA_3800);
/// ln 2 less [`LN_2_HIGH`].
const LN_2_LOW: f64 = 5.497923018708371e-14;

/// `1.5 * 2^52`: added to a small number it leaves the nearest integer in the low bits. Derived: doubles from 2^52 to 2^53 are integers.
pub(crate) const INTEGER_SHIFT: f64 = 6755399441055744.0;

/// `(2 atanh s - 2 s)/s^3` in powers of `s^2`, Chebyshev interpolant on `|s| <= (sqrt 2 - 1)/(sqrt 2 + 1)`, truncation
/// 5e-18. Made by `tests/reference/coefficients.py`.
const ATANH: [f64; 7] = [
    0.666666666666667,
    0.39999999999899505,
    0.28571428625975487,
    0.2222221113479508,
    0.18182889125261723,
    0.15331721600556042,
    0.14616449685043406,
];

/// `(e^r - 1 - r)/r^2` in powers of `r`, Chebyshev interpolant on `|r| <= ln(2)/2`, truncation 3e-19.
/// Made by `tests/reference/coefficients.py`.
const EXP: [f64; 11] = [
    0.5,
    0.1666666666666667,
    0.04166666666666667,
    0.008333333333326141,
    0.0013888888888883752,
    0.00019841269874800493,
    2.4801587325533363e-05,
    2.7557255425746435e-06,
    2.7557273661348637e-07,
    2.510520637395701e-08,
    2.0914679376583935e-09,
];

/// Natural logarithm of a positive normal number.
#[inline(always)]
pub fn ln(x: f64) -> f64 {
    let (exponent, mantissa) = split(x);
    assemble(exponent, mantissa - 1.0, 0.0)
}

/// `ln(1 + x)` for `-1 < x < 1e300`, with full relative accuracy near 0.
#[inline(always)]
pub fn ln_1p(x: f64) -> f64 {
    ln_grown(x, 1.0 / (1.0 + x))
}

/// `ln(ratio)` with full relative accuracy near 1, from `change`, which is `ratio - 1`.
#[inline(always)]
pub fn ln_near_1(change: f64, ratio: f64) -> f64 {
    if change.abs() < 0.5 { ln_1p(change) } else { ln(ratio) }
}

/// [`ln_1p`] from `1/(1 + x)`.
#[inline(always)]
pub fn ln_grown(x: f64, inverse: f64) -> f64 {
    let sum = 1.0 + x;
    // The exact rounding error of the sum (two-sum), relative to the sum.
    let carried = sum - 1.0;
    let lost = (1.0 - (sum - carried)) + (x - carried);
    let (exponent, mantissa) = split(sum);
    assemble(exponent, mantissa - 1.0, lost * inverse)
}

/// Natural logarithm of a positive normal number with an error of 1e-4: sufficient to count nodes.
#[inline(always)]
pub fn rough_ln(x: f64) -> f64 {
    let (exponent, mantissa) = split(x);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    exponent * std::f64::consts::LN_2 + s * (2.0 + 2.0 / 3.0 * s * s)
}

/// `e^x`; underflows to 0 through the subnormals, infinite from 709.79 on.
#[inline(always)]
pub fn exp(x: f64) -> f64 {
    exp_and_m1(x).0
}

/// `e^x` and `e^x - 1` with the accuracy of [`exp`] and [`exp_m1`], in little more time than one of them.
#[inline(always)]
pub fn exp_and_m1(x: f64) -> (f64, f64) {
    let x = clamp(x, -760.0, 720.0);
    let (turns, high, low) = reduce(x);
    let r = high - low;
    let value = high + (r * r * polynomial(&EXP, r) - low);
    // Two factors, since 2^k itself may overflow or underflow.
    let half = (0.5 * turns + INTEGER_SHIFT) - INTEGER_SHIFT;
    let exp = (1.0 + value) * power_of_two(half) * power_of_two(turns - half);
    // Within a factor of 2 of 1 the power is 1/2, 1 or 2, and exact; beyond, the difference does not cancel.
    let near = x > -0.6 && x < 0.6;
    let power = power_of_two(if near { turns } else { 0.0 });
    (exp, if near { power * value + (power - 1.0) } else { exp - 1.0 })
}

/// `e^x - 1` with full relative accuracy near 0; infinite from 709.79 on.
#[inline(always)]
pub fn exp_m1(x: f64) -> f64 {
    // Below -50 the result is -1 to the last bit.
    let x = clamp(x, -50.0, 720.0);
    let (turns, high, low) = reduce(x);
    let r = high - low;
    let value = high + (r * r * polynomial(&EXP, r) - low);
    // 2^k (value + 1) - 1, with half the power first, so that no intermediate value overflows.
    let half_power = power_of_two(clamp(turns, -100.0, 1024.0) - 1.0);
    let result = 2.0 * (half_power * value + (half_power - 0.5));
    if turns > 1024.0 { f64::INFINITY } else { result }
}

/// `phi(z) = e^z - 1 - z`, without cancellation near 0.
pub fn phi(z: f64) -> f64 {
    phi_and_slope(z).0
}

/// `phi(z)` and its derivative `e^z - 1`.
pub fn phi_and_slope(z: f64) -> (f64, f64) {
    let slope = exp_m1(z);
    let phi = if z.abs() < 0.25 { z * z * polynomial(&EXP, z) } else { slope - z };
    (phi, slope)
}

/// `x = 2^k m` with `sqrt(1/2) <= m < sqrt(2)`: `(k, m)`.
#[inline(always)]
fn split(x: f64) -> (f64, f64) {
    // Adding the distance from sqrt(1/2) to 1 carries into the exponent exactly where m would pass sqrt(2).
    let bits = x.to_bits().wrapping_add(0x3FF0_0000_0000_0000 - 0x3FE6_A09E_667F_3BCD);
    // The exponent as the low bits of 2^52 is a float without an integer conversion.
    let exponent = f64::from_bits((bits >> 52) | 0x4330_0000_0000_0000) - (4503599627370496.0 + 1023.0);
    let mantissa = f64::from_bits((bits & 0x000F_FFFF_FFFF_FFFF) + 0x3FE6_A09E_667F_3BCD);
    (exponent, mantissa)
}

/// `k ln 2 + ln(1 + f) + c`, small parts first: `ln(1 + f) = f - f^2/2 + s (f^2/2 + R)` with `s = f/(2 + f)`.
#[inline(always)]
fn assemble(exponent: f64, f: f64, c: f64) -> f64 {
    let s = f / (2.0 + f);
    let s2 = s * s;
    let r = s2 * polynomial(&ATANH, s2);
    let half_square = 0.5 * f * f;
    exponent * LN_2_HIGH - ((half_square - (s * (half_square + r) + (exponent * LN_2_LOW + c))) - f)
}

/// `x = k ln 2 + high - low`: `(k, high, low)`.
#[inline(always)]
fn reduce(x: f64) -> (f64, f64, f64) {
    let turns = (x * std::f64::consts::LOG2_E + INTEGER_SHIFT) - INTEGER_SHIFT;
    (turns, x - turns * LN_2_HIGH, turns * LN_2_LOW)
}

/// `2^k` for a whole `k` from -1022 to 1023.
#[inline(always)]
fn power_of_two(k: f64) -> f64 {
    f64::from_bits(((k + (INTEGER_SHIFT + 1023.0)).to_bits()) << 52)
}

/// `x` within `[low, high]`; NaN stays NaN.
#[inline(always)]
fn clamp(x: f64, low: f64, high: f64) -> f64 {
    let x = if x < low { low } else { x };
    if x > high { high } else { x }
}

/// `c[0] + c[1] x + c[2] x^2 + …`, with at least two terms. Even and odd powers are summed separately, which halves the chain of dependent
/// operations.
#[inline(always)]
pub(crate) fn polynomial<const N: usize>(c: &[f64; N], x: f64) -> f64 {
    let square = x * x;
    // The highest even and odd power.
    let (mut even, mut odd) = if N % 2 == 1 { (c[N - 1], c[N - 2]) } else { (c[N - 2], c[N - 1]) };
    for i in (0..N - 2).rev() {
        if i % 2 == 0 {
            even = even * square + c[i];
        } else {
            odd = odd * square + c[i];
        }
    }
    even + x * odd
}
