//! `optimal` under ceilings: random points of the physical domain, many of them near the least feasible ceilings, near the
//! peaks of the free optimum and near steady sliding on a ceiling. Bounds are kept, times are feasible exactly where the
//! least ceilings say so, and no admissible protocol is cheaper.

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::optimal::{
    Bounds, FeedbackPoint, Optimum, Slopes, feasible_times, feedback_at, least_tau_ceiling, least_v_ceiling, obstacle,
    shortest_time, slopes, solve,
};
use slipsweep::protocol::{Solved, Status};

use super::random::Random;
use super::{POINTS, Row, sample};

#[derive(Debug, Clone, Copy)]
struct Point {
    transition: Transition,
    t_f: f64,
    bounds: Bounds,
    rtol: f64,
    /// A fraction that chooses a variation.
    place: f64,
}

const FINE: f64 = 1e-13;

/// The physical domain of docs/spec.md.
fn transition(random: &mut Random) -> Transition {
    let a = random.between(1e-3, 0.3);
    let b = match (random.uniform() * 6.0) as u32 {
        0 => 0.0,
        1 => a,
        2 => a * random.between(0.05, 0.99),
        _ => (a * random.between(1.01, 20.0)).min(0.5),
    };
    let b = if b != a && (b / a - 1.0).abs() < 1e-3 { a } else { b };
    let v_i = 1.0 + random.between(1e-3, 1e10);
    let v_f = match (random.uniform() * 10.0) as u32 {
        0 => v_i,
        1 => 1.0 + (v_i - 1.0) * (1.0 + random.between(1e-5, 1.0)),
        2..=5 => v_i * random.between(1.0 + 1e-5, 1e4),
        _ => 1.0 + (v_i - 1.0) * random.between(1e-4, 1.0),
    };
    Transition { law: Law { a, b }, v_i, v_f: v_f.clamp(1.001, 1e10) }
}

fn draw(random: &mut Random) -> Point {
    let (transition, floor) = (transition(random), random.chance(0.75));
    let fast = transition.v_i.max(transition.v_f);
    let least = shortest_time(&transition, floor).expect("is in the domain");
    let t_f = match random.chance(0.5) {
        true => least + random.between(1e-3, 1e4) / fast,
        false => least * (1.0 + random.between(1e-9, 1e2)) + random.between(1e-3, 30.0) / transition.v_f,
    };
    let (t_f, free) = (t_f.min(1e4), Bounds::new(floor));
    let optimum = solve(&transition, t_f, free, FINE).value;
    let mut bounds = free;
    let kind = random.uniform();
    if kind < 0.6 {
        let peak = optimum.map_or(10.0 * fast, |found| found.v_end.max(found.v_start));
        let low = least_v_ceiling(&transition, t_f, bounds, FINE).unwrap_or(transition.v_f);
        bounds = bounds.with_v_ceiling(between(random, low, peak));
    }
    if kind > 0.3 {
        let peak = optimum.map_or(2.0, |found| found.friction_max);
        let low = least_tau_ceiling(&transition, t_f, bounds, FINE).unwrap_or(1.0);
        bounds = bounds.with_tau_ceiling(between(random, low, peak));
    }
    Point { transition, t_f, bounds, rtol: random.between(1e-12, 1e-4), place: random.uniform() }
}

/// A ceiling between the least feasible one and the peak of the free optimum, often near one of them, seldom below.
fn between(random: &mut Random, least: f64, peak: f64) -> f64 {
    let width = (peak - least).abs().max(1e-6 * least.abs());
    match (random.uniform() * 8.0) as u32 {
        0 => least + width * random.between(1e-9, 1.0),
        1 => least + least.abs() * random.between(2e-9, 1e-2),
        2 => peak - width * random.between(1e-9, 1.0),
        3 => peak + width * random.between(1e-9, 10.0),
        4 => least - least.abs() * random.between(2e-9, 1e-2),
        _ => least + width * random.uniform(),
    }
}

/// The numbers of a row whose extremal is the only one.
fn certain(solved: &Solved<Optimum>) -> Option<Optimum> {
    solved.value.filter(|_| matches!(solved.status, Status::Ok | Status::BelowBound))
}

#[test]
fn every_optimum_under_ceilings_is_right_or_states_so() {
    sample("ceilings", POINTS, draw, |point, row| {
        let &Point { ref transition, t_f, bounds, rtol, .. } = point;
        let solved = solve(transition, t_f, bounds, rtol);
        row.status(solved.status);
        feasible_where_the_limits_say(point, &solved, row);
        let Some(found) = solved.value else { return };
        keeps_its_bounds(point, &found, row);
        let fine = solve(transition, t_f, bounds, FINE);
        row.fact("converged at 1e-13", fine.status != Status::NotConverged);
        let (Some(rough), Some(fine)) = (certain(&solved), certain(&fine)) else { return };
        let noise = noise_of_work(point, ROUNDINGS);
        // Of either work.
        row.at_most("work to rtol", (rough.work - fine.work).abs(), 2.0 * rtol * fine.work.abs() + 2.0 * noise);
        ceilings_cost(point, &fine, row);
        slopes_are_slopes(point, row);
        starts_like_its_feedback(point, &fine, row);
        dynamic_programming(point, &fine, row);
        two_velocities(point, &fine, row);
    });
}

/// Roundings of an input until it is a term of the work. Chosen: those of a few operations.
const ROUNDINGS: f64 = 4.0;

/// What the solver and some roundings of each input may make of the work.
fn noise_of_work(point: &Point, roundings: f64) -> f64 {
    let &Point { transition: Transition { law, v_i, v_f }, t_f, bounds, .. } = point;
    let (solved, found) = slopes(&point.transition, t_f, bounds, FINE);
    let Some(optimum) = solved.value else { return 0.0 };
    let mut inputs = optimum.hamiltonian.abs() * t_f;
    if let Some(slope) = found {
        let bound = |slope: f64, ceiling: f64| if slope == 0.0 { 0.0 } else { slope * ceiling };
        let by_velocities = (slope.v_i * v_i).abs() + (slope.v_f * v_f).abs();
        let by_ceilings = bound(slope.v_ceiling, bounds.v_ceiling) + bound(slope.tau_ceiling, bounds.tau_ceiling);
        inputs += (slope.a * law.a).abs() + (slope.b * law.b).abs() + by_velocities + by_ceilings.abs();
    }
    64.0 * FINE * optimum.work.abs() + roundings * f64::EPSILON * inputs
}

fn feasible_where_the_limits_say(point: &Point, solved: &Solved<Optimum>, row: &mut Row) {
    let &Point { ref transition, t_f, bounds, .. } = point;
    let infeasible = solved.status == Status::Infeasible;
    row.fact("an obstacle where it is infeasible alone", obstacle(transition, t_f, bounds).is_some() == infeasible);
    let v = least_v_ceiling(transition, t_f, bounds, FINE);
    let tau = least_tau_ceiling(transition, t_f, bounds, FINE);
    row.fact("least ceilings exist where it is feasible", infeasible || (v.is_some() && tau.is_some()));
    let near = |ceiling: f64, least: Option<f64>, with: &dyn Fn(f64) -> Bounds| {
        let Some(least) = least.filter(|_| ceiling.is_finite()) else { return false };
        let doubt = doubt_of_least(point, with(least + RAISE * least.abs()));
        (ceiling - least).abs() <= (1e-9 + doubt) * least.abs()
    };
    let near_v = near(bounds.v_ceiling, v, &|v| bounds.with_v_ceiling(v));
    let near_tau = near(bounds.tau_ceiling, tau, &|tau| bounds.with_tau_ceiling(tau));
    // Near the least ceiling of one kind, rounding of that ceiling decides on the least one of the other.
    for (ceiling, least) in [(bounds.v_ceiling, v), (bounds.tau_ceiling, tau)] {
        let Some(least) = least.filter(|_| ceiling.is_finite() && !near_v && !near_tau) else { continue };
        row.fact("feasible above the least ceiling alone", infeasible == (ceiling < least));
    }
    if let Some((least, most)) = feasible_times(transition, bounds) {
        let inside = (least * (1.0 + 1e-9)..=most * (1.0 - 1e-9)).contains(&t_f);
        row.fact("feasible between the limits of the time", !inside || !infeasible);
        let outside = t_f < least * (1.0 - 1e-9) || t_f > most * (1.0 + 1e-9);
        row.fact("infeasible beyond the limits of the time", !outside || infeasible);
    }
}

/// By which fraction a least ceiling is raised to learn how the limit of the time changes with it.
const RAISE: f64 = 1e-6;

/// What 16 roundings of the time make of a least ceiling, relative: on it the limit of the time is `t_f`, and `raised` has it
/// higher by [`RAISE`]. Where the other ceiling keeps the limit, the least one has few digits.
fn doubt_of_least(point: &Point, raised: Bounds) -> f64 {
    let &Point { ref transition, t_f, .. } = point;
    let Some((least, most)) = feasible_times(transition, raised) else { return 0.0 };
    let limit = if transition.v_f < transition.v_i { most } else { least };
    16.0 * f64::EPSILON * RAISE / (limit / t_f).ln().abs()
}

fn keeps_its_bounds(point: &Point, found: &Optimum, row: &mut Row) {
    let &Point { ref transition, t_f, bounds, .. } = point;
    let times = [found.time_at_floor, found.time_at_v_ceiling, found.time_at_tau_ceiling];
    let numbers = [found.work, found.v_start, found.v_end, found.hamiltonian, found.theta_max, found.friction_max];
    row.fact("finite", numbers.iter().chain(&times).all(|number| number.is_finite()));
    row.fact("times are positive", times.iter().all(|&time| time >= 0.0));
    row.at_most("times are parts of t_f", times.iter().sum::<f64>() - t_f, 64.0 * f64::EPSILON * t_f);
    for v in [found.v_start, found.v_end] {
        row.fact("the floor is kept", !bounds.floor || v >= 1.0);
        row.at_most("the ceiling of velocity is kept", v - bounds.v_ceiling, 8.0 * f64::EPSILON * v);
        let theta = if v == found.v_start { 1.0 / transition.v_i } else { 1.0 / transition.v_f };
        let tau = 1.0 + transition.law.a * v.ln() + transition.law.b * theta.ln();
        row.at_most(
            "the ceiling of friction is kept",
            tau - bounds.tau_ceiling,
            64.0 * f64::EPSILON * (1.0 + v.ln().abs()),
        );
        row.at_most("friction_max is the greatest", tau - found.friction_max, point.rtol + 64.0 * f64::EPSILON);
    }
    row.at_most("friction_max is below its ceiling", found.friction_max - bounds.tau_ceiling, 64.0 * f64::EPSILON);
}

/// A tighter ceiling costs work; one that does not bind costs nothing; none is the free optimum to the last bit.
fn ceilings_cost(point: &Point, fine: &Optimum, row: &mut Row) {
    let &Point { ref transition, t_f, bounds, place, .. } = point;
    let noise = noise_of_work(point, ROUNDINGS);
    let plain = solve(transition, t_f, bounds.without_ceilings(), FINE);
    if let Some(free) = certain(&plain) {
        row.at_most("ceilings cost", free.work - fine.work, noise);
        let binds = free.v_start.max(free.v_end) > bounds.v_ceiling || free.friction_max > bounds.tau_ceiling;
        row.fact(
            "no time on a ceiling that does not bind",
            binds || fine.time_at_v_ceiling + fine.time_at_tau_ceiling == 0.0,
        );
        if !binds {
            row.at_most("ceilings that do not bind", (fine.work - free.work).abs(), noise);
        }
    }
    let none = solve(transition, t_f, bounds.with_v_ceiling(f64::INFINITY).with_tau_ceiling(f64::INFINITY), FINE);
    row.fact("without ceilings the free optimum", none.value == plain.value && none.status == plain.status);
    // Decreasing and, while theta only falls, convex.
    let factor = 1.0 + 0.1 * place * place * place + 1e-6;
    let raised =
        [bounds.with_v_ceiling(bounds.v_ceiling * factor), bounds.with_tau_ceiling(bounds.tau_ceiling * factor)];
    let twice = [
        bounds.with_v_ceiling(bounds.v_ceiling * (2.0 * factor - 1.0)),
        bounds.with_tau_ceiling(bounds.tau_ceiling * (2.0 * factor - 1.0)),
    ];
    for (raised, twice) in raised.into_iter().zip(twice) {
        let (Some(raised), Some(twice)) =
            (certain(&solve(transition, t_f, raised, FINE)), certain(&solve(transition, t_f, twice, FINE)))
        else {
            continue;
        };
        row.at_most("W* falls with a ceiling", raised.work - fine.work, noise);
        let falls = 1.0 / fine.theta_max >= transition.v_i * (1.0 - 1e-12) && transition.v_f > transition.v_i;
        if falls {
            row.at_most("W* is convex in a ceiling", 2.0 * raised.work - fine.work - twice.work, 4.0 * noise);
        }
    }
}

/// Differences of the work are integrals of the slopes, by Simpson's rule of five nodes. Its error is below its distances from
/// the trapezium rule and from Simpson's of three nodes, also where the slope is singular at an end, as at a limit of what is
/// feasible. Where an arc comes or goes the slope has a kink, whose part may cancel that of the smooth parts in these distances:
/// the steps are then shorter, as where the slope changes by half.
fn slopes_are_slopes(point: &Point, row: &mut Row) {
    let parameter = (point.place * 7.0) as usize;
    // Far less than the motion, within which arcs change.
    let &Point { transition: Transition { law: Law { a, b }, v_i, v_f }, t_f, bounds, .. } = point;
    let step = 1e-4 * (t_f * v_i.max(v_f)).min(1.0);
    // The slope by a ceiling has the logarithm of its distance from steady sliding at the end.
    let steady = [v_f, 1.0 + (a - b) * v_f.ln()];
    let distance = match parameter {
        4 => (bounds.v_ceiling / steady[0] - 1.0).abs(),
        5 => (bounds.tau_ceiling / steady[1] - 1.0).abs(),
        _ => f64::INFINITY,
    };
    let step = if distance > 0.0 { step.min(0.1 * distance) } else { step };
    for shorter in [1.0, 1.0 / 16.0, SHORTEST] {
        let at = |i: u32| Sloped::at(point, parameter, 0.25 * step * shorter * f64::from(i));
        let Some(nodes) = (0..5).map(at).collect::<Option<Vec<_>>>() else { return };
        let [first, .., last] = &nodes[..] else { return };
        if !first.x.is_finite() || first.x == 0.0 {
            return;
        }
        let varies = (last.slope - first.slope).abs() > 0.5 * first.slope.abs().max(last.slope.abs());
        if nodes.iter().any(|node| node.arcs != first.arcs) || (varies && shorter > SHORTEST) {
            continue;
        }
        let trapezium = |by: usize| {
            let inner: f64 = nodes.iter().skip(by).step_by(by).map(|node| node.slope).sum();
            (inner + 0.5 * (first.slope - last.slope)) * by as f64 / 4.0
        };
        let (coarse, middle, fine) = (trapezium(4), trapezium(2), trapezium(1));
        let (rough, simpson) = ((4.0 * middle - coarse) / 3.0, (4.0 * fine - middle) / 3.0);
        let small = 1e-6 * (last.slope - first.slope).abs() + 1e-11 * first.slope.abs();
        let bend = (simpson - fine).abs() + (simpson - rough).abs() + small;
        let names = ["dW*/da", "dW*/db", "dW*/dv_i", "dW*/dv_f", "dW*/dv_ceiling", "dW*/dtau_ceiling", "dW*/dt_f"];
        let dx = last.x - first.x;
        let allowed = 4.0 * noise_of_work(point, ROUNDINGS) + bend * dx.abs();
        row.at_most(names[parameter], (last.work - first.work - simpson * dx).abs(), allowed);
        return;
    }
}

/// The shortest steps, in units of the longest.
const SHORTEST: f64 = 1.0 / 256.0;

/// The work with one parameter changed, and its slope by that.
struct Sloped {
    x: f64,
    work: f64,
    slope: f64,
    /// Which arcs there are, as far as an optimum shows them: any at the three bounds, the ends at the ceilings.
    arcs: [bool; 7],
}

impl Sloped {
    /// The parameter is `a`, `b`, `v_i`, `v_f`, a ceiling or `t_f`; `step` is relative.
    fn at(point: &Point, parameter: usize, step: f64) -> Option<Sloped> {
        let &Point { mut transition, mut bounds, mut t_f, .. } = point;
        let number = match parameter {
            0 => &mut transition.law.a,
            1 => &mut transition.law.b,
            2 => &mut transition.v_i,
            3 => &mut transition.v_f,
            4 => &mut bounds.v_ceiling,
            5 => &mut bounds.tau_ceiling,
            _ => &mut t_f,
        };
        *number *= 1.0 + step;
        let x = *number;
        let (solved, found) = slopes(&transition, t_f, bounds, FINE);
        let optimum = certain(&solved)?;
        let Slopes { a, b, v_i, v_f, v_ceiling, tau_ceiling } = found?;
        let slope = [a, b, v_i, v_f, v_ceiling, tau_ceiling, optimum.hamiltonian][parameter];
        let Law { a, b } = transition.law;
        let on_tau = |v: f64, steady: f64| {
            let tau = 1.0 + a * v.ln() - b * steady.ln();
            (tau - bounds.tau_ceiling).abs() <= 64.0 * f64::EPSILON * (1.0 + v.ln().abs())
        };
        let arcs = [
            optimum.time_at_floor > 0.0,
            optimum.time_at_v_ceiling > 0.0,
            optimum.time_at_tau_ceiling > 0.0,
            optimum.v_start == bounds.v_ceiling,
            optimum.v_end == bounds.v_ceiling,
            on_tau(optimum.v_start, transition.v_i),
            on_tau(optimum.v_end, transition.v_f),
        ];
        Some(Sloped { x, work: optimum.work, slope, arcs })
    }
}

fn feedback(point: &Point, theta: f64, t_left: f64) -> Option<FeedbackPoint> {
    let &Point { transition: Transition { law, v_f, .. }, bounds, .. } = point;
    let solved = feedback_at(law, theta, t_left, v_f, bounds, FINE);
    solved.value.filter(|_| matches!(solved.status, Status::Ok | Status::BelowBound))
}

/// The law at the start is the start of the protocol.
fn starts_like_its_feedback(point: &Point, fine: &Optimum, row: &mut Row) {
    let theta = 1.0 / point.transition.v_i;
    // Where 1/v_i is exact.
    if 1.0 / theta != point.transition.v_i {
        return;
    }
    let Some(found) = feedback(point, theta, point.t_f) else { return };
    // Of either work. The feedback begins with theta, which is the rounded inverse of an input, and so is that at the end.
    let noise = noise_of_work(point, ROUNDINGS) + noise_of_work(point, ROUNDINGS + 1.0);
    row.at_most("feedback: work", (found.work_to_go - fine.work).abs(), noise);
}

/// Steps of theta and of the time left that are small compared with how far the time is from its limits, where the work is
/// singular; where no limit is known, those given.
fn within_limits(point: &Point, h: f64, k: f64) -> (f64, f64) {
    let s = point.t_f;
    let theta = 1.0 / point.transition.v_i;
    let room = |theta: f64| {
        let transition = Transition { v_i: 1.0 / theta, ..point.transition };
        let (least, most) = feasible_times(&transition, point.bounds)?;
        Some((s - least).min(most - s))
    };
    let Some(here) = room(theta) else { return (h, k) };
    let moved = [-2.0, 2.0].map(|i| room(theta + i * h).map_or(0.0, |there| (there - here).abs()));
    let moved = moved[0].max(moved[1]);
    let part = 4e-3 * here / moved;
    (if part < 1.0 { h * part } else { h }, k.min(1e-3 * here))
}

/// Hamilton, Jacobi and Bellman: `-dW/ds = min_v [tau v + (dW/dtheta) (1 - theta v)]` over the admissible velocities, by
/// differences of the work alone.
fn dynamic_programming(point: &Point, fine: &Optimum, row: &mut Row) {
    let &Point { transition: Transition { law: Law { a, b }, v_i, v_f }, t_f, bounds, place, .. } = point;
    let (theta_0, theta_1) = (1.0 / v_i, 1.0 / v_f);
    // A state on the way, or somewhat beyond its ends.
    let high = 1.2 * theta_0.max(theta_1);
    let (low, high) = (0.8 * theta_0.min(theta_1), if bounds.floor { high.min(0.999) } else { high });
    let theta = low * (high / low).powf(place);
    let s = t_f * (0.2 + 0.7 * (1.0 - place));
    let here_is = Point { transition: Transition { v_i: 1.0 / theta, ..point.transition }, t_f: s, ..*point };
    let h = 1e-3 * (theta_1 - theta).abs().max(1e-2 * theta).min(theta);
    let (h, k) = within_limits(&here_is, h, 1e-3 * s);
    let noise = noise_of_work(&here_is, ROUNDINGS);
    let w = |i: f64, j: f64| feedback(point, theta + i * h, s + j * k).map(|found| found.work_to_go);
    let Some(here) = feedback(point, theta, s) else { return };
    let difference = |i: f64, j: f64, step: f64| {
        let near = w(i, j)? - w(-i, -j)?;
        let far = w(2.0 * i, 2.0 * j)? - w(-2.0 * i, -2.0 * j)?;
        let (rough, good) = (far / (4.0 * step), (8.0 * near - far) / (12.0 * step));
        // Where the work is smooth the good one errs far less than the rough one. Where its second derivative jumps within the
        // differences, as where an arc begins, it errs by at most half of their distance. Noise has the weights (8 + 8 + 1 + 1)/12.
        Some((good, (good - rough).abs() + (1e3 * FINE * here.work_to_go.abs() + 1.5 * noise) / step))
    };
    let (Some((w_theta, e_theta)), Some((w_s, e_s))) = (difference(1.0, 0.0, h), difference(0.0, 1.0, k)) else {
        return;
    };
    row.at_most("costate is dW/dtheta", (here.costate - w_theta).abs(), e_theta + 1e-9 * here.costate.abs());
    let free = (theta * w_theta - 1.0 - a - b * theta.ln()) / a;
    let least = if bounds.floor { 0.0 } else { f64::NEG_INFINITY };
    let cap = bounds.v_ceiling.ln().min((bounds.tau_ceiling - 1.0 - b * theta.ln()) / a);
    let ln_v = free.max(least).min(cap);
    // The minimiser is known to what theta dW/dtheta is, over a.
    let doubtful = theta * e_theta / a + 1e-9;
    if here.v < 1e-280 {
        return;
    }
    row.at_most("v is the minimiser", (here.v.ln() - ln_v).abs(), doubtful + 1e-9);
    let v = ln_v.exp();
    let hamiltonian = (1.0 + a * ln_v + b * theta.ln()) * v + w_theta * (1.0 - theta * v);
    let allowed = e_s + e_theta * (1.0 + theta * v) + 1e-9 * (hamiltonian.abs() + v + fine.hamiltonian.abs());
    row.at_most("Hamilton, Jacobi and Bellman", (w_s - hamiltonian).abs(), allowed);
}

/// One velocity, then another that arrives: where both are admissible the work is no less.
fn two_velocities(point: &Point, fine: &Optimum, row: &mut Row) {
    let &Point { transition: Transition { law: Law { a, b }, v_i, v_f }, t_f, bounds, place, .. } = point;
    let low = if bounds.floor { 1.0 } else { 0.1 };
    let high = bounds.v_ceiling.min(1e3 * fine.v_end.max(fine.v_start));
    let first = low * (high / low).powf(place);
    let t_1 = t_f * (0.1 + 0.8 * (place * 97.0).fract());
    let after = |theta: f64, v: f64, t: f64| 1.0 / v + (theta - 1.0 / v) * (-v * t).exp();
    let (start, end, t_2) = (1.0 / v_i, 1.0 / v_f, t_f - t_1);
    let middle = after(start, first, t_1);
    // The second velocity, in which theta at the end falls.
    let (mut below, mut above) = (low, high);
    let brackets = (after(middle, below, t_2) - end) * (after(middle, above, t_2) - end) < 0.0;
    if !brackets {
        return;
    }
    for _ in 0..80 {
        let v = (below * above).sqrt();
        if after(middle, v, t_2) > end { below = v } else { above = v }
    }
    let second = above;
    let friction = |theta: f64, v: f64| 1.0 + a * v.ln() + b * theta.ln();
    let thetas = [(start, first), (middle, first), (middle, second), (end, second)];
    // Where friction is too low nothing bounds the work from below: the optimum is one of the protocols above that.
    let lowest = (b - a).max(0.0);
    if thetas.iter().any(|&(theta, v)| friction(theta, v) > bounds.tau_ceiling || friction(theta, v) <= lowest) {
        return;
    }
    let work = |theta: f64, v: f64, t: f64| {
        // Simpson's rule over 400 intervals of the relaxing theta, graded towards the start.
        let n = 400;
        let density = |x: f64| 3.0 * x * x * friction(after(theta, v, t * x * x * x), v) * v;
        let inner: f64 = (1..n).map(|i| f64::from(2 + 2 * (i % 2)) * density(f64::from(i) / f64::from(n))).sum();
        t * (density(0.0) + inner + density(1.0)) / (3.0 * f64::from(n))
    };
    let total = work(start, first, t_1) + work(middle, second, t_2);
    row.at_most("two velocities are no cheaper", fine.work - total, 1e-6 * fine.work.abs());
}
