//! The control velocity under which a block on a spring follows a protocol, `v_c = v + (tau' + m v'')/k`.
//!
//! The spring force is `k s = tau + m v'` and its extension changes by `s' = v_c - v` (docs/derivations.md). Every
//! derivative is analytic.

use crate::model::Law;
use crate::numerics::ROOT_OF_ROUNDING;
use crate::numerics::elementary::ln;
use crate::numerics::root::crossing;

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
    /// State variable.
    pub theta: f64,
    /// `theta' = 1 - theta v`, accurate where it is small compared with 1.
    pub rate: f64,
}

impl SpringBlock {
    /// Friction, in `mu_0 sigma`.
    pub fn friction(&self, jet: &Jet) -> f64 {
        1.0 + self.law.a * ln(jet.v[0]) + self.law.b * ln(jet.theta)
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

impl Tolerance {
    /// What slopes are multiplied with to be those of a value.
    fn unit(self, value: f64) -> f64 {
        if matches!(self, Tolerance::OfValue(_)) { value } else { 1.0 }
    }
}

/// Ratio of the slopes of two nodes below which the smaller one counts as vanishing. Measured: three extrema were between slopes with a ratio of 7e-5 (`cargo
/// test --test solver compliant`); chosen above that.
const FLAT_RATIO: f64 = 1e-3;

/// A place, with value and slope there.
type Node = (f64, [f64; 2]);

impl ValueRange {
    /// The empty range.
    pub const NONE: ValueRange = ValueRange { low: f64::INFINITY, high: f64::NEG_INFINITY };

    /// Extends the range to a value.
    pub fn add(&mut self, value: f64) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
    }

    /// Extends the range to the values between two nodes; `at(u)` returns value and slope.
    ///
    /// A slope that vanishes at a node, as nearly at both ends of a protocol, has no sign, and an extremum may be arbitrarily near: the interval is divided
    /// ever closer to that node.
    pub fn add_interval(&mut self, first: Node, last: Node, tolerance: Tolerance, at: &impl Fn(f64) -> [f64; 2]) {
        self.add(first.1[0]);
        self.add(last.1[0]);
        let allowed = self.allowed(tolerance);
        let [start, end] = [first, last].map(|(_, [_, slope])| (slope * (last.0 - first.0)).abs());
        match [start <= allowed.max(FLAT_RATIO * end), end <= allowed.max(FLAT_RATIO * start)] {
            [false, true] => self.add_towards(first, last, tolerance, at),
            [true, false] => self.add_towards(last, first, tolerance, at),
            [true, true] if (last.1[0] - first.1[0]).abs() > self.allowed(tolerance) * tolerance.unit(first.1[0]) => {
                let u = 0.5 * (first.0 + last.0);
                let middle = (u, at(u));
                self.add(middle.1[0]);
                self.add_towards(middle, first, tolerance, at);
                self.add_towards(middle, last, tolerance, at);
            }
            _ => self.add_between(first, last, tolerance, at),
        }
    }

    /// Extends the range to the values between two nodes, of which the slope vanishes at the second.
    fn add_towards(&mut self, from: Node, flat: Node, tolerance: Tolerance, at: &impl Fn(f64) -> [f64; 2]) {
        let mut before = from;
        let length = |(u, _): Node| (flat.0 - u).abs();
        while length(before) > ROOT_OF_ROUNDING && before.1[1].abs() * length(before) > self.allowed(tolerance) {
            let u = 0.25 * before.0 + 0.75 * flat.0;
            let next = (u, at(u));
            self.add(next.1[0]);
            self.add_between(before, next, tolerance, at);
            before = next;
        }
        self.add_between(before, flat, tolerance, at);
    }

    /// Extends the range to the extrema between two nodes, in either order.
    ///
    /// There is an extremum where the slopes differ in sign. Where they do not, there may be two: the slope is checked
    /// where that of the cubic through both nodes bends back most.
    fn add_between(
        &mut self,
        (u_0, [value_0, slope_0]): Node,
        (u_1, [value_1, slope_1]): Node,
        tolerance: Tolerance,
        at: &impl Fn(f64) -> [f64; 2],
    ) {
        if (slope_0 > 0.0) != (slope_1 > 0.0) {
            return self.add_extremum([u_0, u_1], [slope_0, slope_1], tolerance, at);
        }
        let length = u_1 - u_0;
        let mean = (value_1 - value_0) / (length * tolerance.unit(value_0));
        // The slope of the cubic is `slope_0 + bend s + 3 (...) s^2` over the fraction `s`.
        let bend = 2.0 * (3.0 * mean - 2.0 * slope_0 - slope_1);
        let s = bend / (6.0 * (2.0 * mean - slope_0 - slope_1));
        let opposite = slope_0 + 0.5 * bend * s;
        let matters = (opposite * length).abs() > self.allowed(tolerance);
        if s > 0.0 && s < 1.0 && matters && (opposite > 0.0) != (slope_0 > 0.0) {
            let middle = u_0 + s * length;
            let [value, slope] = at(middle);
            self.add(value);
            if (slope > 0.0) != (slope_0 > 0.0) {
                self.add_extremum([u_0, middle], [slope_0, slope], tolerance, at);
                self.add_extremum([middle, u_1], [slope, slope_1], tolerance, at);
            }
        }
    }

    /// Extends the range to the extremum between two places whose slopes differ in sign.
    fn add_extremum(&mut self, ends: [f64; 2], slopes: [f64; 2], tolerance: Tolerance, at: &impl Fn(f64) -> [f64; 2]) {
        let slope = |u: f64| {
            let [value, slope] = at(u);
            self.add(value);
            // The extremum differs from this value by less than the slope over the interval.
            if (slope * (ends[1] - ends[0])).abs() <= self.allowed(tolerance) { 0.0 } else { slope }
        };
        crossing(slope, ends, slopes, 0.0);
    }

    /// Error of an extremum that is allowed.
    fn allowed(&self, tolerance: Tolerance) -> f64 {
        match tolerance {
            Tolerance::OfValue(rtol) => 0.1 * rtol,
            Tolerance::OfRange(rtol) => 0.1 * rtol * self.magnitude(),
        }
    }

    /// Greatest absolute value in the range.
    pub fn magnitude(&self) -> f64 {
        self.high.abs().max(self.low.abs())
    }
}

#[cfg(test)]
mod tests {
    //! Extrema of functions with known ones.

    use super::{Tolerance, ValueRange};

    #[test]
    fn an_extremum_near_a_node_of_vanishing_slope_is_found() {
        // A rise to 1 whose last part overshoots: 1 + d s^2 - s^3 (1 + s) at the distance s from the end, as v_c of a stiff spring.
        for d in [1e-1, 1e-2, 1e-3] {
            let at = |u: f64| {
                let s = 1.0 - u;
                [1.0 + d * s * s - s * s * s * (1.0 + s), -2.0 * d * s + 3.0 * s * s + 4.0 * s * s * s]
            };
            let node = |u: f64| (u, at(u));
            let mut range = ValueRange::NONE;
            range.add_interval(node(0.3), node(1.0), Tolerance::OfRange(1e-13), &at);
            // Where 4 s^2 + 3 s = 2 d.
            let s = 4.0 * d / (3.0 + (9.0 + 32.0 * d).sqrt());
            assert!((range.high - at(1.0 - s)[0]).abs() < 1e-13, "{d}: {range:?}");
            assert_eq!(range.low, at(0.3)[0]);
        }
    }
}
