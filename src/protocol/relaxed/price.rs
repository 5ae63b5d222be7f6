//! The price of holding theta: what the mixture of `v = 1` and `v = V` that keeps theta costs per unit of time.
//!
//! At a fixed theta both velocities lie on one line `tau v = A + B theta'`, and no other velocity lies below it. `int B dtheta` depends on the
//! ends alone, so that a protocol is the better the lower `A` is along its path (docs/derivations.md).

use super::Problem;
use super::state::State;
use crate::model::StateLaw;
use crate::numerics::elementary::exp_m1;
use crate::numerics::turning::turning;

/// Where the price is least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cheapest {
    /// At `theta = 1`.
    Floor,
    /// At the steady state of the ceiling, `theta = 1/V`.
    Ceiling,
    /// Between.
    At(State),
}

impl Problem {
    /// The price `A` of holding theta at `state`.
    pub(super) fn price(&self, state: &State) -> f64 {
        let Problem { a, b, ceiling, ln_ceiling, .. } = *self;
        if self.law == StateLaw::Slip {
            // (V - 1) ln theta + V ln V, as a sum of positive terms.
            let under = ceiling * state.above_ceiling + state.below_floor;
            return ceiling * ln_ceiling * (1.0 - (b - a) * state.below_floor) / under;
        }
        let beyond = (state.v - 1.0) * (state.v + 1.0);
        let slow = (1.0 - b * state.below_floor) * (ceiling + state.v * state.v) / (ceiling + 1.0);
        slow + a * ceiling * ln_ceiling * beyond / ((ceiling - 1.0) * (ceiling + 1.0))
    }

    /// The derivatives of the price that holds theta while it chatters, with respect to `a`, `b` and the ceiling.
    pub(super) fn price_slopes(&self, state: &State) -> [f64; 3] {
        let Problem { a, b, ceiling, ln_ceiling, .. } = *self;
        let beyond = (state.v - 1.0) * (state.v + 1.0);
        let widest = (ceiling - 1.0) * (ceiling + 1.0);
        let direct = beyond * ceiling * ln_ceiling / widest;
        let slow = (ceiling + state.v * state.v) / (ceiling + 1.0);
        let by_ceiling = -(1.0 - b * state.below_floor) * beyond / ((ceiling + 1.0) * (ceiling + 1.0))
            + a * beyond * (1.0 + ln_ceiling - 2.0 * ceiling * ceiling * ln_ceiling / widest) / widest;
        [direct, -state.below_floor * slow, by_ceiling]
    }

    /// Fractions of the time at `v = 1` and on the ceiling that hold theta at `state`.
    pub(super) fn duties(&self, state: &State) -> [f64; 2] {
        let ceiling = self.ceiling;
        if self.law == StateLaw::Slip {
            let under = ceiling * state.above_ceiling + state.below_floor;
            return [ceiling * state.above_ceiling, state.below_floor].map(|part| part / under);
        }
        // The velocity rounds where theta is almost 1.
        let beyond = exp_m1(state.below_floor) * (state.v + 1.0);
        let below = state.v * state.v * state.excess * (state.excess + 2.0);
        [below, beyond].map(|part| part / ((ceiling - 1.0) * (ceiling + 1.0)))
    }

    /// `R`, for which the price of the law of Perrin, Rice and Zheng is stationary where `s - ln s = R` with `theta^2 = s/V`.
    fn stationary(&self) -> f64 {
        let Problem { a, b, ceiling, ln_ceiling, .. } = *self;
        2.0 / b * (1.0 + a * ceiling * ln_ceiling / (ceiling - 1.0)) - 1.0 - ln_ceiling
    }

    /// Where the price is least.
    pub(super) fn cheapest(&self) -> Cheapest {
        let Problem { a, b, ceiling, ln_ceiling, .. } = *self;
        if self.law == StateLaw::Slip {
            // The price is monotone.
            let falls = (b - a) * ceiling * ln_ceiling < ceiling - 1.0;
            return if falls { Cheapest::Floor } else { Cheapest::Ceiling };
        }
        let level = self.stationary();
        if b == 0.0 || level == f64::INFINITY {
            return Cheapest::Floor;
        }
        if level < 1.0 {
            return Cheapest::Ceiling;
        }
        let s = 1.0 + turning((2.0 * (level - 1.0)).sqrt()).excess;
        if s >= ceiling {
            return Cheapest::Floor;
        }
        Cheapest::At(State::steady((ceiling / s).sqrt(), ceiling))
    }

    /// Whether the price has no other minimum, and the line at each theta no velocity below it, down to the state `lowest`.
    pub(super) fn is_proven_down_to(&self, lowest: &State) -> bool {
        if self.law == StateLaw::Slip {
            return 1.0 - (self.b - self.a) * lowest.below_floor > 0.0;
        }
        let level = self.stationary();
        // The price falls again below theta^2 = s/V with the lesser root s.
        let is_single = level < 1.0
            || level == f64::INFINITY
            || 2.0 * lowest.below_floor <= self.ln_ceiling - turning(-(2.0 * (level - 1.0)).sqrt()).ln_u;
        1.0 - self.b * lowest.below_floor > 0.0 && is_single
    }
}
