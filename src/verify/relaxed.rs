//! `optimal` for the laws of slip and of Perrin, Rice and Zheng: the arcs of the row, integrated from the equations, arrive with its work; the price
//! of holding theta is least where the path turns or rests.

use super::checked_row::NEGATIVE;
use super::motion::{bisect, lowest};
use super::route::integrate;
use super::{Checked, CheckedRow};
use crate::dataset::{Cell, Row};
use crate::model::{Law, StateLaw, Transition};
use crate::numerics::{LONG_ROUNDING_RTOL, NEGLIGIBLE_LN};
use crate::protocol::Solved;
use crate::protocol::relaxed;
use crate::table::STATUS;

/// Slip of the longest arc on the ceiling. Chosen: beyond, rounding of its end may decide the price there.
const MAX_SLIP: f64 = 5000.0;

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

/// The numbers of a row that determine its arcs.
struct Arcs {
    t_f: f64,
    floor: f64,
    fast: f64,
    hamiltonian: f64,
    /// `ln theta` at both ends.
    ends: [f64; 2],
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

    /// Compares the derivatives of the work with respect to both ends by the costate `(H - tau v)/theta'`.
    fn compare_costates(&self, row: &mut CheckedRow<'_>, arcs: &Arcs) {
        let [start, end] = arcs.ends;
        for (column, sign, w, v) in [("dwork_dv_i", -1.0, start, "v_start"), ("dwork_dv_f", 1.0, end, "v_end")] {
            let Some(v) = row.number(v) else { continue };
            let (theta, power) = (w.exp(), self.friction(w, v) * v);
            let rate = self.state.rate(theta * v) / (theta * theta);
            let size = (arcs.hamiltonian.abs() + power.abs()) / rate.abs();
            row.compare_number(column, sign * (arcs.hamiltonian - power) / rate, size);
        }
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

/// Checks a row of a law other than ageing.
pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, t_f) = (row.transition()?, row.axis("t_f")?);
    let block = Block { state: row.state_law()?, law: problem.law, ceiling: row.axis("v_ceiling")? };
    if row.number("work").is_none() {
        return infeasible(row, &block, &problem, t_f);
    }
    let needed = ["time_at_floor", "time_at_v_ceiling", "hamiltonian"].map(|column| row.number(column));
    let ([Some(floor), Some(fast), Some(hamiltonian)], Some(strategy)) = (needed, row.word("strategy")) else {
        return Err("columns of the arcs are not written");
    };
    let arcs = Arcs { t_f, floor, fast, hamiltonian, ends: [-problem.v_i.ln(), -problem.v_f.ln()] };
    let done = match strategy {
        "rise" => rise(row, &block, &arcs),
        _ => bang_bang(row, &block, &arcs, strategy),
    };
    done.ok_or("an arc is too long, or columns of the chattering are not written")
}

/// The least work of a law other than ageing, confirmed by [`check`] as a difference of the column `optimum`.
pub fn certify(row: &mut CheckedRow<'_>, problem: &Transition, state: StateLaw, t_f: f64) -> Solved<f64> {
    let v_ceiling = row.bounds().v_ceiling;
    let solved = relaxed::solve(state, problem, t_f, v_ceiling);
    let optimum = solved.value.map(|found| found.optimum);
    let chatter = solved.value.and_then(|found| found.chatter);
    let numbers = [
        ("a", Some(problem.law.a)),
        ("b", Some(problem.law.b)),
        ("v_i", Some(problem.v_i)),
        ("v_f", Some(problem.v_f)),
        ("t_f", Some(t_f)),
        ("v_ceiling", Some(v_ceiling)),
        ("work", optimum.map(|found| found.work)),
        ("time_at_floor", optimum.map(|found| found.time_at_floor)),
        ("time_at_v_ceiling", optimum.map(|found| found.time_at_v_ceiling)),
        ("hamiltonian", optimum.map(|found| found.hamiltonian)),
        ("chatter_time", chatter.map(|found| found.time)),
        ("chatter_theta", chatter.map(|found| found.theta)),
        ("chatter_duty", chatter.map(|found| found.duty)),
    ];
    let strategy = optimum.map_or("", |found| found.strategy.name());
    let words = [("law", state.name()), ("strategy", strategy), (STATUS, solved.status.name())];
    let numbers = numbers.into_iter().filter_map(|(name, number)| Some((name.to_owned(), Cell::Number(number?))));
    let words = words.into_iter().map(|(name, word)| (name.to_owned(), Cell::Word(word.to_owned())));
    let cells: Row = numbers.chain(words).collect();
    let found = CheckedRow::new(&cells, row.context, check);
    row.push("optimum", found.differences.iter().map(|difference| difference.size).fold(0.0, f64::max));
    found.unchecked.into_iter().for_each(|reason| row.miss(reason));
    solved.map(|found| found.optimum.work)
}

/// Compares a path of one arc on each bound, between which theta may rest while they alternate; `None` if the integrator fails or a column of the
/// chattering is missing.
fn bang_bang(row: &mut CheckedRow<'_>, block: &Block, arcs: &Arcs, strategy: &str) -> Option<()> {
    let Arcs { t_f, floor, fast, ends: [start, end], .. } = *arcs;
    let chatters = strategy == "chatter";
    let [time, theta, duty] = ["chatter_time", "chatter_theta", "chatter_duty"]
        .map(|column| if chatters { row.number(column) } else { Some(0.0) });
    let (time, rest, duty) = (time?, theta?.ln(), duty?);
    let [wait, jerk] = [(1.0, floor - time * (1.0 - duty)), (block.ceiling, fast - time * duty)];
    let toward = |from: f64, to: f64| if to > from { wait } else { jerk };
    let [(v, t), (v_next, t_next)] = match strategy {
        "chatter" => [toward(start, rest), toward(rest, end)],
        "wait_jerk" => [wait, jerk],
        _ => [jerk, wait],
    };
    let first = block.follow(start, v, t)?;
    let turn = if chatters { rest } else { first.end };
    // The time of arcs at the same velocity is that of both.
    let is_one = v == v_next;
    let second = block.follow(turn, v_next, if is_one { 0.0 } else { t_next })?;
    let off = if is_one { first.end - end } else { (first.end - turn).abs() + (second.end - end).abs() };
    row.push("time", ((floor + fast) / t_f - 1.0).abs());
    row.push("theta_end", off.abs() / (1.0 + start.abs().max(end.abs())));
    let price = block.price(turn);
    let (resting, resting_by_b) =
        if chatters { (time * price, time * rest * (duty * block.ceiling + 1.0 - duty)) } else { (0.0, 0.0) };
    row.compare("work", first.work + resting + second.work);
    row.compare("hamiltonian", price);
    row.compare("dwork_da", fast * block.ceiling * block.ceiling.ln());
    // With the work of a steady slide at v = 1.
    let by_b = first.by_b + resting_by_b + second.by_b;
    row.compare_relative("dwork_db", by_b, by_b.abs() + t_f);
    block.compare_costates(row, arcs);
    if chatters {
        let around = [turn - PRICE_STEP, turn + PRICE_STEP].map(|w| block.price(w));
        row.push("price", if around.iter().all(|other| *other > price) { 0.0 } else { f64::INFINITY });
    } else if !row.has_status("unproven") && !row.has_status(NEGATIVE) {
        let least = |from: f64, to: f64| lowest(&|w| block.price(w), (from, to));
        let least = least(start, turn).min(least(turn, end));
        row.push("price", ((price - least) / price.abs()).max(0.0));
    }
    if chatters || fast > 0.0 && floor > 0.0 {
        let around: &[f64] = if chatters { &[1.0, block.ceiling] } else { &[] };
        compare_extremes(row, block, [(v, start, turn), (v_next, turn, end)], around);
    }
    Some(())
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

/// Compares a path faster than at `v = 1`, which ends as long before the end as the time at `v = 1`; `None` if that is too long.
fn rise(row: &mut CheckedRow<'_>, block: &Block, arcs: &Arcs) -> Option<()> {
    let Arcs { t_f, floor, hamiltonian, ends: [start, end], .. } = *arcs;
    let last = if floor > 0.0 { end * floor.exp() } else { end };
    let [time, work] = block.rise(start, last, -hamiltonian)?;
    let wait = block.follow(last, 1.0, floor)?;
    let velocity = |w: f64| (block.rise_ln_u(w, -hamiltonian) - w).exp();
    row.push("time", ((time + floor) / t_f - 1.0).abs());
    row.compare("work", work + wait.work);
    row.compare("theta_max", end.exp());
    row.compare("v_start", velocity(start));
    row.compare("v_end", if floor > 0.0 { 1.0 } else { velocity(end) });
    block.compare_costates(row, arcs);
    Some(())
}

/// Checks a row without numbers: the direct way, at `v = 1` or on the ceiling, takes longer than `t_f`.
fn infeasible(row: &mut CheckedRow<'_>, block: &Block, problem: &Transition, t_f: f64) -> Checked {
    if !row.has_status("infeasible") {
        return Err("optima without a proof");
    }
    let (start, end) = (-problem.v_i.ln(), -problem.v_f.ln());
    if problem.v_f >= block.ceiling {
        return Ok(());
    }
    let is_short = if end > start && block.state == StateLaw::Slip && start < -1.0 {
        // The fastest rise, v = 1/(e theta) up to theta = 1/e.
        let (turn, capped) = (end.min(-1.0), -1.0 - block.ceiling.ln());
        let on_ceiling = if start < capped { (capped - start + 1.0).ln() / block.ceiling } else { 0.0 };
        let least = std::f64::consts::E * (turn.exp() - start.max(capped).exp()) + (turn / end).ln() + on_ceiling;
        t_f < least * (1.0 + 1e-9)
    } else {
        let v = if end > start { 1.0 } else { block.ceiling };
        let reached = block.follow(start, v, t_f).ok_or("an arc is too long")?.end;
        if end > start { reached < end + 1e-9 } else { reached > end - 1e-9 }
    };
    row.push("t_least", if is_short { 0.0 } else { f64::INFINITY });
    Ok(())
}
