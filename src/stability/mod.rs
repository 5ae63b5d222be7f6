//! Finite stiffness: whether steady sliding of a block on a spring is stable.

mod linear;
mod sensitivity;

pub use linear::{Eigenvalues, SteadySliding, critical_velocity};
pub use sensitivity::amplification;
