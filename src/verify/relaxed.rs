//! `optimal` for the laws of slip and of Perrin, Rice and Zheng: the traced arcs obey the equations, arrive, and have the work of the row; the price of
//! holding theta is least where the path turns or rests.

use super::motion::{Followed, bisect, lowest, tau};
use super::optimal::{MAX_SPLITS, TIME_NOISE};
use super::route::integrate;
use super::{Checked, CheckedRow};
use crate::model::{Friction, Law, StateLaw, Transition};
use crate::protocol::optimal::Strategy;
use crate::protocol::relaxed::{self, Relaxed};
use crate::protocol::{Moment, Solved, SpringBlock, Status};

/// Slip of the longest direct way that is followed. Derived: both laws forget its start as `e^-slip`, so that it arrives before.
const MAX_SLIP: f64 = 60.0;

/// Difference of `ln theta` at which a price is above its minimum. Chosen: a minimum is flat to half the digits.
const PRICE_STEP: f64 = 1e-4;

/// Relative difference of states that are equal. Chosen: above the rounding of an arc.
const SAME_STATE: f64 = 1e-10;

/// A law, a material and its ceiling.
#[derive(Debug, Clone, Copy)]
struct Block {
    state: StateLaw,
    law: Law,
    ceiling: f64,
}

/// The certified optimum.
struct Optimum {
    block: Block,
    found: Relaxed,
    motion: Followed,
    /// Between these times it chatters, with pulses in its motion.
    rests: [f64; 2],
    /// `ln theta` where the path turns or rests.
    turn: f64,
    work: f64,
    /// Relative error of the path, and what its turn costs more than the cheapest state.
    error: f64,
}

impl Block {
    fn friction(&self, w: f64, v: f64) -> f64 {
        tau(Friction::Log, &self.law, v, w.exp())
    }

    /// `d ln theta/dt` at `w = ln theta`.
    fn rate(&self, w: f64, v: f64) -> f64 {
        self.state.rate(w.exp() * v) / w.exp()
    }

    /// The fraction of the time on the ceiling that keeps theta, and its cost per unit of time; infinite where the slip law heals faster on the
    /// ceiling than at `v = 1`.
    fn rest(&self, w: f64) -> [f64; 2] {
        let [slow, fast] = [1.0, self.ceiling].map(|v| (self.rate(w, v), self.friction(w, v) * v));
        if fast.0 >= slow.0 {
            return [f64::NAN, f64::INFINITY];
        }
        let duty = slow.0 / (slow.0 - fast.0);
        [duty, duty * fast.1 + (1.0 - duty) * slow.1]
    }

    fn price(&self, w: f64) -> f64 {
        self.rest(w)[1]
    }

    /// Velocity of a rise of the slip law at `w` with `H = -h`: `H = tau v - (tau v)_g g` on the branch that heals faster than at `v = 1`, at which
    /// `u < 1/e` solves `T u = -h theta (1 + ln u)`.
    fn rise(&self, w: f64, h: f64) -> f64 {
        let strength = 1.0 + (self.law.b - self.law.a) * w;
        (bisect(-700.0, -1.0, |ln_u| strength * ln_u.exp() < -h * w.exp() * (1.0 + ln_u)) - w).exp()
    }

    /// The optimum; the reason if it cannot be certified.
    fn certify(self, problem: &Transition, t_f: f64) -> (Solved<Relaxed>, Result<Optimum, &'static str>) {
        let (solved, motion) = relaxed::motion(self.state, problem, t_f, self.ceiling);
        let (Some(found), Some(motion)) = (solved.value, motion) else {
            return (solved, Err("there is no motion of the optimum"));
        };
        let rigid = SpringBlock { law: self.law, k: f64::INFINITY, m: 0.0 };
        let motion = Followed::new(motion, self.state, &rigid, MAX_SPLITS);
        let is_proven = !matches!(solved.status, Status::Unproven | Status::NegativeFriction);
        (solved, self.judge(found, motion, [1.0 / problem.v_i, t_f], is_proven, problem.v_f))
    }

    /// The errors of a motion from the state `theta` in the time `t_f`.
    fn judge(
        self,
        found: Relaxed,
        motion: Followed,
        [theta, t_f]: [f64; 2],
        is_proven: bool,
        v_f: f64,
    ) -> Result<Optimum, &'static str> {
        let (first, last) = (motion.samples[0].1, motion.end());
        let h = found.optimum.hamiltonian;
        let arrival = (first.theta / theta - 1.0).abs() + motion.arrival(v_f) + (last.t / t_f - 1.0).abs();
        let is_rise = found.optimum.strategy == Strategy::Rise;
        let off = motion.worst(|at| match at.v {
            v if v == 1.0 || v == self.ceiling => 0.0,
            v if is_rise => (self.rise(at.theta.ln(), -h) / v - 1.0).abs(),
            _ => f64::INFINITY,
        });
        let error = motion.equation + motion.stretch() + arrival + off;
        if let Some(chatter) = found.chatter {
            let turn = chatter.theta.ln();
            let starts = |(_, at): &&(f64, Moment)| (at.theta / chatter.theta - 1.0).abs() < SAME_STATE;
            let start = motion.samples.iter().find(starts).ok_or("no moment of rest")?.1.t;
            let rests = [start, start + chatter.time];
            let [duty, price] = self.rest(turn);
            let is_least = [turn - PRICE_STEP, turn + PRICE_STEP].iter().all(|w| self.price(*w) > price);
            let lack = if is_least { (duty - chatter.duty).abs() } else { f64::INFINITY };
            let moving = motion.integral(|at| if is_inside(rests, at) { 0.0 } else { at.friction * at.v });
            let work = moving + chatter.time * price;
            return Ok(Optimum { block: self, found, motion, rests, turn, work, error: error + lack });
        }
        // A path of one arc turns at an end.
        let switch = motion.samples.windows(2).find(|pair| pair[0].1.v != pair[1].1.v).map(|pair| pair[0].1);
        let is_slow_first = found.optimum.strategy == Strategy::WaitJerk;
        let end = if (first.v == 1.0) == is_slow_first { last } else { first };
        let turn = switch.unwrap_or(end).theta.ln();
        let least = |from: f64, to: f64| lowest(&|w| self.price(w), (from, to));
        let price = self.price(turn);
        let lack = match () {
            () if is_rise || !is_proven => 0.0,
            () => price - least(first.theta.ln(), turn).min(least(turn, last.theta.ln())),
        };
        let (work, lack) = (motion.work, (lack / price.abs()).max(0.0));
        Ok(Optimum { block: self, found, motion, rests: [f64::NAN; 2], turn, work, error: error + lack })
    }
}

/// Whether a moment is among the pulses that stand for chattering.
fn is_inside([start, end]: [f64; 2], at: &Moment) -> bool {
    at.t > start && at.t <= end * (1.0 + SAME_STATE)
}

impl Optimum {
    /// Compares the numbers of a row.
    fn compare(&self, row: &mut CheckedRow<'_>, t_f: f64) {
        let Optimum { block, found, motion, rests, turn, work, .. } = self;
        let (strategy, ceiling) = (found.optimum.strategy, block.ceiling);
        let [duty, price] = block.rest(*turn);
        let rest = found.chatter.map_or(0.0, |chatter| chatter.time);
        let fast = rest * if rest > 0.0 { duty } else { 0.0 };
        let outside =
            |f: &dyn Fn(&Moment) -> f64| motion.integral(|at| if is_inside(*rests, at) { 0.0 } else { f(at) });
        let time = |v: f64| motion.time_on(|at| at.v == v && !is_inside(*rests, at));
        row.compare("work", *work);
        for (column, time) in [("time_at_floor", time(1.0) + rest - fast), ("time_at_v_ceiling", time(ceiling) + fast)]
        {
            row.compare_relative(column, time, time + TIME_NOISE * t_f / row.context.rtol);
        }
        row.compare_word("strategy", strategy.name());
        let (start, end) = (motion.samples[0].1, motion.end());
        row.compare("v_start", start.v);
        row.compare("v_end", end.v);
        let is_rise = strategy == Strategy::Rise;
        row.compare("hamiltonian", if is_rise { found.optimum.hamiltonian } else { price });
        let greatest =
            |f: &dyn Fn(&Moment) -> f64| motion.greatest(|at| if is_inside(*rests, at) { f64::MIN } else { f(at) });
        let [theta_max, friction_max] = [greatest(&|at| at.theta), greatest(&|at| at.friction)];
        let at_rest = |value: f64| if rest > 0.0 { value } else { f64::MIN };
        row.compare("theta_max", theta_max.max(at_rest(turn.exp())));
        row.compare("friction_max", friction_max.max(at_rest(block.friction(*turn, ceiling))));
        let chatter = found.chatter;
        row.compare("chatter_time", chatter.map(|chatter| chatter.time));
        row.compare("chatter_theta", chatter.map(|chatter| chatter.theta));
        row.compare("chatter_duty", chatter.map(|_| duty));
        if !is_rise {
            row.compare("dwork_da", outside(&|at| at.v * at.v.ln()) + fast * ceiling * ceiling.ln());
            // With the work of a steady slide at v = 1.
            let by_b = outside(&|at| at.v * at.theta.ln()) + (fast * ceiling + rest - fast) * turn;
            row.compare_relative("dwork_db", by_b, by_b.abs() + t_f);
        }
        // Derivatives with respect to both ends by the costate (H - tau v)/theta'.
        for (column, sign, at) in [("dwork_dv_i", -1.0, start), ("dwork_dv_f", 1.0, end)] {
            let (h, power) = (found.optimum.hamiltonian, at.friction * at.v);
            let rate = block.state.rate(at.theta * at.v) / (at.theta * at.theta);
            row.compare_number(column, sign * (h - power) / rate, (h.abs() + power.abs()) / rate.abs());
        }
    }
}

/// Checks a row of a law other than ageing.
pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, t_f) = (row.transition()?, row.axis("t_f")?);
    let block = Block { state: row.state_law()?, law: problem.law, ceiling: row.axis("v_ceiling")? };
    if row.has_status("infeasible") {
        return infeasible(row, &block, &problem, t_f);
    }
    let optimum = block.certify(&problem, t_f).1?;
    row.push("optimum", optimum.error);
    optimum.compare(row, t_f);
    Ok(())
}

/// The least work of a law other than ageing, with its error as a difference of the column `optimum`.
pub fn certify(row: &mut CheckedRow<'_>, problem: &Transition, state: StateLaw, t_f: f64) -> Solved<f64> {
    let block = Block { state, law: problem.law, ceiling: row.bounds().v_ceiling };
    let (solved, optimum) = block.certify(problem, t_f);
    match optimum {
        Ok(optimum) => {
            row.push("optimum", optimum.error);
            solved.map(|_| optimum.work)
        }
        Err(reason) => {
            if solved.status != Status::Infeasible {
                row.miss(reason);
            }
            solved.map(|found| found.optimum.work)
        }
    }
}

/// Checks a row without numbers: the direct way, at `v = 1` or on the ceiling, takes longer than `t_f`.
fn infeasible(row: &mut CheckedRow<'_>, block: &Block, problem: &Transition, t_f: f64) -> Checked {
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
        let slope = |y: &[f64; 1]| [block.rate(y[0], v) / v];
        let [reached] = integrate(slope, [start], (0.0, (v * t_f).min(MAX_SLIP))).ok_or("the integrator failed")?;
        if end > start { reached < end + 1e-9 } else { reached > end - 1e-9 }
    };
    row.push("t_least", if is_short { 0.0 } else { f64::INFINITY });
    Ok(())
}
