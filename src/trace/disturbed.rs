//! A protocol whose state variable is disturbed on the way: the rest of it open loop, with the velocity as planned, and closed loop, with
//! the optimal velocity of the disturbed state.

use crate::model::Transition;
use crate::numerics::elementary::{exp, ln_1p};
use crate::numerics::radau::{NODES, Nodes, radau};
use crate::protocol::{Moment, Motion};

/// A sudden change of theta.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbance {
    /// Relative change of theta, above -1.
    pub change: f64,
    /// Time of the change as a fraction of the duration, inside `(0, 1)`.
    pub at: f64,
}

/// The rest of a protocol after a disturbance.
pub struct Rest {
    /// Its motion, from the time of the disturbance on.
    pub motion: Box<dyn Motion>,
    /// Its work.
    pub work: f64,
    /// `theta(t_f) v_f - 1`.
    pub terminal_error: f64,
}

/// The part of a motion up to a place `s`, which does not arrive in steady sliding if it is shorter, or depart from it if it starts from a state.
pub(super) struct MotionPart {
    motion: Box<dyn Motion>,
    s: f64,
    t: f64,
    departs: bool,
}

impl MotionPart {
    /// The part of `motion` up to a place, and its moment there.
    pub(super) fn start(motion: Box<dyn Motion>, (s, moment): (f64, Moment)) -> MotionPart {
        MotionPart { motion, s, t: moment.t, departs: true }
    }

    /// A motion that starts from a state on the way, not from steady sliding.
    pub(super) fn from_state(motion: Box<dyn Motion>) -> MotionPart {
        MotionPart { s: 1.0, t: motion.duration(), motion, departs: false }
    }
}

impl Motion for MotionPart {
    fn duration(&self) -> f64 {
        self.t
    }

    fn landmarks(&self) -> Vec<f64> {
        let before = self.motion.landmarks().into_iter().take_while(|&s| s < self.s);
        before.map(|s| s / self.s).chain([1.0]).collect()
    }

    fn at(&self, s: f64) -> Moment {
        self.motion.at(s * self.s)
    }

    fn departs(&self) -> bool {
        self.departs
    }

    fn arrives(&self) -> bool {
        self.s == 1.0
    }
}

/// Pieces of an interval between landmarks. Chosen: with them the open loop of the paper's protocol keeps 12 digits.
const PIECES_PER_INTERVAL: u32 = 4;

/// The planned velocity after a disturbance of theta: `d theta' = -v d theta`, so the difference shrinks by `e^-slip`.
struct OpenLoop {
    planned: Box<dyn Motion>,
    first: Moment,
    s: f64,
    /// The difference of theta just after the disturbance.
    difference: f64,
    pieces: Vec<PlannedPiece>,
    b: f64,
}

/// A piece of the planned motion, by its parameter, with the slip since the disturbance.
struct PlannedPiece {
    start: f64,
    length: f64,
    slip: f64,
    slips: Nodes,
}

/// The rest of `planned` after a disturbance at the place `s`, open loop.
pub(super) fn open_loop(
    planned: Box<dyn Motion>,
    (s, first): (f64, Moment),
    work: f64,
    change: f64,
    transition: &Transition,
) -> Rest {
    let b = transition.law.b;
    let ends: Vec<f64> = [s].into_iter().chain(planned.landmarks().into_iter().filter(|&mark| mark > s)).collect();
    let difference = change * first.theta;
    let (mut pieces, mut slip, mut excess) = (Vec::new(), 0.0, 0.0);
    for pair in ends.windows(2) {
        let length = (pair[1] - pair[0]) / f64::from(PIECES_PER_INTERVAL);
        for step in 0..PIECES_PER_INTERVAL {
            let start = pair[0] + f64::from(step) * length;
            let moments: [Moment; NODES] = std::array::from_fn(|j| planned.at(start + length * radau().u[j]));
            let t = planned.at(start).t;
            let rates = radau().slopes(&std::array::from_fn(|j| moments[j].t - t));
            let powers: Nodes = std::array::from_fn(|j| moments[j].v * rates[j]);
            let slips = radau().integrals(&powers);
            let costs =
                std::array::from_fn(|j| b * ln_1p(difference * exp(-(slip + slips[j])) / moments[j].theta) * powers[j]);
            excess += radau().integrals(&costs)[NODES - 1];
            pieces.push(PlannedPiece { start, length, slip, slips });
            slip += slips[NODES - 1];
        }
    }
    let miss = difference * exp(-slip) * transition.v_f;
    let motion = OpenLoop { planned, first, s, difference, pieces, b };
    Rest { motion: Box::new(motion), work: work + excess, terminal_error: miss }
}

impl OpenLoop {
    fn slip(&self, s: f64) -> f64 {
        let place = self.pieces.partition_point(|piece| piece.start <= s).saturating_sub(1);
        let Some(PlannedPiece { start, length, slip, slips }) = self.pieces.get(place) else { return 0.0 };
        slip + radau().interpolate(Some(0.0), slips, ((s - start) / length).clamp(0.0, 1.0))
    }
}

impl Motion for OpenLoop {
    fn duration(&self) -> f64 {
        self.planned.duration() - self.first.t
    }

    fn landmarks(&self) -> Vec<f64> {
        let after = self.planned.landmarks().into_iter().filter(|&mark| mark > self.s);
        [0.0].into_iter().chain(after.map(|mark| (mark - self.s) / (1.0 - self.s))).collect()
    }

    fn at(&self, s: f64) -> Moment {
        let planned = self.s + (1.0 - self.s) * s.clamp(0.0, 1.0);
        let moment = self.planned.at(planned);
        let difference = self.difference * exp(-self.slip(planned));
        Moment {
            t: moment.t - self.first.t,
            theta: moment.theta + difference,
            friction: moment.friction + self.b * ln_1p(difference / moment.theta),
            beta: None,
            ..moment
        }
    }

    fn departs(&self) -> bool {
        false
    }
}
