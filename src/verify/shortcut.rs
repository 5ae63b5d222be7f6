//! `shortcut`: the family's formula with the row's `alpha`, integrated over time in the direction in which it contracts.

use super::clamped::Way;
use super::extremal::solve;
use super::formula_path::{Formula, FormulaPath, arriving};
use super::gap::Cubic;
use super::route::integrate;
use super::verdict::NEGATIVE;
use super::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::model::Transition;
use crate::table::STATUS;

/// Greatest distance of the end from the target, in `ln theta`, of a protocol that was followed.
const MAX_END_ERROR: f64 = 1e-9;

/// A relative change of alpha that is rounding.
const MOVED: f64 = 1e-9;

/// `ln(v_f/v_i)` beyond which theta, as the difference of numbers of the size of its greatest value, has too few digits.
const FAR: f64 = 11.5;

pub fn check(row: &Row, context: &Context) -> Verdict {
    let (Some(problem), Some(t_f), Some(family)) = (transition(row), number(row, "t_f"), word(row, "family")) else {
        return Verdict::unchecked("an axis is missing");
    };
    let tau_ceiling = number(row, "tau_ceiling").unwrap_or(f64::INFINITY);
    match word(row, STATUS) {
        Some("ok" | "below_bound" | NEGATIVE | "infeasible") => {}
        _ => return Verdict::unchecked("status is neither ok, below_bound, negative_friction nor infeasible"),
    }
    let Some(bound) = obstacle(&problem, t_f, family, tau_ceiling, context.bounded) else {
        return Verdict::unchecked("too close to the border to determine whether the family has a member");
    };
    let mut verdict = Verdict::default();
    verdict.status(row, bound.is_some());
    if let Some(bound) = bound {
        verdict.compare_word(row, "bound", bound);
        return verdict;
    }
    if word(row, STATUS) == Some("infeasible") {
        return verdict;
    }
    if tau_ceiling == f64::INFINITY && family == "bounded_friction" {
        verdict.miss("without a friction ceiling alpha is 0, which has no effect");
        return verdict;
    }
    let alpha = number(row, "alpha");
    if alpha.is_none() && family.starts_with("bounded") {
        verdict.miss("alpha was not written");
        return verdict;
    }
    let formula_path = |alpha: f64| formula_path(problem, t_f, family, alpha, tau_ceiling);
    let course_here = formula_path(alpha.unwrap_or(0.0));
    let Some(states) = course_here.states() else {
        verdict.miss("the integrator did not get there");
        return verdict;
    };
    let Some(end) = states.last() else { return verdict };
    let target = course_here.target();
    match alpha {
        Some(alpha) if alpha != 0.0 => {
            let arriving = arriving(alpha, end[0], target, formula_path);
            let doubtful = (end[0] - target).abs() > MAX_END_ERROR;
            let determines = arriving.is_finite() && (arriving - alpha).abs() > MOVED * alpha.abs();
            if doubtful && !determines {
                // A change of its last digits moves the end: as a double alpha does not determine the protocol.
                verdict.miss("alpha has too few digits to follow the protocol again");
                return verdict;
            }
            verdict.compare(row, "alpha", Some(arriving), None);
        }
        _ if (problem.v_f / problem.v_i).ln().abs() > FAR => {
            verdict.miss("velocities too far apart for the formula in doubles");
            return verdict;
        }
        Some(_) => verdict.compare(row, "alpha", Some(0.0), None),
        None if family == "cubic" => verdict.push("arrival", (end[0] - target).abs()),
        None => {}
    }
    verdict.compare(row, "terminal_error", Some((end[0] - target).exp_m1()), Some(1.0));
    verdict.compare(row, "work", Some(end[1]), None);
    verdict.compare(row, "v_min", Some(course_here.least(&states, |y| course_here.velocity(y))), None);
    verdict.compare(row, "v_max", Some(-course_here.least(&states, |y| -course_here.velocity(y))), None);
    let friction_max = -course_here.least(&states, |y| -course_here.friction(y));
    verdict.compare(row, "friction_max", Some(friction_max), Some(friction_max.abs().max(1.0)));
    verdict.friction(row, course_here.least(&states, |y| course_here.friction(y)));
    let ceiling = if family == "bounded_friction" { tau_ceiling } else { f64::INFINITY };
    match least_work(&problem, t_f, context.bounded, ceiling) {
        Some(least) => {
            verdict.compare(row, "work_optimal", Some(least), None);
            let gap = (end[1] - least) / least;
            verdict.compare(row, "gap", Some(gap), Some(gap.abs().max(1.0)));
        }
        None => verdict.miss("the integrator did not get there"),
    }
    verdict
}

/// The least work under a friction ceiling, from the protocol without it if that exceeds it.
fn least_work(problem: &Transition, t_f: f64, bounded: bool, tau_ceiling: f64) -> Option<f64> {
    let free = solve(problem, t_f, bounded)?;
    if tau_ceiling == f64::INFINITY {
        return Some(free.work);
    }
    let way = Way::of(problem, bounded, [f64::INFINITY, tau_ceiling]);
    let turns = free.v_start < problem.v_i && free.v_end > problem.v_f;
    way.solve(t_f, free.c, turns).map(|found| found.work)
}

/// Relative distance from 0 below which the sign of a number is unknown.
const UNSURE: f64 = 1e-11;

/// Which bound leaves the family without a member, from the extreme protocols of the family integrated: `None` where
/// that is too close to call.
fn obstacle(
    problem: &Transition,
    t_f: f64,
    family: &str,
    tau_ceiling: f64,
    bounded: bool,
) -> Option<Option<&'static str>> {
    let Transition { law, v_i, v_f } = *problem;
    let settle = |bound: &'static str, room: f64, size: f64| match room / size {
        room if room > UNSURE => Some(None),
        room if room < -UNSURE => Some(Some(bound)),
        _ => None,
    };
    // Along v = 1 theta ages most; it ends beyond its target if there is time to spare.
    let aged = integrate(|y: &[f64; 1]| [1.0 - y[0]], [1.0 / v_i], (0.0, t_f))?[0];
    let spare = settle("time", aged * v_f - 1.0, 1.0);
    if bounded && v_f < v_i && spare != Some(None) {
        return spare;
    }
    match family {
        "cubic" => {
            let slack = Cubic::new(problem, t_f, 0.0, -3.0 * (v_f - v_i) / (v_i * v_f)).slack();
            settle("velocity", slack, 1.0)
        }
        "bounded_velocity" if v_i == 1.0 || v_f == 1.0 => Some(Some("velocity")),
        "bounded_velocity" if v_f < v_i => spare,
        "bounded_friction" => {
            let steady = |v: f64| 1.0 + (law.a - law.b) * v.ln();
            let highest = steady(v_i).max(steady(v_f));
            match settle("friction", tau_ceiling - highest, highest.abs() + 1.0) {
                Some(None) if v_f > v_i && tau_ceiling.is_finite() => {
                    // With tau = tau_ceiling throughout, the time in which theta falls to its target, over ln theta.
                    let time = |y: &[f64; 2]| {
                        let surplus = (tau_ceiling - 1.0) / law.a + (1.0 - law.b / law.a) * y[0];
                        [-1.0, y[0].exp() / surplus.exp_m1()]
                    };
                    let fall = (v_f / v_i).ln();
                    let least = integrate(time, [-v_i.ln(), 0.0], (0.0, fall))?[1];
                    settle("friction", t_f - least, t_f)
                }
                // With v = 0 throughout, theta ages by the time.
                Some(None) if v_f < v_i => settle("velocity", t_f - (1.0 / v_f - 1.0 / v_i), t_f),
                decided => decided,
            }
        }
        _ => Some(None),
    }
}

fn formula_path(problem: Transition, t_f: f64, family: &str, alpha: f64, tau_ceiling: f64) -> FormulaPath {
    let Transition { law, v_i, v_f } = problem;
    let formula = match family {
        "step" => Formula::Velocity(Box::new(move |_| v_f)),
        "cubic" => {
            let cubic = Cubic::new(&problem, t_f, 0.0, -3.0 * (v_f - v_i) / (v_i * v_f));
            Formula::Velocity(Box::new(move |x| cubic.velocity(x)))
        }
        "bounded_velocity" => {
            let l = ((v_f - 1.0) / (v_i - 1.0)).ln();
            let scale = alpha * t_f * t_f;
            Formula::Velocity(Box::new(move |x| 1.0 + (v_i - 1.0) * (l * x - scale * x * (1.0 - x)).exp()))
        }
        _ => {
            let steady = |v: f64| 1.0 + (law.a - law.b) * v.ln();
            let (spare_i, spare_f) = (tau_ceiling - steady(v_i), tau_ceiling - steady(v_f));
            let l = (spare_f / spare_i).ln();
            Formula::Friction(Box::new(move |x| tau_ceiling - spare_i * (l * x + alpha * x * (1.0 - x)).exp()))
        }
    };
    let backward = matches!(formula, Formula::Friction(_)) && law.b > law.a;
    FormulaPath { problem, t_f, formula, backward }
}
