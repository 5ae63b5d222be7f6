//! Exact parameter sweeps over the control of rate-and-state friction.
pub mod model;
pub mod numerics;
pub mod protocol;
