//! The first swings of a response that is known to settle: a function of the state that never rises bounds all later ones.

use super::course::{Course, Doubts, Fate, as_slow, is_later};
use super::orbit::{Extremum, Orbit, Stop};
use super::slider::{Slider, State};
use crate::numerics::elementary::exp_m1;

/// Share of `rtol` that an extremum may be off by, and by which those to come may go beyond it.
pub(super) const UNFELT: f64 = 0.1;

/// A peak is the greatest where those to come are lower by as much, in units of `rtol`.
const CLEAR: f64 = 0.3;

/// Errors of steps in units of `rtol`, the share of it by which they are taken once more, and the least of them.
const FINE: f64 = 0.01;
const FINER: f64 = 0.1;
const FINEST: f64 = 1e-14;

/// Swings that are followed until those to come are known to be smaller, and steps.
const MOST_SWINGS: u32 = 100;
const MOST_STEPS: u32 = 20_000;

/// A function of the state that never rises.
pub(super) trait Descent {
    /// Its value on the section `v = v_f`.
    fn on_section(&self, state: &State) -> f64;

    /// The least value with which the velocity can be extremal at `e^x v_f`. It grows with the distance of `x` from 0. `None` out
    /// of range.
    fn of_extremum(&self, x: f64) -> Option<f64>;
}

/// The response from `e^x v_f`, which settles, as far as the first swings tell it until those to come are known to be smaller;
/// `None` if its peak is not known.
pub(super) fn first(slider: &Slider, descent: &impl Descent, x: f64, rtol: f64) -> Option<Course> {
    let fine = (FINE * FINER * rtol).max(FINEST);
    let [coarse, fine] = [fine / FINER, fine].map(|tolerance| follow(slider, descent, x, tolerance, rtol));
    let (coarse, fine) = (coarse?, fine?);
    let ([low, high], [bottom, top]) = (coarse.range(), fine.range());
    if (high - top).abs() > rtol {
        return None;
    }
    let Doubts { trough, t_peak, settling_time, cycle_trough } = fine.doubts;
    let alike = |t: f64, other: f64| (t / other - 1.0).abs() <= rtol || t == other;
    let timed = matches!((coarse.fate, fine.fate), (Fate::Settled { time }, Fate::Settled { time: other })
        if alike(time, other));
    let late = match (coarse.peak(rtol), fine.peak(rtol)) {
        (Some(peak), Some(other)) => is_later(peak, other, rtol),
        (None, None) => false,
        _ => true,
    };
    let doubts = Doubts {
        trough: trough || coarse.doubts.trough || !as_slow(low, bottom, rtol),
        t_peak: t_peak || coarse.doubts.t_peak || late,
        settling_time: settling_time || coarse.doubts.settling_time || !timed,
        cycle_trough,
    };
    Some(Course { steps: coarse.steps + fine.steps, doubts, ..fine })
}

/// The same with steps whose errors are below `tolerance`.
fn follow(slider: &Slider, descent: &impl Descent, x: f64, tolerance: f64, rtol: f64) -> Option<Course> {
    let mut orbit = Orbit::new(slider, slider.steady(x), tolerance);
    let mut budget = MOST_STEPS;
    let [mut low, mut high]: [Option<Extremum>; 2] = [None; 2];
    for _ in 0..MOST_SWINGS {
        let cycle = orbit.cycle(true, &mut budget);
        let quiet = cycle == Err(Stop::Quiet);
        let extrema = match &cycle {
            Ok(cycle) => cycle.extrema,
            Err(Stop::Quiet) => orbit.extrema(),
            Err(_) => return None,
        };
        let [slow, fast] = extrema.map(|seen| seen.map(|seen| orbit.polished(seen)));
        low = [low, slow].into_iter().flatten().min_by(|one, other| one.x.total_cmp(&other.x));
        high = [high, fast].into_iter().flatten().max_by(|one, other| one.x.total_cmp(&other.x));
        let [least, greatest] = [low, high].map(|seen| seen.map_or(0.0, |seen| seen.x));
        let left = cycle.map_or(0.0, |cycle| descent.on_section(&cycle.end));
        let reaches = |x: f64| descent.of_extremum(x).is_none_or(|least| least < left);
        if quiet || !reaches(greatest + UNFELT * rtol) {
            let time = if quiet { orbit.settled_at() } else { None };
            let doubts = Doubts {
                trough: !quiet && reaches(least - UNFELT * rtol),
                t_peak: !quiet && (greatest < CLEAR * rtol || reaches(greatest - CLEAR * rtol)),
                settling_time: time.is_none(),
                ..Doubts::default()
            };
            let fate = Fate::Settled { time: time.unwrap_or(0.0) };
            return Some(Course { fate, high, low, t: orbit.t(), steps: MOST_STEPS - budget, doubts });
        }
    }
    None
}

/// `theta - 1 - ln theta` of `y = ln theta`.
pub(super) fn stored(y: f64) -> f64 {
    if y.abs() < 1e-4 { y * y * (0.5 + y * (1.0 / 6.0 + y / 24.0)) } else { exp_m1(y) - y }
}
