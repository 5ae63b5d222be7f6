//! `feedback`: the protocol of the row's own `C`, integrated from its state; its gain by those of neighbouring states.

use super::clamped::{Solution, Totals, Way};
use super::{Context, Verdict, number, word};
use crate::dataset::Row;
use crate::model::Law;
use crate::protocol::optimal::ArcKind;
use crate::table::STATUS;

pub fn check(row: &Row, context: &Context, rtol: f64) -> Verdict {
    let axis = |name: &str| number(row, name);
    let (Some(theta), Some(t_left), Some(a), Some(b), Some(v_f)) =
        (axis("theta"), axis("t_left"), axis("a"), axis("b"), axis("v_f"))
    else {
        return Verdict::unchecked("an axis is missing");
    };
    let [v_ceiling, tau_ceiling] = ["v_ceiling", "tau_ceiling"].map(|name| axis(name).unwrap_or(f64::INFINITY));
    let law = Law { a, b };
    let way = Way { law, from: theta, v_f, t_f: t_left, floor: context.bounded, v_ceiling, tau_ceiling };
    let mut verdict = Verdict::default();
    match way.is_feasible() {
        None => verdict.miss("it is too close to the border of what is feasible"),
        Some(feasible) => verdict.status(row, !feasible),
    }
    let (Some(v), Some(costate)) = (axis("v"), axis("costate")) else {
        if word(row, STATUS) != Some("infeasible") {
            verdict.miss("a column is missing: v or costate");
        }
        return verdict;
    };
    // P = (tau v + C)/(u - 1) at the start.
    let u = theta * v;
    let c = costate * (u - 1.0) - (1.0 + a * v.ln() + b * theta.ln()) * v;
    // If theta rises now, it may turn later.
    let is_near = |found: &Solution| (found.totals.v_start / v - 1.0).abs() < 1e-3;
    let mut both = [u < 1.0, false].into_iter().filter_map(|turns| way.solve(c, turns));
    let Some(solution) = both.find(is_near) else {
        verdict.miss("the integrator did not get there");
        return verdict;
    };
    type Number = fn(&Totals) -> f64;
    let numbers: [(&str, Number); 3] =
        [("v", |found| found.v_start), ("work_to_go", |found| found.work), ("costate", |found| found.costate[0])];
    for (column, number) in numbers {
        let expected = number(&solution.totals);
        verdict.compare(row, column, Some(expected), Some(expected.abs() + solution.noise(number) / rtol));
    }
    verdict.compare_word(row, "arc", solution.arc.name());
    if axis("gain").is_some() {
        match gain(&way, &solution) {
            Some((gain, noise)) => verdict.compare(row, "gain", Some(gain), Some(gain.abs() + noise / rtol)),
            None => verdict.miss("gains at the border of what is feasible"),
        }
    }
    verdict
}

/// Relative step of theta. Chosen: the fifth root of the noise of a velocity, 1e-12, balances both errors of the extrapolated difference
/// within a factor of ten.
const THETA_STEP_RTOL: f64 = 5e-4;

/// `dv/dtheta` at fixed time left, from the protocols of neighbouring states, and its error.
fn gain(way: &Way, solution: &Solution) -> Option<(f64, f64)> {
    let v_start = solution.totals.v_start;
    let exact = match solution.arc {
        ArcKind::Free => None,
        ArcKind::Floor | ArcKind::VCeiling => Some(0.0),
        ArcKind::TauCeiling => Some(-way.law.b * v_start / (way.law.a * way.from)),
    };
    if let Some(gain) = exact {
        return Some((gain, f64::EPSILON * v_start / way.from));
    }
    let v = |step: f64| {
        let from = way.from * (1.0 + step);
        Some(Way { from, ..*way }.solve(solution.totals.c, solution.turns())?.totals.v_start)
    };
    let slope = |step: f64| Some((v(step)? - v(-step)?) / (2.0 * step * way.from));
    let (wide, narrow) = (slope(2.0 * THETA_STEP_RTOL)?, slope(THETA_STEP_RTOL)?);
    let noise = solution.noise(|found| found.v_start).max(1e-12 * v_start) / (THETA_STEP_RTOL * way.from);
    Some((narrow + (narrow - wide) / 3.0, (narrow - wide).abs() + noise))
}
