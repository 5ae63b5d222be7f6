//! A protocol given by a formula in time, integrated in the direction in which it contracts.

use super::gap::golden;
use super::route::integrate;
use crate::model::Transition;

/// Number of pieces in which a protocol is integrated, and in which extremes are searched.
const PIECES: usize = 256;

/// The formula of a protocol over `x = t/t_f`.
pub enum Formula {
    /// The velocity.
    Velocity(Box<dyn Fn(f64) -> f64>),
    /// The friction.
    Friction(Box<dyn Fn(f64) -> f64>),
}

/// State of a protocol: `ln theta`, work, fraction of the time.
pub type State = [f64; 3];

/// A protocol between two steady states.
pub struct FormulaPath {
    pub problem: Transition,
    pub t_f: f64,
    pub formula: Formula,
    /// Whether it is integrated from its end.
    pub backward: bool,
}

impl FormulaPath {
    pub fn velocity(&self, y: &State) -> f64 {
        let law = self.problem.law;
        match &self.formula {
            Formula::Velocity(velocity) => velocity(y[2]),
            Formula::Friction(friction) => ((friction(y[2]) - 1.0 - law.b * y[0]) / law.a).exp(),
        }
    }

    pub fn friction(&self, y: &State) -> f64 {
        let law = self.problem.law;
        match &self.formula {
            Formula::Velocity(velocity) => 1.0 + law.a * velocity(y[2]).ln() + law.b * y[0],
            Formula::Friction(friction) => friction(y[2]),
        }
    }

    fn advance(&self, y: State, length: f64) -> Option<State> {
        let sign = if self.backward { -1.0 } else { 1.0 };
        let slope = |y: &State| {
            let v = self.velocity(y);
            [sign * self.t_f * ((-y[0]).exp() - v), self.t_f * self.friction(y) * v, sign]
        };
        integrate(slope, y, (0.0, length))
    }

    /// The states between the pieces, in the direction of integration; `None` if the integrator fails.
    pub fn states(&self) -> Option<Vec<State>> {
        let (v, x) = if self.backward { (self.problem.v_f, 1.0) } else { (self.problem.v_i, 0.0) };
        let mut states = vec![[-v.ln(), 0.0, x]];
        for _ in 0..PIECES {
            states.push(self.advance(*states.last()?, 1.0 / PIECES as f64)?);
        }
        Some(states)
    }

    /// `ln theta` where the protocol should arrive, in the direction of integration.
    pub fn target(&self) -> f64 {
        -(if self.backward { self.problem.v_i } else { self.problem.v_f }).ln()
    }

    /// The least value of `f` along the way.
    pub fn least(&self, states: &[State], f: impl Fn(&State) -> f64) -> f64 {
        let values = states.iter().enumerate().map(|(i, y)| (i, f(y)));
        let (place, least) = values.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN));
        let at = |s: f64| {
            let piece = (s as usize).min(PIECES - 1);
            let state = self.advance(states[piece], (s - piece as f64) / PIECES as f64);
            state.map_or(f64::INFINITY, |y| f(&y))
        };
        let (low, high) = (place.saturating_sub(1), (place + 1).min(PIECES));
        golden(&at, low as f64, high as f64).min(least)
    }
}

/// The parameter that brings theta to the target, by a secant from `alpha`, at which theta ends at `end`, and a parameter close to it;
/// `formula_path(alpha)` makes a protocol.
pub fn arriving(alpha: f64, end: f64, target: f64, formula_path: impl Fn(f64) -> FormulaPath) -> f64 {
    const ALPHA_STEP: f64 = 1e-6;
    // Error of the integrator: the end of a long protocol does not depend on its parameter.
    const INTEGRATOR_RTOL: f64 = 3e-11;
    if (end - target).abs() <= INTEGRATOR_RTOL {
        return alpha;
    }
    let moved = formula_path(alpha * (1.0 + ALPHA_STEP)).states().and_then(|states| Some(states.last()?[0] - end));
    let fraction = moved.map_or(f64::INFINITY, |moved| ALPHA_STEP * (end - target) / moved);
    alpha * (1.0 - fraction)
}
