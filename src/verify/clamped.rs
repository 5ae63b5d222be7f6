//! Optimal protocols under a floor and ceilings by integration along `ln theta`: the free minimiser, clamped, with one `C`
//! (docs/derivations.md, equation 6).

use super::route::integrate;
use crate::model::{Law, Transition};

/// The way from one state variable to steady sliding at another, under bounds.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    pub law: Law,
    /// State variable at the start.
    pub from: f64,
    /// State variable at the end.
    pub to: f64,
    /// Whether `v >= 1`.
    pub floor: bool,
    /// Velocity ceiling, or infinity.
    pub v_ceiling: f64,
    /// Friction ceiling, or infinity.
    pub tau_ceiling: f64,
}

/// Integrals along a protocol, and its ends.
#[derive(Debug, Clone, Copy, Default)]
pub struct Totals {
    pub time: f64,
    pub work: f64,
    pub time_at_floor: f64,
    pub time_at_v_ceiling: f64,
    pub time_at_tau_ceiling: f64,
    /// Integrals of the multipliers of the two ceilings.
    pub pressure: [f64; 2],
    /// Derivatives of the work with respect to `a` and `b`.
    pub by_law: [f64; 2],
    /// `W + C t` of a protocol that is off by a little.
    pub varied: f64,
    pub v_start: f64,
    pub v_end: f64,
    pub theta_max: f64,
    pub friction: [f64; 2],
    /// Derivatives of the work with respect to theta at the start and at the end.
    pub costate: [f64; 2],
    /// Whether the start is on the friction ceiling.
    pub on_friction_ceiling: bool,
    /// `dW*/dt_f` with the opposite sign.
    pub c: f64,
}

/// A monotone leg: `ln theta` at its ends.
#[derive(Debug, Clone, Copy)]
struct Leg {
    start: f64,
    end: f64,
    /// `ln theta` at the turn at one of its ends, if any.
    turn: Option<f64>,
}

/// Relative distance of a velocity from a bound by rounding.
const BOUND_RTOL: f64 = 1e-12;

/// Relative distance from the border of the feasible region below which rounding decides.
const BORDER_RTOL: f64 = 1e-11;

/// Relative change of `z` of the protocols that try to beat the optimum.
const VARIATION: f64 = 1e-3;

/// The integrated quantities, and the variable itself.
const SUMS: usize = 11;

impl Way {
    /// The way of a transition, with ceilings of velocity and friction.
    pub fn of(problem: &Transition, floor: bool, [v_ceiling, tau_ceiling]: [f64; 2]) -> Way {
        let Transition { law, v_i, v_f } = *problem;
        Way { law, from: 1.0 / v_i, to: 1.0 / v_f, floor, v_ceiling, tau_ceiling }
    }

    fn steady_friction(&self, l: f64) -> f64 {
        1.0 + (self.law.b - self.law.a) * l
    }

    /// The greatest `z = ln(theta v)` under both ceilings.
    pub fn cap(&self, l: f64) -> f64 {
        (self.v_ceiling.ln() + l).min((self.tau_ceiling - self.steady_friction(l)) / self.law.a)
    }

    /// Whether the ceilings allow steady sliding at the end, and nothing above its theta.
    pub fn sits(&self) -> bool {
        self.to >= self.from && self.cap(self.to.ln()) == 0.0
    }

    /// Whether there is a protocol of duration `t_f`; `None` where rounding decides.
    pub fn feasible(&self, t_f: f64) -> Option<bool> {
        let (start, end) = (self.from.ln(), self.to.ln());
        let (caps, clear) = ([start, end].map(|l| self.cap(l)), |room: f64, size: f64| {
            (room.abs() > BORDER_RTOL * size).then_some(room > 0.0)
        });
        if self.to == self.from {
            return Some(caps[1] >= 0.0);
        }
        let on_ceilings = || {
            let slope = |y: &[f64; 2]| [1.0, -y[0].exp() / self.cap(y[0]).exp_m1()];
            integrate(slope, [start, 0.0], (start, end)).map(|y| y[1])
        };
        if self.to < self.from {
            if caps.into_iter().any(|cap| cap <= 0.0) {
                return Some(false);
            }
            return clear(t_f - on_ceilings()?, t_f);
        }
        let (aged, slow) = if self.floor {
            (((self.to - self.from) / (1.0 - self.to)).ln_1p(), 1.0 + self.law.b * end)
        } else {
            (self.to - self.from, f64::NEG_INFINITY)
        };
        if !clear(t_f - aged, t_f)? || !clear(self.tau_ceiling - slow, 1.0)? {
            return Some(false);
        }
        // Above theta_1 theta can wait or turn; below it only where the ceilings allow steady sliding.
        let waits =
            (0..=PLACES).any(|place| self.cap(start + (end - start) * f64::from(place) / f64::from(PLACES)) > 0.0);
        if caps[1] >= 0.0 || waits { Some(true) } else { clear(on_ceilings()? - t_f, t_f) }
    }

    /// `e^z - 1 - z` of the free minimiser, relative to the turn if there is one.
    fn energy(&self, l: f64, c: f64, turn: Option<f64>) -> f64 {
        let Law { a, .. } = self.law;
        match turn {
            Some(turn) => self.energy_beyond(turn, l - turn),
            None => (self.steady_friction(l) + c * l.exp()) / a,
        }
    }

    /// The same at `ln theta = turn + beyond`, without cancellation near the turn.
    fn energy_beyond(&self, turn: f64, beyond: f64) -> f64 {
        let Law { a, b } = self.law;
        ((b - a) * beyond - self.steady_friction(turn) * beyond.exp_m1()) / a
    }

    /// The clamped minimiser at `ln theta = l`, off by the fraction `off`.
    fn clamped(&self, l: f64, energy: f64, falls: bool, off: f64) -> f64 {
        let free = free(energy, falls) * (1.0 + off);
        let lifted = if self.floor && !falls { free.max(l) } else { free };
        lifted.min(self.cap(l))
    }

    /// `ln theta` at the turn of the protocol of `c`, above both ends.
    fn turn(&self, c: f64) -> Option<f64> {
        let g = |l: f64| self.steady_friction(l) + c * l.exp();
        let mut low = self.from.max(self.to).ln();
        let mut high = low;
        let mut step = 1e-3;
        while g(high) > 0.0 {
            (low, high, step) = (high, high + step, 2.0 * step);
            if high > 50.0 {
                return None;
            }
        }
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if g(middle) > 0.0 { low = middle } else { high = middle }
        }
        Some(low)
    }

    /// The totals of the protocol of `c` that turns if `turns`; `None` if it is no protocol.
    pub fn totals(&self, c: f64, turns: bool) -> Option<Totals> {
        let (start, end) = (self.from.ln(), self.to.ln());
        let legs = if turns {
            let turn = self.turn(c)?;
            vec![Leg { start, end: turn, turn: Some(turn) }, Leg { start: turn, end, turn: Some(turn) }]
        } else {
            vec![Leg { start, end, turn: None }]
        };
        let mut all = Totals { friction: [f64::INFINITY, f64::NEG_INFINITY], c, ..Totals::default() };
        all.theta_max = legs.iter().map(|leg| leg.start.max(leg.end)).fold(f64::NEG_INFINITY, f64::max).exp();
        for leg in &legs {
            self.add(leg, &mut all)?;
        }
        let (first, last) = (legs[0], legs[legs.len() - 1]);
        let at = |leg: &Leg, l: f64| self.clamped(l, self.energy(l, c, leg.turn), leg.end < leg.start, 0.0);
        let ends = [(&first, start), (&last, end)].map(|(leg, l)| (at(leg, l), l));
        let (z, l) = ends[0];
        all.on_friction_ceiling = z == (self.tau_ceiling - self.steady_friction(l)) / self.law.a;
        [all.v_start, all.v_end] = ends.map(|(z, l)| (z - l).exp());
        all.costate = ends.map(|(z, l)| {
            let friction = self.steady_friction(l) + self.law.a * z;
            (friction * (z - l).exp() + c) / z.exp_m1()
        });
        Some(all)
    }

    /// Adds the integrals of a leg.
    fn add(&self, leg: &Leg, all: &mut Totals) -> Option<()> {
        let c = all.c;
        let falls = leg.end < leg.start;
        let sums = match leg.turn {
            // theta = theta_h/(1 + X^2): the integrand is regular at the turn.
            Some(turn) => {
                let far = (turn - leg.start.min(leg.end)).exp_m1().sqrt();
                let slope = |y: &[f64; SUMS]| {
                    let x = y[0].max(1e-9 * far);
                    let beyond = -(x * x).ln_1p();
                    let rates = self.rates(turn + beyond, self.energy_beyond(turn, beyond), falls, c);
                    let mut slope = rates.map(|rate| rate * 2.0 * x / (1.0 + x * x));
                    slope[0] = 1.0;
                    slope
                };
                integrate(slope, [0.0; SUMS], (0.0, far))?
            }
            None => {
                let (low, high) = (leg.start.min(leg.end), leg.start.max(leg.end));
                let mut from = [0.0; SUMS];
                from[0] = low;
                integrate(|y: &[f64; SUMS]| self.rates(y[0], self.energy(y[0], c, None), falls, c), from, (low, high))?
            }
        };
        let [_, time, work, floor, at_v, at_tau, by_v, by_tau, by_a, by_b, varied] = sums;
        all.time += time;
        all.work += work;
        all.time_at_floor += floor;
        all.time_at_v_ceiling += at_v;
        all.time_at_tau_ceiling += at_tau;
        all.pressure = [all.pressure[0] + by_v, all.pressure[1] + by_tau];
        all.by_law = [all.by_law[0] + by_a, all.by_law[1] + by_b];
        all.varied += varied;
        for place in 0..=PLACES {
            let l = leg.start + (leg.end - leg.start) * f64::from(place) / f64::from(PLACES);
            let z = self.clamped(l, self.energy(l, c, leg.turn), falls, 0.0);
            let friction = self.steady_friction(l) + self.law.a * z;
            all.friction = [all.friction[0].min(friction), all.friction[1].max(friction)];
        }
        Some(())
    }

    /// The derivatives of the sums with respect to `ln theta`, counted as positive.
    fn rates(&self, l: f64, energy: f64, falls: bool, c: f64) -> [f64; SUMS] {
        let Law { a, .. } = self.law;
        let z = self.clamped(l, energy, falls, 0.0);
        let (v, slope) = ((z - l).exp(), z.exp_m1());
        let dt = l.exp() / slope.abs();
        let friction = self.steady_friction(l) + a * z;
        let on = |bound: f64| if (z - bound).abs() <= BOUND_RTOL * (1.0 + bound.abs()) { 1.0 } else { 0.0 };
        let free = free(energy, falls);
        let caps = [self.v_ceiling.ln() + l, (self.tau_ceiling - self.steady_friction(l)) / a];
        let is_capped = z < free;
        let [at_v, at_tau] = caps.map(|cap| if is_capped && z == cap { 1.0 } else { 0.0 });
        let at_floor = if self.floor && !falls { on(l) } else { 0.0 };
        let pressure = (energy - (slope - z)) / slope;
        let (nu, lambda) = (at_v * a * pressure, at_tau * v * pressure);
        let varied = self.clamped(l, energy, falls, if falls { -VARIATION } else { VARIATION });
        let (v_varied, dt_varied) = ((varied - l).exp(), l.exp() / varied.exp_m1().abs());
        let cost = (self.steady_friction(l) + a * varied) * v_varied + c;
        [
            1.0,
            dt,
            friction * v * dt,
            at_floor * dt,
            at_v * dt,
            at_tau * dt,
            nu * dt,
            lambda * dt,
            (v + lambda) * v.ln() * dt,
            (v + lambda) * l * dt,
            cost * dt_varied,
        ]
    }

    /// The protocol of duration `t_f`, by Newton's method from `c`.
    pub fn solve(&self, t_f: f64, c: f64, turns: bool) -> Option<Totals> {
        let mut here = self.totals(c, turns)?;
        for _ in 0..NEWTON_STEPS {
            let residual = here.time - t_f;
            if residual.abs() <= 1e-13 * t_f {
                break;
            }
            let step = 1e-6 * here.c.abs().max(1.0);
            let slope = (self.totals(here.c + step, turns)?.time - here.time) / step;
            // Shorter steps where a whole one leads away, or to no protocol.
            let steps = (0..12).map(|halvings| residual / slope * 0.5_f64.powi(halvings));
            let mut tried = steps.filter_map(|step| self.totals(here.c - step, turns));
            let Some(next) = tried.find(|next| (next.time - t_f).abs() < residual.abs()) else { break };
            here = next;
        }
        ((here.time - t_f).abs() <= 1e-9 * t_f).then_some(here)
    }
}

/// The free minimiser `z`; near a turn the first terms of its series in `w`, where `e^z - 1 - z = w^2/2`.
fn free(energy: f64, falls: bool) -> f64 {
    if energy >= SMALL_ENERGY {
        return branch(energy, falls).unwrap_or(0.0);
    }
    let root = (2.0 * energy.max(0.0)).sqrt();
    let w = if falls { root } else { -root };
    w * (1.0 - w / 6.0 * (1.0 - w / 6.0 * (1.0 - w * 2.0 / 15.0)))
}

/// Energy below which the next term of the series, `w^5/4320`, is a rounding.
const SMALL_ENERGY: f64 = 1e-7;

/// Places on a leg at which friction is looked at.
const PLACES: u32 = 4000;

/// Most steps of Newton's method, which needs a few from the `C` of a row.
const NEWTON_STEPS: u32 = 20;

/// The root of `e^z - 1 - z = h` above or below 0.
fn branch(h: f64, above: bool) -> Option<f64> {
    if h.is_nan() || h < 0.0 {
        return None;
    }
    let mut z = if above { (1.0 + h + (2.0 * h).sqrt()).ln() } else { -h - (2.0 * h).sqrt() };
    for _ in 0..100 {
        let slope = z.exp_m1();
        if slope == 0.0 {
            break;
        }
        let step = (slope - z - h) / slope;
        z -= step;
        if step.abs() <= 1e-15 * z.abs() {
            break;
        }
    }
    Some(z)
}

#[cfg(test)]
mod tests {
    //! Protocols of known `C`, with work by a 40-digit quadrature of another program.

    use super::*;

    #[test]
    fn reference_totals_of_a_known_c() {
        let paper = Law { a: 0.03, b: 0.05 };
        let way = |law, v_i: f64, v_f: f64, ceilings| Way::of(&Transition { law, v_i, v_f }, true, ceilings);
        let none = f64::INFINITY;
        let cases = [
            (way(paper, 3.0, 100.0, [1000.0, none]), -2.55860702801, false, 0.02, 3.82172461194),
            (way(paper, 3.0, 100.0, [none, 1.05]), -2.30742868597, false, 0.02, 3.80883954761),
            (way(paper, 3.0, 100.0, [400.0, 1.04]), -2.79363404017, true, 0.08, 4.09134444436),
            (way(paper, 100.0, 3.0, [4.5, none]), -2.28801277001, true, 0.7, 1.15046557999),
            (way(paper, 100.0, 3.0, [none, 0.965]), -3.52153861668, false, 0.5, 0.695391959139),
            (way(Law { a: 0.05, b: 0.02 }, 3.0, 100.0, [none, 1.36]), 117.191032104, false, 0.0012, 4.74738331205),
        ];
        for (way, c, turns, t_f, work) in cases {
            let found = way.totals(c, turns).expect("the integrator gets there");
            assert!((found.time / t_f - 1.0).abs() < 1e-9, "{way:?}: {}", found.time);
            assert!((found.work / work - 1.0).abs() < 1e-9, "{way:?}: {}", found.work);
        }
    }
}
