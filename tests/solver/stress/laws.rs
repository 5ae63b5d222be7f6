//! `optimal`, `gap` and `best_cubic` under the laws of slip and of Perrin, Rice and Zheng: random points of the physical domain, shortcuts often on
//! the border of what is feasible or of `v >= 1`. No shortcut costs less than the optimum or the best shortcut, and work is linear in `a` and `b`.

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::protocol::best_cubic::{BestCubic, solve_under};
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::optimal::Bounds;
use slipsweep::protocol::{Status, relaxed};

use super::random::Random;
use super::{POINTS, Row, sample};

#[derive(Debug)]
struct Point {
    state: StateLaw,
    transition: Transition,
    t_f: f64,
    v_ceiling: f64,
    rtol: f64,
}

const FINE: f64 = 1e-13;

/// The physical domain of docs/spec.md.
fn problem(random: &mut Random) -> Point {
    let state = random.one(&[StateLaw::Slip, StateLaw::Prz]);
    let a = random.between(1e-3, 0.3);
    let b = (a * random.one(&[0.0, 0.5, 1.0, 1.5, 3.0, 10.0])).min(0.5);
    let greatest = random.one(&[10.0, 1e3, 1e6, 1e10]);
    let [v_i, v_f] = [(); 2].map(|()| random.between(1.001, greatest));
    let transition = Transition { law: Law { a, b }, v_i, v_f };
    let v_ceiling = (v_i.max(v_f) * (1.0 + random.between(1e-6, 1e4))).min(1e12);
    let least = relaxed::least_time(state, &transition, v_ceiling).expect("has one");
    let t_f = match (3.0 * random.uniform()) as u32 {
        0 => least * (1.0 + random.between(1e-8, 1.0)),
        1 => least + random.between(1e-6, 1e3),
        _ => least + random.between(1e-2, 1e2) / v_i.max(v_f),
    };
    let t_f = t_f.min(1e7 / v_i.max(v_f)).min(1e4).max(least * (1.0 + 1e-9));
    Point { state, transition, t_f, v_ceiling, rtol: random.between(1e-13, 1e-4) }
}

/// A shortcut.
#[derive(Debug)]
struct Shortcut {
    of: Point,
    a_2: f64,
    a_3: f64,
}

/// Coefficients of the size of what theta and the time leave, or by bisection on a border.
fn shortcut(random: &mut Random) -> Shortcut {
    let of = problem(random);
    let Transition { v_i, v_f, .. } = of.transition;
    let rise = 1.0 / v_f - 1.0 / v_i;
    let size = (1.0 / v_i).max(1.0 / v_f).min((of.state.fastest_rise().high * of.t_f).max(rise.abs()));
    let [d_2, d_3] = [(); 2].map(|()| random.sign() * size * random.between(1e-6, 10.0));
    let (mut a_2, mut a_3) = (rise + d_2, d_3);
    if random.chance(0.4) {
        let worse = random.one(&[Status::Infeasible, Status::BelowBound]);
        let along = |s: f64| (rise + s * d_2, s * d_3);
        let (mut inside, mut outside) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            let (a_2, a_3) = along(middle);
            let found = Shortcut { of: Point { ..of }, a_2, a_3 }.evaluate(POSITIVE, FINE).0;
            if found >= worse { outside = middle } else { inside = middle }
        }
        (a_2, a_3) = along(random.one(&[inside, outside]));
    }
    Shortcut { of, a_2, a_3 }
}

/// A law whose friction is positive for all velocities: what is feasible does not depend on `a` and `b`.
const POSITIVE: Law = Law { a: 1e-6, b: 0.0 };

impl Shortcut {
    /// Status, work and least velocity with other `a` and `b`.
    fn evaluate(&self, law: Law, rtol: f64) -> (Status, f64, f64) {
        let transition = Transition { law, ..self.of.transition };
        let landscape = Landscape::under(self.of.state, &transition, self.of.t_f, rtol);
        let (mut work, mut v_min, mut status) = ([f64::NAN], [f64::NAN], [Status::NotConverged]);
        let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
        landscape.evaluate(&[self.a_2], &[self.a_3], out);
        (status[0], work[0], v_min[0])
    }
}

#[test]
fn every_shortcut_of_other_laws_is_right_or_states_so() {
    sample("gap_laws", POINTS, shortcut, |shortcut, row| {
        let &Shortcut { of: Point { transition, rtol, .. }, a_2, a_3 } = shortcut;
        let law = transition.law;
        let (status, work, v_min) = shortcut.evaluate(law, rtol);
        row.status(status);
        let (fine_status, fine, fine_v) = shortcut.evaluate(law, FINE);
        // Closer to v = 1 and to the border of what is feasible rounding decides.
        let is_close = (v_min - 1.0).abs() < 8.0 * f64::EPSILON;
        row.fact("status at every accuracy", fine_status == status || is_close);
        if status == Status::Infeasible || fine_status == Status::Infeasible {
            return;
        }
        row.fact("finite", work.is_finite() && v_min.is_finite() && v_min > 0.0);
        row.agree("v_min to rtol", v_min, fine_v, 2.0 * rtol + 2.0 * FINE);
        row.fact("negative friction alone hides the bound", status == own(v_min) || status == Status::NegativeFriction);
        // W_s = int v dt + a int v ln v dt + b int v ln theta dt, from three other laws.
        let [one, two, three] =
            [(1.0, 0.0), (2.0, 0.0), (1.0, 1.0)].map(|(a, b)| shortcut.evaluate(Law { a, b }, FINE).1);
        let [way, direct, lifetime] = [2.0 * one - two, two - one, three - one];
        let size = way + law.a * direct.abs() + law.b * lifetime.abs();
        row.at_most("work to rtol", (work - fine).abs(), (2.0 * rtol + 2.0 * FINE) * size);
        let others = size + way + direct.abs() + lifetime.abs();
        let linear = way + law.a * direct + law.b * lifetime;
        row.at_most("linear in the law", (linear - fine).abs(), 16.0 * FINE * others);
        not_below_the_optimum(shortcut, status, fine, size, row);
        let rise = 1.0 / transition.v_f - 1.0 / transition.v_i;
        let halfway = Shortcut { of: Point { ..shortcut.of }, a_2: 0.5 * (rise + a_2), a_3: 0.5 * a_3 };
        let line = Shortcut { of: Point { ..shortcut.of }, a_2: rise, a_3: 0.0 };
        let of = |shortcut: &Shortcut| shortcut.evaluate(POSITIVE, FINE).0;
        if of(&line) == Status::Ok {
            row.fact("what is admissible is convex", of(&halfway) <= of(shortcut));
        }
    });
}

/// The status of positive friction.
fn own(v_min: f64) -> Status {
    if v_min < 1.0 { Status::BelowBound } else { Status::Ok }
}

/// Under a ceiling that no shortcut reaches.
fn not_below_the_optimum(shortcut: &Shortcut, status: Status, work: f64, size: f64, row: &mut Row) {
    let Point { state, transition, t_f, .. } = shortcut.of;
    if status != Status::Ok {
        return;
    }
    let solved = relaxed::solve(state, &transition, t_f, HIGH);
    if let (Status::Ok, Some(least)) = (solved.status, solved.value) {
        let allowed = 4.0 * FINE * (size + least.optimum.work.abs()) + relaxed::work_error(&least, &transition, t_f);
        row.at_most("gap >= 0", least.optimum.work - work, allowed);
    }
}

/// A ceiling above every velocity of a shortcut in the sample.
const HIGH: f64 = 1e30;

#[test]
fn every_optimum_of_other_laws_is_right_or_states_so() {
    sample("optimal_laws", POINTS, problem, |point, row| {
        let &Point { state, ref transition, t_f, v_ceiling, .. } = point;
        let solved = relaxed::solve(state, transition, t_f, v_ceiling);
        row.status(solved.status);
        row.fact("feasible beyond the least time", solved.status != Status::Infeasible);
        let (Status::Ok, Some(found)) = (solved.status, solved.value) else { return };
        let noise = relaxed::work_error(&found, transition, t_f) + 4.0 * FINE * found.optimum.work.abs();
        // A higher ceiling allows more.
        let higher = relaxed::solve(state, transition, t_f, 2.0 * v_ceiling);
        if let (Status::Ok, Some(other)) = (higher.status, higher.value) {
            let noise = noise + relaxed::work_error(&other, transition, t_f);
            row.at_most("a ceiling costs", other.optimum.work - found.optimum.work, noise);
        }
    });
}

#[test]
fn every_best_shortcut_of_other_laws_is_the_best_or_states_so() {
    sample("best_cubic_laws", POINTS / 10, problem, |point, row| {
        let &Point { state, ref transition, t_f, v_ceiling, rtol } = point;
        let solved = solve_under(state, transition, t_f, Bounds::new(true).with_v_ceiling(v_ceiling), rtol);
        row.status(solved.status);
        let (Status::Ok, Some(best)) = (solved.status, solved.value) else { return };
        let BestCubic { a_2, a_3, work, work_optimal, gap, v_min, v_max, .. } = best;
        let numbers = [a_2, a_3, work, work_optimal, gap, v_min, v_max];
        row.fact("finite", numbers.iter().all(|number| number.is_finite()));
        row.fact("the bound is kept", v_min >= 1.0);
        row.at_most("gap is that of the works", (gap * work_optimal - (work - work_optimal)).abs(), 1e-11 * work);
        let landscape = Landscape::under(state, transition, t_f, 1e-12);
        let (mut of_x, mut of_x_2) = (Vec::new(), Vec::new());
        for power in 0..8 {
            let step = (a_2.abs() + a_3.abs()) * 10f64.powi(-power);
            for direction in 0..32 {
                let (sine, cosine) = (std::f64::consts::TAU * f64::from(direction) / 32.0).sin_cos();
                of_x.push(a_2 + step * cosine);
                of_x_2.push(a_3 + step * sine);
            }
        }
        let (mut works, mut statuses) = (vec![f64::NAN; of_x.len()], vec![Status::NotConverged; of_x.len()]);
        let out = LandscapeBuffers { work: &mut works, v_min: &mut [], status: &mut statuses };
        landscape.evaluate(&of_x, &of_x_2, out);
        let is_admissible = |&i: &usize| {
            statuses[i] == Status::Ok && least_lifetime(transition, of_x[i], of_x_2[i]) > floor(transition)
        };
        let least = (0..of_x.len()).filter(is_admissible).map(|i| works[i]).fold(f64::INFINITY, f64::min);
        row.at_most("no neighbour costs less", work - least, 1e-11 * work);
    });
}

/// The least theta of a shortcut among samples.
fn least_lifetime(&Transition { v_i, v_f, .. }: &Transition, a_2: f64, a_3: f64) -> f64 {
    let a_4 = 1.0 / v_f - 1.0 / v_i - a_2 - a_3;
    let theta = |x: f64| 1.0 / v_i + x * (a_2 + x * (a_3 + x * a_4));
    (0..=64).map(|i| theta(f64::from(i) / 64.0)).fold(f64::INFINITY, f64::min)
}

/// The theta of which `tau = b - a` in steady sliding, or less than both ends: below, the work may fall without limit (docs/derivations.md).
fn floor(&Transition { law: Law { a, b }, v_i, v_f }: &Transition) -> f64 {
    let (floor, lower) = (if b > a { (1.0 - 1.0 / (b - a)).exp() } else { 0.0 }, 1.0 / v_i.max(v_f));
    if floor < lower { floor } else { 0.5 * lower }
}
