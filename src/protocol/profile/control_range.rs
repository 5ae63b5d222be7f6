//! Derivatives of the velocity on a resolved panel, and the range of a quantity that depends on them.

use super::Exponent;
use super::curve::VelocityCurve;
use super::hermite::Hermite;
use super::theta::ResolvedPanel;
use crate::numerics::elementary::exp;
use crate::numerics::radau::radau;
use crate::protocol::control::{Jet, Tolerance, ValueRange};

impl VelocityCurve<Hermite> {
    /// `v`, `v'`, `v''` and `v'''` in time.
    fn derivatives(&self, x: f64, z: f64) -> [f64; 4] {
        let w = self.w_f * exp(self.exponent.value(x, z));
        let [f1, f2, f3] = self.exponent.derivatives(x, z);
        let t = self.t_f;
        [self.floor + w, w * f1 / t, w * (f2 + f1 * f1) / t / t, w * (f3 + 3.0 * f1 * f2 + f1 * f1 * f1) / t / t / t]
    }
}

impl ResolvedPanel {
    /// State at the fraction `u` of the panel.
    pub fn jet(&self, curve: &VelocityCurve<Hermite>, u: f64) -> Jet {
        let (x, z) = self.x_and_z(u);
        Jet { v: curve.derivatives(x, z), theta: self.theta(u), rate: self.rate(u) }
    }

    /// Extends `range` to the values of a quantity on the panel, its extrema to `tolerance`. `quantity` returns its value
    /// and its slope in time, from the state and `theta''`.
    pub fn range(
        &self,
        curve: &VelocityCurve<Hermite>,
        tolerance: Tolerance,
        range: &mut ValueRange,
        quantity: impl Fn(&Jet, f64) -> [f64; 2],
    ) {
        let duration = self.duration(curve);
        let (theta_second_start, theta_seconds) = self.theta_seconds(duration);
        let along = |u: f64, jet: &Jet, theta_second: f64| {
            let [value, slope] = quantity(jet, theta_second);
            (u, [value, duration * slope])
        };
        let between =
            |u: f64| along(u, &self.jet(curve, u), radau().interpolate(Some(theta_second_start), &theta_seconds, u)).1;
        let mut before = (0.0, between(0.0));
        for ((u, theta, rate), theta_second) in self.nodes().zip(theta_seconds) {
            let (x, z) = self.x_and_z(u);
            let after = along(u, &Jet { v: curve.derivatives(x, z), theta, rate }, theta_second);
            range.add_interval(before, after, tolerance, &between);
            before = after;
        }
    }
}
