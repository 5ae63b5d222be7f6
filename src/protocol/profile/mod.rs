//! Velocities in closed form, `v = floor + (v_1 - floor) e^f` with a known exponent `f`, and theta along them.
//!
//! The exponent has one free parameter, in which theta at the end is monotone. The exponent alone determines the panels
//! (`curve`). Backward integrals give the parameter that brings theta to its target (`arrival`). A forward integration
//! gives theta, work and extremes (`theta`).

mod arrival;
mod control_range;
mod curve;
mod hermite;
mod motion;
mod theta;

use crate::numerics::elementary::{exp, ln};
use crate::numerics::radau::NODES;

pub(super) use arrival::ArrivalProblem;
pub(super) use curve::{ProtocolEnd, VelocityCurve};
pub(super) use hermite::Hermite;
pub(super) use motion::ResolvedProfile;
pub(super) use theta::{InitialState, ResolvedPanel, WorkAndFriction, integrate_theta};

/// Exponent `f = ln((v - floor)/(v_1 - floor))` of a velocity, 0 at the end, over `x = t/t_f`, with `z = 1 - x`.
pub(super) trait Exponent: Copy + Sync {
    /// Variation over a panel with theta at its nodes, fraction of that of a quadrature. Chosen: interpolation takes more nodes.
    const INTERPOLATION: f64;

    /// Exponent with the parameter `c`; the larger `c`, the lower the velocity inside.
    fn with(self, c: f64) -> Self;

    /// Value `f`.
    fn value(&self, x: f64, z: f64) -> f64;

    /// Slope `df/dx`.
    fn slope(&self, x: f64, z: f64) -> f64;

    /// Sensitivity to the parameter, `-df/dc >= 0`.
    fn sensitivity(x: f64, z: f64) -> f64;

    /// Distance in `x` over which `f` varies by `variation` at most, in either direction.
    fn distance_of_variation(&self, x: f64, z: f64, variation: f64) -> f64;

    /// Sum of the absolute coefficients.
    fn size(&self) -> f64;

    /// Scale of the parameter: the unit of its tolerance.
    fn parameter_scale(&self) -> f64;

    /// Relative Newton step in a large `c` that makes a quantity `ratio` times as large, times minus its logarithmic slope.
    /// The quantity is proportional to the width of the layers at both ends.
    fn newton_step(ratio: f64) -> f64;
}

/// Variation of an exponent over a panel whose interpolation at the nodes has the relative accuracy `rtol`. An
/// exponential of total variation `r` is interpolated to `2 (r/4)^n/n!`.
fn panel_variation(rtol: f64) -> f64 {
    let factorial: f64 = (1..=NODES).map(|k| k as f64).product();
    (4.0 * exp(ln(0.01 * rtol * factorial) / NODES as f64)).clamp(2.0, 6.0)
}
