//! Protocols that bring a block from one steady velocity to another: the optimal one and its shortcuts.

pub mod best;
pub mod cubic;
mod motion;
pub mod optimal;
mod outcome;
pub mod swift;

pub use motion::{Moment, Motion};
pub use outcome::{Effort, Solved, Status};
