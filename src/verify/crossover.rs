//! `crossover`: the extremals of the defining initial or final conditions, integrated until theta arrives.

use super::extremal::{Extremal, branch, floor, from_end, from_start, min_duration};
use super::verdict::NEGATIVE;
use super::{Context, Verdict, transition, word};
use crate::dataset::Row;
use crate::model::Transition;
use crate::table::STATUS;

pub fn check(row: &Row, context: &Context) -> Verdict {
    let Some(problem) = transition(row) else { return Verdict::unchecked("an axis is missing") };
    if !matches!(word(row, STATUS), Some("ok" | NEGATIVE)) {
        return Verdict::unchecked("status is neither ok nor negative_friction");
    }
    let mut verdict = Verdict::default();
    let (a, b) = (problem.law.a, problem.law.b);
    let (ln_i, ln_f) = (problem.v_i.ln(), problem.v_f.ln());
    let (tau_i, tau_f) = (1.0 + (a - b) * ln_i, 1.0 + (a - b) * ln_f);
    let accelerates = problem.v_f > problem.v_i;
    let mut pair = |columns: [&'static str; 2], exists: bool, extremal: Option<Extremal>| {
        if exists && extremal.is_none() {
            verdict.miss("the integrator did not get there");
            return;
        }
        let extremal = extremal.filter(|_| exists);
        verdict.compare(row, columns[0], extremal.map(|e| e.time), None);
        verdict.compare(row, columns[1], extremal.map(|e| e.work), None);
    };
    let cross = accelerates && tau_i > b - a && problem.v_f * tau_f > problem.v_i * tau_i;
    pair(["t_cross", "work_at_t_cross"], cross, from_start(&problem, 0.0, false, None));
    let start = 1.0 + a - b * ln_i;
    let hold_exists = accelerates && start - a > b - a && problem.v_f * tau_f > problem.v_i * start - a;
    pair(["t_floor", "work_at_t_floor"], hold_exists, from_start(&problem, -ln_i, false, None));
    // C = 0: a (e^z - 1 - z) = tau_ss(v_i).
    let cheapest = accelerates && tau_i > 0.0 && tau_f > 0.0;
    let fastest = branch(tau_i / a, true).and_then(|z| from_start(&problem, z, false, None));
    pair(["t_cheapest", "work_at_t_cheapest"], cheapest, fastest);
    if !accelerates {
        let turn = tau_f > b - a;
        if problem.v_f < problem.v_i {
            // At the turn itself rounding decides whether there is an end; the error of the mean of two neighbours is z^2.
            let near = [-1e-6, 1e-6].map(|z| from_end(&problem, z, context.bounded, None));
            let mean = match near {
                [Some(before), Some(after)] => Some(Extremal {
                    time: 0.5 * (before.time + after.time),
                    work: 0.5 * (before.work + after.work),
                    ..before
                }),
                _ => None,
            };
            pair(["t_turn", "work_at_t_turn"], turn, mean);
        }
        let t_min = min_duration(&problem);
        let bounded = context.bounded;
        verdict.compare(row, "t_min", bounded.then_some(t_min), (t_min == 0.0).then_some(1.0));
        let work = bounded.then(|| floor(problem.law, 1.0 / problem.v_i, t_min)).flatten();
        verdict.compare(row, "work_at_t_min", work, (t_min == 0.0).then_some(1.0));
    }
    let window = if accelerates || !context.bounded { None } else { window(&problem) };
    match window {
        Some([Some(rising), Some(falling)]) => {
            // Without a change of velocity the window starts at t_f = 0.
            let starts_at_once = problem.v_i == problem.v_f;
            let rising = if starts_at_once { 0.0 } else { rising.time };
            verdict.compare(row, "t_free_in", Some(rising), starts_at_once.then_some(1.0));
            verdict.compare(row, "t_free_out", Some(falling.time), None);
        }
        Some(_) => verdict.miss("the integrator did not get there"),
        None => {
            verdict.compare(row, "t_free_in", None, None);
            verdict.compare(row, "t_free_out", None, None);
        }
    }
    verdict
}

/// The decelerations that start at `v = 1` without a hold, theta rising or falling at the end; `None` if there are none.
///
/// `v(0+) = 1` fixes `C = a - v_i (1 + a - b ln v_i)`, and `C` the energy `e^z - 1 - z` that is left at the target. Each
/// of the two `z` belongs to one of them, if there is any energy left.
fn window(problem: &Transition) -> Option<[Option<Extremal>; 2]> {
    let (a, b) = (problem.law.a, problem.law.b);
    let (ln_i, ln_f) = (problem.v_i.ln(), problem.v_f.ln());
    let c = a - problem.v_i * (1.0 + a - b * ln_i);
    let left = (1.0 - (b - a) * ln_f + c / problem.v_f) / a;
    let regular = 1.0 + (a - b) * ln_f > b - a && 1.0 - b * ln_i > b - a;
    (regular && left > 0.0).then(|| [false, true].map(|falling| from_end(problem, branch(left, falling)?, false, None)))
}
