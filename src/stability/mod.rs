//! Finite stiffness: whether steady sliding of a block on a spring is stable.

mod driven;
mod hopf;
mod linear;
mod sensitivity;
pub mod step_response;

pub use driven::{held_error, open_loop_error};
pub use hopf::{Hopf, lyapunov_coefficient};
pub use linear::{Eigenvalues, SteadySliding, critical_velocity};
pub use sensitivity::amplification;

/// What following a protocol open loop yields.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenLoopResult {
    /// The number asked for; `None` where there is none.
    pub number: Option<f64>,
    /// Steps of the integration.
    pub steps: u32,
}
