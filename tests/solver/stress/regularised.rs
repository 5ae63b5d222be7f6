//! `regularised`: smooth pieces cost no less than the optimum, and a stiff spring drives them like a rigid one.

use slipsweep::model::Transition;
use slipsweep::protocol::regularised::{self, Regularised};
use slipsweep::protocol::{Slider, Status, optimal};

use super::random::Random;
use super::{POINTS, Row, sample};

/// More quadrature nodes than any point takes: some hundredths of a second where velocities fall by ten decades within a
/// piece.
const MOST_NODES: u32 = 4_000_000;

#[derive(Debug)]
struct Point {
    slider: Slider,
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
    let delta_t = t_f * random.between(1e-6, 0.6);
    Point { slider, velocities: (v_i, v_f), t_f, delta_t, bounded, rtol: random.rtol() }
}

fn solve(point: &Point, k: f64) -> slipsweep::protocol::Solved<Regularised> {
    let &Point { slider, velocities, t_f, delta_t, bounded, rtol } = point;
    regularised::solve(&Slider { k, ..slider }, velocities, t_f, delta_t, bounded, rtol)
}

#[test]
fn every_regularised_is_right_or_says_so() {
    sample("regularised", POINTS, draw, |point, row| {
        let found = solve(point, point.slider.k);
        row.status(found.status);
        row.at_most("few nodes", f64::from(found.effort.nodes), f64::from(MOST_NODES));
        row.fact("overlapping pieces are infeasible", point.delta_t <= 0.5 * point.t_f || found.value.is_none());
        // A path on which the extremal need not be unique may be one that cannot be followed.
        match found.status {
            Status::Ok | Status::BelowBound => row.fact("numbers as the status says", found.value.is_some()),
            Status::Infeasible => row.fact("numbers as the status says", found.value.is_none()),
            Status::Nonphysical | Status::NotConverged => {}
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
            let optimum = optimal::solve(&transition, t_f, bounded, 1e-12).value.map_or(f64::NAN, |found| found.work);
            row.agree("the optimum's work", work_optimal, optimum, 2.0 * point.rtol + 1e-11);
        }
        stiff(point, &value, row);
    });
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
