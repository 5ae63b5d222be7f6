//! `optimal`: the traced optimum obeys the equations and conserves `C`, on the floor no higher velocity costs less: it is the extremal.
//!
//! With the costate `beta` of `theta` the Hamiltonian `tau v - beta theta'` is `-C` all the way. Off the floor it is stationary in `v`,
//! so `C = a v - (tau + a)/theta`; on the floor it rises with `v`.

use super::clamped::{TIME_NOISE, Totals, Way};
use super::motion::Followed;
use super::verdict::state_law;
use super::{Context, Verdict, arcsinh, number, relaxed, transition, word};
use crate::dataset::Row;
use crate::model::{Friction, StateLaw, Transition};
use crate::protocol::optimal::{self, Bounds};
use crate::protocol::{Moment, SpringBlock, Status};
use crate::table::STATUS;

/// The certified optimum of a transition with a given duration.
pub struct Optimum {
    pub motion: Followed,
    pub work: f64,
    pub start: Moment,
    pub end: Moment,
    /// The conserved `C`, and its rounding error.
    pub c: f64,
    pub c_noise: f64,
}

/// Shortest duration with `v >= 1`: the time on the floor from `1/v_i` to `1/v_f`.
pub fn min_duration(problem: &Transition) -> f64 {
    ((problem.v_i - problem.v_f).max(0.0) / (problem.v_i * (problem.v_f - 1.0))).ln_1p()
}

/// Distance from a ceiling, relative to 1 plus the ceiling, below which a moment counts as on it. Chosen: far above the errors of a motion.
const CEILING_RTOL: f64 = 1e-9;

/// Relative accuracy of the motions. Chosen: a hundredth of the default `rtol`.
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
    let near = |value: f64, ceiling: f64| {
        ceiling.is_finite() && (value - ceiling).abs() <= CEILING_RTOL * (1.0 + ceiling.abs())
    };
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
        // The Hamiltonian must not fall with the velocity on the floor, nor rise with it at a ceiling, except where friction is too low for
        // a proof.
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
    let optimum = certify(verdict, problem, t_f, bounds);
    compare_gap(verdict, row, optimum.map(|optimum| optimum.work), work);
}

/// Compares the least work, if it is known, and the gap of the protocol `work` above it.
pub fn compare_gap(verdict: &mut Verdict, row: &Row, least: Option<f64>, work: Option<f64>) {
    let Some(least) = least else { return };
    verdict.compare(row, "work_optimal", Some(least), None);
    if let Some(work) = work {
        // The promised error of the gap is relative to the greater of 1 and the gap.
        let gap = (work - least) / least;
        verdict.compare(row, "gap", Some(gap), Some(gap.abs().max(1.0)));
    }
}

/// Numbers of a protocol by integration.
type Number = fn(&Totals) -> f64;

/// The columns of an optimum.
const NUMBERS: [(&str, Number); 5] = [
    ("work", |totals| totals.work),
    ("v_start", |totals| totals.v_start),
    ("v_end", |totals| totals.v_end),
    ("hamiltonian", |totals| -totals.c),
    ("theta_max", |totals| totals.theta_max),
];

const TIMES: [(&str, Number); 3] = [
    ("time_at_floor", |totals| totals.time_at_floor),
    ("time_at_v_ceiling", |totals| totals.time_at_v_ceiling),
    ("time_at_tau_ceiling", |totals| totals.time_at_tau_ceiling),
];

/// Time on a bound, relative to `t_f`, below which rounding decides whether the protocol is ever on it. Chosen: ten times the noise of a
/// time (`clamped.rs`).
const MIN_TIME_RTOL: f64 = 1e-11;

pub fn check(row: &Row, context: &Context, rtol: f64) -> Verdict {
    let (Some(problem), Some(t_f)) = (transition(row), number(row, "t_f")) else {
        return Verdict::unchecked("an axis is missing");
    };
    if context.friction == Friction::Regularised {
        return arcsinh::check(row, &problem, t_f);
    }
    match state_law(row) {
        Some(StateLaw::Ageing) => {}
        Some(law) => return relaxed::check(row, &problem, law),
        None => return Verdict::unchecked("the law is unknown"),
    }
    let ceilings = ["v_ceiling", "tau_ceiling"].map(|name| number(row, name).unwrap_or(f64::INFINITY));
    let has_ceilings = ceilings.into_iter().any(f64::is_finite);
    let way = Way::of(&problem, t_f, context.bounded, ceilings);
    let mut verdict = Verdict::default();
    let feasible = match has_ceilings {
        true => way.is_feasible(),
        false => Some(!context.bounded || t_f >= min_duration(&problem)),
    };
    match feasible {
        None => verdict.miss("it is too close to the border of what is feasible"),
        Some(feasible) => verdict.status(row, !feasible),
    }
    compare_limits(&mut verdict, row, &way, rtol);
    if feasible == Some(false) || word(row, STATUS) == Some("infeasible") {
        return verdict;
    }
    // `C` does not determine the rest of the path after a long time at the floor.
    let is_vague = number(row, "time_at_floor").is_some_and(|time| time > MAX_TIME_AT_FLOOR);
    if is_vague || !has_ceilings {
        let bounds = Bounds { floor: context.bounded, v_ceiling: ceilings[0], tau_ceiling: ceilings[1] };
        followed(&mut verdict, row, (&problem, t_f), bounds, rtol);
    }
    if !is_vague && (has_ceilings || SLOPES.iter().any(|(column, _)| number(row, column).is_some())) {
        integrated(&mut verdict, row, &way, rtol);
    }
    verdict
}

/// Compares a row with its traced motion.
fn followed(verdict: &mut Verdict, row: &Row, (problem, t_f): (&Transition, f64), bounds: Bounds, rtol: f64) {
    let Some(optimum) = certify(verdict, problem, t_f, bounds) else { return };
    let Optimum { motion, work, start, end, c, c_noise } = &optimum;
    verdict.compare(row, "work", Some(*work), None);
    verdict.compare(row, "v_start", Some(start.v), None);
    verdict.compare(row, "v_end", Some(end.v), None);
    let time_at_floor = if bounds.floor { motion.time_at_floor() } else { 0.0 };
    verdict.compare(row, "time_at_floor", Some(time_at_floor), (time_at_floor == 0.0).then_some(t_f));
    if !bounds.has_ceilings() {
        verdict.compare(row, "time_at_v_ceiling", Some(0.0), Some(t_f));
        verdict.compare(row, "time_at_tau_ceiling", Some(0.0), Some(t_f));
        verdict.compare_word(row, "binding", "none");
    }
    verdict.compare(row, "hamiltonian", Some(-c), Some(c.abs() + c_noise / rtol));
    verdict.compare(row, "theta_max", Some(motion.greatest(|at| at.theta)), None);
    verdict.compare(row, "friction_max", Some(motion.greatest(|at| at.friction)), None);
    verdict.friction(row, motion.least(|at| at.friction));
    verdict.compare_word(row, "strategy", strategy(start.v, problem.v_i, time_at_floor));
}

fn strategy(v_start: f64, v_i: f64, time_at_floor: f64) -> &'static str {
    match v_start {
        _ if time_at_floor > 0.0 => "floor",
        v if v > v_i => "speed_up",
        _ => "slow_down",
    }
}

/// Time at the floor beyond which the conserved `C` no longer determines the rest of the path. Derived: the effect of an error of `C`
/// grows like `e^t`, and `e^12` roundings are 2e-11, a fraction of the default `rtol`.
const MAX_TIME_AT_FLOOR: f64 = 12.0;

/// Compares the least feasible numbers and the reason of an infeasible row.
fn compare_limits(verdict: &mut Verdict, row: &Row, way: &Way, rtol: f64) {
    if let Some(limits) = way.limits() {
        let least = limits.as_ref().ok().map(|(least, _)| *least);
        verdict.compare(row, "t_least", least, (least == Some(0.0)).then_some(way.t_f));
        match limits {
            _ if word(row, STATUS) != Some("infeasible") => verdict.demand_nothing(row, "bound"),
            // Either of two equal ceilings.
            Err(ceilings) if ceilings.len() > 1 => {}
            Err(ceilings) => ceilings.iter().for_each(|ceiling| verdict.compare_word(row, "bound", ceiling.name())),
            Ok((least, _)) => {
                verdict.compare_word(row, "bound", if way.t_f <= least { "too_fast" } else { "too_slow" });
            }
        }
    }
    // Ten `rtol` above a least ceiling a protocol exists, ten below none does.
    let near = 10.0 * rtol;
    let below_above = |least: f64| [-near, near].map(|part| least + part * least.abs());
    let under = |v_ceiling: f64, tau_ceiling: f64| Way { v_ceiling, tau_ceiling, ..*way }.is_feasible();
    type Under<'a> = &'a dyn Fn(f64) -> Option<bool>;
    let ceilings: [(&str, Under<'_>); 2] = [
        ("v_ceiling_least", &|v_ceiling| under(v_ceiling, way.tau_ceiling)),
        ("tau_ceiling_least", &|tau_ceiling| under(way.v_ceiling, tau_ceiling)),
    ];
    for (column, under) in ceilings {
        match under(f64::INFINITY) {
            Some(true) => verdict.demand(row, column),
            Some(false) => verdict.demand_nothing(row, column),
            None => {}
        }
        let Some(least) = number(row, column) else { continue };
        let [below, above] = below_above(least).map(under);
        let holds = below != Some(true) && above != Some(false);
        verdict.judge(column, holds, "least feasible");
    }
}

/// Compares a row with the protocol of its own `C` and the next steps of Newton's method, integrated.
fn integrated(verdict: &mut Verdict, row: &Row, way: &Way, rtol: f64) {
    let (Some(hamiltonian), Some(v_start), Some(v_end)) =
        (number(row, "hamiltonian"), number(row, "v_start"), number(row, "v_end"))
    else {
        return verdict.miss("a column is missing: hamiltonian, v_start or v_end");
    };
    let sitting = way.sitting();
    let sits = sitting.is_some();
    // Theta rises first and falls at the end.
    let turns = v_start * way.from < 1.0 && v_end > way.v_f;
    let Some(solution) = sitting.or_else(|| way.solve(-hamiltonian, turns)) else {
        return verdict.miss("the integrator did not get there");
    };
    let found = solution.totals;
    for (column, number) in NUMBERS {
        let expected = number(&found);
        verdict.compare(row, column, Some(expected), Some(expected.abs() + solution.noise(number) / rtol));
    }
    for (column, time) in TIMES {
        let noise = solution.noise(time) + TIME_NOISE * way.t_f;
        verdict.compare(row, column, Some(time(&found)), Some(time(&found) + noise / rtol));
    }
    let times = TIMES.map(|(_, time)| time(&found));
    if times.iter().all(|&time| time == 0.0 || time > MIN_TIME_RTOL * way.t_f) {
        let on = times.map(|time| time > 0.0);
        let binding = match on {
            [_, true, true] => "both",
            [_, true, false] => "v_ceiling",
            [_, false, true] => "tau_ceiling",
            _ => "none",
        };
        verdict.compare_word(row, "binding", binding);
        verdict.compare_word(row, "strategy", strategy(found.v_start, 1.0 / way.from, times[0]));
    }
    let [least, greatest] = way.friction(&solution);
    verdict.compare(row, "friction_max", Some(greatest), None);
    verdict.friction(row, least);
    if let (Some(work), Some(error)) = (number(row, "work"), number(row, "work_error")) {
        let noise = solution.noise(|totals| totals.work) + 0.1 * rtol * found.work.abs();
        verdict.judge("work_error", (work - found.work).abs() <= error + noise, "a bound");
    }
    if sits {
        return verdict.miss("derivatives of rows that slide steadily on a ceiling");
    }
    for (column, slope) in SLOPES {
        let slope = |totals: &Totals| slope(way, totals);
        let expected = slope(&found);
        let size = if expected == 0.0 { 1.0 } else { expected.abs() };
        verdict.compare(row, column, Some(expected), Some(size + solution.noise(slope) / rtol));
    }
    // `W + C t` of a neighbouring protocol must not be less.
    let cost = found.work + found.c * found.time;
    verdict.push("beaten", ((cost - found.varied) / found.work.abs()).max(0.0));
}

/// A derivative of the work.
type Slope = fn(&Way, &Totals) -> f64;

const SLOPES: [(&str, Slope); 6] = [
    ("dwork_da", |_, totals| totals.by_law[0]),
    ("dwork_db", |_, totals| totals.by_law[1]),
    ("dwork_dv_i", |way, totals| -totals.costate[0] * way.from * way.from),
    ("dwork_dv_f", |way, totals| totals.costate[1] / (way.v_f * way.v_f)),
    ("dwork_dv_ceiling", |_, totals| -totals.pressure[0]),
    ("dwork_dtau_ceiling", |_, totals| -totals.pressure[1]),
];
