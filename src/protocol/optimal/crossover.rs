//! The times at which the optimal strategy changes: closed forms, one quadrature each.

use crate::model::Transition;
use crate::protocol::{Effort, Status};

/// The special times of one transition, each with the work `W*` there; `None` where the time does not exist.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CrossoverTimes {
    /// Acceleration: `v(0+) = v_i`.
    pub t_cross: Option<f64>,
    /// Acceleration: `v(0+)` reaches the bound 1.
    pub t_hold: Option<f64>,
    /// Acceleration: least `W*` over `t_f`.
    pub t_cheapest: Option<f64>,
    /// Deceleration: shortest possible time under `v >= 1`.
    pub t_min: Option<f64>,
    /// Deceleration: `v(t_f-) = v_f`, the inflection of `W*`.
    pub t_turn: Option<f64>,
    /// Deceleration: start of the window without hold.
    pub t_free_in: Option<f64>,
    /// Deceleration: end of the window without hold.
    pub t_free_out: Option<f64>,
    /// `W*` at `t_cross`.
    pub work_cross: Option<f64>,
    /// `W*` at `t_hold`.
    pub work_hold: Option<f64>,
    /// `W*` at `t_cheapest`.
    pub work_cheapest: Option<f64>,
    /// `W*` at `t_min`.
    pub work_min: Option<f64>,
    /// `W*` at `t_turn`.
    pub work_turn: Option<f64>,
}

/// Which of the columns are asked for; the others are not computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// `t_cross` or `work_cross`.
    pub cross: bool,
    /// `t_hold` or `work_hold`.
    pub hold: bool,
    /// `t_cheapest` or `work_cheapest`.
    pub cheapest: bool,
    /// `t_min`, `work_min`.
    pub min: bool,
    /// `t_turn`, `work_turn`.
    pub turn: bool,
    /// `t_free_in`, `t_free_out`.
    pub free: bool,
}

/// All special times of a transition; `bounded` says whether `v >= 1` is imposed (if not, hold and min do not exist).
pub fn solve(
    _transition: &Transition,
    _bounded: bool,
    _rtol: f64,
    _wanted: Wanted,
) -> (Status, CrossoverTimes, Effort) {
    unimplemented!("in work")
}
