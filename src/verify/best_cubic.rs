//! `best_cubic`: the work at the row's coefficients, integrated over time, and a search for less work around them.

use super::gap::Cubic;
use super::optimal::compare_gap;
use super::task::Task;
use super::verdict::{Checked, NEGATIVE, axis, state_law};
use super::{Context, Verdict, number, relaxed, transition, word};
use crate::dataset::Row;
use crate::model::StateLaw;
use crate::table::STATUS;

/// Fractions of the coefficients by which the search moves. Chosen: from a visible change to one whose effect on the work, of second order, is
/// above rounding.
const FRACTIONS: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];

/// Fractions that reach over the whole set where the work is not convex. Chosen: rings about twice as far from each other.
const FAR_FRACTIONS: [f64; 5] = [0.2, 0.4, 0.8, 1.6, 3.2];

/// Relative rounding error of a square root of a number that rounding alone keeps from 0. Derived: the root of 1e-15, with room.
const HALF_OF_THE_DIGITS: f64 = 1e-7;

pub fn check(row: &Row, context: &Context, rtol: f64) -> Checked {
    let (problem, t_f, state) = (transition(row)?, axis(row, "t_f")?, state_law(row)?);
    if !matches!(word(row, STATUS), Some("ok" | NEGATIVE)) {
        return Err("status is neither ok nor negative_friction");
    }
    let (Some(alpha_2), Some(alpha_3)) = (number(row, "alpha_2"), number(row, "alpha_3")) else {
        return Err("a coefficient was not written");
    };
    let a_2 = if context.relative[0] { alpha_2 } else { alpha_2 * t_f };
    let a_3 = if context.relative[1] { alpha_3 } else { alpha_3 * t_f * t_f };
    let cubic = Cubic::new(&problem, t_f, a_2, a_3).under(state);
    let work = cubic.work().ok_or("the integrator did not get there")?;
    let mut verdict = Verdict::default();
    verdict.compare(row, "work", Some(work), None);
    // The coefficients are stored in double precision, and the velocity is a small difference of 1 and theta', over theta; where theta rises as
    // fast as its law allows, it depends on the root of this rounding.
    let (v_min, fastest) = (cubic.v_min(), problem.v_i.max(problem.v_f));
    let has_root = state != StateLaw::Ageing && cubic.slack() < HALF_OF_THE_DIGITS;
    let nudge = 1.0 + 2.0 * f64::EPSILON;
    let nudged = [(a_2 * nudge, a_3), (a_2, a_3 * nudge)].map(|(a_2, a_3)| Cubic::new(&problem, t_f, a_2, a_3));
    let off = nudged.map(|near| 4.0 * (near.under(state).v_min() - v_min).abs());
    let noise = fastest * if has_root { HALF_OF_THE_DIGITS } else { 4.0 * f64::EPSILON };
    let noise = noise.max(off[0]).max(off[1]);
    verdict.compare(row, "v_min", Some(v_min), Some(v_min + noise / rtol));
    if noise < v_min {
        verdict.friction(row, cubic.friction_min());
    } else {
        verdict.miss("friction at velocities that the rounding of the coefficients hides");
    }
    let v_ceiling = number(row, "v_ceiling").unwrap_or(f64::INFINITY);
    if state != StateLaw::Ageing {
        let optimum = relaxed::certify(&mut verdict, &problem, state, (t_f, v_ceiling));
        compare_gap(&mut verdict, row, optimum.value, Some(work));
    } else if v_ceiling.is_finite() {
        verdict.miss("the optimum of ageing under a velocity ceiling: the table optimal has its check");
    } else if let Some(optimum) = Task::new(&problem, t_f, context.bounded).certify(&mut verdict) {
        verdict.compare(row, "work_optimal", Some(optimum.work), None);
        // The relative error is up to 1e-7 for any rtol. The difference of two integrations determines the gap to 1e-12, or to the error of the
        // works.
        let gap = (work - optimum.work) / optimum.work;
        let written = [("work", work), ("work_optimal", optimum.work)];
        let off = written.map(|(column, found)| number(row, column).map_or(0.0, |written| (written - found).abs()));
        let noise = 1e-12 + (off[0] + off[1]) / optimum.work.abs();
        verdict.compare(row, "gap", Some(gap), Some((1e-7 * gap.abs()).max(noise) / rtol));
    }
    let least = if context.bounded { 1.0 } else { 0.0 };
    let size = a_2.abs() + a_3.abs();
    let mut saved = 0.0_f64;
    let far = if state == StateLaw::Ageing { &[][..] } else { &FAR_FRACTIONS };
    for fraction in FRACTIONS.iter().chain(far) {
        for turn in 0..8 {
            let angle = f64::from(turn) * std::f64::consts::FRAC_PI_4;
            let (sin, cos) = angle.sin_cos();
            let near = Cubic::new(&problem, t_f, a_2 + fraction * size * cos, a_3 + fraction * size * sin);
            let near = near.under(state);
            if near.slack() > 0.0 && near.v_min() >= least {
                saved = saved.max(near.work().map_or(0.0, |near| (work - near) / work.abs()));
            }
        }
    }
    // Differences below the rounding error of an integration are ignored.
    verdict.push("beaten", if saved > rtol { saved } else { 0.0 });
    Ok(verdict)
}
