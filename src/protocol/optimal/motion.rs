//! The optimal protocol over time: the hold, then the arc along the coordinate of its chart.

use super::arc::{Arc, EqualSteps};
use super::extremal::{Extremal, Problem};
use super::lifetime::Lifetime;
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::protocol::{Moment, Motion};

/// The motion of one extremal. Its parameter `s` runs along the hold up to `fraction`, then along the arc.
pub struct Optimal {
    pub(super) law: Law,
    pub(super) t_f: f64,
    bounded: bool,
    pub(super) floor: Floor,
    /// The part of `s` that the hold takes.
    fraction: f64,
    pub(super) arc: Option<Timed>,
}

/// The rounding error of a velocity at the floor, relative.
const ROUNDING: f64 = 1e-9;

impl Optimal {
    /// The motion of `extremal`, or of the hold alone, in time `t_f`.
    pub(super) fn new(problem: &Problem, t_f: f64, extremal: Option<Extremal>) -> Optimal {
        let (theta_s, time_at_floor) =
            extremal.map_or((problem.to.theta, t_f), |found| (found.theta_s, found.time_at_floor));
        let arc = extremal.map(|found| Timed::new(&found.arc, time_at_floor, t_f));
        let floor = Floor::new(problem, theta_s, arc.as_ref().map_or(t_f, |arc| arc.start));
        let (held, moving) = (floor.length(), arc.as_ref().map_or(0.0, |arc| arc.pieces.length.abs()));
        let fraction = if arc.is_none() { 1.0 } else { held / (held + moving) };
        Optimal { law: problem.law, t_f, bounded: problem.bounded, floor, fraction, arc }
    }
}

impl Motion for Optimal {
    fn duration(&self) -> f64 {
        self.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        let mut landmarks = vec![0.0];
        if self.fraction > 0.0 {
            let (first, length) = (self.floor.first(), self.floor.length());
            for (from, to) in [(0.0, first), (first, length)] {
                let pieces = (to - from).ceil().max(1.0);
                let place = |i: u32| (from + (to - from) * f64::from(i) / pieces) / length;
                landmarks.extend((1..=pieces as u32).map(|i| self.fraction * place(i)));
            }
        }
        if let Some(arc) = &self.arc {
            let count = arc.pieces.count;
            landmarks
                .extend((1..=count).map(|i| self.fraction + (1.0 - self.fraction) * f64::from(i) / f64::from(count)));
        }
        if let Some(last) = landmarks.last_mut() {
            *last = 1.0;
        }
        landmarks
    }

    fn at(&self, s: f64) -> Moment {
        let s = s.clamp(0.0, 1.0);
        let arc = match &self.arc {
            Some(arc) if s >= self.fraction => arc,
            _ => return self.floor.at(s / self.fraction),
        };
        let Law { a, b } = self.law;
        let place = if s == 1.0 { 1.0 } else { ((s - self.fraction) / (1.0 - self.fraction)).min(1.0) };
        let here = arc.pieces.at(place);
        let v = exp(here.ln_u - here.ln_theta);
        let on_bound = self.bounded && v < 1.0 && v > 1.0 - ROUNDING;
        let friction = 1.0 + a * here.ln_u + (b - a) * here.ln_theta;
        Moment {
            t: arc.time(place),
            v: if on_bound { 1.0 } else { v },
            theta: here.theta,
            friction,
            v_c: None,
            // C - a v, which cancels where v is large.
            beta: Some(-(friction + a) / here.theta),
        }
    }
}

/// The hold: `v = 1` until the contact lifetime is `theta_s`.
pub(super) struct Floor {
    pub law: Law,
    pub from: Lifetime,
    theta_s: f64,
    pub time: f64,
    /// Costate where the arc begins, `C - a`.
    beta_s: f64,
}

impl Floor {
    /// The hold of `problem` that takes `time`, until the contact lifetime is `theta_s`.
    pub fn new(problem: &Problem, theta_s: f64, time: f64) -> Floor {
        let beta_s = -(1.0 + problem.law.a + problem.law.b * ln(theta_s)) / theta_s;
        Floor { law: problem.law, from: problem.from, theta_s, time, beta_s }
    }

    /// The costate at the start.
    pub fn costate_at_start(&self) -> f64 {
        self.costate(self.from.ln, self.from.rest, self.time)
    }

    /// Length of its coordinate. `ln theta` changes over its first value at the start, and theta and the costate over 1 at
    /// both ends: the logarithm of the time from either end, in these units, opens them.
    pub fn length(&self) -> f64 {
        self.first() + ln_1p(0.5 * self.time)
    }

    /// Its coordinate in the middle of the hold.
    fn first(&self) -> f64 {
        ln_1p(0.5 * self.time / self.from.theta)
    }

    /// The moment at `place`, from 0 at the start to 1 at the end.
    pub fn at(&self, place: f64) -> Moment {
        let along = self.length() * place;
        // The time gone and the time left.
        let (gone, left) = if along < self.first() {
            let gone = (self.from.theta * exp_m1(along)).min(0.5 * self.time);
            (gone, self.time - gone)
        } else {
            let left = exp_m1(self.length() - along).clamp(0.0, 0.5 * self.time);
            (self.time - left, left)
        };
        let now = self.from.aged(gone);
        Moment {
            t: gone,
            v: 1.0,
            theta: now.theta,
            friction: 1.0 + self.law.b * now.ln,
            v_c: None,
            beta: Some(self.costate(now.ln, now.rest, left)),
        }
    }

    /// `beta = (C + tau)/(1 - theta)` with `C + tau = beta_s (1 - theta_s) + b ln(theta/theta_s)`, in terms that do not
    /// cancel; `rest` is `1 - theta`.
    fn costate(&self, ln_theta: f64, rest: f64, left: f64) -> f64 {
        // 1 - theta_s = rest e^(-left), and theta_s - theta = rest gain.
        let gain = -exp_m1(-left);
        let way = rest * gain / self.theta_s;
        let ratio = if way == 0.0 {
            1.0
        } else if way < 0.5 {
            -ln_1p(-way) / way
        } else {
            (ln(self.theta_s) - ln_theta) / way
        };
        self.beta_s * exp(-left) - self.law.b * gain / self.theta_s * ratio
    }
}

/// The arc with its time.
pub(super) struct Timed {
    pub pieces: EqualSteps,
    /// The conserved `C`.
    pub c: f64,
    /// When it begins.
    pub start: f64,
    t_f: f64,
    /// Time from the start of the arc to the start of each piece, and to the end.
    pub gone: Vec<f64>,
    /// Time from the start of each piece to the end of the arc, and 0.
    pub left: Vec<f64>,
    /// The factor that makes the times of the steps add up.
    scale: f64,
    /// When the pieces begin whose times count from the end.
    middle: f64,
}

impl Timed {
    fn new(arc: &Arc, time_at_floor: f64, t_f: f64) -> Timed {
        Timed::ending(arc, t_f, |total| if time_at_floor > 0.0 { (t_f - total).max(0.0) } else { 0.0 })
    }

    /// The arc from `start` to `end`.
    pub fn between(arc: &Arc, start: f64, end: f64) -> Timed {
        Timed::ending(arc, end, |_| start)
    }

    /// The arc until `t_f`, from a time that depends on how long it takes.
    fn ending(arc: &Arc, t_f: f64, start: impl Fn(f64) -> f64) -> Timed {
        let pieces = arc.pieces();
        let edge = |piece: usize| piece as f64 / f64::from(pieces.count);
        let times: Vec<f64> = (0..pieces.count as usize).map(|i| pieces.time(edge(i), edge(i + 1))).collect();
        let sums = |times: &mut dyn Iterator<Item = &f64>| {
            let mut sum = 0.0;
            let mut sums = vec![0.0];
            for time in times {
                sum += time;
                sums.push(sum);
            }
            sums
        };
        let gone = sums(&mut times.iter());
        let mut left = sums(&mut times.iter().rev());
        left.reverse();
        let total = left[0];
        // Rounding of the search goes to the hold, if there is one.
        let start = start(total);
        let scale = (t_f - start) / total;
        let middle = gone.iter().skip(1).zip(&left).find(|(gone, left)| gone > left).map_or(0.0, |(_, &left)| left);
        Timed { pieces, c: arc.c(), start, t_f, gone, left, scale, middle: t_f - scale * middle }
    }

    /// Time since the start of the protocol: from the nearer end of the arc, so that the layers at both ends keep their
    /// digits.
    pub fn time(&self, place: f64) -> f64 {
        let count = f64::from(self.pieces.count);
        let piece = ((place * count) as usize).min(self.pieces.count as usize - 1);
        let (from, to) = (piece as f64 / count, (piece + 1) as f64 / count);
        // Rounding must not let the time run backwards where one piece or one way of counting gives way to the next.
        if self.gone[piece + 1] <= self.left[piece] {
            let gone = (self.gone[piece] + self.pieces.time(from, place)).min(self.gone[piece + 1]);
            (self.start + self.scale * gone).min(self.middle).max(self.start)
        } else {
            let left = (self.left[piece + 1] + self.pieces.time(place, to)).min(self.left[piece]);
            (self.t_f - self.scale * left).max(self.middle).min(self.t_f)
        }
    }
}
