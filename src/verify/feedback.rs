//! `feedback`: the protocol of the row's own `C`, integrated from its state.

use super::clamped::Way;
use super::{Context, Verdict, number, word};
use crate::dataset::Row;
use crate::model::Law;
use crate::table::STATUS;

pub fn check(row: &Row, context: &Context) -> Verdict {
    let axis = |name: &str| number(row, name);
    let (Some(theta), Some(t_left), Some(a), Some(b), Some(v_f)) =
        (axis("theta"), axis("t_left"), axis("a"), axis("b"), axis("v_f"))
    else {
        return Verdict::unchecked("an axis is missing");
    };
    let [v_ceiling, tau_ceiling] = ["v_ceiling", "tau_ceiling"].map(|name| axis(name).unwrap_or(f64::INFINITY));
    let law = Law { a, b };
    let way = Way { law, from: theta, to: 1.0 / v_f, floor: context.bounded, v_ceiling, tau_ceiling };
    let mut verdict = Verdict::default();
    match way.feasible(t_left) {
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
    // A theta that rises now may turn or not.
    let both = [u < 1.0, false].map(|turns| way.solve(t_left, c, turns));
    let is_near = |found: &f64| (found / v - 1.0).abs() < 1e-3;
    let Some(found) = both.into_iter().flatten().find(|found| is_near(&found.v_start)) else {
        verdict.miss("the integrator did not get there");
        return verdict;
    };
    verdict.compare(row, "v", Some(found.v_start), None);
    verdict.compare(row, "work_to_go", Some(found.work), None);
    verdict.compare(row, "costate", Some(found.costate[0]), None);
    let arc = match found.v_start {
        _ if context.bounded && (v - 1.0).abs() < 1e-9 => "floor",
        v if v >= v_ceiling * (1.0 - 1e-12) => "v_ceiling",
        _ if found.on_friction_ceiling => "tau_ceiling",
        _ => "free",
    };
    verdict.compare_word(row, "arc", arc);
    verdict
}
