//! `bounded_friction`: `tau < tau_M` by construction.

use super::{Case, Family, Obstacle, Swift};
use crate::protocol::{Effort, Motion};

/// The family.
pub struct BoundedFriction;

impl Family for BoundedFriction {
    fn name(&self) -> &'static str {
        "bounded_friction"
    }

    fn doc(&self) -> &'static str {
        "tau < tau_max by construction, v continuous at both ends"
    }

    fn alpha(&self) -> Option<&'static str> {
        Some("alpha_3 in tau = tau_max - (tau_max - tau_i) R^x exp[alpha_3 x (1 - x)], x = t/t_f")
    }

    fn heeds_tau_max(&self) -> bool {
        true
    }

    fn solve(&self, _case: &Case, _rtol: f64, _effort: &mut Effort) -> Result<Swift, Obstacle> {
        Err(Obstacle::NotConverged)
    }

    fn motion(&self, _case: &Case, _rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
        Err(Obstacle::NotConverged)
    }
}
