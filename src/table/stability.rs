//! `stability`: linear stability of steady sliding on a spring.

use std::ops::Range;

use super::optima::transition;
use super::{Column, Job, Kind, Selection, Sheet, Stopped, Table, Work, rows};
use crate::grid::Quantity;
use crate::model::Transition;
use crate::protocol::Status;
use crate::stability::{Hopf, SteadySliding, critical_velocity};

/// One row a transition, stiffness and mass.
pub struct Stability;

const COLUMNS: &[Column] = &[
    Column::number(
        "k_qs",
        "mu_0 sigma/l",
        "quasi-static critical stiffness b - a; not positive: stable at any stiffness",
    ),
    Column::number("k_c_i", "mu_0 sigma/l", "critical stiffness at v_i, (b - a)(1 + m v_i^2/a)"),
    Column::number("k_c_f", "mu_0 sigma/l", "critical stiffness at v_f, (b - a)(1 + m v_f^2/a)"),
    Column::new("stable_i", Kind::Flag, "whether steady sliding at v_i is stable, k > k_c_i, as in exact arithmetic"),
    Column::new("stable_f", Kind::Flag, "whether steady sliding at v_f is stable, k > k_c_f, as in exact arithmetic"),
    Column::number("v_crit", "v_0", "velocity beyond which steady sliding is unstable; null where there is none"),
    Column::number(
        "growth_rate",
        "v_0/l",
        "real part of the leading pair of eigenvalues at v_f; null for a rigid spring",
    ),
    Column::number("frequency", "v_0/l", "imaginary part of that pair (angular frequency), 0 if all three are real"),
    Column::number("decay_rate", "v_0/l", "the third eigenvalue at v_f, real; null for m = 0, which has two"),
    Column::new(
        "hopf",
        Kind::Label(&Hopf::NAMES),
        "side of k_c_f on which small limit cycles at v_f live: supercritical below it, subcritical above; null for m = 0, b <= a",
    )
    .optional(),
];

/// The first of the columns of eigenvalues, and the one after them.
const GROWTH: usize = 6;
const HOPF: usize = 9;

impl Table for Stability {
    fn name(&self) -> &'static str {
        "stability"
    }

    fn doc(&self) -> &'static str {
        "linear stability of steady sliding at both velocities"
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
        1 << 17
    }

    fn cost(&self) -> u64 {
        150
    }

    fn needs_optimum(&self, _selection: &Selection) -> bool {
        false
    }

    fn compute(&self, job: &Job<'_>, range: Range<u64>, sheet: &mut Sheet) -> Result<Work, Stopped> {
        let with_eigenvalues = job.selection.has_any(GROWTH..HOPF);
        rows::each(job, range, (COLUMNS.len(), 1024), sheet, |_, point, cells| {
            let Transition { law, v_i, v_f } = transition(point);
            let (k, m) = (point[Quantity::Stiffness], point[Quantity::Mass]);
            let at_start = SteadySliding::new(law, k, m, v_i);
            let at_end = SteadySliding::new(law, k, m, v_f);
            cells[..GROWTH].copy_from_slice(&[
                law.b - law.a,
                at_start.critical_stiffness(),
                at_end.critical_stiffness(),
                f64::from(u8::from(at_start.is_stable())),
                f64::from(u8::from(at_end.is_stable())),
                critical_velocity(law, k, m).unwrap_or(f64::NAN),
            ]);
            if let Some(eigenvalues) = with_eigenvalues.then(|| at_end.eigenvalues()).flatten() {
                cells[GROWTH..HOPF].copy_from_slice(&[
                    eigenvalues.growth_rate,
                    eigenvalues.frequency,
                    eigenvalues.decay_rate.unwrap_or(f64::NAN),
                ]);
            }
            cells[HOPF] = Hopf::of(law, m, v_f).map_or(f64::NAN, |kind| f64::from(kind as u8));
            (Status::Ok, Work::default())
        })
    }
}
