//! `compliant`: the smooth shortcut on a spring of finite stiffness, and its errors under open-loop control.

use std::ops::Range;

use super::column::fields;
use super::memo::Memo;
use super::optimum_cache::{self, Comparison, transition};
use super::{ColumnBuffer, Job, Projection, RunStats, Stopped, Table, number, rows};
use crate::grid::Quantity::{A, B, FinalVelocity, InitialVelocity, Mass, Sampling, Stiffness, Time};
use crate::grid::{Point, Quantity};
use crate::protocol::compliant::{self, Compliant as Member};
use crate::protocol::optimal::Bounds;
use crate::protocol::{Solved, SpringBlock, error};
use crate::stability::{OpenLoopResult, amplification, held_error, open_loop_error};

/// A row.
struct Row {
    member: Member,
    slider: SpringBlock,
    t_f: f64,
    least: Comparison,
    amplification: Option<f64>,
    sampling_error: Option<f64>,
    open_loop_error: Option<f64>,
    work_error: f64,
}

fields! { Row:
    alpha "1" "coefficient of x^3 (1 - x)^3 in ln(v - 1), x = t/t_f" => |row| row.member.alpha;
    work "mu_0 sigma l" "work of friction W_s" => |row| row.member.work;
    work_optimal "mu_0 sigma l" "least work of friction W* of any protocol" => |row| row.least.work;
    gap "1" "(W_s - W*)/W*; error up to rtol (1 + gap)" => |row| row.least.gap;
    v_min "v_0" "least velocity of the block" => |row| row.member.v_min;
    v_max "v_0" "greatest velocity of the block" => |row| row.member.v_max;
    v_c_min "v_0" "least control velocity; errors of both extremes are relative to the greater one" => |row| row.member.control_min;
    v_c_max "v_0" "greatest control velocity" => |row| row.member.control_max;
    amplification "1"
        "greatest factor by which a small error grows from start to end, in the norm of (ln v, ln theta, k s/a); 0 below 1e-12; \
         null where two runs differ by more than rtol, beyond 3000 steps of a run and beyond the range of doubles"
        => |row| number(row.amplification);
    sampling_error "1"
        "distance from the final steady state in that norm if v_c is sampled every dt and held; error up to rtol (1 + sampling_error); \
         null for dt = 0, beyond 100000 samples, if the simulation does not reach t_f, and where two simulations differ by more"
        => |row| number(row.sampling_error);
    stiffness_ratio "1" "k t_f^2/m: the spring is nearly rigid if this is large; inf for m = 0"
        => |row| if row.slider.m > 0.0 { row.slider.k * row.t_f * row.t_f / row.slider.m } else { f64::INFINITY };
    open_loop_error "1"
        "distance of the simulated end from the final steady state in that norm, with continuous v_c: rounding and integration errors, amplified; \
         null if the simulation does not reach t_f", optional
        => |row| number(row.open_loop_error);
    work_error "mu_0 sigma l" "error bound of work, by a second solve", optional => |row| row.work_error;
    gap_error "1" "error bound of gap, by a second solve of both works", optional => |row| row.least.gap_error;
}

/// One row for each transition, duration, stiffness, mass and sampling interval.
pub static COMPLIANT: Table = Table {
    name: "compliant",
    doc: "the smooth shortcut at finite stiffness",
    axes: &[Time, A, B, InitialVelocity, FinalVelocity, Stiffness, Mass, Sampling],
    columns: &COLUMNS,
    rows_per_part: 1 << 12,
    cost: 700_000,
    needs_optimum: |projection, _| needs_optimum(projection),
    compute,
};

fn needs_optimum(projection: &Projection) -> bool {
    projection.has_any([Index::work_optimal, Index::gap, Index::gap_error])
}

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    // The members by tuple, stiffness and mass, each solved once for all sampling intervals.
    let members = Memo::<(u64, u64, u64), Solution>::default();
    rows::each(job, range, 4, buffer, FIELDS, |tuple, point| {
        let mut work = RunStats::default();
        let (slider, t_f, dt) = (slider(point), point[Quantity::Time], point[Quantity::Sampling]);
        let key = (tuple, slider.k.to_bits(), slider.m.to_bits());
        let Solution { solved, amplification, work_error } = members.get(key, || solve(job, point, &mut work));
        let Some(member) = solved.value else { return (solved.status, None, work) };
        let wanted = [needs_optimum(job.projection), job.projection.has(Index::gap_error)];
        let (free, works) = (Bounds::new(job.bounded), (member.work, work_error));
        let least = optimum_cache::compare(job, (tuple, point), &free, works, wanted, &mut work);
        let status = solved.status.compared_with(least.optimum);
        let is_held = job.projection.has(Index::sampling_error) && dt > 0.0;
        let is_followed = job.projection.has(Index::open_loop_error);
        let held = is_held.then(|| held_error(&slider, velocities(point), t_f, dt, job.rtol));
        let sampling_error = held.and_then(|held| value_of(held, &mut work));
        let path = is_followed.then(|| compliant::path(&slider, velocities(point), t_f, job.rtol).ok()).flatten();
        let open_loop_error = path.and_then(|path| value_of(open_loop_error(&path, job.rtol), &mut work));
        (
            status,
            Some(Row { member, slider, t_f, least, amplification, sampling_error, open_loop_error, work_error }),
            work,
        )
    })
}

/// The number that a simulation gives; its statistics are added.
fn value_of(followed: OpenLoopResult, work: &mut RunStats) -> Option<f64> {
    *work +=
        RunStats { simulations: u64::from(followed.steps > 0), steps: followed.steps.into(), ..RunStats::default() };
    followed.number
}

/// The member of the family.
#[derive(Clone, Copy)]
struct Solution {
    solved: Solved<Member>,
    amplification: Option<f64>,
    /// Error bound of its work, if requested.
    work_error: f64,
}

/// The member for `point`; adds the statistics of the solve.
fn solve(job: &Job<'_>, point: &Point, work: &mut RunStats) -> Solution {
    let (slider, velocities, t_f) = (slider(point), velocities(point), point[Quantity::Time]);
    let solved = compliant::solve(&slider, velocities, t_f, job.rtol);
    *work += RunStats { shortcuts: 1, ..RunStats::from(solved.stats) };
    let wanted = job.projection.has(Index::amplification) && solved.value.is_some();
    let amplification = wanted.then(|| amplification(&slider, velocities, t_f, job.rtol));
    let amplification = amplification.and_then(|followed| value_of(followed, work));
    let wanted = job.projection.has_any([Index::work_error, Index::gap_error]);
    let work_error = solved.value.filter(|_| wanted).and_then(|member| {
        let finest = compliant::solve(&slider, velocities, t_f, error::TIGHTEST_RTOL);
        *work += RunStats::from(finest.stats);
        Some(error::bound(member.work, finest.value?.work, member.work))
    });
    Solution { solved, amplification, work_error: number(work_error) }
}

/// Block and spring of a point that holds at least `a`, `b`, `v_i`, `v_f`, `k` and `m`.
pub fn slider(point: &Point) -> SpringBlock {
    SpringBlock { law: transition(point).law, k: point[Quantity::Stiffness], m: point[Quantity::Mass] }
}

/// Velocities of a point, `(v_i, v_f)`.
pub fn velocities(point: &Point) -> (f64, f64) {
    (point[Quantity::InitialVelocity], point[Quantity::FinalVelocity])
}
