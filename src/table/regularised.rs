//! `regularised`: the optimal protocol with its jumps replaced by smooth pieces.

use std::ops::Range;

use super::column::fields;
use super::compliant::{slider, velocities};
use super::{ColumnBuffer, Job, RunStats, Stopped, Table, rows};
use crate::grid::Quantity;
use crate::grid::Quantity::{A, B, FinalVelocity, InitialVelocity, Mass, Smoothing, Stiffness, Time};
use crate::protocol::regularised::{self, Regularised as Found};
use crate::protocol::{SolverStats, error};

/// A row.
struct Row {
    found: Found,
    work_error: f64,
    gap_error: f64,
}

fields! { Row:
    work "mu_0 sigma l" "work of friction" => |row| row.found.work;
    work_optimal "mu_0 sigma l" "least work of friction W* of any protocol" => |row| row.found.work_optimal;
    gap "1" "(work - W*)/W*; relative error up to rtol" => |row| row.found.gap;
    v_min "v_0" "least velocity of the block; fewer digits far below 1" => |row| row.found.v_min;
    v_max "v_0" "greatest velocity of the block" => |row| row.found.v_max;
    v_c_min "v_0" "least control velocity; errors of both extremes are relative to the greater one" => |row| row.found.control_min;
    v_c_max "v_0" "greatest control velocity" => |row| row.found.control_max;
    work_error "mu_0 sigma l" "error bound of work, by a second solve", optional => |row| row.work_error;
    gap_error "1" "error bound of gap, by a second solve", optional => |row| row.gap_error;
}

/// One row for each transition, duration, stiffness, mass and length of the smooth pieces.
pub static REGULARISED: Table = Table {
    name: "regularised",
    doc: "the optimal protocol with its jumps replaced by smooth pieces",
    axes: &[Time, A, B, InitialVelocity, FinalVelocity, Stiffness, Mass, Smoothing],
    columns: &COLUMNS,
    rows_per_part: 1 << 14,
    cost: 50_000,
    needs_optimum: |_, _| false,
    compute,
};

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    rows::each(job, range, 16, buffer, FIELDS, |_, point| {
        let (t_f, delta_t) = (point[Quantity::Time], point[Quantity::Smoothing]);
        let solve = |rtol| regularised::solve(&slider(point), velocities(point), t_f, delta_t, job.bounded, rtol);
        let solved = solve(job.rtol);
        let mut stats = solved.stats;
        let row = solved.value.map(|found| {
            let finest =
                job.projection.has_any([Index::work_error, Index::gap_error]).then(|| solve(error::TIGHTEST_RTOL));
            stats += finest.map_or_else(SolverStats::default, |finest| finest.stats);
            let finest = finest.and_then(|finest| finest.value);
            let scale = found.replaced / found.work_optimal;
            Row {
                found,
                work_error: finest.map_or(f64::NAN, |finest| error::bound(found.work, finest.work, found.work)),
                gap_error: finest.map_or(f64::NAN, |finest| error::of_excess(found.gap, finest.gap, scale)),
            }
        });
        (solved.status, row, RunStats { optima: 1, ..RunStats::from(stats) })
    })
}
