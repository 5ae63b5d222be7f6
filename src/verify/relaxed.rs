//! The optimum for the laws of slip and of Perrin, Rice and Zheng: its arcs, integrated from the equations, arrive with its work; the price of holding
//! theta is least where the path turns or rests.

use super::CheckedRow;
use super::motion::{bisect, lowest};
use super::route::integrate;
use crate::model::{Law, StateLaw, Transition};
use crate::numerics::{LONG_ROUNDING_RTOL, NEGLIGIBLE_LN};
use crate::protocol::optimal::{Optimum, Strategy};
use crate::protocol::relaxed::{self, Relaxed};
use crate::protocol::{Solved, Status};

/// Slip of the longest arc on the ceiling. Chosen: beyond, rounding of its end may decide the price there.
const MAX_SLIP: f64 = 5000.0;

const TOO_LONG: &str = "an arc is too long";

/// Difference of `ln theta` at which a price is above its minimum. Chosen: a minimum is flat to half the digits.
const PRICE_STEP: f64 = 1e-4;

/// A law, a material and its ceiling.
#[derive(Debug, Clone, Copy)]
struct Block {
    state: StateLaw,
    law: Law,
    ceiling: f64,
}

/// `ln theta` at the end of an arc, its work and the derivative of that with respect to `b`.
struct Arc {
    end: f64,
    work: f64,
    by_b: f64,
}

impl Block {
    fn friction(&self, w: f64, v: f64) -> f64 {
        1.0 + self.law.a * v.ln() + self.law.b * w
    }

    /// `d ln theta/dt` at `w = ln theta`.
    fn rate(&self, w: f64, v: f64) -> f64 {
        self.state.rate(w.exp() * v) / w.exp()
    }

    /// The arc of duration `t` at the velocity `v`; `None` if it is too long.
    fn follow(&self, w: f64, v: f64, t: f64) -> Option<Arc> {
        let all = v * t;
        if v > 1.0 && all > MAX_SLIP {
            return None;
        }
        // Both laws forget the start as e^-slip; then theta is steady to rounding.
        let slip = all.clamp(0.0, NEGLIGIBLE_LN);
        let slope = |y: &[f64; 3]| [self.rate(y[0], v) / v, self.friction(y[0], v), y[0]];
        let [end, work, by_b] = integrate(slope, [w, 0.0, 0.0], (0.0, slip))?;
        let rest = all - slip;
        let end = if rest > 0.0 { -v.ln() } else { end };
        Some(Arc { end, work: work + rest * self.friction(end, v), by_b: by_b + rest * end })
    }

    /// What holding theta costs per unit of time, by the mixture of both bounds that keeps it; infinite where the slip law heals faster on the
    /// ceiling than at `v = 1`.
    fn price(&self, w: f64) -> f64 {
        let [slow, fast] = [1.0, self.ceiling].map(|v| (self.rate(w, v), self.friction(w, v) * v));
        if fast.0 >= slow.0 {
            return f64::INFINITY;
        }
        let duty = slow.0 / (slow.0 - fast.0);
        duty * fast.1 + (1.0 - duty) * slow.1
    }

    /// Compares the derivatives of the work with respect to the velocities of both `ends`, by the costate `(H - tau v)/theta'`.
    fn compare_costates(&self, row: &mut CheckedRow<'_>, optimum: &Optimum, [start, end]: [f64; 2]) {
        let Optimum { hamiltonian, v_start, v_end, .. } = *optimum;
        for (column, sign, w, v) in [("dwork_dv_i", -1.0, start, v_start), ("dwork_dv_f", 1.0, end, v_end)] {
            let (theta, power) = (w.exp(), self.friction(w, v) * v);
            let rate = self.state.rate(theta * v) / (theta * theta);
            let size = (hamiltonian.abs() + power.abs()) / rate.abs();
            row.compare_number(column, sign * (hamiltonian - power) / rate, size);
        }
    }

    /// Whether the direct way, at `v = 1` or on the ceiling, takes longer than `t_f`; `None` if it is too long to integrate.
    fn is_short(&self, &Transition { v_i, v_f, .. }: &Transition, t_f: f64) -> Option<bool> {
        if v_f >= self.ceiling {
            return Some(true);
        }
        let (start, end) = (-v_i.ln(), -v_f.ln());
        if end > start && self.state == StateLaw::Slip && start < -1.0 {
            // The fastest rise, v = 1/(e theta) up to theta = 1/e.
            let (turn, capped) = (end.min(-1.0), -1.0 - self.ceiling.ln());
            let on_ceiling = if start < capped { (capped - start + 1.0).ln() / self.ceiling } else { 0.0 };
            let least = std::f64::consts::E * (turn.exp() - start.max(capped).exp()) + (turn / end).ln() + on_ceiling;
            return Some(t_f < least * (1.0 + 1e-9));
        }
        let v = if end > start { 1.0 } else { self.ceiling };
        let reached = self.follow(start, v, t_f)?.end;
        Some(if end > start { reached < end + 1e-9 } else { reached > end - 1e-9 })
    }

    /// `ln u` of a rise at `w`, by bisection.
    fn rise_ln_u(&self, w: f64, h: f64) -> f64 {
        let strength = 1.0 + (self.law.b - self.law.a) * w;
        bisect(-700.0, -1.0, |ln_u| strength * ln_u.exp() < -h * w.exp() * (1.0 + ln_u))
    }

    /// Time and work of a rise of the slip law from `from` to `to` in `ln theta`, with `H = -h`: `H = tau v - (tau v)_g g` on the branch that
    /// heals faster than at `v = 1`, at which `u < 1/e` solves `T u = -h theta (1 + ln u)`.
    fn rise(&self, from: f64, to: f64, h: f64) -> Option<[f64; 2]> {
        let slope = |y: &[f64; 3]| {
            let v = (self.rise_ln_u(y[0], h) - y[0]).exp();
            let dt = 1.0 / self.rate(y[0], v);
            [1.0, dt, dt * v * self.friction(y[0], v)]
        };
        integrate(slope, [from, 0.0, 0.0], (from, to)).map(|[_, time, work]| [time, work])
    }
}

/// The least work of a law other than ageing. The error of its arcs is a difference of the column `optimum`; the numbers of a row of `optimal` that
/// follow from them are compared, too.
pub fn certify(row: &mut CheckedRow<'_>, problem: &Transition, state: StateLaw, t_f: f64) -> Solved<f64> {
    let block = Block { state, law: problem.law, ceiling: row.bounds().v_ceiling };
    let solved = relaxed::solve(state, problem, t_f, block.ceiling);
    let ends = [-problem.v_i.ln(), -problem.v_f.ln()];
    let error = match &solved.value {
        None if solved.status != Status::Infeasible => Err("optima without a proof"),
        None => block.is_short(problem, t_f).map(|is_short| if is_short { 0.0 } else { f64::INFINITY }).ok_or(TOO_LONG),
        Some(found) if found.optimum.strategy == Strategy::Rise => {
            rise(row, &block, &found.optimum, (ends, t_f)).ok_or(TOO_LONG)
        }
        Some(found) => bang_bang(row, &block, found, (ends, t_f), solved.status == Status::Ok).ok_or(TOO_LONG),
    };
    match error {
        Ok(error) => row.push("optimum", error),
        Err(reason) => row.miss(reason),
    }
    solved.map(|found| found.optimum.work)
}

/// Relative difference of a number from the expected one.
fn apart(found: f64, expected: f64) -> f64 {
    if found == expected { 0.0 } else { ((found - expected) / expected).abs() }
}

/// The greatest of some errors; infinite if one is not a number.
fn greatest(errors: &[f64]) -> f64 {
    errors.iter().fold(0.0, |greatest, error| if error.is_nan() { f64::INFINITY } else { error.max(greatest) })
}

/// The error of a path of one arc on each bound, between which theta may rest while they alternate; `None` if the integrator fails.
fn bang_bang(
    row: &mut CheckedRow<'_>,
    block: &Block,
    &Relaxed { optimum, chatter }: &Relaxed,
    (ends, t_f): ([f64; 2], f64),
    is_proven: bool,
) -> Option<f64> {
    let Optimum { time_at_floor: floor, time_at_v_ceiling: fast, .. } = optimum;
    let [start, end] = ends;
    let (time, duty) = chatter.map_or((0.0, 0.0), |chatter| (chatter.time, chatter.duty));
    let [wait, jerk] = [(1.0, floor - time * (1.0 - duty)), (block.ceiling, fast - time * duty)];
    let toward = |from: f64, to: f64| if to > from { wait } else { jerk };
    let rest = chatter.map(|chatter| chatter.theta.ln());
    let [(v, t), (v_next, t_next)] = match rest {
        Some(rest) => [toward(start, rest), toward(rest, end)],
        None if optimum.strategy == Strategy::WaitJerk => [wait, jerk],
        None => [jerk, wait],
    };
    let first = block.follow(start, v, t)?;
    let turn = rest.unwrap_or(first.end);
    // The time of arcs at the same velocity is that of both.
    let is_one = v == v_next;
    let second = block.follow(turn, v_next, if is_one { 0.0 } else { t_next })?;
    let off = if is_one { first.end - end } else { (first.end - turn).abs() + (second.end - end).abs() };
    let price = block.price(turn);
    let mean = duty * block.ceiling + 1.0 - duty;
    let (resting, resting_by_b) = if chatter.is_some() { (time * price, time * turn * mean) } else { (0.0, 0.0) };
    let work = first.work + resting + second.work;
    row.compare("dwork_da", fast * block.ceiling * block.ceiling.ln());
    // With the work of a steady slide at v = 1.
    let by_b = first.by_b + resting_by_b + second.by_b;
    row.compare_relative("dwork_db", by_b, by_b.abs() + t_f);
    block.compare_costates(row, &optimum, ends);
    let above = if chatter.is_some() {
        let around = [turn - PRICE_STEP, turn + PRICE_STEP].map(|w| block.price(w));
        if around.iter().all(|other| *other > price) { 0.0 } else { f64::INFINITY }
    } else if is_proven {
        let least = |from: f64, to: f64| lowest(&|w| block.price(w), (from, to));
        let least = least(start, turn).min(least(turn, end));
        ((price - least) / price.abs()).max(0.0)
    } else {
        0.0
    };
    if chatter.is_some() || fast > 0.0 && floor > 0.0 {
        let around: &[f64] = if chatter.is_some() { &[1.0, block.ceiling] } else { &[] };
        compare_extremes(row, block, [(v, start, turn), (v_next, turn, end)], around);
    }
    Some(greatest(&[
        apart(floor + fast, t_f),
        off.abs() / (1.0 + start.abs().max(end.abs())),
        apart(optimum.work, work),
        apart(optimum.hamiltonian, price),
        above,
    ]))
}

/// Compares velocities at the ends, greatest state and friction of two arcs, with their velocities and `ln theta` at their ends, and these
/// velocities `around` the turn.
fn compare_extremes(row: &mut CheckedRow<'_>, block: &Block, arcs: [(f64, f64, f64); 2], around: &[f64]) {
    for (column, (v, from, to)) in ["v_start", "v_end"].into_iter().zip(arcs) {
        if (to - from).abs() > LONG_ROUNDING_RTOL * (1.0 + from.abs()) {
            row.compare(column, v);
        }
    }
    let highest = arcs.iter().map(|(_, from, to)| from.max(*to));
    row.compare("theta_max", highest.fold(f64::NEG_INFINITY, f64::max).exp());
    let at_turn = around.iter().map(|v| block.friction(arcs[0].2, *v));
    let friction = arcs.iter().map(|(v, from, to)| block.friction(from.max(*to), *v)).chain(at_turn);
    row.compare("friction_max", friction.fold(f64::NEG_INFINITY, f64::max));
}

/// The error of a path faster than at `v = 1`, which ends as long before the end as the time at `v = 1`; `None` if that is too long.
fn rise(row: &mut CheckedRow<'_>, block: &Block, optimum: &Optimum, (ends, t_f): ([f64; 2], f64)) -> Option<f64> {
    let ([start, end], floor, hamiltonian) = (ends, optimum.time_at_floor, optimum.hamiltonian);
    let last = if floor > 0.0 { end * floor.exp() } else { end };
    let [time, work] = block.rise(start, last, -hamiltonian)?;
    let work = work + block.follow(last, 1.0, floor)?.work;
    let velocity = |w: f64| (block.rise_ln_u(w, -hamiltonian) - w).exp();
    row.compare("theta_max", end.exp());
    row.compare("v_start", velocity(start));
    row.compare("v_end", if floor > 0.0 { 1.0 } else { velocity(end) });
    block.compare_costates(row, optimum, ends);
    Some(greatest(&[apart(time + floor, t_f), apart(optimum.work, work)]))
}
