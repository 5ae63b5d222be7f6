//! `swift`: the members of the shortcut families that solve a transition.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::optima::{self, Comparison, transition};
use super::{Column, Job, Kind, Selection, Sheet, Stopped, Table, Work, rows};
use crate::grid::{Point, Quantity};
use crate::protocol::swift::{Case, FAMILIES, Family, Obstacle, Swift as Member};
use crate::protocol::{Effort, error};

/// One row a transition, time, family and bound on friction.
pub struct Swift;

const WORK_OPTIMAL: usize = 2;
const GAP: usize = 3;
const BOUND: usize = 8;
const WORK_ERROR: usize = 9;
const GAP_ERROR: usize = 10;

const COLUMNS: &[Column] = &[
    Column::number(
        "alpha",
        "1; (v_0/l)^2 for bounded_velocity",
        "the family's parameter alpha_3 of the paper; null for step and cubic, which have none, 0 where tau_max = inf",
    ),
    Column::number("work", "mu_0 sigma l", "work of friction W_s"),
    Column::number("work_optimal", "mu_0 sigma l", "least work of friction W* of any protocol"),
    Column::number("gap", "1", "(W_s - W*)/W*, good to rtol of 1 + gap; below 0 for a step that has not arrived"),
    Column::number("v_min", "v_0", "least velocity between the ends; 0 below the range of doubles"),
    Column::number("v_max", "v_0", "greatest velocity between the ends"),
    Column::number("friction_max", "mu_0 sigma", "greatest friction between the ends"),
    Column::number("end_error", "1", "theta(t_f) v_f - 1: how far from its target a step is; 0 for the other families")
        .optional(),
    Column::new("bound", Kind::Label(&Obstacle::NAMES), "which bound makes the row infeasible").optional(),
    Column::number("work_error", "mu_0 sigma l", "bound of the error of work, by a second solve").optional(),
    Column::number("gap_error", "1", "bound of the error of gap, by a second solve of both works").optional(),
];

impl Table for Swift {
    fn name(&self) -> &'static str {
        "swift"
    }

    fn doc(&self) -> &'static str {
        "the shortcut of a family"
    }

    fn axes(&self) -> &'static [Quantity] {
        &[
            Quantity::Time,
            Quantity::A,
            Quantity::B,
            Quantity::InitialVelocity,
            Quantity::FinalVelocity,
            Quantity::Family,
            Quantity::FrictionBound,
        ]
    }

    fn columns(&self) -> &'static [Column] {
        COLUMNS
    }

    fn rows_per_part(&self) -> u64 {
        1 << 14
    }

    fn cost(&self) -> u64 {
        25_000
    }

    fn needs_optimum(&self, selection: &Selection) -> bool {
        selection.has_any([WORK_OPTIMAL, GAP, GAP_ERROR])
    }

    fn compute(&self, job: &Job<'_>, range: Range<u64>, sheet: &mut Sheet) -> Result<Work, Stopped> {
        let members = Members::default();
        rows::each(job, range, (COLUMNS.len(), 16), sheet, |tuple, point, cells| {
            let mut work = Work::default();
            let (swift, work_error) = match members.get(job, tuple, point, &mut work) {
                Ok(found) => found,
                Err(obstacle) => {
                    cells[BOUND] = obstacle.code() as f64;
                    return (obstacle.status(), work);
                }
            };
            let mut status = swift.status();
            let mut least = Comparison::NONE;
            if self.needs_optimum(job.selection) {
                let bounded = job.selection.has(GAP_ERROR);
                least = optima::compare(job, (tuple, point), (swift.work, work_error), bounded, &mut work);
                status = status.beside(least.optimum);
            }
            let family = FAMILIES.get(point[Quantity::Family] as usize);
            let rate = if family.is_some_and(|family| family.name() == "bounded_velocity") {
                job.grid.units.size("v_0/l")
            } else {
                1.0
            };
            cells[..BOUND].copy_from_slice(&[
                swift.alpha.map_or(f64::NAN, |alpha| alpha * rate * rate),
                swift.work,
                least.work,
                least.gap,
                swift.v_min,
                swift.v_max,
                swift.friction_max,
                swift.miss,
            ]);
            cells[WORK_ERROR] = work_error;
            cells[GAP_ERROR] = least.gap_error;
            (status, work)
        })
    }
}

/// A member, and the bound of the error of its work where that is asked for.
type Solution = Result<(Member, f64), Obstacle>;

/// The members solved so far, by tuple and family.
type Solved = HashMap<(u64, usize), Arc<OnceLock<Solution>>>;

/// The members of families that do not heed the bound on friction, solved once each whatever its values.
#[derive(Default)]
struct Members(Mutex<Solved>);

impl Members {
    /// The member for `point`, which belongs to tuple number `tuple`; adds what is spent by this call alone.
    fn get(&self, job: &Job<'_>, tuple: u64, point: &Point, work: &mut Work) -> Solution {
        let number = point[Quantity::Family] as usize;
        let Some(&family) = FAMILIES.get(number) else { return Err(Obstacle::Domain) };
        if family.heeds_tau_max() {
            return solve(job, family, point, work);
        }
        let mut members = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let member = members.entry((tuple, number)).or_default().clone();
        drop(members);
        *member.get_or_init(|| solve(job, family, point, work))
    }
}

fn solve(job: &Job<'_>, family: &dyn Family, point: &Point, work: &mut Work) -> Solution {
    let case =
        Case { transition: transition(point), t_f: point[Quantity::Time], tau_max: point[Quantity::FrictionBound] };
    let t_min = case.transition.least_time();
    if job.bounded && case.t_f < t_min {
        return Err(Obstacle::Time { t_min });
    }
    let mut effort = Effort::default();
    let solved = family.solve(&case, job.rtol, &mut effort).map(|member| {
        let wanted = job.selection.has_any([WORK_ERROR, GAP_ERROR]);
        let bound = wanted.then(|| error::of_member(family, &case, &member, &mut effort)).flatten();
        (member, bound.unwrap_or(f64::NAN))
    });
    *work += Work { swifts: 1, ..Work::from(effort) };
    solved
}
