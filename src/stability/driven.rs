//! Open-loop simulation of the block under the control velocity of a shortcut, continuous or sampled and held.
//!
//! In the variables of a [`ScaledBlock`], with time in `l/v_f`, the load point replaces one equation by `z' = k (v_c/v_f - e^x)`, and the target is 0.
//! With a rigid spring, `v = v_c`.

use super::step_response::scaled_block::{ScaledBlock, State, X, Y, Z};
use crate::model::{Law, StateLaw};
use crate::numerics::elementary::{exp, exp_m1, ln};
use crate::numerics::stiff::{Accuracy, Integrator, Linearised, Points, System, radau_iia_9};
use crate::numerics::{ROUNDING_RTOL, TIGHT_RTOL};
use crate::protocol::compliant::{self, CompliantPath};
use crate::protocol::{Motion, SpringBlock};
use crate::stability::{CONFIRMATION_RATIO, OpenLoopResult};

/// Samples of one simulation, at most. Chosen: each takes some steps; more would take minutes a row.
const MAX_SAMPLES: u32 = 100_000;

/// Distance from the target at `t_f` under continuous `v_c`: the Euclidean norm in `(ln v, ln theta, k s/a)`.
///
/// Its sources are `rtol` and the rounding of the protocol, amplified along the path. `None` where the simulation does not
/// reach `t_f`.
pub fn open_loop_error(path: &CompliantPath, rtol: f64) -> OpenLoopResult {
    if path.slider.k == f64::INFINITY {
        let end = path.end();
        return OpenLoopResult { number: Some(distance(&path.slider.law, [0.0, ln(end.theta * end.v[0])])), steps: 0 };
    }
    let driven = Driven::new(path, Control::Continuous(path));
    let mut budget = MAX_STEPS;
    let end = driven.follow(driven.start(path), (0.0, driven.v_f * path.duration()), rtol, &mut budget);
    OpenLoopResult { number: end.map(|(state, _)| driven.distance(&state)), steps: MAX_STEPS - budget }
}

/// Distance from the target at `t_f`, as in [`open_loop_error`], if `v_c` of the shortcut from `v_i` to `v_f` in `t_f` is sampled at `0`, `dt`,
/// `2 dt`, … and held. The error is up to `rtol` of 1 + the distance.
///
/// `None` without a shortcut, for more than 100,000 samples, where the simulation does not reach `t_f`, most often because a held `v_c` stops the
/// block or makes it unstable, and where a finer simulation of a more accurate shortcut does not agree.
pub fn held_error(slider: &SpringBlock, velocities: (f64, f64), t_f: f64, dt: f64, rtol: f64) -> OpenLoopResult {
    let samples = (t_f / dt).ceil().max(1.0);
    if samples.is_nan() || samples > f64::from(MAX_SAMPLES) {
        return OpenLoopResult { number: None, steps: 0 };
    }
    let mut steps = 0;
    let mut distance = |rtol: f64, parts: f64, shift: f64| {
        let path = compliant::path(slider, velocities, t_f, (FRACTION * rtol).max(TIGHT_RTOL)).ok()?;
        let sample = |t: f64| (1.0 + shift) * slider.control(&path.at_time(t));
        held_distance(&path, dt, samples as u32, sample, (rtol, parts), &mut steps)
    };
    // Where errors grow, the shift of the control grows with them; steps may stay on an unstable motion by symmetry.
    let shift = (SHIFT * rtol).max(ROUNDING_RTOL);
    let number = distance(rtol, 1.0, shift).and_then(|shifted| {
        let distance = distance(rtol / CONFIRMATION_RATIO, PARTS, 0.0)?;
        ((shifted - distance).abs() <= rtol * (1.0 + distance)).then_some(distance)
    });
    OpenLoopResult { number, steps }
}

/// One simulation of [`held_error`] to `rtol`, under the control velocity `sample` of a time; adds its steps to `steps`. The first step after a
/// sample is at most one of `parts` equal parts of the time to the next.
fn held_distance(
    path: &CompliantPath,
    dt: f64,
    count: u32,
    sample: impl Fn(f64) -> f64,
    (rtol, parts): (f64, f64),
    steps: &mut u32,
) -> Option<f64> {
    let (slider, t_f) = (&path.slider, path.duration());
    let sample = |i: u32| sample(f64::from(i) * dt);
    let time = |i: u32| if i == count { t_f } else { f64::from(i) * dt };
    if slider.k == f64::INFINITY {
        let v_f = path.end().v[0];
        let (mut theta, mut v) = (path.jet(0, 0.0).theta, v_f);
        for i in 0..count {
            v = sample(i);
            let aged = -exp_m1(-(time(i + 1) - time(i)) * v);
            theta += (1.0 / v - theta) * aged;
        }
        return Some(distance(&slider.law, [ln(v / v_f), ln(theta * v_f)]));
    }
    let mut driven = Driven::new(path, Control::Held(0.0));
    let mut budget = MAX_STEPS;
    let mut state_and_step = Some(driven.start(path));
    for i in 0..count {
        let Some((state, h)) = state_and_step else { break };
        driven.control = Control::Held(sample(i));
        let [from, to] = [time(i), time(i + 1)].map(|t| driven.v_f * t);
        state_and_step = driven.follow((state, h.min((to - from) / parts)), (from, to), rtol, &mut budget);
    }
    *steps += MAX_STEPS - budget;
    state_and_step.map(|(state, _)| driven.distance(&state))
}

/// Accuracy of the shortcut, and error of a step, as fractions of `rtol`. Chosen: the acceleration, which the control contains, has two digits less than
/// the velocity, and the errors of a hundred steps may add up.
const FRACTION: f64 = 0.01;

/// Parts of a sampling interval in the second simulation. Chosen: it resolves a relaxation that one step of the first crosses.
const PARTS: f64 = 8.0;

/// Relative shift of the control velocity in the first simulation, in units of `rtol`. Chosen: four digits are left for a control that is the
/// difference of large terms.
const SHIFT: f64 = 1e-4;

/// Steps of one simulation, at most. Chosen: two for each sample.
const MAX_STEPS: u32 = 2 * MAX_SAMPLES;

/// Control velocity at the load point.
enum Control<'a> {
    Continuous(&'a CompliantPath),
    Held(f64),
}

/// The equations of motion.
struct Driven<'a> {
    block: ScaledBlock,
    slider: SpringBlock,
    v_f: f64,
    control: Control<'a>,
}

impl<'a> Driven<'a> {
    fn new(path: &CompliantPath, control: Control<'a>) -> Driven<'a> {
        let (slider, v_f) = (path.slider, path.end().v[0]);
        let SpringBlock { law: Law { a, b }, k, m } = slider;
        let block = ScaledBlock { state_law: StateLaw::Ageing, a, b, inertia: m * v_f * v_f, k };
        Driven { block, slider, v_f, control }
    }

    /// Steady sliding at the initial velocity, and a first step.
    fn start(&self, path: &CompliantPath) -> (State, f64) {
        let state = self.block.steady(ln(path.jet(0, 0.0).v[0] / self.v_f));
        (state, self.block.first_step(&state))
    }

    /// State at the end of a time interval, and the proposed next step; `None` where the integration fails, or the budget
    /// of steps is spent.
    fn follow(
        &self,
        (state, h): (State, f64),
        (from, to): (f64, f64),
        rtol: f64,
        budget: &mut u32,
    ) -> Option<(State, f64)> {
        let accuracy = Accuracy { tolerance: (FRACTION * rtol).max(TIGHT_RTOL), scale: [self.block.a, 1.0, 1.0] };
        let mut run = Integrator::new(self, radau_iia_9(), accuracy, from, state, h);
        while run.t() < to {
            *budget = budget.checked_sub(1)?;
            run.step(to)?;
        }
        Some((*run.y(), run.proposal()))
    }

    /// Distance from the target.
    fn distance(&self, state: &State) -> f64 {
        norm([state[X], state[Y], state[Z] / self.block.a])
    }
}

fn norm(errors: [f64; 3]) -> f64 {
    errors.map(|error| error * error).iter().sum::<f64>().sqrt()
}

/// Distance from the target for a rigid spring, whose force is friction alone.
fn distance(law: &Law, [x, y]: [f64; 2]) -> f64 {
    norm([x, y, x + law.b / law.a * y])
}

impl System<3> for Driven<'_> {
    fn linearise<const L: usize>(&self, points: &Points<3, L>) -> Linearised<3, L> {
        let mut at = self.block.linearise(points);
        for i in 0..L {
            let v_c = match self.control {
                Control::Continuous(path) => self.slider.control(&path.at_time(points.t[i] / self.v_f)),
                Control::Held(v_c) => v_c,
            };
            // Where both velocities are small, their differences from v_f would lose digits.
            at.residual[Z][i] = self.block.k * (v_c / self.v_f - exp(points.y[X][i])) - points.slope[Z][i];
        }
        at
    }
}
