//! The optimum under ceilings: the free one where it obeys them, else the clamped extremal of the same family that takes
//! the given time.

use super::arc::Sums;
use super::ceiling::Ceilings;
use super::clamp::{Path, Switch, Switches, falling_part};
use super::extremal::Problem;
use super::guess::{Guess, QUADRATURE_ERROR};
use super::lifetime::Lifetime;
use super::search::{self, Accuracy, Family, Measured, ShortArc, Start, Time};
use super::{ArcKind, Optimum};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, phi};
use crate::numerics::root::Probe;
use crate::numerics::turning::turning;
use crate::numerics::{LONG_ROUNDING_RTOL, MAX_LN};
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

impl Feasible {
    /// The least and the greatest feasible time.
    pub fn times(&self) -> Option<(f64, f64)> {
        match *self {
            Feasible::Times(least, most) => Some((least, most)),
            Feasible::Sitting(least) => Some((least, f64::INFINITY)),
            Feasible::Never(_) => None,
        }
    }
}

/// What the ceilings allow, without iteration.
pub(super) fn feasible(problem: &Problem, ceilings: &Ceilings) -> Feasible {
    let depth = problem.depth();
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

/// Steady sliding at the final velocity, on a ceiling above which theta cannot come back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sitting {
    pub time: f64,
    /// `d ln u/d ln theta` on the ceiling; NaN where both ceilings are there.
    rise: f64,
    pub kind: ArcKind,
}

impl Sitting {
    /// What the multiplier of the velocity, `tau + a` less than `theta` times the costate, is after `time`, and its
    /// integral: it rises from 0 with the rate `v (tau + a - b + rise multiplier)`.
    pub fn multiplier(&self, problem: &Problem, time: f64) -> (f64, f64) {
        let Law { a, b } = problem.law;
        let (slip, force) = (time / problem.to.theta, problem.friction_end() + a - b);
        let grown = self.rise * slip;
        let (value, integral) = if grown == 0.0 {
            (slip, 0.5 * slip * slip)
        } else {
            (exp_m1(grown) / self.rise, phi(grown) / (self.rise * self.rise))
        };
        (force * value, force * integral * problem.to.theta)
    }
}

/// A solved problem: the path, and how it then slides at the final velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct Constrained {
    pub solved: Solved<Optimum>,
    pub path: Option<Path>,
    pub sitting: Option<Sitting>,
}

impl Constrained {
    pub fn without_numbers(status: Status, stats: SolverStats) -> Constrained {
        Constrained { solved: Solved::without_numbers(status, stats), path: None, sitting: None }
    }
}

/// Solves `problem` in `time` under the ceilings.
pub(super) fn find(problem: &Problem, ceilings: &Ceilings, time: Time, rtol: f64) -> Constrained {
    let guess = Guess::of(problem, time.beyond);
    let none = ceilings.v == f64::INFINITY && ceilings.tau == f64::INFINITY;
    if !none
        && time.beyond > 0.0
        && let Some(found) = find_bound(problem, ceilings, time, rtol, &guess)
    {
        return found;
    }
    let (free, member) = search::free(problem, time, rtol, &guess);
    let Solved { status, value, stats } = free;
    // The velocity rises where friction exceeds b - a. A proven extremal may have less only where theta rises: where theta falls,
    // friction exceeds tau_ss of the end, at least 2 (b - a), so that the velocity has no peak inside.
    let proven = matches!(status, Status::Ok | Status::BelowBound);
    let obeys = |optimum: Optimum| {
        let greatest = optimum.v_start.max(optimum.v_end);
        let peak = |(extremal, _)| if proven { 0.0 } else { search::velocity_range(&extremal)[1] };
        greatest <= ceilings.v && optimum.friction_max <= ceilings.tau && member.map_or(0.0, peak) <= ceilings.v
    };
    if none || status == Status::Infeasible || value.is_some_and(obeys) {
        let path = member.filter(|_| value.is_some()).map(|(extremal, _)| Path::of(problem, extremal));
        return Constrained { solved: free, path, sitting: None };
    }
    let t_f = time.whole;
    match feasible(problem, ceilings) {
        Feasible::Times(least, most) if t_f >= least && t_f <= most => {
            // Without ceilings an extremal falls below the floor: friction is too low for the family to be ordered.
            if value.is_none() && status == Status::Unproven {
                return Constrained::without_numbers(status, stats);
            }
            let p = member.map_or(f64::NAN, |(_, p)| p);
            let search = Search { problem, ceilings, t_f, least, most, rtol, stats };
            search.solve(guess.q_floor, p)
        }
        Feasible::Sitting(_) => sitting(problem, ceilings, t_f, rtol, stats),
        _ => Constrained::without_numbers(Status::Infeasible, stats),
    }
}

/// The optimum where a ceiling certainly binds, without the free one; `None` where that is not known from the first parameter.
fn find_bound(problem: &Problem, ceilings: &Ceilings, time: Time, rtol: f64, guess: &Guess) -> Option<Constrained> {
    let &Guess { q_floor, p, .. } = guess;
    let (t_f, depth) = (time.whole, problem.depth());
    // Friction is so high all along every path that the free optimum is proven: where v >= 1, or where u > 1.
    let at_floor = 1.0 + problem.law.b * problem.from.ln.min(problem.to.ln);
    let at_once = problem.fall > 0.0 && p + q_floor.unwrap_or(0.0) > 0.0;
    let proven = problem.bounded && at_floor > problem.unique_above() || at_once && !problem.is_doubtful();
    if !proven || ceilings.cap(0.0).min(ceilings.cap(depth)) <= 0.0 {
        return None;
    }
    let fall = falling_part(problem, ceilings, &problem.extremal(p, q_floor)?)?;
    if !fall.is_bound(ceilings) {
        return None;
    }
    let Feasible::Times(least, most) = feasible(problem, ceilings) else { return None };
    if t_f < least || t_f > most {
        return None;
    }
    let search = Search { problem, ceilings, t_f, least, most, rtol, stats: SolverStats::default() };
    let found = search.solve(q_floor, p);
    let binds = found.solved.value.is_some_and(|found| found.time_at_v_ceiling + found.time_at_tau_ceiling > 0.0);
    binds.then_some(found)
}

/// The optimum of the time of the turn, then steady sliding.
fn sitting(problem: &Problem, ceilings: &Ceilings, t_f: f64, rtol: f64, mut stats: SolverStats) -> Constrained {
    let (v, friction) = (1.0 / problem.to.theta, problem.friction_end());
    let of_v = ceilings.z_v == 0.0;
    let (mut path, mut sat) = (None, t_f);
    let (mut status, mut optimum) = search::without_arcs(problem, v, 0.0, -friction * v, [friction, friction]);
    if problem.rises() {
        let tolerance = search::quadrature_tolerance(rtol);
        let turn = problem.extremal(0.0, None).and_then(|turn| Some((turn, turn.arc.sums(tolerance)?)));
        let read = turn.and_then(|(turn, sums)| {
            stats += SolverStats { quadratures: 1, nodes: sums.nodes };
            sat = (sat - turn.time(&sums)).max(0.0);
            let turn = path.insert(Path::of(problem, turn));
            search::read(problem, ceilings, turn, turn.extremal.work(problem, &sums), sums.friction_min)
        });
        let failure = || (search::failure(problem, ceilings, f64::INFINITY), None);
        let (of_turn, value) = read.unwrap_or_else(failure);
        let Some(value) = value else { return Constrained::without_numbers(of_turn, stats) };
        (status, optimum) = (of_turn, Optimum { v_end: v, theta_max: problem.to.theta, ..value });
    }
    optimum.work += sat * friction * v;
    if of_v {
        optimum.time_at_v_ceiling = sat;
    } else {
        optimum.time_at_tau_ceiling = sat;
    }
    let rise = match (of_v, ceilings.z_tau == 0.0) {
        (true, true) => f64::NAN,
        (true, false) => 1.0,
        _ => ceilings.kappa,
    };
    let kind = if of_v { ArcKind::VCeiling } else { ArcKind::TauCeiling };
    let sitting = Some(Sitting { time: sat, rise, kind });
    Constrained { solved: Solved { status, value: Some(optimum), stats }, path, sitting }
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
}

/// The clamped extremals of a problem.
struct ClampedPaths<'a, M> {
    problem: &'a Problem,
    member: M,
    rises: bool,
    t_f: f64,
    least: f64,
    most: f64,
    /// What the time leaves to the nearer limit.
    room: f64,
}

impl<M: Fn(f64) -> Option<Path>> Family for ClampedPaths<'_, M> {
    type Path = Path;

    fn problem(&self) -> &Problem {
        self.problem
    }

    fn rises(&self) -> bool {
        self.rises
    }

    fn path(&self, p: f64) -> Option<Path> {
        (self.member)(p)
    }

    fn piece(&self, _: f64, path: &Path) -> u32 {
        path.signature()
    }

    /// The value is the logarithm of the ratio of what the times have beyond the least, and of what they leave to the greatest.
    fn measure(&self, path: &Path, tolerance: f64) -> Option<Measured> {
        let &ClampedPaths { t_f, least, most, .. } = self;
        let (Sums { time, work, friction_min, nodes, .. }, rate) = path.sums(tolerance)?;
        let sign = if self.rises { 1.0 } else { -1.0 };
        let probe = if time <= least {
            Probe { value: -sign * f64::MAX, slope: 0.0 }
        } else if time >= most {
            Probe { value: sign * f64::MAX, slope: 0.0 }
        } else {
            let (mut value, mut slope) = (ln((time - least) / (t_f - least)), rate / (time - least));
            if most.is_finite() {
                value -= ln((most - time) / (most - t_f));
                slope += rate / (most - time);
            }
            Probe { value: sign * value, slope: sign * slope }
        };
        Some(Measured { lag: t_f - time, work, friction_min, nodes, probe })
    }

    /// Arcs on a ceiling change much with the parameter, those at a peak of friction by the square root.
    fn short_arc(&self, _: f64, path: &Path) -> Option<ShortArc> {
        let (of_v, of_tau) = path.times;
        let short = |time: f64| if time > 0.0 && time < SHORT_CEILING_TIME * self.t_f { time } else { f64::INFINITY };
        let time = short(of_v + of_tau).min(short(path.extremal.time_at_floor));
        let part = time / (SHORT_CEILING_TIME * self.t_f);
        time.is_finite().then_some(ShortArc { time, fraction: part * part * self.room / self.t_f })
    }

    fn breaks_at_zero(&self) -> bool {
        false
    }

    fn in_pieces(&self, path: &Path) -> Path {
        *path
    }
}

impl Search<'_> {
    /// The optimum, from the parameter `p` counted from `q_floor`.
    fn solve(&self, q_floor: Option<f64>, p: f64) -> Constrained {
        let (problem, ceilings) = (self.problem, self.ceilings);
        if ceilings.cap(0.0) < 0.0 {
            return self.rising();
        }
        let origin = q_floor.unwrap_or(0.0);
        let at_once = !problem.rises() && p + origin > 0.0;
        if !at_once && let Some(found) = self.lingering() {
            return found;
        }
        let switches = Switches::unknown();
        let member = |p: f64| Path::clamped(problem, ceilings, problem.extremal(p, q_floor)?, &switches);
        let (low, high) = problem.bracket(q_floor, self.t_f);
        let bracket = if problem.rises() {
            // From the member that turns at its end.
            (-origin, high)
        } else {
            (low, high.min(all_on_ceilings(problem, ceilings) + MARGIN - origin))
        };
        self.search(member, problem.rises(), Start { p, bracket, tolerance: QUADRATURE_ERROR })
    }

    /// The optimum that lingers before it turns, close to steady sliding on the ceiling of friction; `None` where it turns
    /// well before.
    fn lingering(&self) -> Option<Constrained> {
        let (problem, ceilings) = (self.problem, self.ceilings);
        let slope = -ceilings.kappa;
        if slope <= 0.0 || !ceilings.tau.is_finite() {
            return None;
        }
        // ln(theta_c/theta_1), and below the end of greater theta.
        let y_c = ceilings.z_tau / slope;
        let above = y_c - problem.depth().max(0.0);
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
        if nearest.is_none_or(|(sums, _)| sums.time >= self.t_f) {
            return None;
        }
        let bracket = (f64::NEG_INFINITY, ln(far));
        Some(self.search(member, false, Start { p: ln(far) - 1.0, bracket, tolerance: QUADRATURE_ERROR }))
    }

    /// Theta rises to the end, last on a ceiling: the parameter is where the ceiling begins.
    fn rising(&self) -> Constrained {
        let (problem, ceilings) = (self.problem, self.ceilings);
        let whole_way = -problem.depth();
        if let Some(y) = lingering(ceilings, -whole_way) {
            let slope = -ceilings.kappa;
            // z at the switch is e^-s of what it is at the end.
            let member = |s: f64| {
                let z = ceilings.z_tau * exp(-s);
                let way = (ceilings.z_tau * exp_m1(-s) / slope).min(-y);
                let ln_z = Some(ln(-ceilings.z_tau) - s);
                Path::rising(problem, ceilings, Switch { way, z, ln_z, rise: ceilings.kappa, pace_over_z: 1.0 / slope })
            };
            let start = Start { p: 1.0, bracket: (0.0, f64::INFINITY), tolerance: QUADRATURE_ERROR };
            return self.search(member, true, start);
        }
        let member = |way: f64| {
            let of_v = -way < ceilings.crossing();
            let (kind, rise) = if of_v { (ArcKind::VCeiling, 1.0) } else { (ArcKind::TauCeiling, ceilings.kappa) };
            let z = ceilings.cap_of(kind, -way);
            Path::rising(problem, ceilings, Switch { way, z, ln_z: None, rise, pace_over_z: -1.0 / z })
        };
        let start = Start { p: 0.5 * whole_way, bracket: (0.0, whole_way), tolerance: QUADRATURE_ERROR };
        self.search(member, true, start)
    }

    /// The member of a family that takes the time.
    fn search(&self, member: impl Fn(f64) -> Option<Path>, rises: bool, start: Start) -> Constrained {
        let Search { problem, ceilings, t_f, rtol, stats, .. } = *self;
        // Rounding of the limits must leave room for the time.
        let (least, most) = (self.least.min(t_f * (1.0 - LIMIT_RTOL)), self.most.max(t_f * (1.0 + LIMIT_RTOL)));
        let room = (t_f - least).min(most - t_f);
        // Near steady sliding on a ceiling the rounding of ln u there changes the time by its relative error.
        let sliding = problem.to.theta / (ceilings.cap(0.0).abs() * room);
        let sliding = if sliding.is_finite() { 0.1 * f64::EPSILON * sliding } else { 0.0 };
        let doubt = 4.0 * f64::EPSILON * t_f / room + sliding;
        let family = ClampedPaths { problem, member, rises, t_f, least, most, room };
        let mut accuracy = Accuracy::new(rtol, doubt, problem.law.a);
        accuracy.least = (SLOPE_CHANGES * accuracy.least).max(1e-16);
        accuracy.exact *= LAST_TOLERANCE_RATIO;
        let (solved, path) = search::Search::solve(&family, ceilings, accuracy, start, room / t_f, stats);
        // On a ceiling that rounding alone keeps off steady friction a long arc has no digits.
        let on_bounds = |found: Optimum| found.time_at_floor + found.time_at_v_ceiling + found.time_at_tau_ceiling;
        if solved.value.is_some_and(|found| on_bounds(found) > (1.0 + rtol.max(LONG_ROUNDING_RTOL)) * t_f) {
            return Constrained::without_numbers(Status::NotConverged, solved.stats);
        }
        let mut path = path.filter(|_| solved.value.is_some()).map(|(path, _)| path);
        path.iter_mut().for_each(Path::refer_to_switches);
        Constrained { solved, path, sitting: None }
    }
}

/// `ln u` of the free extremal at the start where all of it is on the ceilings: the largest `C` at which the ceilings
/// are left.
fn all_on_ceilings(problem: &Problem, ceilings: &Ceilings) -> f64 {
    let Law { a, b } = problem.law;
    let depth = problem.depth();
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
    if z_0.is_finite() { z_0 } else { MAX_LN }
}

/// The lifetime of this logarithm.
fn lifetime(ln_theta: f64) -> Lifetime {
    Lifetime { theta: exp(ln_theta), rest: -exp_m1(ln_theta), ln: ln_theta }
}

/// What a step may leave, in units of what a free search may: the slope changes faster where an arc on a ceiling begins. Chosen: a hundredth of what
/// two steps of a free search leave.
const SLOPE_CHANGES: f64 = 1e-4;

/// Tolerance of the last quadrature, in units of that of a free search. Chosen: fine enough for most short arcs as well, which saves a quadrature.
const LAST_TOLERANCE_RATIO: f64 = 0.02;

/// Fraction of the time below which all arcs on ceilings together are short. Derived: as a difference of times, a longer one loses at most one digit.
const SHORT_CEILING_TIME: f64 = 0.1;

/// Rounding of the least and of the greatest feasible time, relative. Chosen: that of a sum over panels.
const LIMIT_RTOL: f64 = 16.0 * f64::EPSILON;

/// Widens a bracket beyond its rounding. Chosen: far above the rounding, far below a step of the search.
const MARGIN: f64 = 1e-6;
