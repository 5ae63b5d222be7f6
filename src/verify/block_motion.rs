//! A block on its spring after a step of the control velocity, integrated with the explicit integrator of a library.
//!
//! With `x = ln(v/v_f)`, `y = ln(theta v_f)`, `p = (k s - tau_ss(v_f))/a`, times in `l/v_f` and `mu = m v_f^2/a`
//!
//! ```text
//! p' = (k/a) (1 - e^x),    y' = e^-y - e^x,    mu e^x x' = p - x - (b/a) y.
//! ```
//!
//! The variable of integration is the way that these go, not time, so that equal steps see every phase of a slip. Where
//! `x` follows the other two much faster than they change, as it does while the block sticks and always without mass, it is
//! given by them up to the second order in the ratio of the rates.

use std::cell::Cell;

use super::route::integrate;

/// A block on its spring.
#[derive(Debug, Clone)]
pub struct Block {
    /// `k/a`.
    pub pull: f64,
    /// `b/a`.
    pub ratio: f64,
    /// `m v_f^2/a`.
    pub mu: f64,
    /// Ratio of rates below which `x` is quasi-static; the error is its third power.
    pub fast: f64,
    /// Slopes evaluated so far.
    pub work: Cell<u64>,
}

/// The state at one time.
#[derive(Debug, Clone, Copy)]
pub struct BlockState {
    pub p: f64,
    pub y: f64,
    pub x: f64,
    pub t: f64,
    /// Whether `x` is quasi-static.
    slaved: bool,
}

/// An event.
#[derive(Debug, Clone, Copy)]
pub enum Event {
    /// The velocity turns, at a maximum or a minimum.
    Turn { here: BlockState, top: bool },
    /// The motion crosses a level.
    Pass { here: BlockState, level: f64, up: bool },
}

/// Greatest change of any variable along one leg.
const LEG: f64 = 0.5;

/// Slopes evaluated for one block.
const MOST_WORK: u64 = 10_000_000;

/// Distance from its quasi-static value within which `x` counts as quasi-static, and ratio of rates below which it relaxes
/// at once.
const FOLLOWING_DISTANCE: f64 = 1e-10;
const FOLLOWING_RATE_RATIO: f64 = 1e-13;

impl Block {
    /// Steady sliding at `e^x v_f`.
    pub fn steady(&self, x: f64) -> BlockState {
        BlockState { p: (1.0 - self.ratio) * x, y: -x, x, t: 0.0, slaved: self.mu == 0.0 }
    }

    /// The section `v = v_f`.
    pub fn section(&self, p: f64, y: f64) -> BlockState {
        BlockState { p, y, ..self.steady(0.0) }
    }

    fn slopes(&self, p: f64, y: f64, x: f64) -> [f64; 3] {
        let slow = [-self.pull * x.exp_m1(), (-y).exp() - x.exp()];
        [slow[0], slow[1], (p - x - self.ratio * y) / (self.mu * x.exp())]
    }

    /// The slow manifold of `x`, and its rate.
    fn followed(&self, p: f64, y: f64) -> (f64, f64) {
        let rest = p - self.ratio * y;
        let mut x = rest;
        let mut speed = 0.0;
        // Without mass the first value is exact; each iteration gains an order.
        for _ in 0..8 {
            let (v, ageing) = (x.exp(), (-y).exp());
            let first = -self.pull * x.exp_m1() - self.ratio * (ageing - v);
            let second = -self.pull * v * first - self.ratio * (-ageing * (ageing - v) - v * first);
            speed = first - self.mu * v * (first * first + second);
            let next = rest - self.mu * v * speed;
            if (next - x).abs() <= 1e-15 * x.abs() {
                break;
            }
            x = next;
        }
        (x, speed)
    }

    /// Rate at which `x` changes.
    pub fn speed(&self, here: &BlockState) -> f64 {
        if !here.slaved {
            return self.slopes(here.p, here.y, here.x)[2];
        }
        let (x, speed) = self.followed(here.p, here.y);
        if self.mu == 0.0 {
            return speed;
        }
        // The derivative along the motion of p and y, as accurate as x.
        let way = [-self.pull * x.exp_m1(), (-here.y).exp() - x.exp()];
        let step = 1e-3 / (way[0].abs() + way[1].abs());
        let at = |fraction: f64| self.followed(here.p + fraction * step * way[0], here.y + fraction * step * way[1]).0;
        (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step)
    }

    /// Relative error of the slope of the velocity at a turn.
    pub fn flatness(&self, turn: &BlockState) -> Option<f64> {
        let later = self.advance(turn, 0.1 * LEG)?;
        let bend = (self.speed(&later) - self.speed(turn)) / (later.t - turn.t);
        let slopes = [self.pull * turn.x.exp_m1(), self.ratio * ((-turn.y).exp() - turn.x.exp())];
        Some((slopes[0].abs() + slopes[1].abs()) / bend.abs())
    }

    /// Rate of change of the other variables over the relaxation rate of `x`.
    fn ratio_of_rates(&self, here: &BlockState) -> f64 {
        let v = here.x.exp();
        self.mu * v * ((self.pull + self.ratio) * (1.0 + v) + (1.0 + self.ratio) * (-here.y).exp())
    }

    /// The fastest oscillation of small amplitude, which bounds the length of a leg.
    fn block_motion(&self) -> f64 {
        1.0 + (self.pull / self.mu).sqrt().min(self.pull)
    }

    /// The state after the change `way` of the variables; `None` if the integrator fails or needs too many evaluations.
    fn advance(&self, here: &BlockState, way: f64) -> Option<BlockState> {
        if self.work.get() > MOST_WORK {
            return None;
        }
        let block_motion = self.block_motion();
        let pace = |slopes: [f64; 3]| 1.0 / slopes.iter().fold(block_motion, |sum, slope| sum.hypot(*slope));
        if here.slaved {
            let slope = |y: &[f64; 3]| {
                self.work.set(self.work.get() + 1);
                let (x, speed) = self.followed(y[0], y[1]);
                let [p, age] = [-self.pull * x.exp_m1(), (-y[1]).exp() - x.exp()];
                let pace = pace([p, age, speed]);
                [p * pace, age * pace, pace]
            };
            let [p, y, t] = integrate(slope, [here.p, here.y, 0.0], (0.0, way))?;
            return Some(BlockState { p, y, x: self.followed(p, y).0, t: here.t + t, slaved: true });
        }
        let slope = |y: &[f64; 4]| {
            self.work.set(self.work.get() + 1);
            let slopes = self.slopes(y[0], y[1], y[2]);
            let pace = pace(slopes);
            [slopes[0] * pace, slopes[1] * pace, slopes[2] * pace, pace]
        };
        let [p, y, x, t] = integrate(slope, [here.p, here.y, here.x, 0.0], (0.0, way))?;
        Some(BlockState { p, y, x, t: here.t + t, slaved: false })
    }

    /// The state, with `x` quasi-static if it may be from here on.
    fn settle(&self, here: BlockState) -> BlockState {
        if self.mu == 0.0 {
            return here;
        }
        let fast = self.ratio_of_rates(&here);
        if here.slaved {
            return BlockState { slaved: fast < 2.0 * self.fast, ..here };
        }
        let x = self.followed(here.p, here.y).0;
        let follows = fast < FOLLOWING_RATE_RATIO || (fast < self.fast && (here.x - x).abs() < FOLLOWING_DISTANCE);
        if follows { BlockState { x, slaved: true, ..here } } else { here }
    }

    /// Length of the next leg: up to the distance from the quasi-static value, or some relaxation times of `x`.
    fn length(&self, here: &BlockState) -> f64 {
        let fast = self.ratio_of_rates(here);
        if here.slaved || fast >= self.fast {
            return LEG;
        }
        (0.7 * (here.x - self.followed(here.p, here.y).0).abs()).max(3.0 * fast).min(LEG)
    }

    /// One leg, and the crossings of `levels`, which ascend, along it.
    pub fn leg(&self, here: BlockState, levels: &[f64]) -> Option<(BlockState, Vec<Event>)> {
        let before = here;
        let here = self.settle(here);
        let rising = self.speed(&here) > 0.0;
        // An instantaneous arrest crosses levels, too.
        let fallen = levels.iter().rev().filter(|level| **level < before.x && **level >= here.x);
        let mut events: Vec<Event> =
            fallen.map(|&level| Event::Pass { here: BlockState { x: level, ..here }, level, up: false }).collect();
        let was_rising = self.speed(&before) > 0.0;
        if was_rising != rising {
            events.push(Event::Turn { here, top: was_rising });
        }
        let length = self.length(&here);
        let end = self.advance(&here, length)?;
        let turns = rising != (self.speed(&end) > 0.0);
        if turns {
            let (place, turn) = self.place(&here, (0.0, length), |at| self.speed(at))?;
            self.passes(&here, (0.0, here.x), (place, turn.x), levels, &mut events)?;
            events.push(Event::Turn { here: turn, top: rising });
            self.passes(&here, (place, turn.x), (length, end.x), levels, &mut events)?;
        } else {
            self.passes(&here, (0.0, here.x), (length, end.x), levels, &mut events)?;
        }
        Some((end, events))
    }

    /// The levels crossed between two places of a leg between which the velocity is monotone.
    fn passes(
        &self,
        here: &BlockState,
        (from, x_from): (f64, f64),
        (to, x_to): (f64, f64),
        levels: &[f64],
        events: &mut Vec<Event>,
    ) -> Option<()> {
        let up = x_to > x_from;
        let mut met: Vec<f64> =
            levels.iter().copied().filter(|level| (x_from < *level) != (x_to < *level) && x_from != *level).collect();
        met.sort_by(|a, b| if up { a.total_cmp(b) } else { b.total_cmp(a) });
        for level in met {
            let (_, at) = self.place(here, (from, to), |at| at.x - level)?;
            events.push(Event::Pass { here: BlockState { x: level, ..at }, level, up });
        }
        Some(())
    }

    /// The zero of a function on a leg with a change of sign: Illinois method.
    fn place(
        &self,
        here: &BlockState,
        (mut low, mut high): (f64, f64),
        f: impl Fn(&BlockState) -> f64,
    ) -> Option<(f64, BlockState)> {
        let at = |way: f64| if way == 0.0 { Some(*here) } else { self.advance(here, way) };
        let (mut f_low, mut f_high) = (f(&at(low)?), f(&at(high)?));
        let mut found = (low, at(low)?);
        let mut side = 0;
        for _ in 0..60 {
            let way = if f_high == f_low { 0.5 * (low + high) } else { low - f_low * (high - low) / (f_high - f_low) };
            let way = way.clamp(low, high);
            let last = found.0;
            found = (way, at(way)?);
            let value = f(&found.1);
            if value == 0.0 || (way - last).abs() <= 1e-13 {
                break;
            }
            if (value > 0.0) == (f_high > 0.0) {
                (high, f_high) = (way, value);
                f_low *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                (low, f_low) = (way, value);
                f_high *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
            }
        }
        Some(found)
    }
}
