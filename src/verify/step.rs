//! `step`: the block on its spring integrated explicitly up to the peak, and what linear stability forbids.

use super::route::integrate;
use super::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::stability::SteadySliding;

pub fn check(row: &Row, _: &Context) -> Verdict {
    let (Some(problem), Some(k), Some(m)) = (transition(row), number(row, "k"), number(row, "m")) else {
        return Verdict::unchecked("an axis is missing");
    };
    let mut verdict = Verdict::default();
    let (law, v_f) = (problem.law, problem.v_f);
    let moves = k.is_finite() && problem.v_i != v_f;
    // Steady sliding that is unstable is left.
    if moves && !SteadySliding::new(law, k, m, v_f).is_stable() && word(row, "outcome") == Some("settled") {
        verdict.compare_word(row, "outcome", "limit_cycle");
    }
    let Some(t_peak) = number(row, "t_peak") else {
        if word(row, "outcome") == Some("settled") {
            // A peak that is only approached is steady sliding itself.
            verdict.compare(row, "v_peak", Some(v_f), None);
            return verdict;
        }
        verdict.unchecked = Some("without t_peak nothing is simulated again");
        return verdict;
    };
    if m == 0.0 {
        verdict.unchecked = Some("the explicit integrator needs a mass");
        return verdict;
    }
    // z = k s - tau_ss(v_f), y = ln(theta v_f), x = ln(v/v_f), times in l/v_f.
    let inertia = m * v_f * v_f;
    let slope = |&[z, y, x]: &[f64; 3]| {
        let v = x.exp();
        [k * (1.0 - v), (-y).exp() - v, (z - law.a * x - law.b * y) / (inertia * v)]
    };
    let x = (problem.v_i / v_f).ln();
    match integrate(slope, [(law.a - law.b) * x, -x, x], (0.0, t_peak * v_f)) {
        Some([z, y, x]) => {
            let v = v_f * x.exp();
            verdict.compare(row, "v_peak", Some(v), None);
            // How far the top is: v'/v'' there, in which the next order of v is small.
            let [z1, y1, x1] = slope(&[z, y, x]);
            let x2 = (z1 - law.a * x1 - law.b * y1) / (inertia * x.exp()) - x1 * x1;
            let overshoot = (x.exp_m1()).min(1.0);
            verdict.compare(row, "t_peak", Some(t_peak - x1 / x2 / v_f), Some(t_peak / overshoot));
        }
        None => verdict.unchecked = Some("too stiff for an explicit integrator"),
    }
    verdict
}
