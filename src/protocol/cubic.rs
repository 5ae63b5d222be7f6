//! The cubic shortcuts: `theta = 1/v_i + alpha_2 t + alpha_3 t^2 + alpha_4 t^3`, `v` free to jump at both ends.

use super::{Effort, Status};
use crate::model::Transition;

/// The work landscape of one transition in one time over the plane of `(alpha_2, alpha_3)`.
#[derive(Debug, Clone)]
pub struct Landscape {
    _transition: Transition,
}

/// The results of a run of shortcuts, one element a shortcut, laid out column by column.
#[derive(Debug)]
pub struct Shortcuts<'a> {
    /// `W_s`; left untouched where infeasible, and everywhere if empty (not asked for).
    pub work: &'a mut [f64],
    /// Least velocity on `[0, t_f]`; left untouched where infeasible.
    pub v_min: &'a mut [f64],
    /// `Ok`, `BelowBound`, `Infeasible` or `NotConverged`.
    pub status: &'a mut [Status],
}

impl Landscape {
    /// Prepares the landscape of `transition` in time `t_f`; every work is good to relative accuracy `rtol`.
    pub fn new(transition: &Transition, _t_f: f64, _rtol: f64) -> Self {
        Landscape { _transition: *transition }
    }

    /// Evaluates the shortcuts `(a_2[i], a_3[i])`, given scaled: `alpha_2 t_f` and `alpha_3 t_f^2`.
    pub fn evaluate(&self, _a_2: &[f64], _a_3: &[f64], _out: Shortcuts<'_>) -> Effort {
        unimplemented!("in work")
    }
}
