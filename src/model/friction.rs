//! The rate-and-state friction law (ageing form) and a transition between two of its steady states.

use crate::numerics::elementary::ln_1p;

/// Dieterich-Ruina friction with ageing in scaled units: `tau = 1 + a ln v + b ln theta`, `theta' = 1 - theta v`.
///
/// Lengths are in units of `l`, velocities in `v_0`, stresses in `mu_0 sigma` (Dieterich 1979, Ruina 1983).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law {
    /// Direct effect, `a > 0` (dimensionless, `a_SI / mu_0`).
    pub a: f64,
    /// Evolution effect, `b >= 0` (dimensionless, `b_SI / mu_0`).
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
    /// Least duration `t_min` of a protocol with `v >= 1`, in `l/v_0`: the ageing time of a deceleration, 0 otherwise.
    pub fn min_duration(&self) -> f64 {
        self.ageing_time().max(0.0)
    }

    /// Time in which contacts age from `1/v_i` to `1/v_f` at `v = 1`, in `l/v_0`; negative for an acceleration.
    pub fn ageing_time(&self) -> f64 {
        let &Transition { v_i, v_f, .. } = self;
        if v_i < v_f {
            // The difference of the velocities may be as small as rounding.
            return -ln_1p((v_f - v_i) / v_f / (v_i - 1.0));
        }
        // Operations as in the optimum's time at the floor, so that both give the same double.
        let (fall, rest) = ((v_i - v_f) / v_i, (v_f - 1.0) / v_f);
        ln_1p(fall * (1.0 / v_f) / rest)
    }
}
