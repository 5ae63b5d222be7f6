//! The rate-and-state friction law (ageing form) and a transition between two of its steady states.

use crate::numerics::elementary::ln_1p;

/// Rate-and-state friction in scaled units: `tau = 1 + a ln v + b ln theta`, `theta' = 1 - theta v`.
///
/// Lengths are in units of `l`, velocities in `v_0`, stresses in `mu_0 sigma`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law {
    /// Direct effect of the velocity, `a > 0` (dimensionless, `a_SI / mu_0`).
    pub a: f64,
    /// Effect of the contact lifetime, `b >= 0` (dimensionless, `b_SI / mu_0`).
    pub b: f64,
}

/// A change from steady sliding at `v_i` to steady sliding at `v_f`, both above 1 (`v_0`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// The friction law.
    pub law: Law,
    /// Initial steady velocity, `v_i > 1`.
    pub v_i: f64,
    /// Final steady velocity, `v_f > 1`.
    pub v_f: f64,
}

impl Transition {
    /// Least duration of any protocol with `v >= 1`, `t_min`: 0 unless it slows down, then the time in which contacts
    /// age from `1/v_i` to `1/v_f` at `v = 1`.
    pub fn least_time(&self) -> f64 {
        ln_1p((self.v_i - self.v_f).max(0.0) / (self.v_i * (self.v_f - 1.0)))
    }
}
