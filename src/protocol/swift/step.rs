//! `step`: the velocity jumps to `v_f` and stays there.

use super::{Case, Family, Obstacle, Swift};
use crate::protocol::{Effort, Motion};

/// The family.
pub struct Step;

impl Family for Step {
    fn name(&self) -> &'static str {
        "step"
    }

    fn doc(&self) -> &'static str {
        "the velocity jumps to v_f at once and stays there; theta only approaches its target"
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
