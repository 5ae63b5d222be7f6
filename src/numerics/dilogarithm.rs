//! The real dilogarithm.

use super::elementary::{ln, ln_1p};

/// `B_2k / (2k + 1)!` for `k = 1 … 9`, with the Bernoulli numbers `B_2k` (DLMF 24.2.1 and 25.12.2).
const BERNOULLI: [f64; 9] = [
    1.0 / 36.0,
    -1.0 / 3600.0,
    1.0 / 211680.0,
    -1.0 / 10886400.0,
    1.0 / 526901760.0,
    -691.0 / 16999766784000.0,
    1.0 / 1120863744000.0,
    -3617.0 / 181400588328960000.0,
    43867.0 / 97072790126247936000.0,
];

/// `Li_2(x) = -int_0^x ln(1 - y)/y dy` for `x <= 1`, to a few units in the last place.
///
/// From -1 to one half it is a series in `-ln(1 - x)`; above, Euler's reflection, `Li_2(x) + Li_2(1 - x)` equals `pi^2/6 - ln x ln(1 - x)`;
/// below -1 the inversion, `Li_2(x) + Li_2(1/x)` equals `-pi^2/6 - ln(-x)^2/2` (DLMF 25.12.4 and 25.12.6).
pub fn dilogarithm(x: f64) -> f64 {
    if x < -1.0 {
        let l = ln(-x);
        -(std::f64::consts::PI * std::f64::consts::PI / 6.0 + 0.5 * l * l) - dilogarithm(1.0 / x)
    } else if x <= 0.5 {
        let l = -ln_1p(-x);
        let l2 = l * l;
        let tail = BERNOULLI.iter().rev().fold(0.0, |sum, &c| sum * l2 + c);
        l * (1.0 - 0.25 * l + l2 * tail)
    } else if x < 1.0 {
        let y = 1.0 - x;
        std::f64::consts::PI * std::f64::consts::PI / 6.0 - ln(x) * ln(y) - dilogarithm(y)
    } else {
        std::f64::consts::PI * std::f64::consts::PI / 6.0
    }
}
