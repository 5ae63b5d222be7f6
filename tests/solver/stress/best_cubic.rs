//! `best_cubic`: the least work is below that of its neighbours and not below the optimum.

use slipsweep::model::Transition;
use slipsweep::numerics::cubic::{Cubic, ExactCubic};
use slipsweep::numerics::double_double::DoubleDouble;
use slipsweep::protocol::Status;
use slipsweep::protocol::best_cubic::{BestCubic, solve};
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::optimal;

use super::random::Random;
use super::{POINTS, Row, sample};

#[derive(Debug)]
struct Point {
    transition: Transition,
    t_f: f64,
    bounded: bool,
    rtol: f64,
    /// Directions and distances of neighbours, relative.
    neighbours: [(f64, f64, f64); 6],
}

fn draw(random: &mut Random) -> Point {
    let (transition, bounded) = (random.transition(), random.chance(0.7));
    let t_f = random.duration(&transition, bounded);
    let neighbours = std::array::from_fn(|_| {
        let angle = std::f64::consts::TAU * random.uniform();
        (angle.cos(), angle.sin(), random.between(1e-4, 1.0))
    });
    Point { transition, t_f, bounded, rtol: random.rtol(), neighbours }
}

#[test]
fn every_best_shortcut_is_the_best_or_states_so() {
    sample("best_cubic", POINTS, draw, |point, row| {
        let &Point { ref transition, t_f, bounded, rtol, .. } = point;
        let solved = solve(transition, t_f, bounded, rtol);
        row.status(solved.status);
        let Some(best) = solved.value else { return };
        let BestCubic { a_2, a_3, work, work_optimal, gap, v_min, v_max, .. } = best;
        let numbers = [a_2, a_3, work, work_optimal, gap, v_min, v_max];
        row.fact("finite", numbers.iter().all(|number| number.is_finite()));
        // Where friction is that low, the extremal that the gap compares with need not be the least.
        if matches!(solved.status, Status::Unproven | Status::NegativeFriction) {
            return;
        }
        row.fact("the bound is kept", v_min >= if bounded { 1.0 } else { 0.0 });
        row.at_most("gap >= 0", -gap, 1e-20);
        let Some(optimum) = optimal::solve(transition, t_f, bounded, 1e-12).value else {
            return row.fact("the optimum exists", false);
        };
        let allowed = 2e-11 * work + 16.0 * f64::EPSILON * t_f * optimum.hamiltonian.abs();
        row.at_most("gap is that of the works", (gap * work_optimal - (work - work_optimal)).abs(), allowed);
        row.agree("the optimum's work", work_optimal, optimum.work, 4e-12);
        neighbours(point, &best, row);
    });
}

/// No admissible neighbour costs less. For `b > a` the work falls without limit beyond the theta of which `tau = b - a`
/// at `u = 1`: neighbours that go there are left out. So are those below `v = 1` by less than its rounding: over `t_f` of
/// 1e8 even that saves work.
fn neighbours(point: &Point, best: &BestCubic, row: &mut Row) {
    let &Point { ref transition, t_f, bounded, .. } = point;
    let Transition { law, v_i, v_f } = *transition;
    let floor = if law.b > law.a { (1.0 - 1.0 / (law.b - law.a)).exp() } else { 0.0 };
    let landscape = Landscape::new(transition, t_f, 1e-12);
    let size = best.a_2.abs().max(best.a_3.abs());
    for &(x, y, distance) in &point.neighbours {
        let (mut work, mut v_min, mut status) = ([f64::NAN], [f64::NAN], [Status::NotConverged]);
        let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
        let reach = distance * size;
        let (a_2, a_3) = (best.a_2 + reach * x, best.a_3 + reach * y);
        landscape.evaluate(&[a_2], &[a_3], out);
        let theta = Cubic { c: [1.0 / v_i, a_2, a_3, 1.0 / v_f - 1.0 / v_i - a_2 - a_3] };
        if law.b > law.a && theta.least() <= floor {
            continue;
        }
        let above = status[0] == Status::Ok && keeps_the_bound(transition, t_f, [a_2, a_3]);
        if above || (!bounded && matches!(status[0], Status::Ok | Status::BelowBound)) {
            row.at_most("least among neighbours", best.work - work[0], 4e-12 * best.work);
        }
    }
}

/// Whether `v >= 1` to the last of 32 digits: `t_f - theta' - t_f theta >= 0` over `x = t/t_f`.
fn keeps_the_bound(transition: &Transition, t_f: f64, [a_2, a_3]: [f64; 2]) -> bool {
    let number = DoubleDouble::new;
    let steady = |v: f64| number(1.0) / number(v);
    let (start, end) = (steady(transition.v_i), steady(transition.v_f));
    let theta = [start, number(a_2), number(a_3), end - start - number(a_2) - number(a_3)];
    let mut surplus = theta.map(|c| -number(t_f) * c);
    surplus[0] = surplus[0] + number(t_f);
    for power in 1..4 {
        surplus[power - 1] = surplus[power - 1] - number(power as f64) * theta[power];
    }
    ExactCubic { c: surplus }.is_positive(false)
}
