//! `crossover`: the optimum of each of the row's times meets the condition that defines the time.

use super::checked_row::NEGATIVE;
use super::optimal::Optimum;
use super::route::integrate;
use super::task::{Task, min_duration};
use super::{Checked, CheckedRow};
use crate::model::Transition;
use crate::table::transition;

/// Relative step of a time for the slope of its condition. Chosen: the cube root of rounding, which balances both errors of a central difference.
const TIME_STEP_RTOL: f64 = 1e-5;

/// A condition: a function of the optimum that is 0 at the time.
type Condition<'a> = &'a dyn Fn(&Optimum) -> f64;

/// Compares a time, if the row has it, with the root of its condition near it, and the work, if it has a column, with that of the optimum there.
fn compare(
    row: &mut CheckedRow<'_>,
    [time, work]: [&'static str; 2],
    (bounded, problem): (bool, &Transition),
    condition: Condition<'_>,
) {
    // A window of equal velocities begins at 0.
    let Some(t) = row.number(time).filter(|t| *t > 0.0) else {
        if row.number(work).is_some() {
            row.miss("a work at a time that was not written");
        }
        return;
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
    let problem = transition(&row.point);
    if !(row.has_status("ok") || row.has_status(NEGATIVE)) {
        return Err("status is neither ok nor negative_friction");
    }
    let (Transition { law, v_i, v_f }, bounded) = (problem, row.context.bounded);
    let starts_at_floor: Condition<'_> = &|at| at.start.v.ln();
    let conditions: [([&str; 2], bool, Condition<'_>); 6] = [
        (["t_cross", "work_at_t_cross"], false, &|at| (at.start.v / v_i).ln()),
        (["t_floor", "work_at_t_floor"], false, starts_at_floor),
        (["t_cheapest", "work_at_t_cheapest"], false, &|at| at.c),
        (["t_turn", "work_at_t_turn"], bounded, &|at| (at.end.v / v_f).ln()),
        (["t_free_in", ""], false, starts_at_floor),
        (["t_free_out", ""], false, starts_at_floor),
    ];
    for (columns, bounded, condition) in conditions {
        compare(row, columns, (bounded, &problem), condition);
    }
    if row.number("t_min").is_some() || row.number("work_at_t_min").is_some() {
        let t_min = min_duration(&problem, true);
        let scale = |number: f64| if t_min == 0.0 { 1.0 } else { number.abs() };
        row.compare_number("t_min", t_min, scale(t_min));
        // Theta in units of its start, and the time and the work in units of t_min; friction just after a jump to the floor.
        let tau_floor = 1.0 - law.b * v_i.ln();
        let slope = |y: &[f64; 2]| [t_min * (v_i - y[0]), tau_floor + law.b * y[0].ln()];
        let [_, work] = integrate(slope, [1.0, 0.0], (0.0, 1.0)).ok_or("the integrator fails")?;
        row.compare_number("work_at_t_min", t_min * work, scale(t_min * work));
    }
    Ok(())
}
