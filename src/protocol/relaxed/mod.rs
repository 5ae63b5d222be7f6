//! The least work for the laws of Ruina (slip) and of Perrin, Rice and Zheng, with `1 <= v <= V`.
//!
//! With these laws the cost is not convex in the rate of the state: the optimum of the convexified problem alternates between both bounds, and may
//! do so infinitely often (`chatter`). All arcs are elementary or dilogarithms, with one unknown at most (docs/derivations.md).

mod bound_arc;
mod motion;
mod price;
mod rise;
mod slopes;
mod state;

use super::optimal::{Optimum, Slopes, Strategy};
use super::{Motion, Solved, SolverStats, Status};
use crate::model::{StateLaw, Transition};
use crate::numerics::elementary::{exp, ln, ln_1p};
use crate::numerics::root::{LAST_STEP_RESIDUAL, Probe, newton};
use bound_arc::{BoundArc, Kind};
pub use motion::PULSES;
use price::Cheapest;
use state::{Loop, State, down, jerk, up, wait};

/// The optimum of the convexified problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxed {
    /// Its numbers. Times on the bounds include those of chattering; `work` is then an infimum.
    pub optimum: Optimum,
    /// The chattering, if any.
    pub chatter: Option<Chatter>,
}

/// Chattering: both bounds alternate ever faster, so that theta rests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chatter {
    /// Its duration.
    pub time: f64,
    /// Where theta rests.
    pub theta: f64,
    /// Fraction of the time on the ceiling.
    pub duty: f64,
    /// Least work of a protocol with one switch between the bounds.
    pub work_bang_bang: f64,
}

/// A transition between steady states under both bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Problem {
    law: StateLaw,
    a: f64,
    b: f64,
    /// Ceiling `V`.
    ceiling: f64,
    ln_ceiling: f64,
    from: State,
    to: State,
    /// `ln(v_f/v_i)` without its sign.
    ratio: f64,
    /// Difference of theta at both ends, without its sign.
    span: f64,
}

/// Outcomes without numbers.
const fn without(status: Status) -> Solved<Relaxed> {
    Solved::without_numbers(status, SolverStats { quadratures: 0, nodes: 0 })
}

/// The relaxed optimum for `law`, which is not [`StateLaw::Ageing`], to rounding.
///
/// `Infeasible` where `t_f` is below [`least_time`], or outside the domain (`a > 0`, `b >= 0`, `v_i, v_f > 1`, `t_f > 0`, all finite). `Unproven`
/// with numbers where a state is feasible at which the proof of docs/derivations.md does not hold; without numbers where the ceiling is below `v_i`
/// and, besides, not above `v_f` or below the start of a rise.
/// `NegativeFriction` where `tau < 0` on the path.
pub fn solve(law: StateLaw, transition: &Transition, t_f: f64, v_ceiling: f64) -> Solved<Relaxed> {
    find(law, transition, t_f, v_ceiling).0
}

/// The outcome of [`solve`]; with numbers also the problem and its path.
fn find(
    law: StateLaw,
    transition: &Transition,
    t_f: f64,
    v_ceiling: f64,
) -> (Solved<Relaxed>, Option<(Problem, Path)>) {
    let problem = match Problem::new(law, transition, v_ceiling) {
        Ok(problem) if t_f > 0.0 && t_f.is_finite() => problem,
        Ok(_) => return (without(Status::Infeasible), None),
        Err(status) => return (without(status), None),
    };
    if t_f < problem.least_time() {
        return (without(Status::Infeasible), None);
    }
    let path = problem.path(t_f);
    let solved = match &path {
        Some(path) => path.solved(&problem, t_f),
        // The price may be negative or infinite there.
        None if !problem.is_proven(t_f) || problem.from.v > v_ceiling => without(Status::Unproven),
        None => without(Status::NotConverged),
    };
    (solved, path.filter(|_| solved.value.is_some()).map(|path| (problem, path)))
}

/// The derivatives of the work of [`solve`], those that do not exist infinite or NaN; `None` without an optimum.
pub fn slopes(law: StateLaw, transition: &Transition, t_f: f64, v_ceiling: f64) -> Option<Slopes> {
    let (solved, found) = find(law, transition, t_f, v_ceiling);
    let (problem, path) = found?;
    Some(slopes::of_path(&path, &problem, solved.value?.optimum.hamiltonian))
}

/// The least ceiling under which an acceleration may last for `t_f`; `None` for a deceleration.
pub fn least_v_ceiling(law: StateLaw, transition: &Transition, t_f: f64) -> Option<f64> {
    let &Transition { v_i, v_f, .. } = transition;
    if !(v_f > v_i && t_f > 0.0 && t_f.is_finite()) {
        return None;
    }
    // V = v_f (1 + e^x).
    let ceiling = |x: f64| v_f * (1.0 + exp(x));
    let probe = |x: f64| {
        let v = ceiling(x);
        let problem = Problem::new(law, transition, v).ok()?;
        let (slip, [more, less]) = (problem.direct(), [problem.from, problem.to].map(|end| problem.rest_slope(&end)));
        Some(Probe { value: ln(v * t_f / slip), slope: (v - v_f) * (1.0 / v - (more - less) / slip) })
    };
    let least = ln(f64::EPSILON);
    if probe(least)?.value >= 0.0 {
        return Some(v_f);
    }
    newton(probe, 0.0, (least, f64::INFINITY), true, LAST_STEP_RESIDUAL).map(|root| ceiling(root.x))
}

/// The least feasible duration; `None` where no duration is feasible, or for a ceiling below `v_i` that is not above `v_f`.
pub fn least_time(law: StateLaw, transition: &Transition, v_ceiling: f64) -> Option<f64> {
    Problem::new(law, transition, v_ceiling).ok().map(|problem| problem.least_time())
}

/// The relaxed optimum and its motion, in which chattering has 16 pulses.
pub fn motion(
    law: StateLaw,
    transition: &Transition,
    t_f: f64,
    v_ceiling: f64,
) -> (Solved<Relaxed>, Option<Box<dyn Motion>>) {
    let (solved, found) = find(law, transition, t_f, v_ceiling);
    let motion = |(problem, path)| Box::new(motion::BangBang::new(&problem, &path, t_f)) as Box<dyn Motion>;
    (solved, found.map(motion))
}

/// Error bound of the work: all is in closed form, but for rounding.
pub fn work_error(relaxed: &Relaxed, transition: &Transition, t_f: f64) -> f64 {
    let &Transition { law, v_i, v_f } = transition;
    let Optimum { work, hamiltonian, v_start, v_end, time_at_v_ceiling, .. } = relaxed.optimum;
    // Steady friction on the ceiling may cancel.
    let slip = time_at_v_ceiling * v_start.max(v_end);
    let terms = work.abs()
        + slip
        + (hamiltonian * t_f).abs().min(work.abs() * MAX_AMPLIFICATION)
        + (law.b * ln(v_f / v_i)).abs();
    ROUNDINGS * f64::EPSILON * terms
}

/// Rounding errors of a work in units of the last state of its terms. Chosen: measured ones stay below a third (`tests/budgets.csv`).
const ROUNDINGS: f64 = 60.0;

/// Greatest amplification of the rounding of `t_f` that counts. Chosen: beyond, `t_f` is a rounding from its least value.
const MAX_AMPLIFICATION: f64 = 1e8;

/// A path of the relaxed problem.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Path {
    /// Two arcs on bounds, with chattering between them for this time; 0 for a turn.
    OnBounds { arcs: [BoundArc; 2], chatter: f64 },
    /// Faster than at `v = 1`, then at `v = 1`.
    Rise(rise::Rise),
}

impl Problem {
    /// The problem; the status of one outside the domain or without a feasible duration.
    fn new(law: StateLaw, transition: &Transition, ceiling: f64) -> Result<Problem, Status> {
        let &Transition { law: friction, v_i, v_f } = transition;
        let is_inside = friction.a > 0.0 && friction.b >= 0.0 && v_i > 1.0 && v_f > 1.0 && ceiling > 1.0;
        let is_finite = [friction.a, friction.b, v_i, v_f, ceiling].iter().all(|number| number.is_finite());
        if !is_inside || !is_finite || law == StateLaw::Ageing || v_f > ceiling && v_f >= v_i {
            return Err(Status::Infeasible);
        }
        if v_i > ceiling && v_f >= ceiling {
            return Err(Status::Unproven);
        }
        if v_f == ceiling && v_i < v_f {
            return Err(Status::Infeasible);
        }
        let difference = (v_f - v_i).abs();
        Ok(Problem {
            law,
            a: friction.a,
            b: friction.b,
            ceiling,
            ln_ceiling: ln(ceiling),
            from: State::steady(v_i, ceiling),
            to: State::steady(v_f, ceiling),
            ratio: ln_1p(difference / v_i.min(v_f)),
            span: difference / v_i / v_f,
        })
    }

    /// `b - a`.
    fn weakening(&self) -> f64 {
        self.b - self.a
    }

    /// Whether theta rises.
    fn rises(&self) -> bool {
        self.to.v < self.from.v
    }

    /// Length of the direct way: slip on the ceiling, or time at `v = 1`.
    fn direct(&self) -> f64 {
        if self.rises() {
            wait(self.law, &self.from, &self.to, self.ratio)
        } else {
            jerk(self.law, &self.from, &self.to, self.ratio, self.ceiling)
        }
    }

    /// Duration of the direct way.
    fn direct_time(&self) -> f64 {
        if self.rises() { self.direct() } else { self.direct() / self.ceiling }
    }

    /// The least feasible duration. The slip law heals fastest at `v = 1/(e theta)`.
    fn least_time(&self) -> f64 {
        if self.law == StateLaw::Slip && self.rises() && self.from.below_floor > 1.0 {
            return rise::least_time(self);
        }
        self.direct_time()
    }

    /// The path of least work of duration `t_f`.
    fn path(&self, t_f: f64) -> Option<Path> {
        let spare = t_f - self.direct_time();
        if spare < 0.0 {
            return rise::Rise::new(self, t_f).filter(|rise| rise.v_start() <= self.ceiling).map(Path::Rise);
        }
        let arcs = match self.cheapest() {
            // No path returns to the steady state of the ceiling.
            _ if self.from.excess == 0.0 && self.to.excess == 0.0 => self.fall_and_wait(spare),
            Cheapest::Floor => self.wait_and_jerk(spare),
            Cheapest::Ceiling => self.fall_and_wait(spare),
            Cheapest::At(state) => {
                let arcs = [self.arc(&self.from, &state), self.arc(&state, &self.to)];
                let chatter = t_f - (arcs[0].time(self.ceiling) + arcs[1].time(self.ceiling));
                if chatter > 0.0 {
                    return Some(Path::OnBounds { arcs, chatter });
                }
                if state.v < self.from.v.min(self.to.v) || self.from.v > self.ceiling {
                    self.wait_and_jerk(spare)
                } else {
                    self.fall_and_wait(spare)
                }
            }
        };
        Some(Path::OnBounds { arcs: arcs?, chatter: 0.0 })
    }

    /// The arc between two states at which a law other than that of slip may chatter.
    fn arc(&self, from: &State, to: &State) -> BoundArc {
        let (kind, ends) = (if to.v < from.v { Kind::Wait } else { Kind::Jerk }, [*from, *to]);
        let length = match kind {
            Kind::Wait => wait(self.law, from, to, 0.0),
            Kind::Jerk => jerk(self.law, from, to, 0.0, self.ceiling),
        };
        BoundArc { kind, length, ends, span: (from.v - to.v).abs() / from.v / to.v }
    }

    /// First up at `v = 1`, then down on the ceiling: `spare` is the duration of the loop above the higher of both ends.
    fn wait_and_jerk(&self, spare: f64) -> Option<[BoundArc; 2]> {
        let (ceiling, rises) = (self.ceiling, self.rises());
        let base = if rises { &self.to } else { &self.from };
        let whole = up(self.law, base, ceiling, spare);
        let most = whole.back.min(ceiling * spare);
        let probe = |slip: f64| {
            let found = up(self.law, base, ceiling, (spare - slip / ceiling).max(0.0));
            Some(Probe { value: (slip - found.back) / most, slope: (1.0 + found.slope / ceiling) / most })
        };
        let slope = up(self.law, base, ceiling, 0.0).slope;
        let start = (slope * spare / (1.0 + slope / ceiling)).min(most);
        let slip = if most > 0.0 { newton(probe, start, (0.0, most), true, LAST_STEP_RESIDUAL)?.x } else { 0.0 };
        let time = (spare - slip / ceiling).max(0.0);
        let found = up(self.law, base, ceiling, time);
        Some(self.around(&found, [(Kind::Wait, time), (Kind::Jerk, slip)]))
    }

    /// First down on the ceiling, then up at `v = 1`: `spare` is the duration of the loop below the lower of both ends.
    fn fall_and_wait(&self, spare: f64) -> Option<[BoundArc; 2]> {
        let (ceiling, rises) = (self.ceiling, self.rises());
        let base = if rises { &self.from } else { &self.to };
        let probe = |slip: f64| {
            let found = down(self.law, base, ceiling, slip);
            Some(Probe {
                value: (slip / ceiling + found.back - spare) / spare,
                slope: (1.0 / ceiling + found.slope) / spare,
            })
        };
        let at_last = ceiling * (spare - down(self.law, base, ceiling, f64::MAX).back);
        // Both are below the root, since the time back is concave and bounded. Below the steady state of the ceiling theta rises on both arcs.
        let at_once = spare / (1.0 / ceiling + down(self.law, base, ceiling, 0.0).slope);
        let (bracket, start) = if base.excess < 0.0 {
            ((ceiling * spare, f64::INFINITY), at_last)
        } else {
            ((0.0, ceiling * spare), at_once.max(at_last).clamp(0.0, ceiling * spare))
        };
        let slip = if spare > 0.0 { newton(probe, start, bracket, true, LAST_STEP_RESIDUAL)?.x } else { 0.0 };
        let found = down(self.law, base, ceiling, slip);
        Some(self.around(&found, [(Kind::Jerk, slip), (Kind::Wait, found.back)]))
    }

    /// The arcs of a loop with their lengths; the direct way joins that on its bound.
    fn around(&self, Loop { turn, span, .. }: &Loop, order: [(Kind, f64); 2]) -> [BoundArc; 2] {
        let ends = [[self.from, *turn], [*turn, self.to]];
        [0, 1].map(|place| {
            let ((kind, length), ends) = (order[place], ends[place]);
            let is_direct = self.rises() == (kind == Kind::Wait);
            let (more, farther) = if is_direct { (self.direct(), self.span) } else { (0.0, 0.0) };
            BoundArc { kind, length: length + more, ends, span: (span + farther).abs() }
        })
    }

    /// Least duration of a path for the slip law through the state at which `T` vanishes, which is above that of the ceiling; 0 if an end is not
    /// above it.
    fn time_over_weakest(&self) -> f64 {
        let weakest = 1.0 / (self.b - self.a);
        let fall = weakest - self.from.below_floor;
        if fall <= 0.0 || weakest <= self.to.below_floor {
            return 0.0;
        }
        let rise = rise::time_from(weakest, self.to.below_floor, self.to.theta - exp(-weakest));
        ln_1p(fall / (self.ln_ceiling - weakest)) / self.ceiling + rise
    }

    /// Whether the proof holds at every state that a path of duration `t_f` may reach.
    fn is_proven(&self, t_f: f64) -> bool {
        if self.from.v > self.ceiling {
            return self.is_proven_down_to(&self.from);
        }
        let ceiling = State::steady(self.ceiling, self.ceiling);
        if self.is_proven_down_to(&ceiling) {
            return true;
        }
        if self.law == StateLaw::Slip {
            return t_f < self.time_over_weakest();
        }
        let spare = t_f - self.direct_time();
        if spare <= 0.0 {
            return self.is_proven_down_to(if self.rises() { &self.from } else { &self.to });
        }
        self.fall_and_wait(spare).is_some_and(|[fall, _]| self.is_proven_down_to(&fall.ends[1]))
    }
}

impl Path {
    /// The numbers of the path.
    fn solved(&self, problem: &Problem, t_f: f64) -> Solved<Relaxed> {
        let ((relaxed, least), stats) = match self {
            Path::OnBounds { arcs, chatter } => (on_bounds(problem, arcs, *chatter, t_f), SolverStats::default()),
            Path::Rise(rise) => rise.numbers(problem),
        };
        let status = if problem.is_proven(t_f) { Status::Ok } else { Status::Unproven };
        if !relaxed.optimum.work.is_finite() {
            return without(Status::NotConverged);
        }
        Solved { status: status.with_friction(least), value: Some(relaxed), stats }
    }
}

/// The numbers of two arcs on bounds between which it chatters for this time, and their least friction.
fn on_bounds(problem: &Problem, arcs: &[BoundArc; 2], chatter: f64, t_f: f64) -> (Relaxed, f64) {
    let [first, second] = arcs;
    let turn = first.ends[1];
    let [floor, ceiling] = bound_arc::times(arcs, problem.ceiling);
    let [least, greatest] = bound_arc::friction(arcs, problem);
    let velocity = |arc: &BoundArc, other: &BoundArc| {
        if arc.length > 0.0 { arc.velocity(problem) } else { other.velocity(problem) }
    };
    let price = problem.price(&turn);
    let optimum = Optimum {
        work: bound_arc::work(arcs, problem),
        v_start: velocity(first, second),
        v_end: velocity(second, first),
        time_at_floor: floor,
        time_at_v_ceiling: ceiling,
        time_at_tau_ceiling: 0.0,
        hamiltonian: price,
        theta_max: turn.theta.max(problem.from.theta).max(problem.to.theta),
        friction_max: greatest,
        strategy: if first.kind == Kind::Wait { Strategy::WaitJerk } else { Strategy::JerkWait },
    };
    if chatter == 0.0 {
        return (Relaxed { optimum, chatter: None }, least);
    }
    let [_, duty] = problem.duties(&turn);
    // Both bounds occur at the state of chattering.
    let pulses = [Kind::Wait, Kind::Jerk].map(|kind| BoundArc { kind, length: 1.0, ends: [turn; 2], span: 0.0 });
    let there = bound_arc::friction(&pulses, problem);
    let spare = (t_f - problem.direct_time()).max(0.0);
    let works = [problem.wait_and_jerk(spare), problem.fall_and_wait(spare)]
        .map(|arcs| arcs.map_or(f64::INFINITY, |arcs| bound_arc::work(&arcs, problem)));
    let velocity = |arc: &BoundArc| if arc.length > 0.0 { arc.velocity(problem) } else { 1.0 };
    let optimum = Optimum {
        work: optimum.work + chatter * price,
        v_start: velocity(first),
        v_end: velocity(second),
        time_at_floor: floor + chatter * (1.0 - duty),
        time_at_v_ceiling: ceiling + chatter * duty,
        friction_max: greatest.max(there[1]),
        strategy: Strategy::Chatter,
        ..optimum
    };
    let chatter = Chatter { time: chatter, theta: turn.theta, duty, work_bang_bang: works[0].min(works[1]) };
    (Relaxed { optimum, chatter: Some(chatter) }, least.min(there[0]))
}
