//! `regularised`: the optimal protocol with its jumps replaced by smooth pieces.

use std::ops::Range;

use super::compliant::{slider, velocities};
use super::{Column, Job, Selection, Sheet, Stopped, Table, Work, rows};
use crate::grid::Quantity;
use crate::protocol::{error, regularised};

/// One row a transition, time, stiffness, mass and length of the pieces.
pub struct Regularised;

const COLUMNS: &[Column] = &[
    Column::number("work", "mu_0 sigma l", "work of friction"),
    Column::number("work_optimal", "mu_0 sigma l", "least work of friction W* of any protocol"),
    Column::number("gap", "1", "(work - W*)/W*, good to rtol of itself"),
    Column::number("v_min", "v_0", "least velocity of the block; fewer digits where it dips far below 1"),
    Column::number("v_max", "v_0", "greatest velocity of the block"),
    Column::number("v_c_min", "v_0", "least control velocity; both good to rtol of the greater of the two"),
    Column::number("v_c_max", "v_0", "greatest control velocity"),
    Column::number("work_error", "mu_0 sigma l", "bound of the error of work, by a second solve").optional(),
    Column::number("gap_error", "1", "bound of the error of gap, by a second solve").optional(),
];

const WORK_ERROR: usize = 7;
const GAP_ERROR: usize = 8;

impl Table for Regularised {
    fn name(&self) -> &'static str {
        "regularised"
    }

    fn doc(&self) -> &'static str {
        "the optimal protocol, its jumps made smooth"
    }

    fn axes(&self) -> &'static [Quantity] {
        &[
            Quantity::Time,
            Quantity::A,
            Quantity::B,
            Quantity::InitialVelocity,
            Quantity::FinalVelocity,
            Quantity::Stiffness,
            Quantity::Mass,
            Quantity::Smoothing,
        ]
    }

    fn columns(&self) -> &'static [Column] {
        COLUMNS
    }

    fn rows_per_part(&self) -> u64 {
        1 << 14
    }

    fn cost(&self) -> u64 {
        50_000
    }

    fn needs_optimum(&self, _selection: &Selection) -> bool {
        false
    }

    fn compute(&self, job: &Job<'_>, range: Range<u64>, sheet: &mut Sheet) -> Result<Work, Stopped> {
        rows::each(job, range, (COLUMNS.len(), 16), sheet, |_, point, cells| {
            let (t_f, delta_t) = (point[Quantity::Time], point[Quantity::Smoothing]);
            let solve = |rtol| regularised::solve(&slider(point), velocities(point), t_f, delta_t, job.bounded, rtol);
            let solved = solve(job.rtol);
            let mut effort = solved.effort;
            if let Some(found) = solved.value {
                if job.selection.has_any([WORK_ERROR, GAP_ERROR]) {
                    let finest = solve(error::FINEST);
                    effort += finest.effort;
                    if let Some(finest) = finest.value {
                        cells[WORK_ERROR] = error::bound(found.work, finest.work, found.work);
                        cells[GAP_ERROR] = error::of_excess(found.gap, finest.gap, found.replaced / found.work_optimal);
                    }
                }
                cells[..WORK_ERROR].copy_from_slice(&[
                    found.work,
                    found.work_optimal,
                    found.gap,
                    found.v_min,
                    found.v_max,
                    found.control_min,
                    found.control_max,
                ]);
            }
            (solved.status, Work { optima: 1, ..Work::from(effort) })
        })
    }
}
