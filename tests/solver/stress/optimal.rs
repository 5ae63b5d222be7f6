//! `optimal`: what is conserved, the derivative of the least work, monotone families, scaling, and limits.

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::optimal::{Optimum, Strategy, shortest_time, solve};
use slipsweep::protocol::{Solved, Status};

use super::random::Random;
use super::{POINTS, Row, sample};

#[derive(Debug)]
struct Point {
    transition: Transition,
    t_f: f64,
    bounded: bool,
    rtol: f64,
}

fn draw(random: &mut Random) -> Point {
    let (transition, bounded) = (random.transition(), random.chance(0.7));
    let t_f = random.duration(&transition, bounded);
    Point { transition, t_f, bounded, rtol: random.rtol() }
}

const FINE: f64 = 1e-13;

/// The numbers of a row whose extremal is the only one.
fn certain(solved: &Solved<Optimum>) -> Option<Optimum> {
    solved.value.filter(|_| matches!(solved.status, Status::Ok | Status::BelowBound))
}

/// What `t_f` as a double leaves open.
struct Doubt {
    /// Of the time beyond the least one.
    time: f64,
    a: f64,
    t_f: f64,
}

impl Doubt {
    fn of(point: &Point) -> Doubt {
        let least = shortest_time(&point.transition, point.bounded).expect("is in the domain");
        let time = f64::EPSILON * point.t_f / (point.t_f - least);
        Doubt { time, a: point.transition.law.a, t_f: point.t_f }
    }

    /// Of a velocity at an end: the way in `ln u` goes like the time over `a`.
    fn velocity(&self, v: f64) -> f64 {
        (self.time + 4.0 * f64::EPSILON * v.ln().abs()) / self.a
    }
}

#[test]
fn every_optimum_is_right_or_states_so() {
    sample("optimal", POINTS, draw, |point, row| {
        let &Point { ref transition, t_f, bounded, rtol } = point;
        let solved = solve(transition, t_f, bounded, rtol);
        row.status(solved.status);
        let least = shortest_time(transition, bounded).expect("is in the domain");
        let exists = t_f > least || (bounded && t_f == least);
        row.fact("infeasible below the least time alone", (solved.status != Status::Infeasible) == exists);
        if let Some(found) = solved.value {
            sound(transition, t_f, bounded, &solved, &found, row);
        }
        let fine = solve(transition, t_f, bounded, FINE);
        row.fact("converged at 1e-13", fine.status != Status::NotConverged);
        let (Some(rough), Some(fine)) = (certain(&solved), certain(&fine)) else { return };
        let doubt = Doubt::of(point);
        accuracies_agree(point, &doubt, &rough, &fine, row);
        conserved(transition, &doubt, &fine, row);
        slope(point, &doubt, &fine, row);
        bound_costs(point, &fine, row);
        if !bounded {
            scaled(point, &doubt, &fine, row);
        }
        near_equal(point, &fine, row);
    });
}

/// What any row must be.
fn sound(transition: &Transition, t_f: f64, bounded: bool, solved: &Solved<Optimum>, found: &Optimum, row: &mut Row) {
    let &Optimum { work, v_start, v_end, time_at_floor, hamiltonian, theta_max, strategy, .. } = found;
    let numbers = [work, v_start, v_end, time_at_floor, hamiltonian, theta_max];
    row.fact("finite", numbers.iter().all(|number| number.is_finite()));
    row.fact("has a status with numbers", !matches!(solved.status, Status::Infeasible | Status::NotConverged));
    row.fact("velocities are positive", v_start >= 0.0 && v_end >= 0.0);
    row.fact("the bound is kept", !bounded || (v_start >= 1.0 && v_end >= 1.0 && theta_max <= 1.0));
    if certain(solved).is_none() {
        return;
    }
    row.fact("work is positive", work > 0.0);
    row.fact("hold within the time", (0.0..=t_f).contains(&time_at_floor));
    let expected = if time_at_floor > 0.0 {
        Strategy::Floor
    } else if v_start / transition.v_i > 1.0 {
        Strategy::SpeedUp
    } else {
        Strategy::SlowDown
    };
    let sure = time_at_floor > 0.0 || (v_start / transition.v_i - 1.0).abs() > 4.0 * f64::EPSILON;
    row.fact("strategy as it starts", !sure || strategy == expected);
    let ends = 1.0 / transition.v_i.min(transition.v_f);
    row.at_most("theta_max is the largest", ends / theta_max - 1.0, 4.0 * f64::EPSILON);
}

fn accuracies_agree(point: &Point, doubt: &Doubt, rough: &Optimum, fine: &Optimum, row: &mut Row) {
    let budget = |condition: f64| 2.0 * point.rtol + 2.0 * FINE + 4.0 * condition;
    row.agree("work to rtol", rough.work, fine.work, budget(doubt.time));
    let subnormal = |v: f64| 2.0 * point.transition.v_i.max(point.transition.v_f) * f64::from_bits(1) / v;
    let v = |v: f64| budget(doubt.velocity(v)) + subnormal(v);
    row.agree("v_start to rtol", rough.v_start, fine.v_start, v(fine.v_start));
    row.agree("v_end to rtol", rough.v_end, fine.v_end, v(fine.v_end));
    row.agree("theta_max to rtol", rough.theta_max, fine.theta_max, budget(doubt.time));
    let size = fine.hamiltonian.abs() + point.transition.v_i.min(point.transition.v_f);
    row.at_most("hamiltonian to rtol", (rough.hamiltonian - fine.hamiltonian).abs(), budget(doubt.time) * size);
    // A short hold is what is left of t_f, or of the time in which theta grows.
    let rest = doubt.t_f * doubt.time + f64::EPSILON * (doubt.t_f + fine.theta_max);
    let hold = budget(0.0) * fine.time_at_floor + 32.0 * rest;
    row.at_most("time_at_floor to rtol", (rough.time_at_floor - fine.time_at_floor).abs(), hold);
}

/// `C = v (a (u - ln u) - tau_ss(v) - a)` at both ends, with `u = theta v`, where they are on the arc.
fn conserved(transition: &Transition, doubt: &Doubt, fine: &Optimum, row: &mut Row) {
    let Law { a, b } = transition.law;
    let mut at = |invariant, v: f64, inner: f64| {
        let u = inner / v;
        let terms = [a * u, -a * u.ln(), (b - a) * v.ln(), -1.0 - a];
        let c: f64 = v * terms.iter().sum::<f64>();
        let size = v * terms.iter().map(|term| term.abs()).sum::<f64>();
        let relative = 4.0 * FINE + 4.0 * doubt.velocity(inner);
        let allowed = relative * v * a * (u - 1.0).abs() + (FINE + 4.0 * doubt.time) * (size + fine.hamiltonian.abs());
        row.at_most(invariant, (c + fine.hamiltonian).abs(), allowed);
    };
    at("C at the end", transition.v_f, fine.v_end);
    if fine.time_at_floor == 0.0 && fine.v_start > f64::MIN_POSITIVE {
        at("C at the start", transition.v_i, fine.v_start);
    }
}

/// `W*(t_2) - W*(t_1) = int -C dt`, by Simpson's rule, whose error is below its distance from the trapezium rule.
fn slope(point: &Point, doubt: &Doubt, fine: &Optimum, row: &mut Row) {
    let &Point { ref transition, t_f, bounded, .. } = point;
    let least = shortest_time(transition, bounded).expect("is in the domain");
    let step = 1e-3 * (t_f - least);
    let at = |t: f64| certain(&solve(transition, t, bounded, FINE));
    let (middle, end) = (t_f + 0.5 * step, t_f + step);
    let (Some(second), Some(third)) = (at(middle), at(end)) else { return };
    let dt = end - t_f;
    let trapezium = 0.5 * (fine.hamiltonian + third.hamiltonian);
    let simpson = (2.0 * second.hamiltonian + trapezium) / 3.0;
    let noise =
        (8.0 * FINE + 8.0 * doubt.time) * fine.work.max(third.work) + 4.0 * f64::EPSILON * t_f * fine.hamiltonian.abs();
    let bend = (simpson - trapezium).abs() + 1e-6 * (third.hamiltonian - fine.hamiltonian).abs();
    row.at_most("dW*/dt_f = -C", (third.work - fine.work - simpson * dt).abs(), noise + bend * dt);
}

/// The bound costs work, unless it does not bind.
fn bound_costs(point: &Point, fine: &Optimum, row: &mut Row) {
    let &Point { ref transition, t_f, bounded, .. } = point;
    let other = solve(transition, t_f, !bounded, FINE);
    let Some(value) = certain(&other) else { return };
    let (with, without) = if bounded { (fine, &value) } else { (&value, fine) };
    // A rounding of t_f, of which the two leave different times beyond the least, costs that times the Hamiltonian.
    let rounding = 8.0 * f64::EPSILON * t_f * (with.hamiltonian.abs() + without.hamiltonian.abs());
    let noise = 8.0 * FINE * with.work + rounding;
    row.at_most("the bound costs", without.work - with.work, noise);
    if without.v_start >= 1.0 {
        row.at_most("the bound that does not bind", (with.work - without.work).abs(), noise);
    }
}

/// With `v_0` eight times less, `v = 8 v'` and `t = t'/8`, friction is `s tau'` for `a' = a/s`, `b' = b/s`, `s = 1 + (b -
/// a) ln 8`.
fn scaled(point: &Point, doubt: &Doubt, fine: &Optimum, row: &mut Row) {
    let &Point { transition: Transition { law: Law { a, b }, v_i, v_f }, t_f, .. } = point;
    let s = 1.0 + (b - a) * 8f64.ln();
    if s < 0.1 {
        return;
    }
    let other = Transition { law: Law { a: a / s, b: b / s }, v_i: 8.0 * v_i, v_f: 8.0 * v_f };
    let Some(other) = certain(&solve(&other, 0.125 * t_f, false, FINE)) else { return };
    // Friction is a difference of terms of this size.
    let terms = 1.0 + (a + b) * (v_i.ln() + v_f.ln() + 3.0);
    let noise = 8.0 * FINE * terms + 8.0 * doubt.time;
    let size = fine.work.abs() + doubt.t_f * fine.hamiltonian.abs();
    row.at_most("scaling of the work", (s * other.work - fine.work).abs(), noise * size);
}

/// `b -> a`: what a change of `b` makes of the least work is at most `int |ln theta| v dt` times that, and `int v dt <=
/// t_f/theta_min + |ln(theta_f/theta_i)|`.
fn near_equal(point: &Point, fine: &Optimum, row: &mut Row) {
    let &Point { ref transition, t_f, bounded, .. } = point;
    let &Transition { law: Law { a, b }, v_i, v_f } = transition;
    if b == a || (b - a).abs() > 1e-2 * a {
        return;
    }
    let equal = Transition { law: Law { a, b: a }, ..*transition };
    let Some(other) = certain(&solve(&equal, t_f, bounded, FINE)) else { return };
    let way = t_f * v_i.max(v_f) + ((v_i - v_f) / v_f).ln_1p().abs();
    let largest = v_i.max(v_f).ln().max(fine.theta_max.max(other.theta_max).ln().abs());
    let allowed = 1.01 * (b - a).abs() * largest * way + (8.0 * FINE + 8.0 * Doubt::of(point).time) * fine.work;
    row.at_most("b -> a", (fine.work - other.work).abs(), allowed);
}
