//! `crossover`: the times at which the optimal strategy changes.

use std::ops::Range;

use super::optima::transition;
use super::{Column, Job, Selection, Sheet, Stopped, Table, Work, rows};
use crate::grid::Quantity;
use crate::protocol::optimal::crossover::{self, Wanted};

/// One row a transition.
pub struct Crossover;

const TIME: &str = "l/v_0";
const WORK: &str = "mu_0 sigma l";

const COLUMNS: &[Column] = &[
    Column::number("t_cross", TIME, "acceleration: duration at which v(0+) = v_i"),
    Column::number("t_hold", TIME, "acceleration: duration at which v(0+) reaches the bound 1"),
    Column::number("t_cheapest", TIME, "acceleration: duration of least W*"),
    Column::number("t_min", TIME, "deceleration: shortest possible duration"),
    Column::number("t_turn", TIME, "deceleration: duration at which v(t_f-) = v_f"),
    Column::number("t_free_in", TIME, "deceleration: start of the window of durations without hold"),
    Column::number("t_free_out", TIME, "deceleration: end of the window of durations without hold"),
    Column::number("work_cross", WORK, "W* at t_cross"),
    Column::number("work_hold", WORK, "W* at t_hold"),
    Column::number("work_cheapest", WORK, "W* at t_cheapest"),
    Column::number("work_min", WORK, "W* at t_min"),
    Column::number("work_turn", WORK, "W* at t_turn"),
];

impl Table for Crossover {
    fn name(&self) -> &'static str {
        "crossover"
    }

    fn doc(&self) -> &'static str {
        "the durations at which the optimal strategy changes"
    }

    fn axes(&self) -> &'static [Quantity] {
        &[Quantity::A, Quantity::B, Quantity::InitialVelocity, Quantity::FinalVelocity]
    }

    fn columns(&self) -> &'static [Column] {
        COLUMNS
    }

    fn rows_per_part(&self) -> u64 {
        1 << 16
    }

    fn cost(&self) -> u64 {
        1_800
    }

    fn needs_optimum(&self, _selection: &Selection) -> bool {
        false
    }

    fn compute(&self, job: &Job<'_>, range: Range<u64>, sheet: &mut Sheet) -> Result<Work, Stopped> {
        let asked = |columns: &[usize]| job.selection.has_any(columns.iter().copied());
        let wanted = Wanted {
            cross: asked(&[0, 7]),
            hold: asked(&[1, 8]),
            cheapest: asked(&[2, 9]),
            min: asked(&[3, 10]),
            turn: asked(&[4, 11]),
            free: asked(&[5, 6]),
        };
        rows::each(job, range, (COLUMNS.len(), 64), sheet, |_, point, cells| {
            let (status, times, effort) = crossover::solve(&transition(point), job.bounded, job.rtol, wanted);
            let values = [
                times.t_cross,
                times.t_hold,
                times.t_cheapest,
                times.t_min,
                times.t_turn,
                times.t_free_in,
                times.t_free_out,
                times.work_cross,
                times.work_hold,
                times.work_cheapest,
                times.work_min,
                times.work_turn,
            ];
            for (cell, value) in cells.iter_mut().zip(values) {
                *cell = value.unwrap_or(f64::NAN);
            }
            (status, Work { crossovers: 1, ..Work::from(effort) })
        })
    }
}
