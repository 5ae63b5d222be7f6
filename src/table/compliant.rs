//! `compliant`: the smooth shortcut at finite stiffness, and what becomes of it open loop.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::optima::{self, Comparison, transition};
use super::{Column, Job, Selection, Sheet, Stopped, Table, Work, rows};
use crate::grid::{Point, Quantity};
use crate::protocol::compliant::{self, Compliant as Member};
use crate::protocol::{Slider, Solved, error};
use crate::stability::{Followed, amplification, held_error, loop_error};

/// One row a transition, time, stiffness, mass and time between samples.
pub struct Compliant;

const WORK_OPTIMAL: usize = 2;
const GAP: usize = 3;
const AMPLIFICATION: usize = 8;
const END_ERROR: usize = 9;
const RIGID: usize = 10;
const LOOP_ERROR: usize = 11;
const WORK_ERROR: usize = 12;
const GAP_ERROR: usize = 13;

const COLUMNS: &[Column] = &[
    Column::number("alpha", "1", "coefficient of x^3 (1 - x)^3 in ln(v - 1), x = t/t_f"),
    Column::number("work", "mu_0 sigma l", "work of friction W_s"),
    Column::number("work_optimal", "mu_0 sigma l", "least work of friction W* of any protocol"),
    Column::number("gap", "1", "(W_s - W*)/W*, good to rtol of 1 + gap"),
    Column::number("v_min", "v_0", "least velocity of the block"),
    Column::number("v_max", "v_0", "greatest velocity of the block"),
    Column::number("v_c_min", "v_0", "least control velocity; both good to rtol of the greater of the two"),
    Column::number("v_c_max", "v_0", "greatest control velocity"),
    Column::number(
        "amplification",
        "1",
        "greatest factor by which a small error grows from start to end, in the norm of (ln v, ln theta, k s/a); 0 \
         below 1e-30, where only rounding is left of the error; null beyond 3000 steps of its integration and beyond the range of doubles",
    ),
    Column::number(
        "end_error",
        "1",
        "distance from the target in that norm if v_c is sampled every dt and held, to rtol of 1; null for dt = 0, \
         beyond 100000 samples, and where the motion does not last",
    ),
    Column::number("rigid", "1", "k t_f^2/m: a large one makes the spring rigid; inf without mass"),
    Column::number(
        "loop_error",
        "1",
        "distance from the target in that norm if v_c is simulated as it is, at rtol: what that and rounding leave, \
         amplified; null where the motion does not last",
    )
    .optional(),
    Column::number("work_error", "mu_0 sigma l", "bound of the error of work, by a second solve").optional(),
    Column::number("gap_error", "1", "bound of the error of gap, by a second solve of both works").optional(),
];

impl Table for Compliant {
    fn name(&self) -> &'static str {
        "compliant"
    }

    fn doc(&self) -> &'static str {
        "the smooth shortcut at finite stiffness"
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
            Quantity::Sampling,
        ]
    }

    fn columns(&self) -> &'static [Column] {
        COLUMNS
    }

    fn rows_per_part(&self) -> u64 {
        1 << 12
    }

    fn cost(&self) -> u64 {
        700_000
    }

    fn needs_optimum(&self, selection: &Selection) -> bool {
        selection.has_any([WORK_OPTIMAL, GAP, GAP_ERROR])
    }

    fn compute(&self, job: &Job<'_>, range: Range<u64>, sheet: &mut Sheet) -> Result<Work, Stopped> {
        let members = Members::default();
        rows::each(job, range, (COLUMNS.len(), 4), sheet, |tuple, point, cells| {
            let mut work = Work::default();
            let Solution { solved, growth, work_error } = members.get(job, tuple, point, &mut work);
            let Some(member) = solved.value else { return (solved.status, work) };
            let mut status = solved.status;
            let mut least = Comparison::NONE;
            if self.needs_optimum(job.selection) {
                let bounded = job.selection.has(GAP_ERROR);
                least = optima::compare(job, (tuple, point), (member.work, work_error), bounded, &mut work);
                status = status.beside(least.optimum);
            }
            cells[..AMPLIFICATION].copy_from_slice(&[
                member.alpha,
                member.work,
                least.work,
                least.gap,
                member.v_min,
                member.v_max,
                member.control_min,
                member.control_max,
            ]);
            cells[WORK_ERROR] = work_error;
            cells[GAP_ERROR] = least.gap_error;
            let slider = slider(point);
            cells[AMPLIFICATION] = growth.unwrap_or(f64::NAN);
            let t_f = point[Quantity::Time];
            cells[RIGID] = if slider.m > 0.0 { slider.k * t_f * t_f / slider.m } else { f64::INFINITY };
            let dt = point[Quantity::Sampling];
            let (held, told) = (job.selection.has(END_ERROR) && dt > 0.0, job.selection.has(LOOP_ERROR));
            if (held || told)
                && let Ok(path) = compliant::path(&slider, velocities(point), t_f, job.rtol)
            {
                if held {
                    cells[END_ERROR] = told_by(held_error(&path, dt, job.rtol), &mut work);
                }
                if told {
                    cells[LOOP_ERROR] = told_by(loop_error(&path, job.rtol), &mut work);
                }
            }
            (status, work)
        })
    }
}

/// The number of a simulation, whose work is added.
fn told_by(followed: Followed, work: &mut Work) -> f64 {
    *work += Work { simulations: u64::from(followed.steps > 0), steps: followed.steps.into(), ..Work::default() };
    followed.number.unwrap_or(f64::NAN)
}

/// A member.
#[derive(Clone, Copy)]
struct Solution {
    solved: Solved<Member>,
    /// Its amplification.
    growth: Option<f64>,
    /// Bound of the error of its work, where that is asked for.
    work_error: f64,
}

/// The members solved so far, by tuple, stiffness and mass.
type Found = HashMap<(u64, u64, u64), Arc<OnceLock<Solution>>>;

/// The members, solved once each whatever the time between samples.
#[derive(Default)]
struct Members(Mutex<Found>);

impl Members {
    /// The member for `point`, which belongs to tuple number `tuple`; adds what is spent by this call alone.
    fn get(&self, job: &Job<'_>, tuple: u64, point: &Point, work: &mut Work) -> Solution {
        let slider = slider(point);
        let mut members = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let member = members.entry((tuple, slider.k.to_bits(), slider.m.to_bits())).or_default().clone();
        drop(members);
        *member.get_or_init(|| {
            let (velocities, t_f) = (velocities(point), point[Quantity::Time]);
            let solved = compliant::solve(&slider, velocities, t_f, job.rtol);
            *work += Work { swifts: 1, ..Work::from(solved.effort) };
            let wanted = job.selection.has(AMPLIFICATION) && solved.value.is_some();
            let path = wanted.then(|| compliant::path(&slider, velocities, t_f, job.rtol).ok()).flatten();
            let growth = path.map(|path| told_by(amplification(&path, job.rtol), work));
            let work_error =
                solved.value.filter(|_| job.selection.has_any([WORK_ERROR, GAP_ERROR])).and_then(|member| {
                    let finest = compliant::solve(&slider, velocities, t_f, error::FINEST);
                    *work += Work::from(finest.effort);
                    Some(error::bound(member.work, finest.value?.work, member.work))
                });
            Solution { solved, growth, work_error: work_error.unwrap_or(f64::NAN) }
        })
    }
}

/// Block and spring of a point that holds at least `a`, `b`, `v_i`, `v_f`, `k` and `m`.
pub fn slider(point: &Point) -> Slider {
    Slider { law: transition(point).law, k: point[Quantity::Stiffness], m: point[Quantity::Mass] }
}

/// Velocities of a point, `(v_i, v_f)`.
pub fn velocities(point: &Point) -> (f64, f64) {
    (point[Quantity::InitialVelocity], point[Quantity::FinalVelocity])
}
