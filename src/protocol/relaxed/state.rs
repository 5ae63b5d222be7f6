//! A state variable on the way, by quantities that do not cancel near either steady state.

use crate::model::StateLaw;
use crate::numerics::elementary::{exp_and_m1, exp_m1, ln, ln_1p};

/// The state `theta = 1/v`, the steady state of velocity `v`, under the ceiling `V`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Its steady velocity `v`.
    pub v: f64,
    /// `theta`.
    pub theta: f64,
    /// `ln v = -ln theta`.
    pub below_floor: f64,
    /// `ln(V theta)`: distance from the steady state of the ceiling.
    pub above_ceiling: f64,
    /// `V theta - 1`.
    pub excess: f64,
}

impl State {
    /// The steady state of `v`, between 1 and the ceiling.
    pub fn steady(v: f64, ceiling: f64) -> State {
        let excess = (ceiling - v) / v;
        State { v, theta: 1.0 / v, below_floor: ln(v), above_ceiling: ln_1p(excess), excess }
    }
}

/// A loop from a state and back to it, at `v = 1` and on the ceiling, by the length of its first arc: time at `v = 1`, slip on the ceiling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loop {
    /// Where it turns.
    pub turn: State,
    /// Distance in theta of the turn.
    pub span: f64,
    /// Length of the arc back.
    pub back: f64,
    /// Derivative of that length.
    pub slope: f64,
}

/// The loop from `at` that rises for the time `t` and returns on the ceiling.
pub fn up(law: StateLaw, at: &State, ceiling: f64, t: f64) -> Loop {
    if law == StateLaw::Slip {
        // w = ln theta falls to 0 like e^-t; ln(V theta) to 0 with the slip on the ceiling.
        let (left, lost) = exp_and_m1(-t);
        let rise = -at.below_floor * lost;
        let grown = exp_m1(rise);
        let span = at.theta * grown;
        let (below_floor, above_ceiling) = (at.below_floor * left, at.above_ceiling + rise);
        let theta = at.theta + span;
        let turn = State { v: 1.0 / theta, theta, below_floor, above_ceiling, excess: at.excess + ceiling * span };
        return Loop { turn, span, back: ln_1p(rise / at.above_ceiling), slope: below_floor / above_ceiling };
    }
    // artanh theta rises like t/2; arcoth(V theta) with half the slip on the ceiling.
    let (tanh, left) = half_tanh(t);
    let under = 1.0 + at.theta * tanh;
    let span = tanh * (at.v - 1.0) * (at.v + 1.0) * at.theta * at.theta / under;
    let theta = at.theta + span;
    let excess = at.excess + ceiling * span;
    // 1 - theta.
    let distance = (at.v - 1.0) * at.theta * left / under;
    let below_floor = if distance < 0.5 { -ln_1p(-distance) } else { -ln(theta) };
    let turn = State { v: 1.0 / theta, theta, below_floor, above_ceiling: ln_1p(excess), excess };
    let back = ln_1p(2.0 * ceiling * span / (at.excess * (excess + 2.0)));
    Loop { turn, span, back, slope: ceiling * distance * (1.0 + theta) / (excess * (excess + 2.0)) }
}

/// The loop from `at` that falls on the ceiling over `slip` and returns at `v = 1`.
pub fn down(law: StateLaw, at: &State, ceiling: f64, slip: f64) -> Loop {
    if law == StateLaw::Slip {
        let (left, lost) = exp_and_m1(-slip);
        let fall = -at.above_ceiling * lost;
        let (below_floor, above_ceiling) = (at.below_floor + fall, at.above_ceiling * left);
        let span = -at.theta * exp_m1(-fall);
        let excess = exp_m1(above_ceiling);
        let v = ceiling / (1.0 + excess);
        let turn = State { v, theta: 1.0 / v, below_floor, above_ceiling, excess };
        return Loop { turn, span, back: ln_1p(fall / at.below_floor), slope: above_ceiling / below_floor };
    }
    // v/V obeys the equation of theta at v = 1, with the slip for the time.
    let (tanh, left) = half_tanh(slip);
    let x = at.v / ceiling;
    let under = 1.0 + x * tanh;
    let rise = (ceiling - at.v) * (1.0 + x) * tanh / under;
    let v = at.v + rise;
    // 1 - v/V.
    let distance = (ceiling - at.v) / ceiling * left / under;
    let excess = distance * ceiling / v;
    let turn = State { v, theta: 1.0 / v, below_floor: ln(v), above_ceiling: ln_1p(excess), excess };
    let back = ln_1p(2.0 * rise / ((v + 1.0) * (at.v - 1.0)));
    let slope = ceiling * distance * (1.0 + v / ceiling) / ((v - 1.0) * (v + 1.0));
    Loop { turn, span: rise / v / at.v, back, slope }
}

/// Time at `v = 1` from the steady state of `from` up to that of `to <= from`; `ratio` is `ln(from/to)`.
pub fn wait(law: StateLaw, from: &State, to: &State, ratio: f64) -> f64 {
    match law {
        StateLaw::Slip => ln_1p(ratio / to.below_floor),
        _ => ln_1p(2.0 * (from.v - to.v) / ((from.v + 1.0) * (to.v - 1.0))),
    }
}

/// Slip on the ceiling from the steady state of `from` down to that of `to >= from`; `ratio` is `ln(to/from)`.
pub fn jerk(law: StateLaw, from: &State, to: &State, ratio: f64, ceiling: f64) -> f64 {
    if from.v == to.v {
        return 0.0;
    }
    match law {
        StateLaw::Slip => ln_1p(ratio / to.above_ceiling),
        // The difference of both states is that of their velocities.
        _ => ln_1p(2.0 * ceiling * (to.v - from.v) / ((ceiling - to.v) * (ceiling + from.v))),
    }
}

/// `tanh(x/2)` of `x >= 0`, and `1 - tanh(x/2)`.
fn half_tanh(x: f64) -> (f64, f64) {
    let (left, lost) = exp_and_m1(-x);
    (-lost / (1.0 + left), 2.0 * left / (1.0 + left))
}
