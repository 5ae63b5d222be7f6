//! What becomes of a response in the end: rest, a limit cycle, or nothing that could be decided.
//!
//! A cycle maps the section `v = v_f` onto itself. On it the energy is `E = z^2/(2 k)`, so what friction takes over a
//! cycle is the change of `ln z` without a difference of nearly equal numbers, however slow it is. While cycles
//! change fast they are followed one by one. Where they change slowly, and slower than the contact lifetime relaxes,
//! the map is one of `ln z` alone: its fixed points, and the number of cycles between two values of `z`, follow from
//! samples of it.

use super::orbit::{BAND, Cycle, Extremum, Orbit, Seen, Stop};
use super::slider::{Slider, State, Y, Z};
use crate::numerics::elementary::{exp, ln, ln_1p};
use crate::numerics::gauss;

/// The end of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fate {
    /// Steady sliding.
    Settled {
        /// Time after which the velocity stays within [`SETTLED`](super::SETTLED), in `l/v_f`.
        time: f64,
    },
    /// A limit cycle.
    Cycle {
        /// Its duration, in `l/v_f`.
        period: f64,
        /// `ln(v/v_f)` at its fastest.
        high: f64,
        /// `ln(v/v_f)` at its slowest.
        low: f64,
    },
    /// None that could be decided with the work allowed.
    Undecided,
    /// The velocity becomes infinite in finite time, which takes a mass of 0 and `k <= b - a`.
    Ends,
}

/// A response that was followed to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// Its end.
    pub fate: Fate,
    /// Its fastest moment since `v = v_f` was first met, if there was one.
    pub high: Option<Extremum>,
    /// Its slowest.
    pub low: Option<Extremum>,
    /// Time up to which it was followed, in `l/v_f`.
    pub t: f64,
    /// Steps taken.
    pub steps: u32,
}

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
const MOST_STEPS: u32 = 100_000;

/// A motion this small is still told from the errors of its steps, but not whether it is a limit cycle.
const FAINT: f64 = 1e-4;

/// Share of a motion about unstable sliding that the error estimate of a step may be: an estimate as large as the
/// motion would let steps grow until they damp what grows.
const FELT: f64 = 1e-3;

/// A cycle of less than `SMALL` in `ln v` takes the period of small motions, up to a factor of `ALIKE`.
const SMALL: f64 = 0.1;
const ALIKE: f64 = 3.0;

/// Least error of a step that is asked for.
const FINEST: f64 = 1e-13;

/// Error that the finest steps may make in the extrema of a limit cycle, in `ln v`, whatever is asked for.
const RESOLVED: f64 = 2e-7;

/// Cycles over which `ln z` changes by less than this are sampled.
const SLOW: f64 = 0.1;

/// The contact lifetime must relax this many times faster than `z` changes.
const ADIABATIC: f64 = 30.0;

/// On a limit cycle friction gives and takes the same, up to this share of it.
const BALANCED: f64 = 0.01;

/// Cycles that are followed after sampling has led to another place.
const PATIENCE: u32 = 10;

/// Error of an extremum in the dense output.
const ROUGH: f64 = 1e-2;

/// Cycles of one sample.
const MOST_RELAXATIONS: u32 = 60;

/// Nodes of a panel of the integral over `ln z` for the number of cycles, and the greatest length of a panel.
const NODES: usize = 5;
const PANEL: f64 = 1.2;

/// Relative error that a sample's rate may have, in units of `rtol`: the rest is lost where gain and loss cancel.
const RATE_ERROR: f64 = 10.0;

/// Follows the response that starts from steady sliding at `e^x v_f`, `x` not 0.
///
/// A start closer than 1e-4 to sliding that is unstable is moved out to there or, by whole cycles, to below 1e-3: what
/// grows from it has the same shape, but comes later, so that the times of its extrema are NaN.
pub fn follow(slider: &Slider, linear: Linear, x: f64, rtol: f64) -> Course {
    let faint = !linear.stable && x.abs() < FAINT;
    let start = if faint { linear.moved_out(x) } else { x };
    let tolerance = (0.03 * rtol).max(FINEST);
    let tolerance = if linear.stable { tolerance } else { tolerance.min(telling(start.abs())) };
    let mut follower = Follower { slider, linear, rtol, tolerance, budget: MOST_STEPS, high: None, low: None, t: 0.0 };
    let fate = match follower.run(slider.steady(start)) {
        Ok(fate) if linear.allows(&fate, if faint { start.abs() } else { 0.0 }) => fate,
        Err(Stop::Ends) if slider.inertia == 0.0 && slider.k <= slider.b - slider.a => Fate::Ends,
        Ok(_) | Err(_) => Fate::Undecided,
    };
    let Follower { high, low, t, budget, .. } = follower;
    let [low, high] =
        [low, high].map(|seen| seen.map(|seen: Extremum| if faint { Extremum { t: f64::NAN, ..seen } } else { seen }));
    Course { fate, high, low, t, steps: MOST_STEPS - budget }
}

/// Error of a step that tells a motion of this size about unstable sliding: its estimate is allowed to be the power
/// 6/10 of it.
fn telling(size: f64) -> f64 {
    exp(ln(FELT * size) / 0.6).max(FINEST)
}

impl Linear {
    /// A start closer than `FAINT`, moved out to where it grows, by whole cycles if they are short enough.
    fn moved_out(&self, x: f64) -> f64 {
        let whole = self.growth.map(|growth| growth * (ln(FAINT / x.abs()) / growth).ceil());
        let size = whole.map(|whole| x.abs() * exp(whole)).filter(|size| (FAINT..10.0 * FAINT).contains(size));
        size.unwrap_or(FAINT).copysign(x)
    }

    /// Whether an end that was found is no artefact: a limit cycle is larger than the errors of its steps, encloses a
    /// start that was moved out to the distance `moved`, and if it is small has the period of small motions.
    fn allows(&self, fate: &Fate, moved: f64) -> bool {
        let &Fate::Cycle { period, high, low } = fate else { return true };
        let alike = self.period.is_none_or(|linear| period > linear / ALIKE && period < linear * ALIKE);
        period > 0.0 && high - low > FAINT.max(4.0 * moved) && (alike || high - low > SMALL)
    }
}

struct Follower<'a> {
    slider: &'a Slider,
    linear: Linear,
    rtol: f64,
    tolerance: f64,
    budget: u32,
    high: Option<Extremum>,
    low: Option<Extremum>,
    t: f64,
}

/// A place on the section.
#[derive(Debug, Clone, Copy)]
struct Place {
    z: f64,
    y: f64,
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
    /// Error of the rate that an error of a step makes.
    noise: f64,
    /// Error of a step that the rate asks for.
    tolerance: f64,
}

impl Sample {
    /// The place on the slow manifold `way` further in `ln z`, if `y` goes on as a power of `z`.
    fn moved(&self, way: f64) -> Place {
        Place { z: self.place.z * exp(way), y: self.place.y * exp(self.slope * way) }
    }
}

/// How sampling ended.
enum Slide {
    Decided(Fate),
    /// Cycles change fast again: the response is here, `time` later.
    Fast {
        place: Place,
        time: f64,
    },
    /// Cycles come to a limit cycle near here by themselves; the last one changed `ln z` by `change`.
    Near {
        place: Place,
        change: f64,
    },
    /// Contact lifetime and `z` change together.
    Coupled,
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
        // Whether this is the response itself, not another way to the same end.
        let mut real = true;
        loop {
            let cycle = orbit.cycle(self.linear.stable, &mut self.budget);
            self.t = offset + orbit.t();
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
            if self.dies_out(rate, low, high)
                && place.y.abs() < 0.1
                && let Some(time) = orbit.settled_at()
            {
                return Ok(Fate::Settled { time: latest(since, offset, time) });
            }
            count += 1;
            // Both coordinates of the section: relative to its size, or to what moves ln v by 1.
            let change = ((place.z - last.z) / place.z.max(slider.force())).abs().max((place.y - last.y).abs());
            // Down to where rounding and the errors of steps stop it.
            let left = contraction.left;
            contraction.take(change, self.tolerance);
            // A motion that has become smaller is to be told from the errors of its steps as well.
            let enough = telling(high - low);
            if !self.linear.stable && enough < 0.3 * self.tolerance {
                self.tolerance = (0.1 * enough).max(FINEST);
                offset += cycle.t;
                orbit = Orbit::new(slider, [place.z, place.y, 0.0], self.tolerance);
                (last_rate, contraction) = (f64::NAN, Contraction::after(f64::NAN));
                continue;
            }
            let near = contraction.left < 0.03 * self.rtol || (left < self.rtol && contraction.row == 0);
            // Small cycles may only have stopped to change fast.
            if near && high - low > SMALL && rate.abs() < BALANCED * gross(&cycle, last.z, slider) {
                let [low, high] = cycle.exact_range(&mut orbit);
                return Ok(Fate::Cycle { period: cycle.period, high, low });
            }
            if rate.abs() < SLOW && contraction.is_slow() && place.z > 0.0 && count >= again {
                match self.slide(place, (rate - last_rate) / last_rate) {
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
                    Ok(Slide::Near { place, change }) => {
                        real = false;
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

    /// Change of `ln z` over a cycle that began at `z`.
    fn rate(&self, cycle: &Cycle, z: f64) -> f64 {
        let energy = 0.5 * z * z / self.slider.k;
        0.5 * ln_1p((-cycle.loss[0] / energy).max(-1.0 + 1e-12))
    }

    /// Whether cycles of these extrema stay in the band of settled velocities, and shrink from here down to rest.
    ///
    /// For small cycles the rate is `growth + c z^2`, up to a share of the second term of about the square of the
    /// extrema.
    fn dies_out(&self, rate: f64, low: f64, high: f64) -> bool {
        // Without small oscillations, cycles cannot die out slowly.
        let growth = self.linear.growth.unwrap_or(-1.0);
        let rest = 10.0 * high.max(-low) * high.max(-low) * (rate - growth).abs();
        self.linear.stable && excess(low, high) < 0.0 && rate < -2.0 * rest && growth < -2.0 * rest
    }

    /// Keeps the extrema of a cycle if they are further out than those before.
    fn note(&mut self, offset: f64, orbit: &mut Orbit<'_>, extrema: [Option<Seen>; 2]) {
        let kept = [&mut self.low, &mut self.high];
        for ((seen, kept), sign) in extrema.into_iter().zip(kept).zip([-1.0, 1.0]) {
            let Some(seen) = seen else { continue };
            if kept.is_none_or(|kept| sign * seen.rough.x > sign * kept.x - ROUGH) {
                let extremum = orbit.polished(seen);
                if kept.is_none_or(|kept| sign * extremum.x > sign * kept.x) {
                    *kept = Some(Extremum { t: offset + extremum.t, ..extremum });
                }
            }
        }
    }

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
                let tolerance = self.finer(self.rate_error() * rate.abs() / noise);
                let drift = ln(place.z / asked);
                let [low, high] = cycle.exact_range(&mut orbit);
                return Ok(Sample {
                    place,
                    slope,
                    drift,
                    rate,
                    relaxation,
                    period: cycle.period,
                    high,
                    low,
                    noise,
                    tolerance,
                });
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
    fn slide(&mut self, place: Place, bend: f64) -> Result<Slide, Stop> {
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
            let mut next = self.refined(here.moved(stride.copysign(direction)), here.slope, here.tolerance)?;
            let slope = ln(next.place.y / here.place.y) / ln(next.place.z / here.place.z);
            next.slope = if (0.0..=2.0).contains(&slope) { slope } else { 1.0 };
            let gone = ln(next.place.z / here.place.z) / direction.signum();
            if gone < 0.5 * stride && next.drift.abs() > 20.0 * next.rate.abs() {
                // One cycle led here from far away: there is a limit cycle near, and cycles come to it by themselves.
                let (place, change) = (next.place, next.drift.abs());
                return Ok(Slide::Near { place, change });
            }
            if next.rate * direction <= 0.0 {
                return Ok(Slide::Decided(self.cycle_between(&here, &next)?));
            }
            if !self.linear.stable && next.high - next.low < FAINT {
                return Err(Stop::Faint);
            }
            if next.relaxation < ADIABATIC * next.rate.abs() {
                return Ok(Slide::Coupled);
            }
            if self.dies_out(next.rate, next.low, next.high) {
                return Ok(Slide::Decided(Fate::Settled { time: self.settling(place.z, &start, &next)? }));
            }
            if next.rate.abs() > 2.0 * SLOW {
                let (cycles, time) = self.passage(place.z, &start, &next)?;
                // As many whole cycles as fit.
                let spare = cycles - cycles.floor();
                let place = next.moved(-spare * next.rate);
                return Ok(Slide::Fast { place, time: time - spare * next.period });
            }
            here = next;
            stride *= 2.0;
        }
    }

    /// Relative error that a sample's rate may have.
    fn rate_error(&self) -> f64 {
        (RATE_ERROR * self.rtol).min(1e-3)
    }

    /// A tolerance that is no coarser than that of the response.
    fn finer(&self, tolerance: f64) -> f64 {
        tolerance.min(self.tolerance).max(FINEST)
    }

    /// A sample as exact as its rate asks for.
    fn refined(&mut self, place: Place, slope: f64, tolerance: f64) -> Result<Sample, Stop> {
        let sample = self.sample(place, slope, tolerance)?;
        if sample.tolerance >= 0.5 * tolerance {
            return Ok(sample);
        }
        self.sample(sample.place, slope, sample.tolerance)
    }

    /// The limit cycle between two samples whose rates differ in sign.
    fn cycle_between(&mut self, from: &Sample, to: &Sample) -> Result<Fate, Stop> {
        let length = ln(to.place.z / from.place.z);
        let slope = ((to.rate - from.rate) / length).abs();
        let noise = from.noise.max(to.noise);
        let tolerance = self.finer(0.1 * self.rtol * slope / noise);
        let sample = self.find([*from, *to], tolerance, |sample| sample.rate)?;
        let uncertain = noise * FINEST / slope * (sample.high - sample.low);
        if uncertain > RESOLVED.max(0.2 * self.rtol) {
            return Err(Stop::Faint);
        }
        Ok(Fate::Cycle { period: sample.period, high: sample.high, low: sample.low })
    }

    /// The sample between two others at which `f` vanishes, which differs in sign at them: the Illinois method, with
    /// the places where samples turn out to be.
    fn find(
        &mut self,
        [mut far, mut near]: [Sample; 2],
        tolerance: f64,
        f: impl Fn(&Sample) -> f64,
    ) -> Result<Sample, Stop> {
        let resolution = 0.03 * self.rtol;
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
        let beyond = |sample: &Sample| excess(sample.low, sample.high);
        let first = beyond(start);
        if first <= 0.0 {
            return Ok(0.0);
        }
        let touching = self.find([*start, *inside], inside.tolerance, beyond)?;
        let (cycles, time) = self.passage(z, start, &touching)?;
        // The last cycle that leaves the band begins a part of a cycle before the one that would touch it.
        let spare = cycles - cycles.floor();
        let Place { z, y } = touching.moved(-spare * touching.rate);
        let mut orbit = Orbit::new(self.slider, [z, y, 0.0], touching.tolerance);
        orbit.cycle(false, &mut self.budget)?;
        Ok(time - spare * touching.period + orbit.settled_at().unwrap_or(touching.period))
    }

    /// Cycles and time from `z`, near one sample, to another: a sum over cycles as an integral over `ln z`.
    fn passage(&mut self, z: f64, near: &Sample, to: &Sample) -> Result<(f64, f64), Stop> {
        let length = ln(to.place.z / z);
        let panels = (length.abs() / PANEL).ceil();
        let half = 0.5 * length / panels;
        let rule = gauss::rule(NODES);
        let (mut cycles, mut time) = (0.0, 0.0);
        let mut samples = [*near; NODES];
        let mut last = *near;
        for panel in 0..panels as u32 {
            let middle = (2.0 * f64::from(panel) + 1.0) * half;
            for (sample, x) in samples.iter_mut().zip(&rule.x) {
                // So that the node is in the middle of the way of the cycle.
                let way = ln(z / last.place.z) + middle + half * x - last.drift - 0.5 * last.rate;
                last = self.sample(last.moved(way), last.slope, last.tolerance)?;
                *sample = last;
            }
            // A cycle stands for the middle of the way that it goes.
            let places = samples.map(|sample| (ln(sample.place.z / z) + 0.5 * sample.rate - middle) / half);
            for (&x, w) in rule.x.iter().zip(&rule.w) {
                for (i, sample) in samples.iter().enumerate() {
                    let share = half * w * lagrange(&places, i, x) / sample.rate;
                    cycles += share;
                    time += share * sample.period;
                }
            }
        }
        Ok((cycles, time))
    }
}

/// The polynomial that is 1 at node `i` and 0 at the others, at `x`.
fn lagrange(nodes: &[f64; NODES], i: usize, x: f64) -> f64 {
    (0..NODES).filter(|&j| j != i).map(|j| (x - nodes[j]) / (nodes[i] - nodes[j])).product()
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
    fn range(&self) -> [f64; 2] {
        self.extrema.map(|extremum| extremum.map_or(0.0, |seen| seen.rough.x))
    }

    /// The same to the order of the method.
    fn exact_range(&self, orbit: &mut Orbit<'_>) -> [f64; 2] {
        self.extrema.map(|extremum| extremum.map_or(0.0, |seen| orbit.polished(seen).x))
    }
}

/// When a response settled: at `time` of an orbit that began at `offset`, or at `since` if that is at its start.
fn latest(since: f64, offset: f64, time: f64) -> f64 {
    if time == 0.0 { since } else { offset + time }
}

/// What friction gives and takes over a cycle that began at `z`, added up, as a change of `ln z`.
fn gross(cycle: &Cycle, z: f64, slider: &Slider) -> f64 {
    cycle.loss[1] * slider.k / (z * z)
}

/// How far a cycle goes beyond the band of settled velocities, relative to it; negative within.
fn excess(low: f64, high: f64) -> f64 {
    (high / BAND[1]).max(low / BAND[0]) - 1.0
}
