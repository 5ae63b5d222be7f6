//! Averaging over the swings of a block whose friction is felt only after many of them: a heavy one on a stiff spring,
//! or a light one on a spring so stiff that contacts hardly age before it settles.
//!
//! With `S = sqrt(k M)` and `omega = sqrt(k/M)` the block swings as `v/v_f = 1 - A cos(omega t)`; friction changes `A` by
//! a share of the order of `(a + b)/S` a swing. Where that is less than what is asked for, the swings themselves are
//! known, and so is what they come to: friction takes `M A A' = -(1 - s) c(s)`, `s = sqrt(1 - A^2)`, with
//!
//! ```text
//! c = a - b q,    q = -<(v - 1) ln theta>/(1 - s)
//! ```
//!
//! for the contact lifetime that swings with the block, `theta' = 1 - theta v`. A block that starts above `2 v_f` is
//! arrested once, until the spring has come back, and swings from rest after that.

use std::f64::consts::{LN_2, PI};

use super::course::{Course, Doubts, Fate, VANISHING, as_slow, is_later};
use super::fate::Linear;
use super::orbit::{Extremum, Orbit, SETTLED};
use super::slider::Slider;
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::gauss;
use crate::numerics::root::crossing;
use crate::stability::lyapunov_coefficient;

/// What friction does within a swing, in units of `(a + b)/S` for every power of e over which `ln v` and `ln theta` run.
const SIZE: f64 = 3.0;

/// Least amplitude at which `q` is summed, and nodes of a piece of the sum.
const SMALL: f64 = 1e-3;
const GROWN: usize = 10;

/// Swings that die out over as many, in units of `S/a`, are followed one by one.
const COUNTABLE: f64 = 1.5e3;

/// Contacts age while swings die out where `M/a` is more.
const COUPLED: f64 = 30.0;

/// Swings that are simulated before, and steps.
const SWINGS: u32 = 3;
const MOST_STEPS: u32 = 10_000;

/// Errors of these steps in units of `rtol`, the share of them that is taken each time that they are simulated more finely, and
/// the least of them.
const FINE: f64 = 3e-3;
const FINER: f64 = 0.1;
const FINEST: f64 = 1e-14;

/// Limit cycles are told by the Hopf point where their amplitude is less.
const FAINT: f64 = 1e-3;

/// Share of `s` over which the slope of `c` is taken.
const BESIDE: f64 = 1e-4;

/// What friction may change within a swing, beside what is asked for.
const UNFELT: f64 = 0.1;

/// The sign of `c` is told where it is this many times its error.
const CLEAR: f64 = 10.0;

/// Frequencies between which the contact lifetime neither follows the velocity nor stands still.
const FOLLOWING: f64 = 0.03;
const STANDING: f64 = 100.0;

/// Error of `q` between these.
const SUMMED: f64 = 1e-11;

/// Places at which `c` is looked at for a change of sign, and to what the place of one is found.
const PLACES: u32 = 16;
const RESOLUTION: f64 = 1e-13;

/// Nodes of a panel of the integral for the time of many swings, and the length of a panel in `ln(1 - s)`.
const NODES: usize = 16;
const PANEL: f64 = 2.5;

/// A block that swings.
struct Swinging {
    a: f64,
    b: f64,
    mass: f64,
    /// `S`.
    impedance: f64,
    omega: f64,
    /// What friction does within a swing, as a share of it, at most.
    share: f64,
}

/// The response from `e^x v_f` where its swings are known to `rtol`; `None` elsewhere.
pub(super) fn course(slider: &Slider, linear: Linear, x: f64, rtol: f64) -> Option<Course> {
    let &Slider { a, b, inertia: mass, k } = slider;
    let (impedance, omega) = ((k * mass).sqrt(), (k / mass).sqrt());
    let share = SIZE * decades(omega, x) * (a + b) / impedance;
    // False also for numbers out of range.
    let unfelt = share < UNFELT * rtol;
    unfelt.then(|| Swinging { a, b, mass, impedance, omega, share }.course(linear, x, rtol))?
}

/// The response from `e^x v_f` where the first swings alone need simulation: friction is felt in them, but there are too
/// many to follow, and while they die out contacts hardly age. `None` elsewhere.
pub(super) fn course_after_first_swings(slider: &Slider, linear: Linear, x: f64, rtol: f64) -> Option<Course> {
    let &Slider { a, b, inertia: mass, k } = slider;
    let (impedance, omega) = ((k * mass).sqrt(), (k / mass).sqrt());
    let share = SIZE * decades(omega, x) * (a + b) / impedance;
    let many = impedance > COUNTABLE * a && mass < COUPLED * a;
    let alone = omega > STANDING && a * omega > CLEAR * b * decades(omega, x);
    if !(many && alone && linear.stable) {
        return None;
    }
    let swinging = Swinging { a, b, mass, impedance, omega, share };
    // The way down to a slow trough magnifies the errors of steps, so it takes finer ones.
    let mut tolerance = (FINE * rtol).max(FINEST / FINER);
    let mut first = FirstSwings::of(slider, x, tolerance)?;
    let mut doubts = Doubts { trough: true, t_peak: true, ..Doubts::default() };
    while (doubts.trough || doubts.t_peak) && FINER * tolerance >= FINEST {
        tolerance *= FINER;
        let finer = FirstSwings::of(slider, x, tolerance)?;
        if (finer.high.x - first.high.x).abs() > rtol {
            return None;
        }
        doubts.trough = !as_slow(finer.low.x, first.low.x, rtol);
        doubts.t_peak = is_later(first.high, finer.high, rtol);
        first = FirstSwings { steps: first.steps + finer.steps, ..finer };
    }
    let FirstSwings { low, high, t, steps } = first;
    let excess = exp_m1(x).abs();
    let amplitude = excess.min(1.0);
    let start = ((1.0 - amplitude) * (1.0 + amplitude)).sqrt();
    // Friction takes from all swings: c is a, but for a share of 1/omega.
    let (time, known) = swinging.settling(amplitude, start, rtol);
    doubts.settling_time = !known;
    let time = if time > 0.0 { time + high.t } else { time };
    let fate = Fate::Settled { time };
    Some(Course { fate, high: Some(high), low: Some(low), t, steps, doubts })
}

/// Extrema of the first swings.
struct FirstSwings {
    low: Extremum,
    high: Extremum,
    t: f64,
    steps: u32,
}

impl FirstSwings {
    /// From `e^x v_f`, with steps whose errors are below `tolerance`.
    fn of(slider: &Slider, x: f64, tolerance: f64) -> Option<FirstSwings> {
        let mut orbit = Orbit::new(slider, slider.steady(x), tolerance);
        let mut budget = MOST_STEPS;
        let (mut low, mut high) = (None, None);
        for _ in 0..SWINGS {
            let cycle = orbit.cycle(false, &mut budget).ok()?;
            let [slow, fast] = cycle.extrema.map(|seen| seen.map(|seen| orbit.polished(seen)));
            (low, high) = (low.or(slow), high.or(fast));
        }
        Some(FirstSwings { low: low?, high: high?, t: orbit.t(), steps: MOST_STEPS - budget })
    }
}

/// Over how much `ln v` and `ln theta` may run.
fn decades(omega: f64, x: f64) -> f64 {
    1.0 + x.abs() + ln(omega).abs()
}

impl Swinging {
    fn course(&self, linear: Linear, x: f64, rtol: f64) -> Option<Course> {
        let (ratio, excess) = (exp(x), exp_m1(x));
        // Slowest velocity of the first swing, if it is one: where it just touches rest, it may or may not be arrested.
        let rest = 1.0 - excess.abs();
        let arrested = excess > 1.0;
        if excess > 0.0 && rest.abs() < CLEAR * self.share {
            return None;
        }
        let amplitude = excess.abs().min(1.0);
        let start = match excess {
            _ if arrested => 0.0,
            _ if excess < 0.0 => (ratio * (2.0 - ratio)).sqrt(),
            _ => (rest * ratio).sqrt(),
        };
        let mut doubts = Doubts::default();
        // Phases of the slowest and the fastest moment; the phase in which the block is at rest.
        let (low, high, delay) = if arrested {
            // It falls to rest, and the spring comes back by what its force was then.
            let pull = (rest.abs() * (excess + 1.0)).sqrt();
            let delay = libm::acos(-1.0 / excess) + pull;
            doubts.t_peak = self.share > UNFELT * rtol * pull;
            let rests = pull * self.impedance > 4.0 * -VANISHING * (self.a + self.b * decades(self.omega, x));
            if !rests {
                return None;
            }
            ((2.0 * VANISHING, delay), (LN_2, delay + PI), delay)
        } else if excess < 0.0 {
            doubts.trough = self.share > UNFELT * rtol * ratio;
            ((x, 2.0 * PI), (ln_1p(amplitude), PI), 0.0)
        } else {
            doubts.trough = self.share > UNFELT * rtol * rest;
            ((ln_1p(-amplitude), PI), (x, 2.0 * PI), 0.0)
        };
        // What swings in the beginning may grow for a while before it dies out, where contacts age on their own.
        let follows = self.omega < FOLLOWING * ratio * ratio.sqrt();
        let ages = self.b * decades(self.omega, x) > self.a * self.omega.max(1.0) / CLEAR;
        doubts.t_peak |= ages && (arrested || !follows);
        let first = [low, high].map(|(x, phase)| Some(Extremum { x, t: phase / self.omega }));
        // Next to the critical stiffness rounding decides the sign of c in small swings: linear theory and the Hopf point
        // tell it.
        let damped = self.bend().is_some_and(|bend| bend < 0.0);
        let dies_out = amplitude < FAINT && linear.stable && damped;
        if !dies_out && !self.is_clear(start) {
            return None;
        }
        let at_start = self.coefficient(start);
        let mut seen = first;
        let crossing = || self.change_of_sign(start, if at_start > 0.0 { 1.0 } else { 0.0 });
        let fate = if dies_out {
            Fate::Settled { time: 0.0 }
        } else if at_start > 0.0 {
            // That may even arrest a block that is almost at rest.
            if excess < 0.0 && ratio < CLEAR * self.share && ages && !follows {
                return None;
            }
            let crossing = crossing();
            let small = crossing.filter(|&s| (1.0 - s) * (1.0 + s) < FAINT * FAINT);
            match crossing {
                Some(s) if small.is_none() => self.cycle(s, rtol, &mut doubts)?,
                _ if linear.stable && (small.is_none() || damped) => {
                    let (time, known) = self.settling(amplitude, start, rtol);
                    doubts.settling_time = !known;
                    Fate::Settled { time: if time > 0.0 || arrested { time + delay / self.omega } else { 0.0 } }
                }
                _ => self.small_cycle(linear, rtol)?,
            }
        } else {
            // What comes later is faster.
            seen = [first[0].filter(|_| arrested), None];
            doubts = Doubts::default();
            match crossing() {
                Some(s) => self.cycle(s, rtol, &mut doubts)?,
                None => self.driven()?,
            }
        };
        let [low, high] = seen;
        let t = (2.0 * PI + delay) / self.omega;
        Some(Course { fate, high, low, t, steps: 0, doubts })
    }

    /// `c` where `sqrt(1 - A^2)` is `s`.
    fn coefficient(&self, s: f64) -> f64 {
        let &Swinging { a, b, omega, .. } = self;
        match omega {
            _ if b == 0.0 => a,
            _ if omega < FOLLOWING => (a - b) + b * self.behind(s),
            _ if omega > STANDING => a - b * (1.0 + s) / (2.0 * omega * omega),
            _ => a - b * self.summed(s),
        }
    }

    /// Whether the sign of `c` is told: it is positive wherever contacts that follow late only add to it.
    fn is_clear(&self, s: f64) -> bool {
        let late = self.omega < FOLLOWING && self.a >= self.b;
        let error = if late { self.felt(s) } else { self.error(s) };
        self.coefficient(s).abs() > CLEAR * error
    }

    /// Error of `c`: that of `q`, and what friction does to the swing in which it is felt.
    fn error(&self, s: f64) -> f64 {
        let &Swinging { b, omega, .. } = self;
        let lag = match omega {
            _ if omega < FOLLOWING => (3.0 * self.late(s) * self.late(s)).min(1.0) * self.behind(s),
            _ if omega > STANDING => 3.0 / (omega * omega * omega * omega),
            _ => SUMMED,
        };
        b * lag + self.felt(s)
    }

    /// The latter.
    fn felt(&self, s: f64) -> f64 {
        let &Swinging { a, b, omega, share, .. } = self;
        let friction = match omega {
            _ if omega < FOLLOWING => (a - b).abs() + b * self.late(s),
            _ if omega > STANDING => a + b / omega,
            _ => a + b,
        };
        share * friction * friction / (a + b)
    }

    /// How late contacts follow the velocity where it changes fastest.
    fn late(&self, s: f64) -> f64 {
        let apart = self.apart(s);
        self.omega / (apart * apart * apart)
    }

    /// `1 - q` where the contact lifetime follows the velocity: the first term of its series in `omega`.
    fn behind(&self, s: f64) -> f64 {
        let s = self.apart(s);
        let square = s * s;
        0.25 * self.omega * self.omega * (1.0 + s) * (1.0 + square) / (square * square * s)
    }

    /// `s`, or where the series comes to what `1 - q` is for a block that is at rest once in a swing, `0.62 omega^(1/3)`.
    fn apart(&self, s: f64) -> f64 {
        s.max(0.834 * libm::cbrt(self.omega))
    }

    /// `q` from the contact lifetime that repeats itself; in small swings it is linear in the square of the amplitude.
    fn summed(&self, s: f64) -> f64 {
        let square = (1.0 - s) * (1.0 + s);
        if square >= SMALL * SMALL {
            return self.summed_at(square.sqrt());
        }
        let linear = 1.0 / (1.0 + self.omega * self.omega);
        linear + (self.summed_at(SMALL) - linear) * square / (SMALL * SMALL)
    }

    /// The sum for one amplitude, integrated exactly but for `e^D` within short pieces: `-(v - 1) ln theta` has the mean of
    /// `-(A/omega) sin(phi)/theta`.
    fn summed_at(&self, amplitude: f64) -> f64 {
        let omega = self.omega;
        let pieces = 64 + (8.0 / omega) as usize;
        let width = 2.0 * PI / pieces as f64;
        let rule = gauss::rule(GROWN);
        // Over each piece: what is left of the contact lifetime, and what is added.
        let passed = |phase: f64| (phase - amplitude * libm::sin(phase)) / omega;
        let steps: Vec<[f64; 2]> = (0..pieces)
            .map(|i| {
                let (from, to) = (i as f64 * width, (i + 1) as f64 * width);
                let end = passed(to);
                let middle = 0.5 * (from + to);
                let added = rule.x.iter().zip(&rule.w).map(|(x, w)| w * exp(passed(middle + 0.5 * width * x) - end));
                [exp(passed(from) - end), 0.5 * width / omega * added.sum::<f64>()]
            })
            .collect();
        let [left, added] = steps.iter().fold([1.0, 0.0], |[left, added], [l, a]| [left * l, added * l + a]);
        let mut theta = added / (1.0 - left);
        let mut sum = 0.0;
        for (i, [left, added]) in steps.iter().enumerate() {
            sum += libm::sin(i as f64 * width) / theta;
            theta = theta * left + added;
        }
        let in_phase = -amplitude / omega * sum / pieces as f64;
        let s = ((1.0 - amplitude) * (1.0 + amplitude)).sqrt();
        in_phase * (1.0 + s) / (amplitude * amplitude)
    }

    /// Where `c` vanishes on the way from one `s` to another.
    fn change_of_sign(&self, from: f64, to: f64) -> Option<f64> {
        let f = |s: f64| self.coefficient(s);
        let place = |i: u32| from + (to - from) * f64::from(i) / f64::from(PLACES);
        // Towards 0 it may vanish just before the block rests, in proportion.
        let near = (1..=PLACES).map(place).chain((1..PLACES * 4).map(|i| 0.1 * place(PLACES - 1) * exp(-f64::from(i))));
        let mut places: Vec<f64> = near.filter(|&s| s >= from.min(to)).collect();
        places.sort_by(|s, other| if to > from { s.total_cmp(other) } else { other.total_cmp(s) });
        let mut last = [from, f(from)];
        for s in places {
            let here = [s, f(s)];
            if here[1] * last[1] <= 0.0 {
                let resolution = RESOLUTION * last[0].max(s);
                return Some(crossing(f, [last[0], s], [last[1], here[1]], resolution));
            }
            last = here;
        }
        None
    }

    /// The limit cycle at `s`, where friction gives as much as it takes.
    fn cycle(&self, s: f64, rtol: f64, doubts: &mut Doubts) -> Option<Fate> {
        let amplitude = ((1.0 - s) * (1.0 + s)).sqrt();
        let beside = s * if s > 0.5 { 1.0 - BESIDE } else { 1.0 + BESIDE };
        let slope = ((self.coefficient(beside) - self.coefficient(s)) / (beside - s)).abs();
        let error = self.error(s) / slope;
        // Slowest and fastest velocity are 1 - A and 1 + A.
        let (slowest, moved) = (s * s / (1.0 + amplitude), error * s / amplitude);
        doubts.cycle_trough = moved > UNFELT * rtol * slowest;
        doubts.trough |= doubts.cycle_trough;
        let told = moved < UNFELT * rtol && moved < UNFELT * slowest;
        let fate = Fate::Cycle { period: 2.0 * PI / self.omega, high: ln_1p(amplitude), low: ln(slowest) };
        told.then_some(fate)
    }

    /// The first Lyapunov coefficient, if there is a Hopf point.
    fn bend(&self) -> Option<f64> {
        lyapunov_coefficient(Law { a: self.a, b: self.b }, self.mass)
    }

    /// The limit cycle that a supercritical Hopf point leaves just below the critical stiffness, up to the cube of its
    /// size.
    fn small_cycle(&self, linear: Linear, rtol: f64) -> Option<Fate> {
        let growth = linear.growth.filter(|&growth| growth > 0.0)? / (2.0 * PI);
        let size = 2.0 * (growth / -self.bend().filter(|&bend| bend < 0.0)?).sqrt();
        let told = size > 0.0 && size < FAINT && size * size < UNFELT * rtol;
        told.then(|| Fate::Cycle { period: 2.0 * PI / self.omega, high: size, low: -size })
    }

    /// The limit cycle on which friction drives the block until it is arrested: what it gives in a swing is what the
    /// spring's force at rest takes.
    fn driven(&self) -> Option<Fate> {
        let given = -self.coefficient(0.0);
        let pull = (4.0 * PI * given.max(0.0) * self.impedance).sqrt();
        let rests = given > 2.0 * self.error(0.0) && pull > 4.0 * -VANISHING * (self.a + self.b);
        rests.then(|| Fate::Cycle { period: 2.0 * PI / self.omega, high: LN_2, low: 2.0 * VANISHING })
    }

    /// Time until swings of this amplitude stay in the band of settled velocities, and whether it is known.
    fn settling(&self, amplitude: f64, start: f64, rtol: f64) -> (f64, bool) {
        if amplitude < SETTLED {
            return (0.0, amplitude < SETTLED * (1.0 - CLEAR * self.share));
        }
        let less = |amplitude: f64| ln(amplitude * amplitude / (1.0 + ((1.0 - amplitude) * (1.0 + amplitude)).sqrt()));
        let from = ln(amplitude * amplitude / (1.0 + start));
        let length = from - less(SETTLED);
        let panels = (length / PANEL).ceil().max(1.0);
        let rule = gauss::rule(NODES);
        let (mut time, mut least, mut error) = (0.0, f64::INFINITY, 0.0);
        for panel in 0..panels as u32 {
            for (x, w) in rule.x.iter().zip(&rule.w) {
                let s = -exp_m1(from - length * (f64::from(panel) + 0.5 * (1.0 + x)) / panels);
                let coefficient = self.coefficient(s);
                let part = 0.5 * w * length / panels * self.mass * s / coefficient;
                time += part;
                error += part * self.error(s) / coefficient;
                least = least.min(coefficient);
            }
        }
        error += 2.0 * PI / self.omega + 2.0 * self.mass * self.share / least;
        (time, error < UNFELT * rtol * time)
    }
}

#[cfg(test)]
mod tests {
    //! What friction takes from small swings at the critical stiffness, against the first Lyapunov coefficient.

    use super::*;

    #[test]
    fn reference_averaging_meets_the_hopf_point() {
        for (a, omega, mass) in
            [(0.01, 0.1, 1e6), (0.01, 0.3, 1e8), (0.1, 1.0, 1e9), (0.003, 3.0, 1e7), (0.02, 30.0, 1e12)]
        {
            let b = a * (1.0 + omega * omega);
            // At the critical stiffness, but for a share of a/M.
            let swinging = Swinging { a, b, mass, impedance: mass * omega, omega, share: 0.0 };
            let c = |s: f64| swinging.coefficient(s);
            // c = -M omega l_1 (1 - s) to the next order in 1 - s, which two places tell apart.
            let slope = |s: f64| (c(s) - a + b / (1.0 + omega * omega)) / (1.0 - s);
            let found = 2.0 * slope(1.0 - 5e-4) - slope(1.0 - 1e-3);
            let expected = -mass * omega * swinging.bend().expect("has a Hopf point");
            assert!((found / expected - 1.0).abs() < 1e-3, "{omega}: {found} {expected}");
        }
    }
}
