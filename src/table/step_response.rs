//! `step_response`: the response of a block on a spring to an abrupt step of the control velocity.

use std::ops::Range;

use super::column::fields;
use super::memo::Memo;
use super::optimum_cache::transition;
use super::{ColumnBuffer, Job, Kind, Prediction, RunStats, Stopped, Table, number, rows};
use crate::grid::Quantity::{A, B, FinalVelocity, InitialVelocity, Law, Mass, Stiffness};
use crate::stability::step_response::{self, LimitCycle, Outcome, Response, Simulation};
use crate::stability::{SteadySliding, lyapunov_coefficient};

/// A row.
struct Row {
    response: Option<Response>,
    lyapunov: Option<f64>,
}

impl Row {
    fn of_solution(&self, number: impl Fn(&Response) -> f64) -> f64 {
        self.response.as_ref().map_or(f64::NAN, number)
    }

    fn cycle(&self, number: impl Fn(&LimitCycle) -> f64) -> f64 {
        self.of_solution(|response| response.cycle.as_ref().map_or(f64::NAN, &number))
    }
}

fields! { Row:
    v_peak "v_0" "greatest velocity after v first reaches v_f, at least v_f; null if undecided or not known to rtol"
        => |row| row.of_solution(|response| response.v_peak);
    v_trough "v_0" "least velocity after v first reaches v_f, at most v_f; 0 if it underflows; null if undecided or not known to rtol"
        => |row| row.of_solution(|response| response.v_trough);
    t_peak "l/v_0"
        "time of v_peak; relative error up to rtol divided by the overshoot v_peak/v_f - 1; null if the peak is only approached, if \
         undecided, or if not known to that accuracy"
        => |row| row.of_solution(|response| number(response.t_peak));
    outcome (Kind::Label(&Outcome::NAMES)) "long-term behaviour of the response"
        => |row| f64::from(row.response.as_ref().map_or(Outcome::Diverged, |response| response.outcome) as u8);
    stick_slip (Kind::Flag) "whether the oscillation is sustained; null if undecided"
        => |row| row.of_solution(|response| [0.0, 1.0, f64::NAN, f64::NAN][response.outcome as usize]);
    settling_time "l/v_0" "time after which v stays within 1 % of v_f; null unless settled, or if not known to rtol"
        => |row| row.of_solution(|response| number(response.settling_time));
    period "l/v_0" "duration of the limit cycle; null without one" => |row| row.cycle(|cycle| cycle.period);
    cycle_peak "v_0" "greatest velocity on the limit cycle; null without one", optional
        => |row| row.cycle(|cycle| cycle.v_peak);
    cycle_trough "v_0" "least velocity on the limit cycle; null without one, or if not known to rtol", optional
        => |row| row.cycle(|cycle| cycle.v_trough);
    t_end "l/v_0" "time up to which the response was integrated", optional
        => |row| row.of_solution(|response| response.t_end);
    first_lyapunov_coefficient "1"
        "first Lyapunov coefficient at the critical stiffness for this mass and v_f: negative if the Hopf point is \
         supercritical, positive if it is subcritical; null for b <= a, and for m = 0 except with prz", optional
        => |row| number(row.lyapunov);
}

/// One row for each transition, stiffness and mass.
pub static STEP_RESPONSE: Table = Table {
    name: "step_response",
    doc: "the response to an abrupt step of the control velocity",
    axes: &[A, B, Law, InitialVelocity, FinalVelocity, Stiffness, Mass],
    columns: &COLUMNS,
    rows_per_part: 1 << 12,
    cost: 350_000,
    needs_optimum: |_, _| false,
    compute,
};

/// Relative accuracy by default. Chosen: each further digit of a simulation costs time.
pub const DEFAULT_RTOL: f64 = 1e-6;

/// The prediction of linear stability.
pub const PREDICTION: Prediction = Prediction {
    column: "outcome",
    theory: "linear stability at v_f (settled above k_c)",
    surprises: &[
        (
            Outcome::NAMES[Outcome::LimitCycle as usize],
            "stable against small disturbances, but the step leads to a limit cycle around steady sliding",
        ),
        (
            Outcome::NAMES[Outcome::Diverged as usize],
            "without mass the velocity becomes infinite; with any mass, on the axis m, it does not",
        ),
    ],
    axes: &[A, B, FinalVelocity, Stiffness, Mass],
    word: |point| {
        let sliding = SteadySliding::new(transition(point).law, point[Stiffness], point[Mass], point[FinalVelocity]);
        Outcome::NAMES[if sliding.is_stable() { Outcome::Settled } else { Outcome::LimitCycle } as usize]
    },
};

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    let simulations = Memo::<[u64; 6], Simulation>::default();
    rows::each(job, range, 4, buffer, FIELDS, |_, point| {
        let (state_law, transition) = (point.state_law(), transition(point));
        let step = step_response::VelocityStep { state_law, transition, k: point[Stiffness], m: point[Mass] };
        let mut work = RunStats::default();
        // Steps with equal scaled numbers share one simulation.
        let simulation = step.scaled().map(|scaled| {
            simulations.get(scaled.key(), || {
                let simulation = scaled.follow(job.rtol);
                work = RunStats { simulations: 1, steps: simulation.steps.into(), ..RunStats::default() };
                simulation
            })
        });
        let (status, response) = step.from_simulation(simulation.as_ref(), job.rtol);
        let lyapunov = lyapunov_coefficient(step.state_law, step.transition.law, step.inertia());
        (status, Some(Row { response, lyapunov }), work)
    })
}
