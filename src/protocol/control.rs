//! The control velocity under which a block on a spring follows a protocol, `v_c = v + (tau' + m v'')/k`.
//!
//! The spring pulls with `k s = tau + m v'` and grows by `s' = v_c - v` (docs/theory.md, "Finite stiffness"). Every
//! derivative is analytic.

use crate::model::Law;
use crate::numerics::elementary::ln;

/// A block on a spring under friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringBlock {
    /// The friction law.
    pub law: Law,
    /// Stiffness of the spring, `k > 0`; infinite for a rigid one.
    pub k: f64,
    /// Mass of the block, `m >= 0`.
    pub m: f64,
}

/// A moment of a smooth protocol, with its derivatives in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet {
    /// `v`, `v'`, `v''`, `v'''`.
    pub v: [f64; 4],
    /// Contact lifetime.
    pub theta: f64,
    /// `theta' = 1 - theta v`, accurate where it is small beside 1.
    pub rate: f64,
}

impl SpringBlock {
    /// Friction.
    pub fn friction(&self, jet: &Jet) -> f64 {
        1.0 + self.law.a * ln(jet.v[0]) + self.law.b * ln(jet.theta)
    }

    /// The spring force `k s = tau + m v'`.
    pub fn pull(&self, jet: &Jet) -> f64 {
        self.friction(jet) + self.m * jet.v[1]
    }

    /// `v_c`.
    pub fn control(&self, jet: &Jet) -> f64 {
        let [v, v1, v2, _] = jet.v;
        if self.k == f64::INFINITY {
            return v;
        }
        // Derivatives of ln v and ln theta.
        let (q1, y1) = (v1 / v, jet.rate / jet.theta);
        let Law { a, b } = self.law;
        v + (a * q1 + b * y1 + self.m * v2) / self.k
    }

    /// `v_c'`, where `theta''` is `bend`.
    pub fn control_rate(&self, jet: &Jet, bend: f64) -> f64 {
        let [v, v1, v2, v3] = jet.v;
        if self.k == f64::INFINITY {
            return v1;
        }
        let (q1, y1) = (v1 / v, jet.rate / jet.theta);
        let (q2, y2) = (v2 / v - q1 * q1, bend / jet.theta - y1 * y1);
        let Law { a, b } = self.law;
        v1 + (a * q2 + b * y2 + self.m * v3) / self.k
    }
}

/// The range of something along a protocol, its turns found from its slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    /// Least value so far.
    pub low: f64,
    /// Greatest value so far.
    pub high: f64,
}

/// The tolerance of a turning point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Tolerance {
    /// In units of the value there, of whose logarithm the slopes are.
    OfValue(f64),
    /// In units of the greatest size in the range.
    OfRange(f64),
}

/// More steps than a bracket between two nodes takes.
const MOST_STEPS: u32 = 60;

impl Extent {
    /// Of nothing.
    pub const NONE: Extent = Extent { low: f64::INFINITY, high: f64::NEG_INFINITY };

    /// Takes in a value.
    pub fn add(&mut self, value: f64) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
    }

    /// Takes in what lies between two places `(u, [value, slope])`: a turn if the slopes differ in sign. `at(u)` tells the
    /// value and the slope; Illinois method on the slope.
    pub fn turn(
        &mut self,
        (mut u_0, [value_0, mut slope_0]): (f64, [f64; 2]),
        (mut u_1, [value_1, mut slope_1]): (f64, [f64; 2]),
        tolerance: Tolerance,
        at: impl Fn(f64) -> [f64; 2],
    ) {
        self.add(value_0);
        self.add(value_1);
        if (slope_0 > 0.0) == (slope_1 > 0.0) {
            return;
        }
        let mut last = 0.0;
        for _ in 0..MOST_STEPS {
            let u = u_0 + (u_1 - u_0) * (slope_0 / (slope_0 - slope_1));
            let [value, slope] = at(u);
            self.add(value);
            // What is left to gain is less than the slope over the bracket.
            let enough = match tolerance {
                Tolerance::OfValue(rtol) => 0.1 * rtol,
                Tolerance::OfRange(rtol) => 0.1 * rtol * self.high.abs().max(self.low.abs()),
            };
            if slope.abs() * (u_1 - u_0) <= enough {
                break;
            }
            if (slope > 0.0) == (slope_0 > 0.0) {
                (u_0, slope_0) = (u, slope);
                slope_1 *= if last > 0.0 { 0.5 } else { 1.0 };
                last = 1.0;
            } else {
                (u_1, slope_1) = (u, slope);
                slope_0 *= if last < 0.0 { 0.5 } else { 1.0 };
                last = -1.0;
            }
        }
    }
}
