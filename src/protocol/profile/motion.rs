//! A member over time.

use super::Exponent;
use super::curve::VelocityCurve;
use super::theta::{ResolvedPanel, friction_at};
use crate::model::Law;
use crate::numerics::elementary::exp;
use crate::protocol::{Moment, Motion, equal_landmarks, interval_at};

/// Member as a motion: panels of equal length in the parameter `s`, each with theta at its nodes.
pub struct ResolvedProfile<E> {
    pub law: Law,
    pub curve: VelocityCurve<E>,
    pub panels: Vec<ResolvedPanel>,
}

impl<E> ResolvedProfile<E> {
    /// Panel at `s`, and the fraction of it.
    pub fn panel_at(&self, s: f64) -> (&ResolvedPanel, f64) {
        let (k, fraction) = interval_at(s, self.panels.len());
        (&self.panels[k], fraction)
    }
}

impl<E: Exponent> Motion for ResolvedProfile<E> {
    fn duration(&self) -> f64 {
        self.curve.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        equal_landmarks(self.panels.len())
    }

    fn at(&self, s: f64) -> Moment {
        let (panel, u) = self.panel_at(s);
        let (x, z) = panel.x_and_z(u);
        let theta = panel.theta(u);
        let v = self.curve.floor + self.curve.w_f * exp(self.curve.exponent.value(x, z));
        Moment { t: self.curve.t_f * x, v, theta, friction: friction_at(&self.law, v, theta), v_c: None, beta: None }
    }
}
