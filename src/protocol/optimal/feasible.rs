//! What the bounds allow: the feasible times, the least ceilings, and why a protocol is infeasible.

use super::ceiling::{Ceilings, ln_ratio};
use super::constrained::{Feasible, feasible};
use super::extremal::Problem;
use super::{ArcKind, Bounds, Obstacle, posed};
use crate::model::Transition;
use crate::numerics::elementary::{exp, ln};
use crate::numerics::{MAX_LN, MIN_INVERTIBLE};

/// The least and the greatest feasible time under the bounds, each in closed form or one quadrature; the greatest is
/// infinite unless a ceiling keeps theta from rising. `None` where no time is feasible.
pub fn feasible_times(transition: &Transition, bounds: impl Into<Bounds>) -> Option<(f64, f64)> {
    let (problem, ceilings) = posed(transition, 1.0, &bounds.into())?;
    feasible(&problem, &ceilings).times()
}

/// Time of an acceleration with friction at its ceiling throughout, a jump without one; `None` where friction at an end is above it.
pub fn acceleration_time_at_ceiling(transition: &Transition, tau_ceiling: f64) -> Option<f64> {
    let (problem, &Transition { law, v_i, v_f }) = (Problem::between(transition, false), transition);
    let bounds = Bounds::new(false).with_tau_ceiling(tau_ceiling);
    if tau_ceiling == f64::INFINITY {
        return Some(0.0);
    }
    Some(feasible(&problem, &Ceilings::new(law, [v_i, v_f], problem.depth(), &bounds)).times()?.0)
}

/// Why a protocol is infeasible; `None` for a feasible one.
pub fn obstacle(transition: &Transition, t_f: f64, bounds: impl Into<Bounds>) -> Option<Obstacle> {
    let Some((problem, ceilings)) = posed(transition, t_f, &bounds.into()) else { return Some(Obstacle::Domain) };
    let found = feasible(&problem, &ceilings);
    if let Feasible::Never(kind) = found {
        return Some(if kind == ArcKind::VCeiling {
            Obstacle::VCeiling { above: lowest_v(&problem, transition) }
        } else {
            Obstacle::TauCeiling { above: lowest_tau(&problem) }
        });
    }
    let (t_least, t_most) = found.times()?;
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
    let &Transition { v_i, v_f, .. } = transition;
    let lowest = lowest_v(&problem, transition);
    let at = |place: f64| {
        let distance = exp(place);
        let v = lowest + distance;
        let z = |steady: f64| ln_ratio(v, (lowest - steady) + distance, steady);
        let z_start = [z(v_i), ceilings.z_start[1]];
        (v, Ceilings { v, z_v: z(v_f), z_start, ..ceilings })
    };
    least(&problem, t_f, &ceilings, v_f, || root(&problem, t_f, [0.0, 1.0], rtol, at))
}

/// The least ceiling of friction that allows `t_f`, with the other bounds as they are; `None` where no ceiling does.
pub fn least_tau_ceiling(transition: &Transition, t_f: f64, bounds: impl Into<Bounds>, rtol: f64) -> Option<f64> {
    let (problem, ceilings) = posed(transition, t_f, &bounds.into().with_tau_ceiling(f64::INFINITY))?;
    let (a, start, end) = (problem.law.a, problem.friction_start(), problem.friction_end());
    let lowest = lowest_tau(&problem);
    let steady = problem.friction_start().max(end);
    let least = |root: &dyn Fn() -> f64| least(&problem, t_f, &ceilings, steady, root);
    if lowest.is_finite() {
        let at = |place: f64| {
            let distance = exp(place);
            let z = |steady: f64| ((lowest - steady) + distance) / a;
            let z_start = [ceilings.z_start[0], z(start)];
            (lowest + distance, Ceilings { tau: lowest + distance, z_tau: z(end), z_start, ..ceilings })
        };
        return least(&|| root(&problem, t_f, [ln(a), 1.0], rtol, at));
    }
    // Without the floor nothing bounds it from below.
    let at = |z_tau: f64| {
        let z_start = [ceilings.z_start[0], z_tau + ceilings.kappa * ceilings.depth];
        (end + a * z_tau, Ceilings { tau: end + a * z_tau, z_tau, z_start, ..ceilings })
    };
    least(&|| root(&problem, t_f, [0.0, 1.0], rtol * (1.0 / a).min(1.0), at))
}

/// The least ceiling, found by `root`, unless no ceiling allows `t_f`, or steady sliding on the ceiling does.
fn least(problem: &Problem, t_f: f64, without: &Ceilings, steady: f64, root: impl FnOnce() -> f64) -> Option<f64> {
    let (least, most) = feasible(problem, without).times()?;
    if t_f < least || t_f > most {
        return None;
    }
    Some(if problem.fall == 0.0 { steady } else { root() })
}

/// The ceiling, by a place that rises with it, on which the limit of the time is `t_f`; the search starts at a place with a
/// step.
fn root(
    problem: &Problem,
    t_f: f64,
    [start, mut step]: [f64; 2],
    rtol: f64,
    at: impl Fn(f64) -> (f64, Ceilings),
) -> f64 {
    // Above 0 where the ceiling allows `t_f`.
    let room = |place: f64| match feasible(problem, &at(place).1) {
        Feasible::Times(least, _) if !problem.rises() => -ln(least.clamp(MIN_INVERTIBLE, 1.0 / MIN_INVERTIBLE) / t_f),
        Feasible::Times(_, most) => ln(most.clamp(MIN_INVERTIBLE, 1.0 / MIN_INVERTIBLE) / t_f),
        Feasible::Sitting(_) => ln(1.0 / MIN_INVERTIBLE),
        Feasible::Never(_) => ln(MIN_INVERTIBLE),
    };
    let mut low = (start, room(start));
    let mut high = low;
    let first = step;
    while high.1 < 0.0 {
        if high.0 > MAX_LN {
            return at(high.0).0;
        }
        low = high;
        high = (high.0 + step, room(high.0 + step));
        step *= 2.0;
    }
    step = first;
    while low.1 >= 0.0 {
        if low.0 < -MAX_LN {
            return at(low.0).0;
        }
        high = low;
        low = (low.0 - step, room(low.0 - step));
        step *= 2.0;
    }
    at(zero_of_rising(room, low, high, 0.1 * rtol)).0
}

/// The zero of a rising function between two places with their values, to `resolution`: the Illinois method (Dowell and
/// Jarratt, BIT 11, 168, 1971), which ends once values on both sides are that close, with bisections where it lags.
fn zero_of_rising(f: impl Fn(f64) -> f64, mut low: (f64, f64), mut high: (f64, f64), resolution: f64) -> f64 {
    let (mut at_low, mut at_high) = (low.1, high.1);
    for step in 0.. {
        let width = high.0 - low.0;
        let secant = (high.0 - at_high * width / (at_high - at_low)).max(low.0).min(high.0);
        // The side that has not moved is evaluated close to the zero.
        let x = match step % 3 {
            2 => low.0 + 0.5 * width,
            _ if secant - low.0 < resolution => low.0 + 0.5 * resolution,
            _ if high.0 - secant < resolution => high.0 - 0.5 * resolution,
            _ => secant,
        };
        if width <= resolution || !(x > low.0 && x < high.0) {
            return secant;
        }
        let value = f(x);
        if value < 0.0 {
            (low, at_low, at_high) = ((x, value), value, 0.5 * at_high);
        } else {
            (high, at_high, at_low) = ((x, value), value, 0.5 * at_low);
        }
        (at_low, at_high) = if step % 3 == 2 { (low.1, high.1) } else { (at_low, at_high) };
    }
    high.0
}
