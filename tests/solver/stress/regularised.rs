//! `regularised`: smooth pieces cost no less than the optimum, and a stiff spring drives them like a rigid one.

use slipsweep::model::Transition;
use slipsweep::protocol::regularised::{self, Regularised};
use slipsweep::protocol::{SpringBlock, Status, optimal};

use super::compliant::determines_velocity;
use super::random::Random;
use super::{POINTS, Row, sample};

/// More quadrature nodes than any point takes: some hundredths of a second where velocities fall by ten decades within a
/// piece.
const MOST_NODES: u32 = 4_000_000;

const FINE: f64 = 1e-12;

/// Least legal `delta_t`.
const MIN_DURATION: f64 = 1e-20;

/// What rounding may leave of the velocity where the exponent of a piece is steep.
const STEEP: f64 = 2e-10;

#[derive(Debug)]
struct Point {
    slider: SpringBlock,
    velocities: (f64, f64),
    t_f: f64,
    delta_t: f64,
    bounded: bool,
    rtol: f64,
}

fn draw(random: &mut Random) -> Point {
    let (transition, bounded) = (random.transition(), random.chance(0.5));
    let slider = random.slider(transition.law, transition.v_f);
    let t_f = random.duration(&transition, bounded);
    let Transition { v_i, v_f, .. } = transition;
    let delta_t = (t_f * random.between(1e-6, 0.6)).max(MIN_DURATION);
    Point { slider, velocities: (v_i, v_f), t_f, delta_t, bounded, rtol: random.rtol() }
}

fn solve(point: &Point, k: f64) -> slipsweep::protocol::Solved<Regularised> {
    let &Point { slider, velocities, t_f, delta_t, bounded, rtol } = point;
    regularised::solve(&SpringBlock { k, ..slider }, velocities, t_f, delta_t, bounded, rtol)
}

#[test]
fn every_regularised_is_right_or_states_so() {
    sample("regularised", POINTS, draw, |point, row| {
        let found = solve(point, point.slider.k);
        row.status(found.status);
        row.at_most("few nodes", f64::from(found.stats.nodes), f64::from(MOST_NODES));
        row.fact("overlapping pieces are infeasible", point.delta_t <= 0.5 * point.t_f || found.value.is_none());
        // A path on which the extremal need not be unique may be one that cannot be followed.
        match found.status {
            Status::Ok | Status::BelowBound | Status::NegativeFriction => {
                row.fact("numbers agree with the status", found.value.is_some())
            }
            Status::Infeasible => row.fact("numbers agree with the status", found.value.is_none()),
            Status::Unproven | Status::NotConverged => {}
        }
        let Some(value) = found.value else { return };
        let Regularised { work, work_optimal, gap, v_min, v_max, control_min, control_max, .. } = value;
        let numbers = [work, work_optimal, gap, v_min, v_max, control_min, control_max];
        row.fact("finite", numbers.iter().all(|number| number.is_finite()));
        row.fact("in order", v_min > 0.0 && v_min <= v_max && control_min <= control_max);
        // The bound costs work, so below it less than W* may do.
        if found.status == Status::Ok {
            let rounding = 4.0 * f64::EPSILON + 2.0 * point.rtol * value.replaced / work_optimal;
            row.at_most("gap >= 0", -gap, rounding);
        }
        if found.status == Status::Ok {
            let &Point { slider, velocities: (v_i, v_f), t_f, bounded, .. } = point;
            let transition = Transition { law: slider.law, v_i, v_f };
            let optimum = optimal::solve(&transition, t_f, bounded, FINE).value.map_or(f64::NAN, |found| found.work);
            row.agree("the optimum's work", work_optimal, optimum, 2.0 * point.rtol + 1e-11);
        }
        accurate(point, &value, row);
        stiff(point, &value, row);
    });
}

/// Every number agrees with that of a finer accuracy.
fn accurate(point: &Point, rough: &Regularised, row: &mut Row) {
    let &Point { slider, velocities, t_f, delta_t, bounded, rtol } = point;
    let found = regularised::solve(&slider, velocities, t_f, delta_t, bounded, FINE);
    // Where the extremal need not be unique, no number is promised.
    if found.status == Status::Unproven {
        return;
    }
    let Some(fine) = found.value else { return row.fact("exists at 1e-12", false) };
    let noise = 2.0 * (rtol + FINE);
    row.agree("work to rtol", rough.work, fine.work, noise);
    // Rounding of the works of the pieces and of their times; for `a` below the physical domain also of the exponents of steep velocities. Works cancel
    // where friction changes sign, which grows by `b` times such an exponent.
    let exponent = (fine.v_max / fine.v_min).ln();
    let units = if slider.law.a < 1e-3 { 4.0 + exponent } else { 4.0 };
    let is_cancelled = found.status == Status::NegativeFriction;
    let friction = if is_cancelled { 1.0 + slider.law.b * exponent } else { 1.0 };
    let rounding = units * f64::EPSILON * (friction + fine.gap.abs() * t_f / delta_t);
    row.at_most("gap to rtol", (rough.gap - fine.gap).abs(), noise * fine.gap.abs() + rounding);
    // The ends of a piece have slopes of the order of 1/a in time, and curvatures of their square.
    let slope = delta_t / slider.law.a;
    let short = velocities.0.min(velocities.1) - 1.0;
    let steep = noise + STEEP + f64::EPSILON * (16.0 / slider.law.a + slope * slope + 4.0 / short);
    row.agree("v_min to rtol", rough.v_min, fine.v_min, steep);
    row.agree("v_max to rtol", rough.v_max, fine.v_max, steep);
    let range = fine.control_max.abs().max(fine.control_min.abs());
    if determines_velocity(slider.law, fine.v_max, range) {
        row.at_most("least control velocity to rtol", (rough.control_min - fine.control_min).abs(), steep * range);
        row.at_most("greatest control velocity to rtol", (rough.control_max - fine.control_max).abs(), steep * range);
    }
}

/// The block does not know the spring; a rigid one moves with it.
fn stiff(point: &Point, value: &Regularised, row: &mut Row) {
    let Some(rigid) = solve(point, f64::INFINITY).value else { return row.fact("exists on a rigid spring", false) };
    row.fact(
        "a rigid spring moves with the block",
        (rigid.control_min, rigid.control_max) == (rigid.v_min, rigid.v_max),
    );
    row.fact("the block does not know the spring", [rigid.work, rigid.gap] == [value.work, value.gap]);
}
