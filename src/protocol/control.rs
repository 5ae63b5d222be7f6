//! The control velocity under which a block on a spring follows a protocol, `v_c = v + (tau' + m v'')/k`.
//!
//! The spring force is `k s = tau + m v'` and its extension changes by `s' = v_c - v` (docs/derivations.md). Every
//! derivative is analytic.

use crate::model::Law;
use crate::numerics::elementary::ln;

/// A block on a spring under friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringBlock {
    /// The friction law.
    pub law: Law,
    /// Stiffness of the spring, `k > 0`; infinite for a rigid spring.
    pub k: f64,
    /// Mass of the block, `m >= 0`.
    pub m: f64,
}

/// State of a smooth protocol at one time, with the derivatives of the velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet {
    /// `v`, `v'`, `v''`, `v'''`.
    pub v: [f64; 4],
    /// Contact lifetime.
    pub theta: f64,
    /// `theta' = 1 - theta v`, accurate where it is small compared with 1.
    pub rate: f64,
}

impl SpringBlock {
    /// Friction, in `mu_0 sigma`.
    pub fn friction(&self, jet: &Jet) -> f64 {
        1.0 + self.law.a * ln(jet.v[0]) + self.law.b * ln(jet.theta)
    }

    /// Spring force, `k s = tau + m v'`.
    pub fn spring_force(&self, jet: &Jet) -> f64 {
        self.friction(jet) + self.m * jet.v[1]
    }

    /// Control velocity `v_c`, in `v_0`.
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

    /// Rate of the control velocity `v_c'`, for this `theta''`.
    pub fn control_rate(&self, jet: &Jet, theta_second: f64) -> f64 {
        let [v, v1, v2, v3] = jet.v;
        if self.k == f64::INFINITY {
            return v1;
        }
        let (q1, y1) = (v1 / v, jet.rate / jet.theta);
        let (q2, y2) = (v2 / v - q1 * q1, theta_second / jet.theta - y1 * y1);
        let Law { a, b } = self.law;
        v1 + (a * q2 + b * y2 + self.m * v3) / self.k
    }
}

/// Range of a quantity along a protocol; its extrema are roots of its slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ValueRange {
    /// Least value so far.
    pub low: f64,
    /// Greatest value so far.
    pub high: f64,
}

/// Accuracy of an extremum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Tolerance {
    /// In units of the value there; slopes are those of its logarithm.
    OfValue(f64),
    /// In units of the greatest absolute value in the range.
    OfRange(f64),
}

/// Steps of the Illinois method for an extremum, at most. Chosen: more than a bracket between two nodes takes.
const MAX_STEPS: u32 = 60;

impl ValueRange {
    /// The empty range.
    pub const NONE: ValueRange = ValueRange { low: f64::INFINITY, high: f64::NEG_INFINITY };

    /// Extends the range to a value.
    pub fn add(&mut self, value: f64) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
    }

    /// Extends the range to the values between two nodes `(u, [value, slope])`, with an extremum where the slopes differ in
    /// sign. `at(u)` returns value and slope; the Illinois method finds the root of the slope.
    pub fn add_interval(
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
        for _ in 0..MAX_STEPS {
            let u = u_0 + (u_1 - u_0) * (slope_0 / (slope_0 - slope_1));
            let [value, slope] = at(u);
            self.add(value);
            // The extremum differs from this value by less than the slope over the bracket.
            let allowed = match tolerance {
                Tolerance::OfValue(rtol) => 0.1 * rtol,
                Tolerance::OfRange(rtol) => 0.1 * rtol * self.high.abs().max(self.low.abs()),
            };
            if slope.abs() * (u_1 - u_0) <= allowed {
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
