//! A response cycle by cycle: extrema, and upward crossings of the section `v = v_f`.

use std::collections::VecDeque;

use super::integration::{Integration, IntegrationStep, step_to, substep};
use super::scaled_block::{ScaledBlock, State, X, Y, Z};
use crate::numerics::root::crossing;
use crate::numerics::stiff::radau_iia_9;

/// Extremum of the velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremum {
    /// Value of `ln(v/v_f)`.
    pub x: f64,
    /// Time since the start of the orbit, in `l/v_f`.
    pub t: f64,
}

/// Cycle between two upward crossings of `v = v_f`; the first cycle begins where `v = v_f` is first reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// State at the end, on the section: `x = 0`.
    pub end: State,
    /// Time at the end, since the start of the orbit, in `l/v_f`.
    pub t: f64,
    /// Duration, in `l/v_f`.
    pub period: f64,
    /// Minimum and maximum of the velocity; `None` if the first cycle has none.
    pub extrema: [Option<RoughExtremum>; 2],
}

/// Reason why the integration of an orbit stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The distance from steady sliding is that of the errors of steps.
    AtRest,
    /// No step is short enough: the velocity becomes infinite.
    BlowUp,
    /// The velocity has begun to grow without bound (`ScaledBlock::diverges`).
    Divergence,
    /// The step limit is reached.
    StepLimit,
    /// The motion is smaller than the errors of its steps.
    BelowStepError,
}

/// Distance from steady sliding, in `ln v`, within which motions are linear. Derived: its square is 1e-10.
const LINEAR_RADIUS: f64 = 1e-5;

/// Distance from steady sliding that counts as rest, in errors of a step. Chosen: errors of three steps may add up.
const REST_DISTANCE: f64 = 3.0;

/// Half width of the band of settled velocities, in `|v/v_f - 1|`. By definition of the column `settling_time`.
pub const SETTLED: f64 = 0.01;

/// Band of settled velocities: `ln(1 - SETTLED)` and `ln(1 + SETTLED)`.
pub const BAND: [f64; 2] = [-0.01005033585350144, 0.009950330853168083];

/// Half width of the windows of both refinements of an extremum, fraction of a step. Chosen: the error of the dense
/// output, of order 5, is smaller at every tolerance.
const POLISH_WINDOW: f64 = 0.125;

/// Distance of an extremum from the edge of the band of settled velocities, relative to the edge, below which it is refined. Chosen: the error of the
/// dense output is smaller.
const NEAR_EDGE: f64 = 0.01;

/// Integration of a response, with its cycles.
#[derive(Debug)]
pub struct Orbit<'a> {
    slider: &'a ScaledBlock,
    run: Integration<'a>,
    /// Distance from steady sliding that counts as rest.
    rest_distance: f64,
    /// Time from the last section to the start of the last step: for short cycles after a long rest, the total time has too
    /// few digits.
    elapsed: f64,
    /// Whether `v = v_f` has been reached.
    met: bool,
    /// Cycles that ended in the last step and are not yet returned: one step can cross the section several times.
    closed: VecDeque<Cycle>,
    /// Slope of `x` at the end of the last step.
    slope: f64,
    /// Minimum and maximum of the velocity since the last section, if there are any.
    pub(super) extrema: [Option<RoughExtremum>; 2],
    /// The last entry into the band of settled velocities; `None` outside.
    entry: Option<BandEntry>,
    /// Accuracy of `x` at an extremum.
    x_error: f64,
    /// Whether the last extremum outside the band, or near its edge, is so near that rounding decides on which side; `None`
    /// if there was no such extremum.
    pub(super) touches: Option<bool>,
}

/// Extremum to the accuracy of the dense output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoughExtremum {
    /// The extremum.
    pub rough: Extremum,
    /// The step and the fraction of it; `None` at an arrest.
    position: Option<(IntegrationStep, f64)>,
}

#[derive(Debug, Clone, Copy)]
struct BandEntry {
    edge: f64,
    position: Option<(IntegrationStep, f64)>,
}

impl<'a> Orbit<'a> {
    /// Orbit from `state`, with errors of a step below `tolerance` and of `x` at an extremum below `x_error`.
    pub fn new(slider: &'a ScaledBlock, state: State, tolerance: f64, x_error: f64) -> Orbit<'a> {
        Orbit {
            slider,
            run: slider.run(state, slider.first_step(&state), tolerance),
            rest_distance: rest_distance(tolerance),
            elapsed: 0.0,
            met: state[X] == 0.0,
            closed: VecDeque::new(),
            slope: 0.0,
            extrema: [None; 2],
            entry: is_inside(state[X]).then_some(BandEntry { edge: state[X], position: None }),
            x_error,
            touches: None,
        }
    }

    /// Time reached.
    pub fn t(&self) -> f64 {
        self.run.t()
    }

    /// Integrates to the next section; each step takes 1 off the `budget`.
    ///
    /// # Errors
    ///
    /// The reason why the orbit does not reach the section; `AtRest` only if it `may_rest`.
    pub fn cycle(&mut self, may_rest: bool, budget: &mut u32) -> Result<Cycle, StopReason> {
        loop {
            if let Some(cycle) = self.closed.pop_front() {
                return Ok(cycle);
            }
            if *budget == 0 {
                return Err(StopReason::StepLimit);
            }
            *budget -= 1;
            if may_rest && self.is_at_rest() {
                return Err(StopReason::AtRest);
            }
            if let Some(arrested) = self.slider.arrest(self.run.y()) {
                // It falls past v_f, and out of the band of settled velocities.
                self.met |= self.run.y()[X] > 0.0 && arrested[X] <= 0.0;
                self.entry = self.entry.filter(|_| is_inside(arrested[X]));
                self.run.jump(arrested, self.slider.first_step(&arrested));
                self.note_extremum(
                    -1.0,
                    RoughExtremum { rough: Extremum { x: arrested[X], t: self.run.t() }, position: None },
                );
                self.slope = 0.0;
            }
            if self.slider.diverges(self.run.y()) {
                return Err(StopReason::Divergence);
            }
            let step = step_to(&mut self.run, f64::MAX).ok_or(StopReason::BlowUp)?;
            self.scan(&step);
            self.elapsed += step.path.h;
        }
    }

    fn is_at_rest(&self) -> bool {
        let [z, y, x] = *self.run.y();
        let ScaledBlock { a, b, inertia, k, .. } = *self.slider;
        // Friction converts ln theta to ln v by b/a, and the energy of a soft spring moves masses of M and a.
        let force = a.min((k * (inertia + a)).sqrt());
        x.abs() < self.rest_distance && y.abs() * b < self.rest_distance * a && z.abs() < self.rest_distance * force
    }

    /// Finds extrema and crossings within a step, from node to node.
    fn scan(&mut self, step: &IntegrationStep) {
        let mut u0 = 0.0;
        let (mut x0, mut slope0) = (step.path.start[X], step.path.slope(X, 0.0));
        if self.slope * slope0 < 0.0 {
            // Between two steps, whose polynomials differ slightly in slope.
            self.note_extremum(self.slope, RoughExtremum { rough: Extremum { x: x0, t: step.path.t }, position: None });
        }
        for u1 in radau_iia_9().nodes {
            let (x1, slope1) = (step.path.value(X, u1), step.path.slope(X, u1));
            if slope0 * slope1 < 0.0 {
                let turn = crossing(|u| step.path.slope(X, u), [u0, u1], [slope0, slope1], 1e-6 * (u1 - u0));
                let x = step.path.value(X, turn);
                self.scan_monotone(step, [u0, turn], [x0, x]);
                let rough = Extremum { x, t: step.path.time(turn) };
                self.note_extremum(slope0, RoughExtremum { rough, position: Some((*step, turn)) });
                self.scan_monotone(step, [turn, u1], [x, x1]);
            } else {
                self.scan_monotone(step, [u0, u1], [x0, x1]);
            }
            (u0, x0, slope0) = (u1, x1, slope1);
        }
        self.slope = slope0;
    }

    /// Records an extremum after a rise or a fall, if `v = v_f` has been reached and the extremum exceeds `v_f` and the one
    /// before: at rest, rounding makes extrema too.
    fn note_extremum(&mut self, slope: f64, seen: RoughExtremum) {
        let side = usize::from(slope > 0.0);
        let (edge, sign) = (BAND[side], [-1.0, 1.0][side]);
        let beyond = seen.rough.x / edge - 1.0;
        if beyond.abs() < NEAR_EDGE {
            let refined = self.refined(seen).x / edge - 1.0;
            let is_ambiguous = refined.abs() * edge.abs() < self.x_error || refined * beyond <= 0.0;
            if is_ambiguous || beyond > 0.0 {
                self.touches = Some(is_ambiguous);
            }
        } else if beyond > 0.0 {
            self.touches = Some(false);
        }
        let (kept, out) = (&mut self.extrema[side], sign * seen.rough.x);
        if self.met && out > 0.0 && kept.is_none_or(|kept| out > sign * kept.rough.x) {
            *kept = Some(seen);
        }
    }

    /// Finds crossings within a range of a step in which the velocity is monotone.
    fn scan_monotone(&mut self, step: &IntegrationStep, u: [f64; 2], x: [f64; 2]) {
        let at = |level: f64| crossing(|u| step.path.value(X, u) - level, u, [x[0] - level, x[1] - level], 1e-9);
        let (rises, falls) = (x[0] < 0.0 && x[1] >= 0.0, x[0] > 0.0 && x[1] <= 0.0);
        if rises {
            let cycle = self.end_cycle(step, at(0.0));
            self.closed.push_back(cycle);
            self.extrema = [None; 2];
        }
        self.met |= rises || falls;
        if !is_inside(x[1]) {
            self.entry = None;
        } else if self.entry.is_none() {
            let edge = if x[0] > 0.0 { BAND[1] } else { BAND[0] };
            self.entry = Some(BandEntry { edge, position: Some((*step, at(edge))) });
        }
    }

    /// The cycle that ends at the section, near the fraction `u` of a step.
    fn end_cycle(&mut self, step: &IntegrationStep, u: f64) -> Cycle {
        let (end, t, refined_step) = self.locate(step, u, 0.0);
        let time = refined_step.map_or(u * step.path.h, |refined_step| refined_step.path.h);
        let cycle = Cycle { end: [end[Z], end[Y], 0.0], t, period: self.elapsed + time, extrema: self.extrema };
        // The caller adds the whole step.
        self.elapsed = -time;
        cycle
    }

    /// State and time where `x` is `level`, near the fraction `u` of a step, to the order of the method.
    fn locate(&mut self, step: &IntegrationStep, u: f64, level: f64) -> (State, f64, Option<IntegrationStep>) {
        let mut u = u;
        let mut best = (std::array::from_fn(|r| step.path.value(r, u)), step.path.time(u), None);
        for _ in 0..2 {
            let Some(refined_step) = substep(&mut self.run, step, 0.0, u) else { break };
            best = (refined_step.path.end, refined_step.path.time(1.0), Some(refined_step));
            let change = (level - refined_step.path.end[X]) / refined_step.path.slope(X, 1.0);
            u += change / step.path.h;
            if change.abs() <= 1e-12 * step.path.h || !(u > 0.0 && u < 1.5) {
                break;
            }
        }
        best
    }

    /// Refines an extremum by integration over ever shorter steps about it.
    pub fn refined(&mut self, RoughExtremum { rough, position }: RoughExtremum) -> Extremum {
        let Some((mut step, mut u)) = position else { return rough };
        for _ in 0..2 {
            let (from, to) = ((u - POLISH_WINDOW).max(0.0), u + POLISH_WINDOW);
            let Some(refined_step) = substep(&mut self.run, &step, from, to) else { return rough };
            let slopes = [refined_step.path.slope(X, 0.0), refined_step.path.slope(X, 1.0)];
            if slopes[0] * slopes[1] >= 0.0 {
                break;
            }
            (step, u) = (refined_step, crossing(|u| refined_step.path.slope(X, u), [0.0, 1.0], slopes, 1e-9));
        }
        substep(&mut self.run, &step, 0.0, u)
            .map_or(rough, |refined_step| Extremum { x: refined_step.path.end[X], t: refined_step.path.time(1.0) })
    }

    /// Time of the last entry into the band of settled velocities; `None` outside the band.
    pub fn settled_at(&mut self) -> Option<f64> {
        let BandEntry { edge, position } = self.entry?;
        Some(position.map_or(0.0, |(step, u)| self.locate(&step, u, edge).1))
    }
}

/// Distance from steady sliding that counts as rest, for errors of a step below `tolerance`: the motion is linear, and of
/// the size of these errors.
pub(super) fn rest_distance(tolerance: f64) -> f64 {
    LINEAR_RADIUS.min(REST_DISTANCE * tolerance)
}

fn is_inside(x: f64) -> bool {
    x > BAND[0] && x < BAND[1]
}
