//! Finite stiffness: whether steady sliding of a block on a spring is stable.

mod linear;

pub use linear::{Eigenvalues, SteadySliding, critical_velocity};
