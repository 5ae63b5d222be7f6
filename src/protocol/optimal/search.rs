//! The search for the extremal that takes a given time, and what is read off it.

use super::arc::{Sums, phi};
use super::extremal::{Extremal, Problem};
use super::{Optimum, Strategy, hold};
use crate::numerics::elementary::{exp, ln, ln_1p};
use crate::numerics::root::{Root, newton};
use crate::numerics::turning::turning;
use crate::protocol::{Effort, Solved, Status};

/// A probe this close to the wanted time (relative) is the last: the Newton step from it leaves an error of the order
/// of its square.
const ENOUGH: f64 = 1e-8;

/// Tolerance of a quadrature whose results are to be good to `rtol`. Velocities at the ends change by up to some twenty
/// times the relative change of the time, since the time goes like the way in `ln u`.
pub(super) fn quadrature_tolerance(rtol: f64) -> f64 {
    0.02 * rtol
}

/// Steps across the seam of the family before it counts as met.
const MOST_CROSSINGS: u32 = 4;

/// Share of the whole time below which a hold is short.
const SHORT: f64 = 0.01;

/// How far rounding may take a velocity off the bound.
const ROUNDING: f64 = 1e-9;

/// No quadrature is asked for more than this.
const FINEST: f64 = 1e-18;

/// Solves `problem` in time `t_f` to relative accuracy `rtol`.
pub(super) fn solve(problem: &Problem, t_f: f64, rtol: f64) -> Solved<Optimum> {
    find(problem, t_f, rtol).0
}

/// The same, with the extremal; `None` where there is no solution, or no arc beside the hold.
pub(super) fn find(problem: &Problem, t_f: f64, rtol: f64) -> (Solved<Optimum>, Option<Extremal>) {
    let mut effort = Effort::default();
    let t_min = problem.t_min();
    let beyond = t_f - t_min;
    if beyond < 0.0 || beyond.is_nan() || (beyond == 0.0 && !problem.bounded) {
        return (Solved { status: Status::Infeasible, value: None, effort }, None);
    }
    if beyond == 0.0 {
        return (shortest(problem, t_min), None);
    }
    let q_hold = problem.q_hold();
    // The time beyond the least is known no better than t_f itself is.
    let enough = ENOUGH + 2.0 * f64::EPSILON * t_f / beyond;
    let mut last: Option<(Extremal, Sums)> = None;
    let mut friction_min = f64::INFINITY;
    // Early probes only need to be as good as the step that they give.
    let mut tolerance = 1e-3f64;
    let exact = quadrature_tolerance(rtol);
    // What counts is the time beyond the least, which may be a small share of the whole.
    let share = beyond / t_f;
    let mut probe = |q, share: f64| {
        let extremal = problem.extremal(q, q_hold)?;
        let (sums, probe) = loop {
            let sums = extremal.arc.sums((tolerance * share).max(FINEST))?;
            effort.quadratures += 1;
            effort.nodes += sums.nodes;
            let probe = extremal.probe(problem, &sums, beyond);
            let next = (1e-3 * probe.value * probe.value).clamp(exact, tolerance);
            // A value within the error of its quadrature tells nothing, not even its sign.
            let doubtful = tolerance > exact && probe.value.abs() <= (30.0 * tolerance).max(enough);
            tolerance = if doubtful { next.min(1e-3 * tolerance).max(exact) } else { next };
            if !doubtful {
                break (sums, probe);
            }
        };
        friction_min = friction_min.min(sums.friction_min);
        last = Some((extremal, sums));
        Some(probe)
    };
    let bracket = problem.bracket(q_hold, beyond);
    let mut start = guess(problem, q_hold, beyond);
    let mut root = None;
    for _ in 0..MOST_CROSSINGS {
        root = newton(|q| probe(q, share), start, bracket, problem.rises(), enough);
        // The slope jumps where the hold begins: a last step across that seam is taken again from the other side.
        match (&root, q_hold) {
            (Some(root), Some(_)) if (root.probed < 0.0) != (root.x < 0.0) => start = root.x,
            _ => break,
        }
    }
    if let Some(root) = &mut root
        && let Some(held) = problem.extremal(root.x, q_hold).map(|found| found.hold_time)
        && held > 0.0
        && held < SHORT * t_f
        && let Some(last) = probe(root.x, held / t_f)
        && last.slope > 0.0
    {
        // A short hold is a small difference of two times: one more step, as fine as the hold asks.
        *root = Root { x: root.x - last.value / last.slope, probed: root.x, probe: last };
    }
    let unique_above = problem.unique_above();
    let unsolved = |effort| {
        let doubtful = friction_min <= unique_above || problem.is_doubtful();
        let status = if doubtful { Status::Nonphysical } else { Status::NotConverged };
        (Solved { status, value: None, effort }, None)
    };
    let (Some(root), Some((probed, sums))) = (root, last) else { return unsolved(effort) };
    let Some(found) = problem.extremal(root.x, q_hold) else { return unsolved(effort) };

    // W* is stationary in the parameter up to C dt: the trapezium of C over the last step leaves an error of third
    // order.
    let (c_probed, c) = (probed.arc.c(), found.arc.c());
    let lag = beyond - probed.time_beyond(problem, &sums);
    let work = probed.work(problem, &sums) - 0.5 * (c_probed + c) * lag;
    let held = found.hold_time > 0.0;
    let v_start = if held { 1.0 } else { exp(found.start.ln_u) / problem.from.theta };
    // Just off the bound, rounding may take v(0+) below it; further below there is no protocol on the bound at all.
    let below = v_start < 1.0 - ROUNDING;
    let v_start = if problem.bounded && !below { v_start.max(1.0) } else { v_start };
    let v_end = exp(found.end.ln_u) / problem.to.theta;
    let friction = found.friction_min(problem, &sums);
    let strategy = if held {
        Strategy::Hold
    } else if v_start * problem.from.theta > 1.0 {
        Strategy::SpeedUp
    } else {
        Strategy::SlowDown
    };
    let status = if friction <= unique_above || (problem.bounded && below) {
        Status::Nonphysical
    } else if v_start < 1.0 && !problem.bounded {
        Status::BelowBound
    } else {
        Status::Ok
    };
    let value = Optimum {
        work,
        v_start,
        v_end,
        hold_time: found.hold_time,
        hamiltonian: -c,
        theta_max: found.arc.theta_max(),
        strategy,
    };
    (Solved { status, value: Some(value), effort }, Some(found))
}

/// `t_f = t_min`: the hold alone.
fn shortest(problem: &Problem, t_min: f64) -> Solved<Optimum> {
    let law = problem.law;
    let friction = 1.0 + law.b * problem.from.ln();
    let status = if friction <= problem.unique_above() { Status::Nonphysical } else { Status::Ok };
    let value = Optimum {
        work: hold::work(&law, problem.from, t_min),
        v_start: 1.0,
        v_end: 1.0,
        hold_time: t_min,
        hamiltonian: -hold::c_leaving(&law, problem.to.theta, problem.to.ln()),
        theta_max: problem.to.theta,
        strategy: Strategy::Hold,
    };
    Solved { status, value: Some(value), effort: Effort::default() }
}

/// A first parameter, counted from `q_hold`. For `b = a` time is linear in `ln u` along an arc; that line, `v = const` for very short times,
/// and a hold for long ones come close.
fn guess(problem: &Problem, q_hold: Option<f64>, beyond: f64) -> f64 {
    let law = problem.law;
    let friction = problem.friction_a();
    let origin = q_hold.unwrap_or(0.0);
    let held = |z_start: f64| {
        // An arc that leaves the bound at the anchor comes back to it with the same E.
        let z_end = turning((2.0 * phi(z_start)).sqrt()).ln_u;
        law.a * (z_end - z_start) / friction
    };
    if problem.rises() {
        let arc = problem.to.theta * held(problem.to.ln());
        return match q_hold {
            Some(_) if beyond > arc => (beyond - arc) / problem.theta_a(),
            _ => -origin,
        };
    }
    let e = ((problem.friction_end() - friction / (1.0 + problem.fall)) / law.a).max(0.0);
    let z_end = turning((2.0 * e).sqrt()).ln_u;
    let z_start = z_end - beyond * friction / (law.a * problem.from.theta);
    if z_start > 0.0 {
        let fast = problem.from.theta * ln_1p(problem.fall) / beyond;
        z_start.max(ln(fast) - 1.5) - origin
    } else {
        let q = -(2.0 * phi(z_start)).sqrt();
        match q_hold {
            Some(q_hold) if q < q_hold => {
                let arc = problem.from.theta * law.a * (z_end - problem.from.ln()) / friction;
                -(beyond - arc).max(0.0) / problem.theta_a()
            }
            _ => q - origin,
        }
    }
}
