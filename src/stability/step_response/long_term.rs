//! The end of a response: steady sliding, a limit cycle, or nothing that could be decided.
//!
//! Cycles are followed one by one while they change fast; where they change slowly, `envelope.rs` leaps over many.

use super::envelope::{FINEST, Fixed, Lap, Leapt, NUDGE, distance, size};
use super::orbit::{BAND, Cycle, Extremum, Orbit, Seen, Stop};
use super::scaled_block::{Place, ScaledBlock, State, X};
use super::simulation::{Doubts, LongTermBehaviour, ROUNDED, Simulation, VANISHING};
use crate::numerics::elementary::{exp, ln};

/// Small motions about steady sliding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
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
const LEAP_CHANGE: f64 = 0.03;

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
const FALL: f64 = 0.01;

/// Distance from the limit cycle, in units of `rtol`. Chosen: the error of a step, [`STEP_ERROR`].
const LIMIT_ERROR: f64 = 0.03;

/// Difference of `ln v` within which two peaks are equal, in units of `rtol`: the accuracy of the second run of a course.
const PEAK_TIE: f64 = 0.3;

/// Follows the response from `e^x v_f` once, with steps whose errors are to leave this `share` of `rtol` of its numbers.
pub(super) fn follow_once(slider: &ScaledBlock, linear: Linear, x: f64, rtol: f64, share: f64) -> Simulation {
    let mut follower = Follower {
        slider,
        linear,
        asked: rtol.max(ROUNDED),
        rtol: share * rtol,
        tolerance: step_error(rtol, share),
        finest: FINEST * (share / 0.3).max(1.0),
        budget: MAX_STEPS,
        extrema: [None; 2],
        vague_peak: false,
        t: 0.0,
    };
    let long_term = follower.run(slider.steady(x)).unwrap_or(LongTermBehaviour::Undecided);
    let Follower { extrema: [low, high], t, budget, vague_peak, .. } = follower;
    let doubts = Doubts { t_peak: vague_peak, ..Doubts::default() };
    Simulation { long_term, high, low, t, steps: MAX_STEPS - budget, doubts }
}

/// Error of a step that leaves this share of `rtol`; those of the first two runs always differ.
pub(super) fn step_error(rtol: f64, share: f64) -> f64 {
    (STEP_ERROR * share * rtol).max(FINEST * (share / 0.3).max(1.0))
}

pub(super) struct Follower<'a> {
    pub slider: &'a ScaledBlock,
    pub linear: Linear,
    /// Accuracy that the numbers are asked for with, and that of this run.
    pub asked: f64,
    pub rtol: f64,
    /// Error of a step.
    pub tolerance: f64,
    /// Least error of a step relative to the motion.
    pub finest: f64,
    pub budget: u32,
    /// Slowest and fastest moment so far.
    extrema: [Option<Extremum>; 2],
    /// Whether another moment was as fast as the fastest.
    vague_peak: bool,
    t: f64,
}

/// A response under way: an orbit that may have begun after others.
struct Way<'a> {
    orbit: Orbit<'a>,
    /// Time before the orbit.
    offset: f64,
    /// Since when the orbit has been settled if it began so; NaN if that was not seen.
    since: f64,
    /// Error of its steps.
    tolerance: f64,
    /// Where the last cycle ended.
    place: Option<Place>,
    pace: Pace,
}

impl Way<'_> {
    /// When it settled; `None` outside the band.
    fn settled_at(&mut self) -> Option<f64> {
        let time = self.orbit.settled_at()?;
        Some(if time == 0.0 { self.since } else { self.offset + time })
    }
}

impl<'a> Follower<'a> {
    fn run(&mut self, start: State) -> Result<LongTermBehaviour, Stop> {
        let mut way = self.way(start, start[X].abs(), 0.0, 0.0);
        // Cycles so far, and after how many to try the next leap.
        let (mut count, mut again) = (0, 0);
        loop {
            // Follow one cycle.
            let cycle = match self.cycle(&mut way) {
                Err(Stop::Quiet) => {
                    return way.settled_at().map(|time| LongTermBehaviour::Settled { time }).ok_or(Stop::Quiet);
                }
                cycle => cycle?,
            };
            let Some(lap) = self.compare(&mut way, &cycle) else { continue };
            let size = lap.size();
            count += 1;
            // Steady sliding?
            if self.may_die_out(&lap)
                && (self.dies_out(&lap) || self.dies_out_exactly(&lap)?)
                && let Some(time) = way.settled_at()
            {
                return Ok(LongTermBehaviour::Settled { time });
            }
            // A limit cycle? Small cycles may only have stopped to change fast: Newton's method finds those.
            if size >= 1.0 && self.is_driven() && way.pace.has_arrived(self.asked) && self.attracts(&lap)? {
                let [low, high] = cycle.exact_range(&mut way.orbit);
                return Ok(LongTermBehaviour::Cycle { period: cycle.period, high, low });
            }
            // Leap over cycles that hardly change.
            let end = way.offset + cycle.t;
            if (way.pace.is_slow() || way.pace.change < self.rtol) && count >= again {
                again = 2 * count + MIN_CYCLES;
                match self.leap_on(self.slider.place(&cycle.end), lap.range, way.pace.change) {
                    Ok(Leapt::Cycle(Fixed { lap, .. })) => return Ok(lap.limit()),
                    Ok(Leapt::At { place, time }) if time > 0.0 => {
                        let since = way.settled_at().filter(|_| excess(lap.range) < 0.0);
                        let pace = Pace::default();
                        way = self.way(self.slider.state(place), size, end + time, since.unwrap_or(f64::NAN));
                        (way.place, way.pace) = (Some(place), pace);
                        continue;
                    }
                    Ok(_) | Err(Stop::Faint) => {}
                    Err(stop) => return Err(stop),
                }
            }
            // Steps as fine as the motion asks for.
            let asked = self.step_error(size);
            if (!self.linear.stable && asked < 0.1 * way.tolerance) || asked > 100.0 * way.tolerance {
                let since = way.settled_at().unwrap_or(f64::NAN);
                way = Way { place: way.place, pace: way.pace, ..self.way(cycle.end, size, end, since) };
            }
        }
    }

    /// The next cycle; its extrema are kept.
    fn cycle(&mut self, way: &mut Way<'_>) -> Result<Cycle, Stop> {
        let cycle = way.orbit.cycle(self.linear.stable, &mut self.budget);
        self.t = way.offset + way.orbit.t();
        let extrema = cycle.as_ref().map_or_else(|_| way.orbit.extrema(), |cycle| cycle.extrema);
        self.note(way, extrema);
        cycle
    }

    /// A cycle compared with where it began; `None` for the first one, and for rounding at rest.
    fn compare(&self, way: &mut Way<'_>, cycle: &Cycle) -> Option<Lap> {
        let place = self.slider.place(&cycle.end);
        let from = way.place.replace(place)?;
        let change = [place[0] - from[0], place[1] - from[1]];
        let range = cycle.range();
        way.pace.take(distance(change, size(range)), range[0], self.asked);
        let lap = Lap { from, change, period: cycle.period, range, tolerance: way.tolerance };
        change[0].is_finite().then_some(lap)
    }

    /// Whether there may be a limit cycle: friction weakens with velocity, and inertia limits what grows.
    pub(super) fn is_driven(&self) -> bool {
        self.slider.b > self.slider.a && self.slider.inertia > 0.0
    }

    /// A way on from a state, with a motion of this size.
    fn way(&self, state: State, size: f64, offset: f64, since: f64) -> Way<'a> {
        let tolerance = self.step_error(size);
        let orbit = Orbit::new(self.slider, state, tolerance);
        Way { orbit, offset, since, tolerance, place: None, pace: Pace::default() }
    }

    /// Whether a cycle that begins beside this one comes to it: that one changes little does not show that.
    fn attracts(&mut self, lap: &Lap) -> Result<bool, Stop> {
        let compared_with = self.lap([lap.from[0] + NUDGE, lap.from[1]], lap.tolerance)?;
        Ok((1.0 + (compared_with.change[0] - lap.change[0]) / NUDGE).abs() < MAX_RATIO)
    }

    /// Error of a step in a motion of this size.
    fn step_error(&self, size: f64) -> f64 {
        let felt = exp(ln(ERROR_OF_MOTION * size) / 0.6);
        self.tolerance.min(felt).max(self.finest * size.min(1.0))
    }

    /// Whether a cycle stays in the band of settled velocities, about sliding that is stable, so that it may die out.
    fn may_die_out(&self, lap: &Lap) -> bool {
        self.linear.stable && excess(lap.range) < 0.0 && lap.from[1].abs() < 0.1
    }

    /// Whether it shrinks beyond the errors of its steps, and so do all smaller ones: the change of `ln z` in small cycles is
    /// `growth + c A^2` of the amplitude `A`.
    pub(super) fn dies_out(&self, lap: &Lap) -> bool {
        let shrinks = lap.change[0] < -1e3 * lap.tolerance / lap.size();
        self.may_die_out(lap) && shrinks && self.linear.growth.is_none_or(|growth| growth < 0.0)
    }

    /// The same with the finest steps.
    fn dies_out_exactly(&mut self, lap: &Lap) -> Result<bool, Stop> {
        match self.lap(lap.from, self.finest * lap.size()) {
            Ok(fine) => Ok(self.dies_out(&fine)),
            // Steps that only follow rounding: the next cycle tries coarser ones.
            Err(Stop::Faint) => Ok(false),
            Err(stop) => Err(stop),
        }
    }

    /// Keeps the extrema of a cycle if they are further out than those before.
    fn note(&mut self, way: &mut Way<'_>, extrema: [Option<Seen>; 2]) {
        for (i, sign) in [(0, -1.0), (1, 1.0)] {
            let (Some(seen), kept) = (extrema[i], self.extrema[i]) else { continue };
            if kept.is_some_and(|kept| sign * seen.rough.x <= sign * kept.x - DENSE_OUTPUT_ERROR) {
                continue;
            }
            let extremum = way.orbit.polished(seen);
            if i == 1 && kept.is_none_or(|kept| extremum.x > kept.x - PEAK_TIE * self.rtol) {
                self.vague_peak = kept.is_some_and(|kept| extremum.x < kept.x + PEAK_TIE * self.rtol);
            }
            if kept.is_none_or(|kept| sign * extremum.x > sign * kept.x) {
                self.extrema[i] = Some(Extremum { t: way.offset + extremum.t, ..extremum });
            }
        }
    }

    /// The same for a cycle whose time is not known.
    pub(super) fn note_unseen(&mut self, range: [f64; 2]) {
        for (i, sign) in [(0, -1.0), (1, 1.0)] {
            if self.extrema[i].is_none_or(|kept| sign * range[i] > sign * kept.x + PEAK_TIE * self.rtol) {
                self.extrema[i] = Some(Extremum { x: range[i], t: f64::NAN });
            }
        }
    }
}

/// How fast cycles come to each other.
#[derive(Debug, Clone, Copy)]
struct Pace {
    /// The last change of the section.
    change: f64,
    /// Shares that a change left of the one before, the last two.
    shares: [f64; 2],
    /// The change from which on all have become less.
    first: f64,
    /// The slowest moment, and its change.
    low: f64,
    lower: f64,
    /// Cycles that changed less than a part of `rtol`.
    lingers: u32,
}

impl Default for Pace {
    fn default() -> Pace {
        let unknown = f64::NAN;
        Pace { change: unknown, shares: [unknown; 2], first: unknown, low: unknown, lower: unknown, lingers: 0 }
    }
}

impl Pace {
    /// Takes in the change of the section over a cycle, and its slowest moment. Rises of a change below `rtol` may be
    /// errors of steps.
    fn take(&mut self, change: f64, low: f64, rtol: f64) {
        let share = change / self.change;
        if share < MAX_RATIO {
            self.first = self.first.max(self.change);
        } else if change.is_nan() || change > rtol {
            self.first = f64::NAN;
        }
        (self.change, self.shares) = (change, [share, self.shares[0]]);
        (self.low, self.lower) = (low, (low - self.low).abs());
    }

    /// Whether all changes to come, a geometric series, are less than a part of `rtol`, and so are those of the slowest moment,
    /// which may magnify them. A row of changes from far away shows that they are no errors of steps; where those are all that
    /// is left, the series has no ratio, and changes as small as that have lasted.
    fn has_arrived(&mut self, rtol: f64) -> bool {
        let [share, before] = self.shares;
        let largest = if share < SMALL_RATIO { share } else { share.max(before) };
        let left = largest / (1.0 - largest);
        // False for NaN.
        let comes_from_far = self.change < FALL * self.first;
        let comes = comes_from_far && largest < MAX_RATIO && self.change * left < LIMIT_ERROR * rtol;
        self.lingers += u32::from(comes_from_far && self.change < LIMIT_ERROR * rtol);
        let lower = self.lower * left.max(0.01);
        (comes && (lower < LIMIT_ERROR * rtol || self.low < VANISHING)) || self.lingers > MIN_CYCLES
    }

    /// Whether cycles change little, and the next one will change about as much.
    fn is_slow(&self) -> bool {
        self.change < LEAP_CHANGE && self.shares.iter().all(|share| CONSTANT_RATE.contains(share))
    }
}

impl Cycle {
    /// `ln(v/v_f)` at its slowest and fastest, as they were seen.
    fn range(&self) -> [f64; 2] {
        self.extrema.map(|extremum| extremum.map_or(0.0, |seen| seen.rough.x))
    }

    /// The same to the order of the method.
    fn exact_range(&self, orbit: &mut Orbit<'_>) -> [f64; 2] {
        self.extrema.map(|extremum| extremum.map_or(0.0, |seen| orbit.polished(seen).x))
    }
}

impl Lap {
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
