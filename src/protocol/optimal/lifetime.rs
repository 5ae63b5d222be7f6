//! A contact lifetime beside its distance from 1, where contacts end up that age at `v = 1`.

use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};

/// A contact lifetime; `theta` and `1 - theta` are each known to full relative accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lifetime {
    /// The lifetime `theta > 0`.
    pub theta: f64,
    /// `1 - theta`.
    pub rest: f64,
}

impl Lifetime {
    /// That of a `theta` as it is.
    pub fn new(theta: f64) -> Lifetime {
        Lifetime { theta, rest: 1.0 - theta }
    }

    /// That of steady sliding at `v`, `1/v`.
    pub fn steady(v: f64) -> Lifetime {
        Lifetime { theta: 1.0 / v, rest: (v - 1.0) / v }
    }

    /// `ln theta`, from whichever of `theta` and `1 - theta` is small.
    pub fn ln(&self) -> f64 {
        if self.theta < 0.5 { ln(self.theta) } else { ln_1p(-self.rest) }
    }

    /// By how much it grows in `time` at `v = 1`.
    pub fn growth(&self, time: f64) -> f64 {
        -self.rest * exp_m1(-time)
    }

    /// What it has become after `time` at `v = 1`.
    pub fn aged(&self, time: f64) -> Lifetime {
        Lifetime { theta: self.theta + self.growth(time), rest: self.rest * exp(-time) }
    }
}
