//! Protocols that bring a block from one steady velocity to another: the optimal one and its shortcuts.

pub mod arcsinh;
pub mod best_cubic;
pub mod compliant;
mod control;
pub mod cubic;
pub mod error;
mod motion;
pub mod optimal;
mod outcome;
mod profile;
pub mod regularised;
pub mod relaxed;
pub mod shortcut;
pub mod smoothness;

pub use control::{Jet, SpringBlock};
pub use motion::{Moment, Motion};
pub(crate) use motion::{equal_landmarks, interval_at};
pub use outcome::{Solved, SolverStats, Status};
