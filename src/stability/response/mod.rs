//! The response of a block on a spring to a step of the control velocity: `v_c` jumps from `v_i` to `v_f` and stays
//! there.
//!
//! In the scaled variables of [`slider`] only `a`, `b`, `k`, `m v_f^2` and `v_i/v_f` enter. The response is
//! integrated until its end is decided ([`fate`]).

mod fate;
mod orbit;
mod slider;

use crate::model::Transition;
use crate::numerics::elementary::{exp, ln};
use crate::protocol::Status;
use crate::stability::SteadySliding;

pub use fate::{Course, Fate, Linear, follow};
pub use orbit::{Cycle, Extremum, Orbit, SETTLED, Seen, Stop};
pub use slider::{Slider, State};

/// A step of the control velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The friction law and both velocities.
    pub transition: Transition,
    /// Stiffness of the spring, `k > 0`; infinite for a rigid one.
    pub k: f64,
    /// Mass of the block, `m >= 0`.
    pub m: f64,
}

/// The end of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Steady sliding at `v_f`.
    Settled,
    /// A limit cycle: stick-slip, or a small sustained oscillation.
    LimitCycle,
    /// None that could be decided with the work allowed.
    Undecided,
}

impl Outcome {
    /// The words that are written into tables, in the order of the outcomes.
    pub const NAMES: [&'static str; 3] = ["settled", "limit_cycle", "undecided"];
}

/// What a response does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Its end.
    pub outcome: Outcome,
    /// Greatest velocity from when `v = v_f` is first met on, at least `v_f`, in `v_0`.
    pub v_peak: f64,
    /// Least velocity from when `v = v_f` is first met on, at most `v_f`, in `v_0`; 0 below the range of doubles.
    pub v_trough: f64,
    /// Time of the greatest velocity, in `l/v_0`; `None` if it is only approached.
    pub t_peak: Option<f64>,
    /// Time after which `|v/v_f - 1|` stays below [`SETTLED`], in `l/v_0`.
    pub settling_time: Option<f64>,
    /// The limit cycle.
    pub cycle: Option<Sustained>,
    /// Time up to which it was followed, in `l/v_0`.
    pub t_end: f64,
    /// Steps of the integrator.
    pub steps: u32,
}

/// A limit cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sustained {
    /// Its duration, in `l/v_0`.
    pub period: f64,
    /// Its greatest velocity, in `v_0`.
    pub v_peak: f64,
    /// Its least velocity, in `v_0`.
    pub v_trough: f64,
}

impl Step {
    /// The response, with numbers good to `rtol`; `BelowBound` where the velocity falls below 1, `Infeasible` where it
    /// becomes infinite in finite time, as it does without mass below the critical stiffness.
    pub fn respond(&self, rtol: f64) -> (Status, Option<Response>) {
        let Transition { law, v_i, v_f } = self.transition;
        let x = ln(v_i / v_f);
        if !self.k.is_finite() || x == 0.0 {
            let response = Response {
                outcome: Outcome::Settled,
                v_peak: v_f,
                v_trough: v_f,
                t_peak: None,
                settling_time: Some(0.0),
                cycle: None,
                t_end: 0.0,
                steps: 0,
            };
            return (Status::Ok, Some(response));
        }
        let slider = Slider { a: law.a, b: law.b, inertia: self.m * v_f * v_f, k: self.k };
        let linear = Linear::of(&SteadySliding::new(law, self.k, self.m, v_f), v_f);
        let course = follow(&slider, linear, x, rtol);
        let Some(response) = Response::new(&course, v_f, rtol) else { return (Status::Infeasible, None) };
        let least = response.v_trough.min(v_i);
        (if least < 1.0 { Status::BelowBound } else { Status::Ok }, Some(response))
    }
}

impl Response {
    /// In the units of the model; `None` for one that ends.
    fn new(course: &Course, v_f: f64, rtol: f64) -> Option<Response> {
        let velocity = |x: f64| v_f * exp(x);
        let (outcome, settling_time, cycle) = match course.fate {
            Fate::Settled { time } => (Outcome::Settled, Some(time / v_f), None),
            Fate::Cycle { period, high, low } => (Outcome::LimitCycle, None, Some((period, high, low))),
            Fate::Undecided => (Outcome::Undecided, None, None),
            Fate::Ends => return None,
        };
        let (peak, trough) =
            (course.high.map_or(0.0, |high| high.x.max(0.0)), course.low.map_or(0.0, |low| low.x.min(0.0)));
        let (last_high, last_low) = cycle.map_or((0.0, 0.0), |(_, high, low)| (high, low));
        // Approached from below, the greatest velocity is that of the limit cycle.
        let attained = course.high.filter(|high| high.x > last_high + rtol);
        Some(Response {
            outcome,
            v_peak: velocity(peak.max(last_high)),
            v_trough: velocity(trough.min(last_low)),
            t_peak: attained.map(|high| high.t / v_f),
            settling_time,
            cycle: cycle.map(|(period, high, low)| Sustained {
                period: period / v_f,
                v_peak: velocity(high),
                v_trough: velocity(low),
            }),
            t_end: course.t / v_f,
            steps: course.steps,
        })
    }
}

impl Linear {
    /// Of steady sliding at `v_f`.
    fn of(sliding: &SteadySliding, v_f: f64) -> Linear {
        let mut linear = Linear { stable: sliding.is_stable(), growth: None, relaxation: f64::INFINITY };
        if let Some(eigenvalues) = sliding.eigenvalues().filter(|eigenvalues| eigenvalues.frequency > 0.0) {
            linear.growth = Some(2.0 * std::f64::consts::PI * eigenvalues.growth_rate / eigenvalues.frequency);
            linear.relaxation = eigenvalues.decay_rate.map_or(f64::INFINITY, |decay| -decay / v_f);
        }
        linear
    }
}
