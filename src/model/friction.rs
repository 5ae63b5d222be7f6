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
        self.ageing_time().max(0.0)
    }

    /// The time in which contacts age from `1/v_i` to `1/v_f` at `v = 1`; negative for an acceleration.
    pub fn ageing_time(&self) -> f64 {
        let &Transition { v_i, v_f, .. } = self;
        if v_i < v_f {
            // The shares of both, of which the first may be as small as rounding.
            return -ln_1p((v_f - v_i) / v_f / (v_i - 1.0));
        }
        // In the steps in which the optimum's hold takes it, so that both are the same double.
        let (fall, rest) = ((v_i - v_f) / v_i, (v_f - 1.0) / v_f);
        ln_1p(fall * (1.0 / v_f) / rest)
    }
}
