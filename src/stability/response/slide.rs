//! Many slow cycles at once, by samples of the map of the section.
//!
//! Where cycles change slowly, and slower than the contact lifetime relaxes, the map is one of `ln z` alone: its fixed
//! points, and the number of cycles between two values of `z`, follow from samples of it.

use std::ops::AddAssign;

use super::course::Fate;
use super::fate::{FAINT, Follower, LEGIBLE, SLOW, excess, finest, gross};
use super::orbit::{Orbit, Stop};
use super::slider::{Slider, Y, Z};
use crate::numerics::elementary::{exp, ln, ln_1p};
use crate::numerics::gauss;

/// Error that the finest steps may make in the extrema of a limit cycle, in `ln v`, whatever is asked for.
const RESOLVED: f64 = 2e-7;

/// To what the place of a limit cycle, or of a cycle that touches the band of settled velocities, is found in `ln z`, in
/// units of `rtol`.
const RESOLUTION: f64 = 0.03;

/// A block is almost at rest where `ln(v/v_f)` is less.
const RESTING: f64 = -2.0;

/// The contact lifetime must relax this many times faster than `z` changes.
const ADIABATIC: f64 = 30.0;

/// Cycles of one sample.
const MOST_RELAXATIONS: u32 = 60;

/// Times that a sample is taken again with a finer tolerance.
const MOST_REFINEMENTS: u32 = 4;

/// Nodes of a panel of the integral over `ln z` for the number of cycles, and the greatest length of a panel.
const NODES: usize = 5;
const PANEL: f64 = 1.2;

/// Part of a cycle up to which a number of cycles must be known to tell when a response has settled.
const COUNTED: f64 = 0.02;

/// Times the work of counting cycles that counting them again more exactly may take.
const RECOUNT: u32 = 5;

/// Errors of rates, in units of those that errors of steps make: samples are off the slow manifold as well.
const CHANCE: f64 = 10.0;

/// Share of what is asked for that a cycle must not be of all cycles, to be counted.
const UNCOUNTED: f64 = 0.1;

/// Times that a panel is halved for that.
const MOST_HALVINGS: u32 = 6;

/// Part of a cycle that a number of cycles may be off by, at least.
const TIE: f64 = 1e-3;

/// An entry into the band that such an error moves by more than this part of a period is not the one where a cycle just touches it.
const JUMP: f64 = 0.1;

/// How far beside a limit cycle in `ln z` the slope of the rate is taken.
const BESIDE: f64 = 0.01;

/// Slope of the rate beside a limit cycle with which cycles come to it by themselves.
const ATTRACTING: f64 = 1e-3;

/// Least share of the slope that was expected with which a limit cycle is found.
const ALIKE: f64 = 0.1;

/// Rounding of the spring's force in a step.
const ROUNDING: f64 = 3.0 * f64::EPSILON;

/// Relative error that a sample's rate may have, in units of `rtol`: the rest is lost where gain and loss cancel.
const RATE_ERROR: f64 = 10.0;

/// A place on the section.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub z: f64,
    pub y: f64,
}

/// A cycle that starts on the slow manifold.
#[derive(Debug, Clone, Copy)]
struct Sample {
    place: Place,
    /// Change of `y` with `ln z` along the slow manifold, relative to `y`.
    slope: f64,
    /// How much further in `ln z` it is than was asked for.
    drift: f64,
    /// Change of `ln z`.
    rate: f64,
    /// Share of its distance from the slow manifold by which the contact lifetime relaxes.
    relaxation: f64,
    period: f64,
    high: f64,
    low: f64,
    /// Error of the rate that an error of a step makes, and the one that rounding makes where the terms of friction cancel.
    noise: f64,
    rounding: f64,
    /// Error of a step that the rate asks for.
    tolerance: f64,
}

impl Sample {
    /// The place on the slow manifold `way` further in `ln z`, if `y` goes on as a power of `z`.
    fn moved(&self, way: f64) -> Place {
        Place { z: self.place.z * exp(way), y: self.place.y * exp(self.slope * way) }
    }
}

/// Where the rate changes its sign.
enum Crossing {
    /// At this sample, whose steps have this error.
    Found { sample: Sample, tolerance: f64 },
    /// About here, up to `change`, but its slope is another one on each side: cycles come to it by themselves.
    Kink { place: Place, change: f64 },
}

/// How sampling ended.
pub(super) enum Slide {
    Decided(Fate),
    /// Cycles change fast again: the response is here, `time` later.
    Fast {
        place: Place,
        time: f64,
    },
    /// Cycles come to a limit cycle near here by themselves; the last one changed `ln z` by `change`. It is `enclosed`
    /// where cycles grow on one side of it and shrink on the other.
    Near {
        place: Place,
        change: f64,
        enclosed: bool,
    },
    /// Contact lifetime and `z` change together.
    Coupled,
}

impl Follower<'_> {
    /// The first cycle from near a place that starts on the slow manifold. Its `z` has changed by the cycles before it.
    ///
    /// Where the contact lifetime relaxes slowly, jumps shorten the way, with the slope of the manifold as it is given.
    fn sample(&mut self, place: Place, slope: f64, tolerance: f64) -> Result<Sample, Stop> {
        let asked = place.z;
        let mut place = place;
        // How far off the slow manifold the place is.
        let mut off = f64::INFINITY;
        for _ in 0..MOST_RELAXATIONS {
            let mut orbit = Orbit::new(self.slider, [place.z, place.y, 0.0], tolerance);
            let cycle = orbit.cycle(false, &mut self.budget)?;
            let rate = self.rate(&cycle, place.z);
            let relaxation = 1.0 - exp(-self.linear.relaxation * cycle.period);
            let [low, high] = cycle.range();
            let size = (high - low).min(1.0);
            if off <= (self.rate_error() * rate.abs() * size).max(3.0 * tolerance) {
                // Errors of a step are absolute in x, so their share is greater in small cycles.
                let noise = gross(&cycle, place.z, self.slider) / size;
                let rounding = f64::EPSILON * cycle.loss[2] * self.slider.k / (place.z * place.z);
                let drift = ln(place.z / asked);
                let [low, high] = cycle.exact_range(&mut orbit);
                let period = cycle.period;
                let sample = Sample {
                    place,
                    slope,
                    drift,
                    rate,
                    relaxation,
                    period,
                    high,
                    low,
                    noise,
                    rounding,
                    tolerance: f64::NAN,
                };
                let tolerance = self.finer(self.rate_error() * rate.abs() / noise, &sample);
                return Ok(Sample { tolerance, ..sample });
            }
            let coupled = relaxation < ADIABATIC * rate.abs() && off < f64::INFINITY;
            let near = ln(cycle.end[Z] / asked).abs() < 1.0;
            if coupled || !near {
                break;
            }
            let left = (cycle.end[Y] - place.y - rate * slope * place.y) / relaxation;
            if relaxation > 0.5 {
                off = off.min(left.abs()) * (1.0 - relaxation);
                place = Place { z: cycle.end[Z], y: cycle.end[Y] };
            } else if left.abs() < 1.0 {
                off = 0.1 * left.abs();
                place.y += left;
            } else {
                break;
            }
        }
        Err(Stop::Unrelaxed)
    }

    /// Goes on by samples from a place where cycles change slowly, the change itself changing by the share `bend` a
    /// cycle.
    pub(super) fn slide(&mut self, place: Place, bend: f64) -> Result<Slide, Stop> {
        let start = self.refined(place, 1.0, self.tolerance)?;
        if start.relaxation < ADIABATIC * start.rate.abs() {
            return Ok(Slide::Coupled);
        }
        let direction = start.rate;
        // To where the rate would vanish if it went on like this, and beyond.
        let mut stride = if bend < 0.0 { 1.5 * (direction / bend).abs() } else { 0.5 };
        let mut here = start;
        loop {
            stride = stride.clamp(1e-6, 0.7);
            let refined = self.refined(here.moved(stride.copysign(direction)), here.slope, here.tolerance);
            // What can be followed by samples up to here need not be followed cycle by cycle.
            if matches!(refined, Err(Stop::Unrelaxed)) && here.place.z != start.place.z {
                return self.whole_cycles(place.z, &start, &here);
            }
            let mut next = refined?;
            let slope = ln(next.place.y / here.place.y) / ln(next.place.z / here.place.z);
            next.slope = if (0.0..=2.0).contains(&slope) { slope } else { 1.0 };
            let gone = ln(next.place.z / here.place.z) / direction.signum();
            if gone < 0.5 * stride && next.drift.abs() > 20.0 * next.rate.abs() {
                // One cycle led here from far away: there is a limit cycle near, and cycles come to it by themselves.
                let (place, change) = (next.place, next.drift.abs());
                return Ok(Slide::Near { place, change, enclosed: false });
            }
            if next.rate * direction <= 0.0 {
                return self.cycle_between(&here, &next);
            }
            if !self.linear.stable && next.high - next.low < FAINT {
                return Err(Stop::Faint);
            }
            if next.relaxation < ADIABATIC * next.rate.abs() {
                let gone = here.place.z != start.place.z;
                return if gone { self.whole_cycles(place.z, &start, &here) } else { Ok(Slide::Coupled) };
            }
            if self.dies_out(next.rate, next.noise * next.tolerance, next.low, next.high) {
                return Ok(Slide::Decided(Fate::Settled { time: self.settling(place.z, &start, &next)? }));
            }
            if next.rate.abs() > 2.0 * SLOW {
                return self.whole_cycles(place.z, &start, &next);
            }
            here = next;
            stride *= 2.0;
        }
    }

    /// On from `z`, near one sample, to near another, by as many whole cycles as fit.
    fn whole_cycles(&mut self, z: f64, near: &Sample, to: &Sample) -> Result<Slide, Stop> {
        let Passage { cycles, time } = self.passage(z, near, to)?;
        let spare = cycles - cycles.floor();
        self.passed += cycles;
        self.miscounted += CHANCE * cycles * (to.noise * to.tolerance / to.rate).abs();
        Ok(Slide::Fast { place: to.moved(-spare * to.rate), time: time - spare * to.period })
    }

    /// Relative error that a sample's rate may have.
    fn rate_error(&self) -> f64 {
        (RATE_ERROR * self.rtol).min(1e-3).min(self.counting)
    }

    /// A tolerance that is no coarser than that of the response.
    fn finer(&self, tolerance: f64, sample: &Sample) -> f64 {
        tolerance.min(self.tolerance).max(self.finest(sample))
    }

    /// Least error of a step that a cycle is asked for: rounding of the spring's force moves `ln v` of a light block.
    fn finest(&self, Sample { place, low, high, .. }: &Sample) -> f64 {
        let Slider { a, inertia, k, .. } = *self.slider;
        finest(high - low).max(ROUNDING * place.z / a.max((k * inertia).sqrt()))
    }

    /// A sample as exact as its rate asks for.
    fn refined(&mut self, place: Place, slope: f64, tolerance: f64) -> Result<Sample, Stop> {
        let mut sample = self.sample(place, slope, tolerance)?;
        let mut tolerance = tolerance;
        // The less the rate is found to be, the more exact it must be.
        for _ in 0..MOST_REFINEMENTS {
            if sample.tolerance >= 0.5 * tolerance {
                break;
            }
            tolerance = sample.tolerance;
            sample = self.sample(sample.place, slope, tolerance)?;
        }
        let least = LEGIBLE * (sample.noise * self.finest(&sample)).max(sample.rounding);
        if sample.rate.abs() < least { Err(Stop::Faint) } else { Ok(sample) }
    }

    /// The limit cycle between two samples whose rates differ in sign.
    fn cycle_between(&mut self, from: &Sample, to: &Sample) -> Result<Slide, Stop> {
        let (sample, tolerance) = match self.crossing([*from, *to])? {
            Crossing::Found { sample, tolerance } => (sample, tolerance),
            Crossing::Kink { place, change } => return Ok(Slide::Near { place, change, enclosed: false }),
        };
        // A block that is almost at rest once in a swing hardly shows it on the section.
        if sample.low < RESTING {
            let beside = self.sample(sample.moved(RESOLUTION * self.rtol), sample.slope, tolerance)?;
            if (beside.low - sample.low).abs() > self.rtol {
                let change = RESOLUTION * self.rtol;
                return Ok(Slide::Near { place: sample.place, change, enclosed: true });
            }
        }
        Ok(Slide::Decided(Fate::Cycle { period: sample.period, high: sample.high, low: sample.low }))
    }

    /// Where between two samples the rate changes its sign.
    ///
    /// They are as exact as the slope of the rate asks for, which beside a limit cycle may be far less than between two distant
    /// samples.
    fn crossing(&mut self, mut bracket: [Sample; 2]) -> Result<Crossing, Stop> {
        let direction = bracket[0].rate.signum();
        for _ in 0..MOST_REFINEMENTS {
            let [from, to] = bracket;
            let way = ln(to.place.z / from.place.z);
            let slope = ((to.rate - from.rate) / way).abs();
            let noise = from.noise.max(to.noise);
            let tolerance = self.finer(RESOLUTION * self.rtol * slope / noise, &from);
            let sample = self.find(bracket, tolerance, |sample| sample.rate)?;
            let room = ln(sample.place.z / from.place.z).abs().min(ln(to.place.z / sample.place.z).abs());
            let step = (0.5 * room).min(BESIDE).copysign(way);
            let before = self.sample(sample.moved(-step), sample.slope, tolerance)?;
            let distance = ln(sample.place.z / before.place.z).abs();
            let steepness = (before.rate - sample.rate) * direction / distance;
            let found = sample.rate.abs() <= self.rtol.max(RESOLVED) * steepness;
            if found && steepness >= ALIKE * slope {
                let error = (noise * self.finest(&sample)).max(sample.rounding);
                let uncertain = error / steepness * (sample.high - sample.low);
                let enough = uncertain <= RESOLVED.max(0.2 * self.rtol);
                return if enough { Ok(Crossing::Found { sample, tolerance }) } else { Err(Stop::Faint) };
            }
            if sample.low < RESTING {
                let after = self.sample(sample.moved(step), sample.slope, tolerance)?;
                let beyond = (sample.rate - after.rate) * direction / ln(after.place.z / sample.place.z).abs();
                if steepness.max(beyond) > ATTRACTING {
                    return Ok(Crossing::Kink { place: sample.place, change: step.abs() });
                }
            }
            let before = self.refined(before.place, before.slope, before.tolerance)?;
            let after = self.refined(sample.moved(step), sample.slope, before.tolerance)?;
            bracket = match [before.rate * direction > 0.0, after.rate * direction < 0.0] {
                [true, true] => [before, after],
                [true, false] => [after, to],
                [false, _] => [from, before],
            };
        }
        Err(Stop::Faint)
    }

    /// The sample between two others at which `f` vanishes, which differs in sign at them: the Illinois method, with
    /// the places where samples turn out to be.
    fn find(
        &mut self,
        [mut far, mut near]: [Sample; 2],
        tolerance: f64,
        f: impl Fn(&Sample) -> f64,
    ) -> Result<Sample, Stop> {
        let resolution = RESOLUTION * self.rtol;
        let [mut f_far, mut f_near] = [f(&far), f(&near)];
        for _ in 0..MOST_RELAXATIONS {
            let way = ln(near.place.z / far.place.z);
            let step = -way * f_near / (f_near - f_far);
            if step.abs() <= resolution || !step.is_finite() {
                break;
            }
            let next = self.sample(near.moved(step - near.drift), near.slope, tolerance)?;
            let f_next = f(&next);
            if (f_next > 0.0) == (f_near > 0.0) {
                f_far *= 0.5;
            } else {
                (far, f_far) = (near, f_near);
            }
            (near, f_near) = (next, f_next);
        }
        Ok(near)
    }

    /// Time from `z` on until the velocity stays in the band of settled velocities, as it does in the cycle `inside`;
    /// `start` is a sample near `z`.
    fn settling(&mut self, z: f64, start: &Sample, inside: &Sample) -> Result<f64, Stop> {
        // About linear in ln z.
        let beyond = |sample: &Sample| ln_1p(excess(sample.low, sample.high));
        if beyond(start) <= 0.0 {
            return Ok(0.0);
        }
        let mut touching = self.find([*start, *inside], inside.tolerance, beyond)?;
        let (miscounted, vague) = (self.miscounted, self.vague_time);
        let budget = self.budget;
        let mut passage = self.passage(z, start, &touching)?;
        // Whether a single cycle is felt, and so whether they have to be counted.
        let felt = (self.passed + passage.cycles) * UNCOUNTED * self.rtol < 1.0;
        let needed = COUNTED / (CHANCE * passage.cycles);
        let recounts = felt && needed < self.rate_error();
        let affordable = self.budget > RECOUNT * (budget - self.budget);
        self.vague_time |= recounts && !affordable;
        if recounts && affordable {
            (self.counting, self.miscounted, self.vague_time) = (needed, miscounted, vague);
            let [start, inside] =
                [start, inside].map(|sample| self.refined(sample.place, sample.slope, sample.tolerance));
            let (start, inside) = (start?, inside?);
            touching = self.find([start, inside], inside.tolerance, beyond)?;
            passage = self.passage(z, &start, &touching)?;
        }
        let Passage { cycles, time } = passage;
        let miscounted = self.miscounted;
        let uncertain = CHANCE * cycles * (touching.noise * touching.tolerance / touching.rate).abs();
        // The last cycle that leaves the band begins a part of a cycle before the one that would touch it.
        let spare = cycles - cycles.floor();
        let mut settled = |way: f64| {
            let Place { z, y } = touching.moved(-(spare + way) * touching.rate);
            let mut orbit = Orbit::new(self.slider, [z, y, 0.0], touching.tolerance);
            orbit.cycle(false, &mut self.budget)?;
            Ok(time - spare * touching.period + orbit.settled_at().unwrap_or(touching.period))
        };
        let found = settled(0.0)?;
        if felt {
            // Whether a cycle that just touches the band leaves it, on either side, may not be known.
            let off = (miscounted + uncertain).max(TIE);
            let mut jumps = spare.min(1.0 - spare) < off;
            for way in [-off, off] {
                jumps = jumps || (settled(way)? - found).abs() > JUMP * touching.period;
            }
            self.vague_time |= jumps;
        }
        Ok(found)
    }

    /// Cycles and time from `z`, near one sample, to another: a sum over cycles as an integral over `ln z`.
    fn passage(&mut self, z: f64, near: &Sample, to: &Sample) -> Result<Passage, Stop> {
        let length = ln(to.place.z / z);
        let panels = (length.abs() / PANEL).ceil();
        let mut last = *near;
        let mut sum = Passage::default();
        for panel in 0..panels as u32 {
            let [from, to] = [0.0, 1.0].map(|end| (f64::from(panel) + end) * length / panels);
            let whole = self.panel(z, from, to, &mut last)?;
            // Only what settles is told when.
            sum += if self.linear.stable { self.halved(z, from, to, whole, MOST_HALVINGS, &mut last)? } else { whole };
        }
        Ok(sum)
    }

    /// A panel by halves, and these by halves, until the number of cycles is known to a small part of one.
    fn halved(
        &mut self,
        z: f64,
        from: f64,
        to: f64,
        whole: Passage,
        depth: u32,
        last: &mut Sample,
    ) -> Result<Passage, Stop> {
        let middle = 0.5 * (from + to);
        let first = self.panel(z, from, middle, last)?;
        let second = self.panel(z, middle, to, last)?;
        let mut sum = first;
        sum += second;
        let change = (sum.cycles - whole.cycles).abs();
        // Where cycles are so many that one of them is not felt, they need not be counted.
        let enough = COUNTED.max(UNCOUNTED * self.rtol * sum.cycles.abs());
        if change <= enough || depth == 0 {
            self.vague_time |= change > enough;
            self.miscounted += change;
            return Ok(sum);
        }
        let mut sum = self.halved(z, from, middle, first, depth - 1, last)?;
        sum += self.halved(z, middle, to, second, depth - 1, last)?;
        Ok(sum)
    }

    /// Cycles and time between two places beyond `z` in `ln z`; `last` is the last sample that was taken.
    fn panel(&mut self, z: f64, from: f64, to: f64, last: &mut Sample) -> Result<Passage, Stop> {
        let rule = gauss::rule(NODES);
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let mut samples = [*last; NODES];
        for (sample, x) in samples.iter_mut().zip(&rule.x) {
            // So that the node is in the middle of the way of the cycle.
            let way = ln(z / last.place.z) + middle + half * x - last.drift - 0.5 * last.rate;
            *last = self.sample(last.moved(way), last.slope, last.tolerance)?;
            *sample = *last;
        }
        // A cycle stands for the middle of the way that it goes.
        let places = samples.map(|sample| (ln(sample.place.z / z) + 0.5 * sample.rate - middle) / half);
        let mut sum = Passage::default();
        for (&x, w) in rule.x.iter().zip(&rule.w) {
            for (i, sample) in samples.iter().enumerate() {
                let share = half * w * lagrange(&places, i, x) / sample.rate;
                sum += Passage { cycles: share, time: share * sample.period };
            }
        }
        Ok(sum)
    }
}

/// Cycles that are passed over by samples, and their time.
#[derive(Debug, Clone, Copy, Default)]
struct Passage {
    cycles: f64,
    time: f64,
}

impl AddAssign for Passage {
    fn add_assign(&mut self, other: Passage) {
        self.cycles += other.cycles;
        self.time += other.time;
    }
}

/// The polynomial that is 1 at node `i` and 0 at the others, at `x`.
fn lagrange(nodes: &[f64; NODES], i: usize, x: f64) -> f64 {
    (0..NODES).filter(|&j| j != i).map(|j| (x - nodes[j]) / (nodes[i] - nodes[j])).product()
}
