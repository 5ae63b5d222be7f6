//! The state variable theta with its distance from 1, the limit of ageing at `v = 1`.

use crate::numerics::elementary::{exp_and_m1, exp_m1, ln, ln_1p};

/// A value of the state variable; `theta` and `1 - theta` are each known to full relative accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lifetime {
    /// The lifetime `theta > 0`.
    pub theta: f64,
    /// `1 - theta`.
    pub rest: f64,
    /// `ln theta`.
    pub ln: f64,
}

impl Lifetime {
    /// The state of steady sliding at `v`, `1/v`.
    pub fn steady(v: f64) -> Lifetime {
        Lifetime::with(1.0 / v, (v - 1.0) / v)
    }

    /// From `theta` and `1 - theta`; `ln theta` comes from whichever of `theta` and `1 - theta` is small.
    pub fn with(theta: f64, rest: f64) -> Lifetime {
        let ln = if theta < 0.5 { ln(theta) } else { ln_1p(-rest) };
        Lifetime { theta, rest, ln }
    }

    /// By how much it grows in `time` at `v = 1`.
    pub fn growth(&self, time: f64) -> f64 {
        -self.rest * exp_m1(-time)
    }

    /// The state after `time` at `v = 1`.
    pub fn aged(&self, time: f64) -> Lifetime {
        self.aged_by(time).0
    }

    /// The state after `time` at `v = 1`, and by how much it has grown.
    pub fn aged_by(&self, time: f64) -> (Lifetime, f64) {
        let (left, lost) = exp_and_m1(-time);
        let growth = -self.rest * lost;
        (Lifetime::with(self.theta + growth, self.rest * left), growth)
    }
}
