//! `optimal`: the traced optimum obeys the equations and conserves `C`, on the floor no higher velocity costs less: it is the extremal.
//!
//! With the costate `beta` of `theta` the Hamiltonian `tau v - beta theta'` is `-C` all the way. Off the floor it is stationary in `v`,
//! so `C = a v - (tau + a)/theta`; on the floor it rises with `v`.

use super::motion::Followed;
use super::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::model::Transition;
use crate::protocol::{Moment, SpringBlock, Status, optimal};
use crate::table::STATUS;

/// The certified optimum of a transition in some time.
pub struct Optimum {
    pub motion: Followed,
    pub work: f64,
    pub start: Moment,
    pub end: Moment,
    /// The conserved `C`, and what rounding leaves of its digits.
    pub c: f64,
    pub c_noise: f64,
}

/// Shortest duration with `v >= 1`: the time on the floor from `1/v_i` to `1/v_f`.
pub fn min_duration(problem: &Transition) -> f64 {
    ((problem.v_i - problem.v_f).max(0.0) / (problem.v_i * (problem.v_f - 1.0))).ln_1p()
}

/// Accuracy of the motions.
const MOTION_RTOL: f64 = 1e-12;

/// The optimum, if there is one, with its error as a difference of the column `optimum`.
pub fn certify(verdict: &mut Verdict, problem: &Transition, t_f: f64, bounded: bool) -> Option<Optimum> {
    let (solved, motion) = optimal::motion(problem, t_f, bounded, MOTION_RTOL);
    let Some(motion) = motion else {
        verdict.miss("there is no motion of the optimum");
        return None;
    };
    let Transition { law, v_i, v_f } = *problem;
    let motion = Followed::new(motion, &SpringBlock { law, k: f64::INFINITY, m: 0.0 });
    let mut conserved: Vec<(f64, f64)> = Vec::new();
    let proven = matches!(solved.status, Status::Ok | Status::BelowBound);
    let mut wrong = 0.0f64;
    for (_, Moment { v, theta, friction, beta, .. }) in &motion.samples {
        let (beta, press) = (beta.unwrap_or(f64::NAN), friction + law.a);
        if bounded && *v == 1.0 {
            conserved.push((beta * (1.0 - theta) - friction, beta.abs() * (1.0 - theta).abs() + friction.abs()));
            // It must not fall with the velocity; where friction is too low for a proof it may.
            let fall = -(press + beta * theta) / press.abs().max(law.a);
            wrong = wrong.max(if proven { fall } else { 0.0 });
        } else {
            conserved.push((law.a * v - press / theta, law.a * v + press.abs() / theta));
        }
    }
    let (c, size) = conserved.iter().copied().min_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((f64::NAN, f64::NAN));
    let drift = conserved.iter().map(|(other, size)| (other - c).abs() / size).fold(0.0, f64::max);
    let (start, end) = (motion.samples[0].1, motion.end());
    let arrival = (start.theta * v_i - 1.0).abs() + (end.theta * v_f - 1.0).abs() + (end.t / t_f - 1.0).abs();
    verdict.push("optimum", motion.equation + arrival + drift + wrong);
    Some(Optimum { work: motion.work, start, end, c, c_noise: 1e-14 * size, motion })
}

/// Compares the work of the optimum and, where the row has one, the gap of the protocol `work` above it.
pub fn compare(verdict: &mut Verdict, row: &Row, (problem, t_f): (&Transition, f64), work: Option<f64>, bounded: bool) {
    let Some(optimum) = certify(verdict, problem, t_f, bounded) else { return };
    verdict.compare(row, "work_optimal", Some(optimum.work), None);
    if let Some(work) = work {
        // The tables promise the gap relative to 1, or to itself if that is more.
        let gap = (work - optimum.work) / optimum.work;
        verdict.compare(row, "gap", Some(gap), Some(gap.abs().max(1.0)));
    }
}

pub fn check(row: &Row, context: &Context, rtol: f64) -> Verdict {
    let (Some(problem), Some(t_f)) = (transition(row), number(row, "t_f")) else {
        return Verdict::unchecked("an axis is missing");
    };
    let mut verdict = Verdict::default();
    let infeasible = context.bounded && t_f < min_duration(&problem);
    verdict.status(row, infeasible);
    if infeasible || word(row, STATUS) == Some("infeasible") {
        return verdict;
    }
    let Some(optimum) = certify(&mut verdict, &problem, t_f, context.bounded) else { return verdict };
    let Optimum { motion, work, start, end, c, c_noise } = &optimum;
    verdict.compare(row, "work", Some(*work), None);
    verdict.compare(row, "v_start", Some(start.v), None);
    verdict.compare(row, "v_end", Some(end.v), None);
    let time_at_floor = if context.bounded { motion.time_at_floor() } else { 0.0 };
    verdict.compare(row, "time_at_floor", Some(time_at_floor), (time_at_floor == 0.0).then_some(t_f));
    verdict.compare(row, "hamiltonian", Some(-c), Some(c.abs() + c_noise / rtol));
    verdict.compare(row, "theta_max", Some(motion.greatest(|at| at.theta)), None);
    verdict.friction(row, motion.least(|at| at.friction));
    let strategy = match start.v {
        _ if time_at_floor > 0.0 => "floor",
        v if v > problem.v_i => "speed_up",
        _ => "slow_down",
    };
    verdict.compare_word(row, "strategy", strategy);
    verdict
}
