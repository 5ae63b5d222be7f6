//! An extremal of regularised friction over time.

use super::extremal::{Extremal, INTERVALS, Sums};
use crate::model::Friction;
use crate::protocol::motion::PieceTimes;
use crate::protocol::{Moment, Motion, SolverStats, equal_landmarks};

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
        let landmarks = equal_landmarks(INTERVALS as usize);
        let pieces = landmarks.windows(2).map(|ends| extremal.part([ends[0], ends[1]]));
        let times: Option<Vec<f64>> = pieces.map(|piece| Some(piece.sums(&whole, stats)?.time)).collect();
        let mut times = PieceTimes::new(&times?);
        times.set(0.0, t_f);
        Some(ExtremalMotion { extremal, t_f, whole, times })
    }

    /// Time at `s`.
    fn time(&self, s: f64) -> Option<f64> {
        let (piece, part) = self.times.part_at(s);
        let time = if part[0] < part[1] {
            self.extremal.part(part).sums(&self.whole, &mut SolverStats::default())?.time
        } else {
            0.0
        };
        Some(self.times.at(piece, time))
    }
}

impl Motion for ExtremalMotion {
    fn duration(&self) -> f64 {
        self.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        equal_landmarks(INTERVALS as usize)
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
