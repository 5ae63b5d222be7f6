//! `crossover`: the special times are in order, and what is special happens there.

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::Status;
use slipsweep::protocol::optimal::crossover::{self, CrossoverTimes};
use slipsweep::protocol::optimal::{self, Optimum};

use super::random::{EVERY_TIME, Random};
use super::{POINTS, Row, sample};

#[derive(Debug)]
struct Point {
    transition: Transition,
    bounded: bool,
    rtol: f64,
}

fn draw(random: &mut Random) -> Point {
    Point { transition: random.transition(), bounded: random.chance(0.7), rtol: random.rtol() }
}

const FINE: f64 = 1e-13;

/// The special times and the works there, by their columns.
pub fn columns(times: &CrossoverTimes) -> [(&'static str, Option<f64>); 12] {
    [
        ("t_cross", times.t_cross),
        ("t_floor", times.t_floor),
        ("t_cheapest", times.t_cheapest),
        ("t_min", times.t_min),
        ("t_turn", times.t_turn),
        ("t_free_in", times.t_free_in),
        ("t_free_out", times.t_free_out),
        ("work_at_t_cross", times.work_at_t_cross),
        ("work_at_t_floor", times.work_at_t_floor),
        ("work_at_t_cheapest", times.work_at_t_cheapest),
        ("work_at_t_min", times.work_at_t_min),
        ("work_at_t_turn", times.work_at_t_turn),
    ]
}

#[test]
fn every_special_time_is_right_or_is_said_not_to_be() {
    sample("crossover", POINTS, draw, |point, row| {
        let &Point { ref transition, bounded, rtol } = point;
        let (status, rough, _) = crossover::solve(transition, bounded, rtol, EVERY_TIME);
        row.status(status);
        row.fact("finite", columns(&rough).into_iter().filter_map(|(_, found)| found).all(f64::is_finite));
        let (fine_status, fine, _) = crossover::solve(transition, bounded, FINE, EVERY_TIME);
        row.fact("converged at 1e-13", fine_status != Status::NotConverged);
        if status != Status::Ok || fine_status != Status::Ok {
            return;
        }
        for ((_, rough), (_, fine)) in columns(&rough).into_iter().zip(columns(&fine)) {
            row.fact("exists at every accuracy", rough.is_some() == fine.is_some());
            if let (Some(rough), Some(fine)) = (rough, fine) {
                row.agree("to rtol", rough, fine, 2.0 * rtol + 2.0 * FINE);
            }
        }
        order(transition, &fine, row);
        happens(point, &fine, row);
    });
}

fn order(transition: &Transition, times: &CrossoverTimes, row: &mut Row) {
    let &CrossoverTimes { t_cross, t_floor, t_cheapest, t_min, t_turn, t_free_in, t_free_out, .. } = times;
    let rises = |chain: &[Option<f64>]| {
        let known: Vec<f64> = chain.iter().copied().flatten().collect();
        known.windows(2).all(|pair| pair[0] <= pair[1] * (1.0 + 8.0 * FINE))
    };
    row.fact("in order", rises(&[t_cheapest, t_cross, t_floor]) && rises(&[t_min, t_free_in, t_turn, t_free_out]));
    let faster = transition.v_f > transition.v_i;
    let of_the_other = if faster { [t_min, t_turn, t_free_in] } else { [t_cross, t_floor, t_cheapest] };
    row.fact("of its own direction", of_the_other.iter().all(Option::is_none));
}

/// The optimum at the special times does what is special about them.
fn happens(point: &Point, times: &CrossoverTimes, row: &mut Row) {
    let &Point { ref transition, bounded, .. } = point;
    let &Transition { law: Law { a, b }, v_i, v_f } = transition;
    let least = optimal::shortest_time(transition, bounded).expect("is in the domain");
    let at = |time: Option<f64>| -> Option<(f64, Optimum)> {
        let t = time.filter(|&t| t > 0.0)?;
        let solved = optimal::solve(transition, t, bounded, FINE);
        Some((t, solved.value.filter(|_| matches!(solved.status, Status::Ok | Status::BelowBound))?))
    };
    // What a rounding of t leaves open of the time beyond the least, and of the velocities at the ends.
    let doubt = |t: f64| 4.0 * FINE + 8.0 * f64::EPSILON * t / (t - least);
    let steady = |v: f64| v * (1.0 + (a - b) * v.ln());
    let size = |v: f64| v * (1.0 + (a + b) * v.ln());
    let works = [
        (times.t_cross, times.work_at_t_cross),
        (times.t_floor.filter(|_| bounded), times.work_at_t_floor),
        (times.t_cheapest, times.work_at_t_cheapest),
        (times.t_min, times.work_at_t_min),
        (times.t_turn, times.work_at_t_turn),
    ];
    for (time, work) in works {
        if let (Some((t, found)), Some(work)) = (at(time), work) {
            let allowed = if t == least { 8.0 * FINE } else { 4.0 * FINE + 2.0 * doubt(t) };
            row.agree("work is the optimum's", work, found.work, allowed);
        }
    }
    // Stationary in t_f at the inflection: the Hamiltonian is the largest, or least, there.
    if let Some((t, found)) = at(times.t_cross) {
        row.at_most("v(0+) = v_i at t_cross", (found.v_start / v_i - 1.0).abs(), doubt(t) / a.min(1.0));
        row.at_most("C at t_cross", (found.hamiltonian - steady(v_i)).abs(), 8.0 * FINE * size(v_i));
        inflection(transition, bounded, t, least, steady(v_i), size(v_i), row);
    }
    if let Some((t, found)) = at(times.t_turn) {
        row.at_most("v(t_f-) = v_f at t_turn", (found.v_end / v_f - 1.0).abs(), doubt(t) / a.min(1.0));
        row.at_most("C at t_turn", (found.hamiltonian - steady(v_f)).abs(), 8.0 * FINE * size(v_f));
        inflection(transition, bounded, t, least, steady(v_f), size(v_f), row);
    }
    if let Some((t, found)) = at(times.t_cheapest) {
        let slope = found.hamiltonian.abs() * t;
        row.at_most("C = 0 at t_cheapest", slope, doubt(t) * (found.work + size(v_i) * t) * (1.0 + 1.0 / a));
    }
    if let Some((t, found)) = at(times.t_floor.filter(|_| bounded)) {
        row.at_most("v(0+) = 1 at t_floor", found.v_start - 1.0, doubt(t) / a.min(1.0));
        row.at_most("no hold at t_floor", found.time_at_floor, 16.0 * f64::EPSILON * t + doubt(t) * t);
    }
}

/// The Hamiltonian is largest at the inflection of `W*`.
fn inflection(transition: &Transition, bounded: bool, t: f64, least: f64, most: f64, size: f64, row: &mut Row) {
    for fraction in [-1e-1, -1e-3, 1e-3, 1e-1, 10.0] {
        let solved = optimal::solve(transition, t + fraction * (t - least), bounded, FINE);
        if let (Some(found), Status::Ok | Status::BelowBound) = (solved.value, solved.status) {
            row.at_most("an inflection", found.hamiltonian - most, 8.0 * FINE * size);
        }
    }
}
