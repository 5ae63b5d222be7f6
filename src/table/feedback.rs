//! `feedback`: what the optimal protocol does now, from the state variable and the time left.

use std::ops::Range;

use super::column::fields;
use super::optimum_cache::with_ceilings;
use super::{ColumnBuffer, Job, Kind, RunStats, Stopped, Table, rows};
use crate::grid::Quantity;
use crate::grid::Quantity::{A, B, FinalVelocity, FrictionCeiling, Theta, TimeLeft, VelocityCeiling};
use crate::model::Law;
use crate::protocol::optimal::{self, ArcKind, FeedbackPoint};

fields! { FeedbackPoint:
    v "v_0" "velocity of the optimal protocol now" => |point| point.v;
    work_to_go "mu_0 sigma l" "least work of friction in the time left" => |point| point.work_to_go;
    costate "mu_0 sigma v_0" "d work_to_go/d theta; -beta of a trace" => |point| point.costate;
    gain "v_0^2/l" "dv/dtheta at fixed t_left" => |point| point.gain;
    arc (Kind::Label(&ArcKind::NAMES)) "the bound on which the protocol is now, or free if on none"
        => |point| f64::from(point.arc as u8);
}

/// One row for each state and time left, target and pair of ceilings.
pub static FEEDBACK: Table = Table {
    name: "feedback",
    doc: "the optimal velocity now, by the state variable and the time left",
    axes: &[Theta, TimeLeft, A, B, FinalVelocity, VelocityCeiling, FrictionCeiling],
    columns: &COLUMNS,
    rows_per_part: 1 << 16,
    cost: 3_000,
    needs_optimum: |_, _| false,
    compute,
};

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    rows::each(job, range, 64, buffer, FIELDS, |_, point| {
        let law = Law { a: point[Quantity::A], b: point[Quantity::B] };
        let [theta, t_left, v_f] =
            [Quantity::Theta, Quantity::TimeLeft, Quantity::FinalVelocity].map(|axis| point[axis]);
        let solved = optimal::feedback_at(law, theta, t_left, v_f, with_ceilings(job, point), job.rtol);
        (solved.status, solved.value, RunStats { own_optima: 1, ..RunStats::from(solved.stats) })
    })
}
