//! Protocols that bring a block from one steady velocity to another: the optimal one and its shortcuts.

pub mod best;
pub mod cubic;
pub mod optimal;
mod outcome;

pub use outcome::{Effort, Solved, Status};
