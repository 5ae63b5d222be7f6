//! What the bounds allow: the feasible times, the least ceilings, and why a protocol is infeasible.

use super::ceiling::Ceilings;
use super::constrained::{Feasible, feasible};
use super::extremal::Problem;
use super::{ArcKind, Bounds, Obstacle, posed};
use crate::model::Transition;
use crate::numerics::elementary::{exp, ln, ln_1p};
use crate::numerics::root::crossing;

/// The least and the greatest feasible time under the bounds, each in closed form or one quadrature; the greatest is
/// infinite unless a ceiling keeps theta from rising. `None` where no time is feasible.
pub fn feasible_times(transition: &Transition, bounds: impl Into<Bounds>) -> Option<(f64, f64)> {
    let (problem, ceilings) = posed(transition, 1.0, &bounds.into())?;
    match feasible(&problem, &ceilings) {
        Feasible::Times(least, most) => Some((least, most)),
        Feasible::Sitting(least) => Some((least, f64::INFINITY)),
        Feasible::Never(_) => None,
    }
}

/// Why a protocol is infeasible; `None` for a feasible one.
pub fn obstacle(transition: &Transition, t_f: f64, bounds: impl Into<Bounds>) -> Option<Obstacle> {
    let Some((problem, ceilings)) = posed(transition, t_f, &bounds.into()) else { return Some(Obstacle::Domain) };
    let (t_least, t_most) = match feasible(&problem, &ceilings) {
        Feasible::Times(least, most) => (least, most),
        Feasible::Sitting(least) => (least, f64::INFINITY),
        Feasible::Never(ArcKind::VCeiling) => {
            return Some(Obstacle::VCeiling { above: lowest_v(&problem, transition) });
        }
        Feasible::Never(_) => return Some(Obstacle::TauCeiling { above: lowest_tau(&problem) }),
    };
    if t_f < t_least || (t_f == t_least && !problem.bounded && problem.rises()) {
        Some(Obstacle::TooFast { t_least })
    } else {
        (t_f > t_most).then_some(Obstacle::TooSlow { t_most })
    }
}

/// No ceiling of the velocity below this one is feasible.
fn lowest_v(problem: &Problem, transition: &Transition) -> f64 {
    match (problem.rises(), problem.bounded) {
        (false, _) => transition.v_f,
        (true, true) => 1.0,
        (true, false) => 0.0,
    }
}

/// No ceiling of friction below this one is feasible.
fn lowest_tau(problem: &Problem) -> f64 {
    match (problem.rises(), problem.bounded) {
        (false, _) => problem.friction_a().max(problem.friction_end()),
        (true, true) => 1.0 + problem.law.b * problem.to.ln,
        (true, false) => f64::NEG_INFINITY,
    }
}

/// The least ceiling of the velocity that allows `t_f`, with the other bounds as they are; `None` where no ceiling does.
pub fn least_v_ceiling(transition: &Transition, t_f: f64, bounds: impl Into<Bounds>, rtol: f64) -> Option<f64> {
    let (problem, ceilings) = posed(transition, t_f, &bounds.into().with_v_ceiling(f64::INFINITY))?;
    let v_f = transition.v_f;
    // A ceiling by its distance from v_f.
    let above = |distance: f64| Ceilings { v: v_f + distance, z_v: ln_1p(distance / v_f), ..ceilings };
    let lowest = lowest_v(&problem, transition);
    let search = Least { problem: &problem, t_f, rtol };
    match feasible(&problem, &ceilings) {
        Feasible::Never(_) => None,
        Feasible::Times(least, most) if t_f < least || t_f > most => None,
        _ if problem.fall == 0.0 => Some(v_f),
        _ if problem.rises() => Some(v_f - search.distance(v_f - lowest, |distance| above(-distance))),
        _ => Some(v_f + search.distance(f64::INFINITY, above)),
    }
}

/// The least ceiling of friction that allows `t_f`, with the other bounds as they are; `None` where no ceiling does.
pub fn least_tau_ceiling(transition: &Transition, t_f: f64, bounds: impl Into<Bounds>, rtol: f64) -> Option<f64> {
    let (problem, ceilings) = posed(transition, t_f, &bounds.into().with_tau_ceiling(f64::INFINITY))?;
    let [start, end] = [&problem.from, &problem.to].map(|at| 1.0 + (problem.law.b - problem.law.a) * at.ln);
    let edge = if problem.rises() { start.min(end) } else { start.max(end) };
    // A ceiling by its distance from the friction of steady sliding.
    let above =
        |distance: f64| Ceilings { tau: edge + distance, z_tau: ((edge - end) + distance) / problem.law.a, ..ceilings };
    let lowest = lowest_tau(&problem);
    let search = Least { problem: &problem, t_f, rtol };
    match feasible(&problem, &ceilings) {
        Feasible::Never(_) => None,
        Feasible::Times(least, most) if t_f < least || t_f > most => None,
        _ if problem.fall == 0.0 => Some(edge),
        _ if problem.rises() => Some(edge - search.distance(edge - lowest, |distance| above(-distance))),
        _ => Some(edge + search.distance(f64::INFINITY, above)),
    }
}

/// The search for the least ceiling.
struct Least<'a> {
    problem: &'a Problem,
    t_f: f64,
    rtol: f64,
}

impl Least<'_> {
    /// Distance, up to `most`, from a ceiling of infinite time at which the limit of the time is `t_f`; the time falls with
    /// the distance.
    fn distance(&self, most: f64, ceilings: impl Fn(f64) -> Ceilings) -> f64 {
        let beyond = |ln_distance: f64| {
            let time = match feasible(self.problem, &ceilings(exp(ln_distance))) {
                Feasible::Times(least, most) => {
                    if self.problem.rises() {
                        most
                    } else {
                        least
                    }
                }
                Feasible::Sitting(_) => f64::INFINITY,
                Feasible::Never(_) => 0.0,
            };
            ln(time.clamp(TINY, HUGE) / self.t_f)
        };
        if most <= 0.0 {
            return most;
        }
        let mut high = if most.is_finite() { ln(most) } else { 0.0 };
        let mut at_high = beyond(high);
        let mut step = 1.0;
        while most.is_infinite() && at_high > 0.0 && high < FARTHEST {
            (high, step) = (high + step, 2.0 * step);
            at_high = beyond(high);
        }
        if at_high >= 0.0 {
            return exp(high);
        }
        let (mut low, mut at_low) = (high - 1.0, beyond(high - 1.0));
        step = 1.0;
        while at_low < 0.0 {
            if low < NEAREST {
                return 0.0;
            }
            (high, at_high) = (low, at_low);
            (low, step) = (low - step, 2.0 * step);
            at_low = beyond(low);
        }
        exp(crossing(beyond, [high, low], [at_high, at_low], 0.01 * self.rtol))
    }
}

/// Range of times whose logarithm is taken.
const TINY: f64 = 1e-300;
const HUGE: f64 = 1e300;

/// Logarithms of the greatest and the least distance.
const FARTHEST: f64 = 600.0;
const NEAREST: f64 = -700.0;
