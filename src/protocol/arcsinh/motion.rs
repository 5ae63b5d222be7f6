//! An extremal of regularised friction over time.

use super::extremal::{Extremal, INTERVALS, Sums};
use crate::model::Friction;
use crate::protocol::motion::PieceTimes;
use crate::protocol::{Moment, Motion, SolverStats};

/// The motion along an extremal; its parameter is the fraction of the coordinate.
pub(super) struct ExtremalMotion {
    extremal: Extremal,
    t_f: f64,
    /// Sums of the whole: near a turn and at rest those of an interval have few digits.
    whole: Sums,
    times: PieceTimes,
}

impl ExtremalMotion {
    /// The motion of duration `t_f`; `None` if the extremal does not exist throughout.
    pub fn new(extremal: Extremal, t_f: f64, stats: &mut SolverStats) -> Option<ExtremalMotion> {
        let whole = extremal.sums(&Sums::default(), stats)?;
        let mut time = |interval| Some(extremal.part([interval, interval + 1].map(place)).sums(&whole, stats)?.time);
        let times: Option<Vec<f64>> = (0..INTERVALS).map(&mut time).collect();
        let mut times = PieceTimes::new(&times?);
        times.set(0.0, t_f);
        Some(ExtremalMotion { extremal, t_f, whole, times })
    }

    /// Time at `s`.
    fn time(&self, s: f64) -> Option<f64> {
        let interval = ((s * f64::from(INTERVALS)) as u32).min(INTERVALS - 1);
        let (piece, [from, to]) = (interval as usize, [interval, interval + 1].map(place));
        let part = if self.times.is_nearer_start(piece) { [from, s] } else { [s, to] };
        let time = if part[0] < part[1] {
            self.extremal.part(part).sums(&self.whole, &mut SolverStats::default())?.time
        } else {
            0.0
        };
        Some(self.times.at(piece, time))
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
