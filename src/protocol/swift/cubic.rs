//! `cubic`: theta is the cubic in time along which v is continuous at both ends.

use super::{Case, Family, Obstacle, Swift};
use crate::protocol::{Effort, Motion};

/// The family.
pub struct Cubic;

impl Family for Cubic {
    fn name(&self) -> &'static str {
        "cubic"
    }

    fn doc(&self) -> &'static str {
        "theta a cubic in time, v continuous at both ends"
    }

    fn alpha(&self) -> Option<&'static str> {
        None
    }

    fn solve(&self, _case: &Case, _rtol: f64, _effort: &mut Effort) -> Result<Swift, Obstacle> {
        Err(Obstacle::NotConverged)
    }

    fn motion(&self, _case: &Case, _rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
        Err(Obstacle::NotConverged)
    }
}
