//! A protocol over time: traces show it, and `verify` integrates it independently.

use crate::model::Friction;

/// State of a protocol at one time, in scaled units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Time since the start, `0 <= t <= t_f`.
    pub t: f64,
    /// Velocity.
    pub v: f64,
    /// State variable.
    pub theta: f64,
    /// Friction.
    pub friction: f64,
    /// Control velocity, where the spring is elastic.
    pub v_c: Option<f64>,
    /// Costate of the state variable, where the protocol is an extremal.
    pub beta: Option<f64>,
}

/// Landmarks of a motion of `count` intervals, which are equally long in `s`.
pub(crate) fn equal_landmarks(count: usize) -> Vec<f64> {
    (0..=count).map(|k| k as f64 / count as f64).collect()
}

/// The interval at `s` of `count` that are equally long in `s`, and the fraction of it.
pub(crate) fn interval_at(s: f64, count: usize) -> (usize, f64) {
    let along = s.clamp(0.0, 1.0) * count as f64;
    let k = (along as usize).min(count - 1);
    (k, along - k as f64)
}

/// Times along consecutive pieces, counted from the nearer end: the layers at both ends keep their digits.
pub(super) struct PieceTimes {
    /// Time from the start to the start of each piece, and to the end.
    pub gone: Vec<f64>,
    /// Time from the start of each piece to the end, and 0.
    pub left: Vec<f64>,
    /// When they begin and end.
    pub start: f64,
    pub end: f64,
    /// The factor that makes the times of the pieces add up.
    scale: f64,
    /// When the pieces begin whose times count from the end.
    middle: f64,
}

impl PieceTimes {
    /// Pieces that take these times, from the time 0 on.
    pub fn new(times: &[f64]) -> PieceTimes {
        let sums = |times: &mut dyn Iterator<Item = &f64>| {
            let mut sums = vec![0.0];
            sums.extend(times.scan(0.0, |sum, time| {
                *sum += time;
                Some(*sum)
            }));
            sums
        };
        let gone = sums(&mut times.iter());
        let mut left = sums(&mut times.iter().rev());
        left.reverse();
        let end = left[0];
        let mut all = PieceTimes { gone, left, start: 0.0, end, scale: 1.0, middle: 0.0 };
        all.set(0.0, end);
        all
    }

    /// Moves the pieces to the time from `start` to `end`.
    pub fn set(&mut self, start: f64, end: f64) {
        let nearer_end = self.gone.iter().skip(1).zip(&self.left).find(|(gone, left)| gone > left);
        self.scale = (end - start) / self.left[0];
        self.middle = end - self.scale * nearer_end.map_or(0.0, |(_, &left)| left);
        (self.start, self.end) = (start, end);
    }

    /// Whether the times of a piece count from the start.
    fn is_nearer_start(&self, piece: usize) -> bool {
        self.gone[piece + 1] <= self.left[piece]
    }

    /// The piece at `s` of pieces that are equally long in `s`, from 0 to 1, and the part of it from `s` to the end from which its times count.
    pub fn part_at(&self, s: f64) -> (usize, [f64; 2]) {
        let count = self.left.len() - 1;
        let (piece, _) = interval_at(s, count);
        let [from, to] = [piece, piece + 1].map(|edge| edge as f64 / count as f64);
        (piece, if self.is_nearer_start(piece) { [from, s] } else { [s, to] })
    }

    /// The time in a piece, `part` after its start or, if its times count from the end, before its end.
    pub fn at(&self, piece: usize, part: f64) -> f64 {
        // Rounding must not let the time run backwards where one piece or one way of counting gives way to the next.
        if self.is_nearer_start(piece) {
            let gone = (self.gone[piece] + part).min(self.gone[piece + 1]);
            (self.start + self.scale * gone).min(self.middle).max(self.start)
        } else {
            let left = (self.left[piece + 1] + part).min(self.left[piece]);
            (self.end - self.scale * left).max(self.middle).min(self.end)
        }
    }
}

/// A protocol as a curve over a parameter `s` from 0 to 1, along which time never falls.
///
/// The parameter stretches layers that are thin in time. `at(0.0)` is just after the jump at the start, `at(1.0)` just
/// before the jump at the end.
pub trait Motion: Sync {
    /// Duration `t_f`.
    fn duration(&self) -> f64;

    /// Values of `s`, ascending from 0 to 1, between which the curve is smooth on the scale of the interval.
    fn landmarks(&self) -> Vec<f64>;

    /// State at `s`, clamped to `[0, 1]`.
    fn at(&self, s: f64) -> Moment;

    /// Form of friction before and after the motion, and on it.
    fn friction(&self) -> Friction {
        Friction::Log
    }

    /// Whether steady sliding at the initial velocity precedes; false for a motion that starts from some state.
    fn departs(&self) -> bool {
        true
    }

    /// Whether steady sliding at the final velocity follows; false for a motion that is cut off at some time.
    fn arrives(&self) -> bool {
        true
    }
}
