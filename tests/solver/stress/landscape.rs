//! `gap`: no shortcut costs less than the optimum, work is linear in the law, and what is admissible is convex.

use slipsweep::model::{Law, Transition};
use slipsweep::numerics::double_double::DoubleDouble as Dd;
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::{Status, optimal};

use super::random::Random;
use super::{POINTS, Row, sample};

#[derive(Debug)]
struct Point {
    transition: Transition,
    t_f: f64,
    a_2: f64,
    a_3: f64,
    rtol: f64,
}

const FINE: f64 = 1e-13;

/// Coefficients of the size of what theta and the time leave, on the straight line, on the border of what is admissible
/// or of the bound within some units in the last place, or anything.
fn draw(random: &mut Random) -> Point {
    let transition = random.transition();
    let bounded = random.chance(0.5);
    let t_f = random.duration(&transition, bounded);
    let rtol = random.rtol();
    let rise = 1.0 / transition.v_f - 1.0 / transition.v_i;
    let size = (1.0 / transition.v_i).max(1.0 / transition.v_f).min(t_f.max(rise.abs()));
    let mut away = || random.sign() * size * random.between(1e-6, 10.0);
    let (d_2, d_3) = (away(), away());
    let (mut a_2, mut a_3) = match random.uniform() {
        kind if kind < 0.05 => (rise, 0.0),
        kind if kind < 0.15 => {
            (random.sign() * random.between(1e-30, 1e30), random.sign() * random.between(1e-30, 1e30))
        }
        _ => (rise + d_2, d_3),
    };
    if random.chance(0.4) {
        // Bisection from the straight line to there.
        let landscape = Landscape::new(&Transition { law: POSITIVE, ..transition }, t_f, rtol);
        let worse = random.one(&[Status::Infeasible, Status::BelowBound]);
        let along = |s: f64| (rise + s * (a_2 - rise), s * a_3);
        let (mut inside, mut outside) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            if status(&landscape, along(middle)) >= worse { outside = middle } else { inside = middle }
        }
        let (edge_2, edge_3) = along(random.one(&[inside, outside]));
        let sided = |random: &mut Random, x: f64| if x == 0.0 { x } else { random.near(x.abs()).copysign(x) };
        (a_2, a_3) = (sided(random, edge_2), sided(random, edge_3));
    }
    Point { transition, t_f, a_2, a_3, rtol }
}

/// A law whose friction is positive for all velocities that a double holds: what is feasible does not depend on the law.
const POSITIVE: Law = Law { a: 1e-6, b: 0.0 };

fn status(landscape: &Landscape, (a_2, a_3): (f64, f64)) -> Status {
    let mut status = [Status::NotConverged];
    landscape.evaluate(&[a_2], &[a_3], LandscapeBuffers { work: &mut [], v_min: &mut [], status: &mut status });
    status[0]
}

/// Status, work and least velocity.
fn evaluate(transition: &Transition, t_f: f64, rtol: f64, a_2: f64, a_3: f64) -> (Status, f64, f64) {
    let (mut work, mut v_min, mut status) = ([f64::NAN], [f64::NAN], [Status::NotConverged]);
    let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
    Landscape::new(transition, t_f, rtol).evaluate(&[a_2], &[a_3], out);
    (status[0], work[0], v_min[0])
}

#[test]
fn every_shortcut_is_right_or_states_so() {
    sample("gap", POINTS, draw, |point, row| {
        let &Point { ref transition, t_f, a_2, a_3, rtol } = point;
        let (status, work, v_min) = evaluate(transition, t_f, rtol, a_2, a_3);
        row.status(status);
        if status == Status::Infeasible {
            return;
        }
        let positive = Transition { law: POSITIVE, ..*transition };
        let feasible = evaluate(&positive, t_f, rtol, a_2, a_3).0;
        row.fact("finite", work.is_finite() && v_min.is_finite());
        row.fact("v_min is positive", v_min > 0.0);
        // The status is decided in exact arithmetic; v_min is rounded.
        let beyond = if feasible == Status::Ok { 1.0 - v_min } else { v_min - 1.0 };
        row.at_most("v_min agrees with the status", beyond, 4.0 * f64::EPSILON);
        row.fact("negative friction alone changes a status", status == feasible || status == Status::NegativeFriction);
        let (fine_status, fine, fine_v) = evaluate(transition, t_f, FINE, a_2, a_3);
        row.fact("status at every accuracy", fine_status == status);
        row.agree("v_min to rtol", v_min, fine_v, 2.0 * rtol + 2.0 * FINE);
        // Work is a sum of the way and of terms in a and b, any of which may cancel against the others.
        let sum = Sum::of(point, row);
        let size = sum.way + transition.law.a * sum.direct.abs() + transition.law.b * sum.lifetime.abs();
        row.at_most("work to rtol", (work - fine).abs(), (2.0 * rtol + 2.0 * FINE) * size);
        // The works of the other laws are as good, and their sizes are those of a = 1 and b = 1.
        let others = size + sum.way + sum.direct.abs() + sum.lifetime.abs();
        row.at_most("linear in the law", (sum.at(transition.law) - fine).abs(), 16.0 * FINE * others);
        scaled(point, fine, size, row);
        not_below_the_optimum(point, status, work, size, row);
        convex(point, feasible, row);
    });
}

/// `W_s = int v dt + a int v ln v dt + b int v ln theta dt`, from three other laws.
struct Sum {
    way: f64,
    direct: f64,
    lifetime: f64,
}

impl Sum {
    fn of(point: &Point, row: &mut Row) -> Sum {
        let &Point { ref transition, t_f, a_2, a_3, .. } = point;
        let of = |a: f64, b: f64| {
            let transition = Transition { law: Law { a, b }, ..*transition };
            evaluate(&transition, t_f, FINE, a_2, a_3).1
        };
        let [one, two, three] = [of(1.0, 0.0), of(2.0, 0.0), of(1.0, 1.0)];
        row.fact("finite for other laws", one.is_finite() && two.is_finite() && three.is_finite());
        Sum { way: 2.0 * one - two, direct: two - one, lifetime: three - one }
    }

    fn at(&self, Law { a, b }: Law) -> f64 {
        self.way + a * self.direct + b * self.lifetime
    }
}

/// With `v_0` eight times less, as for the optimum; theta and its coefficients are in units of time.
fn scaled(point: &Point, fine: f64, size: f64, row: &mut Row) {
    let &Point { transition: Transition { law: Law { a, b }, v_i, v_f }, t_f, a_2, a_3, .. } = point;
    let s = 1.0 + (b - a) * 8f64.ln();
    if s < 0.1 {
        return;
    }
    let other = Transition { law: Law { a: a / s, b: b / s }, v_i: 8.0 * v_i, v_f: 8.0 * v_f };
    let (status, work, _) = evaluate(&other, 0.125 * t_f, FINE, 0.125 * a_2, 0.125 * a_3);
    row.fact("scaling of feasibility", status != Status::Infeasible);
    row.at_most("scaling of the work", (s * work - fine).abs(), 32.0 * FINE * (1.0 + a + b) * size);
}

fn not_below_the_optimum(point: &Point, status: Status, work: f64, size: f64, row: &mut Row) {
    let &Point { ref transition, t_f, rtol, .. } = point;
    // Where friction falls with theta to below b - a, work is not bounded below: v grows like 1/theta.
    let Law { a, b } = transition.law;
    if status == Status::NegativeFriction || 1.0 + (b - a) * least_lifetime(point).ln() <= (b - a).max(0.0) {
        return;
    }
    let optimum = optimal::solve(transition, t_f, status == Status::Ok, rtol);
    if let (Some(optimum), Status::Ok | Status::BelowBound) = (optimum.value, optimum.status) {
        let rounding = 8.0 * f64::EPSILON * t_f * optimum.hamiltonian.abs();
        let allowed = (2.0 * rtol + 2.0 * FINE) * (size + optimum.work) + rounding;
        row.at_most("gap >= 0", optimum.work - work, allowed);
    }
}

/// About the least theta on the way: at an end or where it is stationary. It may be far less than its terms.
fn least_lifetime(point: &Point) -> f64 {
    let &Point { transition: Transition { v_i, v_f, .. }, a_2, a_3, .. } = point;
    let [start, end] = [v_i, v_f].map(|v| Dd::new(1.0) / Dd::new(v));
    let (a_2, a_3) = (Dd::new(a_2), Dd::new(a_3));
    let a_4 = end - start - a_2 - a_3;
    let at = |x: f64| (start + Dd::new(x) * (a_2 + Dd::new(x) * (a_3 + Dd::new(x) * a_4))).high;
    let (a_2, a_3, a_4) = (a_2.high, a_3.high, a_4.high);
    let root = (a_3 * a_3 - 3.0 * a_2 * a_4).max(0.0).sqrt();
    let turns = [-a_2 / (a_3 + root), (root - a_3) / (3.0 * a_4)];
    let inside = turns.into_iter().filter(|x| (0.0..=1.0).contains(x)).map(at);
    inside.fold((1.0 / v_i).min(1.0 / v_f), f64::min).max(f64::MIN_POSITIVE)
}

/// Halfway to the straight line, which is the middle of what is admissible, it is no less admissible.
fn convex(point: &Point, status_there: Status, row: &mut Row) {
    let &Point { ref transition, t_f, a_2, a_3, rtol } = point;
    let landscape = Landscape::new(&Transition { law: POSITIVE, ..*transition }, t_f, rtol);
    let rise = 1.0 / transition.v_f - 1.0 / transition.v_i;
    // Near 1 that is as thin as the rounding of halfway.
    let thin = transition.v_i.min(transition.v_f) - 1.0 < 1e-14;
    if status(&landscape, (rise, 0.0)) == Status::Ok && !thin {
        let halfway = status(&landscape, (0.5 * (rise + a_2), 0.5 * a_3));
        row.fact("what is admissible is convex", halfway <= status_there);
    }
}
