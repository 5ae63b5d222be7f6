//! Response of a block on a spring to a velocity step: `v_c` jumps from `v_i` to `v_f` and stays there.
//!
//! In the scaled variables of `scaled_block.rs` the response depends on `a`, `b`, `k`, `m v_f^2` and `v_i/v_f` only. It is
//! integrated (`integration.rs`, `orbit.rs`) until its long-term behaviour is decided (`long_term.rs`). Envelope following
//! skips cycles that hardly change (`envelope.rs`). Finer steps repeat all until the numbers agree (`simulation.rs`).

mod envelope;
mod integration;
mod long_term;
mod motion;
mod orbit;
pub(super) mod scaled_block;
mod series;
mod simulation;

use crate::model::{Law, StateLaw, Transition};
use crate::numerics::elementary::{exp, ln};
use crate::protocol::Status;
use crate::stability::SteadySliding;
use long_term::LinearStability;
use simulation::follow;

pub use integration::{Integration, IntegrationStep, step_to};
pub use motion::StepResponseMotion;
pub use orbit::{Cycle, Extremum, Orbit, RoughExtremum, SETTLED, StopReason};
pub use scaled_block::{ScaledBlock, State, Z};
pub use simulation::{LongTermBehaviour, Simulation, UnresolvedNumbers};

/// A step of the control velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityStep {
    /// Evolution law of the state.
    pub state_law: StateLaw,
    /// The friction law and both velocities.
    pub transition: Transition,
    /// Stiffness of the spring, `k > 0`; infinite for a rigid spring.
    pub k: f64,
    /// Mass of the block, `m >= 0`.
    pub m: f64,
}

/// Long-term behaviour of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Steady sliding at `v_f`.
    Settled,
    /// A limit cycle: stick-slip, or a small sustained oscillation.
    LimitCycle,
    /// Undecided within the step limit.
    Undecided,
    /// The velocity becomes infinite in finite time. Such a step has no [`Response`].
    Diverged,
}

impl Outcome {
    /// Names in tables, in the order of the variants.
    pub const NAMES: [&'static str; 4] = ["settled", "limit_cycle", "undecided", "diverged"];
}

/// Numbers of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Long-term behaviour.
    pub outcome: Outcome,
    /// Greatest velocity after `v = v_f` is first reached, at least `v_f`, in `v_0`; NaN if undecided.
    pub v_peak: f64,
    /// Least velocity after `v = v_f` is first reached, at most `v_f`, in `v_0`; 0 below the range of doubles, NaN if
    /// undecided or unresolved.
    pub v_trough: f64,
    /// Time of the greatest velocity, in `l/v_0`; `None` if it is only approached, undecided or unresolved.
    pub t_peak: Option<f64>,
    /// Time after which `|v/v_f - 1|` stays below [`SETTLED`], in `l/v_0`; `None` if not settled or unresolved.
    pub settling_time: Option<f64>,
    /// The limit cycle, if the response reaches one.
    pub cycle: Option<LimitCycle>,
    /// Simulated time, in `l/v_0`.
    pub t_end: f64,
    /// Number of steps of the integrator.
    pub steps: u32,
}

/// A limit cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitCycle {
    /// Period, in `l/v_0`.
    pub period: f64,
    /// Greatest velocity, in `v_0`.
    pub v_peak: f64,
    /// Least velocity, in `v_0`; NaN if unresolved.
    pub v_trough: f64,
}

impl VelocityStep {
    /// Scaled mass `m v_f^2`.
    pub fn inertia(&self) -> f64 {
        self.m * self.transition.v_f * self.transition.v_f
    }

    /// The step in scaled variables; `None` where the response takes no time: for a rigid spring, and for `v_i = v_f`.
    pub fn scaled(&self) -> Option<ScaledStep> {
        let Transition { law, v_i, v_f } = self.transition;
        let slider = ScaledBlock { state_law: self.state_law, a: law.a, b: law.b, inertia: self.inertia(), k: self.k };
        (self.k.is_finite() && v_i != v_f).then_some(ScaledStep { slider, ratio: v_i / v_f })
    }

    /// Status and response, with numbers to the relative tolerance `rtol`.
    pub fn respond(&self, rtol: f64) -> (Status, Option<Response>) {
        let simulation = self.scaled().map(|scaled| scaled.follow(rtol));
        self.from_simulation(simulation.as_ref(), rtol)
    }

    /// Status and response from the simulation of [`VelocityStep::scaled`], which other steps may share.
    ///
    /// `BelowBound` where the velocity falls below 1, `Infeasible` where it becomes infinite in finite time. This takes a mass
    /// of 0, and below the critical stiffness every step suffices. With the slip law and that of Perrin, Rice and Zheng large
    /// steps diverge above it too.
    pub fn from_simulation(&self, simulation: Option<&Simulation>, rtol: f64) -> (Status, Option<Response>) {
        let Transition { v_i, v_f, .. } = self.transition;
        let lowest = simulation.and_then(|simulation| simulation.low).map_or(v_f, |low| v_f * exp(low.x)).min(v_i);
        let at_once = Simulation::known(LongTermBehaviour::Settled { time: 0.0 });
        let response = Response::new(simulation.unwrap_or(&at_once), v_f, rtol);
        let status = match response {
            None => Status::Infeasible,
            Some(response) if response.v_trough.min(lowest) < 1.0 => Status::BelowBound,
            Some(_) => Status::Ok,
        };
        (status, response)
    }
}

/// Parameters of the response in scaled variables; steps with equal parameters have the same simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaledStep {
    /// The block on its spring.
    pub slider: ScaledBlock,
    /// Ratio `v_i/v_f`.
    pub ratio: f64,
}

impl ScaledStep {
    /// Simulates the response until its long-term behaviour is decided.
    pub fn follow(&self, rtol: f64) -> Simulation {
        follow(&self.slider, ln(self.ratio), rtol)
    }

    /// Parameters as bits: the key of the memo.
    pub fn key(&self) -> [u64; 6] {
        let ScaledBlock { state_law, a, b, inertia, k } = self.slider;
        let [a, b, inertia, k, ratio] = [a, b, inertia, k, self.ratio].map(f64::to_bits);
        [state_law as u64, a, b, inertia, k, ratio]
    }
}

impl Response {
    /// Response in the units of the model; `None` where the velocity becomes infinite.
    fn new(simulation: &Simulation, v_f: f64, rtol: f64) -> Option<Response> {
        let velocity = |x: f64| v_f * exp(x);
        let (outcome, settling_time, cycle) = match simulation.long_term {
            LongTermBehaviour::Settled { time } => (
                Outcome::Settled,
                Some(time / v_f).filter(|time| !simulation.unresolved.settling_time && time.is_finite()),
                None,
            ),
            LongTermBehaviour::Cycle { period, high, low } => (Outcome::LimitCycle, None, Some((period, high, low))),
            LongTermBehaviour::Undecided => (Outcome::Undecided, None, None),
            LongTermBehaviour::BlowUp => return None,
        };
        let [low, high] = simulation.range();
        // An undecided response, and one that settles after the simulation, may leave this range later.
        let decided = outcome != Outcome::Undecided && !simulation.unresolved.peak;
        let known = |velocity: f64, known: bool| if known { velocity } else { f64::NAN };
        let unresolved = simulation.unresolved;
        let peak = simulation.peak(rtol).filter(|peak| decided && !unresolved.t_peak && !peak.t.is_nan());
        Some(Response {
            outcome,
            v_peak: known(velocity(high), decided),
            v_trough: known(velocity(low), decided && !unresolved.trough),
            t_peak: peak.map(|peak| peak.t / v_f),
            settling_time,
            cycle: cycle.map(|(period, high, low)| LimitCycle {
                period: period / v_f,
                v_peak: velocity(high),
                v_trough: known(velocity(low), !unresolved.cycle_trough),
            }),
            t_end: simulation.t / v_f,
            steps: simulation.steps,
        })
    }
}

impl LinearStability {
    /// Linear stability of steady sliding at `v_f`.
    fn of(slider: &ScaledBlock) -> LinearStability {
        let law = Law { a: slider.a, b: slider.b };
        let sliding = SteadySliding::new(law, slider.k, slider.inertia, 1.0);
        let mut linear = LinearStability { stable: sliding.is_stable(), growth: None };
        if let Some(eigenvalues) = sliding.eigenvalues().filter(|eigenvalues| eigenvalues.frequency > 0.0) {
            let period = 2.0 * std::f64::consts::PI / eigenvalues.frequency;
            linear.growth = Some(eigenvalues.growth_rate * period);
        }
        linear
    }
}
