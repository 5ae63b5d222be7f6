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

impl<E: Exponent> Motion for Resolution<E> {
    fn duration(&self) -> f64 {
        self.curve.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        let count = self.panels.len();
        (0..=count).map(|k| k as f64 / count as f64).collect()
    }

    fn at(&self, s: f64) -> Moment {
        let count = self.panels.len();
        let along = s.clamp(0.0, 1.0) * count as f64;
        let k = (along as usize).min(count - 1);
        let panel = &self.panels[k];
        let u = along - k as f64;
        let (x, z) = panel.place(u);
        let theta = panel.theta(u);
        let v = self.curve.floor + self.curve.w_f * exp(self.curve.exponent.value(x, z));
        Moment { t: self.curve.t_f * x, v, theta, friction: friction_at(&self.law, v, theta), v_c: None, beta: None }
    }
}
