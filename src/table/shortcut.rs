//! `shortcut`: the members of the shortcut families that solve a transition.

use std::ops::Range;

use super::column::fields;
use super::memo::Memo;
use super::optimum_cache::{self, Comparison, transition};
use super::{ColumnBuffer, Job, Kind, Projection, RunStats, Stopped, Table, number, rows};
use crate::grid::Quantity::{A, B, FinalVelocity, FrictionCeiling, InitialVelocity, Time};
use crate::grid::{Block, Point, Quantity};
use crate::protocol::optimal::Bounds;
use crate::protocol::shortcut::{Case, FAMILIES, Family, Obstacle, Shortcut as Member};
use crate::protocol::{SolverStats, error};

/// A row: the member of the family, or the reason why it is infeasible.
struct Row {
    member: Option<Member>,
    obstacle: Option<Obstacle>,
    /// Factor of `alpha` to the unit of its column.
    alpha_unit: f64,
    work_error: f64,
    least: Comparison,
}

impl Row {
    fn of_solution(&self, number: impl Fn(&Member) -> f64) -> f64 {
        self.member.as_ref().map_or(f64::NAN, number)
    }
}

fields! { Row:
    alpha "1; (v_0/l)^2 for bounded_velocity"
        "parameter of the family (alpha_3 in the paper); null for step and cubic, 0 for tau_ceiling = inf"
        => |row| row.of_solution(|member| number(member.alpha)) * row.alpha_unit;
    work "mu_0 sigma l" "work of friction W_s" => |row| row.of_solution(|member| member.work);
    work_optimal "mu_0 sigma l" "least work of friction W* of any protocol; for bounded_friction under its tau_ceiling"
        => |row| row.least.work;
    gap "1" "(W_s - W*)/W*; error up to rtol (1 + gap); may be negative for a step, which does not reach the final state"
        => |row| row.least.gap;
    v_min "v_0" "least velocity between the ends; 0 if it underflows" => |row| row.of_solution(|member| member.v_min);
    v_max "v_0" "greatest velocity between the ends" => |row| row.of_solution(|member| member.v_max);
    friction_max "mu_0 sigma" "greatest friction between the ends"
        => |row| row.of_solution(|member| member.friction_max);
    terminal_error "1" "theta(t_f) v_f - 1, the relative distance of a step from its target; 0 for the other families", optional
        => |row| row.of_solution(|member| member.miss);
    bound (Kind::Label(&Obstacle::NAMES)) "the bound that makes the row infeasible", optional
        => |row| number(row.obstacle.map(|obstacle| obstacle.code() as f64));
    work_error "mu_0 sigma l" "error bound of work, by a second solve", optional => |row| row.work_error;
    gap_error "1" "error bound of gap, by a second solve of both works", optional => |row| row.least.gap_error;
}

/// One row for each transition, duration, family and friction ceiling.
pub static SHORTCUT: Table = Table {
    name: "shortcut",
    doc: "the shortcut of a family; only bounded_friction depends on tau_ceiling",
    axes: &[Time, A, B, InitialVelocity, FinalVelocity, Quantity::Family, FrictionCeiling],
    columns: &COLUMNS,
    rows_per_part: 1 << 14,
    cost: 25_000,
    needs_optimum: |projection, block| needs_optimum(projection) && has_uncapped(block),
    compute,
};

fn needs_optimum(projection: &Projection) -> bool {
    projection.has_any([Index::work_optimal, Index::gap, Index::gap_error])
}

/// Whether a row of `block` is compared with the optimum without ceilings.
fn has_uncapped(block: &Block) -> bool {
    let is_uncapped = |number: f64| FAMILIES.get(number as usize).is_some_and(|family| !family.uses_tau_ceiling);
    block.may_be(Quantity::Family, is_uncapped) || block.may_be(Quantity::FrictionCeiling, f64::is_infinite)
}

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    // The members of families without a friction ceiling, each solved once for all ceilings.
    let members = Memo::<(u64, usize), Solution>::default();
    rows::each(job, range, 16, buffer, FIELDS, |tuple, point| {
        let mut work = RunStats::default();
        let mut row =
            Row { member: None, obstacle: None, alpha_unit: 1.0, work_error: f64::NAN, least: Comparison::NONE };
        let number = point[Quantity::Family] as usize;
        let Some(&family) = FAMILIES.get(number) else { return (Obstacle::Domain.status(), Some(row), work) };
        let mut solve = || solve(job, family, point, &mut work);
        let solved = if family.uses_tau_ceiling { solve() } else { members.get((tuple, number), solve) };
        let member = match solved {
            Ok((member, work_error)) => {
                row.work_error = work_error;
                member
            }
            Err(obstacle) => {
                row.obstacle = Some(obstacle);
                return (obstacle.status(), Some(row), work);
            }
        };
        let free = Bounds::new(job.bounded);
        // The members of the family obey its own friction ceiling, or none.
        let is_capped = family.uses_tau_ceiling;
        let bounds = if is_capped { free.with_tau_ceiling(point[Quantity::FrictionCeiling]) } else { free };
        let wanted = [needs_optimum(job.projection), job.projection.has(Index::gap_error)];
        let works = (member.work, row.work_error);
        row.least = optimum_cache::compare(job, (tuple, point), &bounds, works, wanted, &mut work);
        if family.name == "bounded_velocity" {
            row.alpha_unit = job.grid.units.size("v_0/l").powi(2);
        }
        row.member = Some(member);
        (member.status().compared_with(row.least.optimum), Some(row), work)
    })
}

/// A member, and the error bound of its work if requested.
type Solution = Result<(Member, f64), Obstacle>;

fn solve(job: &Job<'_>, family: &Family, point: &Point, work: &mut RunStats) -> Solution {
    let case = Case {
        transition: transition(point),
        t_f: point[Quantity::Time],
        tau_ceiling: point[Quantity::FrictionCeiling],
    };
    let t_min = case.transition.min_duration();
    if job.bounded && case.t_f < t_min {
        return Err(Obstacle::Time { t_min });
    }
    let mut stats = SolverStats::default();
    let solved = family.solve(&case, job.rtol, &mut stats).map(|member| {
        let wanted = job.projection.has_any([Index::work_error, Index::gap_error]);
        let bound = wanted.then(|| error::of_member(family, &case, &member, &mut stats)).flatten();
        (member, bound.unwrap_or(f64::NAN))
    });
    *work += RunStats { shortcuts: 1, ..RunStats::from(stats) };
    solved
}
