//! Responses of a block whose friction does not weaken with velocity, `b <= a`: all of them settle.
//!
//! With `u = theta v` the energy and what the contacts store,
//!
//! ```text
//! V = M (v - 1)^2/2 + z^2/(2 k) + b (theta - 1 - ln theta),
//! -V' = (a - b) (v - 1) ln v + b [(u ln u - u + 1)/theta + u - 1 - ln u],
//! ```
//!
//! never rises, and vanishes at steady sliding alone. Where the velocity is extremal, friction carries the spring's
//! force, `z = a ln v + b ln theta`, so the least `V` that an extremum takes bounds all those to come.

use super::course::{Course, Doubts, Fate};
use super::orbit::{BAND, Extremum};
use super::slider::{Slider, State, Y, Z};
use super::swings::{self, Descent, UNFELT, stored};
use crate::numerics::elementary::{exp, exp_m1, ln_1p};
use crate::numerics::root::{Probe, newton};

/// Greatest `|ln v|` whose exponential is in the range of doubles with room to spare.
const WIDEST: f64 = 600.0;

/// To what roots are found, as a share of what vanishes there.
const ENOUGH: f64 = 1e-12;

/// The response from `e^x v_f`, as far as it is known without following it to its end; `None` if friction weakens or its
/// peak is not known.
pub(super) fn course(slider: &Slider, x: f64, rtol: f64) -> Option<Course> {
    let strengthens = slider.b <= slider.a;
    strengthens.then(|| slider.adiabatic(x, rtol).or_else(|| swings::first(slider, &Energy(slider), x, rtol)))?
}

impl Slider {
    /// A spring so soft that contacts follow the velocity, `theta v = 1`, and friction only adds `a/v^2` to the mass. The
    /// block swings in the potential `U = M (v - 1)^2/2 + a (1/v - 1 + ln v)`, which takes it from its fastest to its
    /// slowest moment.
    fn adiabatic(&self, x: f64, rtol: f64) -> Option<Course> {
        let &Slider { a, b, inertia: mass, k } = self;
        let potential = |x: f64| 0.5 * mass * exp_m1(x) * exp_m1(x) + a * lag(x);
        let start = potential(x);
        // The greatest force, and the share of V that a swing takes at most: ln u is at most force/a while the block swings
        // for 2 pi sqrt((M + 4 a)/k) + 4 force/k, and |v - 1| has the integral 4 force/k.
        let force = (2.0 * k * start).sqrt();
        let followed = (20.0 * force + 4.0 * std::f64::consts::PI * (k * (mass + 4.0 * a)).sqrt()) / a;
        let turn = |sign: f64| {
            if x * sign > 0.0 {
                return Some(x);
            }
            // Distance from 0 against the share of V that is missing.
            let probe = |size: f64| {
                let x = sign * size;
                let slope = sign * (mass * exp(x) * exp_m1(x) - a * exp_m1(-x)) / start;
                Some(Probe { value: potential(x) / start - 1.0, slope }).filter(|probe| probe.value.is_finite())
            };
            newton(probe, x.abs(), (0.0, WIDEST), true, ENOUGH).map(|root| sign * root.x)
        };
        let (high, low) = (turn(1.0)?, turn(-1.0));
        let widest = low.map_or(WIDEST, |low| high.max(-low));
        let share = followed + 8.0 * (a - b) * widest / force;
        let error = |x: f64| {
            let v = exp(x);
            share * start / (mass * v * exp_m1(x) - a * exp_m1(-x)).abs()
        };
        // False also for numbers out of range.
        if !(error(high) < UNFELT * rtol && high < WIDEST) {
            return None;
        }
        let low = low.filter(|&low| error(low) < UNFELT * rtol);
        let inside = high < BAND[1] - rtol && low.is_some_and(|low| low > BAND[0] + rtol);
        // All swings are as high as each other.
        let doubts = Doubts { trough: low.is_none(), t_peak: true, settling_time: !inside, ..Doubts::default() };
        let extremum = |x: f64| Extremum { x, t: f64::NAN };
        let (high, low) = (Some(extremum(high)), low.map(extremum));
        Some(Course { fate: Fate::Settled { time: 0.0 }, high, low, t: 0.0, steps: 0, doubts })
    }
}

/// `V`, which falls.
struct Energy<'a>(&'a Slider);

impl Descent for Energy<'_> {
    fn on_section(&self, state: &State) -> f64 {
        0.5 * state[Z] * state[Z] / self.0.k + self.0.b * stored(state[Y])
    }

    /// Over all contact lifetimes.
    fn of_extremum(&self, x: f64) -> Option<f64> {
        let &Slider { a, b, inertia, k } = self.0;
        let kinetic = 0.5 * inertia * exp_m1(x) * exp_m1(x);
        let of = |y: f64| kinetic + 0.5 * (a * x + b * y) * (a * x + b * y) / k + b * stored(y);
        if b == 0.0 || x == 0.0 {
            return Some(of(0.0));
        }
        // Zero where it takes least: between 0 and where friction is that of y = -a x/b, and no further than without b.
        let scale = a * x.abs() / k;
        let probe = |y: f64| {
            let value = ((a * x + b * y) / k + exp_m1(y)) / scale;
            Some(Probe { value, slope: (b / k + exp(y)) / scale }).filter(|probe| probe.value.is_finite())
        };
        let end = if x < 0.0 { ln_1p(scale).min(-a * x / b) } else { 0.0 };
        let bracket = if x < 0.0 { (0.0, f64::INFINITY) } else { (f64::NEG_INFINITY, 0.0) };
        newton(probe, end, bracket, true, ENOUGH).map(|root| of(root.x))
    }
}

/// `1/v - 1 + ln v` of `x = ln v`.
fn lag(x: f64) -> f64 {
    stored(-x)
}

#[cfg(test)]
mod tests {
    //! What is told without following a response to its end, against responses that are followed to it.

    use super::super::course::as_slow;
    use super::super::fate::follow_once;
    use super::super::slider::X;
    use super::super::{Orbit, Scaled, Slider};
    use super::*;

    /// Numbers between 0 and 1 from a fixed linear congruence.
    fn uniform(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Compares with a response that is followed to its end; what is compared is counted.
    fn compare(slider: &Slider, found: &Course, x: f64, rtol: f64, compared: &mut [usize; 4]) {
        let scaled = Scaled { slider: *slider, ratio: exp(x) };
        let judge = follow_once(slider, scaled.linear(), x, rtol, 0.01);
        let Fate::Settled { time } = judge.fate else { return };
        let ([low, high], [bottom, top]) = (found.range(), judge.range());
        compared[0] += 1;
        assert!((high - top).abs() < rtol, "{slider:?} {x} at {rtol:e}: {high} {top}");
        if !found.doubts.trough {
            compared[1] += 1;
            assert!(as_slow(low, bottom, rtol), "{slider:?} {x} at {rtol:e}: {low} {bottom}");
        }
        if !found.doubts.t_peak
            && let (Some(peak), Some(other)) = (found.peak(rtol), judge.peak(rtol))
        {
            compared[2] += 1;
            assert!((peak.t / other.t - 1.0).abs() < rtol / other.x.min(1.0), "{slider:?} {x}: {peak:?} {other:?}");
        }
        if !found.doubts.settling_time
            && let Fate::Settled { time: found } = found.fate
        {
            compared[3] += 1;
            assert!(found == time || (found / time - 1.0).abs() < rtol, "{slider:?} {x} at {rtol:e}: {found} {time}");
        }
    }

    #[test]
    fn reference_what_first_swings_tell_is_what_becomes_of_the_response() {
        let mut state = 3;
        let mut random = |least: f64, greatest: f64| least * (greatest / least).powf(uniform(&mut state));
        let mut compared = [0; 4];
        for i in 0..300 {
            let (a, rtol) = (random(1e-4, 1.0), random(1e-6, 1e-3));
            let b = [0.0, a, a * (1.0 - random(1e-6, 1.0)), a * (random(1.0, 2.0) - 1.0)][i % 4];
            let inertia = if i % 7 == 0 { 0.0 } else { a * random(1e-6, 1e6) };
            let slider = Slider { a, b, inertia, k: a * random(1e-4, 1e4) };
            let x = random(1e-3, 10.0) * if i % 2 == 0 { 1.0 } else { -1.0 };
            if let Some(found) = swings::first(&slider, &Energy(&slider), x, rtol) {
                compare(&slider, &found, x, rtol, &mut compared);
            }
        }
        assert!(compared.iter().zip([200, 100, 40, 20]).all(|(&count, least)| count > least), "{compared:?}");
    }

    #[test]
    fn reference_the_potential_tells_the_swings_on_a_soft_spring() {
        let mut state = 4;
        let mut random = |least: f64, greatest: f64| least * (greatest / least).powf(uniform(&mut state));
        let mut compared = [0; 4];
        for i in 0..80 {
            let (a, rtol) = (random(1e-4, 1.0), random(3e-3, 1e-2));
            let b = if i % 2 == 0 { a } else { a * (1.0 - random(1e-12, 1e-9)) };
            let inertia = if i % 5 == 0 { 0.0 } else { a * random(1e-3, 1e3) };
            let k = random(1e-3, 1.0) * a * a / (inertia + 4.0 * a) * (0.1 * rtol / 20.0).powi(2);
            let x = random(1e-2, 3.0) * if i % 3 == 0 { 1.0 } else { -1.0 };
            let slider = Slider { a, b, inertia, k };
            if let Some(found) = slider.adiabatic(x, rtol) {
                compare(&slider, &found, x, rtol, &mut compared);
            }
        }
        assert!(compared[0] > 20 && compared[1] > 20, "{compared:?}");
    }

    #[test]
    fn reference_the_energy_never_rises_and_bounds_every_extremum() {
        let mut state = 6;
        let mut random = |least: f64, greatest: f64| least * (greatest / least).powf(uniform(&mut state));
        let mut bounded = 0;
        for i in 0..100 {
            let a = random(1e-4, 1.0);
            let b = if i % 2 == 0 { a } else { a * (random(1.0, 2.0) - 1.0) };
            let slider = Slider { a, b, inertia: a * random(1e-3, 1e4), k: a * random(1e-3, 1e3) };
            let start = slider.steady(random(1e-2, 5.0) * if i % 3 == 0 { 1.0 } else { -1.0 });
            let energy = |[z, y, x]: [f64; 3]| {
                0.5 * slider.inertia * exp_m1(x) * exp_m1(x) + 0.5 * z * z / slider.k + b * stored(y)
            };
            let mut orbit = Orbit::new(&slider, start, 1e-10);
            let (mut left, mut budget) = (energy(start), 5_000);
            assert!(start[X] != 0.0);
            for _ in 0..8 {
                let Ok(cycle) = orbit.cycle(true, &mut budget) else { break };
                for seen in cycle.extrema.into_iter().flatten() {
                    let Some(least) = Energy(&slider).of_extremum(orbit.polished(seen).x) else { continue };
                    bounded += 1;
                    assert!(least < left * (1.0 + 1e-6) + 1e-12 * a, "{slider:?}: {least} {left}");
                }
                let next = energy(cycle.end);
                assert!(next < left * (1.0 + 1e-6) + 1e-12 * a, "{slider:?}: {next} {left}");
                left = next;
            }
        }
        assert!(bounded > 300, "{bounded}");
    }
}
