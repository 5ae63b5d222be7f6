//! `crossover`: the times at which the optimal strategy changes.

use std::ops::Range;

use super::column::fields;
use super::optimum_cache::transition;
use super::{ColumnBuffer, Job, RunStats, Stopped, Table, number, rows};
use crate::grid::Quantity;
use crate::protocol::optimal::crossover::{self, CrossoverTimes, Wanted};

fields! { CrossoverTimes:
    t_cross "l/v_0" "acceleration: duration at which v(0+) = v_i" => |times| number(times.t_cross);
    t_floor "l/v_0" "acceleration: duration at which v(0+) reaches the floor 1"
        => |times| number(times.t_floor);
    t_cheapest "l/v_0" "acceleration: duration of least W*" => |times| number(times.t_cheapest);
    t_min "l/v_0" "deceleration: shortest possible duration" => |times| number(times.t_min);
    t_turn "l/v_0" "deceleration: duration at which v(t_f-) = v_f" => |times| number(times.t_turn);
    t_free_in "l/v_0" "deceleration: start of the window of durations that never reach the floor"
        => |times| number(times.t_free_in);
    t_free_out "l/v_0" "deceleration: end of the window of durations that never reach the floor"
        => |times| number(times.t_free_out);
    work_at_t_cross "mu_0 sigma l" "W* at t_cross" => |times| number(times.work_at_t_cross);
    work_at_t_floor "mu_0 sigma l" "W* at t_floor" => |times| number(times.work_at_t_floor);
    work_at_t_cheapest "mu_0 sigma l" "W* at t_cheapest" => |times| number(times.work_at_t_cheapest);
    work_at_t_min "mu_0 sigma l" "W* at t_min" => |times| number(times.work_at_t_min);
    work_at_t_turn "mu_0 sigma l" "W* at t_turn" => |times| number(times.work_at_t_turn);
}

/// One row for each transition.
pub static CROSSOVER: Table = Table {
    name: "crossover",
    doc: "the durations at which the optimal strategy changes",
    axes: &[Quantity::A, Quantity::B, Quantity::InitialVelocity, Quantity::FinalVelocity],
    columns: &COLUMNS,
    rows_per_part: 1 << 16,
    cost: 1_800,
    needs_optimum: |_, _| false,
    compute,
};

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    let wanted = |indices: [Index; 2]| job.projection.has_any(indices);
    let wanted = Wanted {
        cross: wanted([Index::t_cross, Index::work_at_t_cross]),
        floor: wanted([Index::t_floor, Index::work_at_t_floor]),
        cheapest: wanted([Index::t_cheapest, Index::work_at_t_cheapest]),
        min: wanted([Index::t_min, Index::work_at_t_min]),
        turn: wanted([Index::t_turn, Index::work_at_t_turn]),
        free: wanted([Index::t_free_in, Index::t_free_out]),
    };
    rows::each(job, range, 64, buffer, FIELDS, |_, point| {
        let (status, times, stats) = crossover::solve(&transition(point), job.bounded, job.rtol, wanted);
        (status, Some(times), RunStats { crossovers: 1, ..RunStats::from(stats) })
    })
}
