//! `shortcut`: the traced member obeys the equations and the formula of its family, and arrives.

use super::gap::{Cubic, place};
use super::motion::Followed;
use super::route::integrate;
use super::task::{Task, min_duration};
use super::verdict::{Checked, NEGATIVE, axis};
use super::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::model::Transition;
use crate::protocol::optimal::Bounds;
use crate::protocol::shortcut::{Case, find};
use crate::protocol::{Moment, SpringBlock};
use crate::table::STATUS;

pub fn check(row: &Row, context: &Context, rtol: f64) -> Checked {
    let (problem, t_f) = (transition(row)?, axis(row, "t_f")?);
    let name = word(row, "family").ok_or("an axis is missing")?;
    let case = Case { transition: problem, t_f, tau_ceiling: number(row, "tau_ceiling").unwrap_or(f64::INFINITY) };
    if !matches!(word(row, STATUS), Some("ok" | "below_bound" | NEGATIVE | "infeasible")) {
        return Err("status is neither ok, below_bound, negative_friction nor infeasible");
    }
    let bound = obstacle(&case, name, context.bounded)
        .ok_or("too close to the border to determine whether the family has a member")?;
    let mut verdict = Verdict::default();
    verdict.status(row, bound.is_some());
    if let Some(bound) = bound {
        verdict.compare_word(row, "bound", bound);
    }
    if bound.is_some() || word(row, STATUS) == Some("infeasible") {
        return Ok(verdict);
    }
    let Some(Ok(motion)) = find(name).map(|family| family.motion(&case, rtol)) else {
        verdict.push("motion", f64::INFINITY);
        return Ok(verdict);
    };
    let followed = Followed::new(motion, &SpringBlock { law: problem.law, k: f64::INFINITY, m: 0.0 });
    let miss = followed.end().theta * problem.v_f - 1.0;
    let formula = formula(&mut verdict, row, &case, name, &followed, rtol);
    let arrival = if name == "step" { 0.0 } else { miss.abs() };
    verdict.push("motion", followed.equation + arrival + formula + (followed.end().t / t_f - 1.0).abs());
    verdict.compare(row, "terminal_error", Some(if name == "step" { miss } else { 0.0 }), Some(1.0));
    verdict.compare(row, "work", Some(followed.work), None);
    followed.compare_velocities(&mut verdict, row);
    let friction_max = followed.greatest(|at| at.friction);
    verdict.compare(row, "friction_max", Some(friction_max), Some(friction_max.abs().max(1.0)));
    verdict.friction(row, followed.least(|at| at.friction));
    // The optimum of this family has its ceiling.
    let ceiling = if name == "bounded_friction" { case.tau_ceiling } else { f64::INFINITY };
    let bounds = Bounds::new(context.bounded).with_tau_ceiling(ceiling);
    Task::new(&problem, t_f, bounds).compare_gap(&mut verdict, row, Some(followed.work));
    Ok(verdict)
}

/// Distance of a moment from the bound of its family, and the size of its terms.
type Distance<'a> = &'a dyn Fn(&Moment) -> (f64, f64);

/// Compares `alpha` with that of the moment that determines it best; the greatest distance from the formula along the motion.
fn formula(verdict: &mut Verdict, row: &Row, case: &Case, name: &str, followed: &Followed, rtol: f64) -> f64 {
    let Case { transition: Transition { law, v_i, v_f }, t_f, tau_ceiling } = *case;
    let greatest = |off: &dyn Fn(&Moment) -> f64| followed.samples.iter().map(|(_, at)| off(at)).fold(0.0, f64::max);
    let steady = |v: f64| 1.0 + (law.a - law.b) * v.ln();
    let room = |v: f64| if name == "bounded_velocity" { v - 1.0 } else { tau_ceiling - steady(v) };
    let (first, last) = (room(v_i), room(v_f));
    // The logarithm of the distance from the bound over that at the start is `l x + c x (1 - x)`, `x = t/t_f`.
    let (here, unit): (Distance<'_>, f64) = match name {
        "step" => return greatest(&|at| (at.v / v_f - 1.0).abs()),
        "cubic" => {
            let cubic = Cubic::new(&case.transition, t_f, 0.0, -3.0 * (v_f - v_i) / (v_i * v_f));
            // Theta and its slope are differences of numbers of the size of the greatest, and of that over the time.
            let noise =
                |at: &Moment| 16.0 * f64::EPSILON / v_i.min(v_f) * (1.0 / at.theta + 1.0 / (t_f * at.theta * at.v));
            return greatest(&|at| ((at.v / cubic.velocity(place(at.t / t_f)) - 1.0).abs() - noise(at)).max(0.0));
        }
        "bounded_velocity" => (&|at| (at.v - 1.0, at.v), -t_f * t_f),
        // A parabola, for which alpha is 0.
        _ if tau_ceiling == f64::INFINITY => {
            verdict.compare(row, "alpha", Some(0.0), Some(1.0));
            return 0.0;
        }
        _ => (&|at| (tau_ceiling - at.friction, tau_ceiling.abs() + at.friction.abs()), 1.0),
    };
    let l = (last / first).ln();
    // Rounding of the distances at the ends.
    let rounding = if name == "bounded_velocity" { 0.0 } else { (tau_ceiling.abs() + 1.0) / first.min(last) };
    // The coefficient from one moment, and its rounding.
    let coefficient = |at: &Moment| {
        let ((distance, size), x) = (here(at), at.t / t_f);
        let noise = 8.0 * f64::EPSILON * (size / distance.abs() + l.abs() + rounding);
        (((distance / first).ln() - l * x) / (x * (1.0 - x)), noise / (x * (1.0 - x)))
    };
    let all =
        followed.samples.iter().map(|(_, at)| coefficient(at)).filter(|(c, noise)| c.is_finite() && noise.is_finite());
    let Some((c, noise)) = all.min_by(|x, y| x.1.total_cmp(&y.1)) else { return f64::INFINITY };
    verdict.compare(row, "alpha", Some(c / unit), Some((c.abs() + noise / rtol) / unit.abs()));
    greatest(&|at| {
        let ((distance, size), x) = (here(at), at.t / t_f);
        let expected = first * (l * x + c * x * (1.0 - x)).exp();
        ((distance - expected).abs() / size - noise * x * (1.0 - x) * expected / size).max(0.0)
    })
}

/// Relative distance from 0 below which the sign of a number is unknown. Chosen: a hundred times the tolerance of the integrator
/// (`route.rs`).
const SIGN_RTOL: f64 = 1e-11;

/// The bound that leaves the family without a member, from the extreme protocols of the family; `None` where rounding decides.
fn obstacle(case: &Case, family: &str, bounded: bool) -> Option<Option<&'static str>> {
    let Case { transition: Transition { law, v_i, v_f }, t_f, tau_ceiling } = *case;
    let settle = |bound: &'static str, room: f64, size: f64| match room / size {
        room if room > SIGN_RTOL => Some(None),
        room if room < -SIGN_RTOL => Some(Some(bound)),
        _ => None,
    };
    let spare = settle("time", t_f - min_duration(&case.transition, true), t_f);
    if bounded && v_f < v_i && spare != Some(None) {
        return spare;
    }
    let steady = |v: f64| 1.0 + (law.a - law.b) * v.ln();
    let highest = steady(v_i).max(steady(v_f));
    match family {
        "cubic" => {
            let slack = Cubic::new(&case.transition, t_f, 0.0, -3.0 * (v_f - v_i) / (v_i * v_f)).slack();
            settle("velocity", slack, 1.0)
        }
        "bounded_velocity" if v_f < v_i => spare,
        "bounded_friction" => match settle("friction", tau_ceiling - highest, highest.abs() + 1.0) {
            Some(None) if v_f > v_i && tau_ceiling.is_finite() => {
                // With tau = tau_ceiling throughout, the time in which theta falls to its target, over ln theta.
                let time = |y: &[f64; 2]| {
                    let surplus = (tau_ceiling - 1.0) / law.a + (1.0 - law.b / law.a) * y[0];
                    [-1.0, y[0].exp() / surplus.exp_m1()]
                };
                let least = integrate(time, [-v_i.ln(), 0.0], (0.0, (v_f / v_i).ln()))?[1];
                settle("friction", t_f - least, t_f)
            }
            // With v = 0 throughout, theta rises by the time.
            Some(None) if v_f < v_i => settle("velocity", t_f - (1.0 / v_f - 1.0 / v_i), t_f),
            decided => decided,
        },
        _ => Some(None),
    }
}
