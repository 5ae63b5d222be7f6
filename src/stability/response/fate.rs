//! The end of a response: steady sliding, a limit cycle, or nothing that could be decided.
//!
//! Cycles are followed one by one while they change fast; where they change slowly, `envelope.rs` leaps over many.

use super::course::{Course, Doubts, Fate, VANISHING};
use super::envelope::{FINEST, SMALLEST, Fixed, Lap, Leapt, distance, size};
use super::orbit::{BAND, Cycle, Extremum, Orbit, Seen, Stop};
use super::slider::{Place, Slider, State, X};
use crate::numerics::elementary::{exp, ln};

/// Small motions about steady sliding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Whether they die out.
    pub stable: bool,
    /// Change of `ln z` over a cycle, if they oscillate.
    pub growth: Option<f64>,
}

/// Steps of one run.
pub(super) const MOST_STEPS: u32 = 100_000;

/// Error of a step in units of the accuracy of the numbers: as many steps as this is small may add up.
const STEP: f64 = 0.03;

/// Error of an extremum in the dense output.
const ROUGH: f64 = 1e-2;

/// Share of a motion that the error estimate of a step may be: an estimate as large as the motion would let steps grow
/// until they damp what grows.
const FELT: f64 = 1e-3;

/// Change of a cycle below which it is worth the laps of a leap.
const SLOW: f64 = 0.03;

/// What a cycle leaves of the change of the one before if cycles come to a limit cycle fast.
const FAST: f64 = 0.95;
const AT_ONCE: f64 = 0.02;

/// What it leaves if they change at about the same rate.
const STEADY: std::ops::Range<f64> = 0.5..2.0;

/// Cycles that are followed before the next try to leap, and after a limit cycle is found.
const PATIENCE: u32 = 10;

/// Share of `rtol` by which a limit cycle may still be missed.
const ARRIVED: f64 = 0.03;

/// Peaks that differ by less than this, in units of `rtol`, are as high as each other.
const ALIKE_PEAKS: f64 = 0.3;

/// Follows the response from `e^x v_f` once, with steps whose errors are to leave this `share` of `rtol` of its numbers.
pub(super) fn follow_once(slider: &Slider, linear: Linear, x: f64, rtol: f64, share: f64) -> Course {
    let mut follower = Follower {
        slider,
        linear,
        asked: rtol,
        rtol: share * rtol,
        tolerance: step_error(rtol, share),
        finest: FINEST * (share / 0.3).max(1.0),
        budget: MOST_STEPS,
        extrema: [None; 2],
        vague_peak: false,
        t: 0.0,
    };
    let fate = follower.run(slider.steady(x)).unwrap_or(Fate::Undecided);
    let Follower { extrema: [low, high], t, budget, vague_peak, .. } = follower;
    let doubts = Doubts { t_peak: vague_peak, ..Doubts::default() };
    Course { fate, high, low, t, steps: MOST_STEPS - budget, doubts }
}

/// Error of a step that leaves this share of `rtol`; those of the first two runs always differ.
pub(super) fn step_error(rtol: f64, share: f64) -> f64 {
    (STEP * share * rtol).max(FINEST * (share / 0.3).max(1.0))
}

pub(super) struct Follower<'a> {
    pub slider: &'a Slider,
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
}

impl Way<'_> {
    /// When it settled; `None` outside the band.
    fn settled_at(&mut self) -> Option<f64> {
        let time = self.orbit.settled_at()?;
        Some(if time == 0.0 { self.since } else { self.offset + time })
    }
}

impl<'a> Follower<'a> {
    fn run(&mut self, start: State) -> Result<Fate, Stop> {
        let tolerance = self.step_error(start[X].abs());
        let mut way =
            Way { orbit: Orbit::new(self.slider, start, tolerance), offset: 0.0, since: 0.0, tolerance };
        let mut before: Option<Place> = None;
        let mut pace = Pace::default();
        let (mut count, mut again) = (0, 0);
        loop {
            // Follow one cycle.
            let cycle = way.orbit.cycle(self.linear.stable, &mut self.budget);
            self.t = way.offset + way.orbit.t();
            let Ok(cycle) = cycle else {
                let extrema = way.orbit.extrema();
                self.note(&mut way, extrema);
                let stop = cycle.expect_err("is none");
                let settled = if stop == Stop::Quiet { way.settled_at() } else { None };
                return settled.map(|time| Fate::Settled { time }).ok_or(stop);
            };
            self.note(&mut way, cycle.extrema);
            let place = self.slider.place(&cycle.end);
            let Some(last) = before.replace(place).filter(|last| (place[0] - last[0]).is_finite()) else { continue };
            let range = cycle.range();
            let size = size(range);
            let change = [place[0] - last[0], place[1] - last[1]];
            count += 1;
            pace.take(distance(change, size));

            // Steady sliding?
            let lap = Lap { from: last, change, period: cycle.period, range, tolerance: way.tolerance };
            if self.dies_out(&lap) || (self.may_die_out(&lap) && self.dies_out_exactly(&lap)?) {
                if let Some(time) = way.settled_at() {
                    return Ok(Fate::Settled { time });
                }
            }
            // A limit cycle?
            pace.take_low(range[0]);
            if pace.left < ARRIVED * self.asked && size > SMALLEST && !self.may_die_out(&lap) && pace.has_arrived(self.asked) {
                let [low, high] = cycle.exact_range(&mut way.orbit);
                return Ok(Fate::Cycle { period: cycle.period, high, low });
            }
            // Leap over cycles that hardly change.
            if (pace.is_slow() || pace.change < self.rtol) && count >= again {
                again = 2 * count + PATIENCE;
                match self.leap_on(place, range, pace.change) {
                    Err(Stop::Faint) => {}
                    Err(stop) => return Err(stop),
                    Ok(leapt) => match leapt {
                    Leapt::Cycle(Fixed { lap, .. }) => return Ok(lap.limit()),
                    Leapt::At { place, time } if time > 0.0 => {
                        let stays = excess(range) < 0.0;
                        let since = if stays { way.settled_at().unwrap_or(f64::NAN) } else { f64::NAN };
                        let offset = way.offset + cycle.t + time;
                        way = self.restart(place, size, offset, since);
                        (before, pace) = (Some(place), Pace::default());
                        continue;
                    }
                    Leapt::At { .. } | Leapt::Nowhere => {}
}
                }
            }
            // Steps as fine as the motion asks for.
            let asked = self.step_error(size);
            if !self.linear.stable && asked < 0.1 * way.tolerance || asked > 100.0 * way.tolerance {
                let since = way.settled_at().unwrap_or(f64::NAN);
                way = self.restart(place, size, way.offset + cycle.t, since);
            }
        }
    }

    /// Goes on from a place on the section.
    fn restart(&self, place: Place, size: f64, offset: f64, since: f64) -> Way<'a> {
        let tolerance = self.step_error(size);
        Way { orbit: Orbit::new(self.slider, self.slider.state(place), tolerance), offset, since, tolerance }
    }

    /// Error of a step in a motion of this size.
    fn step_error(&self, size: f64) -> f64 {
        let felt = exp(ln(FELT * size) / 0.6);
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
        let fine = self.lap(lap.from, self.finest * lap.size())?;
        Ok(self.dies_out(&fine))
    }

    /// Keeps the extrema of a cycle if they are further out than those before.
    fn note(&mut self, way: &mut Way<'_>, extrema: [Option<Seen>; 2]) {
        for (i, sign) in [(0, -1.0), (1, 1.0)] {
            let (Some(seen), kept) = (extrema[i], self.extrema[i]) else { continue };
            if kept.is_some_and(|kept| sign * seen.rough.x <= sign * kept.x - ROUGH) {
                continue;
            }
            let extremum = way.orbit.polished(seen);
            if i == 1 && kept.is_none_or(|kept| extremum.x > kept.x - ALIKE_PEAKS * self.rtol) {
                self.vague_peak = kept.is_some_and(|kept| extremum.x < kept.x + ALIKE_PEAKS * self.rtol);
            }
            if kept.is_none_or(|kept| sign * extremum.x > sign * kept.x) {
                self.extrema[i] = Some(Extremum { t: way.offset + extremum.t, ..extremum });
            }
        }
    }

    /// The same for a cycle whose time is not known.
    pub(super) fn note_unseen(&mut self, range: [f64; 2]) {
        for (i, sign) in [(0, -1.0), (1, 1.0)] {
            if self.extrema[i].is_none_or(|kept| sign * range[i] > sign * kept.x + ALIKE_PEAKS * self.rtol) {
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
    /// Estimate of all changes to come: those of a geometric series.
    left: f64,
    /// The slowest moment, and its changes to come.
    low: f64,
    lower: f64,
    lingers: u32,
}

impl Default for Pace {
    fn default() -> Pace {
        Pace { change: f64::NAN, shares: [f64::NAN; 2], left: f64::INFINITY, low: f64::NAN, lower: f64::NAN, lingers: 0 }
    }
}

impl Pace {
    fn take(&mut self, change: f64) {
        let share = change / self.change;
        let largest = if share < AT_ONCE { share } else { self.shares.into_iter().fold(share, f64::max) };
        // False for NaN.
        self.left = if largest < FAST { change * largest / (1.0 - largest) } else { f64::INFINITY };
        (self.change, self.shares) = (change, [share, self.shares[0]]);
    }

    /// Takes in the slowest moment.
    fn take_low(&mut self, low: f64) {
        self.lower = (low - self.low).abs() * self.shares[0].max(0.01);
        self.low = low;
    }

    /// Whether the slowest moment changes no more, which may magnify changes of the section; or errors of steps keep it from that.
    fn has_arrived(&mut self, rtol: f64) -> bool {
        self.lingers += 1;
        self.lower < ARRIVED * rtol || self.low < VANISHING || self.lingers > PATIENCE
    }

    /// Whether cycles change little, and the next one will change about as much.
    fn is_slow(&self) -> bool {
        self.change < SLOW && self.shares.iter().all(|share| STEADY.contains(share))
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
    fn limit(&self) -> Fate {
        let [low, high] = self.range;
        Fate::Cycle { period: self.period, high, low }
    }
}

/// How far a cycle goes beyond the band of settled velocities, relative to it; negative within.
pub(super) fn excess([low, high]: [f64; 2]) -> f64 {
    (high / BAND[1]).max(low / BAND[0]) - 1.0
}
