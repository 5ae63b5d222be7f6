//! The end of a response: steady sliding, a limit cycle, or nothing that could be decided.
//!
//! Cycles are followed one by one while they change fast; where they change slowly, `envelope.rs` leaps over many.

use super::envelope::{DIFFERENCE_STEP, EnvelopeResult, FixedPoint, MIN_STEP_ERROR, MapStep, distance, size};
use super::orbit::{BAND, Cycle, Extremum, Orbit, RoughExtremum, StopReason};
use super::scaled_block::{ScaledBlock, SectionPoint, State, X};
use super::simulation::{LongTermBehaviour, MIN_DIFFERENCE, Simulation, UNDERFLOW_LN_V, UnresolvedNumbers};
use crate::numerics::elementary::{exp, ln};

/// Small motions about steady sliding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearStability {
    /// Whether they die out.
    pub stable: bool,
    /// Change of `ln z` over a cycle, if they oscillate.
    pub growth: Option<f64>,
}

/// Steps of one run, at most. Chosen: some ten times those of a response that leaps decide.
pub(super) const MAX_STEPS: u32 = 100_000;

/// Error of a step, fraction of the error that a run may leave. Chosen: the errors of the thirty-odd steps of a slip add up.
const STEP_ERROR: f64 = 0.03;

/// Error of `ln(v/v_f)` at an extremum of the dense output, at most. Measured at the loosest tolerance.
const DENSE_OUTPUT_ERROR: f64 = 1e-2;

/// Error estimate of a step, fraction of the motion, at most. Chosen: an estimate as large as the motion lets steps grow until
/// they damp what grows.
const ERROR_OF_MOTION: f64 = 1e-3;

/// Change of a cycle, relative, below which a leap is tried. Chosen: its inverse is about the number of laps that a leap takes.
const MAX_SLOW_CHANGE: f64 = 0.03;

/// Ratio of consecutive changes, at most, of cycles that are followed to their limit. Chosen: they come to 1e-6 of it within 270
/// cycles.
const MAX_RATIO: f64 = 0.95;

/// Ratio of consecutive changes below which the last one alone counts. Chosen: errors of steps may have made the one before.
const SMALL_RATIO: f64 = 0.02;

/// Ratios of consecutive changes at a nearly constant rate. Chosen: a leap that the next cycle refuses costs little.
const CONSTANT_RATE: std::ops::Range<f64> = 0.5..2.0;

/// Cycles between two tries to leap, and within the tolerance before changes count as errors of steps. Chosen: fewer cost less than
/// a try.
const MIN_CYCLES: u32 = 10;

/// Ratio of the last to the first of a row of falling changes, at most. Chosen: errors of steps differ by less.
const MAX_FALL_RATIO: f64 = 0.01;

/// Distance from the limit cycle, in units of `rtol`. Chosen: the error of a step, [`STEP_ERROR`].
const LIMIT_ERROR: f64 = 0.03;

/// Difference of `ln v` within which two peaks are equal, in units of `rtol`: the accuracy of the second run of a course.
const PEAK_TIE: f64 = 0.3;

/// Follows the response from `e^x v_f` once, with steps whose errors are to leave this `share` of `rtol` of its numbers.
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
        finest: MIN_STEP_ERROR * (error_fraction / 0.3).max(1.0),
        budget: MAX_STEPS,
        extrema: [None; 2],
        is_peak_ambiguous: false,
        t: 0.0,
    };
    let long_term = follower.run(slider.steady(x)).unwrap_or(LongTermBehaviour::Undecided);
    let Follower { extrema: [low, high], t, budget, is_peak_ambiguous, .. } = follower;
    let unresolved = UnresolvedNumbers { t_peak: is_peak_ambiguous, ..UnresolvedNumbers::default() };
    Simulation { long_term, high, low, t, steps: MAX_STEPS - budget, unresolved }
}

/// Error of a step that leaves this share of `rtol`; those of the first two runs always differ.
pub(super) fn step_error(rtol: f64, error_fraction: f64) -> f64 {
    (STEP_ERROR * error_fraction * rtol).max(MIN_STEP_ERROR * (error_fraction / 0.3).max(1.0))
}

pub(super) struct Follower<'a> {
    pub slider: &'a ScaledBlock,
    pub linear: LinearStability,
    /// Accuracy that the numbers are asked for with, and that of this run.
    pub requested_rtol: f64,
    pub rtol: f64,
    /// Error of a step.
    pub tolerance: f64,
    /// Least error of a step relative to the motion.
    pub finest: f64,
    pub budget: u32,
    /// Slowest and fastest moment so far.
    extrema: [Option<Extremum>; 2],
    /// Whether another moment was as fast as the fastest.
    is_peak_ambiguous: bool,
    t: f64,
}

/// A response under way: an orbit that may have begun after others.
struct OrbitSegment<'a> {
    orbit: Orbit<'a>,
    /// Time before the orbit.
    offset: f64,
    /// Since when the orbit has been settled if it began so; NaN if that was not seen.
    settled_since: f64,
    /// Error of its steps.
    tolerance: f64,
    /// Where the last cycle ended.
    section_point: Option<SectionPoint>,
    convergence: CycleConvergence,
}

impl OrbitSegment<'_> {
    /// When it settled; `None` outside the band.
    fn settled_at(&mut self) -> Option<f64> {
        let time = self.orbit.settled_at()?;
        Some(if time == 0.0 { self.settled_since } else { self.offset + time })
    }
}

impl<'a> Follower<'a> {
    fn run(&mut self, start: State) -> Result<LongTermBehaviour, StopReason> {
        let mut segment = self.segment(start, start[X].abs(), 0.0, 0.0);
        // Cycles so far, and after how many to try the next leap.
        let (mut count, mut next_attempt) = (0, 0);
        loop {
            // Follow one cycle.
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
            // A limit cycle? Small cycles may only have stopped to change fast: Newton's method finds those.
            if size >= 1.0
                && self.is_driven()
                && segment.convergence.has_arrived(self.requested_rtol)
                && self.attracts(&map_step)?
            {
                let [low, high] = cycle.exact_range(&mut segment.orbit);
                return Ok(LongTermBehaviour::Cycle { period: cycle.period, high, low });
            }
            // Leap over cycles that hardly change.
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
            // Steps as fine as the motion asks for.
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

    /// The next cycle; its extrema are kept.
    fn cycle(&mut self, segment: &mut OrbitSegment<'_>) -> Result<Cycle, StopReason> {
        let cycle = segment.orbit.cycle(self.linear.stable, &mut self.budget);
        self.t = segment.offset + segment.orbit.t();
        let extrema = cycle.as_ref().map_or_else(|_| segment.orbit.extrema(), |cycle| cycle.extrema);
        self.note_extrema(segment, extrema);
        cycle
    }

    /// A cycle compared with where it began; `None` for the first one, and for rounding at rest.
    fn map_step_of(&self, segment: &mut OrbitSegment<'_>, cycle: &Cycle) -> Option<MapStep> {
        let section_point = self.slider.section_point(&cycle.end);
        let from = segment.section_point.replace(section_point)?;
        let change = [section_point[0] - from[0], section_point[1] - from[1]];
        let range = cycle.range();
        segment.convergence.update(distance(change, size(range)), range[0], self.requested_rtol);
        let map_step = MapStep { from, change, period: cycle.period, range, tolerance: segment.tolerance };
        change[0].is_finite().then_some(map_step)
    }

    /// Whether there may be a limit cycle: friction weakens with velocity, and inertia limits what grows.
    pub(super) fn is_driven(&self) -> bool {
        self.slider.b > self.slider.a && self.slider.inertia > 0.0
    }

    /// A way on from a state, with a motion of this size.
    fn segment(&self, state: State, size: f64, offset: f64, settled_since: f64) -> OrbitSegment<'a> {
        let tolerance = self.step_error(size);
        let orbit = Orbit::new(self.slider, state, tolerance);
        OrbitSegment {
            orbit,
            offset,
            settled_since,
            tolerance,
            section_point: None,
            convergence: CycleConvergence::default(),
        }
    }

    /// Whether a cycle that begins beside this one comes to it: that one changes little does not show that.
    fn attracts(&mut self, map_step: &MapStep) -> Result<bool, StopReason> {
        let neighbour = self.map_step([map_step.from[0] + DIFFERENCE_STEP, map_step.from[1]], map_step.tolerance)?;
        Ok((1.0 + (neighbour.change[0] - map_step.change[0]) / DIFFERENCE_STEP).abs() < MAX_RATIO)
    }

    /// Error of a step in a motion of this size.
    fn step_error(&self, size: f64) -> f64 {
        let visible_error = exp(ln(ERROR_OF_MOTION * size) / 0.6);
        self.tolerance.min(visible_error).max(self.finest * size.min(1.0))
    }

    /// Whether a cycle stays in the band of settled velocities, about sliding that is stable, so that it may die out.
    fn may_decay(&self, map_step: &MapStep) -> bool {
        self.linear.stable && excess(map_step.range) < 0.0 && map_step.from[1].abs() < 0.1
    }

    /// Whether it shrinks beyond the errors of its steps, and so do all smaller ones: the change of `ln z` in small cycles is
    /// `growth + c A^2` of the amplitude `A`.
    pub(super) fn decays(&self, map_step: &MapStep) -> bool {
        let shrinks = map_step.change[0] < -1e3 * map_step.tolerance / map_step.size();
        self.may_decay(map_step) && shrinks && self.linear.growth.is_none_or(|growth| growth < 0.0)
    }

    /// The same with the finest steps.
    fn decays_at_finest_steps(&mut self, map_step: &MapStep) -> Result<bool, StopReason> {
        match self.map_step(map_step.from, self.finest * map_step.size()) {
            Ok(fine) => Ok(self.decays(&fine)),
            // Steps that only follow rounding: the next cycle tries coarser ones.
            Err(StopReason::BelowStepError) => Ok(false),
            Err(stop) => Err(stop),
        }
    }

    /// Keeps the extrema of a cycle if they are further out than those before.
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

    /// The same for a cycle whose time is not known.
    pub(super) fn note_range(&mut self, range: [f64; 2]) {
        for (i, sign) in [(0, -1.0), (1, 1.0)] {
            if self.extrema[i].is_none_or(|kept| sign * range[i] > sign * kept.x + PEAK_TIE * self.rtol) {
                self.extrema[i] = Some(Extremum { x: range[i], t: f64::NAN });
            }
        }
    }
}

/// How fast cycles come to each other.
#[derive(Debug, Clone, Copy)]
struct CycleConvergence {
    /// The last change of the section.
    change: f64,
    /// Shares that a change left of the one before, the last two.
    ratios: [f64; 2],
    /// The change from which on all have become less.
    first_change: f64,
    /// The slowest moment, and its change.
    low: f64,
    low_change: f64,
    /// Cycles that changed less than a part of `rtol`.
    small_changes: u32,
}

impl Default for CycleConvergence {
    fn default() -> CycleConvergence {
        let unknown = f64::NAN;
        CycleConvergence {
            change: unknown,
            ratios: [unknown; 2],
            first_change: unknown,
            low: unknown,
            low_change: unknown,
            small_changes: 0,
        }
    }
}

impl CycleConvergence {
    /// Takes in the change of the section over a cycle, and its slowest moment. Rises of a change below `rtol` may be
    /// errors of steps.
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

    /// Whether all changes to come, a geometric series, are less than a part of `rtol`, and so are those of the slowest moment,
    /// which may magnify them. A row of changes from far away shows that they are no errors of steps; where those are all that
    /// is left, the series has no ratio, and changes as small as that have lasted.
    fn has_arrived(&mut self, rtol: f64) -> bool {
        let [ratio, before] = self.ratios;
        let largest = if ratio < SMALL_RATIO { ratio } else { ratio.max(before) };
        let remaining = largest / (1.0 - largest);
        // False for NaN.
        let comes_from_far = self.change < MAX_FALL_RATIO * self.first_change;
        let converges = comes_from_far && largest < MAX_RATIO && self.change * remaining < LIMIT_ERROR * rtol;
        self.small_changes += u32::from(comes_from_far && self.change < LIMIT_ERROR * rtol);
        let low_change = self.low_change * remaining.max(0.01);
        (converges && (low_change < LIMIT_ERROR * rtol || self.low < UNDERFLOW_LN_V)) || self.small_changes > MIN_CYCLES
    }

    /// Whether cycles change little, and the next one will change about as much.
    fn is_slow(&self) -> bool {
        self.change < MAX_SLOW_CHANGE && self.ratios.iter().all(|ratio| CONSTANT_RATE.contains(ratio))
    }
}

impl Cycle {
    /// `ln(v/v_f)` at its slowest and fastest, as they were seen.
    fn range(&self) -> [f64; 2] {
        self.extrema.map(|extremum| extremum.map_or(0.0, |seen| seen.rough.x))
    }

    /// The same to the order of the method.
    fn exact_range(&self, orbit: &mut Orbit<'_>) -> [f64; 2] {
        self.extrema.map(|extremum| extremum.map_or(0.0, |seen| orbit.refined(seen).x))
    }
}

impl MapStep {
    /// The limit cycle that it is.
    fn limit(&self) -> LongTermBehaviour {
        let [low, high] = self.range;
        LongTermBehaviour::Cycle { period: self.period, high, low }
    }
}

/// How far a cycle goes beyond the band of settled velocities, relative to it; negative within.
pub(super) fn excess([low, high]: [f64; 2]) -> f64 {
    (high / BAND[1]).max(low / BAND[0]) - 1.0
}
