//! `shortcut`: the traced member obeys the equations and the formula of its family, and arrives.

use super::checked_row::NEGATIVE;
use super::gap::{Cubic, place};
use super::motion::Followed;
use super::route::integrate;
use super::task::{Task, min_duration};
use super::{Checked, CheckedRow};
use crate::model::Transition;
use crate::protocol::shortcut::{Case, find};
use crate::protocol::{Moment, SpringBlock};

pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, t_f, bounds) = (row.transition()?, row.axis("t_f")?, row.bounds());
    let name = row.word("family").ok_or("an axis is missing")?;
    let case = Case { transition: problem, t_f, tau_ceiling: bounds.tau_ceiling };
    if !["ok", "below_bound", NEGATIVE, "infeasible"].iter().any(|status| row.has_status(status)) {
        return Err("status is neither ok, below_bound, negative_friction nor infeasible");
    }
    let bound = obstacle(&case, name, bounds.floor)
        .ok_or("too close to the border to determine whether the family has a member")?;
    let has_numbers = row.compare_feasible(bound.is_none());
    if let Some(bound) = bound {
        row.compare_word("bound", bound);
    }
    if !has_numbers {
        return Ok(());
    }
    let Some(Ok(motion)) = find(name).map(|family| family.motion(&case, row.context.rtol)) else {
        row.push("motion", f64::INFINITY);
        return Ok(());
    };
    let followed = Followed::new(motion, &SpringBlock { law: problem.law, k: f64::INFINITY, m: 0.0 });
    let miss = followed.end().theta * problem.v_f - 1.0;
    let formula = formula(row, &case, name, &followed);
    let arrival = if name == "step" { 0.0 } else { miss.abs() };
    row.push("motion", followed.equation + arrival + formula + (followed.end().t / t_f - 1.0).abs());
    row.compare_relative("terminal_error", if name == "step" { miss } else { 0.0 }, 1.0);
    row.compare("work", followed.work);
    followed.compare_velocities(row);
    let friction_max = followed.greatest(|at| at.friction);
    row.compare_relative("friction_max", friction_max, friction_max.abs().max(1.0));
    row.compare_friction(followed.least(|at| at.friction));
    // The optimum of this family has its ceiling.
    let bounds = if name == "bounded_friction" { bounds } else { bounds.without_ceilings() };
    if let Some(optimum) = row.certify(&Task::new(&problem, t_f, bounds)) {
        row.compare_gap(optimum.work, Some(followed.work));
    }
    Ok(())
}

/// A family by the distance of its motions from a bound: the logarithm of that over the one at the start is `l p(x) + c q(x)`, `x = t/t_f`.
pub struct Exponential<'a> {
    pub t_f: f64,
    /// Distance at the start.
    pub first: f64,
    pub l: f64,
    /// `p` and `q`.
    pub shape: fn(f64) -> [f64; 2],
    /// Distance of a moment from the bound, and the size of its terms.
    pub distance: &'a dyn Fn(&Moment) -> [f64; 2],
    /// Relative rounding of the distances at the ends, in units of `8 eps`.
    pub rounding: f64,
}

impl Exponential<'_> {
    /// `c` by the moment that determines it best, with its rounding error, and the greatest distance from the formula along the motion.
    pub fn fit(&self, followed: &Followed) -> Option<[f64; 3]> {
        let moment = |(_, at): &(f64, Moment)| ((self.shape)(at.t / self.t_f), (self.distance)(at));
        let moments: Vec<([f64; 2], [f64; 2])> = followed.samples.iter().map(moment).collect();
        let coefficient = |&([p, q], [distance, size]): &([f64; 2], [f64; 2])| {
            let noise = 8.0 * f64::EPSILON * (size / distance.abs() + self.l.abs() + self.rounding);
            [((distance / self.first).ln() - self.l * p) / q, noise / q]
        };
        let determined = moments.iter().map(coefficient).filter(|fit| fit.iter().all(|number| number.is_finite()));
        let [c, noise] = determined.min_by(|x, y| x[1].total_cmp(&y[1]))?;
        let off = |&([p, q], [distance, size]): &([f64; 2], [f64; 2])| {
            let expected = self.first * (self.l * p + c * q).exp();
            ((distance - expected).abs() / size - noise * q * expected / size).max(0.0)
        };
        Some([c, noise, moments.iter().map(off).fold(0.0, f64::max)])
    }
}

/// Compares `alpha`; the greatest distance from the formula of the family along the motion.
fn formula(row: &mut CheckedRow<'_>, case: &Case, name: &str, followed: &Followed) -> f64 {
    let Case { transition: Transition { law, v_i, v_f }, t_f, tau_ceiling } = *case;
    let greatest = |off: &dyn Fn(&Moment) -> f64| followed.samples.iter().map(|(_, at)| off(at)).fold(0.0, f64::max);
    let shape = |x: f64| [x, x * (1.0 - x)];
    let over_floor = |at: &Moment| [at.v - 1.0, at.v];
    let under_ceiling = |at: &Moment| [tau_ceiling - at.friction, tau_ceiling.abs() + at.friction.abs()];
    let (family, unit) = match name {
        "step" => return greatest(&|at| (at.v / v_f - 1.0).abs()),
        "cubic" => {
            let cubic = smooth_cubic(case);
            // Theta and its slope are differences of numbers of the size of the greatest, and of that over the time.
            let noise =
                |at: &Moment| 16.0 * f64::EPSILON / v_i.min(v_f) * (1.0 / at.theta + 1.0 / (t_f * at.theta * at.v));
            return greatest(&|at| ((at.v / cubic.velocity(place(at.t / t_f)) - 1.0).abs() - noise(at)).max(0.0));
        }
        "bounded_velocity" => {
            let l = ((v_f - 1.0) / (v_i - 1.0)).ln();
            (Exponential { t_f, first: v_i - 1.0, l, shape, distance: &over_floor, rounding: 0.0 }, -t_f * t_f)
        }
        // A parabola, for which alpha is 0.
        _ if tau_ceiling == f64::INFINITY => {
            row.compare_relative("alpha", 0.0, 1.0);
            return 0.0;
        }
        _ => {
            let [first, last] = [v_i, v_f].map(|v| tau_ceiling - (1.0 + (law.a - law.b) * v.ln()));
            let rounding = (tau_ceiling.abs() + 1.0) / first.min(last);
            (Exponential { t_f, first, l: (last / first).ln(), shape, distance: &under_ceiling, rounding }, 1.0)
        }
    };
    let Some([c, noise, off]) = family.fit(followed) else { return f64::INFINITY };
    row.compare_relative("alpha", c / unit, (c.abs() + noise / row.context.rtol) / f64::abs(unit));
    off
}

/// The cubic shortcut without jumps of the velocity: theta changes as `3 x^2 - 2 x^3`.
fn smooth_cubic(&Case { transition, t_f, .. }: &Case) -> Cubic {
    let Transition { v_i, v_f, .. } = transition;
    Cubic::new(&transition, t_f, [0.0, -3.0 * (v_f - v_i) / (v_i * v_f)])
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
        "cubic" => settle("velocity", smooth_cubic(case).slack(), 1.0),
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
