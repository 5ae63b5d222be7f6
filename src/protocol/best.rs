//! The least-work cubic shortcut, and its gap to the optimum without cancellation.

use super::Solved;
use crate::model::Transition;

/// The best cubic shortcut of one transition in one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Best {
    /// `alpha_2 t_f`.
    pub a_2: f64,
    /// `alpha_3 t_f^2`.
    pub a_3: f64,
    /// Its work `W_s`.
    pub work: f64,
    /// The optimal work `W*`.
    pub work_optimal: f64,
    /// `(W_s - W*)/W*`.
    pub gap: f64,
    /// Its least velocity.
    pub v_min: f64,
}

/// The shortcut of least work over the whole plane where `v >= 1` (`bounded`) or `v > 0`.
pub fn solve(_transition: &Transition, _t_f: f64, _bounded: bool, _rtol: f64) -> Solved<Best> {
    unimplemented!("in work")
}
