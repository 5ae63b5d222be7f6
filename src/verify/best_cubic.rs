//! `best_cubic`: the work at the row's coefficients, integrated over time, and a search for less work around them.

use super::checked_row::NEGATIVE;
use super::gap::{Cubic, compare_v_max};
use super::task::Task;
use super::{Checked, CheckedRow, relaxed};
use crate::model::StateLaw;

/// Fractions of the coefficients by which the search moves. Chosen: from a visible change to one whose effect on the work, of second order, is
/// above rounding.
const FRACTIONS: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];

/// Fractions that reach over the whole set where the work is not convex. Chosen: rings about twice as far from each other.
const FAR_FRACTIONS: [f64; 5] = [0.2, 0.4, 0.8, 1.6, 3.2];

/// Relative rounding error of a square root of a number that rounding alone keeps from 0. Derived: the root of 1e-15, with room.
const HALF_OF_THE_DIGITS: f64 = 1e-7;

pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (task, state) = (Task::of(row)?, row.state_law()?);
    let (Task { problem, t_f, .. }, friction) = (task, row.context.friction);
    if !(row.has_status("ok") || row.has_status(NEGATIVE)) {
        return Err("status is neither ok nor negative_friction");
    }
    let [a_2, a_3] = row.coefficients(t_f).ok_or("a coefficient was not written")?;
    let at = |a_2: f64, a_3: f64| Cubic::new(&problem, t_f, [a_2, a_3]).under(state, friction);
    let (cubic, rtol) = (at(a_2, a_3), row.context.rtol);
    let work = cubic.work().ok_or("the integrator did not get there")?;
    row.compare("work", work);
    // The coefficients are stored in double precision, and the velocity is a small difference of 1 and theta', over theta; where theta rises as
    // fast as its law allows, it depends on the root of this rounding.
    let (v_min, fastest) = (cubic.v_min(), problem.v_i.max(problem.v_f));
    let has_root = state != StateLaw::Ageing && cubic.slack() < HALF_OF_THE_DIGITS;
    let nudge = 1.0 + 2.0 * f64::EPSILON;
    let off = [at(a_2 * nudge, a_3), at(a_2, a_3 * nudge)].map(|near| 4.0 * (near.v_min() - v_min).abs());
    let noise = fastest * if has_root { HALF_OF_THE_DIGITS } else { 4.0 * f64::EPSILON };
    let noise = noise.max(off[0]).max(off[1]);
    row.compare_relative("v_min", v_min, v_min + noise / rtol);
    compare_v_max(row, [a_2, a_3], |[a_2, a_3]| at(a_2, a_3));
    if noise < v_min {
        row.compare_friction(cubic.friction_min());
    } else {
        row.miss("friction at velocities that the rounding of the coefficients hides");
    }
    if state != StateLaw::Ageing {
        if let Some(least) = relaxed::certify(row, &problem, state, t_f).value {
            row.compare_gap(least, Some(work));
        }
    } else if let Some(optimum) = row.certify(&task) {
        row.compare("work_optimal", optimum.work);
        // The relative error is up to 1e-7 for any rtol. The difference of two integrations determines the gap to 1e-12, or to the error of the
        // works.
        let gap = (work - optimum.work) / optimum.work;
        let written = [("work", work), ("work_optimal", optimum.work)];
        let off = written.map(|(column, found)| row.number(column).map_or(0.0, |written| (written - found).abs()));
        let noise = 1e-12 + (off[0] + off[1]) / optimum.work.abs();
        row.compare_relative("gap", gap, (1e-7 * gap.abs()).max(noise) / rtol);
    }
    let least = if row.context.bounded { 1.0 } else { 0.0 };
    let size = a_2.abs() + a_3.abs();
    let mut saved = 0.0_f64;
    let far = if state == StateLaw::Ageing { &[][..] } else { &FAR_FRACTIONS };
    for fraction in FRACTIONS.iter().chain(far) {
        for turn in 0..8 {
            let (sin, cos) = (f64::from(turn) * std::f64::consts::FRAC_PI_4).sin_cos();
            let near = at(a_2 + fraction * size * cos, a_3 + fraction * size * sin);
            if near.slack() > 0.0 && near.v_min() >= least {
                saved = saved.max(near.work().map_or(0.0, |near| (work - near) / work.abs()));
            }
        }
    }
    // Differences below the rounding error of an integration are ignored.
    row.push("beaten", if saved > rtol { saved } else { 0.0 });
    Ok(())
}
