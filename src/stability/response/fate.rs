//! What becomes of a response in the end: rest, a limit cycle, or nothing that could be decided.
//!
//! A cycle maps the section `v = v_f` onto itself. On it the energy is `E = z^2/(2 k)`, so what friction takes over a
//! cycle is the change of `ln z` without a difference of nearly equal numbers, however slow it is. While cycles
//! change fast they are followed one by one; where they change slowly, many are passed over at once (`slide.rs`).

use super::course::{COARSE, Course, Doubts, FINER, Fate, VANISHING};
use super::orbit::{BAND, Cycle, Extremum, Orbit, Seen, Stop};
use super::slide::{Place, Slide};
use super::slider::{Slider, State, Y, Z};
use crate::numerics::elementary::{exp, ln, ln_1p};

/// Small motions about steady sliding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Whether they die out.
    pub stable: bool,
    /// Change of `ln z` over a cycle, if they oscillate.
    pub growth: Option<f64>,
    /// Their period in `l/v_f`, if they oscillate.
    pub period: Option<f64>,
    /// Rate at which they come to oscillate alone, in `v_f/l`: minus the third eigenvalue, or infinite.
    pub relaxation: f64,
}

/// Steps of one response.
pub(super) const MOST_STEPS: u32 = 100_000;

/// A motion this small is still told from the errors of its steps, but not whether it is a limit cycle.
pub(super) const FAINT: f64 = 1e-4;

/// Share of a motion about unstable sliding that the error estimate of a step may be: an estimate as large as the
/// motion would let steps grow until they damp what grows.
const FELT: f64 = 1e-3;

/// A cycle of less than `SMALL` in `ln v` takes the period of small motions, up to a factor of `ALIKE`.
const SMALL: f64 = 0.1;
const ALIKE: f64 = 3.0;

/// Least error of a step that is asked for, relative to the size of the motion.
const FINEST: f64 = 1e-14;

/// A rate this many times larger than what the finest steps leave of it has a sign.
pub(super) const LEGIBLE: f64 = 30.0;

/// Swings move the spring's force by less than this share of `a` where a block slides neutrally.
const SOFT: f64 = 1e-3;

/// Cycles over which `ln z` changes by less than this are sampled.
pub(super) const SLOW: f64 = 0.1;

/// On a limit cycle friction gives and takes the same, up to this share of it.
const BALANCED: f64 = 0.01;

/// Cycles that are followed after sampling has led to another place.
const PATIENCE: u32 = 10;

/// Cycles next to a limit cycle that samples have found between them have come to it where they move by less than this in
/// `PATIENCE` of them, in units of `rtol`: what is left are errors of steps, whose shares of each other are chance.
const STILL: f64 = 0.1;

/// How far from a cycle in `ln z` another begins that shows whether it attracts.
const BESIDE: f64 = 0.03;

/// It attracts at once where one cycle leaves less than this share of that.
const AT_ONCE: f64 = 0.1;

/// What errors of steps may leave on the side from which cycles come slowly, in units of `rtol`.
const SLOW_SIDE: f64 = 10.0;

/// Peaks that differ by less than this, in units of `rtol`, are as high as each other.
const ALIKE_PEAKS: f64 = 0.3;

/// Error of a step, in units of the accuracy of the numbers.
pub(super) const STEP: f64 = 0.03;

/// Error of an extremum in the dense output.
const ROUGH: f64 = 1e-2;

/// Follows the response from `e^x v_f` once, with steps whose errors are to leave this `share` of `rtol` of its numbers. The
/// coarsest run takes cycles that hardly change for a limit cycle, which a finer one has to confirm.
pub(super) fn follow_once(slider: &Slider, linear: Linear, x: f64, rtol: f64, share: f64) -> Course {
    let start = linear.start(x);
    let faint = start != x;
    let mut follower = Follower {
        slider,
        linear,
        rtol: share * rtol,
        tolerance: linear.step_error(x, rtol, share),
        trusts: share >= COARSE,
        budget: MOST_STEPS,
        high: None,
        low: None,
        t: 0.0,
        counting: f64::INFINITY,
        vague: false,
        vague_time: false,
        vague_peak: false,
        passed: 0.0,
        miscounted: 0.0,
    };
    let fate = match follower.run(slider.steady(start)) {
        Ok(fate) if linear.allows(slider, &fate, if faint { start.abs() } else { 0.0 }) => fate,
        Ok(_) | Err(_) => Fate::Undecided,
    };
    let Follower { high, low, t, budget, vague, vague_time, vague_peak, .. } = follower;
    let doubts = Doubts { cycle_trough: vague, settling_time: vague_time, t_peak: vague_peak, ..Doubts::default() };
    let [low, high] =
        [low, high].map(|seen| seen.map(|seen: Extremum| if faint { Extremum { t: f64::NAN, ..seen } } else { seen }));
    Course { fate, high, low, t, steps: MOST_STEPS - budget, doubts }
}

/// Error of a step that tells a motion of this size about unstable sliding: its estimate is allowed to be the power
/// 6/10 of it.
fn telling(size: f64) -> f64 {
    exp(ln(FELT * size) / 0.6).max(finest(size))
}

/// Least error of a step that a motion of this size is asked for.
pub(super) fn finest(size: f64) -> f64 {
    FINEST * size.min(1.0)
}

impl Linear {
    /// Whether a light block on a soft spring slides so nearly neutrally, for `b` next to `a`, that the finest steps cannot
    /// tell swings that die out from those that grow.
    ///
    /// On the way of `ln v` by 1 the spring's force changes by `k/omega`, and a step's error in it is a share of
    /// [`Slider::force`].
    pub(super) fn is_neutral(&self, slider: &Slider) -> bool {
        let (Some(growth), Some(period)) = (self.growth, self.period) else { return false };
        let swing = slider.k * period / (2.0 * std::f64::consts::PI);
        swing < SOFT * slider.a && growth.abs() * swing < LEGIBLE * FINEST * slider.force()
    }

    /// Where the response from `e^x v_f` is followed from.
    fn start(&self, x: f64) -> f64 {
        if !self.stable && x.abs() < FAINT { self.moved_out(x) } else { x }
    }

    /// Error of a step of the run that is to leave a `share` of `rtol`: of the first two it always differs.
    pub(super) fn step_error(&self, x: f64, rtol: f64, share: f64) -> f64 {
        let size = self.start(x).abs();
        let told = if self.stable { f64::INFINITY } else { telling(size) * share / COARSE };
        (STEP * share * rtol).min(told).max(finest(size) * (share / (COARSE * FINER)).max(1.0))
    }

    /// A start closer than `FAINT`, moved out to where it grows, by whole cycles if they are short enough.
    fn moved_out(&self, x: f64) -> f64 {
        let whole = self.growth.map(|growth| growth * (ln(FAINT / x.abs()) / growth).ceil());
        let size = whole.map(|whole| x.abs() * exp(whole)).filter(|size| (FAINT..10.0 * FAINT).contains(size));
        size.unwrap_or(FAINT).copysign(x)
    }

    /// Whether an end that was found is no artefact: a limit cycle is driven by friction that weakens with velocity, is
    /// larger than the errors of its steps, encloses a start that was moved out to the distance `moved`, and if it is
    /// small has the period of small motions.
    fn allows(&self, slider: &Slider, fate: &Fate, moved: f64) -> bool {
        let &Fate::Cycle { period, high, low } = fate else { return true };
        let alike = self.period.is_none_or(|linear| period > linear / ALIKE && period < linear * ALIKE);
        let driven = slider.b > slider.a && slider.inertia > 0.0;
        driven && period > 0.0 && high - low > FAINT.max(4.0 * moved) && (alike || high - low > SMALL)
    }
}

pub(super) struct Follower<'a> {
    pub(super) slider: &'a Slider,
    pub(super) linear: Linear,
    pub(super) rtol: f64,
    pub(super) tolerance: f64,
    /// Whether what hardly changes is a limit cycle without being asked.
    trusts: bool,
    pub(super) budget: u32,
    high: Option<Extremum>,
    low: Option<Extremum>,
    t: f64,
    /// Relative error of rates with which cycles can be counted.
    pub(super) counting: f64,
    /// Whether the least velocity still changes on the limit cycle.
    vague: bool,
    /// Whether the number of cycles that were passed over is not known.
    pub(super) vague_time: bool,
    /// Whether another moment was as fast as the fastest.
    vague_peak: bool,
    /// Cycles that were passed over, and by how many this number may be off.
    pub(super) passed: f64,
    pub(super) miscounted: f64,
}

impl Follower<'_> {
    fn run(&mut self, start: State) -> Result<Fate, Stop> {
        let slider = self.slider;
        let mut orbit = Orbit::new(slider, start, self.tolerance);
        // Time before this orbit began.
        let mut offset = 0.0;
        // Since when this orbit has been settled, if it began so.
        let mut since = 0.0;
        let mut before: Option<Place> = None;
        let mut last_rate = f64::NAN;
        let mut contraction = Contraction::after(f64::NAN);
        // Cycles so far, and after how many sampling may be tried again.
        let (mut count, mut again) = (0, 0);
        // After how many it may be asked again whether they come to a limit cycle.
        let mut asked = 0;
        let (mut last_low, mut lingers) = (f64::NAN, 0);
        // Whether cycles have come so near to each other that what is left are errors of steps.
        let mut arrived = false;
        // Where samples have found a limit cycle, and at which cycle.
        let mut found: Option<(Place, u32)> = None;
        // Whether this is the response itself, not another way to the same end.
        let mut real = true;
        loop {
            let cycle = orbit.cycle(self.linear.stable, &mut self.budget);
            // Another way to the same end begins anew.
            self.t = self.t.max(offset + orbit.t());
            let cycle = match cycle {
                Ok(cycle) => cycle,
                Err(stop) => {
                    let extrema = orbit.extrema();
                    if real {
                        self.note(offset, &mut orbit, extrema);
                    }
                    return match (stop, orbit.settled_at()) {
                        (Stop::Quiet, Some(time)) => Ok(Fate::Settled { time: latest(since, offset, time) }),
                        _ => Err(stop),
                    };
                }
            };
            if real {
                self.note(offset, &mut orbit, cycle.extrema);
            }
            let place = Place { z: cycle.end[Z], y: cycle.end[Y] };
            let Some(last) = before.replace(place) else { continue };
            let rate = self.rate(&cycle, last.z);
            let [low, high] = cycle.range();
            let doubt = gross(&cycle, last.z, slider) / (high - low).min(1.0) * self.tolerance;
            if self.dies_out(rate, doubt, low, high)
                && place.y.abs() < 0.1
                && let Some(time) = orbit.settled_at()
            {
                return Ok(Fate::Settled { time: latest(since, offset, time) });
            }
            count += 1;
            // Both coordinates of the section: relative to its size, or to what moves ln v by 1.
            let distance =
                |from: Place| ((place.z - from.z) / place.z.max(slider.force())).abs().max((place.y - from.y).abs());
            let change = distance(last);
            // Down to where rounding and the errors of steps stop it.
            let left = contraction.left;
            contraction.take(change, self.tolerance);
            // A motion that has become smaller is to be told from the errors of its steps as well.
            let enough = telling(high - low);
            if !self.linear.stable && enough < 0.3 * self.tolerance {
                self.tolerance = (0.1 * enough).max(finest(high - low));
                offset += cycle.t;
                orbit = Orbit::new(slider, [place.z, place.y, 0.0], self.tolerance);
                (last_rate, contraction) = (f64::NAN, Contraction::after(f64::NAN));
                continue;
            }
            let still = found.is_some_and(|(from, since)| {
                count >= since + PATIENCE && distance(from) < STILL * self.rtol && change < STILL * self.rtol
            });
            arrived &= change < self.rtol;
            let near =
                contraction.left < 0.03 * self.rtol || (left < self.rtol && contraction.row == 0) || still || arrived;
            let lower = (low - last_low).abs();
            last_low = low;
            // Small cycles may only have stopped to change fast.
            let ends =
                near && place.z > 0.0 && high - low > SMALL && rate.abs() < BALANCED * gross(&cycle, last.z, slider);
            // Changes that are errors of steps do not show that cycles change slowly.
            let mut creeps = false;
            if ends && !arrived && !still && count >= asked {
                asked = 2 * count;
                arrived = self.trusts || self.attracts(last, place, change, !real)?;
                creeps = !arrived;
            }
            if ends && (arrived || still) {
                // Friction may magnify what the section does not show.
                let [low, high] = cycle.exact_range(&mut orbit);
                let vague = lower > 0.1 * self.rtol && low > VANISHING;
                if !vague || lingers == PATIENCE {
                    self.vague = vague;
                    return Ok(Fate::Cycle { period: cycle.period, high, low });
                }
                lingers += 1;
                last_rate = rate;
                continue;
            }
            let slow = rate.abs() < SLOW && (contraction.is_slow() || creeps);
            if slow && place.z > 0.0 && count >= again {
                let bend = if creeps { 0.0 } else { (rate - last_rate) / last_rate };
                match self.slide(place, bend) {
                    Ok(Slide::Decided(Fate::Settled { time })) => {
                        let inside = orbit.settled_at().filter(|_| time == 0.0);
                        let time = inside.map_or(offset + cycle.t + time, |time| latest(since, offset, time));
                        return Ok(Fate::Settled { time });
                    }
                    Ok(Slide::Decided(fate)) => return Ok(fate),
                    Ok(Slide::Fast { place, time }) => {
                        let stays = excess(low, high) < 0.0 && rate < 0.0;
                        let inside = orbit.settled_at().filter(|_| stays);
                        since = inside.map_or(offset + cycle.t + time, |time| latest(since, offset, time));
                        offset += cycle.t + time;
                        orbit = Orbit::new(slider, [place.z, place.y, 0.0], self.tolerance);
                        before = Some(place);
                        (last_rate, contraction) = (f64::NAN, Contraction::after(f64::NAN));
                        continue;
                    }
                    // Errors of steps drive cycles off again.
                    Ok(Slide::Near { place, enclosed: true, .. })
                        if found.is_some_and(|(from, _)| ln(place.z / from.z).abs() < self.rtol)
                            && change < self.rtol =>
                    {
                        let [low, high] = cycle.exact_range(&mut orbit);
                        self.vague = true;
                        return Ok(Fate::Cycle { period: cycle.period, high, low });
                    }
                    Ok(Slide::Near { place, change, enclosed }) => {
                        real = false;
                        found = enclosed.then_some((place, count));
                        orbit = Orbit::new(slider, [place.z, place.y, 0.0], self.tolerance);
                        before = Some(place);
                        (last_rate, contraction) = (f64::NAN, Contraction::after(change));
                        again = count + PATIENCE;
                        continue;
                    }
                    Ok(Slide::Coupled) | Err(Stop::Unrelaxed) => again = 2 * count,
                    Err(stop) => return Err(stop),
                }
            }
            last_rate = rate;
        }
    }

    /// Whether cycles that begin beside the last one, which went from one place to another, come to it so fast that all its
    /// changes to come, `change` having been the last, add up to less than `rtol`.
    ///
    /// That a cycle changes little does not tell: friction may only give and take almost the same, as it does next to the
    /// critical stiffness, or be little beside inertia.
    fn attracts(&mut self, from: Place, to: Place, change: f64, sampled: bool) -> Result<bool, Stop> {
        let gap = |place: Place, beside: Place| ln(beside.z / place.z).abs().max((beside.y - place.y).abs());
        // What samples led to may be approached fast from one side and slowly from the other.
        let sides = if sampled { [BESIDE, -BESIDE].as_slice() } else { &[BESIDE] };
        for &side in sides {
            let mut beside = self.next(Place { z: from.z * exp(side), ..from })?;
            let first = gap(to, beside);
            let mut share = first / BESIDE;
            if share > AT_ONCE {
                // The first cycle was for the contact lifetime to follow.
                beside = self.next(beside)?;
                share = gap(self.next(to)?, beside) / first;
            }
            let told = 1.0 - share > 10.0 * self.tolerance / BESIDE;
            let enough = if side > 0.0 { self.rtol } else { SLOW_SIDE * self.rtol };
            if !(told && change * share < enough * (1.0 - share)) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Where the cycle ends that begins at a place.
    fn next(&mut self, Place { z, y }: Place) -> Result<Place, Stop> {
        let end = Orbit::new(self.slider, [z, y, 0.0], self.tolerance).cycle(false, &mut self.budget)?.end;
        Ok(Place { z: end[Z], y: end[Y] })
    }

    /// Change of `ln z` over a cycle that began at `z`.
    pub(super) fn rate(&self, cycle: &Cycle, z: f64) -> f64 {
        let energy = 0.5 * z * z / self.slider.k;
        0.5 * ln_1p((-cycle.loss[0] / energy).max(-1.0 + 1e-12))
    }

    /// Whether cycles of these extrema stay in the band of settled velocities, and shrink from here down to rest; the
    /// rate is known up to `doubt`.
    ///
    /// For small cycles the rate is `growth + c z^2`, up to a share of the second term of about the square of the
    /// extrema.
    pub(super) fn dies_out(&self, rate: f64, doubt: f64, low: f64, high: f64) -> bool {
        // Without small oscillations, cycles cannot die out slowly.
        let growth = self.linear.growth.unwrap_or(-1.0);
        let rest = 10.0 * high.max(-low) * high.max(-low) * (rate - growth).abs();
        self.linear.stable && excess(low, high) < 0.0 && rate < -2.0 * (rest + doubt) && growth < -2.0 * rest
    }

    /// Keeps the extrema of a cycle if they are further out than those before.
    fn note(&mut self, offset: f64, orbit: &mut Orbit<'_>, extrema: [Option<Seen>; 2]) {
        let kept = [&mut self.low, &mut self.high];
        for ((seen, kept), sign) in extrema.into_iter().zip(kept).zip([-1.0, 1.0]) {
            let Some(seen) = seen else { continue };
            if kept.is_none_or(|kept| sign * seen.rough.x > sign * kept.x - ROUGH) {
                let extremum = orbit.polished(seen);
                if sign > 0.0 && kept.is_none_or(|kept| extremum.x > kept.x - ALIKE_PEAKS * self.rtol) {
                    self.vague_peak = kept.is_some_and(|kept| extremum.x < kept.x + ALIKE_PEAKS * self.rtol);
                }
                if kept.is_none_or(|kept| sign * extremum.x > sign * kept.x) {
                    *kept = Some(Extremum { t: offset + extremum.t, ..extremum });
                }
            }
        }
    }
}

/// How cycles come closer to each other.
#[derive(Debug, Clone, Copy)]
struct Contraction {
    /// The last change of the section.
    change: f64,
    /// What was left of a change by the next one, the last two times.
    shares: [f64; 2],
    /// Changes in a row that were smaller than the one before.
    row: u32,
    /// Estimate of all changes to come.
    left: f64,
}

impl Contraction {
    /// After a change, or NaN.
    fn after(change: f64) -> Contraction {
        Contraction { change, shares: [f64::NAN; 2], row: 0, left: f64::INFINITY }
    }

    /// Takes in the next change, with the error of a step.
    fn take(&mut self, change: f64, tolerance: f64) {
        let share = change / self.change;
        let contracts = share < 0.999;
        if !contracts {
            *self = Contraction { shares: [share, self.shares[0]], ..Contraction::after(change) };
            return;
        }
        let largest = share.max(self.shares[0]);
        // The slower, the longer it must go on to be told from chance.
        let enough = match largest {
            _ if share < 0.01 && change < 100.0 * tolerance && self.change > 1e3 * tolerance => 1,
            largest if largest < 0.5 => 2,
            _ => 8,
        };
        self.row += 1;
        if self.row >= enough {
            self.left = self.left.min(change * largest / (1.0 - largest));
        }
        (self.change, self.shares) = (change, [share, self.shares[0]]);
    }

    /// Whether changes stay about the same.
    fn is_slow(&self) -> bool {
        self.shares.iter().all(|share| (0.5..2.0).contains(share))
    }
}

impl Cycle {
    /// `ln(v/v_f)` at its slowest and fastest, as they were seen.
    pub(super) fn range(&self) -> [f64; 2] {
        self.extrema.map(|extremum| extremum.map_or(0.0, |seen| seen.rough.x))
    }

    /// The same to the order of the method.
    pub(super) fn exact_range(&self, orbit: &mut Orbit<'_>) -> [f64; 2] {
        self.extrema.map(|extremum| extremum.map_or(0.0, |seen| orbit.polished(seen).x))
    }
}

/// When a response settled: at `time` of an orbit that began at `offset`, or at `since` if that is at its start.
fn latest(since: f64, offset: f64, time: f64) -> f64 {
    if time == 0.0 { since } else { offset + time }
}

/// What friction gives and takes over a cycle that began at `z`, added up, as a change of `ln z`.
pub(super) fn gross(cycle: &Cycle, z: f64, slider: &Slider) -> f64 {
    cycle.loss[1] * slider.k / (z * z)
}

/// How far a cycle goes beyond the band of settled velocities, relative to it; negative within.
pub(super) fn excess(low: f64, high: f64) -> f64 {
    (high / BAND[1]).max(low / BAND[0]) - 1.0
}
