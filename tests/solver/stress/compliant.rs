//! `compliant`: the member exists if there is time for it, costs no less than the optimum, and the control velocity
//! tends to the block's on a stiff spring.

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::compliant::{self, Compliant};
use slipsweep::protocol::{SpringBlock, Status, optimal};
use slipsweep::stability::{amplification, held_error, open_loop_error};

use super::random::Random;
use super::{POINTS, Row, sample};

/// More quadrature nodes than any point takes.
const MOST_NODES: u32 = 150_000;

/// Steps at which two simulations are given up.
const MOST_STEPS: u32 = 400_000;

/// Open loops are simulated: three times up to a hundred thousand steps.
const LOOP_POINTS: u64 = 60;

const FINE: f64 = 1e-12;

#[derive(Debug)]
struct Point {
    slider: SpringBlock,
    velocities: (f64, f64),
    t_f: f64,
    dt: f64,
    rtol: f64,
}

fn draw(random: &mut Random) -> Point {
    let transition = random.transition();
    let slider = random.slider(transition.law, transition.v_f);
    let t_f = random.duration(&transition, true);
    let Transition { v_i, v_f, .. } = transition;
    let dt = t_f * random.between(1e-3, 1.0);
    Point { slider, velocities: (v_i, v_f), t_f, dt, rtol: random.rtol() }
}

#[test]
fn every_compliant_is_right_or_states_so() {
    sample("compliant", POINTS, draw, |point, row| {
        let &Point { slider, velocities: (v_i, v_f), t_f, rtol, .. } = point;
        let solved = compliant::solve(&slider, (v_i, v_f), t_f, rtol);
        row.status(solved.status);
        let transition = Transition { law: slider.law, v_i, v_f };
        row.fact("exists if there is time", solved.value.is_some() == (t_f > transition.min_duration()));
        row.at_most("few nodes", f64::from(solved.stats.nodes), f64::from(MOST_NODES));
        let Some(rough) = solved.value else { return };
        let Compliant { alpha, work, v_min, v_max, control_min, control_max } = rough;
        let numbers = [alpha, work, v_min, v_max, control_min, control_max];
        row.fact("finite", numbers.iter().all(|number| number.is_finite()));
        row.fact("in order", 1.0 <= v_min && v_min <= v_max && control_min <= control_max);
        let optimum = optimal::solve(&transition, t_f, true, FINE);
        if let (Some(best), Status::Ok, Status::Ok) = (optimum.value, optimum.status, solved.status) {
            let terms = 1.0 + (slider.law.a + slider.law.b) * (v_max.ln() + v_i.max(v_f).ln());
            let rounding = 8.0 * f64::EPSILON * t_f * best.hamiltonian.abs();
            row.at_most("gap >= 0", best.work - work, (rtol + FINE) * terms * best.work + rounding);
        }
        accurate(point, &rough, row);
        forces(point, &rough, row);
        stiff(point, &rough, row);
    });
}

/// Every number agrees with that of a finer accuracy.
fn accurate(point: &Point, rough: &Compliant, row: &mut Row) {
    let &Point { slider, velocities: (v_i, v_f), t_f, rtol, .. } = point;
    let Some(fine) = compliant::solve(&slider, (v_i, v_f), t_f, FINE).value else {
        return row.fact("exists at 1e-12", false);
    };
    let noise = 2.0 * (rtol + FINE);
    let terms = 1.0 + (slider.law.a + slider.law.b) * (fine.v_max.ln() + v_i.max(v_f).ln());
    row.agree("work to rtol", rough.work, fine.work, noise * terms);
    row.agree("v_min to rtol", rough.v_min, fine.v_min, noise);
    row.agree("v_max to rtol", rough.v_max, fine.v_max, noise);
    let range = fine.control_max.abs().max(fine.control_min.abs());
    if determines_velocity(slider.law, fine.v_max, range) {
        // Ageing drives the spring at (b/k) (1/theta - v), which may cancel with v. Twice: the velocity itself has an error,
        // and its exponent, of terms of some hundred, a rounding.
        let allowed = (2.0 * noise + 128.0 * f64::EPSILON) * (range + slider.law.b / slider.k * fine.v_max);
        row.at_most("least control velocity to rtol", (rough.control_min - fine.control_min).abs(), allowed);
        row.at_most("greatest control velocity to rtol", (rough.control_max - fine.control_max).abs(), allowed);
    }
}

/// Whether the control velocity is no small remainder of large terms: friction changes by `a v'/v + b theta'/theta`, which
/// cancel for `b` near `a` where theta follows `1/v`, and a soft spring makes much of what is left.
pub fn determines_velocity(Law { a, b }: Law, v_max: f64, range: f64) -> bool {
    (b - a).abs() > 0.1 * a && range < 1e6 * v_max
}

/// Friction, inertia and spring may be weaker by the same factor: nothing but ratios of forces enters.
fn forces(point: &Point, rough: &Compliant, row: &mut Row) {
    let &Point { slider: SpringBlock { law: Law { a, b }, k, m }, velocities, t_f, rtol, .. } = point;
    let weaker = SpringBlock { law: Law { a: 0.25 * a, b: 0.25 * b }, k: 0.25 * k, m: 0.25 * m };
    let Some(other) = compliant::solve(&weaker, velocities, t_f, rtol).value else {
        return row.fact("only ratios of forces enter", false);
    };
    let of = |found: &Compliant| [found.alpha, found.v_min, found.v_max, found.control_min, found.control_max];
    row.fact("only ratios of forces enter", of(&other) == of(rough));
}

/// The block does not know the spring; a rigid one moves with it.
fn stiff(point: &Point, rough: &Compliant, row: &mut Row) {
    let &Point { slider, velocities, t_f, rtol, .. } = point;
    let at = |k: f64| compliant::solve(&SpringBlock { k, ..slider }, velocities, t_f, rtol).value;
    let Some(rigid) = at(f64::INFINITY) else { return row.fact("exists on a rigid spring", false) };
    row.fact(
        "a rigid spring moves with the block",
        (rigid.control_min, rigid.control_max) == (rigid.v_min, rigid.v_max),
    );
    row.fact(
        "the block does not know the spring",
        [rigid.alpha, rigid.work, rigid.v_max] == [rough.alpha, rough.work, rough.v_max],
    );
    // k (v_c - v) is the same on any spring, so the control velocity is at most this far from the block's.
    let far = (rough.control_max - rough.v_max).max(rough.v_min - rough.control_min).max(0.0) + rough.v_max;
    if slider.k.is_finite()
        && let Some(near) = at(1e9 * slider.k * (far / rough.v_max))
    {
        let off = (near.control_max - rigid.v_max).abs().max((near.control_min - rigid.v_min).abs());
        row.at_most("k -> inf", off, (4e-9 + 4.0 * rtol) * rigid.v_max);
    }
}

#[test]
fn what_becomes_of_a_compliant_open_loop_is_a_number_or_none() {
    sample("compliant open loop", LOOP_POINTS, draw, |point, row| {
        let &Point { slider, velocities, t_f, dt, rtol } = point;
        let path = match compliant::path(&slider, velocities, t_f, rtol) {
            Ok(path) => path,
            Err(status) => return row.status(status),
        };
        row.status(Status::Ok);
        for found in [
            amplification(&slider, velocities, t_f, rtol),
            open_loop_error(&path, rtol),
            held_error(&slider, velocities, t_f, dt, rtol),
        ] {
            row.fact("few steps", found.steps <= MOST_STEPS);
            row.fact("a number or none", found.number.is_none_or(|number| number >= 0.0 && number.is_finite()));
        }
    });
}
