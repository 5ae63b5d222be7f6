//! Long-term behaviour of a response: steady sliding, a limit cycle, or undecided.
//!
//! Fast-changing cycles are integrated one by one; `envelope.rs` skips slowly changing cycles.

use super::envelope::{DIFFERENCE_STEP, EnvelopeResult, FixedPoint, MIN_STEP_ERROR, MapStep, distance, size};
use super::orbit::{BAND, Cycle, Extremum, Orbit, RoughExtremum, StopReason};
use super::scaled_block::{ScaledBlock, SectionPoint, State, X};
use super::simulation::{ACCURACIES, LongTermBehaviour, MIN_DIFFERENCE, Simulation, UNDERFLOW_LN_V, UnresolvedNumbers};
use crate::numerics::elementary::{exp, ln};

/// Small motions about steady sliding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LinearStability {
    /// Whether they decay.
    pub stable: bool,
    /// Growth of `ln z` over a cycle; `None` if they do not oscillate.
    pub growth: Option<f64>,
}

/// Steps of one run, at most. Chosen: some ten times those of a response that envelope following decides.
pub(super) const MAX_STEPS: u32 = 100_000;

/// Error of a step, fraction of the error of a run, and of an implicit step, fraction of that; distance from the limit cycle, fraction of `rtol`.
/// Chosen: the errors of the thirty-odd steps of a slip add up.
pub(super) const STEP_ERROR: f64 = 0.03;

/// Error of `ln(v/v_f)` at an extremum of the dense output, at most. Chosen; the budgets of `step_response` judge it.
const DENSE_OUTPUT_ERROR: f64 = 1e-2;

/// Error estimate of a step, fraction of the motion, at most. Chosen: an estimate as large as the motion allows steps that
/// damp a growing motion.
const ERROR_OF_MOTION: f64 = 1e-3;

/// Relative change of a cycle below which an envelope step is tried. Chosen: its inverse is about the number of cycles that
/// an envelope step integrates.
const MAX_SLOW_CHANGE: f64 = 0.03;

/// Ratio of consecutive changes, at most, of cycles that are integrated to their limit. Chosen: 270 cycles to 1e-6 of it.
const MAX_RATIO: f64 = 0.95;

/// Ratio of consecutive changes below which the last one alone counts. Chosen: errors of steps may have made the one before.
const SMALL_RATIO: f64 = 0.02;

/// Ratios of consecutive changes at a nearly constant rate. Chosen: a failed envelope step costs little.
const CONSTANT_RATE: std::ops::Range<f64> = 0.5..2.0;

/// Cycles between two attempts of an envelope step, and cycles within the tolerance after which changes count as errors of
/// steps. Chosen: fewer cost less than an attempt.
const MIN_CYCLES: u32 = 10;

/// Ratio of the last to the first of a sequence of falling changes, at most. Chosen: errors of steps differ by less.
const MAX_FALL_RATIO: f64 = 0.01;

/// Difference of `ln v` within which two peaks are equal, in units of `rtol`: the accuracy of the second run.
const PEAK_TIE: f64 = ACCURACIES[1];

/// Runs the response from `e^x v_f` once; the errors of its steps add up to `error_fraction` of `rtol`.
pub(super) fn follow_once(
    slider: &ScaledBlock,
    linear: LinearStability,
    x: f64,
    rtol: f64,
    error_fraction: f64,
) -> Simulation {
    let mut follower = Follower {
        slider,
        linear,
        requested_rtol: rtol.max(MIN_DIFFERENCE),
        rtol: error_fraction * rtol,
        tolerance: step_error(rtol, error_fraction),
        min_step_error: min_step_error(error_fraction),
        budget: MAX_STEPS,
        extrema: [None; 2],
        is_peak_ambiguous: false,
        touches_band: false,
        t: 0.0,
    };
    let long_term = match follower.run(slider.steady(x)) {
        Ok(long_term) => long_term,
        Err(StopReason::Divergence) => LongTermBehaviour::BlowUp,
        Err(_) => LongTermBehaviour::Undecided,
    };
    let Follower { extrema: [low, high], t, budget, is_peak_ambiguous, touches_band, .. } = follower;
    let unresolved =
        UnresolvedNumbers { t_peak: is_peak_ambiguous, settling_time: touches_band, ..UnresolvedNumbers::default() };
    Simulation { long_term, high, low, t, steps: MAX_STEPS - budget, unresolved }
}

/// Error of a step in a run to `error_fraction` of `rtol`; the first two runs always differ in it.
pub(super) fn step_error(rtol: f64, error_fraction: f64) -> f64 {
    (STEP_ERROR * error_fraction * rtol).max(min_step_error(error_fraction))
}

/// Least error of a step in such a run.
fn min_step_error(error_fraction: f64) -> f64 {
    MIN_STEP_ERROR * (error_fraction / ACCURACIES[1]).max(1.0)
}

pub(super) struct Follower<'a> {
    pub slider: &'a ScaledBlock,
    pub linear: LinearStability,
    /// Requested accuracy, and that of this run.
    pub requested_rtol: f64,
    pub rtol: f64,
    /// Error of a step.
    pub tolerance: f64,
    /// Least error of a step relative to the motion.
    pub min_step_error: f64,
    pub budget: u32,
    /// Minimum and maximum of the velocity so far.
    extrema: [Option<Extremum>; 2],
    /// Whether two peaks are equal within [`PEAK_TIE`].
    is_peak_ambiguous: bool,
    /// Whether an extremum so far touches the band of settled velocities.
    touches_band: bool,
    t: f64,
}

/// Segment of a response: an orbit, with its start time.
struct OrbitSegment<'a> {
    orbit: Orbit<'a>,
    /// Time before the orbit.
    offset: f64,
    /// Settling time of an orbit that starts settled; NaN if unknown.
    settled_since: f64,
    /// Error of a step.
    tolerance: f64,
    /// End of the last cycle.
    section_point: Option<SectionPoint>,
    convergence: CycleConvergence,
}

impl OrbitSegment<'_> {
    /// Settling time so far; `None` outside the band.
    fn settled_at(&mut self) -> Option<f64> {
        let time = self.orbit.settled_at()?;
        Some(if time == 0.0 { self.settled_since } else { self.offset + time })
    }
}

impl<'a> Follower<'a> {
    fn run(&mut self, start: State) -> Result<LongTermBehaviour, StopReason> {
        let mut segment = self.segment(start, start[X].abs(), 0.0, 0.0);
        // Cycles so far, and the number of cycles at the next attempt of an envelope step.
        let (mut count, mut next_attempt) = (0, 0);
        loop {
            // Integrate one cycle.
            let cycle = match self.cycle(&mut segment) {
                Err(StopReason::AtRest) => {
                    return segment
                        .settled_at()
                        .map(|time| LongTermBehaviour::Settled { time })
                        .ok_or(StopReason::AtRest);
                }
                cycle => cycle?,
            };
            let Some(map_step) = self.map_step_of(&mut segment, &cycle) else { continue };
            let size = map_step.size();
            count += 1;
            // Steady sliding?
            if self.may_decay(&map_step)
                && (self.decays(&map_step) || self.decays_at_finest_steps(&map_step)?)
                && let Some(time) = segment.settled_at()
            {
                return Ok(LongTermBehaviour::Settled { time });
            }
            // A limit cycle? Newton's method finds small cycles, whose changes may only have become slow.
            if size >= 1.0
                && self.is_driven()
                && segment.convergence.has_arrived(self.requested_rtol)
                && self.attracts(&map_step)?
            {
                let [low, high] = cycle.exact_range(&mut segment.orbit);
                return Ok(LongTermBehaviour::Cycle { period: cycle.period, high, low });
            }
            // Skip cycles that hardly change.
            let end = segment.offset + cycle.t;
            if (segment.convergence.is_slow() || segment.convergence.change < self.rtol) && count >= next_attempt {
                next_attempt = 2 * count + MIN_CYCLES;
                match self.follow_envelope(
                    self.slider.section_point(&cycle.end),
                    map_step.range,
                    segment.convergence.change,
                ) {
                    Ok(EnvelopeResult::Cycle(FixedPoint { map_step, .. })) => return Ok(map_step.limit()),
                    Ok(EnvelopeResult::At { section_point, time }) if time > 0.0 => {
                        let settled_since = segment.settled_at().filter(|_| excess(map_step.range) < 0.0);
                        let convergence = CycleConvergence::default();
                        segment = self.segment(
                            self.slider.state(section_point),
                            size,
                            end + time,
                            settled_since.unwrap_or(f64::NAN),
                        );
                        (segment.section_point, segment.convergence) = (Some(section_point), convergence);
                        continue;
                    }
                    Ok(_) | Err(StopReason::BelowStepError) => {}
                    Err(stop) => return Err(stop),
                }
            }
            // Adapt the tolerance to the motion.
            let requested_rtol = self.step_error(size);
            if (!self.linear.stable && requested_rtol < 0.1 * segment.tolerance)
                || requested_rtol > 100.0 * segment.tolerance
            {
                let settled_since = segment.settled_at().unwrap_or(f64::NAN);
                segment = OrbitSegment {
                    section_point: segment.section_point,
                    convergence: segment.convergence,
                    ..self.segment(cycle.end, size, end, settled_since)
                };
            }
        }
    }

    /// Integrates the next cycle and records its extrema.
    fn cycle(&mut self, segment: &mut OrbitSegment<'_>) -> Result<Cycle, StopReason> {
        let cycle = segment.orbit.cycle(self.linear.stable, &mut self.budget);
        self.t = segment.offset + segment.orbit.t();
        let extrema = cycle.as_ref().map_or_else(|_| segment.orbit.extrema, |cycle| cycle.extrema);
        self.touches_band = segment.orbit.touches.unwrap_or(self.touches_band);
        self.note_extrema(segment, extrema);
        cycle
    }

    /// Return-map step of a cycle; `None` for the first one, and for rounding at rest.
    fn map_step_of(&self, segment: &mut OrbitSegment<'_>, cycle: &Cycle) -> Option<MapStep> {
        let section_point = self.slider.section_point(&cycle.end);
        let from = segment.section_point.replace(section_point)?;
        let change = [section_point[0] - from[0], section_point[1] - from[1]];
        let range = cycle.range();
        segment.convergence.update(distance(change, size(range)), range[0], self.requested_rtol);
        let map_step = MapStep { from, change, period: cycle.period, range, tolerance: segment.tolerance };
        change[0].is_finite().then_some(map_step)
    }

    /// Whether a limit cycle may exist: friction is velocity-weakening, and inertia limits growth.
    pub(super) fn is_driven(&self) -> bool {
        self.slider.b > self.slider.a && self.slider.inertia > 0.0
    }

    /// Segment from a state, for a motion of this size.
    fn segment(&self, state: State, size: f64, offset: f64, settled_since: f64) -> OrbitSegment<'a> {
        let tolerance = self.step_error(size);
        let orbit = Orbit::new(self.slider, state, tolerance, self.rtol);
        OrbitSegment {
            orbit,
            offset,
            settled_since,
            tolerance,
            section_point: None,
            convergence: CycleConvergence::default(),
        }
    }

    /// Whether this cycle attracts a neighbouring cycle: a small change does not show this.
    fn attracts(&mut self, map_step: &MapStep) -> Result<bool, StopReason> {
        let neighbour = self.map_step([map_step.from[0] + DIFFERENCE_STEP, map_step.from[1]], map_step.tolerance)?;
        Ok((1.0 + (neighbour.change[0] - map_step.change[0]) / DIFFERENCE_STEP).abs() < MAX_RATIO)
    }

    /// Error of a step for a motion of this size.
    fn step_error(&self, size: f64) -> f64 {
        let visible_error = exp(ln(ERROR_OF_MOTION * size) / 0.6);
        self.tolerance.min(visible_error).max(self.min_step_error * size.min(1.0))
    }

    /// Whether a cycle stays in the band of settled velocities about stable sliding, so that it may decay.
    fn may_decay(&self, map_step: &MapStep) -> bool {
        self.linear.stable && excess(map_step.range) < 0.0 && map_step.from[1].abs() < 0.1
    }

    /// Whether a cycle shrinks by more than the errors of its steps, and so do all smaller ones. The change of `ln z` in
    /// small cycles is `growth + c A^2` of the amplitude `A`.
    pub(super) fn decays(&self, map_step: &MapStep) -> bool {
        let shrinks = map_step.change[0] < -1e3 * map_step.tolerance / map_step.size();
        self.may_decay(map_step) && shrinks && self.linear.growth.is_none_or(|growth| growth < 0.0)
    }

    /// Whether a cycle decays, at the tightest tolerance.
    fn decays_at_finest_steps(&mut self, map_step: &MapStep) -> Result<bool, StopReason> {
        match self.map_step(map_step.from, self.min_step_error * map_step.size()) {
            Ok(fine) => Ok(self.decays(&fine)),
            // Steps resolve rounding only: the next cycle has a looser tolerance.
            Err(StopReason::BelowStepError) => Ok(false),
            Err(stop) => Err(stop),
        }
    }

    /// Records the extrema of a cycle if they exceed those before.
    fn note_extrema(&mut self, segment: &mut OrbitSegment<'_>, extrema: [Option<RoughExtremum>; 2]) {
        for (i, sign) in [(0, -1.0), (1, 1.0)] {
            let (Some(seen), kept) = (extrema[i], self.extrema[i]) else { continue };
            if kept.is_some_and(|kept| sign * seen.rough.x <= sign * kept.x - DENSE_OUTPUT_ERROR) {
                continue;
            }
            let extremum = segment.orbit.refined(seen);
            if i == 1 && kept.is_none_or(|kept| extremum.x > kept.x - PEAK_TIE * self.rtol) {
                self.is_peak_ambiguous = kept.is_some_and(|kept| extremum.x < kept.x + PEAK_TIE * self.rtol);
            }
            if kept.is_none_or(|kept| sign * extremum.x > sign * kept.x) {
                self.extrema[i] = Some(Extremum { t: segment.offset + extremum.t, ..extremum });
            }
        }
    }

    /// Records the extrema of a cycle at an unknown time.
    pub(super) fn note_range(&mut self, range: [f64; 2]) {
        for (i, sign) in [(0, -1.0), (1, 1.0)] {
            if self.extrema[i].is_none_or(|kept| sign * range[i] > sign * kept.x + PEAK_TIE * self.rtol) {
                self.extrema[i] = Some(Extremum { x: range[i], t: f64::NAN });
            }
        }
    }
}

/// Convergence of consecutive cycles.
#[derive(Debug, Clone, Copy, Default)]
struct CycleConvergence {
    /// Last change of the section point.
    change: f64,
    /// Last two ratios of consecutive changes.
    ratios: [f64; 2],
    /// First of the falling changes.
    first_change: f64,
    /// Least velocity, in `ln(v/v_f)`, and its change.
    low: f64,
    low_change: f64,
    /// Number of cycles with changes below a fraction of `rtol`.
    small_changes: u32,
}

impl CycleConvergence {
    /// Updates with the change of the section point over a cycle, and its least velocity. Rising changes below `rtol` may
    /// be errors of steps.
    fn update(&mut self, change: f64, low: f64, rtol: f64) {
        let ratio = change / self.change;
        if ratio < MAX_RATIO {
            self.first_change = self.first_change.max(self.change);
        } else if change.is_nan() || change > rtol {
            self.first_change = f64::NAN;
        }
        (self.change, self.ratios) = (change, [ratio, self.ratios[0]]);
        (self.low, self.low_change) = (low, (low - self.low).abs());
    }

    /// Whether the sum of all future changes, a geometric series, is below a fraction of `rtol`, and so for the least
    /// velocity, which may magnify them.
    ///
    /// A sequence of falling changes distinguishes convergence from errors of steps. Changes that remain small for many
    /// cycles are errors of steps at the limit.
    fn has_arrived(&mut self, rtol: f64) -> bool {
        let [ratio, before] = self.ratios;
        let largest = if ratio < SMALL_RATIO { ratio } else { ratio.max(before) };
        let remaining = largest / (1.0 - largest);
        // False for NaN.
        let comes_from_far = self.change < MAX_FALL_RATIO * self.first_change;
        let converges = comes_from_far && largest < MAX_RATIO && self.change * remaining < STEP_ERROR * rtol;
        self.small_changes += u32::from(comes_from_far && self.change < STEP_ERROR * rtol);
        let low_change = self.low_change * remaining.max(0.01);
        (converges && (low_change < STEP_ERROR * rtol || self.low < UNDERFLOW_LN_V)) || self.small_changes > MIN_CYCLES
    }

    /// Whether cycles change slowly, at a nearly constant rate.
    fn is_slow(&self) -> bool {
        self.change < MAX_SLOW_CHANGE && self.ratios.iter().all(|ratio| CONSTANT_RATE.contains(ratio))
    }
}

impl Cycle {
    /// Least and greatest `ln(v/v_f)`, to the accuracy of the dense output.
    fn range(&self) -> [f64; 2] {
        self.extrema.map(|extremum| extremum.map_or(0.0, |seen| seen.rough.x))
    }

    /// Least and greatest `ln(v/v_f)`, to the order of the method.
    pub(super) fn exact_range(&self, orbit: &mut Orbit<'_>) -> [f64; 2] {
        self.extrema.map(|extremum| extremum.map_or(0.0, |seen| orbit.refined(seen).x))
    }
}

impl MapStep {
    /// Limit cycle of a fixed point.
    fn limit(&self) -> LongTermBehaviour {
        let [low, high] = self.range;
        LongTermBehaviour::Cycle { period: self.period, high, low }
    }
}

/// Excess of a cycle over the band of settled velocities, relative to the band; negative within.
pub(super) fn excess([low, high]: [f64; 2]) -> f64 {
    (high / BAND[1]).max(low / BAND[0]) - 1.0
}
