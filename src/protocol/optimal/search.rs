//! The search for the extremal that takes a given time, and what is read off it.

use super::arc::Sums;
use super::extremal::{Extremal, Problem};
use super::guess::{Guess, guess};
use super::{Optimum, Strategy, floor};
use crate::numerics::elementary::exp;
use crate::numerics::root::newton_in_pieces;
use crate::protocol::{Solved, SolverStats, Status};

/// Tolerance of a quadrature whose results are to be good to `rtol`. Velocities at the ends change by up to some twenty
/// times the relative change of the time, since the time goes like the way in `ln u`.
pub(super) fn quadrature_tolerance(rtol: f64) -> f64 {
    0.02 * rtol
}

/// Steps across the seam of the family before it counts as met.
const MOST_CROSSINGS: u32 = 4;

/// Most steps that make a short hold more exact.
const MOST_REFINEMENTS: u32 = 10;

/// A relative change of a short hold after which the next one is rounding.
const SETTLED: f64 = 1e-7;

/// A relative difference of times that is rounding.
const SPENT: f64 = 4.0 * f64::EPSILON;

/// A bracket that closes on a larger change of the time holds no member of this time, but a gap of the family; unless
/// a search may end there, with a corrected step that leaves an error of third order.
const JUMP: f64 = 1e-2;

/// Fraction of the whole time below which a hold is short.
const SHORT: f64 = 0.01;

/// Fraction of `q_hold` below which parameters are counted from 0: counted from `q_hold`, a search could not distinguish them.
const NEAR: f64 = 1e-5;

/// How far from the seam, in the scaled start of the arc or in `ln v(0+)`, a protocol without time at the floor is near it.
const SEAM: f64 = 1e-3;

/// The rounding error of a velocity at the floor, relative.
pub(super) const ROUNDING: f64 = 1e-9;

/// Tightest tolerance of a quadrature.
pub(super) const FINEST: f64 = 1e-18;

/// The solution and its extremal; `None` without a solution, or without an arc after the floor.
pub(super) fn find(problem: &Problem, t_f: f64, rtol: f64) -> (Solved<Optimum>, Option<Member>) {
    find_beyond(problem, Time::since(problem, t_f), rtol)
}

/// A member of the family of extremals.
#[derive(Debug, Clone, Copy)]
pub(super) struct Member {
    pub extremal: Extremal,
    /// Its parameter, counted from `q_hold` if that is used.
    pub p: f64,
    pub q_hold: Option<f64>,
}

/// A time, and what of it is beyond the least one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Time {
    pub whole: f64,
    pub beyond: f64,
    /// The relative rounding error of `beyond`.
    pub doubt: f64,
}

impl Time {
    /// The time `t_f` of a problem.
    pub fn since(problem: &Problem, t_f: f64) -> Time {
        let beyond = t_f - problem.t_min();
        Time { whole: t_f, beyond, doubt: 2.0 * f64::EPSILON * t_f / beyond }
    }
}

/// The solution for a time beyond the least, given without cancellation.
pub(super) fn find_beyond(problem: &Problem, time: Time, rtol: f64) -> (Solved<Optimum>, Option<Member>) {
    let Time { whole: t_f, beyond, doubt } = time;
    let mut stats = SolverStats::default();
    if beyond < 0.0 || beyond.is_nan() || (beyond == 0.0 && !problem.bounded) {
        return (Solved { status: Status::Infeasible, value: None, stats }, None);
    }
    if beyond == 0.0 {
        return (shortest(problem, problem.t_min()), None);
    }
    let family = Family { q_hold: problem.q_hold().filter(|&q_hold| problem.reach(beyond) >= NEAR * q_hold.abs()) };
    let accuracy = Accuracy::new(rtol, doubt, problem.law.a);
    let Guess { p: mut start, error } = guess(problem, family.q_hold, beyond);
    let mut tolerance = (1e-3 * error).max(accuracy.exact);
    let mut last: Option<Probed> = None;
    let mut friction_min = f64::INFINITY;
    let mut probe = |p, fraction: f64| {
        let extremal = problem.extremal(p, family.q_hold)?;
        let piece = family.piece(p, extremal.time_at_floor);
        let before = last.as_ref().filter(|last| last.piece == piece).map(|last| last.value);
        let (sums, probe) = loop {
            let sums = extremal.arc.sums((tolerance * fraction).max(FINEST))?;
            stats.quadratures += 1;
            stats.nodes += sums.nodes;
            let probe = extremal.probe(problem, &sums, beyond);
            // A value within the error of its quadrature determines nothing, not even its sign.
            let doubtful = tolerance > accuracy.exact
                && (probe.value.abs() <= 30.0 * tolerance || accuracy.may_end(probe.value, before));
            let next = accuracy.next(probe.value, before);
            tolerance = if doubtful { next.min(1e-3 * tolerance).max(accuracy.exact) } else { next };
            if !doubtful {
                break (sums, probe);
            }
        };
        friction_min = friction_min.min(sums.friction_min);
        last = Some(Probed { extremal, sums, piece, value: probe.value });
        Some((probe, piece))
    };
    // What counts is the time beyond the least, which may be a small fraction of the whole.
    let fraction = beyond / t_f;
    let bracket = problem.bracket(family.q_hold, beyond);
    let mut outcome = None;
    for _ in 0..MOST_CROSSINGS {
        let root =
            newton_in_pieces(|p| probe(p, fraction), start, bracket, problem.rises(), accuracy.enough, accuracy.least);
        let found = root.and_then(|(root, piece)| Some((root.x, problem.extremal(root.x, family.q_hold)?, piece)));
        outcome = found.map(|(x, found, _)| (x, found));
        // The slope jumps where a hold begins: a last step across such a seam is taken again from the other side.
        match found {
            Some((x, found, piece)) if family.piece(x, found.time_at_floor) != piece => start = x,
            _ => break,
        }
    }
    // A short hold is a small difference of two times: more steps, as fine as the hold asks. Near the seam a protocol
    // without a hold may be one with a hold of less than the error.
    for _ in 0..MOST_REFINEMENTS {
        let Some((x, found)) = &mut outcome else { break };
        let held = found.time_at_floor > 0.0;
        let compared_with = if problem.rises() { found.start - problem.from.ln } else { *x };
        let seam = family.q_hold.filter(|_| !held && compared_with < SEAM);
        let fraction = match seam {
            Some(_) => 0.0,
            None if held && found.time_at_floor < SHORT * t_f => found.time_at_floor / t_f,
            None => break,
        };
        let Some((last, _)) = probe(*x, fraction).filter(|(last, _)| last.slope > 0.0) else { break };
        let finer = *x - last.value / last.slope;
        // The slope may be 1e5 times as large on the other side of the start of a hold: a step ends there, and goes on
        // with that side's own.
        let crosses = family.q_hold.is_some() && finer * x.signum() < 0.0;
        let finer = if crosses { f64::MIN_POSITIVE.copysign(finer) } else { finer };
        let Some(extremal) = problem.extremal(finer, family.q_hold) else { break };
        let before = found.time_at_floor;
        (*x, *found) = (finer, extremal);
        // A hold that such a step changes is not yet known to the square of that change.
        let settled = (found.time_at_floor - before).abs() <= SETTLED * before || last.value.abs() <= SPENT;
        if held == (found.time_at_floor > 0.0) && last.value.abs() <= accuracy.enough && settled && !crosses {
            break;
        }
    }
    let unique_above = problem.unique_above();
    let close = JUMP.max(10.0 * accuracy.enough).max(libm::cbrt(accuracy.least));
    let (Some((p, found)), Some(Probed { extremal: probed, sums, .. })) =
        (outcome, last.filter(|last| last.value.abs() <= close))
    else {
        let doubtful = friction_min <= unique_above || problem.is_doubtful();
        let status = if doubtful { Status::Unproven } else { Status::NotConverged };
        return (Solved { status, value: None, stats }, None);
    };

    // W* is stationary in the parameter up to C dt: the trapezium of C over the last step leaves an error of third
    // order.
    let (c_probed, c) = (probed.arc.c(), found.arc.c());
    let lag = beyond - probed.time_beyond(&sums);
    let work = probed.work(problem, &sums) - 0.5 * (c_probed + c) * lag;
    let held = found.time_at_floor > 0.0;
    let v_start = if held { 1.0 } else { exp(found.start) / problem.from.theta };
    // Just off the bound, rounding may take v(0+) below it; further below there is no protocol on the bound at all.
    let below = v_start < 1.0 - ROUNDING;
    let v_start = if problem.bounded && !below { v_start.max(1.0) } else { v_start };
    let v_end = exp(found.end) / problem.to.theta;
    let v_end = if problem.bounded && v_end > 1.0 - ROUNDING { v_end.max(1.0) } else { v_end };
    let friction = found.friction_min(problem, &sums);
    let strategy = if held {
        Strategy::Floor
    } else if v_start * problem.from.theta > 1.0 {
        Strategy::SpeedUp
    } else {
        Strategy::SlowDown
    };
    let doubtful = friction <= unique_above || (problem.bounded && below);
    if doubtful && problem.bounded && (below || velocity_range(&found)[0] < 1.0 - ROUNDING) {
        // Where friction is this low an extremal may fall below the bound on its way: then it is no protocol under it.
        return (Solved { status: Status::Unproven, value: None, stats }, None);
    }
    let status = if doubtful {
        Status::Unproven
    } else if v_start < 1.0 && !problem.bounded {
        Status::BelowBound
    } else {
        Status::Ok
    };
    let status = status.with_friction(friction);
    let value = Optimum {
        work,
        v_start,
        v_end,
        time_at_floor: found.time_at_floor,
        time_at_v_ceiling: 0.0,
        time_at_tau_ceiling: 0.0,
        hamiltonian: -c,
        theta_max: found.arc.theta_max(),
        friction_max: found.friction_max(problem),
        strategy,
    };
    (Solved { status, value: Some(value), stats }, Some(Member { extremal: found, p, q_hold: family.q_hold }))
}

/// Least and greatest velocity of the arc of an extremal: at an end, or where friction passes `b - a`, upwards for the least.
pub(super) fn velocity_range(found: &Extremal) -> [f64; 2] {
    let (pieces, law) = (found.arc.pieces(), found.arc.law);
    let look = |place: f64| {
        let here = pieces.at(place);
        let friction = 1.0 + law.a * here.ln_u + (law.b - law.a) * here.ln_theta;
        (friction - (law.b - law.a), here.ln_u - here.ln_theta)
    };
    let place = |k: u32| f64::from(k) / f64::from(PLACES);
    let mut before = look(0.0);
    let (mut least, mut greatest) = (before.1, before.1);
    for k in 1..=PLACES {
        let after = look(place(k));
        let mut seen = after.1;
        if (before.0 < 0.0) != (after.0 < 0.0) {
            let (mut low, mut high) = (place(k - 1), place(k));
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if (look(middle).0 < 0.0) == (before.0 < 0.0) { low = middle } else { high = middle }
            }
            seen = look(low).1;
        }
        least = least.min(after.1).min(seen);
        greatest = greatest.max(after.1).max(seen);
        before = after;
    }
    [exp(least), exp(greatest)]
}

/// Places at which an arc is looked at for its least velocity: friction rises through `b - a` once at the most.
const PLACES: u32 = 64;

/// Halvings of what lies between two of them: the velocity is flat there, so half of the digits of a place are enough.
const HALVINGS: u32 = 30;

/// The last probe of a search.
struct Probed {
    extremal: Extremal,
    sums: Sums,
    piece: SmoothInterval,
    value: f64,
}

/// The family in its parameter `p`, which counts from `q_hold`.
struct Family {
    q_hold: Option<f64>,
}

/// An interval of the parameter in which the time is smooth.
#[derive(Clone, Copy, PartialEq)]
struct SmoothInterval {
    /// Beyond `q_hold`.
    beyond: bool,
    /// Beyond `q = 0`.
    turned: bool,
    held: bool,
}

impl Family {
    fn piece(&self, p: f64, time_at_floor: f64) -> SmoothInterval {
        let q_hold = self.q_hold.unwrap_or(0.0);
        SmoothInterval { beyond: p > 0.0, turned: p + q_hold > 0.0, held: time_at_floor > 0.0 }
    }
}

/// The tolerance of probes.
pub(super) struct Accuracy {
    /// A value this small (relative) needs no further probe: the Newton step from there leaves an error of the order of
    /// its square.
    pub enough: f64,
    /// An error (relative) that a corrected step may leave.
    pub least: f64,
    /// Tolerance of the quadrature of the last probe.
    pub exact: f64,
}

impl Accuracy {
    pub fn new(rtol: f64, doubt: f64, a: f64) -> Accuracy {
        let enough = 1e-8 + doubt;
        // C = a v + beta goes like a times the velocities.
        Accuracy { enough, least: (0.005 * rtol).max(1e-16), exact: quadrature_tolerance(rtol) / (1.0 + a) }
    }

    /// What the step after a probe of this value, and one of the value `before` in the same piece, is expected to leave.
    fn left(value: f64, before: Option<f64>) -> f64 {
        0.5 * value * value * before.map_or(1.0, |before| (value.abs() + before.abs()).min(1.0))
    }

    /// Whether a probe of this value may be the last.
    fn may_end(&self, value: f64, before: Option<f64>) -> bool {
        value.abs() <= self.enough || (before.is_some() && Accuracy::left(value, before) <= self.least)
    }

    /// Tolerance of the probe after one of this value: as good as the step that it gives.
    fn next(&self, value: f64, before: Option<f64>) -> f64 {
        let next = Accuracy::left(value, before);
        if self.may_end(next, Some(value)) {
            return self.exact;
        }
        (0.06 * Accuracy::left(next, Some(value))).min(COARSEST).max(self.exact)
    }
}

/// Largest tolerance of a probe.
const COARSEST: f64 = 1e-4;

/// `t_f = t_min`: the hold alone.
fn shortest(problem: &Problem, t_min: f64) -> Solved<Optimum> {
    let law = problem.law;
    let friction = 1.0 + law.b * problem.from.ln;
    let status = if friction <= problem.unique_above() { Status::Unproven } else { Status::Ok };
    let status = status.with_friction(friction);
    let value = Optimum {
        work: floor::work(&law, problem.from, t_min),
        v_start: 1.0,
        v_end: 1.0,
        time_at_floor: t_min,
        time_at_v_ceiling: 0.0,
        time_at_tau_ceiling: 0.0,
        hamiltonian: -floor::c_leaving(&law, problem.to.theta, problem.to.ln),
        theta_max: problem.to.theta,
        friction_max: 1.0 + law.b * problem.to.ln,
        strategy: Strategy::Floor,
    };
    Solved { status, value: Some(value), stats: SolverStats::default() }
}
