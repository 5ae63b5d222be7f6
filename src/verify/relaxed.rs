//! `optimal` for the laws of slip and of Perrin, Rice and Zheng: the arcs of the row, integrated from the equations, arrive with its work; the price
//! of holding theta is least where the path turns or rests.

use super::motion::{bisect, lowest};
use super::route::integrate;
use super::verdict::{Checked, Verdict, axis, number, word};
use crate::dataset::{Cell, Row};
use crate::model::{Law, StateLaw, Transition};
use crate::protocol::Solved;
use crate::protocol::relaxed;
use crate::table::STATUS;

/// Slip on a bound after which theta is steady to rounding. Derived: both laws forget its start as `e^-slip`.
const STEADY_SLIP: f64 = 60.0;

/// Slip of the longest arc on the ceiling. Chosen: beyond, rounding of its end may decide the price there.
const MAX_SLIP: f64 = 5000.0;

/// Points of an arc at which its price is sampled. Chosen: a minimum is refined.
const PRICE_POINTS: u32 = 256;

/// Difference of `ln theta` at which a price is above its minimum. Chosen: a minimum is flat to half the digits.
const PRICE_STEP: f64 = 1e-4;

/// Change of `ln theta` below which a piece counts as absent. Chosen: above rounding.
const NO_SLIDE: f64 = 1e-12;

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

/// A piece of a path at one velocity, between two `ln theta`.
#[derive(Clone, Copy)]
struct Slide {
    v: f64,
    from: f64,
    to: f64,
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
        let slip = all.clamp(0.0, STEADY_SLIP);
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

    /// Compares the derivatives of the work at the ends of a path, and that with respect to `b`, which is `by_b`.
    fn slopes(&self, verdict: &mut Verdict, row: &Row, arcs: &Arcs, by_b: f64) {
        let on_ceiling = arcs.fast * self.ceiling * self.ceiling.ln();
        verdict.compare(row, "dwork_da", Some(on_ceiling), None);
        // With the work of a steady slide at v = 1.
        verdict.compare(row, "dwork_db", Some(by_b), Some(by_b.abs() + arcs.t_f));
        self.costates(verdict, row, arcs);
    }

    /// Compares the derivatives of the work with respect to both ends by the costate `(H - tau v)/theta'`.
    fn costates(&self, verdict: &mut Verdict, row: &Row, arcs: &Arcs) {
        let speeds = ["v_start", "v_end"].map(|column| number(row, column));
        let signs = [("dwork_dv_i", -1.0), ("dwork_dv_f", 1.0)];
        for (((column, sign), w), v) in signs.into_iter().zip(arcs.ends).zip(speeds) {
            let Some(v) = v else { continue };
            let (theta, power) = (w.exp(), self.friction(w, v) * v);
            let rate = self.state.rate(theta * v) / (theta * theta);
            let size = (arcs.hamiltonian.abs() + power.abs()) / rate.abs();
            verdict.compare_number(row, column, sign * (arcs.hamiltonian - power) / rate, size);
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

    /// Compares the greatest state and friction of a path, and its velocities at the ends where it slides there.
    fn extremes(&self, verdict: &mut Verdict, row: &Row, slides: &[Slide]) {
        let slides_on = |slide: &&Slide| (slide.to - slide.from).abs() > NO_SLIDE * (1.0 + slide.from.abs());
        for (column, slide) in [("v_start", slides.first()), ("v_end", slides.last())] {
            if let Some(slide) = slide.filter(slides_on) {
                verdict.compare(row, column, Some(slide.v), None);
            }
        }
        let highest = slides.iter().map(|slide| slide.from.max(slide.to)).fold(f64::NEG_INFINITY, f64::max);
        verdict.compare(row, "theta_max", Some(highest.exp()), None);
        let friction = slides.iter().map(|slide| self.friction(slide.from.max(slide.to), slide.v));
        verdict.compare(row, "friction_max", Some(friction.fold(f64::NEG_INFINITY, f64::max)), None);
    }
}

/// Checks a row of a law other than ageing.
pub fn check(row: &Row, problem: &Transition, state: StateLaw) -> Checked {
    let (t_f, ceiling) = (axis(row, "t_f")?, axis(row, "v_ceiling")?);
    let block = Block { state, law: problem.law, ceiling };
    if number(row, "work").is_none() {
        return Ok(infeasible(row, &block, problem, t_f));
    }
    let needed = ["time_at_floor", "time_at_v_ceiling", "hamiltonian"].map(|column| number(row, column));
    let ([Some(floor), Some(fast), Some(hamiltonian)], Some(strategy)) = (needed, word(row, "strategy")) else {
        return Err("columns of the arcs are not written");
    };
    let arcs = Arcs { t_f, floor, fast, hamiltonian, ends: [-problem.v_i.ln(), -problem.v_f.ln()] };
    let mut verdict = Verdict::default();
    let done = match strategy {
        "rise" => rise(&mut verdict, row, &block, &arcs),
        _ => bang_bang(&mut verdict, row, &block, &arcs, strategy),
    };
    if done.is_none() {
        verdict.miss("an arc is too long, or columns of the chattering are not written");
    }
    Ok(verdict)
}

/// The optimum of a law other than ageing, its work confirmed by [`check`].
pub fn certify(
    verdict: &mut Verdict,
    problem: &Transition,
    state: StateLaw,
    (t_f, v_ceiling): (f64, f64),
) -> Solved<f64> {
    let solved = relaxed::solve(state, problem, t_f, v_ceiling);
    let optimum = solved.value.map(|found| found.optimum);
    let chatter = solved.value.and_then(|found| found.chatter);
    let numbers = [
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
    let words = [("strategy", optimum.map_or("", |found| found.strategy.name())), (STATUS, solved.status.name())];
    let numbers = numbers.into_iter().filter_map(|(name, number)| Some((name.to_owned(), Cell::Number(number?))));
    let words = words.into_iter().map(|(name, word)| (name.to_owned(), Cell::Word(word.to_owned())));
    let row: Row = numbers.chain(words).collect();
    verdict.confirm("optimum", check(&row, problem, state).unwrap_or_else(Verdict::unchecked));
    solved.map(|found| found.optimum.work)
}

/// Compares a path of one arc on each bound, between which theta may rest while they alternate; `None` if the integrator fails or a column of the
/// chattering is missing.
fn bang_bang(verdict: &mut Verdict, row: &Row, block: &Block, arcs: &Arcs, strategy: &str) -> Option<()> {
    let Arcs { t_f, floor, fast, ends: [start, end], .. } = *arcs;
    let chatters = strategy == "chatter";
    let [time, theta, duty] = ["chatter_time", "chatter_theta", "chatter_duty"]
        .map(|column| if chatters { number(row, column) } else { Some(0.0) });
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
    verdict.push("time", ((floor + fast) / t_f - 1.0).abs());
    verdict.push("theta_end", off.abs() / (1.0 + start.abs().max(end.abs())));
    let price = block.price(turn);
    let resting = if chatters { time * price } else { 0.0 };
    verdict.compare(row, "work", Some(first.work + resting + second.work), None);
    verdict.compare(row, "hamiltonian", Some(price), None);
    let of_rest = if chatters { time * rest * (duty * block.ceiling + 1.0 - duty) } else { 0.0 };
    block.slopes(verdict, row, arcs, first.by_b + of_rest + second.by_b);
    if chatters {
        let around = [turn - PRICE_STEP, turn + PRICE_STEP].map(|w| block.price(w));
        verdict.push("price", if around.iter().all(|other| *other > price) { 0.0 } else { f64::INFINITY });
    } else if word(row, STATUS) != Some("unproven") {
        let least = |from: f64, to: f64| lowest(&|w| block.price(w), (from, to), PRICE_POINTS);
        let least = least(start, turn).min(least(turn, end));
        verdict.push("price", ((price - least) / price.abs()).max(0.0));
    }
    let [before, after] = [(v, start, turn), (v_next, turn, end)].map(|(v, from, to)| Slide { v, from, to });
    let [slow, quick] = [1.0, block.ceiling].map(|v| Slide { v, from: turn, to: turn });
    if chatters {
        block.extremes(verdict, row, &[before, slow, quick, after]);
    } else if fast > 0.0 && floor > 0.0 {
        block.extremes(verdict, row, &[before, after]);
    }
    Some(())
}

/// Compares a path faster than at `v = 1`, which ends as long before the end as the time at `v = 1`; `None` if that is too long.
fn rise(verdict: &mut Verdict, row: &Row, block: &Block, arcs: &Arcs) -> Option<()> {
    let Arcs { t_f, floor, hamiltonian, ends: [start, end], .. } = *arcs;
    let last = if floor > 0.0 { end * floor.exp() } else { end };
    let [time, work] = block.rise(start, last, -hamiltonian)?;
    let wait = block.follow(last, 1.0, floor)?;
    verdict.push("time", ((time + floor) / t_f - 1.0).abs());
    verdict.compare(row, "work", Some(work + wait.work), None);
    verdict.compare(row, "theta_max", Some(end.exp()), None);
    verdict.compare(row, "v_start", Some((block.rise_ln_u(start, -hamiltonian) - start).exp()), None);
    let v_end = if floor > 0.0 { 1.0 } else { (block.rise_ln_u(end, -hamiltonian) - end).exp() };
    verdict.compare(row, "v_end", Some(v_end), None);
    block.costates(verdict, row, arcs);
    Some(())
}

/// Checks a row without numbers: the direct way, at `v = 1` or on the ceiling, takes longer than `t_f`.
fn infeasible(row: &Row, block: &Block, problem: &Transition, t_f: f64) -> Verdict {
    let mut verdict = Verdict::default();
    if word(row, STATUS) != Some("infeasible") || number(row, "work").is_some() {
        verdict.miss("optima without a proof");
        return verdict;
    }
    let (start, end) = (-problem.v_i.ln(), -problem.v_f.ln());
    if problem.v_f >= block.ceiling {
        return verdict;
    }
    if end > start && block.state == StateLaw::Slip && start < -1.0 {
        // The fastest rise, v = 1/(e theta) up to theta = 1/e.
        let (turn, capped) = (end.min(-1.0), -1.0 - block.ceiling.ln());
        let on_ceiling = if start < capped { (capped - start + 1.0).ln() / block.ceiling } else { 0.0 };
        let least = std::f64::consts::E * (turn.exp() - start.max(capped).exp()) + (turn / end).ln() + on_ceiling;
        verdict.push("t_least", if t_f < least * (1.0 + 1e-9) { 0.0 } else { f64::INFINITY });
        return verdict;
    }
    let v = if end > start { 1.0 } else { block.ceiling };
    match block.follow(start, v, t_f) {
        Some(arc) => {
            let is_short = if end > start { arc.end < end + 1e-9 } else { arc.end > end - 1e-9 };
            verdict.push("t_least", if is_short { 0.0 } else { f64::INFINITY });
        }
        None => verdict.miss("an arc is too long"),
    }
    verdict
}
