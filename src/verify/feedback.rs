//! `feedback`: the traced optimum from the state of the row; its gain by those of neighbouring states.

use super::optimal::Optimum;
use super::task::Task;
use super::verdict::{Checked, axis};
use super::{Context, Verdict, number, word};
use crate::dataset::Row;
use crate::model::{Law, Transition};
use crate::protocol::optimal::{ArcKind, Bounds};
use crate::table::STATUS;

pub fn check(row: &Row, context: &Context, rtol: f64) -> Checked {
    let (theta, t_f, v_f) = (axis(row, "theta")?, axis(row, "t_left")?, axis(row, "v_f")?);
    let law = Law { a: axis(row, "a")?, b: axis(row, "b")? };
    let [v_ceiling, tau_ceiling] = ["v_ceiling", "tau_ceiling"].map(|name| number(row, name).unwrap_or(f64::INFINITY));
    let problem = Transition { law, v_i: 1.0 / theta, v_f };
    let bounds = Bounds { floor: context.bounded, v_ceiling, tau_ceiling };
    let task = Task { problem, theta: Some(theta), t_f, bounds };
    let mut verdict = Verdict::default();
    task.compare_status(&mut verdict, row);
    if number(row, "v").is_none() && number(row, "costate").is_none() {
        if word(row, STATUS) != Some("infeasible") {
            verdict.miss("a column is missing: v or costate");
        }
        return Ok(verdict);
    }
    let Some(optimum) = task.certify(&mut verdict) else { return Ok(verdict) };
    let near = task.near();
    let near = near.as_ref().unwrap_or(&optimum);
    let costate = |optimum: &Optimum| -optimum.start.beta.unwrap_or(f64::NAN);
    for (column, expected, other) in [
        ("v", optimum.start.v, near.start.v),
        ("work_to_go", optimum.work, near.work),
        ("costate", costate(&optimum), costate(near)),
    ] {
        verdict.compare(row, column, Some(expected), Some(expected.abs() + (other - expected).abs() / rtol));
    }
    verdict.compare_word(row, "arc", optimum.arc().name());
    if number(row, "gain").is_some() {
        match gain(&task, &optimum, near) {
            Some((gain, noise)) => verdict.compare(row, "gain", Some(gain), Some(gain.abs() + noise / rtol)),
            None => verdict.miss("gains at the border of what is feasible"),
        }
    }
    Ok(verdict)
}

/// Relative step of theta. Chosen: the fifth root of the noise of a velocity, 1e-12, balances both errors of the extrapolated difference
/// within a factor of ten.
const THETA_STEP_RTOL: f64 = 5e-4;

/// `dv/dtheta` at fixed time left, from the optima of neighbouring states, and its error.
fn gain(task: &Task, optimum: &Optimum, near: &Optimum) -> Option<(f64, f64)> {
    let (theta, v_start, Law { a, b }) = (task.from(), optimum.start.v, task.problem.law);
    let exact = match optimum.arc() {
        ArcKind::Free => None,
        ArcKind::Floor | ArcKind::VCeiling => Some(0.0),
        ArcKind::TauCeiling => Some(-b * v_start / (a * theta)),
    };
    if let Some(gain) = exact {
        return Some((gain, f64::EPSILON * v_start / theta));
    }
    let v = |step: f64| {
        let neighbour = Task { theta: Some(theta * (1.0 + step)), ..*task };
        Some(neighbour.certify(&mut Verdict::default())?.start.v)
    };
    let slope = |step: f64| Some((v(step)? - v(-step)?) / (2.0 * step * theta));
    let (wide, narrow) = (slope(2.0 * THETA_STEP_RTOL)?, slope(THETA_STEP_RTOL)?);
    let noise = (near.start.v - v_start).abs().max(1e-12 * v_start) / (THETA_STEP_RTOL * theta);
    Some((narrow + (narrow - wide) / 3.0, (narrow - wide).abs() + noise))
}
