//! Elementary functions (provisional).
/// ln
#[inline(always)]
pub fn ln(x: f64) -> f64 { libm::log(x) }
/// ln_1p
#[inline(always)]
pub fn ln_1p(x: f64) -> f64 { libm::log1p(x) }
/// exp
#[inline(always)]
pub fn exp(x: f64) -> f64 { libm::exp(x) }
/// exp_m1
#[inline(always)]
pub fn exp_m1(x: f64) -> f64 { libm::expm1(x) }
