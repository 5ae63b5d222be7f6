//! The motion of a path: arcs on both bounds, a rise, and pulses instead of chattering.

use super::bound_arc::{BoundArc, Kind};
use super::rise::Rise;
use super::state::{State, down, up};
use super::{Path, Problem};
use crate::numerics::elementary::{exp, ln};
use crate::protocol::{Moment, Motion, equal_landmarks};

/// Pulses on the ceiling that stand for chattering. Chosen: they cost 1e-4 more work in the case of docs/laws.md.
pub const PULSES: usize = 16;

/// A piece of the motion.
#[derive(Debug, Clone, Copy)]
enum Piece {
    /// An arc on a bound.
    Bound(BoundArc),
    /// A rise of the slip law.
    Rise(Rise),
}

/// The motion.
pub struct BangBang {
    problem: Problem,
    t_f: f64,
    /// Each piece, its time of start, and the intervals in it.
    pieces: Vec<(Piece, f64, u32)>,
}

impl BangBang {
    /// The motion of `path`.
    pub(super) fn new(problem: &Problem, path: &Path, t_f: f64) -> BangBang {
        let mut motion = BangBang { problem: *problem, t_f, pieces: Vec::new() };
        match path {
            Path::OnBounds { arcs: [first, second], chatter } => {
                motion.push(first);
                let rest = first.ends[1];
                let held = Problem { from: rest, to: rest, ratio: 0.0, span: 0.0, ..*problem };
                if *chatter > 0.0
                    && let Some(pulse) = held.wait_and_jerk(chatter / PULSES as f64)
                {
                    (0..PULSES).for_each(|_| pulse.iter().for_each(|arc| motion.push(arc)));
                }
                motion.push(second);
            }
            Path::Rise(rise) => {
                let length = problem.from.below_floor - rise.end();
                motion.pieces.push((Piece::Rise(*rise), 0.0, length as u32 + 1));
                let (v, time) = (exp(rise.end()), rise.wait(problem));
                let from = State::steady(v, problem.ceiling);
                motion.push(&BoundArc { kind: Kind::Wait, length: time, ends: [from, problem.to], span: 0.0 });
            }
        }
        motion
    }

    /// Adds an arc, unless it is empty.
    fn push(&mut self, arc: &BoundArc) {
        let &BoundArc { length, ends: [from, to], .. } = arc;
        if length > 0.0 {
            let change = (from.below_floor - to.below_floor).abs();
            // A polynomial of degree 16 follows it to rounding.
            let intervals = ((length + change) as u32).min(MAX_INTERVALS) + 1;
            self.pieces.push((Piece::Bound(*arc), self.end(), intervals));
        }
    }

    /// Time at the end of the last piece.
    fn end(&self) -> f64 {
        self.pieces.last().map_or(0.0, |(piece, start, _)| start + self.duration_of(piece))
    }

    /// The number of intervals of all pieces.
    fn intervals(&self) -> u32 {
        self.pieces.iter().map(|(.., intervals)| intervals).sum()
    }

    fn duration_of(&self, piece: &Piece) -> f64 {
        match piece {
            Piece::Bound(arc) => arc.time(self.problem.ceiling),
            Piece::Rise(rise) => rise.time(&self.problem, rise.end()),
        }
    }

    /// Time since the start of a piece, velocity and `-ln theta` at a fraction of it.
    fn inside(&self, piece: &Piece, fraction: f64) -> [f64; 3] {
        let Problem { law, ceiling, from: start, .. } = self.problem;
        match *piece {
            Piece::Bound(BoundArc { kind, length, ends: [from, _], .. }) => {
                let part = fraction * length;
                match kind {
                    Kind::Wait => [part, 1.0, up(law, &from, ceiling, part).turn.below_floor],
                    Kind::Jerk => [part / ceiling, ceiling, down(law, &from, ceiling, part).turn.below_floor],
                }
            }
            Piece::Rise(rise) => {
                let state = start.below_floor + fraction * (rise.end() - start.below_floor);
                [rise.time(&self.problem, state), rise.velocity(&self.problem, state), state]
            }
        }
    }
}

/// Greatest number of intervals of a piece. Chosen: a long wait approaches rest within them.
const MAX_INTERVALS: u32 = 200;

impl Motion for BangBang {
    fn duration(&self) -> f64 {
        self.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        equal_landmarks(self.intervals() as usize)
    }

    fn at(&self, s: f64) -> Moment {
        let mut along = s.clamp(0.0, 1.0) * f64::from(self.intervals());
        let last = self.pieces.len().saturating_sub(1);
        let mut found = [0.0, f64::NAN, f64::NAN];
        for (state, (piece, start, intervals)) in self.pieces.iter().enumerate() {
            let intervals = f64::from(*intervals);
            if along <= intervals || state == last {
                let [t, v, below_floor] = self.inside(piece, (along / intervals).min(1.0));
                found = [start + t, v, below_floor];
                break;
            }
            along -= intervals;
        }
        let [t, v, below_floor] = found;
        let direct = if v == 1.0 { 0.0 } else { self.problem.a * ln(v) };
        Moment {
            t: if s >= 1.0 { self.t_f } else { t },
            v,
            theta: exp(-below_floor),
            friction: 1.0 + direct - self.problem.b * below_floor,
            v_c: None,
            beta: None,
        }
    }
}
