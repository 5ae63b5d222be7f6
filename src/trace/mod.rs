//! A protocol over time: its selection, its moments and their output.

mod disturbed;
mod protocol;
#[cfg(feature = "read")]
mod row;
mod sample;
mod write;

use crate::grid::Grid;
use crate::model::{Transition, Units};
use crate::numerics::elementary::ln;
use crate::protocol::{Moment, Motion};
use crate::table::Column;

pub use disturbed::{Disturbance, Rest};
pub use protocol::{
    Absence, Disturbed, Parameter, Protocol, TracedPath, has_floor, has_regularised_friction, names, quantities,
};
#[cfg(feature = "read")]
pub(crate) use row::point_of;
#[cfg(feature = "read")]
pub use row::{Pathless, TABLES, protocol_of};
pub use sample::{RANGE_RTOL, VALUE_RTOL};
pub use write::{csv, parquet, record_batch};

/// The columns of a trace; `v_c` only for an elastic spring, `beta` only for an extremal.
pub const COLUMNS: [Column; 6] = [
    Column::number("t", "l/v_0", "time since the start; equal in two rows where the velocity jumps"),
    Column::number("v", "v_0", "velocity"),
    Column::number("theta", "l/v_0", "state variable"),
    Column::number("tau", "mu_0 sigma", "friction: 1 + a ln v + b ln theta, or regularised"),
    Column::number("v_c", "v_0", "control velocity of the load point"),
    Column::number(
        "beta",
        "mu_0 sigma v_0",
        "minus the costate of theta: tau + a + beta theta = 0 above the floor, with a tanh(tau/a) for a if friction is regularised; null before and after the protocol",
    ),
];

/// Relative difference of velocities up to which they do not count as a jump. Chosen: above the rounding of every motion.
const JUMP_RTOL: f64 = 1e-9;

/// The times of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Times {
    /// The fewest times at which straight lines have errors below [`RANGE_RTOL`] of the range of every column, and below a relative
    /// [`VALUE_RTOL`] of velocity and theta.
    Fewest,
    /// A number of equally spaced times from 0 to `t_f`, at least 2.
    Spaced(usize),
}

/// The moments of a protocol, with the steady states before and after it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// The moments in the order of time, from 0 to `t_f`; at a jump of the velocity, two have the same time.
    pub moments: Vec<Moment>,
    /// Least velocity on the open interval `(0, t_f)`.
    pub v_min: f64,
    /// Greatest velocity there.
    pub v_max: f64,
}

impl Trace {
    /// Traces `motion`, a protocol of `transition`; `None` if a moment is NaN, or if the motion has more detail than can be resolved.
    pub fn of(motion: &dyn Motion, transition: &Transition, times: Times) -> Option<Trace> {
        let [before, after] = around(motion, transition);
        let samples = sample::Samples::of(motion, &[before, after])?;
        let (v_min, v_max) = samples.velocities(motion);
        let mut moments = match times {
            Times::Fewest => samples.fewest(),
            Times::Spaced(count) => sample::spaced(motion, count)?,
        };
        let apart = |here: f64, steady: f64| (here - steady).abs() > JUMP_RTOL * steady;
        let jumps = |here: &Moment, steady: &Moment| {
            apart(here.v, steady.v) || here.v_c.is_some_and(|v_c| apart(v_c, steady.v))
        };
        if motion.departs() && moments.first().is_some_and(|first| jumps(first, &before)) {
            moments.insert(0, before);
        }
        if motion.arrives() && moments.last().is_some_and(|last| jumps(last, &after)) {
            moments.push(after);
        }
        Some(Trace { moments, v_min, v_max })
    }

    /// The moments without those of steady sliding before a jump at the start and after one at the end.
    pub fn within_jumps(&self) -> &[Moment] {
        let is_jump = |pair: Option<&[Moment]>| pair.is_some_and(|pair| pair[0].t == pair[1].t);
        let mut pairs = self.moments.windows(2);
        let (first, last) = (is_jump(pairs.next()), is_jump(pairs.next_back()));
        &self.moments[usize::from(first)..self.moments.len() - usize::from(last)]
    }

    /// This trace, and `rest` after it.
    pub fn then(mut self, rest: Trace) -> Trace {
        let start = self.moments.last().map_or(0.0, |last| last.t);
        self.moments.extend(rest.moments.into_iter().map(|moment| Moment { t: start + moment.t, ..moment }));
        Trace { v_min: self.v_min.min(rest.v_min), v_max: self.v_max.max(rest.v_max), ..self }
    }

    /// This trace, converted from the units of the model to `units`.
    pub fn in_units(mut self, units: &Units) -> Trace {
        let size = |column: usize| units.size(unit(column));
        for moment in &mut self.moments {
            *moment = Moment {
                t: moment.t * size(0),
                v: moment.v * size(1),
                theta: moment.theta * size(2),
                friction: moment.friction * size(3),
                v_c: moment.v_c.map(|v_c| v_c * size(4)),
                beta: moment.beta.map(|beta| beta * size(5)),
            };
        }
        (self.v_min, self.v_max) = (self.v_min * size(1), self.v_max * size(1));
        self
    }

    /// The columns of the trace, as indices of [`COLUMNS`].
    pub fn columns(&self) -> Vec<usize> {
        let is_there = |&column: &usize| self.moments.iter().any(|moment| Trace::value(moment, column).is_some());
        (0..COLUMNS.len()).filter(is_there).collect()
    }

    /// The value of a column, given by its index in [`COLUMNS`], at a moment; `None` if it does not exist.
    pub fn value(moment: &Moment, column: usize) -> Option<f64> {
        let Moment { t, v, theta, friction, v_c, beta } = *moment;
        [Some(t), Some(v), Some(theta), Some(friction), v_c, beta][column]
    }
}

/// The scaled unit of a column, given by its index in [`COLUMNS`].
pub fn unit(column: usize) -> &'static str {
    COLUMNS[column].unit(&Grid::default())
}

/// The steady states before the start and after the end: theta is continuous, the velocity may jump.
fn around(motion: &dyn Motion, transition: &Transition) -> [Moment; 2] {
    let (first, last) = (motion.at(0.0), motion.at(1.0));
    let steady = |t: f64, v: f64, theta: f64| Moment {
        t,
        v,
        theta,
        friction: motion.friction().at(&transition.law, ln(v), ln(theta)),
        v_c: first.v_c.map(|_| v),
        beta: None,
    };
    [steady(0.0, transition.v_i, first.theta), steady(motion.duration(), transition.v_f, last.theta)]
}
