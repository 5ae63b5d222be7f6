//! Integration along a response: Taylor series where the equations are not stiff, Radau IIA where they are.
//!
//! A slip is not stiff: its velocity changes at the rate of damping by friction. A series of order 16 is then about as long
//! as an implicit step and costs a fifth of it. In the stick phase friction damps `v` thousands of times faster than the
//! state changes, which takes an implicit method.

use multiversion::multiversion;

use super::long_term::STEP_ERROR;
use super::scaled_block::{Rates, ScaledBlock, State, X, Y};
use super::series::{Powers, TERMS, reach};
use crate::numerics::MAX_STEPS;
use crate::numerics::elementary::{exp, ln};
use crate::numerics::stiff::{Accuracy, DenseOutput, Integrator, radau_iia_9};

/// Stages of an implicit step: order 9.
pub const STAGES: usize = 5;

/// Integration step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegrationStep {
    /// The solution over the step.
    pub path: DenseOutput<3, TERMS>,
    /// Whether it is by Radau IIA, good to order 9 at its end and to order 5 between, or by a Taylor series, good everywhere.
    pub is_implicit: bool,
}

/// Integration along a response.
#[derive(Debug, Clone)]
pub struct Integration<'a> {
    slider: &'a ScaledBlock,
    integrator: Integrator<'a, ScaledBlock, 3, STAGES>,
    accuracy: Accuracy<3>,
    /// Length of a series, in units of the fastest motion, above which steps are implicit.
    implicit_from: f64,
    /// Whether steps are series.
    uses_series: bool,
}

/// Length of a series, in units of the fastest motion, at most. Chosen: about the stability interval of a series of order
/// 16 (Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.2).
const MAX_REACH: f64 = 5.0;

/// Change of `ln theta` in a series, at most. Chosen: beyond it terms of `1/theta` below the rounding of the others grow.
const MAX_CHANGE: f64 = 6.0;

/// Length of a step, in units of the fastest motion, above which steps are implicit. Measured: both kinds cost as much
/// there (`cargo bench --bench step_response`).
const IMPLICIT_FROM: f64 = 15.0;

/// Duration of a slip of a light block on a soft spring, fraction of the rest before it, at least. Chosen: far below those
/// of the physical domain.
const SHORTEST_SLIP: f64 = 1e-120;

impl ScaledBlock {
    /// Integration from `state`, with errors of a step below `tolerance` in `x`, `y` and `z/force`.
    pub fn run(&self, state: State, h: f64, tolerance: f64) -> Integration<'_> {
        let accuracy = Accuracy { tolerance, scale: [self.force(), 1.0, 1.0] };
        // An error of theta in a stick phase becomes an error of the time of the next slip, and accuracy costs least there.
        let implicit = Accuracy { tolerance: STEP_ERROR * tolerance, ..accuracy };
        let mut integrator = Integrator::new(self, radau_iia_9(), implicit, 0.0, state, h);
        if self.inertia > 0.0 || self.k > self.b - self.a {
            integrator.may_step(SHORTEST_SLIP);
        }
        // Near rest a series is this short: rounding errors of the force enter its terms over factorials.
        let order = TERMS as f64;
        let rounding = exp((ln(tolerance / f64::EPSILON) + libm::lgamma(order + 1.0)) / order);
        let implicit_from = IMPLICIT_FROM.min(0.7 * rounding);
        Integration { slider: self, integrator, accuracy, implicit_from, uses_series: true }
    }
}

impl Integration<'_> {
    /// Time reached.
    pub fn t(&self) -> f64 {
        self.integrator.t()
    }

    /// State at the time reached.
    pub fn y(&self) -> &State {
        self.integrator.y()
    }

    /// Continues from another state, with a first step of about `h`.
    pub fn jump(&mut self, state: State, h: f64) {
        self.integrator.jump(state, h);
    }

    #[inline(always)]
    fn step(&mut self, limit: f64) -> Option<IntegrationStep> {
        match self.expand(limit) {
            Some(path) => Some(IntegrationStep { path, is_implicit: false }),
            None => self.integrator.step(limit).map(IntegrationStep::implicit),
        }
    }

    /// Step by a series; `None` where the equations are stiff.
    #[inline(always)]
    fn expand(&mut self, limit: f64) -> Option<DenseOutput<3, TERMS>> {
        let (slider, state) = (self.slider, *self.integrator.y());
        let rates = Rates::of(slider.state_law, state[Y], state[X]);
        let fast = slider.fast(&rates);
        // False for numbers out of range.
        // Below IMPLICIT_FROM, so that the kinds do not alternate.
        let short = fast * self.integrator.proposal() < 2.0 * MAX_REACH;
        if !self.uses_series && !short {
            return None;
        }
        let unit = 1.0 / fast;
        let powers = slider.series(&state, &rates, unit);
        let reach = reach(&powers, &self.accuracy.scale, self.accuracy.tolerance);
        self.uses_series = reach < self.implicit_from;
        if !self.uses_series {
            return None;
        }
        let h = reach.min(MAX_REACH) * unit;
        let mut length = h.min(self.integrator.left(limit));
        let over = |h: f64| DenseOutput::from_powers(self.t(), h, state, stretched(&powers, h / unit));
        let mut step = over(length);
        for _ in 0..MAX_STEPS {
            let change = (step.end[Y] - state[Y]).abs();
            if change <= MAX_CHANGE {
                break;
            }
            length *= 0.9 * MAX_CHANGE / change;
            step = over(length);
        }
        let advances = step.end.iter().all(|end| end.is_finite()) && self.integrator.leap(length, step.end, h);
        self.uses_series = advances;
        advances.then_some(step)
    }
}

/// Coefficients in powers of a time unit that is `factor` times as long.
#[inline(always)]
fn stretched(powers: &Powers, factor: f64) -> Powers {
    let mut scaled = *powers;
    let mut power = 1.0;
    let [z, y, x] = &mut scaled;
    for ((z, y), x) in z.iter_mut().zip(y).zip(x) {
        power *= factor;
        [z, y, x].into_iter().for_each(|coefficient| *coefficient *= power);
    }
    scaled
}

/// Takes one step, which ends at `limit` at the latest; `None` if no step is short enough.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub fn step_to(run: &mut Integration<'_>, limit: f64) -> Option<IntegrationStep> {
    run.step(limit)
}

/// Substep between two fractions of a step, to the accuracy of a step: an implicit step is repeated. `None` if it fails.
pub fn substep(run: &mut Integration<'_>, step: &IntegrationStep, from: f64, to: f64) -> Option<IntegrationStep> {
    if step.is_implicit {
        run.integrator.between(&step.path, from, to).map(IntegrationStep::implicit)
    } else {
        Some(IntegrationStep { path: step.path.between(from, to), is_implicit: false })
    }
}

impl IntegrationStep {
    fn implicit(path: DenseOutput<3, STAGES>) -> IntegrationStep {
        IntegrationStep { path: path.raised(), is_implicit: true }
    }
}
