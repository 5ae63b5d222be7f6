//! `step`: the response of a block on a spring to an abrupt step of the control velocity.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::optima::transition;
use super::{Column, Job, Kind, Prediction, Selection, Sheet, Stopped, Table, Work, rows};
use crate::grid::Quantity;
use crate::model::Law;
use crate::stability::response::{self, Course, Outcome, Scaled};
use crate::stability::{SteadySliding, lyapunov_coefficient};

/// One row a transition, stiffness and mass.
pub struct Step;

const LYAPUNOV: usize = 10;

const COLUMNS: &[Column] = &[
    Column::number(
        "v_peak",
        "v_0",
        "greatest velocity from when v = v_f is first met on, at least v_f; null if undecided",
    ),
    Column::number(
        "v_trough",
        "v_0",
        "least velocity from when v = v_f is first met on, at most v_f; 0 below the range of doubles, null if undecided or \
         not known to rtol",
    ),
    Column::number(
        "t_peak",
        "l/v_0",
        "time of v_peak, good to rtol of itself over the overshoot v_peak/v_f - 1; null where the peak is only approached, \
         if undecided and if not known to that",
    ),
    Column::new("outcome", Kind::Label(&Outcome::NAMES), "what becomes of the response in the end"),
    Column::new("stick_slip", Kind::Flag, "whether the oscillation is sustained; null if undecided"),
    Column::number(
        "settling_time",
        "l/v_0",
        "time after which v stays within 1 % of v_f; null unless the outcome is settled, and if not known to rtol",
    ),
    Column::number("period", "l/v_0", "duration of the limit cycle; null without one"),
    Column::number("cycle_peak", "v_0", "greatest velocity on the limit cycle; null without one").optional(),
    Column::number(
        "cycle_trough",
        "v_0",
        "least velocity on the limit cycle; null without one, and if not known to rtol",
    )
    .optional(),
    Column::number("t_end", "l/v_0", "time up to which the response was integrated").optional(),
    Column::number(
        "lyapunov",
        "1",
        "first Lyapunov coefficient at the critical stiffness for this mass and v_f: negative if the Hopf point is \
         supercritical, positive if a limit cycle may be met above it; null for b <= a and for m = 0",
    )
    .optional(),
];

impl Table for Step {
    fn name(&self) -> &'static str {
        "step"
    }

    fn doc(&self) -> &'static str {
        "the response to an abrupt step of the control velocity"
    }

    fn axes(&self) -> &'static [Quantity] {
        &[
            Quantity::A,
            Quantity::B,
            Quantity::InitialVelocity,
            Quantity::FinalVelocity,
            Quantity::Stiffness,
            Quantity::Mass,
        ]
    }

    fn columns(&self) -> &'static [Column] {
        COLUMNS
    }

    fn rows_per_part(&self) -> u64 {
        1 << 12
    }

    fn cost(&self) -> u64 {
        350_000
    }

    fn needs_optimum(&self, _selection: &Selection) -> bool {
        false
    }

    /// Simulated: each digit more costs time.
    fn default_rtol(&self) -> Option<f64> {
        Some(1e-6)
    }

    fn prediction(&self) -> Option<Prediction> {
        Some(Prediction {
            column: "outcome",
            theory: "linear stability at v_f (settled above k_c)",
            surprise: Outcome::NAMES[Outcome::LimitCycle as usize],
            why: "stable against small disturbances, but the step leads onto a cycle that surrounds steady sliding",
            axes: &[Quantity::A, Quantity::B, Quantity::FinalVelocity, Quantity::Stiffness, Quantity::Mass],
            word: |point| {
                let law = Law { a: point[Quantity::A], b: point[Quantity::B] };
                let (k, m) = (point[Quantity::Stiffness], point[Quantity::Mass]);
                let outcome = if SteadySliding::new(law, k, m, point[Quantity::FinalVelocity]).is_stable() {
                    Outcome::Settled
                } else {
                    Outcome::LimitCycle
                };
                Outcome::NAMES[outcome as usize]
            },
        })
    }

    fn compute(&self, job: &Job<'_>, range: Range<u64>, sheet: &mut Sheet) -> Result<Work, Stopped> {
        let courses = Courses::default();
        rows::each(job, range, (COLUMNS.len(), 4), sheet, |_, point, cells| {
            let step = response::Step {
                transition: transition(point),
                k: point[Quantity::Stiffness],
                m: point[Quantity::Mass],
            };
            let mut work = Work::default();
            let course = step.scaled().map(|scaled| courses.get(&scaled, job.rtol, &mut work));
            let (status, response) = step.from_course(course.as_ref(), job.rtol);
            let law = step.transition.law;
            cells[LYAPUNOV] = lyapunov_coefficient(law, step.inertia()).unwrap_or(f64::NAN);
            if let Some(response) = response {
                let cycle = response.cycle;
                cells[..LYAPUNOV].copy_from_slice(&[
                    response.v_peak,
                    response.v_trough,
                    response.t_peak.unwrap_or(f64::NAN),
                    response.outcome as usize as f64,
                    match response.outcome {
                        Outcome::Settled => 0.0,
                        Outcome::LimitCycle => 1.0,
                        Outcome::Undecided => f64::NAN,
                    },
                    response.settling_time.unwrap_or(f64::NAN),
                    cycle.map_or(f64::NAN, |cycle| cycle.period),
                    cycle.map_or(f64::NAN, |cycle| cycle.v_peak),
                    cycle.map_or(f64::NAN, |cycle| cycle.v_trough),
                    response.t_end,
                ]);
            }
            (status, work)
        })
    }
}

/// The courses of a part so far, followed once each.
#[derive(Default)]
struct Courses(Mutex<HashMap<[u64; 5], Arc<OnceLock<Course>>>>);

impl Courses {
    /// The course; adds what is spent by this call alone.
    fn get(&self, scaled: &Scaled, rtol: f64, work: &mut Work) -> Course {
        let mut courses = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let course = courses.entry(scaled.key()).or_default().clone();
        drop(courses);
        *course.get_or_init(|| {
            let course = scaled.follow(rtol);
            *work += Work { simulations: 1, steps: course.steps.into(), ..Work::default() };
            course
        })
    }
}
