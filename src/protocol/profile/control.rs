//! What a spring has to be told along a resolved panel: derivatives of the velocity, and the range of what follows.

use super::Exponent;
use super::curve::Curve;
use super::hermite::Hermite;
use super::passage::Resolved;
use crate::numerics::elementary::exp;
use crate::numerics::radau::radau;
use crate::protocol::control::{Extent, Jet, Tolerance};

impl Curve<Hermite> {
    /// `v`, `v'`, `v''` and `v'''` in time.
    fn derivatives(&self, x: f64, z: f64) -> [f64; 4] {
        let w = self.w_f * exp(self.exponent.value(x, z));
        let [f1, f2, f3] = self.exponent.derivatives(x, z);
        let t = self.t_f;
        [self.floor + w, w * f1 / t, w * (f2 + f1 * f1) / t / t, w * (f3 + 3.0 * f1 * f2 + f1 * f1 * f1) / t / t / t]
    }
}

impl Resolved {
    /// The moment at a share `u` of the panel.
    pub fn jet(&self, curve: &Curve<Hermite>, u: f64) -> Jet {
        let (x, z) = self.place(u);
        Jet { v: curve.derivatives(x, z), theta: self.theta(u), rate: self.rate(u) }
    }

    /// Takes the range of something on the panel into `extent`, turns as good as `tolerance`; `told` gives its value and its
    /// slope in time, from the moment and `theta''` there.
    pub fn range(
        &self,
        curve: &Curve<Hermite>,
        tolerance: Tolerance,
        extent: &mut Extent,
        told: impl Fn(&Jet, f64) -> [f64; 2],
    ) {
        let duration = self.duration(curve);
        let (bend_start, bends) = self.bends(duration);
        let along = |u: f64, jet: &Jet, bend: f64| {
            let [value, slope] = told(jet, bend);
            (u, [value, duration * slope])
        };
        let between = |u: f64| along(u, &self.jet(curve, u), radau().interpolate(bend_start, &bends, u)).1;
        let mut before = (0.0, between(0.0));
        for ((u, theta, rate), bend) in self.nodes().zip(bends) {
            let (x, z) = self.place(u);
            let after = along(u, &Jet { v: curve.derivatives(x, z), theta, rate }, bend);
            extent.turn(before, after, tolerance, between);
            before = after;
        }
    }
}
