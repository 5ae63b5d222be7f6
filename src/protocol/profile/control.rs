//! What a spring has to be told along a resolved panel: derivatives of the velocity, and the range of what follows.

use super::Exponent;
use super::curve::Curve;
use super::hermite::Hermite;
use super::passage::Resolved;
use crate::numerics::elementary::exp;
use crate::protocol::control::{Extent, Jet};

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

    /// Takes the range of something on the panel into `extent`, turns good to `rtol`; `told` gives its value and its
    /// slope in time.
    pub fn range(&self, curve: &Curve<Hermite>, rtol: f64, extent: &mut Extent, told: impl Fn(&Jet) -> [f64; 2]) {
        let duration = self.duration(curve);
        let along = |u: f64, jet: &Jet| {
            let [value, slope] = told(jet);
            (u, [value, duration * slope])
        };
        let mut before = along(0.0, &self.jet(curve, 0.0));
        for (u, theta, rate) in self.nodes() {
            let (x, z) = self.place(u);
            let after = along(u, &Jet { v: curve.derivatives(x, z), theta, rate });
            extent.turn(before, after, rtol, |u| along(u, &self.jet(curve, u)).1);
            before = after;
        }
    }
}
