//! The least work with regularised friction and the ageing law, `tau = a asinh(v/2 exp((1 + b ln theta)/a))`, for `v > 0`.
//!
//! The cost `tau v` is strictly convex in the velocity down to rest, so the optimum is smooth without a floor: one extremal and one scalar root
//! (docs/derivations.md, "Regularised friction").

mod extremal;
mod motion;

use super::Motion;
use super::optimal::{Optimum, Slopes, Strategy};
use super::{Solved, SolverStats, Status};
use crate::model::arcsinh::{reduction, scaled_friction, steady_level};
use crate::model::{Law, Transition};
use crate::numerics::elementary::{exp, ln, ln_1p};
use crate::numerics::root::{LAST_STEP_RESIDUAL, crossing};
use crate::numerics::{LONG_ROUNDING_RTOL, MAX_LN, TIGHT_RTOL};
use extremal::{Extremal, Point, Sums};

/// The optimum and the derivatives of its work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regularised {
    /// Its numbers. No bound binds.
    pub optimum: Optimum,
    /// Derivatives of its work; those by ceilings are 0.
    pub slopes: Slopes,
}

/// A transition between steady states.
#[derive(Debug, Clone, Copy)]
struct Problem {
    transition: Transition,
    /// `ln theta` at both ends.
    ln_from: f64,
    ln_to: f64,
    /// `|ln(v_f/v_i)|`.
    ratio: f64,
    rises: bool,
}

/// The optimum of duration `t_f`, to rounding.
///
/// `Infeasible` unless `t_f` is above [`least_time`], and outside the domain (`a > 0`, `b >= 0`, `v_i, v_f > 0`, `t_f > 0`, all finite). `Unproven`
/// where steady friction at the least theta is not above `(b - a) tanh(tau/a)` by more than a ten-thousandth, which needs `b` close to `2 a` or more:
/// extremals need not be unique there.
pub fn solve(transition: &Transition, t_f: f64) -> Solved<Regularised> {
    extremal(transition, t_f).map(|(found, _)| found)
}

/// The optimum of duration `t_f` and its motion; see [`solve`].
pub fn motion(transition: &Transition, t_f: f64) -> (Solved<Regularised>, Option<Box<dyn Motion>>) {
    let mut solved = extremal(transition, t_f);
    let motion = solved.value.and_then(|(_, member)| motion::ExtremalMotion::new(member, t_f, &mut solved.stats));
    (solved.map(|(found, _)| found), motion.map(|motion| Box::new(motion) as Box<dyn Motion>))
}

/// The optimum and its extremal.
fn extremal(transition: &Transition, t_f: f64) -> Solved<(Regularised, Extremal)> {
    let mut stats = SolverStats::default();
    let problem = Problem::new(transition).filter(|problem| t_f.is_finite() && t_f > problem.least_time());
    let Some(problem) = problem else { return Solved::without_numbers(Status::Infeasible, stats) };
    let value = problem.optimum(t_f, &mut stats);
    let status = match value {
        _ if !problem.is_proven() => Status::Unproven,
        Some(_) => Status::Ok,
        None => Status::NotConverged,
    };
    Solved { status, value, stats }
}

/// The infimum of feasible durations, `1/v_f - 1/v_i` or 0: a block at rest ages at the rate 1; `None` outside the domain.
pub fn least_time(transition: &Transition) -> Option<f64> {
    Problem::new(transition).map(|problem| problem.least_time())
}

impl Problem {
    fn new(transition: &Transition) -> Option<Problem> {
        let &Transition { law: Law { a, b }, v_i, v_f } = transition;
        let is_inside = a > 0.0 && b >= 0.0 && v_i > 0.0 && v_f > 0.0;
        let is_finite = [a, b, v_i, v_f].iter().all(|number| number.is_finite());
        (is_inside && is_finite).then(|| Problem {
            transition: *transition,
            ln_from: -ln(v_i),
            ln_to: -ln(v_f),
            ratio: ln_1p((v_f - v_i).abs() / v_i.min(v_f)),
            rises: v_f < v_i,
        })
    }

    fn least_time(&self) -> f64 {
        let Transition { v_i, v_f, .. } = self.transition;
        ((v_i - v_f) / v_i / v_f).max(0.0)
    }

    /// Whether `tau_ss(theta)/theta` falls with theta everywhere, beyond rounding, so that each Hamiltonian has one turning point.
    fn is_proven(&self) -> bool {
        let law = self.transition.law;
        let level = steady_level(&law, self.ln_from.min(self.ln_to));
        law.a * scaled_friction(level) * (1.0 - MIN_SLOPE) > (law.b - law.a) * reduction(level).0
    }

    /// The member `q` of the family, in which duration rises with `q`.
    ///
    /// `theta_h = theta e^{q^2}` at the turning point, with the greater theta of both ends. For `q > 0` the extremal passes it. For `q < 0` it ends
    /// before it if theta rises, and begins after it if theta falls; below `-TURNING_CHART_END`, the excess of `-q` over it is that of `ln u` at the start.
    fn member(&self, q: f64) -> Option<Extremal> {
        let law = self.transition.law;
        let far = (q * q + self.ratio).sqrt();
        let length = if q < 0.0 { self.ratio / (far - q) } else { far + q };
        if self.rises {
            return Some(Extremal::turning(law, self.ln_to + q * q, -far, length));
        }
        if q >= -TURNING_CHART_END {
            return Some(Extremal::turning(law, self.ln_from + q * q, -q, length));
        }
        let slowest =
            Extremal::turning(law, self.ln_from + TURNING_CHART_END * TURNING_CHART_END, TURNING_CHART_END, 0.0)
                .at(0.0)?;
        Some(Extremal::falling(law, self.ln_from, slowest.ln_u - q - TURNING_CHART_END, self.ratio))
    }

    /// What the search compares: duration, or the time above the least one.
    fn measure(&self, sums: &Sums) -> f64 {
        if self.rises { sums.lag } else { sums.time }
    }

    /// The member of duration `t_f`.
    fn search(&self, t_f: f64, stats: &mut SolverStats) -> Option<(Extremal, Sums)> {
        let target = if self.rises { t_f - self.least_time() } else { t_f };
        let greater = self.transition.v_i.min(self.transition.v_f);
        let mut value = |q: f64| {
            let sums = self.member(q).and_then(|member| member.sums(&Sums::default(), stats));
            sums.map_or(f64::NAN, |sums| ln(self.measure(&sums).max(f64::MIN_POSITIVE) / target))
        };
        // Theta rises by the rate 1 at most.
        let mut bracket = [0.0, ln_1p(target * greater).sqrt()];
        let mut values = [if self.ratio > 0.0 { value(0.0) } else { -MAX_LN }, value(bracket[1])];
        let mut step = 0.25;
        // The fastest start lies within the range of doubles.
        while values[0] > 0.0 && step < MAX_LN {
            bracket = [bracket[0] - step, bracket[0]];
            values = [value(bracket[0]), values[0]];
            step *= 2.0;
        }
        if !(values[0] <= 0.0 && values[1] >= -LONG_ROUNDING_RTOL) {
            return None;
        }
        let width = bracket[1] - bracket[0];
        // The work is corrected to first order, and the other numbers change as much.
        let q = crossing(value, bracket, values, TIGHT_RTOL * width);
        let member = self.member(q)?;
        let sums = member.sums(&Sums::default(), stats)?;
        // The correction of the work leaves the square.
        let is_found = ln(self.measure(&sums) / target).abs() < LAST_STEP_RESIDUAL;
        is_found.then_some((member, sums))
    }

    fn optimum(&self, t_f: f64, stats: &mut SolverStats) -> Option<(Regularised, Extremal)> {
        let (member, sums) = self.search(t_f, stats)?;
        let Transition { law, v_i, v_f } = self.transition;
        let [start, end]: [Point; 2] = [member.at(0.0)?, member.at(1.0)?];
        let hamiltonian = member.hamiltonian();
        // To first order in what the search left of the duration.
        let left = if self.rises { t_f - self.least_time() - sums.lag } else { t_f - sums.time };
        let ln_theta_max = member.turning_point().unwrap_or(self.ln_from.max(self.ln_to));
        let optimum = Optimum {
            work: sums.work + hamiltonian * left,
            v_start: start.velocity(),
            v_end: end.velocity(),
            time_at_floor: 0.0,
            time_at_v_ceiling: 0.0,
            time_at_tau_ceiling: 0.0,
            hamiltonian,
            theta_max: exp(ln_theta_max),
            friction_max: member.friction_max()?,
            strategy: if start.velocity() > v_i { Strategy::SpeedUp } else { Strategy::SlowDown },
        };
        let slopes = Slopes {
            a: sums.by_law[0],
            b: sums.by_law[1],
            v_i: -start.costate(&law) / (v_i * v_i),
            v_f: end.costate(&law) / (v_f * v_f),
            v_ceiling: 0.0,
            tau_ceiling: 0.0,
        };
        optimum.work.is_finite().then_some((Regularised { optimum, slopes }, member))
    }
}

/// Least relative slope of `tau_ss(theta)/theta` of a proven optimum. Derived: the velocity keeps twelve digits.
const MIN_SLOPE: f64 = 1e-4;

/// `-q` above which the start counts by its velocity. Chosen: the turning point is then at `e` times theta, far from the extremal.
const TURNING_CHART_END: f64 = 1.0;
