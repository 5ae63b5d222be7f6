//! `shortcut`: every member of a family costs no less than the optimum, stays within what its family promises, and scales.

use slipsweep::grid::Quantity;
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::shortcut::{Case, Family, Obstacle, Shortcut, find};
use slipsweep::protocol::{SolverStats, Status, optimal};

use super::random::Random;
use super::{POINTS, Row, sample};
use crate::reference::table;

#[derive(Debug)]
struct Point {
    case: Case,
    rtol: f64,
}

const FINE: f64 = 1e-12;

/// What is held to an accuracy, and its number.
type Number = (&'static str, fn(&Shortcut) -> f64);

fn friction_of_ends(&Transition { law: Law { a, b }, v_i, v_f }: &Transition) -> f64 {
    let steady = |v: f64| 1.0 + (a - b) * v.ln();
    steady(v_i).max(steady(v_f))
}

/// The bound on friction is near the friction of an end, above it, or absent.
fn draw(random: &mut Random) -> Point {
    let transition = random.transition();
    let bounded = random.chance(0.7);
    let t_f = random.duration(&transition, bounded);
    let ends = friction_of_ends(&transition);
    let tau_ceiling = match random.uniform() {
        kind if kind < 0.2 && ends > 0.0 => random.near(ends),
        kind if kind < 0.3 => f64::INFINITY,
        _ => ends + random.between(1e-12, Quantity::FrictionCeiling.domain().greatest),
    };
    Point { case: Case { transition, t_f, tau_ceiling }, rtol: random.rtol() }
}

fn solve(family: &Family, case: &Case, rtol: f64) -> Result<Shortcut, Obstacle> {
    family.solve(case, rtol, &mut SolverStats::default())
}

fn examine(name: &str, points: u64, draw: fn(&mut Random) -> Point) {
    let family = find(name).expect("is a family");
    sample(&format!("shortcut {name}"), points, draw, |point, row| {
        let &Point { ref case, rtol } = point;
        let solved = solve(family, case, rtol);
        let status = match &solved {
            Ok(shortcut) => shortcut.status(),
            Err(obstacle) => obstacle.status(),
        };
        // Outside the physical domain a member need not be found.
        match status {
            Status::NotConverged if !is_physical(case) => row.status = Some(status),
            status => row.status(status),
        }
        exists(name, case, &solved, row);
        let Ok(rough) = solved else { return };
        sound(&rough, row);
        promises(name, case, &rough, row);
        let fine = solve(family, case, FINE);
        let Transition { law: Law { a, b }, v_i, v_f } = case.transition;
        // Outside the physical domain, a path may be too ill-conditioned at one tolerance and not at another.
        let honest = !is_physical(case) && matches!(fine, Err(Obstacle::NotConverged));
        row.fact("exists at 1e-12", fine.is_ok() || honest);
        // Within some units in the last place of 1, v - 1 has the digits of no more than that.
        let Some(fine) = fine.ok().filter(|_| v_i.min(v_f) - 1.0 > 1e-14) else { return };
        // Friction is a sum of terms of this size.
        let logarithms = fine.v_max.max(v_i).ln() + v_i.max(v_f).ln();
        let terms = 1.0 + (a + b) * logarithms;
        let noise = (2.0 * rtol + 2.0 * FINE) * terms + 8.0 * slip(case, &fine);
        let numbers: [Number; 3] =
            [("work to rtol", |s| s.work), ("v_max to rtol", |s| s.v_max), ("v_min to rtol", |s| s.v_min)];
        for (invariant, number) in numbers {
            let (rough, exact) = (number(&rough), number(&fine));
            // A velocity that friction determines carries the rounding of ln theta, b/a times.
            let bounded = family.uses_tau_ceiling && invariant != "work to rtol";
            let carried = if bounded { 2.0 * f64::EPSILON * b / a * logarithms } else { 0.0 };
            let allowed = allowed(family, case, (rough - exact) / exact, noise + carried, |s| number(s) / exact);
            row.agree(invariant, rough, exact, allowed);
        }
        row.at_most("friction_max to rtol", (rough.friction_max - fine.friction_max).abs(), noise);
        not_below_the_optimum(name, case, &rough, noise, row);
        if name != "bounded_velocity" {
            scaled(family, case, &fine, terms, row);
        }
    });
}

/// What two numbers may differ by: `noise`, or what the last places of the inputs stand for if that is more, as far as there are members near.
fn allowed(family: &Family, case: &Case, found: f64, noise: f64, number: impl Fn(&Shortcut) -> f64) -> f64 {
    if found.abs() <= noise || !family.uses_tau_ceiling {
        return noise;
    }
    let &Case { transition: Transition { law: Law { a, b }, v_i, v_f }, t_f, tau_ceiling } = case;
    let with = |[a, b, v_i, v_f, t_f, tau_ceiling]: [f64; 6]| Case {
        transition: Transition { law: Law { a, b }, v_i, v_f },
        t_f,
        tau_ceiling,
    };
    let inputs = [a, b, v_i, v_f, t_f, tau_ceiling];
    let compared_with: [Case; 6] = std::array::from_fn(|k| {
        let mut moved = inputs;
        moved[k] = moved[k].next_up();
        with(moved)
    });
    let change = |case: &Case| solve(family, case, FINE).map_or(0.0, |found| (number(&found) - 1.0).abs());
    noise + 8.0 * compared_with.iter().map(change).sum::<f64>()
}

/// Whether a case lies in the physical domain of docs/spec.md, where every member must be found.
fn is_physical(&Case { transition: Transition { law: Law { a, b }, v_i, v_f }, t_f, .. }: &Case) -> bool {
    let apart = |x: f64, y: f64, least: f64| x == y || (x - y).abs() > least * y;
    let law = (1e-3..=0.3).contains(&a) && b <= 0.5_f64.min(20.0 * a) && apart(b, a, 1e-3);
    let velocity = |v: f64| (1.001..=1e10).contains(&v);
    let slip = t_f * v_i.max(v_f);
    law && velocity(v_i) && velocity(v_f) && apart(v_i, v_f, 1e-6) && t_f <= 1e4 && (1e-3..=1e7).contains(&slip)
}

/// Where a family must have a member, and where it cannot.
fn exists(name: &str, case: &Case, solved: &Result<Shortcut, Obstacle>, row: &mut Row) {
    let Transition { v_i, v_f, .. } = case.transition;
    let least = |bounded| optimal::shortest_time(&case.transition, bounded).expect("is in the domain");
    match name {
        "step" => row.fact("exists", solved.is_ok()),
        "bounded_velocity" => row.fact("exists", solved.is_ok() == (case.t_f > least(true))),
        "bounded_friction" => {
            let below = case.tau_ceiling <= friction_of_ends(&case.transition);
            let sure =
                (case.tau_ceiling - friction_of_ends(&case.transition)).abs() > 1e-12 * case.tau_ceiling.max(1.0);
            row.fact("not beyond the bound", !(sure && below) || solved.is_err());
        }
        _ => {}
    }
    if name != "step" {
        row.fact("not in less than the least time", solved.is_err() || case.t_f > least(false) || v_f >= v_i);
    }
}

/// The rounding of the time, spent at the greatest velocity, as a fraction of the work.
fn slip(case: &Case, found: &Shortcut) -> f64 {
    f64::EPSILON * case.t_f * found.v_max * found.friction_max.abs() / found.work.abs()
}

fn sound(found: &Shortcut, row: &mut Row) {
    let &Shortcut { alpha, work, v_min, v_max, friction_max, friction_min, miss } = found;
    let numbers = [alpha.unwrap_or(0.0), work, v_min, v_max, friction_max, friction_min, miss];
    row.fact("finite", numbers.iter().all(|number| number.is_finite()));
    row.fact("in order", 0.0 <= v_min && v_min <= v_max && friction_min <= friction_max);
}

fn promises(name: &str, case: &Case, found: &Shortcut, row: &mut Row) {
    let Transition { v_i, v_f, .. } = case.transition;
    if name != "step" {
        row.fact("between both ends", found.v_min <= v_i.min(v_f) && found.v_max >= v_i.max(v_f));
        row.fact("arrives", found.miss == 0.0);
    }
    match name {
        "bounded_velocity" => row.fact("v >= 1", found.v_min >= 1.0),
        "bounded_friction" => row.fact("tau <= tau_ceiling", found.friction_max <= case.tau_ceiling),
        _ => {}
    }
}

fn not_below_the_optimum(name: &str, case: &Case, found: &Shortcut, noise: f64, row: &mut Row) {
    let bounded = found.status() == Status::Ok;
    let optimum = optimal::solve(&case.transition, case.t_f, bounded, FINE);
    if let (Some(best), Status::Ok | Status::BelowBound) = (optimum.value, optimum.status)
        && name != "step"
        && found.friction_min >= 0.0
    {
        let rounding = 8.0 * f64::EPSILON * case.t_f * best.hamiltonian.abs();
        row.at_most("gap >= 0", best.work - found.work, noise * best.work + rounding);
    }
}

/// With `v_0` eight times less, as for the optimum.
fn scaled(family: &Family, case: &Case, fine: &Shortcut, terms: f64, row: &mut Row) {
    let Transition { law: Law { a, b }, v_i, v_f } = case.transition;
    let s = 1.0 + (b - a) * 8f64.ln();
    if s < 0.1 || (family.uses_tau_ceiling && case.tau_ceiling - friction_of_ends(&case.transition) < 1e-9) {
        return;
    }
    let transition = Transition { law: Law { a: a / s, b: b / s }, v_i: 8.0 * v_i, v_f: 8.0 * v_f };
    let other = solve(family, &Case { transition, t_f: 0.125 * case.t_f, tau_ceiling: case.tau_ceiling / s }, FINE);
    if let Ok(other) = other {
        let noise = 32.0 * FINE * terms * (1.0 + a + b) + 64.0 * slip(case, fine);
        let (work, v_max) = (s * other.work, other.v_max / 8.0);
        let allowed = |found: f64, exact: f64, number: fn(&Shortcut) -> f64| {
            allowed(family, case, (found - exact) / exact, noise, |s| number(s) / exact)
        };
        row.agree("scaling of the work", work, fine.work, allowed(work, fine.work, |s| s.work));
        row.agree("scaling of v_max", v_max, fine.v_max, allowed(v_max, fine.v_max, |s| s.v_max));
    }
}

#[test]
fn every_step_is_right_or_states_so() {
    examine("step", POINTS, draw);
}

#[test]
fn every_cubic_is_right_or_states_so() {
    examine("cubic", POINTS, draw);
}

#[test]
fn every_bounded_velocity_is_right_or_states_so() {
    examine("bounded_velocity", POINTS, draw);
}

#[test]
fn every_bounded_friction_is_right_or_states_so() {
    examine("bounded_friction", POINTS, draw);
}

/// The first points of the sample against Taylor series in arithmetic of 84 digits: `tests/reference/generate_stress.py`.
#[test]
fn reference_members_of_bounded_friction_of_the_sample() {
    let family = find("bounded_friction").expect("is a family");
    let rows = table("stress_bounded_friction");
    assert!(rows.len() >= 100, "{} rows", rows.len());
    for row in &rows {
        let law @ Law { a, b } = Law { a: row.number("a"), b: row.number("b") };
        let transition = Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") };
        let case = Case { transition, t_f: row.number("t_f"), tau_ceiling: row.number("tau_ceiling") };
        for rtol in [1e-6, 1e-10, 1e-13] {
            let found = solve(family, &case, rtol).unwrap_or_else(|obstacle| panic!("{obstacle} in {row:?}"));
            let logarithms = found.v_max.ln() + transition.v_i.max(transition.v_f).ln();
            let noise = rtol * (1.0 + (a + b) * logarithms) + 8.0 * slip(&case, &found);
            let carried = 2.0 * f64::EPSILON * (1.0 + b / a) * logarithms;
            let numbers: [Number; 5] = [
                ("alpha", |s| s.alpha.unwrap_or(f64::NAN)),
                ("work", |s| s.work),
                ("v_min", |s| s.v_min),
                ("v_max", |s| s.v_max),
                ("friction_max", |s| s.friction_max),
            ];
            for (column, number) in numbers {
                let exact = row.number(column);
                if number(&found) == exact {
                    continue;
                }
                let error = number(&found) / exact - 1.0;
                let allowed = allowed(family, &case, error, noise + carried, |s| number(s) / exact);
                assert!(error.abs() <= allowed, "{column} at {rtol}: off by {error:.1e} > {allowed:.1e} in {row:?}");
            }
        }
    }
}
