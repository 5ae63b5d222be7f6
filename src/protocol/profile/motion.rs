//! A member over time.

use super::Exponent;
use super::curve::Curve;
use super::passage::{Resolved, friction_at};
use crate::model::Law;
use crate::numerics::elementary::exp;
use crate::protocol::{Moment, Motion};

/// Panels of equal length in the parameter `s`, each with theta at its nodes.
pub struct Resolution<E> {
    pub law: Law,
    pub curve: Curve<E>,
    pub panels: Vec<Resolved>,
}

impl<E> Resolution<E> {
    /// The panel at `s`, and the share of it.
    pub fn place(&self, s: f64) -> (&Resolved, f64) {
        let count = self.panels.len();
        let along = s.clamp(0.0, 1.0) * count as f64;
        let k = (along as usize).min(count - 1);
        (&self.panels[k], along - k as f64)
    }
}

impl<E: Exponent> Motion for Resolution<E> {
    fn duration(&self) -> f64 {
        self.curve.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        let count = self.panels.len();
        (0..=count).map(|k| k as f64 / count as f64).collect()
    }

    fn at(&self, s: f64) -> Moment {
        let (panel, u) = self.place(s);
        let (x, z) = panel.place(u);
        let theta = panel.theta(u);
        let v = self.curve.floor + self.curve.w_f * exp(self.curve.exponent.value(x, z));
        Moment { t: self.curve.t_f * x, v, theta, friction: friction_at(&self.law, v, theta), v_c: None, beta: None }
    }
}
