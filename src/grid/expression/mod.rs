//! Expressions of axes: parsed and checked once, then evaluated over many points with equal results on every machine.

mod parse;
mod program;

pub use parse::Fault;
pub use program::{Expression, Scratch};
