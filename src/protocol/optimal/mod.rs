//! The optimal protocol: least work of friction from `(v_i, 1/v_i)` to `(v_f, 1/v_f)` in time `t_f`.
//!
//! It is a quadrature and one scalar root (docs/theory.md): a regular `arc` along which `C` is conserved, under the
//! bound `v >= 1` after a `hold`; the family of such `extremal`s has one parameter, in which the time is monotone.

mod arc;
pub mod crossover;
mod extremal;
mod hold;
mod lifetime;
mod motion;
mod route;
mod search;

use super::{Effort, Motion, Solved, Status};
use crate::model::{Law, Transition};
use crate::numerics::elementary::ln;
use extremal::Problem;
use lifetime::Lifetime;

pub(super) use motion::Optimal as Route;
pub(super) use route::{Site, Span};

/// How the optimal protocol starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Strategy {
    /// Jumps up: `v(0+) > v_i`.
    SpeedUp,
    /// Jumps down, but stays off the bound: `1 < v(0+) <= v_i`.
    SlowDown,
    /// Starts on the bound `v = 1`.
    Hold,
}

impl Strategy {
    /// All strategies, in their order.
    pub const ALL: [Strategy; 3] = [Strategy::SpeedUp, Strategy::SlowDown, Strategy::Hold];

    /// The name that is written into tables.
    pub fn name(self) -> &'static str {
        match self {
            Strategy::SpeedUp => "speed_up",
            Strategy::SlowDown => "slow_down",
            Strategy::Hold => "hold",
        }
    }
}

/// The optimal protocol of one transition in one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optimum {
    /// Least work `W*` (scaled: `mu_0 sigma l`).
    pub work: f64,
    /// Velocity just after the start, `v(0+)`.
    pub v_start: f64,
    /// Velocity just before the end, `v(t_f-)`.
    pub v_end: f64,
    /// Time spent on the bound `v = 1`.
    pub hold_time: f64,
    /// `dW*/dt_f = -C`, the Hamiltonian.
    pub hamiltonian: f64,
    /// Largest contact lifetime on the way.
    pub theta_max: f64,
    /// How it starts.
    pub strategy: Strategy,
}

/// Solves one optimal protocol to relative accuracy `rtol`, with `v >= 1` where `bounded`.
///
/// `Infeasible` where no protocol is fast enough under the bound (`t_f < t_min`), or where an argument is outside its
/// domain (`a > 0`, `b >= 0`, `v_i, v_f > 1`, `t_f > 0`, all finite). Without the bound, `BelowBound` where `v(0+) <
/// 1`.
pub fn solve(transition: &Transition, t_f: f64, bounded: bool, rtol: f64) -> Solved<Optimum> {
    let Some(problem) = Problem::of(transition, bounded).filter(|_| t_f > 0.0 && t_f.is_finite()) else {
        return Solved { status: Status::Infeasible, value: None, effort: Effort::default() };
    };
    search::solve(&problem, t_f, rtol)
}

/// The same protocol, and its motion wherever it has numbers.
///
/// Time is good to `rtol`, or 1e-12 if that is less, of `t_f`; on the arc also of what is left of it. `v`, `theta` and
/// `friction` belong to the extremal to a few units in the last place. The costate `beta` is the one of the Hamiltonian
/// `H = tau v - beta theta' = -C`, so `beta = -dV/dtheta` with `V(theta, time left)` the least work: `1 + a + a ln v +
/// b ln theta + beta theta = 0` on the arc, and `beta = (C + tau)/(1 - theta)` on the bound `v = 1`, continuous where
/// the arc begins.
pub fn motion(
    transition: &Transition,
    t_f: f64,
    bounded: bool,
    rtol: f64,
) -> (Solved<Optimum>, Option<Box<dyn Motion>>) {
    let (solved, route) = route(transition, t_f, bounded, rtol);
    (solved, route.map(|route| Box::new(route) as Box<dyn Motion>))
}

/// The same protocol, and the route that it takes.
pub(super) fn route(transition: &Transition, t_f: f64, bounded: bool, rtol: f64) -> (Solved<Optimum>, Option<Route>) {
    let Some(problem) = Problem::of(transition, bounded).filter(|_| t_f > 0.0 && t_f.is_finite()) else {
        return (Solved { status: Status::Infeasible, value: None, effort: Effort::default() }, None);
    };
    let (solved, extremal) = search::find(&problem, t_f, rtol.min(MOTION_RTOL));
    let route = solved.value.map(|_| Route::new(&problem, t_f, extremal));
    (solved, route)
}

/// Accuracy of every motion: the time on the arc is what is left of `t_f` after the hold.
const MOTION_RTOL: f64 = 1e-12;

/// The least time in which there is a protocol with `v >= 1`, or `v > 0` without the bound; 0 for an acceleration.
pub fn shortest_time(transition: &Transition, bounded: bool) -> Option<f64> {
    Some(Problem::of(transition, bounded)?.t_min())
}

/// What the optimal protocol would do now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Feedback {
    /// Its velocity.
    pub v: f64,
    /// How hard the bound is pressed: the derivative of the cost rate with respect to `v` there, 0 off the bound.
    pub pressure: f64,
}

/// Optimal feedback: what the optimal protocol does now, at contact lifetime `theta` with `time_left` to reach
/// `theta_f`; `fall` is `theta/theta_f - 1`. `None` where no protocol arrives in time, or where the solver could not
/// certify its answer.
#[allow(clippy::too_many_arguments)]
pub(super) fn feedback(
    law: Law,
    theta: f64,
    theta_f: f64,
    fall: f64,
    time_left: f64,
    bounded: bool,
    rtol: f64,
    effort: &mut Effort,
) -> Option<Feedback> {
    let problem = Problem { law, from: Lifetime::new(theta), to: Lifetime::new(theta_f), fall, bounded };
    let solved = search::solve(&problem, time_left, rtol);
    effort.quadratures += solved.effort.quadratures;
    effort.nodes += solved.effort.nodes;
    let optimum = solved.value?;
    let pressure = if optimum.strategy == Strategy::Hold {
        // On the bound -C = friction + V_theta (1 - theta) gives V_theta.
        let friction = 1.0 + law.b * ln(theta);
        let v_theta = (optimum.hamiltonian - friction) / (1.0 - theta);
        (friction + law.a - v_theta * theta).max(0.0)
    } else {
        0.0
    };
    Some(Feedback { v: optimum.v_start, pressure })
}

impl Problem {
    /// The problem of a transition between steady states; `None` outside the domain.
    fn of(transition: &Transition, bounded: bool) -> Option<Problem> {
        let &Transition { law, v_i, v_f } = transition;
        let inside = law.a > 0.0 && law.b >= 0.0 && v_i > 1.0 && v_f > 1.0;
        let finite = law.a.is_finite() && law.b.is_finite() && v_i.is_finite() && v_f.is_finite();
        (inside && finite).then(|| Problem {
            law,
            from: Lifetime::steady(v_i),
            to: Lifetime::steady(v_f),
            fall: (v_f - v_i) / v_i,
            bounded,
        })
    }
}
