//! The times at which the optimal strategy changes: closed forms, one quadrature each.

use super::clamp::Path;
use super::extremal::{Extremal, Problem};
use super::floor;
use super::search::{is_proven, quadrature_tolerance};
use crate::model::{Law, Transition};
use crate::numerics::turning::turning;
use crate::protocol::{SolverStats, Status};

/// The special times of one transition, each with the work `W*` there; `None` where the time does not exist.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CrossoverTimes {
    /// Acceleration: `v(0+) = v_i`.
    pub t_cross: Option<f64>,
    /// Acceleration: `v(0+)` reaches the bound 1.
    pub t_floor: Option<f64>,
    /// Acceleration: least `W*` over `t_f`.
    pub t_cheapest: Option<f64>,
    /// Deceleration: shortest possible time under `v >= 1`.
    pub t_min: Option<f64>,
    /// Deceleration: `v(t_f-) = v_f`, the inflection of `W*`.
    pub t_turn: Option<f64>,
    /// Deceleration: start of the window above the floor.
    pub t_free_in: Option<f64>,
    /// Deceleration: end of the window above the floor.
    pub t_free_out: Option<f64>,
    /// `W*` at `t_cross`.
    pub work_at_t_cross: Option<f64>,
    /// `W*` at `t_floor`.
    pub work_at_t_floor: Option<f64>,
    /// `W*` at `t_cheapest`.
    pub work_at_t_cheapest: Option<f64>,
    /// `W*` at `t_min`.
    pub work_at_t_min: Option<f64>,
    /// `W*` at `t_turn`.
    pub work_at_t_turn: Option<f64>,
}

/// The requested columns; others are not computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// `t_cross` or `work_at_t_cross`.
    pub cross: bool,
    /// `t_floor` or `work_at_t_floor`.
    pub floor: bool,
    /// `t_cheapest` or `work_at_t_cheapest`.
    pub cheapest: bool,
    /// `t_min`, `work_at_t_min`.
    pub min: bool,
    /// `t_turn`, `work_at_t_turn`.
    pub turn: bool,
    /// `t_free_in`, `t_free_out`.
    pub free: bool,
}

/// All special times of a transition, to relative accuracy `rtol`; `bounded` states whether `v >= 1` is imposed (`t_min`
/// and the window above the floor do not exist otherwise).
///
/// Each is one quadrature, no search over `t_f` (docs/derivations.md, "Crossover times"). The status is `Unproven` where
/// friction falls to `max(0, b - a)` on one of the paths whose extremal is not proved to be the only one, `NegativeFriction` where it falls below 0, `Infeasible` outside the domain of the law, `NotConverged`
/// where a quadrature failed.
pub fn solve(
    transition: &Transition,
    bounded: bool,
    rtol: f64,
    wanted: Wanted,
) -> (Status, CrossoverTimes, SolverStats) {
    let mut times = CrossoverTimes::default();
    let Some(problem) = Problem::of(transition, bounded) else {
        return (Status::Infeasible, times, SolverStats::default());
    };
    let mut quadratures =
        Quadratures { problem, rtol, status: Status::Ok, friction: f64::INFINITY, stats: SolverStats::default() };
    if transition.v_f > transition.v_i {
        acceleration(&mut quadratures, wanted, &mut times);
    } else {
        deceleration(&mut quadratures, wanted, &mut times);
    }
    (quadratures.status.with_friction(quadratures.friction), times, quadratures.stats)
}

/// The quadratures of one transition, with the worst status met.
struct Quadratures {
    problem: Problem,
    rtol: f64,
    status: Status,
    /// Least friction on any of the paths.
    friction: f64,
    stats: SolverStats,
}

impl Quadratures {
    /// Takes in the least friction of a path. Where it is low, `is_proven` decides whether the extremal is the only one.
    fn meet(&mut self, friction: f64, is_proven: impl FnOnce() -> bool) {
        self.friction = self.friction.min(friction);
        if friction <= self.problem.unique_above() && !is_proven() {
            self.status = self.status.max(Status::Unproven);
        }
    }

    /// Time and work of an extremal that exists.
    fn measure(&mut self, extremal: Option<Extremal>) -> (Option<f64>, Option<f64>) {
        let sums = extremal.as_ref().and_then(|e| e.arc.sums(quadrature_tolerance(self.rtol)));
        let (Some(extremal), Some(sums)) = (extremal, sums) else {
            // Where friction fails already in a steady state, no arc need exist.
            let failed = if self.problem.is_doubtful() { Status::Unproven } else { Status::NotConverged };
            self.status = self.status.max(failed);
            return (None, None);
        };
        self.stats.quadratures += 1;
        self.stats.nodes += sums.nodes;
        let problem = self.problem;
        let least = Path::of(&problem, extremal).friction(&problem, sums.friction_min).least;
        self.meet(least, || is_proven(&problem, &extremal));
        (Some(extremal.time(&sums)), Some(extremal.work(&self.problem, &sums)))
    }
}

/// `v_f > v_i`. Each time exists exactly where `E > 0` all along its arc, which the friction at the two ends decides.
fn acceleration(quadratures: &mut Quadratures, wanted: Wanted, times: &mut CrossoverTimes) {
    let problem = quadratures.problem;
    let Law { a, b } = problem.law;
    let friction_0 = problem.friction_a();
    let friction_1 = problem.friction_end();
    let ln_v_i = -problem.from.ln;
    let ratio = 1.0 + problem.fall;
    if wanted.cross && friction_0 > b - a && ratio * friction_1 > friction_0 {
        (times.t_cross, times.work_at_t_cross) = quadratures.measure(problem.extremal(0.0, None));
    }
    if wanted.floor && 1.0 - b * ln_v_i > b - a && ratio * friction_1 > 1.0 + a - b * ln_v_i - a * problem.from.theta {
        let unheld = Problem { bounded: true, ..problem }.q_floor().and_then(|q| problem.extremal(q, None));
        (times.t_floor, times.work_at_t_floor) = quadratures.measure(unheld);
    }
    if wanted.cheapest && friction_0 > 0.0 && friction_1 > 0.0 {
        let z_0 = turning((2.0 * friction_0 / a).sqrt()).ln_u;
        (times.t_cheapest, times.work_at_t_cheapest) = quadratures.measure(problem.extremal(z_0, None));
    }
}

/// `v_f <= v_i`.
fn deceleration(quadratures: &mut Quadratures, wanted: Wanted, times: &mut CrossoverTimes) {
    let problem = quadratures.problem;
    let Law { a, b } = problem.law;
    if wanted.min && problem.bounded {
        let t_min = problem.t_min();
        times.t_min = Some(t_min);
        times.work_at_t_min = Some(floor::work(&problem.law, problem.from, t_min));
        // No other protocol is as fast.
        quadratures.meet(1.0 + b * problem.from.ln, || true);
    }
    let turns = problem.friction_end() > b - a;
    if wanted.turn && turns {
        (times.t_turn, times.work_at_t_turn) =
            if problem.rises() { quadratures.measure(problem.extremal(0.0, None)) } else { (Some(0.0), Some(0.0)) };
    }
    if wanted.free
        && problem.bounded
        && turns
        && 1.0 + b * problem.from.ln > b - a
        && let Some([rising, falling]) = problem.free_window()
    {
        times.t_free_in = quadratures.measure(Some(rising)).0;
        times.t_free_out = quadratures.measure(Some(falling)).0;
    }
}
