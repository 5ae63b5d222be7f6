//! Derivatives of the least work. By the envelope theorem those by the material and the ceiling are partial derivatives at fixed states of the turns;
//! that by a state at an end is the costate there.

use super::bound_arc::{self, BoundArc, Kind};
use super::state::State;
use super::{Path, Problem};
use crate::model::StateLaw;
use crate::numerics::elementary::ln_1p;
use crate::numerics::gauss::{SHORT_NODES, rule};
use crate::protocol::optimal::Slopes;

/// Derivatives of the least work of `path`, whose Hamiltonian is `hamiltonian`. Infinite or NaN where they do not exist.
pub(super) fn of_path(path: &Path, problem: &Problem, hamiltonian: f64) -> Slopes {
    let (arcs, time) = match path {
        Path::OnBounds { arcs, chatter } => (arcs, *chatter),
        Path::Rise(rise) => return rise.slopes(problem),
    };
    let [_, a, b] = bound_arc::terms(arcs, problem);
    // The state at the turn, and what holding it costs for the time of chattering.
    let price = problem.price_slopes(&arcs[0].ends[1]);
    let [start, end] =
        [(&arcs[0], &arcs[1], &problem.from), (&arcs[1], &arcs[0], &problem.to)].map(|(arc, other, state)| {
            let kind = if arc.length > 0.0 || other.length == 0.0 { arc.kind } else { other.kind };
            problem.by_velocity(state, kind, &arcs[0].ends[1], arc.span)
        });
    let on_ceiling = by_ceiling(&arcs[0], 1, problem, hamiltonian) + by_ceiling(&arcs[1], 0, problem, hamiltonian);
    Slopes {
        a: a + time * price[0],
        b: b + time * price[1],
        v_i: -start,
        v_f: end,
        v_ceiling: on_ceiling + if time > 0.0 { time * price[2] } else { 0.0 },
        tau_ceiling: 0.0,
    }
}

/// The derivative of the work of an arc less `H` times its duration with respect to the ceiling, between fixed states.
///
/// The path turns at the end `turn` of the arc.
fn by_ceiling(arc: &BoundArc, turn: usize, problem: &Problem, hamiltonian: f64) -> f64 {
    if arc.kind == Kind::Wait || arc.length == 0.0 {
        return 0.0;
    }
    let least = arc.ends[0].theta.min(arc.ends[1].theta);
    if arc.length <= SHORT && arc.span <= SHORT * least {
        return problem.over_short_arc(arc, hamiltonian);
    }
    let Problem { a, b, ceiling, .. } = *problem;
    let [start, end] = [0, 1].map(|place| problem.of_end(&arc.ends[place], hamiltonian, place == turn));
    (a - b + hamiltonian / ceiling) * arc.length / ceiling + start - end
}

/// Slip, and change of theta relative to its lesser end, up to which an arc is short, and its derivative a quadrature, since the terms of the closed
/// form cancel. Derived: the distance of theta from the steady state of the ceiling changes by a factor of e at most, and the error of [`SHORT_NODES`]
/// is `4.1^-32`, or `5.8^-32` from the singularity at 0.
const SHORT: f64 = 1.0;

impl Problem {
    /// [`by_ceiling`] of a short arc: the integral over time of `tau + a + costate dtheta'/dv`.
    fn over_short_arc(&self, arc: &BoundArc, hamiltonian: f64) -> f64 {
        let Problem { law, a, b, ceiling, ln_ceiling, .. } = *self;
        let (rule, from, steady) = (rule(SHORT_NODES), &arc.ends[0], hamiltonian / ceiling);
        let span = if from.excess > 0.0 { -arc.span } else { arc.span };
        let terms = rule.x.iter().zip(&rule.w).map(|(x, weight)| {
            let change = 0.5 * span * (1.0 + x);
            let (grown, excess) = (ln_1p(change / from.theta), from.excess + ceiling * change);
            let above_ceiling = from.above_ceiling + grown;
            let tau = 1.0 + (a * ln_ceiling - b * (from.below_floor - grown));
            let (by_speed, rate) = match law {
                StateLaw::Slip => (a + steady - (tau - steady) / above_ceiling, -(1.0 + excess) * above_ceiling),
                _ => {
                    let twice_rate = -excess * (excess + 2.0);
                    (a - tau + 2.0 * (steady + (tau - steady) / twice_rate), 0.5 * twice_rate)
                }
            };
            0.5 * weight * by_speed / rate
        });
        span * terms.sum::<f64>()
    }

    /// The derivative, with respect to the ceiling, of the slip on it from `state` to another one, but for the part of that one.
    pub(super) fn rest_slope(&self, state: &State) -> f64 {
        match self.law {
            StateLaw::Slip => 1.0 / (self.ceiling * state.above_ceiling),
            _ => 2.0 * state.theta / (state.excess * (state.excess + 2.0)),
        }
    }

    /// The part of the end `state` in the derivative of the work of an arc less `H` times its duration with respect to the ceiling.
    fn of_end(&self, state: &State, hamiltonian: f64, is_turn: bool) -> f64 {
        let Problem { law, a, b, ceiling, ln_ceiling, .. } = *self;
        let steady = 1.0 + (a - b) * ln_ceiling;
        // At a turn the Hamiltonian is the price, which does not let the difference cancel at the steady state of the ceiling.
        match (law, is_turn) {
            (StateLaw::Slip, true) => {
                let under = ceiling * state.above_ceiling + state.below_floor;
                (steady * (ceiling - 1.0) - (b - a) * ln_ceiling) / (ceiling * under)
            }
            (StateLaw::Slip, false) => self.rest_slope(state) * (steady - hamiltonian / ceiling),
            (_, true) => {
                let direct = a * ceiling * ln_ceiling / (ceiling - 1.0);
                2.0 * (1.0 - b * state.below_floor + direct) / ((1.0 + state.excess) * (ceiling + 1.0))
            }
            (_, false) => self.rest_slope(state) * (steady + b * state.above_ceiling - hamiltonian / ceiling),
        }
    }

    /// The costate `(H - tau v)/theta'` at `state`, the distance `span` of theta from the `turn`, by the velocity of its steady sliding: over `v^2`.
    ///
    /// `H` is the mean of `tau v` on both bounds that holds theta at the turn, so that `H - tau v` there is a fraction of their difference.
    fn by_velocity(&self, state: &State, kind: Kind, turn: &State, span: f64) -> f64 {
        let Problem { a, b, ceiling, ln_ceiling, .. } = *self;
        let [at_floor, on_ceiling] = self.duties(turn);
        let dearer = (1.0 - b * turn.below_floor) * (ceiling - 1.0) + a * ceiling * ln_ceiling;
        let (saved, speed) = match kind {
            Kind::Wait => (on_ceiling * dearer, 1.0),
            Kind::Jerk => (-at_floor * dearer, ceiling),
        };
        let growth = ln_1p(span / turn.theta.min(state.theta)).copysign(turn.theta - state.theta);
        let rate = match (self.law, kind) {
            (StateLaw::Slip, Kind::Wait) => state.theta * state.below_floor,
            (StateLaw::Slip, Kind::Jerk) => -(1.0 + state.excess) * state.above_ceiling,
            (_, Kind::Wait) => 0.5 * (state.v - 1.0) * (state.v + 1.0) * state.theta * state.theta,
            (_, Kind::Jerk) => -0.5 * state.excess * (state.excess + 2.0),
        };
        (saved + b * speed * growth) / rate * state.theta * state.theta
    }
}
