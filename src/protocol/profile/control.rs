//! What a spring has to be told along a resolved panel: derivatives of the velocity, and the range of the control.

use super::Exponent;
use super::curve::Curve;
use super::hermite::Hermite;
use super::passage::Resolved;
use crate::numerics::elementary::exp;
use crate::protocol::control::{Extent, Jet, Slider};

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

    /// Takes the range of `v_c` on the panel into `extent`, turns good to `rtol`.
    pub fn control(&self, slider: &Slider, curve: &Curve<Hermite>, rtol: f64, extent: &mut Extent) {
        let duration = self.duration(curve);
        let told = |jet: &Jet| {
            let [value, slope] = slider.control(jet);
            [value, duration * slope]
        };
        let mut before = (0.0, told(&self.jet(curve, 0.0)));
        for (u, theta, rate) in self.nodes() {
            let (x, z) = self.place(u);
            let after = (u, told(&Jet { v: curve.derivatives(x, z), theta, rate }));
            extent.turn(before, after, rtol, |u| told(&self.jet(curve, u)));
            before = after;
        }
    }
}
