//! A block on a spring of finite stiffness: stability of steady sliding, response to a velocity step, open-loop errors.

pub mod arcsinh;
mod driven;
mod hopf;
mod linear;
mod sensitivity;
pub mod step_response;

pub use driven::{held_error, open_loop_error};
pub use hopf::{Hopf, interpolated_lyapunov_coefficient, lyapunov_coefficient};
pub use linear::{Eigenvalues, SteadySliding, critical_velocity};
pub use sensitivity::amplification;

/// Tolerance of the first of two runs that confirm a number over that of the second. Chosen: their difference is the error of the first to a
/// digit, and rounding differs with their steps.
const CONFIRMATION_RATIO: f64 = 10.0;

/// Result of following a protocol open loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenLoopResult {
    /// The requested number; `None` where there is none.
    pub number: Option<f64>,
    /// Number of steps of the integration.
    pub steps: u32,
}
