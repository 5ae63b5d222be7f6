//! A protocol over time: traces show it, and `verify` integrates it independently.

use crate::model::Friction;

/// State of a protocol at one time, in scaled units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Time since the start, `0 <= t <= t_f`.
    pub t: f64,
    /// Velocity.
    pub v: f64,
    /// State variable.
    pub theta: f64,
    /// Friction.
    pub friction: f64,
    /// Control velocity, where the spring is elastic.
    pub v_c: Option<f64>,
    /// Costate of the state variable, where the protocol is an extremal.
    pub beta: Option<f64>,
}

/// Landmarks of a motion of `count` intervals, which are equally long in `s`.
pub(crate) fn equal_landmarks(count: usize) -> Vec<f64> {
    (0..=count).map(|k| k as f64 / count as f64).collect()
}

/// The interval at `s` of `count` that are equally long in `s`, and the fraction of it.
pub(crate) fn interval_at(s: f64, count: usize) -> (usize, f64) {
    let along = s.clamp(0.0, 1.0) * count as f64;
    let k = (along as usize).min(count - 1);
    (k, along - k as f64)
}

/// A protocol as a curve over a parameter `s` from 0 to 1, along which time never falls.
///
/// The parameter stretches layers that are thin in time. `at(0.0)` is just after the jump at the start, `at(1.0)` just
/// before the jump at the end.
pub trait Motion: Sync {
    /// Duration `t_f`.
    fn duration(&self) -> f64;

    /// Values of `s`, ascending from 0 to 1, between which the curve is smooth on the scale of the interval.
    fn landmarks(&self) -> Vec<f64>;

    /// State at `s`, clamped to `[0, 1]`.
    fn at(&self, s: f64) -> Moment;

    /// Form of friction before and after the motion, and on it.
    fn friction(&self) -> Friction {
        Friction::Log
    }

    /// Whether steady sliding at the initial velocity precedes; false for a motion that starts from some state.
    fn departs(&self) -> bool {
        true
    }

    /// Whether steady sliding at the final velocity follows; false for a motion that is cut off at some time.
    fn arrives(&self) -> bool {
        true
    }
}
