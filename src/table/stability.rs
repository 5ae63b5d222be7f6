//! `stability`: linear stability of steady sliding on a spring.

use std::ops::Range;

use super::column::fields;
use super::optimum_cache::transition;
use super::{ColumnBuffer, Job, Kind, RunStats, Stopped, Table, number, rows};
use crate::grid::Quantity;
use crate::grid::Quantity::{A, B, FinalVelocity, InitialVelocity, Mass, Stiffness};
use crate::model::{Friction, Law, StateLaw, Transition};
use crate::protocol::Status;
use crate::protocol::smoothness::{smooth_eps, smooth_slip_fraction};
use crate::stability::{
    Eigenvalues, Hopf, SteadySliding, arcsinh, critical_velocity, interpolated_lyapunov_coefficient,
    lyapunov_coefficient,
};

/// A row.
struct Row {
    state: StateLaw,
    /// The interpolated law, NaN without.
    law_eps: f64,
    friction: Friction,
    transition: Transition,
    /// The law whose logarithmic friction has the same derivatives at v_f.
    law_f: Law,
    k: f64,
    m: f64,
    at_start: SteadySliding,
    at_end: SteadySliding,
    eigenvalues: Option<Eigenvalues>,
}

impl Row {
    fn v_crit(&self) -> Option<f64> {
        match self.friction {
            Friction::Log => critical_velocity(self.transition.law, self.k, self.m),
            Friction::Regularised => arcsinh::critical_velocity(self.transition.law, self.k, self.m),
        }
    }

    fn lyapunov_coefficient(&self) -> Option<f64> {
        let Transition { law, v_f, .. } = self.transition;
        let inertia = self.m * v_f * v_f;
        if self.law_eps.is_nan() {
            return lyapunov_coefficient(self.state, law, inertia);
        }
        interpolated_lyapunov_coefficient(self.law_eps, law, inertia)
    }
}

fields! { Row:
    k_od "mu_0 sigma/l" "overdamped critical stiffness b - a; if not positive, steady sliding is stable at any stiffness"
        => |row| row.law_f.b - row.law_f.a;
    k_c_i "mu_0 sigma/l" "critical stiffness at v_i, (b - a)(1 + m v_i^2/a)" => |row| row.at_start.critical_stiffness();
    k_c_f "mu_0 sigma/l" "critical stiffness at v_f, (b - a)(1 + m v_f^2/a)" => |row| row.at_end.critical_stiffness();
    stable_i (Kind::Flag) "whether steady sliding at v_i is stable, k > k_c_i; decided exactly"
        => |row| f64::from(u8::from(row.at_start.is_stable()));
    stable_f (Kind::Flag) "whether steady sliding at v_f is stable, k > k_c_f; decided exactly"
        => |row| f64::from(u8::from(row.at_end.is_stable()));
    v_crit "v_0" "velocity above which steady sliding is unstable; null if there is none"
        => |row| number(row.v_crit());
    growth_rate "v_0/l" "real part of the leading pair of eigenvalues at v_f; null for a rigid spring"
        => |row| row.eigenvalues.map_or(f64::NAN, |eigenvalues| eigenvalues.growth_rate);
    frequency "v_0/l" "imaginary part of that pair (angular frequency); 0 if all three are real"
        => |row| row.eigenvalues.map_or(f64::NAN, |eigenvalues| eigenvalues.frequency);
    decay_rate "v_0/l" "the third eigenvalue at v_f, real; null for m = 0, which has two"
        => |row| number(row.eigenvalues.and_then(|eigenvalues| eigenvalues.decay_rate));
    hopf_type (Kind::Label(&Hopf::NAMES))
        "supercritical: small limit cycles exist below k_c_f; subcritical: above it; null for b <= a, and for m = 0 except with prz", optional
        => |row| number(row.lyapunov_coefficient().map(|found| f64::from(Hopf::from_coefficient(found) as u8)));
    first_lyapunov_coefficient "1"
        "first Lyapunov coefficient at the critical stiffness for this mass and v_f: negative if the Hopf point is \
         supercritical, positive if it is subcritical; null where hopf_type is", optional
        => |row| number(row.lyapunov_coefficient());
    slip_fraction_smooth "1"
        "greatest fraction of the slip law, in a mixture with the ageing law, with smooth optima at the states of v_i and v_f: \
         a/(a + T) with the greater steady friction T; null for T <= 0", optional
        => |row| number(smooth_slip_fraction(&row.transition));
    law_eps_smooth "1"
        "least law_eps with smooth optima at all v >= 1 and all states from that of the greater velocity to 1; null where \
         friction at v = 1 is there below 0 or b - a", optional
        => |row| number(smooth_eps(&row.transition));
}

/// One row for each transition, stiffness and mass.
pub static STABILITY: Table = Table {
    name: "stability",
    doc: "linear stability of steady sliding at both velocities",
    axes: &[A, B, Quantity::Law, Quantity::LawEps, InitialVelocity, FinalVelocity, Stiffness, Mass],
    columns: &COLUMNS,
    rows_per_part: 1 << 17,
    cost: 150,
    needs_optimum: |_, _| false,
    compute,
};

fn compute(job: &Job<'_>, range: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    let with_eigenvalues = job.projection.has_any([Index::growth_rate, Index::frequency, Index::decay_rate]);
    rows::each(job, range, 1024, buffer, FIELDS, |_, point| {
        let transition = transition(point);
        let Transition { law, v_i, v_f } = transition;
        let (k, m) = (point[Quantity::Stiffness], point[Quantity::Mass]);
        let friction = job.friction;
        let at = |v: f64| match friction {
            Friction::Log => law,
            Friction::Regularised => arcsinh::linearised(law, v),
        };
        let [at_start, at_end] = [v_i, v_f].map(|v| SteadySliding::new(at(v), k, m, v));
        let eigenvalues = with_eigenvalues.then(|| at_end.eigenvalues()).flatten();
        let (state, law_eps, law_f) = (point.state_law(), point[Quantity::LawEps], at(v_f));
        let row = Row { state, law_eps, friction, transition, law_f, k, m, at_start, at_end, eigenvalues };
        (Status::Ok, Some(row), RunStats::default())
    })
}
