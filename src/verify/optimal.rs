//! `optimal`: the extremal of the row's duration, by an integrator.

use super::clamped::Way;
use super::extremal::{Extremal, branch, energy, min_duration, solve_with};
use super::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::model::Transition;
use crate::table::STATUS;

/// Relative sizes of the variations that are compared with the optimum.
const SIZES: [f64; 4] = [-1e-2, 1e-2, -1e-4, 1e-4];

pub fn check(row: &Row, context: &Context) -> Verdict {
    let (Some(problem), Some(t_f)) = (transition(row), number(row, "t_f")) else {
        return Verdict::unchecked("an axis is missing");
    };
    let ceilings = ["v_ceiling", "tau_ceiling"].map(|name| number(row, name).unwrap_or(f64::INFINITY));
    if ceilings.into_iter().any(f64::is_finite) {
        return under_ceilings(row, &Way::of(&problem, context.bounded, ceilings), t_f);
    }
    let mut verdict = Verdict::default();
    let infeasible = context.bounded && t_f < min_duration(&problem);
    verdict.status(row, infeasible);
    if infeasible || word(row, STATUS) == Some("infeasible") {
        return verdict;
    }
    let Some((extremal, varied)) = solve_with(&problem, t_f, context.bounded, &SIZES) else {
        verdict.miss("the integrator did not get there");
        return verdict;
    };
    let size = extremal.work.abs();
    verdict.compare(row, "work", Some(extremal.work), Some(size));
    verdict.compare(row, "v_start", Some(extremal.v_start), None);
    verdict.compare(row, "v_end", Some(extremal.v_end), None);
    verdict.compare(row, "time_at_floor", Some(extremal.time_at_floor), (extremal.time_at_floor == 0.0).then_some(t_f));
    verdict.compare(row, "hamiltonian", Some(-extremal.c), None);
    verdict.compare(row, "theta_max", Some(extremal.theta_max), None);
    verdict.friction(row, friction_min(&problem, &extremal));
    let strategy = match extremal.v_start {
        _ if extremal.time_at_floor > 0.0 => "floor",
        v if v > problem.v_i => "speed_up",
        _ => "slow_down",
    };
    verdict.compare_word(row, "strategy", strategy);
    // No admissible variation may cost less.
    if let (Some(work), Some(least)) = (number(row, "work"), varied.into_iter().reduce(f64::min)) {
        verdict.push("beaten", ((work - least) / size).max(0.0));
    }
    verdict
}

/// Time at the floor beyond which the conserved `C` no longer determines the rest of the path.
const MAX_TIME_AT_FLOOR: f64 = 12.0;

/// A row under ceilings: the protocol of the row's own `C` and the next steps of Newton's method, integrated.
fn under_ceilings(row: &Row, way: &Way, t_f: f64) -> Verdict {
    let mut verdict = Verdict::default();
    match way.feasible(t_f) {
        None => verdict.miss("it is too close to the border of what is feasible"),
        Some(feasible) => verdict.status(row, !feasible),
    }
    let (Some(hamiltonian), Some(v_start), Some(v_end)) =
        (number(row, "hamiltonian"), number(row, "v_start"), number(row, "v_end"))
    else {
        if word(row, STATUS) != Some("infeasible") {
            verdict.miss("a column is missing: hamiltonian, v_start or v_end");
        }
        return verdict;
    };
    if way.sits() || number(row, "time_at_floor").is_some_and(|time| time > MAX_TIME_AT_FLOOR) {
        verdict.miss("C does not determine it: it waits at the floor for long, or slides steadily at v_f");
        return verdict;
    }
    // Theta rises first and falls at the end.
    let turns = v_start * way.from < 1.0 && v_end * way.to > 1.0;
    let Some(found) = way.solve(t_f, -hamiltonian, turns) else {
        verdict.miss("the integrator did not get there");
        return verdict;
    };
    let size = found.work.abs();
    let or_t_f = |time: f64| Some(if time == 0.0 { t_f } else { time });
    verdict.compare(row, "work", Some(found.work), Some(size));
    verdict.compare(row, "v_start", Some(found.v_start), None);
    verdict.compare(row, "v_end", Some(found.v_end), None);
    verdict.compare(row, "time_at_floor", Some(found.time_at_floor), or_t_f(found.time_at_floor));
    verdict.compare(row, "time_at_v_ceiling", Some(found.time_at_v_ceiling), or_t_f(found.time_at_v_ceiling));
    verdict.compare(row, "time_at_tau_ceiling", Some(found.time_at_tau_ceiling), or_t_f(found.time_at_tau_ceiling));
    verdict.compare(row, "hamiltonian", Some(-found.c), None);
    verdict.compare(row, "theta_max", Some(found.theta_max), None);
    verdict.friction(row, found.friction[0]);
    let [by_v, by_tau] = found.pressure.map(|pressure| -pressure);
    let [start, end] = found.costate;
    for (column, expected) in [
        ("dwork_da", found.by_law[0]),
        ("dwork_db", found.by_law[1]),
        ("dwork_dv_i", -start * way.from * way.from),
        ("dwork_dv_f", end * way.to * way.to),
        ("dwork_dv_ceiling", by_v),
        ("dwork_dtau_ceiling", by_tau),
    ] {
        verdict.compare(row, column, Some(expected), (expected == 0.0).then_some(1.0));
    }
    // No admissible variation may cost less, with time at its price.
    let cost = found.work + found.c * found.time;
    verdict.push("beaten", ((cost - found.varied) / size).max(0.0));
    verdict
}

/// Places on either leg at which friction is evaluated.
const PLACES: u32 = 4000;

/// Least friction: on the hold it rises; on the arc `u - 1 - ln u` follows from theta, rising and then falling.
fn friction_min(problem: &Transition, extremal: &Extremal) -> f64 {
    let Transition { law, v_i, v_f } = *problem;
    let held = if extremal.time_at_floor > 0.0 { 1.0 - law.b * v_i.ln() } else { f64::INFINITY };
    let start = if extremal.time_at_floor > 0.0 {
        1.0 + (1.0 / v_i - 1.0) * (-extremal.time_at_floor).exp()
    } else {
        1.0 / v_i
    };
    let friction = |z: f64, theta: f64| 1.0 + law.a * z + (law.b - law.a) * theta.ln();
    let mut least = held.min(friction((extremal.v_start * start).ln(), start));
    least = least.min(friction((extremal.v_end / v_f).ln(), 1.0 / v_f));
    let legs = [(extremal.v_start * start < 1.0, start, false), (extremal.v_end > v_f, 1.0 / v_f, true)];
    for (_, theta, falling) in legs.into_iter().filter(|(is_there, ..)| *is_there) {
        for place in 0..=PLACES {
            let fraction = f64::from(place) / f64::from(PLACES);
            let theta = theta * (extremal.theta_max / theta).powf(fraction);
            if let Some(z) = branch(energy(law, extremal.c, theta), falling) {
                least = least.min(friction(z, theta));
            }
        }
    }
    least
}
