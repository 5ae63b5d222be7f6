//! `optimal`: the traced optimum obeys the equations and conserves `C`, on the floor no higher velocity costs less: it is the extremal.
//!
//! With the costate `beta` of `theta` the Hamiltonian `tau v - beta theta'` is `-C` all the way. Off the floor it is stationary in `v`,
//! so `C = a v - (tau + a)/theta`; on the floor it rises with `v`.

use super::clamped::Way;
use super::motion::Followed;
use super::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::model::Transition;
use crate::protocol::optimal::{self, Bounds};
use crate::protocol::{Moment, SpringBlock, Status};
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

/// Distance from a ceiling, relative to 1 and it, at which a moment counts as on it.
const AT_CEILING: f64 = 1e-9;

/// Accuracy of the motions.
const MOTION_RTOL: f64 = 1e-12;

/// The optimum, if there is one, with its error as a difference of the column `optimum`.
pub fn certify(verdict: &mut Verdict, problem: &Transition, t_f: f64, bounds: impl Into<Bounds>) -> Option<Optimum> {
    let bounds: Bounds = bounds.into();
    let (solved, motion) = optimal::motion(problem, t_f, bounds, MOTION_RTOL);
    let Some(motion) = motion else {
        verdict.miss("there is no motion of the optimum");
        return None;
    };
    let Transition { law, v_i, v_f } = *problem;
    let motion = Followed::new(motion, &SpringBlock { law, k: f64::INFINITY, m: 0.0 });
    let mut conserved: Vec<(f64, f64)> = Vec::new();
    let proven = matches!(solved.status, Status::Ok | Status::BelowBound);
    let mut wrong = 0.0f64;
    let near =
        |value: f64, ceiling: f64| ceiling.is_finite() && (value - ceiling).abs() <= AT_CEILING * (1.0 + ceiling.abs());
    for &(_, Moment { v, theta, friction, beta, .. }) in &motion.samples {
        let press = friction + law.a;
        let at_floor = bounds.floor && v == 1.0;
        if !at_floor && !near(v, bounds.v_ceiling) && !near(friction, bounds.tau_ceiling) {
            conserved.push((law.a * v - press / theta, law.a * v + press.abs() / theta));
            continue;
        }
        let Some(beta) = beta else { continue };
        let (pull, push) = (beta * (1.0 - theta * v), friction * v);
        conserved.push((pull - push, beta.abs() * (1.0 + theta * v) + push.abs()));
        // On the floor the Hamiltonian must not fall with the velocity, at a ceiling not rise; where friction is too low for a
        // proof it may.
        let fall = (press + beta * theta) / press.abs().max(law.a) * if at_floor { -1.0 } else { 1.0 };
        wrong = wrong.max(if proven { fall } else { 0.0 });
    }
    let (c, size) = conserved.iter().copied().min_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((f64::NAN, f64::NAN));
    let drift = conserved.iter().map(|(other, size)| (other - c).abs() / size).fold(0.0, f64::max);
    let (start, end) = (motion.samples[0].1, motion.end());
    let arrival = (start.theta * v_i - 1.0).abs() + (end.theta * v_f - 1.0).abs() + (end.t / t_f - 1.0).abs();
    verdict.push("optimum", motion.equation + arrival + drift + wrong);
    Some(Optimum { work: motion.work, start, end, c, c_noise: 1e-14 * size, motion })
}

/// Compares the work of the optimum and, where the row has one, the gap of the protocol `work` above it.
pub fn compare(
    verdict: &mut Verdict,
    row: &Row,
    (problem, t_f): (&Transition, f64),
    work: Option<f64>,
    bounds: impl Into<Bounds>,
) {
    let Some(optimum) = certify(verdict, problem, t_f, bounds) else { return };
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
    let ceilings = ["v_ceiling", "tau_ceiling"].map(|name| number(row, name).unwrap_or(f64::INFINITY));
    if ceilings.into_iter().any(f64::is_finite) {
        return under_ceilings(row, &Way::of(&problem, context.bounded, ceilings), t_f);
    }
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

/// Time at the floor beyond which the conserved `C` no longer determines the rest of the path.
const MAX_TIME_AT_FLOOR: f64 = 12.0;

/// A row under ceilings: the protocol of the row's own `C` and the next steps of Newton's method, integrated.
fn under_ceilings(row: &Row, way: &Way, t_f: f64) -> Verdict {
    let mut verdict = Verdict::default();
    match way.feasible(t_f) {
        None => verdict.miss("it is too close to the border of what is feasible"),
        Some(feasible) => verdict.status(row, !feasible),
    }
    let (Some(hamiltonian), Some(v_start), Some(v_end)) =
        (number(row, "hamiltonian"), number(row, "v_start"), number(row, "v_end"))
    else {
        if word(row, STATUS) != Some("infeasible") {
            verdict.miss("a column is missing: hamiltonian, v_start or v_end");
        }
        return verdict;
    };
    if way.sits() || number(row, "time_at_floor").is_some_and(|time| time > MAX_TIME_AT_FLOOR) {
        verdict.miss("C does not determine it: it waits at the floor for long, or slides steadily at v_f");
        return verdict;
    }
    // Theta rises first and falls at the end.
    let turns = v_start * way.from < 1.0 && v_end * way.to > 1.0;
    let Some(found) = way.solve(t_f, -hamiltonian, turns) else {
        verdict.miss("the integrator did not get there");
        return verdict;
    };
    let size = found.work.abs();
    let or_t_f = |time: f64| Some(if time == 0.0 { t_f } else { time });
    verdict.compare(row, "work", Some(found.work), Some(size));
    verdict.compare(row, "v_start", Some(found.v_start), None);
    verdict.compare(row, "v_end", Some(found.v_end), None);
    verdict.compare(row, "time_at_floor", Some(found.time_at_floor), or_t_f(found.time_at_floor));
    verdict.compare(row, "time_at_v_ceiling", Some(found.time_at_v_ceiling), or_t_f(found.time_at_v_ceiling));
    verdict.compare(row, "time_at_tau_ceiling", Some(found.time_at_tau_ceiling), or_t_f(found.time_at_tau_ceiling));
    verdict.compare(row, "hamiltonian", Some(-found.c), None);
    verdict.compare(row, "theta_max", Some(found.theta_max), None);
    verdict.friction(row, found.friction[0]);
    let [by_v, by_tau] = found.pressure.map(|pressure| -pressure);
    let [start, end] = found.costate;
    for (column, expected) in [
        ("dwork_da", found.by_law[0]),
        ("dwork_db", found.by_law[1]),
        ("dwork_dv_i", -start * way.from * way.from),
        ("dwork_dv_f", end * way.to * way.to),
        ("dwork_dv_ceiling", by_v),
        ("dwork_dtau_ceiling", by_tau),
    ] {
        verdict.compare(row, column, Some(expected), (expected == 0.0).then_some(1.0));
    }
    // No admissible variation may cost less, with time at its price.
    let cost = found.work + found.c * found.time;
    verdict.push("beaten", ((cost - found.varied) / size).max(0.0));
    verdict
}
