//! Velocities in closed form, `v = floor + (v_1 - floor) e^f` with a known exponent `f`, and what contacts make of
//! them.
//!
//! The exponent has one free parameter, in which theta at the end is monotone. Since the exponent is known before
//! anything is computed, so are the panels that resolve it: a `curve` is laid out in them, the parameter that
//! brings theta where it should be follows from integrals taken backwards (`arrival`), and theta, work and extremes
//! from a passage forwards (`passage`).

mod arrival;
mod control;
mod curve;
mod hermite;
mod motion;
mod passage;

use crate::numerics::elementary::{exp, ln};
use crate::numerics::radau::NODES;

pub(super) use arrival::Problem;
pub(super) use curve::{Curve, Panel, Side, Stretches};
pub(super) use hermite::Hermite;
pub(super) use motion::Resolution;
pub(super) use passage::{Passage, Resolved, Start, pass};

/// The exponent `f = ln((v - floor)/(v_1 - floor))` of a velocity, 0 at the end, over `x = t/t_f`, with `z = 1 - x`.
pub(super) trait Exponent: Copy + Sync {
    /// The same with another parameter `c`; the larger it is, the lower the velocity inside.
    fn with(self, c: f64) -> Self;

    /// Its value.
    fn value(&self, x: f64, z: f64) -> f64;

    /// Its slope in `x`.
    fn slope(&self, x: f64, z: f64) -> f64;

    /// `-df/dc`, not negative.
    fn lean(x: f64, z: f64) -> f64;

    /// A distance over which it varies by `variation` at the most, in either direction.
    fn stride(&self, x: f64, z: f64, variation: f64) -> f64;

    /// The size of its coefficients.
    fn size(&self) -> f64;

    /// A change of the parameter that counts.
    fn unit(&self) -> f64;

    /// The relative step of Newton's method for a large `c` at which something that goes like the width of the layers
    /// at both ends is to become `ratio` times as large, times minus its logarithmic slope.
    fn settle(ratio: f64) -> f64;

    /// Whether it falls first and then rises, with nothing in between that counts where both sides are low.
    fn dips(&self) -> bool;

    /// The stretches of a curve with this exponent whose velocity is `v_1 = floor + e^level`; where it is below `depth`
    /// nothing counts.
    fn stretches(&self, level: f64, depth: f64) -> Stretches;
}

/// Variation of an exponent over a panel whose interpolation at the nodes is good to `rtol`: an exponential of total
/// variation `r` is interpolated to `2 (r/4)^n/n!`.
pub(super) fn reach(rtol: f64) -> f64 {
    let factorial: f64 = (1..=NODES).map(|k| k as f64).product();
    (4.0 * exp(ln(0.01 * rtol * factorial) / NODES as f64)).clamp(2.0, 6.0)
}
