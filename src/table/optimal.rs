//! `optimal`: the protocol of least work.

use std::ops::Range;

use super::optimum_cache::{OPTIMUM_AXES, work_error};
use super::{Column, ColumnBuffer, Definition, Field, Job, Kind, RunStats, Stopped, columns, place, rows};
use crate::protocol::optimal::Optimum;

/// The words of `strategy`, in the order of [`Strategy::ALL`](crate::protocol::optimal::Strategy::ALL).
const STRATEGIES: &[&str] = &["speed_up", "slow_down", "floor"];

/// A row.
struct Row {
    optimum: Optimum,
    work_error: f64,
}

const FIELDS: [Field<Row>; 8] = [
    Field::new(Column::number("work", "mu_0 sigma l", "least work of friction W*"), |row| row.optimum.work),
    Field::new(Column::number("v_start", "v_0", "velocity just after the start, v(0+)"), |row| row.optimum.v_start),
    Field::new(Column::number("v_end", "v_0", "velocity just before the end, v(t_f-)"), |row| row.optimum.v_end),
    Field::new(Column::number("time_at_floor", "l/v_0", "time spent on the velocity floor v = 1"), |row| {
        row.optimum.time_at_floor
    }),
    Field::new(Column::number("hamiltonian", "mu_0 sigma v_0", "dW*/dt_f"), |row| row.optimum.hamiltonian),
    Field::new(Column::number("theta_max", "l/v_0", "greatest state variable theta on the path"), |row| {
        row.optimum.theta_max
    }),
    Field::new(
        Column::new(
            "strategy",
            Kind::Label(STRATEGIES),
            "start of the protocol: speed_up v(0+) > v_i, slow_down 1 < v(0+) <= v_i, floor v(0+) = 1",
        ),
        |row| f64::from(row.optimum.strategy as u8),
    ),
    Field::new(
        Column::number("work_error", "mu_0 sigma l", "error bound of work, by a second solve").optional(),
        |row| row.work_error,
    ),
];

const COLUMNS: [Column; 8] = columns(&FIELDS);
const WORK_ERROR: usize = place(&COLUMNS, "work_error");

/// One row for each transition and duration.
pub static OPTIMAL: Definition = Definition {
    name: "optimal",
    doc: "the protocol of least work",
    axes: OPTIMUM_AXES,
    columns: &COLUMNS,
    rows_per_part: 1 << 16,
    cost: 2_500,
    needs_optimum: |_| true,
    compute,
};

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    rows::each(job, range, 64, buffer, &FIELDS, |tuple, point| {
        let (solved, mut work) = job.optimum_cache.get(tuple, point);
        let row = solved.value.map(|optimum| {
            let wanted = job.projection.has(WORK_ERROR);
            let work_error = if wanted { work_error(job, point, &optimum, &mut work) } else { f64::NAN };
            Row { optimum, work_error }
        });
        (solved.status, row, work)
    })
}

#[cfg(test)]
mod tests {
    //! The words of the column are those of its type.

    use super::*;
    use crate::protocol::optimal::Strategy;

    #[test]
    fn strategies_are_named_alike() {
        assert_eq!(Strategy::ALL.map(Strategy::name), STRATEGIES);
        assert_eq!(Strategy::ALL.map(|strategy| strategy as usize), [0, 1, 2]);
    }
}
