//! The optimum under ceilings: the free one where it obeys them, else the clamped extremal of the same family that takes
//! the given time.

use std::cell::Cell;

use super::arc::{greatest_friction, least_friction, phi};
use super::ceiling::Ceilings;
use super::clamp::{Path, PathSums, Piece, Switch, whole};
use super::extremal::Problem;
use super::lifetime::Lifetime;
use super::search::{self, Accuracy, FINEST, Member, ROUNDING, Time};
use super::{ArcKind, Optimum, Strategy, floor};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::root::{Probe, newton_in_pieces};
use crate::numerics::turning::turning;
use crate::protocol::{Solved, SolverStats, Status};

/// What the bounds allow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Feasible {
    /// Times from the first to the second.
    Times(f64, f64),
    /// Theta cannot come back from above `theta_1`; times from this one.
    Sitting(f64),
    /// No time: the ceiling of this kind is too low.
    Never(ArcKind),
}

/// What the ceilings allow, without iteration.
pub(super) fn feasible(problem: &Problem, ceilings: &Ceilings) -> Feasible {
    let depth = ln_1p(problem.fall);
    let (cap_end, cap_start) = (ceilings.cap(0.0), ceilings.cap(depth));
    let kind = |y: f64| if y < ceilings.crossing() { ArcKind::VCeiling } else { ArcKind::TauCeiling };
    if !problem.rises() {
        let steady = depth == 0.0;
        return match cap_end.min(cap_start) {
            cap if cap > 0.0 => Feasible::Times(time_on(ceilings, problem.from.theta, depth, 0.0), f64::INFINITY),
            0.0 if steady => Feasible::Sitting(0.0),
            _ => Feasible::Never(kind(if cap_end <= cap_start { 0.0 } else { depth })),
        };
    }
    if problem.bounded {
        // The floor itself.
        if ceilings.v < 1.0 {
            return Feasible::Never(ArcKind::VCeiling);
        }
        if ceilings.tau < 1.0 + problem.law.b * problem.to.ln {
            return Feasible::Never(ArcKind::TauCeiling);
        }
    }
    let t_min = problem.t_min();
    if cap_end == 0.0 {
        return Feasible::Sitting(t_min);
    }
    if cap_end > 0.0 || lingering(ceilings, depth).is_some() {
        return Feasible::Times(t_min, f64::INFINITY);
    }
    Feasible::Times(t_min, time_on(ceilings, problem.to.theta, 0.0, depth))
}

/// Time on the ceilings between two places, the first of greater theta.
fn time_on(ceilings: &Ceilings, theta_hi: f64, y_hi: f64, y_lo: f64) -> f64 {
    ceilings.arcs(theta_hi, y_hi, y_lo).iter().flatten().fold(0.0, |time, arc| time + arc.time())
}

/// Where steady sliding on the ceiling of friction is possible above `depth`, for a problem that ends below it: time then
/// has no upper limit.
fn lingering(ceilings: &Ceilings, depth: f64) -> Option<f64> {
    let y = -ceilings.z_tau / ceilings.kappa;
    (ceilings.kappa < 0.0 && ceilings.z_tau < 0.0 && y >= depth && ceilings.z_v + y >= 0.0).then_some(y)
}

/// A solved problem: the path, and how long it then slides at the final velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct Constrained {
    pub solved: Solved<Optimum>,
    pub path: Option<Path>,
    /// Time of steady sliding at the end.
    pub sitting: f64,
}

impl Constrained {
    fn without_numbers(status: Status, stats: SolverStats) -> Constrained {
        Constrained { solved: Solved { status, value: None, stats }, path: None, sitting: 0.0 }
    }
}

/// Solves `problem` in `time` under the ceilings.
pub(super) fn find(problem: &Problem, ceilings: &Ceilings, time: Time, rtol: f64) -> Constrained {
    let (free, member) = search::find_beyond(problem, time, rtol);
    let none = ceilings.v == f64::INFINITY && ceilings.tau == f64::INFINITY;
    // The velocity rises along an arc unless friction is so low that the extremal is not proven to be the least.
    let proven = matches!(free.status, Status::Ok | Status::BelowBound);
    let peak = |member: Member| if proven { 0.0 } else { search::velocity_range(&member.extremal)[1] };
    let obeys = |optimum: Optimum| {
        let greatest = optimum.v_start.max(optimum.v_end);
        greatest <= ceilings.v && optimum.friction_max <= ceilings.tau && member.map_or(0.0, peak) <= ceilings.v
    };
    if none || free.value.is_some_and(obeys) {
        let path = member.map(|member| {
            let mut path = Path::new(member.extremal);
            path.push(whole(problem, &member.extremal));
            path
        });
        return Constrained { solved: free, path, sitting: 0.0 };
    }
    let stats = free.stats;
    if free.status == Status::Infeasible {
        return Constrained::without_numbers(Status::Infeasible, stats);
    }
    let t_f = time.whole;
    match feasible(problem, ceilings) {
        Feasible::Never(_) => Constrained::without_numbers(Status::Infeasible, stats),
        Feasible::Times(least, most) if t_f < least || t_f > most => {
            Constrained::without_numbers(Status::Infeasible, stats)
        }
        Feasible::Sitting(_) => sitting(problem, ceilings, t_f, rtol, stats),
        // Without ceilings an extremal falls below the floor: friction is too low for the family to be ordered.
        _ if free.value.is_none() && free.status == Status::Unproven => {
            Constrained::without_numbers(Status::Unproven, stats)
        }
        Feasible::Times(least, most) => {
            let (quadratures, nodes) = (Cell::new(0), Cell::new(0));
            let search = Search { problem, ceilings, t_f, least, most, rtol, stats, quadratures, nodes };
            search.solve(member.as_ref())
        }
    }
}

/// The optimum of the time of the turn, then steady sliding.
fn sitting(problem: &Problem, ceilings: &Ceilings, t_f: f64, rtol: f64, mut stats: SolverStats) -> Constrained {
    let law = problem.law;
    let v = 1.0 / problem.to.theta;
    let friction = problem.friction_end();
    let c = -friction / problem.to.theta;
    let of_v = ceilings.z_v == 0.0;
    let mut path = None;
    let mut value = Optimum {
        work: 0.0,
        v_start: v,
        v_end: v,
        time_at_floor: 0.0,
        time_at_v_ceiling: 0.0,
        time_at_tau_ceiling: 0.0,
        hamiltonian: -c,
        theta_max: problem.to.theta,
        friction_max: friction,
        strategy: Strategy::SlowDown,
    };
    let mut sat = t_f;
    let mut least = friction;
    if problem.rises() {
        let tolerance = search::quadrature_tolerance(rtol);
        let turn = problem.extremal(0.0, None).and_then(|extremal| Some((extremal, extremal.arc.sums(tolerance)?)));
        let Some((extremal, sums)) = turn else {
            return Constrained::without_numbers(Status::NotConverged, stats);
        };
        stats.quadratures += 1;
        stats.nodes += sums.nodes;
        sat -= extremal.time(&sums);
        least = extremal.friction_min(problem, &sums);
        let held = extremal.time_at_floor > 0.0;
        value.work = extremal.work(problem, &sums);
        value.v_start = if held { 1.0 } else { exp(extremal.start) / problem.from.theta };
        value.time_at_floor = extremal.time_at_floor;
        value.friction_max = extremal.friction_max(problem).max(friction);
        value.strategy = if held { Strategy::Floor } else { Strategy::SlowDown };
        let mut whole_path = Path::new(extremal);
        whole_path.push(whole(problem, &extremal));
        path = Some(whole_path);
    }
    let sat = sat.max(0.0);
    value.work += sat * friction * v;
    if of_v {
        value.time_at_v_ceiling = sat
    } else {
        value.time_at_tau_ceiling = sat
    }
    let doubtful = least <= (law.b - law.a).max(0.0);
    let status = if doubtful { Status::Unproven } else { Status::Ok };
    let below = !problem.bounded && value.v_start < 1.0 && status == Status::Ok;
    let status = if below { Status::BelowBound } else { status }.with_friction(least);
    Constrained { solved: Solved { status, value: Some(value), stats }, path, sitting: sat }
}

/// The search for the clamped extremal that takes the time `t_f`.
struct Search<'a> {
    problem: &'a Problem,
    ceilings: &'a Ceilings,
    t_f: f64,
    /// The least and the greatest time.
    least: f64,
    most: f64,
    rtol: f64,
    stats: SolverStats,
    /// Of this search.
    quadratures: Cell<u32>,
    nodes: Cell<u32>,
}

/// What a probe found.
struct Probed {
    path: Path,
    sums: PathSums,
    probe: Probe,
}

/// An interval of a parameter, with a first guess.
struct Interval {
    start: f64,
    bracket: (f64, f64),
    /// Whether time rises with the parameter.
    rises: bool,
}

impl Search<'_> {
    fn solve(mut self, free: Option<&Member>) -> Constrained {
        let (problem, ceilings) = (self.problem, self.ceilings);
        if ceilings.cap(0.0) < 0.0 {
            return self.rising();
        }
        let q_hold = match free {
            Some(member) => member.q_hold,
            None => problem.q_hold(),
        };
        if let Some(found) = self.lingering() {
            return found;
        }
        let member = |p: f64| Path::clamped(problem, ceilings, problem.extremal(p, q_hold)?);
        let (low, high) = problem.bracket(q_hold, self.t_f);
        let origin = q_hold.unwrap_or(0.0);
        let interval = if problem.rises() {
            // From the member that turns at its end.
            let high = free.map_or(high, |free| free.p + MARGIN);
            Interval { start: free.map_or(-origin, |free| free.p), bracket: (-origin, high), rises: true }
        } else {
            let most = self.all_on_ceilings() + MARGIN - origin;
            let low = free.map_or(low, |free| free.p - MARGIN);
            Interval {
                start: free.map_or(0.5 * (low + most), |free| free.p),
                bracket: (low, most.min(high)),
                rises: false,
            }
        };
        self.search(member, interval)
    }

    /// `ln u` of the free extremal at the start where all of it is on the ceilings: the largest `C` at which the ceilings
    /// are left.
    fn all_on_ceilings(&self) -> f64 {
        let (problem, ceilings) = (self.problem, self.ceilings);
        let Law { a, b } = problem.law;
        let depth = ln_1p(problem.fall);
        let friction_0 = problem.friction_a();
        // theta_0 (C - C_0) at a place, and a E(theta_0) there.
        let excess = |y: f64| {
            let friction = friction_0 - (b - a) * (depth - y);
            (a * phi(ceilings.cap(y)) - friction) * exp(depth - y) + friction_0
        };
        let start = ceilings.cap(depth);
        let mut most = a * phi(start);
        let mut z_0 = start;
        let peak = (ln((ceilings.tau + a) / b) - ceilings.z_tau) / ceilings.kappa;
        for y in [0.0, ceilings.crossing(), peak] {
            if (0.0..depth).contains(&y) && excess(y) > most {
                most = excess(y);
                z_0 = turning((2.0 * most / a).sqrt()).ln_u;
            }
        }
        if z_0.is_finite() { z_0 } else { MOST_LN_U }
    }

    /// The optimum that lingers before it turns, close to steady sliding on the ceiling of friction; `None` where it turns
    /// well before.
    fn lingering(&mut self) -> Option<Constrained> {
        let (problem, ceilings) = (self.problem, self.ceilings);
        let slope = -ceilings.kappa;
        if slope <= 0.0 || !ceilings.tau.is_finite() {
            return None;
        }
        // ln(theta_c/theta_1), and below the end of greater theta.
        let y_c = ceilings.z_tau / slope;
        let above = y_c - ln_1p(problem.fall).max(0.0);
        let ln_theta_c = problem.to.ln + y_c;
        if above <= 0.0 || (problem.bounded && ln_theta_c >= 0.0) || ceilings.z_v + y_c <= 0.0 {
            return None;
        }
        let far = 0.5 * above;
        let member = |ln_delta: f64| {
            let delta = exp(ln_delta);
            let turn = lifetime(ln_theta_c - delta);
            let extremal = problem.turning_at(turn, y_c - delta, -delta)?;
            Path::lingering(problem, ceilings, extremal, ln_delta)
        };
        let tolerance = search::quadrature_tolerance(self.rtol);
        let nearest = member(ln(far)).and_then(|path| path.sums(tolerance));
        if nearest.is_none_or(|sums| sums.time >= self.t_f) {
            return None;
        }
        let start = ln(far) - 1.0;
        let interval = Interval { start, bracket: (f64::NEG_INFINITY, ln(far)), rises: false };
        Some(self.search(member, interval))
    }

    /// Theta rises to the end, last on a ceiling: the parameter is where the ceiling begins.
    fn rising(&mut self) -> Constrained {
        let (problem, ceilings) = (self.problem, self.ceilings);
        let whole_way = -ln_1p(problem.fall);
        if let Some(y) = lingering(ceilings, -whole_way) {
            let slope = -ceilings.kappa;
            // z at the switch is e^-s of what it is at the end.
            let member = |s: f64| {
                let z = ceilings.z_tau * exp(-s);
                let way = (ceilings.z_tau * exp_m1(-s) / slope).min(-y);
                let ln_z = Some(ln(-ceilings.z_tau) - s);
                Path::rising(problem, ceilings, Switch { way, z, ln_z, rise: ceilings.kappa, pace_over_z: 1.0 / slope })
            };
            let interval = Interval { start: 1.0, bracket: (0.0, f64::INFINITY), rises: true };
            return self.search(member, interval);
        }
        let member = |way: f64| {
            let of_v = -way < ceilings.crossing();
            let (kind, rise) = if of_v { (ArcKind::VCeiling, 1.0) } else { (ArcKind::TauCeiling, ceilings.kappa) };
            let z = ceilings.cap_of(kind, -way);
            Path::rising(problem, ceilings, Switch { way, z, ln_z: None, rise, pace_over_z: -1.0 / z })
        };
        let interval = Interval { start: 0.5 * whole_way, bracket: (0.0, whole_way), rises: true };
        self.search(member, interval)
    }

    /// The member of a family that takes the time.
    fn search(&mut self, member: impl Fn(f64) -> Option<Path>, interval: Interval) -> Constrained {
        let Search { problem, t_f, least, most, rtol, .. } = *self;
        let room = (t_f - least).min(most - t_f);
        let doubt = 4.0 * f64::EPSILON * t_f / room;
        let exact = Accuracy::new(rtol, doubt, problem.law.a).exact * (room / t_f).min(1.0);
        let (low, high) = interval.bracket;
        let (mut tolerance, mut enough, mut start) = (exact.max(FINEST), ENOUGH + doubt, interval.start);
        let mut found = None;
        for _ in 0..MOST_SEARCHES {
            let probe = |p: f64, tolerance: f64| self.probe(member(p)?, tolerance, interval.rises);
            let probe_piece = |p: f64| probe(p, tolerance).map(|probed| (probed.probe, probed.path.signature()));
            let root = newton_in_pieces(probe_piece, start, interval.bracket, interval.rises, enough, enough * enough);
            // The last probe is fine enough for most short arcs as well.
            let last = (LAST * tolerance).max(FINEST);
            let Some((x, probed)) = root.and_then(|(root, _)| Some((root.x, probe(root.x, last)?))) else { break };
            let Probe { value, slope } = probed.probe;
            let step = if slope > 0.0 { value / slope } else { 0.0 };
            let Some(path) = member((x - step).max(low).min(high)) else { break };
            // Short arcs on a ceiling change much with the parameter, those at a peak of friction by the square root.
            let (of_v, of_tau) = path.times();
            let held = path.extremal.time_at_floor / (SHORT * t_f);
            let short_hold = if held > 0.0 { held * held } else { 1.0 };
            let fraction = ((of_v + of_tau) / (SHORT * t_f)).powi(2).min(short_hold).clamp(f64::MIN_POSITIVE, 1.0);
            let needed = (LEFT * rtol * fraction).sqrt().max(doubt);
            let finer = (exact * fraction).max(FINEST);
            // A last step must not cross a seam of the family, where the slope jumps.
            let smooth = path.signature() == probed.path.signature() || value.abs() <= SEAM;
            let good = value.abs() <= needed && smooth && last <= finer;
            let accepted = value * value <= rtol.max(100.0 * doubt * doubt);
            if accepted {
                found = Some((probed, path));
            }
            if good {
                break;
            }
            (tolerance, enough, start) = (finer.min(tolerance), needed.min(0.01 * enough).max(doubt), x);
        }
        self.stats.quadratures += self.quadratures.get();
        self.stats.nodes += self.nodes.get();
        let Some((Probed { path: probed, sums, .. }, path)) = found else {
            let status = if problem.is_doubtful() { Status::Unproven } else { Status::NotConverged };
            return Constrained::without_numbers(status, self.stats);
        };
        let (c_probed, c) = (probed.extremal.arc.c(), path.extremal.arc.c());
        let (ceiling_work, nodes) = probed.ceiling_work();
        self.stats.nodes += nodes;
        let held_work = floor::work(&problem.law, problem.from, probed.extremal.time_at_floor);
        let work = held_work + sums.work + ceiling_work - 0.5 * (c_probed + c) * (t_f - sums.time);
        let solved = self.read(&path, work, sums.friction_min);
        Constrained { solved, path: solved.value.map(|_| path), sitting: 0.0 }
    }

    /// How far the time of a path is from the one wanted, as a rising function of the parameter: the logarithm of the ratio
    /// of what they have beyond the least time, and of what they leave to the greatest.
    fn probe(&self, path: Path, tolerance: f64, rises: bool) -> Option<Probed> {
        let &Search { t_f, least, most, .. } = self;
        let sums = path.sums(tolerance)?;
        self.quadratures.set(self.quadratures.get() + 1);
        self.nodes.set(self.nodes.get() + sums.nodes);
        let sign = if rises { 1.0 } else { -1.0 };
        let time = sums.time;
        let probe = if time <= least {
            Probe { value: -sign * f64::MAX, slope: 0.0 }
        } else if time >= most {
            Probe { value: sign * f64::MAX, slope: 0.0 }
        } else {
            let (mut value, mut slope) = (ln((time - least) / (t_f - least)), sums.rate / (time - least));
            if most.is_finite() {
                value -= ln((most - time) / (most - t_f));
                slope += sums.rate / (most - time);
            }
            Probe { value: sign * value, slope: sign * slope }
        };
        Some(Probed { path, sums, probe })
    }

    /// The optimum of a path.
    fn read(&self, path: &Path, work: f64, friction_min: f64) -> Solved<Optimum> {
        let Search { problem, ceilings, stats, .. } = *self;
        let law = problem.law;
        let extremal = &path.extremal;
        let held = extremal.time_at_floor > 0.0;
        let velocity = |(theta, z): (f64, f64), kind: ArcKind| match kind {
            ArcKind::VCeiling => ceilings.v,
            _ => exp(z) / theta,
        };
        let Some((first, last)) = path.pieces().next().zip(path.pieces().last()) else {
            return Solved { status: Status::NotConverged, value: None, stats };
        };
        let v_start = if held { 1.0 } else { velocity(first.ends()[0], first.kind()) };
        let v_end = velocity(last.ends()[1], last.kind());
        let below = v_start < 1.0 - ROUNDING || v_end < 1.0 - ROUNDING;
        let (v_start, v_end) =
            if problem.bounded && !below { (v_start.max(1.0), v_end.max(1.0)) } else { (v_start, v_end) };
        let (time_at_v_ceiling, time_at_tau_ceiling) = path.times();
        let friction = path.friction(&law, friction_min);
        // A ceiling that hardly binds is met to the accuracy of the search.
        if v_end > ceilings.v * (1.0 + ROUNDING_AT_CEILING)
            || friction.greatest > ceilings.tau + ROUNDING_AT_CEILING * (law.a + ceilings.tau.abs())
        {
            return Solved { status: Status::NotConverged, value: None, stats };
        }
        let v_end = v_end.min(ceilings.v);
        let held_at = if held { 1.0 + law.b * problem.from.ln } else { f64::INFINITY };
        let (friction_min, proven_by) = (friction.least.min(held_at), friction.least_steady.min(held_at));
        let strategy = if held {
            Strategy::Floor
        } else if v_start * problem.from.theta > 1.0 {
            Strategy::SpeedUp
        } else {
            Strategy::SlowDown
        };
        let doubtful = proven_by <= problem.unique_above() || (problem.bounded && below);
        // Where friction is low the velocity may fall along an arc: then the start is not the least, or is above the ceiling.
        if (problem.bounded && below) || v_start > ceilings.v * (1.0 + ROUNDING_AT_CEILING) {
            return Solved { status: Status::Unproven, value: None, stats };
        }
        let status = if doubtful {
            Status::Unproven
        } else if below {
            Status::BelowBound
        } else {
            Status::Ok
        };
        let value = Optimum {
            work,
            v_start,
            v_end,
            time_at_floor: extremal.time_at_floor,
            time_at_v_ceiling,
            time_at_tau_ceiling,
            hamiltonian: -extremal.arc.c(),
            theta_max: extremal.arc.theta_max().max(problem.to.theta),
            friction_max: friction.greatest.min(ceilings.tau),
            strategy,
        };
        Solved { status: status.with_friction(friction_min), value: Some(value), stats }
    }
}

/// The lifetime of this logarithm.
fn lifetime(ln_theta: f64) -> Lifetime {
    Lifetime { theta: exp(ln_theta), rest: -exp_m1(ln_theta), ln: ln_theta }
}

/// A relative difference of times from which Newton's method leaves rounding in two steps.
const ENOUGH: f64 = 1e-4;

/// Fraction of the time below which all arcs on ceilings together are short.
const SHORT: f64 = 0.1;

/// Tolerance of the last probe, in units of that of the others.
const LAST: f64 = 0.01;

/// Square of the relative difference of times before the last step, in units of the accuracy: Newton's method leaves that.
const LEFT: f64 = 0.01;

/// A relative difference of times so small that a change of slope by 1e5 does not matter.
const SEAM: f64 = 1e-13;

/// Searches until the last step is as good as its slope promises.
const MOST_SEARCHES: u32 = 6;

/// Relative excess over a ceiling that is an error of the search.
const ROUNDING_AT_CEILING: f64 = 1e-7;

/// Widens a bracket beyond its rounding.
const MARGIN: f64 = 1e-6;

/// Largest `ln u` that is searched.
const MOST_LN_U: f64 = 690.0;

/// Friction along a path.
pub(super) struct FrictionRange {
    pub least: f64,
    /// The least, with that of steady sliding on the ceiling of friction.
    pub least_steady: f64,
    pub greatest: f64,
}

impl Path {
    /// Friction along the pieces; `least` is what nodes have met.
    fn friction(&self, law: &Law, least: f64) -> FrictionRange {
        let c = self.extremal.arc.c();
        let mut range = FrictionRange { least, least_steady: f64::INFINITY, greatest: f64::NEG_INFINITY };
        for piece in self.pieces() {
            let ends = piece.ends();
            let at = |(theta, z): (f64, f64)| 1.0 + law.a * z + (law.b - law.a) * ln(theta);
            let (low, high) = match piece {
                Piece::Free { .. } => (least_friction(law, c, ends), greatest_friction(law, c, ends)),
                Piece::Ceiling { .. } => (at(ends[0]).min(at(ends[1])), at(ends[0]).max(at(ends[1]))),
            };
            range.least = range.least.min(low);
            range.greatest = range.greatest.max(high);
            if piece.kind() == ArcKind::TauCeiling {
                let steady = |(theta, _): (f64, f64)| at((theta, 0.0));
                range.least_steady = range.least_steady.min(steady(ends[0])).min(steady(ends[1]));
            }
        }
        range.least_steady = range.least_steady.min(range.least);
        range
    }
}
