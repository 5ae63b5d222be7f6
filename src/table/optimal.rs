//! `optimal`: the protocol of least work, under ceilings of velocity and friction if there are any.

use std::ops::Range;

use super::column::fields;
use super::optimum_cache::{self, transition, with_ceilings, work_error};
use super::{ColumnBuffer, Job, Kind, Projection, RunStats, Stopped, Table, number, rows};
use crate::grid::Quantity::{A, B, FinalVelocity, FrictionCeiling, InitialVelocity, Law, Time, VelocityCeiling};
use crate::grid::{Block, Point, Quantity};
use crate::model::{Friction, StateLaw};
use crate::protocol::optimal::{self, Bounds, Obstacle, Optimum, Slopes, Strategy};
use crate::protocol::relaxed::{self, Chatter, Relaxed};
use crate::protocol::{Solved, Status, arcsinh};

/// The words of `strategy`.
pub(super) static STRATEGIES: &[&str] = &Strategy::NAMES;

/// Those of the ageing law, which are the first.
pub(super) static STRATEGIES_OF_AGEING: &[&str] = STRATEGIES.split_at(3).0;

/// The words of `binding`.
const BINDING: &[&str] = &["none", "v_ceiling", "tau_ceiling", "both"];

/// The words of `bound`.
const OBSTACLES: &[&str] = &["domain", "too_fast", "too_slow", "v_ceiling", "tau_ceiling"];

/// A row. An infeasible one has no optimum, but least feasible numbers and the reason.
#[derive(Default)]
struct Row {
    optimum: Option<Optimum>,
    chatter: Option<Chatter>,
    slopes: Option<Slopes>,
    work_error: f64,
    t_least: Option<f64>,
    v_ceiling_least: Option<f64>,
    tau_ceiling_least: Option<f64>,
    obstacle: Option<Obstacle>,
}

impl Row {
    fn of_optimum(&self, cell: impl Fn(&Optimum) -> f64) -> f64 {
        self.optimum.as_ref().map_or(f64::NAN, cell)
    }

    fn of_chatter(&self, cell: impl Fn(&Chatter) -> f64) -> f64 {
        self.chatter.as_ref().map_or(f64::NAN, cell)
    }

    fn slope(&self, cell: impl Fn(&Slopes) -> f64) -> f64 {
        self.slopes.as_ref().map(cell).filter(|slope| slope.is_finite()).unwrap_or(f64::NAN)
    }
}

fields! { Row:
    work "mu_0 sigma l" "least work of friction W*" => |row| row.of_optimum(|found| found.work);
    v_start "v_0" "velocity just after the start, v(0+)" => |row| row.of_optimum(|found| found.v_start);
    v_end "v_0" "velocity just before the end, v(t_f-)" => |row| row.of_optimum(|found| found.v_end);
    time_at_floor "l/v_0" "time spent on the velocity floor v = v_0" => |row| row.of_optimum(|found| found.time_at_floor);
    time_at_v_ceiling "l/v_0" "time spent on the velocity ceiling"
        => |row| row.of_optimum(|found| found.time_at_v_ceiling);
    time_at_tau_ceiling "l/v_0" "time spent on the friction ceiling"
        => |row| row.of_optimum(|found| found.time_at_tau_ceiling);
    hamiltonian "mu_0 sigma v_0" "dW*/dt_f" => |row| row.of_optimum(|found| found.hamiltonian);
    theta_max "l/v_0" "greatest state variable theta on the path" => |row| row.of_optimum(|found| found.theta_max);
    strategy (Kind::Label(STRATEGIES)) "start of the protocol: speed_up v(0+) > v_i, slow_down 1 < v(0+) <= v_i, floor v(0+) = 1; \
        with slip and prz wait_jerk, jerk_wait, chatter or rise, where a jerk is a jump of v to v_ceiling, not da/dt"
        => |row| row.of_optimum(|found| f64::from(found.strategy as u8));
    work_error "mu_0 sigma l" "error bound of work, by a second solve", optional
        => |row| if row.optimum.is_some() { row.work_error } else { f64::NAN };
    friction_max "mu_0 sigma" "greatest friction between the ends", optional
        => |row| row.of_optimum(|found| found.friction_max);
    binding (Kind::Label(BINDING)) "the ceilings on which the protocol spends time", optional
        => |row| row.of_optimum(|found| f64::from(u8::from(found.time_at_v_ceiling > 0.0) + 2 * u8::from(found.time_at_tau_ceiling > 0.0)));
    t_least "l/v_0" "least feasible duration under the floor and the ceilings", optional => |row| number(row.t_least);
    v_ceiling_least "v_0" "least feasible velocity ceiling for t_f and tau_ceiling", optional
        => |row| number(row.v_ceiling_least);
    tau_ceiling_least "mu_0 sigma" "least feasible friction ceiling for t_f and v_ceiling; null with slip and prz", optional
        => |row| number(row.tau_ceiling_least);
    bound (Kind::Label(OBSTACLES))
        "the bound that makes the row infeasible; too_fast: t_f < t_least, too_slow: theta cannot wait so long", optional
        => |row| number(row.obstacle.map(|obstacle| code(obstacle) as f64));
    chatter_time "l/v_0" "time in which v alternates ever faster between both bounds; null unless strategy is chatter", optional
        => |row| row.of_chatter(|chatter| chatter.time);
    chatter_theta "l/v_0" "state variable theta while v alternates", optional => |row| row.of_chatter(|chatter| chatter.theta);
    chatter_duty "1" "fraction of chatter_time on the velocity ceiling", optional
        => |row| row.of_chatter(|chatter| chatter.duty);
    work_bang_bang "mu_0 sigma l" "least work with one switch between both bounds; null unless strategy is chatter", optional
        => |row| row.of_chatter(|chatter| chatter.work_bang_bang);
    dwork_da "sigma l" "derivative of work with respect to a", optional => |row| row.slope(|slopes| slopes.a);
    dwork_db "sigma l" "derivative of work with respect to b", optional => |row| row.slope(|slopes| slopes.b);
    dwork_dv_i "mu_0 sigma l/v_0" "derivative of work with respect to v_i", optional
        => |row| row.slope(|slopes| slopes.v_i);
    dwork_dv_f "mu_0 sigma l/v_0" "derivative of work with respect to v_f", optional
        => |row| row.slope(|slopes| slopes.v_f);
    dwork_dv_ceiling "mu_0 sigma l/v_0" "shadow price of v_ceiling; 0 if it does not bind", optional
        => |row| row.slope(|slopes| slopes.v_ceiling);
    dwork_dtau_ceiling "l" "shadow price of tau_ceiling; 0 if it does not bind", optional
        => |row| row.slope(|slopes| slopes.tau_ceiling);
}

/// One row for each transition, duration and pair of ceilings.
pub static OPTIMAL: Table = Table {
    name: "optimal",
    doc: "the protocol of least work",
    axes: &[Time, A, B, Law, InitialVelocity, FinalVelocity, VelocityCeiling, FrictionCeiling],
    columns: &COLUMNS,
    rows_per_part: 1 << 16,
    cost: 2_500,
    needs_optimum: |projection, block| !wants_slopes(projection) && has_uncapped(block),
    compute,
};

/// The slopes come with an optimum of their own.
fn wants_slopes(projection: &Projection) -> bool {
    projection.has_any(Index::dwork_da as usize..COLUMNS.len())
}

/// Whether a row of `block` has the ageing law and no ceiling.
fn has_uncapped(block: &Block) -> bool {
    let ceilings = [Quantity::VelocityCeiling, Quantity::FrictionCeiling];
    ceilings.into_iter().all(|ceiling| block.may_be(ceiling, f64::is_infinite))
        && block.may_be(Quantity::Law, |law| law == f64::from(StateLaw::Ageing as u8))
}

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    let wants_slopes = wants_slopes(job.projection);
    rows::each(job, range, 64, buffer, FIELDS, |tuple, point| {
        if job.friction == Friction::Regularised {
            return regularised_row(job, (tuple, point), wants_slopes);
        }
        if point.state_law() != StateLaw::Ageing {
            return relaxed_row(point, wants_slopes, job.projection.has(Index::v_ceiling_least));
        }
        let mut work = RunStats::default();
        let bounds = with_ceilings(job, point);
        let (solved, slopes) = if wants_slopes {
            let (solved, slopes) = optimal::slopes(&transition(point), point[Quantity::Time], bounds, job.rtol);
            work += RunStats { own_optima: 1, ..RunStats::from(solved.stats) };
            (solved, slopes)
        } else {
            (optimum_cache::optimum(job, (tuple, point), &bounds, &mut work), None)
        };
        let mut row = Row { optimum: solved.value, slopes, ..least(job, point, &bounds, &solved) };
        if let Some(optimum) = row.optimum.filter(|_| job.projection.has(Index::work_error)) {
            row.work_error = work_error(point, &bounds, &optimum, &mut work);
        }
        (solved.status, Some(row), work)
    })
}

/// A row with regularised friction, which knows no ceilings.
fn regularised_row(job: &Job<'_>, (tuple, point): (u64, &Point), wants_slopes: bool) -> rows::ComputedRow<Row> {
    let (transition, t_f) = (transition(point), point[Quantity::Time]);
    let mut work = RunStats::default();
    let (solved, slopes) = if wants_slopes {
        let solved = arcsinh::solve(&transition, t_f);
        work += RunStats { own_optima: 1, ..RunStats::from(solved.stats) };
        (solved.map(|found| found.optimum), solved.value.map(|found| found.slopes))
    } else {
        (optimum_cache::cached_optimum(job, (tuple, point), &mut work), None)
    };
    let t_least = arcsinh::least_time(&transition);
    let is_infeasible = solved.status == Status::Infeasible;
    let row = Row {
        optimum: solved.value,
        slopes,
        t_least,
        obstacle: t_least.filter(|_| is_infeasible).map(|t_least| Obstacle::TooFast { t_least }),
        ..Row::default()
    };
    (solved.status, Some(row), work)
}

/// A row of another law than ageing.
fn relaxed_row(point: &Point, wants_slopes: bool, wants_ceiling: bool) -> rows::ComputedRow<Row> {
    let (law, transition, t_f) = (point.state_law(), transition(point), point[Quantity::Time]);
    let v_ceiling = point[Quantity::VelocityCeiling];
    let solved = relaxed::solve(law, &transition, t_f, v_ceiling);
    let t_least = relaxed::least_time(law, &transition, v_ceiling);
    let obstacle = match (solved.status, t_least) {
        (Status::Infeasible, Some(t_least)) => Some(Obstacle::TooFast { t_least }),
        (Status::Infeasible, None) => Some(Obstacle::VCeiling { above: transition.v_f }),
        // Not solved: a ceiling below both velocities, or below the start of a rise.
        (Status::Unproven, _) if solved.value.is_none() && transition.v_i > v_ceiling => {
            Some(Obstacle::VCeiling { above: transition.v_i })
        }
        _ => None,
    };
    let slopes = || relaxed::slopes(law, &transition, t_f, v_ceiling);
    let v_ceiling_least = || relaxed::least_v_ceiling(law, &transition, t_f);
    let row = Row {
        optimum: solved.value.map(|found: Relaxed| found.optimum),
        chatter: solved.value.and_then(|found| found.chatter),
        work_error: solved.value.map_or(f64::NAN, |found| relaxed::work_error(&found, &transition, t_f)),
        t_least,
        slopes: wants_slopes.then(slopes).flatten(),
        v_ceiling_least: wants_ceiling.then(v_ceiling_least).flatten(),
        obstacle,
        ..Row::default()
    };
    (solved.status, Some(row), RunStats { own_optima: 1, ..RunStats::from(solved.stats) })
}

/// The least feasible numbers that are requested, and the reason of an infeasible row.
fn least(job: &Job<'_>, point: &Point, bounds: &Bounds, solved: &Solved<Optimum>) -> Row {
    let (transition, t_f, rtol) = (transition(point), point[Quantity::Time], job.rtol);
    let wanted = |column: Index| job.projection.has(column).then_some(());
    let is_infeasible = solved.status == Status::Infeasible;
    Row {
        t_least: wanted(Index::t_least)
            .and_then(|()| optimal::feasible_times(&transition, bounds))
            .map(|(least, _)| least),
        v_ceiling_least: wanted(Index::v_ceiling_least)
            .and_then(|()| optimal::least_v_ceiling(&transition, t_f, bounds, rtol)),
        tau_ceiling_least: wanted(Index::tau_ceiling_least)
            .and_then(|()| optimal::least_tau_ceiling(&transition, t_f, bounds, rtol)),
        obstacle: wanted(Index::bound)
            .filter(|()| is_infeasible)
            .and_then(|()| optimal::obstacle(&transition, t_f, bounds)),
        ..Row::default()
    }
}

/// The place of a reason among [`OBSTACLES`].
fn code(obstacle: Obstacle) -> usize {
    match obstacle {
        Obstacle::Domain => 0,
        Obstacle::TooFast { .. } => 1,
        Obstacle::TooSlow { .. } => 2,
        Obstacle::VCeiling { .. } => 3,
        Obstacle::TauCeiling { .. } => 4,
    }
}
