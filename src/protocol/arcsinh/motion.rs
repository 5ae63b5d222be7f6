//! An extremal of regularised friction over time.

use super::extremal::{Extremal, Sums};
use crate::model::Friction;
use crate::protocol::{Moment, Motion, SolverStats};

/// Intervals between landmarks. Measured: with so many, all random optima of the physical domain can be traced (`cargo test random_optima`).
const INTERVALS: u32 = 32;

/// The motion along an extremal; its parameter is the fraction of the coordinate.
pub(super) struct ExtremalMotion {
    extremal: Extremal,
    t_f: f64,
    /// Sums of the whole: near a turn and at rest those of an interval have few digits.
    whole: Sums,
    /// Times from the start to the edges of the intervals, and from the edges to the end.
    gone: Vec<f64>,
    left: Vec<f64>,
    /// When the intervals begin whose times count from the end.
    middle: f64,
}

impl ExtremalMotion {
    /// The motion of duration `t_f`; `None` if the extremal does not exist throughout.
    pub fn new(extremal: Extremal, t_f: f64, stats: &mut SolverStats) -> Option<ExtremalMotion> {
        let whole = extremal.sums(&Sums::default(), stats)?;
        let (mut gone, mut left) = (vec![0.0], vec![0.0]);
        for interval in 0..INTERVALS {
            let time = extremal.part([interval, interval + 1].map(place)).sums(&whole, stats)?.time;
            gone.push(gone[gone.len() - 1] + time);
            left.iter_mut().for_each(|left| *left += time);
            left.push(0.0);
        }
        let nearer_end = gone.iter().skip(1).zip(&left).find(|(gone, left)| gone > left);
        let middle = t_f - nearer_end.map_or(0.0, |(_, &left)| left);
        Some(ExtremalMotion { extremal, t_f, whole, gone, left, middle })
    }

    /// Time at `s`: from the nearer end, so that the layers at both ends keep their digits.
    fn time(&self, s: f64) -> Option<f64> {
        let interval = ((s * f64::from(INTERVALS)) as u32).min(INTERVALS - 1);
        let [from, to] = [interval, interval + 1].map(place);
        let (first, next) = (interval as usize, interval as usize + 1);
        let time = |part| Some(self.extremal.part(part).sums(&self.whole, &mut SolverStats::default())?.time);
        if self.gone[next] <= self.left[first] {
            let since = if s <= from { 0.0 } else { time([from, s])? };
            Some((self.gone[first] + since).min(self.gone[next]).min(self.middle))
        } else {
            Some((self.t_f - (self.left[next] + time([s, to])?).min(self.left[first])).max(self.middle))
        }
    }
}

/// The fraction at the start of an interval.
fn place(interval: u32) -> f64 {
    f64::from(interval) / f64::from(INTERVALS)
}

impl Motion for ExtremalMotion {
    fn duration(&self) -> f64 {
        self.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        (0..=INTERVALS).map(place).collect()
    }

    fn at(&self, s: f64) -> Moment {
        let s = s.clamp(0.0, 1.0);
        let t = if s < 1.0 { self.time(s).unwrap_or(f64::NAN) } else { self.t_f };
        let Some(point) = self.extremal.at(s) else {
            return Moment { t, v: f64::NAN, theta: f64::NAN, friction: f64::NAN, v_c: None, beta: None };
        };
        let law = &self.extremal.law;
        let beta = Some(-point.costate(law));
        Moment { t, v: point.velocity(), theta: point.theta, friction: point.friction(law), v_c: None, beta }
    }

    fn friction(&self) -> Friction {
        Friction::Regularised
    }
}
