//! `feedback`: the traced optimum from the state of the row; its gain by those of neighbouring states.

use super::optimal::Optimum;
use super::task::Task;
use super::{Checked, CheckedRow};
use crate::grid::Quantity;
use crate::model::{Law, Transition};
use crate::numerics::LONG_ROUNDING_RTOL;
use crate::protocol::optimal::ArcKind;
use crate::table::transition;

pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let [theta, t_f] = [Quantity::Theta, Quantity::TimeLeft].map(|axis| row.point[axis]);
    let problem = Transition { v_i: 1.0 / theta, ..transition(&row.point) };
    let task = Task { theta: Some(theta), ..Task::new(&problem, t_f, row.bounds()) };
    if !row.compare_feasible(task.is_feasible()) {
        return Ok(());
    }
    let Some(optimum) = row.certify(&task) else { return Ok(()) };
    let (near, rtol) = (task.near(), row.context.rtol);
    let near = near.as_ref().unwrap_or(&optimum);
    let costate = |optimum: &Optimum| -optimum.start.beta.unwrap_or(f64::NAN);
    for (column, expected, other) in [
        ("v", optimum.start.v, near.start.v),
        ("work_to_go", optimum.work, near.work),
        ("costate", costate(&optimum), costate(near)),
    ] {
        row.compare_relative(column, expected, expected.abs() + (other - expected).abs() / rtol);
    }
    row.compare_word("arc", optimum.arc().name());
    if row.number("gain").is_some() {
        let (gain, noise) = gain(&task, &optimum, near).ok_or("gains at the border of what is feasible")?;
        row.compare_relative("gain", gain, gain.abs() + noise / rtol);
    }
    Ok(())
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
        Some(neighbour.certify().ok()?.start.v)
    };
    let slope = |step: f64| Some((v(step)? - v(-step)?) / (2.0 * step * theta));
    let (wide, narrow) = (slope(2.0 * THETA_STEP_RTOL)?, slope(THETA_STEP_RTOL)?);
    let noise = (near.start.v - v_start).abs().max(LONG_ROUNDING_RTOL * v_start) / (THETA_STEP_RTOL * theta);
    Some((narrow + (narrow - wide) / 3.0, (narrow - wide).abs() + noise))
}
