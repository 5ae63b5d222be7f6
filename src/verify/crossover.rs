//! `crossover`: the optimum of each of the row's times meets the condition that defines the time.

use super::checked_row::NEGATIVE;
use super::optimal::Optimum;
use super::route::integrate;
use super::task::{Task, min_duration};
use super::{Checked, CheckedRow};
use crate::model::Transition;

/// Relative step of a time for the slope of its condition. Chosen: the cube root of rounding, which balances both errors of a central difference.
const TIME_STEP_RTOL: f64 = 1e-5;

/// A condition: a function of the optimum that is 0 at the time.
type Condition<'a> = &'a dyn Fn(&Optimum) -> f64;

/// Compares a time with the root of its condition near it, and the work, if it has a column, with that of the optimum there.
fn compare(
    row: &mut CheckedRow<'_>,
    [time, work]: [&'static str; 2],
    (exists, bounded, problem): (bool, bool, &Transition),
    condition: Condition<'_>,
) {
    if !exists {
        return [time, work].iter().for_each(|column| row.compare(column, None));
    }
    if row.number(time).is_none() && row.has_status(NEGATIVE) {
        return row.miss("a time at which friction may be too low for a proof");
    }
    [time, work].iter().for_each(|column| row.demand(column, true));
    let Some(t) = row.number(time).filter(|t| *t > 0.0) else {
        return row.miss("a work at a time that was not written");
    };
    let mut at = |t: f64| row.certify(&Task::new(problem, t, bounded));
    let (Some(before), Some(here), Some(after)) =
        (at(t * (1.0 - TIME_STEP_RTOL)), at(t), at(t * (1.0 + TIME_STEP_RTOL)))
    else {
        return;
    };
    let slope = (condition(&after) - condition(&before)) / (2.0 * TIME_STEP_RTOL);
    row.compare(time, t * (1.0 - condition(&here) / slope));
    row.compare(work, here.work);
}

pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let problem = row.transition()?;
    if !(row.has_status("ok") || row.has_status(NEGATIVE)) {
        return Err("status is neither ok nor negative_friction");
    }
    let Transition { law, v_i, v_f } = problem;
    let (a, b, bounded) = (law.a, law.b, row.context.bounded);
    let (ln_i, ln_f) = (v_i.ln(), v_f.ln());
    let (tau_i, tau_f) = (1.0 + (a - b) * ln_i, 1.0 + (a - b) * ln_f);
    // Friction just after a jump to the floor.
    let tau_floor = 1.0 - b * ln_i;
    let accelerates = v_f > v_i;
    let starts_at_floor = |at: &Optimum| at.start.v.ln();
    let mut pair = |columns, exists, bounded, condition: Condition<'_>| {
        compare(row, columns, (exists, bounded, &problem), condition);
    };
    let cross = accelerates && tau_i > b - a && v_f * tau_f > v_i * tau_i;
    pair(["t_cross", "work_at_t_cross"], cross, false, &|at| (at.start.v / v_i).ln());
    let floor = accelerates && tau_floor > b - a && v_f * tau_f > v_i * (tau_floor + a) - a;
    pair(["t_floor", "work_at_t_floor"], floor, false, &starts_at_floor);
    pair(["t_cheapest", "work_at_t_cheapest"], accelerates && tau_i > 0.0 && tau_f > 0.0, false, &|at| at.c);
    if v_f < v_i {
        pair(["t_turn", "work_at_t_turn"], tau_f > b - a, bounded, &|at| (at.end.v / v_f).ln());
    }
    // The window of decelerations above the floor: v(0+) = 1 determines C, and C the energy e^z - 1 - z at the target.
    let left = (tau_f + (a - v_i * (tau_floor + a)) / v_f) / a;
    let window = !accelerates && bounded && tau_f > b - a && tau_floor > b - a && left > 0.0;
    if window && v_i == v_f {
        // For equal velocities the window begins at 0.
        row.compare_relative("t_free_in", 0.0, 1.0);
    } else {
        pair(["t_free_in", ""], window, false, &starts_at_floor);
    }
    compare(row, ["t_free_out", ""], (window, false, &problem), &starts_at_floor);
    if !accelerates {
        let t_min = min_duration(&problem, true);
        let scale = |number: f64| if t_min == 0.0 { 1.0 } else { number.abs() };
        row.compare_relative("t_min", bounded.then_some(t_min), scale(t_min));
        // Theta in units of its start, and the time and the work in units of t_min.
        let slope = |y: &[f64; 2]| [t_min * (v_i - y[0]), tau_floor + b * y[0].ln()];
        let work = integrate(slope, [1.0, 0.0], (0.0, 1.0)).map(|y| t_min * y[1]).filter(|_| bounded);
        row.compare_relative("work_at_t_min", work, scale(work.unwrap_or(1.0)));
    }
    Ok(())
}
