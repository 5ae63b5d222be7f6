//! `bounded_velocity`: `v > 1` by construction.

use super::{Case, Family, Obstacle, Swift};
use crate::protocol::{Effort, Motion};

/// The family.
pub struct BoundedVelocity;

impl Family for BoundedVelocity {
    fn name(&self) -> &'static str {
        "bounded_velocity"
    }

    fn doc(&self) -> &'static str {
        "v > 1 by construction, v continuous at both ends"
    }

    fn alpha(&self) -> Option<&'static str> {
        Some("alpha_3 in v = 1 + (v_i - 1) exp[ln((v_f - 1)/(v_i - 1)) t/t_f - alpha_3 (t_f - t) t]")
    }

    fn solve(&self, _case: &Case, _rtol: f64, _effort: &mut Effort) -> Result<Swift, Obstacle> {
        Err(Obstacle::NotConverged)
    }

    fn motion(&self, _case: &Case, _rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
        Err(Obstacle::NotConverged)
    }
}
