//! The slip law heals faster than at `v = 1` while `theta < 1/e`: a deceleration may take less time than waiting does.
//!
//! On such an arc `H = -h` with `h > 0`. With `s = ln v`, `c = b - a` and `y = h/v`, all is elementary: `omega = -1 - ln(theta v) = (1 - c - c s)/(c + y)`,
//! `ln theta = -1 - omega - s`, `dt = -(y/(c + y)) ds/v`. The time is in closed form, and the arc ends where `v = 1`; then `v = 1`
//! (docs/derivations.md).

use std::f64::consts::E;

use super::{Chatter, Problem, Relaxed};
use crate::numerics::ROUNDING_RTOL;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p, phi};
use crate::numerics::gauss::{SHORT_NODES, rule};
use crate::numerics::root::{LAST_STEP_RESIDUAL, Probe, crossing, newton};
use crate::numerics::wright::wright_omega;
use crate::protocol::SolverStats;
use crate::protocol::optimal::{Optimum, Slopes, Strategy};

/// An arc faster than at `v = 1` and the time at `v = 1` after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rise {
    /// `-H`.
    h: f64,
    start: ArcPoint,
    end: ArcPoint,
    /// Change of `ln theta` on the arc.
    change: f64,
}

/// A place on the arc.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ArcPoint {
    /// `-ln theta`.
    below_floor: f64,
    omega: f64,
    /// `T = 1 + c ln theta`.
    strength: f64,
}

impl ArcPoint {
    /// The place at `-ln theta` of the arc with `h`.
    fn new(problem: &Problem, h: f64, below_floor: f64) -> ArcPoint {
        let strength = strength(problem, below_floor);
        ArcPoint { below_floor, omega: wright_omega(ln(strength / h) + below_floor - 1.0), strength }
    }

    /// `ln v`.
    fn ln_v(&self) -> f64 {
        self.below_floor - 1.0 - self.omega
    }
}

/// The least duration: `v = 1/(e theta)`, or the ceiling if that is less, up to `theta = 1/e`, then `v = 1`.
pub(super) fn least_time(problem: &Problem) -> f64 {
    let (from, to) = (problem.from.below_floor, problem.to.below_floor);
    let turn = 1.0 + problem.ln_ceiling;
    if from > turn {
        // ln(V theta) falls to -1 like e^-Vt.
        let on_ceiling = ln(from - problem.ln_ceiling) / problem.ceiling;
        return on_ceiling + time_from(turn, to, problem.to.theta - 1.0 / (E * problem.ceiling));
    }
    fastest_time(problem)
}

/// The duration of the fastest rise of the problem.
fn fastest_time(problem: &Problem) -> f64 {
    time_from(problem.from.below_floor, problem.to.below_floor, problem.span)
}

/// The least duration of a rise between two values of `-ln theta` by `span` of theta: `v = 1/(e theta)` up to `theta = 1/e`, then `v = 1`.
pub(super) fn time_from(from: f64, to: f64, span: f64) -> f64 {
    match () {
        () if to >= 1.0 => E * span,
        () if from <= 1.0 => ln(from / to),
        () => -exp_m1(1.0 - from) - ln(to),
    }
}

/// Greatest length of a panel in `ln v`: the poles at `y = -c` are `pi` off the axis for `c > 0`, so that the error is `3.4^-32`.
const MAX_PANEL: f64 = 4.0;

/// `h` in units of `v_i` at the least duration. There `omega` is below its reciprocal, and the duration that of the fastest rise to its square.
const MAX_STEEPNESS: f64 = 1e9;

/// Limit of minus the derivative of the logarithm of the excess with respect to `ln h`: the excess falls like `h^-2` (docs/derivations.md).
const GREATEST_SLOPE: f64 = 2.0;

/// Integrals along an arc of `T/(1 + omega)` over `ln theta`, and of `ln v` and `ln theta` over the slip.
type Sums = [f64; 3];

impl Rise {
    /// The rise of duration `t_f`, shorter than at `v = 1` throughout; `None` where `T` vanishes on the way.
    pub(super) fn new(problem: &Problem, t_f: f64) -> Option<Rise> {
        let from = problem.from.below_floor;
        let at_start = strength(problem, from);
        let least = at_start / (from - 1.0);
        if !(least > 0.0 && least.is_finite()) {
            return None;
        }
        let of_level = |level: f64| Rise::of_level(problem, least, level);
        let spare = t_f - fastest_time(problem);
        let slowest = of_level(0.0).wait_excess(problem);
        let steepest = ln(MAX_STEEPNESS * problem.from.v / least);
        let level = if spare <= of_level(steepest).excess_of_whole(problem)[0] {
            steepest
        } else if slowest - spare <= ROUNDING_RTOL * t_f {
            0.0
        } else {
            let probe = |level: f64| {
                let [excess, fall] = of_level(level).excess_of_whole(problem);
                // Far beyond the root rounding takes the digits of the slope, which stays below its limit.
                Some(Probe { value: ln(spare / excess), slope: (fall / excess).min(GREATEST_SLOPE) })
            };
            // The logarithm of the excess falls like -bend level^2 at first, at last like -2 level.
            let fall = ln(slowest / spare);
            let cube = ((from - 1.0) / from).powi(3);
            let bend = 0.5 * cube * at_start / ((1.0 - problem.weakening()) * slowest);
            let start = 0.25 * (fall + (fall * (fall + 16.0 / bend)).sqrt());
            let enough = LAST_STEP_RESIDUAL.max(ROUNDING_RTOL * t_f / spare);
            newton(probe, start, (0.0, steepest), true, enough)?.x
        };
        Some(of_level(level))
    }

    /// The rise with `h = least e^level`, where `least = T/omega` at `v = 1` at the start.
    fn of_level(problem: &Problem, least: f64, level: f64) -> Rise {
        let (from, to, c) = (problem.from.below_floor, problem.to.below_floor, problem.weakening());
        let (h, at_rest) = (least * exp(level), from - 1.0);
        let omega = wright_omega(at_rest + ln(at_rest) - level);
        let start = ArcPoint { below_floor: from, omega, strength: strength(problem, from) };
        let omega = (1.0 - c) / (c + h);
        let (end, change) = if 1.0 + omega >= from {
            (start, 0.0)
        } else if 1.0 + omega > to {
            (ArcPoint { below_floor: 1.0 + omega, omega, strength: h * omega }, from - (1.0 + omega))
        } else {
            (ArcPoint::new(problem, h, to), problem.ratio)
        };
        Rise { h, start, end, change }
    }

    /// `omega` at the start less that at `to`, where `ln theta` is higher by `change`.
    fn fall_of_omega(&self, problem: &Problem, to: &ArcPoint, change: f64) -> f64 {
        // One step of Newton's method restores the digits that the difference loses.
        let fall = self.start.omega - to.omega;
        let sum = change + ln_1p(-problem.weakening() * change / to.strength);
        fall - (fall + ln_1p(fall / to.omega) - sum) / (1.0 + 1.0 / self.start.omega)
    }

    /// `ln v` at the start less that at the end.
    fn fall_of_ln_v(&self, problem: &Problem) -> f64 {
        let fall = self.fall_of_omega(problem, &self.end, self.change);
        if self.end.omega < 1.0 {
            return self.change - fall;
        }
        // v = h omega/T. The difference above would lose digits where v hardly changes.
        ln_1p(fall / self.end.omega) - ln_1p(-problem.weakening() * self.change / self.end.strength)
    }

    /// From the start to `to`, where `ln theta` is higher by `change`: duration less that of the fastest rise, minus its derivative with respect to
    /// `ln h`, and slip.
    fn excess(&self, problem: &Problem, to: &ArcPoint, change: f64) -> [f64; 3] {
        if change == 0.0 {
            return [0.0; 3];
        }
        let (c, h, from) = (problem.weakening(), self.h, &self.start);
        let fall = self.fall_of_omega(problem, to, change);
        // c/y at both ends, and ln((1 + c/y_0)/(1 + c/y_1)).
        let [r0, r1] = [from, to].map(|place| c * place.omega / place.strength);
        let growth = c * (fall * to.strength + to.omega * c * change) / (from.strength * to.strength);
        let ln_growth = ln_1p(growth / (1.0 + r1));
        let slip = change - fall - ln_growth;
        let left = exp(-to.omega);
        let bend = phi(-fall);
        // 1 - (1 + omega) e^-omega.
        let early = left * phi(to.omega);
        let by_strength = to.strength * (fall * early + to.omega * left * bend) / (from.omega * to.omega);
        let by_weakening = fall + ln_growth - change * phi(-from.omega) / from.omega;
        // The derivatives of both ends with respect to ln h.
        let moved = |place: &ArcPoint, r: f64| place.strength / ((1.0 + place.omega) * (1.0 + r));
        let by_level = c * (slip - 1.0 / (1.0 + r1) + 1.0 / (1.0 + r0));
        [(by_strength + c * by_weakening) / h, (moved(to, r1) - moved(from, r0) - by_level) / h, slip]
    }

    /// Duration less the least one, and minus its derivative with respect to `ln h`.
    fn excess_of_whole(&self, problem: &Problem) -> [f64; 2] {
        let [excess, fall, _] = self.excess(problem, &self.end, self.change);
        [excess + self.wait_excess(problem), fall]
    }

    /// The time at `v = 1` up to the turn of the fastest rise, less that of the fastest rise.
    fn wait_excess(&self, problem: &Problem) -> f64 {
        let to = problem.to.below_floor;
        // The arc ends at v = 1, where -ln theta = 1 + omega, or at the target.
        let (turn, more, fastest) =
            if to < 1.0 { (1.0, self.end.omega, 1.0) } else { (to, self.end.below_floor - to, E * problem.to.theta) };
        ln_1p(more / turn) + fastest * exp_m1(-more)
    }

    /// `-ln theta` where the arc ends.
    pub(super) fn end(&self) -> f64 {
        self.end.below_floor
    }

    /// The velocity at the start.
    pub(super) fn v_start(&self) -> f64 {
        exp(self.start.ln_v())
    }

    /// The derivatives of the work.
    pub(super) fn slopes(&self, problem: &Problem) -> Slopes {
        let (a, to) = (problem.a, problem.to.below_floor);
        let [_, by_a, by_b] = self.sums(problem, &mut SolverStats::default());
        // The costate is -(tau + a)/(theta omega) on the arc, and (H - tau)/theta' at v = 1.
        let costate = |place: &ArcPoint| (place.strength - a * place.omega) / place.omega;
        let at_end = if self.wait(problem) > 0.0 { (self.h + 1.0 - problem.b * to) / to } else { costate(&self.end) };
        Slopes {
            a: by_a,
            b: by_b - (self.end.below_floor - to),
            v_i: problem.from.theta * costate(&self.start),
            v_f: -problem.to.theta * at_end,
            v_ceiling: 0.0,
            tau_ceiling: 0.0,
        }
    }

    /// Velocity on the arc at `-ln theta`.
    pub(super) fn velocity(&self, problem: &Problem, below_floor: f64) -> f64 {
        exp(ArcPoint::new(problem, self.h, below_floor).ln_v())
    }

    /// The time at `v = 1`.
    pub(super) fn wait(&self, problem: &Problem) -> f64 {
        let to = problem.to.below_floor;
        ln_1p((self.end.below_floor - to) / to)
    }

    /// Duration of the arc from the start to `-ln theta`.
    pub(super) fn time(&self, problem: &Problem, below_floor: f64) -> f64 {
        let change = problem.from.below_floor - below_floor;
        let [excess, ..] = self.excess(problem, &ArcPoint::new(problem, self.h, below_floor), change);
        excess + E * problem.from.theta * exp_m1(change)
    }

    /// The sums along the arc.
    fn sums(&self, problem: &Problem, stats: &mut SolverStats) -> Sums {
        let (rule, c, h) = (rule(SHORT_NODES), problem.weakening(), self.h);
        let length = self.fall_of_ln_v(problem);
        let (mut sums, mut left) = ([0.0; 3], length);
        // h/v at the end, where the difference in `ln_v` would lose digits.
        let end_y = self.end.strength / self.end.omega;
        let end = ln(h / end_y);
        while left > 0.0 {
            // For c < 0 there is a pole beyond the start.
            let far = if c < 0.0 { 2.0 * ln(h / -c) - 2.0 * (end + left) } else { MAX_PANEL };
            let panel = left.min(MAX_PANEL).min(far);
            for (&node, &weight) in rule.x.iter().zip(&rule.w) {
                let rise = left - 0.5 * panel * (1.0 + node);
                let (ln_v, y) = (end + rise, end_y * exp(-rise));
                let (omega, slope) = ((1.0 - c - c * ln_v) / (c + y), y / (c + y));
                let weight = 0.5 * panel * weight * slope;
                sums[0] += weight * slope * omega * (c + y);
                sums[1] += weight * ln_v;
                sums[2] -= weight * (1.0 + omega + ln_v);
            }
            stats.nodes += SHORT_NODES as u32;
            left = if panel == left { 0.0 } else { left - panel };
        }
        stats.quadratures += 1;
        sums
    }

    /// The numbers, the least friction, and solver statistics.
    pub(super) fn numbers(&self, problem: &Problem) -> ((Relaxed, f64), SolverStats) {
        let (to, mut stats) = (problem.to.below_floor, SolverStats::default());
        let [work, ..] = self.sums(problem, &mut stats);
        let wait = self.wait(problem);
        let friction = |place: &ArcPoint| place.strength - problem.a * (1.0 + place.omega);
        let ends = [friction(&self.start), friction(&self.end), 1.0 - problem.b * to];
        let most = ends[0].max(ends[1]).max(if wait > 0.0 { ends[2] } else { ends[1] });
        let optimum = Optimum {
            work: work - problem.a * self.change + wait - problem.b * (self.end.below_floor - to),
            v_start: self.v_start(),
            v_end: if wait > 0.0 { 1.0 } else { exp(self.end.ln_v()) },
            time_at_floor: wait,
            time_at_v_ceiling: 0.0,
            time_at_tau_ceiling: 0.0,
            hamiltonian: -self.h,
            theta_max: problem.to.theta,
            friction_max: self.top(problem).map_or(most, |top| most.max(top)),
            strategy: Strategy::Rise,
        };
        let chatter: Option<Chatter> = None;
        ((Relaxed { optimum, chatter }, ends[0].min(ends[1])), stats)
    }

    /// The maximum of friction inside the arc, if it has one.
    fn top(&self, problem: &Problem) -> Option<f64> {
        let (a, b, c, h) = (problem.a, problem.b, problem.weakening(), self.h);
        let omega = |y: f64, ln_v: f64| (1.0 - c - c * ln_v) / (c + y);
        // Of the sign of the derivative with respect to ln v, which falls along the arc.
        let slope = |ln_v: f64| {
            let y = h * exp(-ln_v);
            a * (c + y) - b * y * (1.0 + omega(y, ln_v))
        };
        let ends = [self.end.ln_v(), self.start.ln_v()];
        let slopes = ends.map(slope);
        if !(slopes[0] > 0.0 && slopes[1] < 0.0) {
            return None;
        }
        // At a maximum, half of the digits are enough.
        let ln_v = crossing(slope, ends, slopes, f64::EPSILON.sqrt() * (1.0 + ends[1]));
        Some(1.0 + a * ln_v - b * (1.0 + omega(h * exp(-ln_v), ln_v) + ln_v))
    }
}

/// `T = 1 + c ln theta` at `-ln theta`.
fn strength(problem: &Problem, below_floor: f64) -> f64 {
    1.0 - problem.weakening() * below_floor
}
