//! `stability`: linear stability of steady sliding on a spring.

use std::ops::Range;

use super::column::fields;
use super::optimum_cache::transition;
use super::{ColumnBuffer, Definition, Job, Kind, RunStats, Stopped, number, place, rows};
use crate::grid::Quantity;
use crate::model::{Law, Transition};
use crate::protocol::Status;
use crate::stability::{Eigenvalues, Hopf, SteadySliding, critical_velocity};

/// A row.
struct Row {
    law: Law,
    v_f: f64,
    k: f64,
    m: f64,
    at_start: SteadySliding,
    at_end: SteadySliding,
    eigenvalues: Option<Eigenvalues>,
}

fields! { Row:
    k_od "mu_0 sigma/l" "overdamped critical stiffness b - a; if not positive, steady sliding is stable at any stiffness"
        => |row| row.law.b - row.law.a;
    k_c_i "mu_0 sigma/l" "critical stiffness at v_i, (b - a)(1 + m v_i^2/a)" => |row| row.at_start.critical_stiffness();
    k_c_f "mu_0 sigma/l" "critical stiffness at v_f, (b - a)(1 + m v_f^2/a)" => |row| row.at_end.critical_stiffness();
    stable_i (Kind::Flag) "whether steady sliding at v_i is stable, k > k_c_i; decided exactly"
        => |row| f64::from(u8::from(row.at_start.is_stable()));
    stable_f (Kind::Flag) "whether steady sliding at v_f is stable, k > k_c_f; decided exactly"
        => |row| f64::from(u8::from(row.at_end.is_stable()));
    v_crit "v_0" "velocity above which steady sliding is unstable; null if there is none"
        => |row| number(critical_velocity(row.law, row.k, row.m));
    growth_rate "v_0/l" "real part of the leading pair of eigenvalues at v_f; null for a rigid spring"
        => |row| row.eigenvalues.map_or(f64::NAN, |eigenvalues| eigenvalues.growth_rate);
    frequency "v_0/l" "imaginary part of that pair (angular frequency); 0 if all three are real"
        => |row| row.eigenvalues.map_or(f64::NAN, |eigenvalues| eigenvalues.frequency);
    decay_rate "v_0/l" "the third eigenvalue at v_f, real; null for m = 0, which has two"
        => |row| number(row.eigenvalues.and_then(|eigenvalues| eigenvalues.decay_rate));
    hopf_type (Kind::Label(&Hopf::NAMES))
        "supercritical: small limit cycles exist below k_c_f; subcritical: above it; null for m = 0 or b <= a", optional
        => |row| number(Hopf::of(row.law, row.m, row.v_f).map(|kind| f64::from(kind as u8)));
}

const GROWTH_RATE: usize = place(&COLUMNS, "growth_rate");
const FREQUENCY: usize = place(&COLUMNS, "frequency");
const DECAY_RATE: usize = place(&COLUMNS, "decay_rate");

/// One row for each transition, stiffness and mass.
pub static STABILITY: Definition = Definition {
    name: "stability",
    doc: "linear stability of steady sliding at both velocities",
    axes: &[
        Quantity::A,
        Quantity::B,
        Quantity::InitialVelocity,
        Quantity::FinalVelocity,
        Quantity::Stiffness,
        Quantity::Mass,
    ],
    columns: &COLUMNS,
    rows_per_part: 1 << 17,
    cost: 150,
    needs_optimum: |_| false,
    compute,
};

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    let with_eigenvalues = job.projection.has_any([GROWTH_RATE, FREQUENCY, DECAY_RATE]);
    rows::each(job, range, 1024, buffer, FIELDS, |_, point| {
        let Transition { law, v_i, v_f } = transition(point);
        let (k, m) = (point[Quantity::Stiffness], point[Quantity::Mass]);
        let [at_start, at_end] = [v_i, v_f].map(|v| SteadySliding::new(law, k, m, v));
        let eigenvalues = with_eigenvalues.then(|| at_end.eigenvalues()).flatten();
        (Status::Ok, Some(Row { law, v_f, k, m, at_start, at_end, eigenvalues }), RunStats::default())
    })
}
