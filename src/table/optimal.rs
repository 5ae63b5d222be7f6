//! `optimal`: the protocol of least work.

use std::ops::Range;

use super::optima::{OPTIMUM_AXES, work_error};
use super::{Column, Job, Kind, Selection, Sheet, Stopped, Table, Work, rows};
use crate::grid::Quantity;

/// One row a transition and time.
pub struct Optimal;

const WORK_ERROR: usize = 7;

/// The words of `strategy`, in the order of [`Strategy::ALL`](crate::protocol::optimal::Strategy::ALL).
const STRATEGIES: &[&str] = &["speed_up", "slow_down", "hold"];

const COLUMNS: &[Column] = &[
    Column::number("work", "mu_0 sigma l", "least work of friction W*"),
    Column::number("v_start", "v_0", "velocity just after the start, v(0+)"),
    Column::number("v_end", "v_0", "velocity just before the end, v(t_f-)"),
    Column::number("hold_time", "l/v_0", "time spent on the bound v = 1"),
    Column::number("hamiltonian", "mu_0 sigma v_0", "dW*/dt_f"),
    Column::number("theta_max", "l/v_0", "largest contact lifetime on the way"),
    Column::new(
        "strategy",
        Kind::Label(STRATEGIES),
        "how it starts: speed_up v(0+) > v_i, slow_down 1 < v(0+) <= v_i, hold on the bound v = 1",
    ),
    Column::number("work_error", "mu_0 sigma l", "bound of the error of work, by a second solve").optional(),
];

impl Table for Optimal {
    fn name(&self) -> &'static str {
        "optimal"
    }

    fn doc(&self) -> &'static str {
        "the protocol of least work"
    }

    fn axes(&self) -> &'static [Quantity] {
        OPTIMUM_AXES
    }

    fn columns(&self) -> &'static [Column] {
        COLUMNS
    }

    fn rows_per_part(&self) -> u64 {
        1 << 16
    }

    fn cost(&self) -> u64 {
        2_500
    }

    fn needs_optimum(&self, _selection: &Selection) -> bool {
        true
    }

    fn compute(&self, job: &Job<'_>, range: Range<u64>, sheet: &mut Sheet) -> Result<Work, Stopped> {
        rows::each(job, range, (COLUMNS.len(), 64), sheet, |tuple, point, cells| {
            let (solved, mut work) = job.optima.get(tuple, point);
            if let Some(optimum) = solved.value {
                if job.selection.has(WORK_ERROR) {
                    cells[WORK_ERROR] = work_error(job, point, &optimum, &mut work);
                }
                cells[..WORK_ERROR].copy_from_slice(&[
                    optimum.work,
                    optimum.v_start,
                    optimum.v_end,
                    optimum.hold_time,
                    optimum.hamiltonian,
                    optimum.theta_max,
                    f64::from(optimum.strategy as u8),
                ]);
            }
            (solved.status, work)
        })
    }
}

#[cfg(test)]
mod tests {
    //! The words of a label are those of its type.

    use super::*;
    use crate::protocol::optimal::Strategy;

    #[test]
    fn strategies_are_named_alike() {
        assert_eq!(Strategy::ALL.map(Strategy::name), STRATEGIES);
        assert_eq!(Strategy::ALL.map(|strategy| strategy as usize), [0, 1, 2]);
    }
}
