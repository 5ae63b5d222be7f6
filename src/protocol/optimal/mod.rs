//! The optimal protocol: least work of friction from `(v_i, 1/v_i)` to `(v_f, 1/v_f)` in time `t_f`.

pub mod crossover;

use super::Solved;
use crate::model::Transition;

/// How the optimal protocol starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Strategy {
    /// Jumps up: `v(0+) > v_i`.
    SpeedUp,
    /// Jumps down, but stays off the bound: `1 < v(0+) <= v_i`.
    SlowDown,
    /// Starts on the bound `v = 1`.
    Hold,
}

impl Strategy {
    /// All strategies, in their order.
    pub const ALL: [Strategy; 3] = [Strategy::SpeedUp, Strategy::SlowDown, Strategy::Hold];

    /// The name that is written into tables.
    pub fn name(self) -> &'static str {
        match self {
            Strategy::SpeedUp => "speed_up",
            Strategy::SlowDown => "slow_down",
            Strategy::Hold => "hold",
        }
    }
}

/// The optimal protocol of one transition in one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optimum {
    /// Least work `W*` (scaled: `mu_0 sigma l`).
    pub work: f64,
    /// Velocity just after the start, `v(0+)`.
    pub v_start: f64,
    /// Velocity just before the end, `v(t_f-)`.
    pub v_end: f64,
    /// Time spent on the bound `v = 1`.
    pub hold_time: f64,
    /// `dW*/dt_f = -C`, the Hamiltonian.
    pub hamiltonian: f64,
    /// Largest contact lifetime on the way.
    pub theta_max: f64,
    /// How it starts.
    pub strategy: Strategy,
}

/// Solves one optimal protocol to relative accuracy `rtol`, with `v >= 1` where `bounded`.
pub fn solve(_transition: &Transition, _t_f: f64, _bounded: bool, _rtol: f64) -> Solved<Optimum> {
    unimplemented!("in work")
}
