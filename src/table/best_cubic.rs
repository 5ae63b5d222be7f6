//! `best_cubic`: the cubic shortcut of least work.

use std::ops::Range;

use super::column::fields;
use super::optimum_cache::{LAW_AXES, OPTIMUM_AXES, transition};
use super::{ColumnBuffer, Job, Kind, RunStats, Stopped, Table, rows};
use crate::grid::{Point, Quantity, Scale};
use crate::protocol::optimal::Bounds;
use crate::protocol::{SolverStats, best_cubic, error};

/// A row.
struct Row {
    best: best_cubic::BestCubic,
    /// Coefficients in the units of their columns.
    alpha_2: f64,
    alpha_3: f64,
    work_error: f64,
}

fields! { Row:
    alpha_2 (Kind::Quantity(Quantity::Alpha2)) "coefficient of t in theta; in the unit of alpha_2 in the spec, 1/t_f by default"
        => |row| row.alpha_2;
    alpha_3 (Kind::Quantity(Quantity::Alpha3)) "coefficient of t^2 in theta; in the unit of alpha_3 in the spec, 1/t_f^2 by default"
        => |row| row.alpha_3;
    work "mu_0 sigma l" "work of friction W_s of the best shortcut" => |row| row.best.work;
    work_optimal "mu_0 sigma l" "least work of friction W* of any protocol, under v_ceiling if there is one; if none exists, the row is infeasible" => |row| row.best.work_optimal;
    gap "1" "(W_s - W*)/W*, computed without cancellation; relative error up to 1e-7, or absolute error up to 1e-20; error up to 1e-11 (1 + gap) with a law other than ageing, or under a ceiling" => |row| row.best.gap;
    v_min "v_0" "least velocity of the best shortcut" => |row| row.best.v_min;
    work_error "mu_0 sigma l" "error bound of work, by a second search", optional => |row| row.work_error;
    v_max "v_0" "greatest velocity of the best shortcut, which v_ceiling does not bound", optional => |row| row.best.v_max;
}

/// One row for each transition and duration, under the laws of a grid with the axis `law`.
pub static BEST_CUBIC: Table = Table { axes: LAW_AXES, ..BEST_CUBIC_OF_AGEING };

/// One row for each transition and duration, with ageing and without ceilings.
pub const BEST_CUBIC_OF_AGEING: Table = Table {
    name: "best_cubic",
    doc: "the cubic shortcut of least work, over the whole (alpha_2, alpha_3) plane",
    axes: OPTIMUM_AXES,
    columns: &COLUMNS,
    rows_per_part: 1 << 10,
    cost: 1_500_000,
    needs_optimum: |_, _| false,
    compute,
};

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    // Without these axes the law is ageing, and the ceiling NaN or infinite, which is none.
    let solve = |point: &Point, rtol| {
        let bounds = Bounds::new(job.bounded).with_v_ceiling(point[Quantity::VelocityCeiling]);
        best_cubic::solve_under(point.state_law(), &transition(point), point[Quantity::Time], bounds, rtol)
    };
    let natural = |quantity| job.grid.scale(quantity) == Some(Scale::Model);
    let (natural_2, natural_3) = (natural(Quantity::Alpha2), natural(Quantity::Alpha3));
    rows::each(job, range, 1, buffer, FIELDS, |_, point| {
        let t_f = point[Quantity::Time];
        let solved = solve(point, job.rtol);
        let mut stats = solved.stats;
        let row = solved.value.map(|best| {
            let finest = job.projection.has(Index::work_error).then(|| solve(point, error::TIGHTEST_RTOL));
            stats += finest.map_or_else(SolverStats::default, |finest| finest.stats);
            let finest = finest.and_then(|finest| finest.value);
            Row {
                best,
                alpha_2: if natural_2 { best.a_2 / t_f } else { best.a_2 },
                alpha_3: if natural_3 { best.a_3 / (t_f * t_f) } else { best.a_3 },
                work_error: finest.map_or(f64::NAN, |finest| error::bound(best.work, finest.work, best.work)),
            }
        });
        (solved.status, row, RunStats { best: 1, ..RunStats::from(stats) })
    })
}
