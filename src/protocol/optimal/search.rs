//! The search for the extremal that takes a given time, and what is read off it.

use super::arc::{ArcPoint, Sums};
use super::ceiling::Ceilings;
use super::clamp::Path;
use super::extremal::{Extremal, Problem};
use super::guess::{Guess, QUADRATURE_ERROR};
use super::{ArcKind, Optimum, Strategy, floor};
use crate::numerics::elementary::exp;
use crate::numerics::root::{Probe, newton_in_pieces};
use crate::numerics::{MAX_LN, ROOT_OF_ROUNDING, ROUNDING_RTOL};
use crate::protocol::{Solved, SolverStats, Status};

/// Tolerance of a quadrature whose results are to be good to `rtol`. Velocities at the ends change by up to some twenty
/// times the relative change of the time, since the time goes like the way in `ln u`.
pub(super) fn quadrature_tolerance(rtol: f64) -> f64 {
    0.02 * rtol
}

/// Most steps across the seam of the family before it counts as met, and most that make a short floor arc more exact. Chosen: more than either takes
/// where it converges.
const MAX_REFINEMENTS: u32 = 10;

/// Fraction of the whole time below which a floor arc is short. Derived: as a difference of times, a longer one loses at most two digits.
const SHORT_FLOOR_TIME: f64 = 0.01;

/// How far from the seam, in the scaled start of the arc or in `ln v(0+)`, a protocol without time at the floor is near it. Chosen: above the usual
/// error of a step.
const SEAM_WIDTH: f64 = 1e-3;

/// The rounding error of a velocity at the floor, relative. Chosen: `ln u` has errors of some roundings over `a`, at least 1e-3, far below this.
pub(super) const ROUNDING: f64 = 1e-9;

/// Tightest tolerance of a quadrature. Chosen: below the rounding of a double by two digits.
pub(super) const FINEST: f64 = 1e-18;

/// A family of paths in one parameter, in which the time is monotone.
pub(super) trait Family {
    type Path: Copy;

    fn problem(&self) -> &Problem;

    /// Whether time rises with the parameter.
    fn rises(&self) -> bool;

    /// The path at a parameter; `None` where there is none.
    fn path(&self, p: f64) -> Option<Self::Path>;

    /// The interval of the parameter in which the time is smooth, as a number.
    fn piece(&self, p: f64, path: &Self::Path) -> u32;

    /// Quadrature to relative accuracy `tolerance`.
    fn measure(&self, path: &Self::Path, tolerance: f64) -> Option<Measured>;

    /// The short arc of a path whose length is not known as well as that of the whole.
    fn short_arc(&self, p: f64, path: &Self::Path) -> Option<ShortArc>;

    /// Whether the slope of the time may jump where the parameter is 0.
    fn breaks_at_zero(&self) -> bool;

    /// The path in pieces.
    fn in_pieces(&self, path: &Self::Path) -> Path;
}

/// What one quadrature finds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured {
    /// By how much the time is less than the one wanted.
    pub lag: f64,
    /// Work of the free arcs.
    pub work: f64,
    /// Least friction met at a node.
    pub friction_min: f64,
    pub nodes: u32,
    /// How far the time is from the one wanted, as a rising function of the parameter.
    pub probe: Probe,
}

/// A short arc: a small difference of two times.
pub(super) struct ShortArc {
    pub time: f64,
    /// Tolerance of a quadrature that resolves it, in units of that of the whole.
    pub fraction: f64,
}

/// Where a search starts.
pub(super) struct Start {
    pub p: f64,
    pub bracket: (f64, f64),
    /// Tolerance of the first quadrature.
    pub tolerance: f64,
}

/// A search and its statistics.
pub(super) struct Search<'a, F: Family> {
    family: &'a F,
    accuracy: Accuracy,
    /// Tolerance of the next quadrature.
    tolerance: f64,
    /// The last path, its piece and what was measured.
    last: Option<(F::Path, u32, Measured)>,
    stats: SolverStats,
    /// Least friction met at a node.
    friction_min: f64,
}

impl<'a, F: Family> Search<'a, F> {
    /// The optimum, whose path takes the time of which `fraction` counts, with the path and its parameter.
    #[inline(always)]
    pub fn solve(
        family: &'a F,
        ceilings: &Ceilings,
        accuracy: Accuracy,
        start: Start,
        fraction: f64,
        stats: SolverStats,
    ) -> (Solved<Optimum>, Option<(F::Path, f64)>) {
        let tolerance = start.tolerance.max(accuracy.exact);
        let mut search = Search { family, accuracy, tolerance, last: None, stats, friction_min: f64::INFINITY };
        let root = search.root(start.p, start.bracket, fraction);
        let found = search.refined(root);
        // A bracket that closes on a larger change of the time holds no member of this time, but a gap of the family.
        let close = (10.0 * search.accuracy.enough).max(libm::cbrt(search.accuracy.least));
        let last = search.last.filter(|(.., last)| last.probe.value.abs() <= close);
        let (problem, mut stats) = (family.problem(), search.stats);
        let failure = || failure(problem, ceilings, search.friction_min);
        let Some(((p, path), (probed, _, measured))) = found.zip(last) else {
            return (Solved::without_numbers(failure(), stats), None);
        };
        let (probed, in_pieces) = (family.in_pieces(&probed), family.in_pieces(&path));
        // W* is stationary in the parameter up to C dt: the trapezium of C over the last step leaves an error of third
        // order.
        let c = probed.extremal.arc.c() + in_pieces.extremal.arc.c();
        let (bound_work, nodes) = probed.bound_work(problem);
        stats.nodes += nodes;
        let work = bound_work + measured.work - 0.5 * c * measured.lag;
        let (status, value) =
            read(problem, ceilings, &in_pieces, work, measured.friction_min).unwrap_or_else(|| (failure(), None));
        (Solved { status, value, stats }, Some((path, p)))
    }

    #[inline(always)]
    fn probe(&mut self, p: f64, fraction: f64) -> Option<(Probe, u32)> {
        let path = self.family.path(p)?;
        let piece = self.family.piece(p, &path);
        let before = self.last.as_ref().filter(|(_, before, _)| *before == piece).map(|(.., last)| last.probe.value);
        let accuracy = &self.accuracy;
        let measured = loop {
            let measured = self.family.measure(&path, (self.tolerance * fraction).max(FINEST))?;
            self.stats.quadratures += 1;
            self.stats.nodes += measured.nodes;
            let value = measured.probe.value;
            // A value within the error of its quadrature determines nothing, not even its sign.
            let doubtful = self.tolerance > accuracy.exact
                && (value.abs() <= 30.0 * self.tolerance || accuracy.may_end(value, before));
            let next = accuracy.next(value, before);
            self.tolerance = if doubtful { next.min(1e-3 * self.tolerance).max(accuracy.exact) } else { next };
            if !doubtful {
                break measured;
            }
        };
        self.friction_min = self.friction_min.min(measured.friction_min);
        self.last = Some((path, piece, measured));
        Some((measured.probe, piece))
    }

    #[inline(always)]
    fn root(&mut self, mut start: f64, bracket: (f64, f64), fraction: f64) -> Option<(f64, F::Path)> {
        let (family, enough, least) = (self.family, self.accuracy.enough, self.accuracy.least);
        let mut outcome = None;
        for _ in 0..MAX_REFINEMENTS {
            let root = newton_in_pieces(|p| self.probe(p, fraction), start, bracket, family.rises(), enough, least);
            // Rounding may step to an end of the bracket, where no member need exist.
            let member = |x| family.path(x).map(|path| (x, path));
            let found = root.and_then(|(root, piece)| {
                let (x, path) = member(root.x).or_else(|| member(root.probed))?;
                Some((x, path, piece))
            });
            outcome = found.map(|(x, path, _)| (x, path));
            // The slope jumps at a seam of the family: a last step across it is taken again from the other side.
            match found {
                Some((x, path, piece)) if family.piece(x, &path) != piece => start = x,
                _ => break,
            }
        }
        outcome
    }

    /// More steps, as fine as a short arc asks.
    #[inline(always)]
    fn refined(&mut self, mut outcome: Option<(f64, F::Path)>) -> Option<(f64, F::Path)> {
        let family = self.family;
        for _ in 0..MAX_REFINEMENTS {
            let (x, path) = outcome.as_mut()?;
            let Some(before) = family.short_arc(*x, path) else { break };
            let Some((last, piece)) = self.probe(*x, before.fraction).filter(|(last, _)| last.slope > 0.0) else {
                break;
            };
            let finer = *x - last.value / last.slope;
            // The slope may be 1e5 times as large on the other side of the start of a floor arc: a step ends there, and goes on
            // with that side's own.
            let crosses = family.breaks_at_zero() && finer * x.signum() < 0.0;
            let finer = if crosses { f64::MIN_POSITIVE.copysign(finer) } else { finer };
            let Some(next) = family.path(finer) else { break };
            (*x, *path) = (finer, next);
            let after = family.short_arc(finer, &next).map_or(before.time, |arc| arc.time);
            // An arc is known to the square of what such a step changes.
            let settled =
                (after - before.time).abs() <= ROOT_OF_ROUNDING * before.time || last.value.abs() <= ROUNDING_RTOL;
            if family.piece(finer, &next) == piece && last.value.abs() <= self.accuracy.enough && settled && !crosses {
                break;
            }
        }
        outcome
    }
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

/// An optimum without ceilings, with its extremal and parameter; without them where it is the floor arc alone.
pub(super) type FreeOptimum = (Solved<Optimum>, Option<(Extremal, f64)>);

/// The optimum without ceilings.
pub(super) fn free(problem: &Problem, time: Time, rtol: f64, guess: &Guess) -> FreeOptimum {
    let Time { whole: t_f, beyond, doubt } = time;
    let stats = SolverStats::default();
    if beyond < 0.0 || beyond.is_nan() || (beyond == 0.0 && !problem.bounded) {
        return (Solved::without_numbers(Status::Infeasible, stats), None);
    }
    if beyond == 0.0 {
        return (shortest(problem, problem.t_min()), None);
    }
    let &Guess { q_floor, p, tolerance } = guess;
    let family = Extremals { problem, q_floor, t_f, beyond };
    let start = Start { p, bracket: problem.bracket(q_floor, beyond), tolerance };
    // What counts is the time beyond the least, which may be a small fraction of the whole.
    let accuracy = Accuracy::new(rtol, doubt, problem.law.a);
    Search::solve(&family, &Ceilings::none(problem.law), accuracy, start, beyond / t_f, stats)
}

/// The status of a search without a solution: a defect, unless no protocol has friction at both ends that proves its
/// extremal the only one, or friction was too low for that on the way.
pub(super) fn failure(problem: &Problem, ceilings: &Ceilings, met: f64) -> Status {
    let under_ceilings = |steady: f64, y: f64| steady + problem.law.a * ceilings.cap(y);
    let start = under_ceilings(problem.friction_start(), problem.depth());
    let least = start.min(under_ceilings(problem.friction_end(), 0.0)).min(met);
    let doubtful = problem.is_doubtful() || least <= problem.unique_above();
    if doubtful { Status::Unproven } else { Status::NotConverged }
}

/// The optimum of a path, without one where that is no protocol under the bounds; `None` where the search failed.
#[inline(always)]
pub(super) fn read(
    problem: &Problem,
    ceilings: &Ceilings,
    path: &Path,
    work: f64,
    met: f64,
) -> Option<(Status, Option<Optimum>)> {
    let Extremal { time_at_floor, arc, .. } = path.extremal;
    let (first, last) = path.pieces().next().zip(path.pieces().last())?;
    let velocity = |&ArcPoint { theta, ln_theta, ln_u: z }: &ArcPoint, kind: ArcKind| match kind {
        ArcKind::VCeiling => ceilings.v,
        // exp(z) would lose digits below the normal numbers.
        _ if z < -MAX_LN => exp(z - ln_theta),
        _ => exp(z) / theta,
    };
    let held = time_at_floor > 0.0;
    let v_start = if held { 1.0 } else { velocity(&first.ends()[0], first.kind()) };
    let v_end = velocity(&last.ends()[1], last.kind());
    let friction = path.friction(problem, met);
    // A ceiling that hardly binds is met to the accuracy of the search.
    let most = ceilings.v * (1.0 + ROUNDING_AT_CEILING);
    let most_tau = ceilings.tau + ROUNDING_AT_CEILING * (problem.law.a + ceilings.tau.abs());
    if v_end > most || friction.greatest > most_tau {
        return None;
    }
    // Just off the bound, rounding may take a velocity below it; further below there is no protocol on the bound at all.
    let below = problem.bounded && v_start.min(v_end) < 1.0 - ROUNDING;
    let doubtful = below || (friction.least_steady <= problem.unique_above() && !is_proven(problem, &path.extremal));
    let (of_v, of_tau) = path.times;
    // Where friction is this low the velocity may fall along an arc: below the floor, or from above the ceiling.
    let dips = || problem.bounded && of_v + of_tau == 0.0 && velocity_range(&path.extremal)[0] < 1.0 - ROUNDING;
    if below || v_start > if doubtful { ceilings.v } else { most } || (doubtful && dips()) {
        return Some((Status::Unproven, None));
    }
    let least = if problem.bounded { 1.0 } else { 0.0 };
    let (v_start, v_end) = (v_start.max(least).min(ceilings.v), v_end.max(least).min(ceilings.v));
    let status = if doubtful {
        Status::Unproven
    } else if v_start.min(v_end) < 1.0 {
        Status::BelowBound
    } else {
        Status::Ok
    };
    let optimum = Optimum {
        work,
        v_start,
        v_end,
        time_at_floor,
        time_at_v_ceiling: of_v,
        time_at_tau_ceiling: of_tau,
        hamiltonian: -arc.c(),
        theta_max: arc.theta_max().max(problem.to.theta),
        friction_max: friction.greatest.min(ceilings.tau),
        strategy: if held {
            Strategy::Floor
        } else if v_start * problem.from.theta > 1.0 {
            Strategy::SpeedUp
        } else {
            Strategy::SlowDown
        },
    };
    Some((status.with_friction(friction.least), Some(optimum)))
}

/// Relative excess over a ceiling that is an error of the search. Chosen: far above the errors of a search that succeeds.
const ROUNDING_AT_CEILING: f64 = 1e-7;

/// Whether an extremal is proved to be the only one, however low friction falls on it: for `b > a`, where `tau_ss >= 2 (b - a)`
/// at both ends and it obeys the floor (docs/derivations.md, "Unique: monotone time").
pub(super) fn is_proven(problem: &Problem, found: &Extremal) -> bool {
    let least = 2.0 * problem.unique_above();
    if least <= 0.0 || problem.friction_start().min(problem.friction_end()) < least {
        return false;
    }
    if !problem.bounded {
        true
    } else if found.time_at_floor > 0.0 {
        // Where friction at v = 1 falls as theta rises, a free arc may come before the floor.
        found.arc.c() >= floor::c_leaving(&problem.law, problem.from.theta, problem.from.ln)
    } else {
        velocity_range(found)[0] >= 1.0 - ROUNDING
    }
}

/// Least and greatest velocity of the arc of an extremal: at an end, or where friction passes `b - a`. There `theta tau' = b (1 -
/// u)`, so that it passes upwards at most once before the turn, and downwards at most once after it.
pub(super) fn velocity_range(found: &Extremal) -> [f64; 2] {
    let (pieces, law) = (found.arc.pieces(), found.arc.law);
    // Friction above b - a, and ln v.
    let look = |place: f64| {
        let here = pieces.at(place);
        (1.0 + law.a * here.ln_u + (law.b - law.a) * (here.ln_theta - 1.0), here.ln_u - here.ln_theta)
    };
    let bisect = |[mut low, mut high]: [f64; 2], is_low: &dyn Fn(f64) -> bool| {
        for _ in 0..f64::MANTISSA_DIGITS {
            let middle = 0.5 * (low + high);
            if is_low(middle) { low = middle } else { high = middle }
        }
        low
    };
    let turn = bisect([0.0, 1.0], &|place| pieces.at(place).ln_u < 0.0);
    let flat = [[0.0, turn], [turn, 1.0]].map(|leg| {
        let sign = look(leg[0]).0 < 0.0;
        look(bisect(leg, &|place| (look(place).0 < 0.0) == sign)).1
    });
    let ln_v = [look(0.0).1, look(1.0).1, flat[0], flat[1]];
    [f64::INFINITY, f64::NEG_INFINITY]
        .map(|from| ln_v.iter().fold(from, |range, &v| if from > 0.0 { range.min(v) } else { range.max(v) }))
        .map(exp)
}

/// The extremals of a problem; the parameter counts from `q_floor`.
struct Extremals<'a> {
    problem: &'a Problem,
    q_floor: Option<f64>,
    t_f: f64,
    beyond: f64,
}

impl Family for Extremals<'_> {
    type Path = Extremal;

    fn problem(&self) -> &Problem {
        self.problem
    }

    fn rises(&self) -> bool {
        self.problem.rises()
    }

    fn path(&self, p: f64) -> Option<Extremal> {
        self.problem.extremal(p, self.q_floor)
    }

    /// The seams are `q_floor`, `q = 0` and the start of a floor arc.
    fn piece(&self, p: f64, path: &Extremal) -> u32 {
        let beyond = [p > 0.0, p + self.q_floor.unwrap_or(0.0) > 0.0, path.time_at_floor > 0.0];
        beyond.into_iter().fold(0, |sum, is_beyond| 2 * sum + u32::from(is_beyond))
    }

    fn measure(&self, path: &Extremal, tolerance: f64) -> Option<Measured> {
        let sums = path.arc.sums(tolerance)?;
        let Sums { work, friction_min, nodes, .. } = sums;
        let probe = path.probe(self.problem, &sums, self.beyond);
        Some(Measured { lag: self.beyond - path.time_beyond(&sums), work, friction_min, nodes, probe })
    }

    /// A short floor arc. Near the seam a protocol without a floor arc may be one with a floor arc of less than the error.
    fn short_arc(&self, p: f64, path: &Extremal) -> Option<ShortArc> {
        let time = path.time_at_floor;
        if time > 0.0 {
            return (time < SHORT_FLOOR_TIME * self.t_f).then(|| ShortArc { time, fraction: time / self.t_f });
        }
        let start = if self.rises() { path.start - self.problem.from.ln } else { p };
        (self.q_floor.is_some() && start < SEAM_WIDTH).then_some(ShortArc { time, fraction: 0.0 })
    }

    fn breaks_at_zero(&self) -> bool {
        self.q_floor.is_some()
    }

    fn in_pieces(&self, path: &Extremal) -> Path {
        Path::of(self.problem, *path)
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
        (0.06 * Accuracy::left(next, Some(value))).min(QUADRATURE_ERROR).max(self.exact)
    }
}

/// `t_f = t_min`: the floor arc alone.
fn shortest(problem: &Problem, t_min: f64) -> Solved<Optimum> {
    let law = problem.law;
    let (work, c) = (floor::work(&law, problem.from, t_min), floor::c_leaving(&law, problem.to.theta, problem.to.ln));
    let friction = [problem.from, problem.to].map(|at| 1.0 + law.b * at.ln);
    // No other protocol is as fast.
    let (_, mut optimum) = without_arcs(problem, 1.0, work, c, friction);
    (optimum.time_at_floor, optimum.strategy) = (t_min, Strategy::Floor);
    let status = Status::Ok.with_friction(friction[0].min(friction[1]));
    Solved { status, value: Some(optimum), stats: SolverStats::default() }
}

/// A protocol of constant velocity, with the work, `C`, and the least and the greatest friction given.
pub(super) fn without_arcs(
    problem: &Problem,
    v: f64,
    work: f64,
    c: f64,
    [least, greatest]: [f64; 2],
) -> (Status, Optimum) {
    let status = if least <= problem.unique_above() { Status::Unproven } else { Status::Ok };
    let optimum = Optimum {
        work,
        v_start: v,
        v_end: v,
        time_at_floor: 0.0,
        time_at_v_ceiling: 0.0,
        time_at_tau_ceiling: 0.0,
        hamiltonian: -c,
        theta_max: problem.to.theta,
        friction_max: greatest,
        strategy: Strategy::SlowDown,
    };
    (status.with_friction(least), optimum)
}
