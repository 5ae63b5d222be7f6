//! `crossover`: the times at which the optimal strategy changes.

use std::ops::Range;

use super::optimum_cache::transition;
use super::{Column, ColumnBuffer, Definition, Field, Job, RunStats, Stopped, columns, number, place, rows};
use crate::grid::Quantity;
use crate::protocol::optimal::crossover::{self, CrossoverTimes, Wanted};

const TIME: &str = "l/v_0";
const WORK: &str = "mu_0 sigma l";

const FIELDS: [Field<CrossoverTimes>; 12] = [
    Field::new(Column::number("t_cross", TIME, "acceleration: duration at which v(0+) = v_i"), |times| {
        number(times.t_cross)
    }),
    Field::new(Column::number("t_floor", TIME, "acceleration: duration at which v(0+) reaches the floor 1"), |times| {
        number(times.t_floor)
    }),
    Field::new(Column::number("t_cheapest", TIME, "acceleration: duration of least W*"), |times| {
        number(times.t_cheapest)
    }),
    Field::new(Column::number("t_min", TIME, "deceleration: shortest possible duration"), |times| number(times.t_min)),
    Field::new(Column::number("t_turn", TIME, "deceleration: duration at which v(t_f-) = v_f"), |times| {
        number(times.t_turn)
    }),
    Field::new(
        Column::number("t_free_in", TIME, "deceleration: start of the window of durations that never reach the floor"),
        |times| number(times.t_free_in),
    ),
    Field::new(
        Column::number("t_free_out", TIME, "deceleration: end of the window of durations that never reach the floor"),
        |times| number(times.t_free_out),
    ),
    Field::new(Column::number("work_at_t_cross", WORK, "W* at t_cross"), |times| number(times.work_at_t_cross)),
    Field::new(Column::number("work_at_t_floor", WORK, "W* at t_floor"), |times| number(times.work_at_t_floor)),
    Field::new(Column::number("work_at_t_cheapest", WORK, "W* at t_cheapest"), |times| {
        number(times.work_at_t_cheapest)
    }),
    Field::new(Column::number("work_at_t_min", WORK, "W* at t_min"), |times| number(times.work_at_t_min)),
    Field::new(Column::number("work_at_t_turn", WORK, "W* at t_turn"), |times| number(times.work_at_t_turn)),
];

const COLUMNS: [Column; 12] = columns(&FIELDS);

/// One row for each transition.
pub static CROSSOVER: Definition = Definition {
    name: "crossover",
    doc: "the durations at which the optimal strategy changes",
    axes: &[Quantity::A, Quantity::B, Quantity::InitialVelocity, Quantity::FinalVelocity],
    columns: &COLUMNS,
    rows_per_part: 1 << 16,
    cost: 1_800,
    needs_optimum: |_| false,
    compute,
};

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    let wanted = |names: [&str; 2]| job.projection.has_any(names.map(|name| place(&COLUMNS, name)));
    let wanted = Wanted {
        cross: wanted(["t_cross", "work_at_t_cross"]),
        floor: wanted(["t_floor", "work_at_t_floor"]),
        cheapest: wanted(["t_cheapest", "work_at_t_cheapest"]),
        min: wanted(["t_min", "work_at_t_min"]),
        turn: wanted(["t_turn", "work_at_t_turn"]),
        free: wanted(["t_free_in", "t_free_out"]),
    };
    rows::each(job, range, 64, buffer, &FIELDS, |_, point| {
        let (status, times, stats) = crossover::solve(&transition(point), job.bounded, job.rtol, wanted);
        (status, Some(times), RunStats { crossovers: 1, ..RunStats::from(stats) })
    })
}
