//! The margin of steady friction below a ceiling, `tau_M - 1 - (a - b) ln v`, with full relative accuracy.

use super::Law;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::ln;

/// `ln 2` less its nearest double.
const LN_2_REST: f64 = 2.3190468138462996e-17;

/// Margin, fraction of its terms, below which it is formed in double-double. Chosen: one digit is lost there.
const CANCELLATION: f64 = 0.1;

/// Margin of steady sliding at `v > 0`, in `mu_0 sigma`; infinite without a ceiling.
pub fn friction_margin(law: Law, tau_ceiling: f64, v: f64) -> f64 {
    let scale = tau_ceiling - 1.0;
    if scale == f64::INFINITY {
        return scale;
    }
    let plain = scale - (law.a - law.b) * ln(v);
    if plain.abs() > CANCELLATION * scale.abs().max(1.0) {
        return plain;
    }
    let slope = DoubleDouble::sum(law.a, -law.b);
    (DoubleDouble::sum(tau_ceiling, -1.0) - slope * logarithm(v)).high
}

/// `ln v` in double-double: `k ln 2 + 2 atanh s`, `s = (m - 1)/(m + 1)`, for `v = 2^k m`.
fn logarithm(v: f64) -> DoubleDouble {
    let (mut m, mut k) = libm::frexp(v);
    if m < std::f64::consts::FRAC_1_SQRT_2 {
        (m, k) = (2.0 * m, k - 1);
    }
    let s = DoubleDouble::sum(m, -1.0) / DoubleDouble::sum(m, 1.0);
    let square = s * s;
    // s^2 is below 0.0295: its twenty-first power ends the series.
    let mut sum = DoubleDouble::new(0.0);
    for n in (0..21).rev() {
        sum = sum * square + DoubleDouble::new(1.0) / DoubleDouble::new(f64::from(2 * n + 1));
    }
    let ln_2 = DoubleDouble { high: std::f64::consts::LN_2, low: LN_2_REST };
    DoubleDouble::new(f64::from(k)) * ln_2 + DoubleDouble::new(2.0) * s * sum
}
