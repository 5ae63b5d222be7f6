//! Regularised friction by its definition, with the standard library, and its optimum: the velocities that conserve the Hamiltonian of a row, by
//! bisection, take its time and its work.

use super::motion::bisect;
use super::{Checked, CheckedRow};
use crate::model::{Law, Transition};
use crate::numerics::radau::radau;
use crate::protocol::arcsinh::solve;

/// Panels of each branch. Chosen: shorter than the scale of the least `a`; the nodes near the turning point keep half the digits.
const PANELS: u32 = 60;

/// Rounding of a time, in units of that of friction over `a`, and of the inverse fall of `ln theta` from the turn. Derived: they are in proportion to
/// the inverse distance of the nodes from the turn, of which the first is at 1e-4 of the way.
const TURN_ROUNDINGS: f64 = 1e4;

/// Friction over `a`, and its derivative by `ln v`.
fn friction(law: &Law, ln_v: f64, ln_theta: f64) -> (f64, f64) {
    let ln_2z = ln_v + (1.0 + law.b * ln_theta) / law.a;
    let scaled = if ln_2z > 30.0 { ln_2z } else { (0.5 * ln_2z.exp()).asinh() };
    (scaled, scaled.tanh())
}

/// Friction.
pub fn tau(law: &Law, v: f64, theta: f64) -> f64 {
    law.a * friction(law, v.ln(), theta.ln()).0
}

/// `a` and `b` of the logarithm with the same derivatives at steady sliding.
pub fn linearised(law: &Law, v: f64) -> Law {
    let reduced = friction(law, v.ln(), -v.ln()).1;
    Law { a: law.a * reduced, b: law.b * reduced }
}

/// An extremal of the Hamiltonian `h`.
struct Extremal {
    law: Law,
    h: f64,
}

impl Extremal {
    /// `ln u` at `ln theta`, by bisection of `tau + a f (1 - u) = theta H`.
    fn ln_u(&self, ln_theta: f64, rises: bool) -> f64 {
        let target = ln_theta.exp() * self.h / self.law.a;
        bisect(0.0, if rises { -1600.0 } else { 60.0 }, |ln_u| {
            let (scaled, reduced) = friction(&self.law, ln_u - ln_theta, ln_theta);
            scaled - reduced * ln_u.exp_m1() > target
        })
    }

    /// Time, `int u dt` and work while `ln theta` goes between `low` and `high`, below the turning point `top` if there is one.
    fn branch(&self, [low, high]: [f64; 2], top: Option<f64>, rises: bool) -> [f64; 3] {
        let rule = radau();
        // ln theta = top - x^2, or linear in the part.
        let range = |place: f64| top.map_or(0.0, |top| (top - place).max(0.0).sqrt());
        let [near, far] = [range(high), range(low)];
        let mut sums = [0.0; 3];
        for panel in 0..PANELS {
            for (&u, &weight) in rule.u.iter().zip(&rule.w) {
                let part = (f64::from(panel) + u) / f64::from(PANELS);
                let weight = weight / f64::from(PANELS);
                let x = near + part * (far - near);
                let (ln_theta, slope) = match top {
                    Some(top) => (top - x * x, 2.0 * x * (far - near)),
                    None => (high - part * (high - low), high - low),
                };
                let ln_u = self.ln_u(ln_theta, rises);
                let dt = weight * slope * ln_theta.exp() / ln_u.exp_m1().abs();
                let scaled = friction(&self.law, ln_u - ln_theta, ln_theta).0;
                let lag = dt * ln_u.exp();
                let terms = [dt, lag, lag * (-ln_theta).exp() * self.law.a * scaled];
                sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            }
        }
        sums
    }

    /// The sums of the whole path of `problem`, with the greatest theta `theta_max` and the side of 1 of `u` at both ends.
    fn path(&self, problem: &Transition, theta_max: f64, [start_rises, end_rises]: [bool; 2]) -> [f64; 3] {
        let [start, end] = [-problem.v_i.ln(), -problem.v_f.ln()];
        if start_rises && !end_rises {
            let top = theta_max.ln();
            let [up, down] = [self.branch([start, top], Some(top), true), self.branch([end, top], Some(top), false)];
            return [0, 1, 2].map(|i| up[i] + down[i]);
        }
        let top = self.turning_point(start.max(end));
        self.branch([start.min(end), start.max(end)], top, start_rises)
    }

    /// `ln theta` of a turning point within a factor of 10 above `from`, by bisection.
    fn turning_point(&self, from: f64) -> Option<f64> {
        let excess = |w: f64| self.law.a * friction(&self.law, -w, w).0 - w.exp() * self.h;
        let high = from + 10f64.ln();
        (excess(high) <= 0.0).then(|| bisect(from, high, |w| excess(w) > 0.0))
    }
}

/// Relative rounding of the time of a path that turns at `theta_max`: close to the turn, friction over `theta_max H` is a small difference from 1.
fn turn_rounding(problem: &Transition, theta_max: f64) -> f64 {
    let ways = [problem.v_i, problem.v_f].map(|v| (theta_max * v).ln()).into_iter().filter(|way| *way > 0.0);
    let farthest = ways.clone().fold(0.0, f64::max);
    ways.map(|way| TURN_ROUNDINGS / problem.law.a * f64::EPSILON / (way * farthest).sqrt()).sum()
}

/// The work of the optimum of `problem` and `t_f` by the Hamiltonian `h` and the greatest theta of a solution, whose error of time is recorded;
/// `None` where the sides of both ends contradict each other.
fn certify(
    row: &mut CheckedRow<'_>,
    problem: &Transition,
    t_f: f64,
    [h, theta_max, v_start, v_end]: [f64; 4],
) -> Option<f64> {
    let extremal = Extremal { law: problem.law, h };
    let sides = [v_start < problem.v_i, v_end < problem.v_f];
    if sides == [false, true] {
        row.push("optimum", f64::INFINITY);
        return None;
    }
    let [time, lag, work] = extremal.path(problem, theta_max, sides);
    let rise = (problem.v_i - problem.v_f) / (problem.v_i * problem.v_f);
    // At rest theta rises as fast as it can: the slip counts.
    let error = if rise > 0.0 { lag / (t_f - rise) - 1.0 } else { time / t_f - 1.0 };
    for (v, theta, rises) in [(v_start, 1.0 / problem.v_i, sides[0]), (v_end, 1.0 / problem.v_f, sides[1])] {
        let expected = (extremal.ln_u(theta.ln(), rises) - theta.ln()).exp();
        row.push("velocity", if expected < 1e-300 { v } else { (v / expected - 1.0).abs() });
    }
    let error = (error.abs() - turn_rounding(problem, theta_max)).max(0.0);
    row.push("time", error * (h * if rise > 0.0 { t_f - rise } else { t_f } / work).abs().min(1.0));
    Some(work)
}

/// Checks a row of `optimal`.
pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, t_f) = (row.transition()?, row.axis("t_f")?);
    if !row.compare_feasible(t_f > (problem.v_i - problem.v_f) / problem.v_i / problem.v_f) {
        return Ok(());
    }
    let numbers = ["hamiltonian", "theta_max", "v_start", "v_end"].map(|column| row.number(column));
    let [Some(h), Some(theta_max), Some(v_start), Some(v_end)] = numbers else {
        return Err("a column is not written: hamiltonian, theta_max, v_start or v_end");
    };
    let work = certify(row, &problem, t_f, [h, theta_max, v_start, v_end]);
    let noise = turn_rounding(&problem, theta_max) / row.context.rtol;
    row.compare_relative("work", work, work.unwrap_or(1.0).abs() * (1.0 + noise));
    let greatest =
        if v_start < problem.v_i && v_end > problem.v_f { theta_max } else { 1.0 / problem.v_i.min(problem.v_f) };
    row.compare("theta_max", greatest);
    row.compare_word("strategy", if v_start > problem.v_i { "speed_up" } else { "slow_down" });
    Ok(())
}

/// The least work, confirmed as in [`check`].
pub fn least_work(row: &mut CheckedRow<'_>, problem: &Transition, t_f: f64) -> Option<f64> {
    let Some(found) = solve(problem, t_f).value.map(|found| found.optimum) else {
        row.compare("work_optimal", None);
        return None;
    };
    certify(row, problem, t_f, [found.hamiltonian, found.theta_max, found.v_start, found.v_end])
}
