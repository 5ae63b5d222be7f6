//! `optimal` for the laws of slip and of Perrin, Rice and Zheng: the arcs of the row, integrated from the equations, arrive with its work; the price
//! of holding theta is least where the path turns or rests.

use super::motion::bisect;
use super::verdict::{Verdict, number, word};
use crate::dataset::{Cell, Row};
use crate::model::{Law, StateLaw, Transition};
use crate::numerics::radau::radau;
use crate::protocol::Solved;
use crate::protocol::relaxed::{self, Relaxed};
use crate::table::STATUS;

/// Length of a step, in units of the time in which the equation damps a disturbance. Chosen: the fixed points converge by a factor of 4 each.
const STEP: f64 = 0.25;

/// Fixed points of a step. Chosen: `4^-28` is below rounding.
const FIXED_POINTS: u32 = 28;

/// Greatest number of steps of an arc. Chosen: 0.1 s.
const MAX_STEPS: u32 = 20_000;

/// Change of `ln theta` in the rest of an arc below which it slides steadily. Chosen: rounding.
const STEADY: f64 = 1e-15;

/// Difference of `ln theta` at which a price is above its minimum. Chosen: a minimum is flat to half the digits.
const PRICE_STEP: f64 = 1e-4;

/// Panels of a rise. Chosen: enough for a range of 25 in `ln theta`.
const PANELS: u32 = 100;

/// A law, a material and its ceiling.
#[derive(Debug, Clone, Copy)]
struct Block {
    state: StateLaw,
    law: Law,
    ceiling: f64,
}

/// An arc: `ln theta` at its end, its work and the derivative of that with respect to `b`, and the least price on it.
struct Arc {
    end: f64,
    work: f64,
    by_b: f64,
    price: f64,
}

impl Block {
    fn friction(&self, w: f64, v: f64) -> f64 {
        1.0 + self.law.a * v.ln() + self.law.b * w
    }

    /// `d ln theta/dt` at `w = ln theta`, and minus its derivative with respect to `w`.
    fn rate(&self, w: f64, v: f64) -> (f64, f64) {
        let (theta, u) = (w.exp(), w.exp() * v);
        let damping = if self.state == StateLaw::Slip { v } else { (1.0 + u * u) / (2.0 * theta) };
        (self.state.rate(u) / theta, damping)
    }

    /// The arc of duration `t` at the velocity `v`, by fixed points of a collocation rule on each step; `None` if it takes too many.
    fn follow(&self, mut w: f64, v: f64, t: f64) -> Option<Arc> {
        let rule = radau();
        let (mut work, mut by_b, mut left, mut price) = (0.0, 0.0, t, self.price(w));
        for _ in 0..MAX_STEPS {
            let (rate, damping) = self.rate(w, v);
            if (rate * left).abs() <= STEADY {
                work += left * v * self.friction(w, v);
                by_b += left * v * w;
                return Some(Arc { end: w, work, by_b, price: price.min(self.price(w)) });
            }
            let dt = (STEP / damping).min(left);
            let mut at = rule.u.map(|u| w + u * dt * rate);
            for _ in 0..FIXED_POINTS {
                at = rule.integrals(&at.map(|w| self.rate(w, v).0)).map(|sum| w + dt * sum);
            }
            work += dt * v * at.iter().zip(&rule.w).map(|(&w, weight)| weight * self.friction(w, v)).sum::<f64>();
            by_b += dt * v * at.iter().zip(&rule.w).map(|(&w, weight)| weight * w).sum::<f64>();
            w = at[at.len() - 1];
            price = price.min(self.price(w));
            left -= dt;
            if left <= 0.0 {
                return Some(Arc { end: w, work, by_b, price });
            }
        }
        None
    }

    /// What holding theta costs per unit of time, by the mixture of both bounds that keeps it; infinite where the slip law heals faster on the
    /// ceiling than at `v = 1`.
    fn price(&self, w: f64) -> f64 {
        let [slow, fast] = [1.0, self.ceiling].map(|v| (self.rate(w, v).0, self.friction(w, v) * v));
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
    fn rise(&self, from: f64, to: f64, h: f64) -> (f64, f64) {
        let rule = radau();
        let (mut time, mut work) = (0.0, 0.0);
        let length = (to - from) / f64::from(PANELS);
        for panel in 0..PANELS {
            for (&u, &weight) in rule.u.iter().zip(&rule.w) {
                let w = from + length * (f64::from(panel) + u);
                let v = (self.rise_ln_u(w, h) - w).exp();
                let dt = length * weight / self.rate(w, v).0;
                (time, work) = (time + dt, work + dt * v * self.friction(w, v));
            }
        }
        (time, work)
    }
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

/// Checks a row of a law other than ageing.
pub fn check(row: &Row, problem: &Transition, state: StateLaw) -> Verdict {
    let numbers = ["t_f", "v_ceiling"].map(|column| number(row, column));
    let [Some(t_f), Some(ceiling)] = numbers else { return Verdict::unchecked("an axis is missing") };
    let block = Block { state, law: problem.law, ceiling };
    if number(row, "work").is_none() {
        return infeasible(row, &block, problem, t_f);
    }
    let needed = ["time_at_floor", "time_at_v_ceiling", "hamiltonian"].map(|column| number(row, column));
    let ([Some(floor), Some(fast), Some(hamiltonian)], Some(strategy)) = (needed, word(row, "strategy")) else {
        return Verdict::unchecked("columns of the arcs are not written");
    };
    let arcs = Arcs { t_f, floor, fast, hamiltonian, ends: [-problem.v_i.ln(), -problem.v_f.ln()] };
    let mut verdict = Verdict::default();
    let done = match strategy {
        "rise" => rise(&mut verdict, row, &block, &arcs),
        "chatter" => chatter(&mut verdict, row, &block, &arcs),
        _ => turn(&mut verdict, row, &block, &arcs, strategy == "wait_jerk"),
    };
    if done.is_none() {
        verdict.miss("an arc is too long, or columns of the chattering are not written");
    }
    verdict
}

/// The optimum of a law other than ageing, its work confirmed by [`check`].
pub fn certify(
    verdict: &mut Verdict,
    problem: &Transition,
    state: StateLaw,
    (t_f, v_ceiling): (f64, f64),
) -> Solved<f64> {
    let solved = relaxed::solve(state, problem, t_f, v_ceiling);
    let mut row: Row = Vec::new();
    let mut number = |name: &str, value: f64| row.push((name.to_owned(), Cell::Number(value)));
    number("t_f", t_f);
    number("v_ceiling", v_ceiling);
    let mut strategy = "";
    if let Some(Relaxed { optimum, chatter }) = solved.value {
        number("work", optimum.work);
        number("time_at_floor", optimum.time_at_floor);
        number("time_at_v_ceiling", optimum.time_at_v_ceiling);
        number("hamiltonian", optimum.hamiltonian);
        if let Some(chatter) = chatter {
            number("chatter_time", chatter.time);
            number("chatter_theta", chatter.theta);
            number("chatter_duty", chatter.duty);
        }
        strategy = optimum.strategy.name();
    }
    for (name, word) in [("strategy", strategy), (STATUS, solved.status.name())] {
        row.push((name.to_owned(), Cell::Word(word.to_owned())));
    }
    verdict.confirm("optimum", check(&row, problem, state));
    Solved { status: solved.status, value: solved.value.map(|found| found.optimum.work), stats: solved.stats }
}

/// A piece of a path at one velocity, between two `ln theta`.
struct Slide {
    v: f64,
    from: f64,
    to: f64,
}

impl Block {
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

/// Change of `ln theta` below which a piece counts as absent. Chosen: above rounding.
const NO_SLIDE: f64 = 1e-12;

/// Compares a path with one turn; `None` if an arc is too long.
fn turn(verdict: &mut Verdict, row: &Row, block: &Block, arcs: &Arcs, waits_first: bool) -> Option<()> {
    let Arcs { t_f, floor, fast, ends: [start, end], .. } = *arcs;
    let order = [(1.0, floor), (block.ceiling, fast)];
    let [first, second] = if waits_first { order } else { [order[1], order[0]] };
    let speeds = [first.0, second.0];
    let first = block.follow(start, first.0, first.1)?;
    let second = block.follow(first.end, second.0, second.1)?;
    if fast > 0.0 && floor > 0.0 {
        let slides = [(speeds[0], start, first.end), (speeds[1], first.end, end)];
        block.extremes(verdict, row, &slides.map(|(v, from, to)| Slide { v, from, to }));
    }
    verdict.push("time", ((floor + fast) / t_f - 1.0).abs());
    verdict.push("theta_end", (second.end - end).abs() / (1.0 + start.abs().max(end.abs())));
    verdict.compare(row, "work", Some(first.work + second.work), None);
    block.slopes(verdict, row, arcs, first.by_b + second.by_b);
    let price = block.price(first.end);
    verdict.compare(row, "hamiltonian", Some(price), None);
    if word(row, STATUS) != Some("unproven") {
        verdict.push("price", ((price - first.price.min(second.price)) / price.abs()).max(0.0));
    }
    Some(())
}

/// Compares a path that chatters; `None` if an arc is too long or a column is missing.
fn chatter(verdict: &mut Verdict, row: &Row, block: &Block, arcs: &Arcs) -> Option<()> {
    let Arcs { t_f, floor, fast, ends: [start, end], .. } = *arcs;
    let [time, theta, duty] = ["chatter_time", "chatter_theta", "chatter_duty"].map(|column| number(row, column));
    let (time, rest, duty) = (time?, theta?.ln(), duty?);
    let price = block.price(rest);
    verdict.push("time", ((floor + fast) / t_f - 1.0).abs());
    verdict.compare(row, "hamiltonian", Some(price), None);
    let around = [rest - PRICE_STEP, rest + PRICE_STEP].map(|w| block.price(w));
    verdict.push("price", if around.iter().all(|other| *other > price) { 0.0 } else { f64::INFINITY });
    let [slow, jerk] = [floor - time * (1.0 - duty), fast - time * duty];
    let arc = |from: f64, to: f64| if to > from { (1.0, slow) } else { (block.ceiling, jerk) };
    let size = 1.0 + start.abs().max(end.abs());
    let by_b = time * rest * (duty * block.ceiling + 1.0 - duty);
    let ((v, t), (v_next, t_next)) = (arc(start, rest), arc(rest, end));
    let rests = [(v, start, rest), (1.0, rest, rest), (block.ceiling, rest, rest), (v_next, rest, end)];
    block.extremes(verdict, row, &rests.map(|(v, from, to)| Slide { v, from, to }));
    let first = block.follow(start, v, t)?;
    if v == v_next {
        // This time is that of both arcs.
        verdict.push("theta_end", (first.end - end).abs() / size);
        verdict.compare(row, "work", Some(first.work + time * price), None);
        block.slopes(verdict, row, arcs, first.by_b + by_b);
        return Some(());
    }
    let second = block.follow(rest, v_next, t_next)?;
    verdict.push("theta_end", ((first.end - rest).abs() + (second.end - end).abs()) / size);
    verdict.compare(row, "work", Some(first.work + time * price + second.work), None);
    block.slopes(verdict, row, arcs, first.by_b + by_b + second.by_b);
    Some(())
}

/// Compares a path faster than at `v = 1`, which ends as long before the end as the time at `v = 1`; `None` if that is too long.
fn rise(verdict: &mut Verdict, row: &Row, block: &Block, arcs: &Arcs) -> Option<()> {
    let Arcs { t_f, floor, hamiltonian, ends: [start, end], .. } = *arcs;
    let last = if floor > 0.0 { end * floor.exp() } else { end };
    let (time, work) = block.rise(start, last, -hamiltonian);
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
