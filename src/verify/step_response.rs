//! `step_response`: the block on its spring, with an explicit integrator in other variables.

use std::cell::Cell;

use super::block_motion::Block;
use super::hopf;
use super::long_term::{LongTermBehaviour, follow};
use super::verdict::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::stability::SteadySliding;
use crate::table::STATUS;

/// Relative size of a step from unstable steady sliding below which the growth takes too long to integrate.
const MIN_AMPLITUDE: f64 = 1e-4;

/// Distance from the edge of the band of settled velocities, in rtol, within which a turn may or may not leave the band.
const EDGE_RTOLS: f64 = 10.0;

/// Relative overshoot below which its time is not determined.
const MIN_OVERSHOOT: f64 = 1e-3;

pub fn check(row: &Row, _: &Context, rtol: f64) -> Verdict {
    let (Some(problem), Some(k), Some(m)) = (transition(row), number(row, "k"), number(row, "m")) else {
        return Verdict::unchecked("an axis is missing");
    };
    let mut verdict = Verdict::default();
    let (law, v_i, v_f) = (problem.law, problem.v_i, problem.v_f);
    hopf::compare_coefficient(&mut verdict, row, law, m * v_f * v_f, rtol);
    if number(row, "t_end").is_some() {
        verdict.miss("t_end, up to which a response was integrated");
    }
    if !(k.is_finite() && v_i != v_f) {
        verdict.compare_word(row, "outcome", "settled");
        verdict.compare_word(row, "stick_slip", "no");
        ["v_peak", "v_trough"].iter().for_each(|column| verdict.compare(row, column, Some(v_f), None));
        verdict.compare(row, "settling_time", Some(0.0), Some(1.0));
        ["t_peak", "period", "cycle_peak", "cycle_trough"]
            .iter()
            .for_each(|column| verdict.compare(row, column, None, None));
        return verdict;
    }
    let stable = SteadySliding::new(law, k, m, v_f).is_stable();
    // A response does not settle at unstable steady sliding.
    if !stable && word(row, "outcome") == Some("settled") {
        verdict.compare_word(row, "outcome", "limit_cycle");
    }
    if word(row, "outcome") == Some("undecided") {
        verdict.miss("undecided responses");
        return verdict;
    }
    let start = (v_i / v_f).ln();
    if !stable && start.abs() < MIN_AMPLITUDE {
        verdict.miss("steps of less than 1e-4 about unstable sliding");
        return verdict;
    }
    let block = Block {
        pull: k / law.a,
        ratio: law.b / law.a,
        mu: m * v_f * v_f / law.a,
        fast: (0.01 * rtol).cbrt(),
        work: Cell::new(0),
    };
    let simulation = follow(&block, stable, start, rtol);
    let infinite = matches!(simulation.long_term, Ok(LongTermBehaviour::Infinite));
    if infinite || word(row, STATUS) == Some("infeasible") {
        verdict.status(row, infinite);
        return verdict;
    }
    let velocity = |x: f64| v_f * x.exp();
    // Effect of an error of the spring force on a quasi-static ln v.
    let felt = (block.pull * block.mu).sqrt().max(1.0).sqrt();
    let high = simulation.high.map_or(0.0, |high| high.x.max(0.0));
    let low = simulation.low.map_or(0.0, |low| low.x.min(0.0));
    let peak_time = |verdict: &mut Verdict| {
        let Some(top) = simulation.high.filter(|top| top.x > MIN_OVERSHOOT) else { return };
        let scale = (top.t / top.x.exp_m1().min(1.0)).max(top.flatness);
        verdict.compare_number(row, "t_peak", top.t / v_f, scale / v_f);
    };
    let compare_status = |verdict: &mut Verdict, bottom: f64| {
        let lowest = velocity(bottom).min(v_i);
        if lowest.ln().abs() > 100.0 * felt * rtol {
            verdict.compare_word(row, STATUS, if lowest < 1.0 { "below_bound" } else { "ok" });
        }
    };
    // Numbers with errors above rtol are null.
    match simulation.long_term {
        Ok(LongTermBehaviour::Settled { time, speed, margin }) => {
            compare_status(&mut verdict, low);
            verdict.compare_word(row, "outcome", "settled");
            verdict.compare_word(row, "stick_slip", "no");
            verdict.compare(row, "v_peak", Some(velocity(high)), None);
            verdict.compare_number(row, "v_trough", velocity(low), felt * velocity(low));
            peak_time(&mut verdict);
            if margin > EDGE_RTOLS * rtol {
                let scale = time.max(0.1 * block_time(&block)) + 1.0 / speed;
                verdict.compare_number(row, "settling_time", time / v_f, scale / v_f);
            } else {
                verdict.miss("settling times that depend on rounding");
            }
            ["period", "cycle_peak", "cycle_trough"].iter().for_each(|column| verdict.compare(row, column, None, None));
        }
        Ok(LongTermBehaviour::Cycle(cycle)) => {
            verdict.compare_word(row, "outcome", "limit_cycle");
            verdict.compare_word(row, "stick_slip", "yes");
            // A weakly attracting cycle is determined less accurately.
            let vague = (1e-10 / (1.0 - cycle.fraction) / rtol).max(1.0);
            let (top, bottom) = (high.max(cycle.high), low.min(cycle.low));
            compare_status(&mut verdict, bottom);
            verdict.compare(row, "v_peak", Some(velocity(top)), Some(vague * velocity(top)));
            verdict.compare_number(row, "v_trough", velocity(bottom), vague * felt * velocity(bottom));
            if high > cycle.high + 100.0 * vague * rtol {
                peak_time(&mut verdict);
            }
            verdict.compare(row, "period", Some(cycle.period / v_f), Some(vague * cycle.period / v_f));
            verdict.compare(row, "cycle_peak", Some(velocity(cycle.high)), Some(vague * velocity(cycle.high)));
            let trough = velocity(cycle.low);
            verdict.compare_number(row, "cycle_trough", trough, vague * felt * trough);
            verdict.compare(row, "settling_time", None, None);
        }
        Ok(LongTermBehaviour::Infinite) => {}
        Err(reason) => {
            verdict.miss(reason);
            // Earlier events do not depend on the end.
            if number(row, "t_peak").is_some_and(|t| t * v_f < simulation.t) {
                verdict.compare(row, "v_peak", Some(velocity(high)), None);
                peak_time(&mut verdict);
            }
        }
    }
    verdict
}

/// The period of small oscillations or the relaxation time, whichever is shorter, in `l/v_f`.
fn block_time(block: &Block) -> f64 {
    1.0 / (1.0 + block.pull)
}
