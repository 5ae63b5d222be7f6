//! `step_response`: the traced response obeys the equations; its extremes, its settling and its cycles are read off the trace.

use super::motion::{Followed, bisect};
use super::route::integrate;
use super::{Checked, CheckedRow, MAX_DIFFERENCE_RTOLS, hopf};
use crate::model::{Law, StateLaw, Transition};
use crate::numerics::MAX_PANELS;
use crate::protocol::{Motion, SpringBlock};
use crate::stability::SteadySliding;
use crate::stability::step_response::{Outcome, SETTLED, VelocityStep};
use crate::table::{STATUS, slider, transition};

/// Relative overshoot below which its time is not determined. Chosen: the error of the time is `rtol` divided by the overshoot.
const MIN_OVERSHOOT: f64 = 1e-3;

/// Number of cycles after the decision in which a response approaches its limit cycle. Chosen: a typical multiplier of 0.5 leaves 1e-9.
const MORE_CYCLES: f64 = 30.0;

/// Distance of two successive cycles, in rtol, beyond which they determine no limit cycle. Chosen: three digits are left at the default `rtol`.
const MAX_CYCLE_RTOLS: f64 = 1e3;

/// An extremum or a crossing.
#[derive(Debug, Clone, Copy)]
struct Event {
    t: f64,
    v: f64,
}

/// The events of a response, in the order of time.
struct Events {
    /// Crossings of `v_f` from below.
    rises: Vec<Event>,
    /// Extremes since `v_f` was first crossed.
    tops: Vec<Event>,
    bottoms: Vec<Event>,
    /// Time at which the velocity enters the band for good, and its logarithmic slope there; least distance of an extremum from an edge, in `ln v`.
    settled: Option<(Event, f64)>,
    margin: f64,
}

impl Events {
    fn of(followed: &Followed, v_f: f64) -> Events {
        let samples = &followed.samples;
        let at = |s: f64| followed.at(s);
        let crossing = |i: usize, level: f64| {
            let rising = samples[i + 1].1.v > level;
            let moment = at(bisect(samples[i].0, samples[i + 1].0, |s| (at(s).v > level) != rising));
            Event { t: moment.t, v: moment.v }
        };
        let mut events = Events { rises: vec![], tops: vec![], bottoms: vec![], settled: None, margin: f64::INFINITY };
        let mut met = false;
        let edges = [v_f * (1.0 - SETTLED), v_f * (1.0 + SETTLED)];
        let inside = |v: f64| v > edges[0] && v < edges[1];
        let (_, first) = samples[0];
        events.settled = inside(first.v).then_some((Event { t: first.t, v: first.v }, f64::INFINITY));
        for i in 0..samples.len() - 1 {
            let (v, next) = (samples[i].1.v, samples[i + 1].1.v);
            if (v < v_f) != (next < v_f) {
                met = true;
                if next >= v_f {
                    events.rises.push(crossing(i, v_f));
                }
            }
            if !inside(v) && inside(next) {
                let edge = edges[usize::from(v > v_f)];
                let entry = crossing(i, edge);
                let speed = (next / v).ln() / (samples[i + 1].1.t - samples[i].1.t);
                events.settled = Some((entry, speed.abs()));
            } else if !inside(next) {
                events.settled = None;
            }
            let before = if i > 0 { samples[i - 1].1.v } else { v };
            for (sign, kept) in [(1.0, &mut events.tops), (-1.0, &mut events.bottoms)] {
                if i > 0 && sign * (v - before) > 0.0 && sign * (next - v) <= 0.0 {
                    let (t, v) = followed.extremum(i, sign);
                    let edge = edges.iter().map(|edge| (v / edge).ln().abs()).fold(f64::INFINITY, f64::min);
                    events.margin = events.margin.min(edge);
                    if met {
                        kept.push(Event { t, v });
                    }
                }
            }
        }
        events
    }
}

pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, state) = (transition(&row.point), row.point.state_law());
    let SpringBlock { k, m, .. } = slider(&row.point);
    let Transition { law, v_i, v_f } = problem;
    hopf::Point::new(state, law, m * v_f * v_f).compare_coefficient(row);
    // The block follows a rigid spring at once.
    if !(k.is_finite() && v_i != v_f) {
        return Ok(());
    }
    let step = VelocityStep { state_law: state, transition: problem, k, m };
    let infinite = diverges(&step).ok_or("steps without mass that an explicit integrator does not decide")?;
    if row.compare_feasible(!infinite) {
        let followed = follow(row, step)?;
        compare(row, &step, &followed);
    }
    Ok(())
}

/// Pieces of unit length over which a step without mass is followed, and the distance from steady sliding at which it has settled.
const MASSLESS_PIECES: u32 = 2000;
const MASSLESS_REST: f64 = 1e-3;

/// Whether the velocity becomes infinite: without mass, below `b - a`, and with other laws than ageing from the place on where `-G(u)/u`
/// reaches `k/(b - a)`. `None` if unknown.
///
/// In `y = ln(theta v_f)` and `q = ln u` over slip, which is scaled so that no slope is large.
fn diverges(
    &VelocityStep { state_law, transition: Transition { law: Law { a, b }, v_i, v_f }, k, m }: &VelocityStep,
) -> Option<bool> {
    if m > 0.0 || b <= a {
        return Some(false);
    }
    if state_law == StateLaw::Ageing || (state_law == StateLaw::Slip && k < b - a) {
        return Some(k < b - a);
    }
    // A negative potential falls, and its sublevels are compact.
    let x = (v_i / v_f).ln();
    if state_law == StateLaw::Slip && k > b - a && k * (-x).exp_m1() + (k - (b - a)) * x < a {
        return Some(false);
    }
    let growth = |q: f64| state_law.rate(q.exp()) / q.exp();
    let slope = |&[y, q]: &[f64; 2]| {
        let (growth, pull) = (growth(q), k * ((y - q).exp() - 1.0));
        let scale = 1.0 / (1.0 + growth.abs() + pull.abs() / a);
        [scale * growth, scale * (pull - (b - a) * growth) / a]
    };
    let mut state = [(v_f / v_i).ln(), 0.0];
    for _ in 0..MASSLESS_PIECES {
        state = integrate(slope, state, (0.0, 1.0))?;
        if -growth(state[1]) >= k / (b - a) {
            return Some(true);
        }
        if k > b - a && state.iter().all(|x| x.abs() < MASSLESS_REST) {
            return Some(false);
        }
    }
    None
}

/// The traced response, with its errors as differences; the reason where there is none.
fn follow(row: &mut CheckedRow<'_>, step: VelocityStep) -> Result<Followed, &'static str> {
    let rtol = row.context.rtol;
    let response = step.respond(rtol).1.filter(|response| response.outcome != Outcome::Undecided);
    let response = response.ok_or("undecided responses")?;
    let more = response.cycle.map_or(0.0, |cycle| MORE_CYCLES * cycle.period);
    // The slope of the velocity, which determines the time of the peak, has fewer digits than the velocity.
    let motion = step.motion(response.t_end + more, 0.01 * rtol);
    let motion = motion.filter(|motion| motion.landmarks().len() <= MAX_PANELS as usize);
    let motion = motion.ok_or("responses of more than 10,000 steps")?;
    let VelocityStep { state_law, transition: Transition { law, .. }, k, m } = step;
    let followed = Followed::new(Box::new(motion), state_law, &SpringBlock { law, k, m }, 0);
    row.push("motion", followed.equation);
    row.push("control", followed.control);
    Ok(followed)
}

/// Greatest and least velocity of these extremes, `v_f` without any.
fn range(events: &Events, v_f: f64, (from, to): (f64, f64)) -> [Event; 2] {
    let within = |events: &[Event], sign: f64| {
        let inside = events.iter().filter(|event| event.t > from && event.t < to);
        inside.fold(
            Event { t: f64::NAN, v: v_f },
            |best, event| if sign * event.v > sign * best.v { *event } else { best },
        )
    };
    [within(&events.tops, 1.0), within(&events.bottoms, -1.0)]
}

/// The last whole cycle of a response.
struct LastCycle {
    period: f64,
    top: f64,
    bottom: f64,
    /// Approximate relative distance from the limit cycle.
    apart: f64,
}

impl LastCycle {
    /// The last cycle, if there are enough.
    fn of(events: &Events, v_f: f64, rtol: f64) -> Option<LastCycle> {
        let cycle = |back: usize| {
            let first = events.rises.len().checked_sub(2 + back)?;
            let [from, to] = [events.rises[first].t, events.rises[first + 1].t];
            let [top, bottom] = range(events, v_f, (from, to)).map(|event| event.v);
            Some(LastCycle { period: to - from, top, bottom, apart: f64::INFINITY })
        };
        // Cycles far apart determine a slow change.
        let stride = (events.rises.len() / 4).max(1);
        let (first, second, third) = (cycle(2 * stride)?, cycle(stride)?, cycle(0)?);
        let change = |one: &LastCycle, next: &LastCycle| {
            (next.period / one.period - 1.0).abs() + (next.top / one.top - 1.0).abs()
        };
        let [before, last] = [change(&first, &second), change(&second, &third)];
        let apart = match () {
            () if last < rtol => last,
            // The further changes of an approach are a geometric series.
            () if last < before && (second.top < first.top) == (third.top < second.top) => {
                last * last / (before - last)
            }
            // An oscillation that still grows.
            () => f64::INFINITY,
        };
        Some(LastCycle { apart, ..third })
    }
}

/// Compares the numbers of a response with its trace.
fn compare(row: &mut CheckedRow<'_>, step: &VelocityStep, followed: &Followed) {
    let (&VelocityStep { transition: Transition { law, v_i, v_f }, k, m, .. }, rtol) = (step, row.context.rtol);
    let events = Events::of(followed, v_f);
    let [peak, trough] = range(&events, v_f, (0.0, f64::INFINITY));
    // Effect of an error of the spring force on a quasi-static ln v.
    let felt = (k / law.a * (m * v_f * v_f / law.a)).sqrt().max(1.0).sqrt();
    let lowest = trough.v.min(v_i);
    if lowest.ln().abs() > 100.0 * felt * rtol {
        row.compare_word(STATUS, if lowest < 1.0 { "below_bound" } else { "ok" });
    }
    // A response does not settle at unstable steady sliding.
    let settled = events.settled.filter(|_| SteadySliding::new(law, k, m, v_f).is_stable());
    let last = LastCycle::of(&events, v_f, rtol);
    let vague = last.as_ref().map_or(f64::INFINITY, |last| 1.0 + last.apart / rtol);
    // A limit cycle that is approached slowly has greater extremes than any cycle of the trace.
    if settled.is_some() || vague <= MAX_CYCLE_RTOLS {
        let vague = if settled.is_some() { 1.0 } else { vague };
        row.compare_relative("v_peak", peak.v, vague * peak.v);
        row.compare_number("v_trough", trough.v, vague * felt * trough.v);
        let overshoot = peak.v / v_f - 1.0;
        if overshoot > MIN_OVERSHOOT {
            row.compare_number("t_peak", peak.t, (peak.t + 1.0 / v_f) / overshoot.min(1.0));
        }
    }
    row.compare_word("outcome", if settled.is_some() { "settled" } else { "limit_cycle" });
    if let Some((entry, speed)) = settled {
        // Nearer to an edge of the band, it is undetermined whether an extremum leaves it.
        if events.margin > MAX_DIFFERENCE_RTOLS * rtol {
            let scale = entry.t.max(0.1 / (v_f * (1.0 + k / law.a))) + 1.0 / speed;
            row.compare_number("settling_time", entry.t, scale);
        } else {
            row.miss("settling times that depend on rounding");
        }
        return;
    }
    let Some(LastCycle { period, top, bottom, .. }) = last.filter(|_| vague <= MAX_CYCLE_RTOLS) else {
        return row.miss("cycles that are approached slowly");
    };
    row.compare_relative("period", period, vague * period);
    row.compare_relative("cycle_peak", top, vague * top);
    row.compare_number("cycle_trough", bottom, vague * felt * bottom);
}
