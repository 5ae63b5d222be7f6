//! Expressions of axes: read once, checked, and evaluated over many points at a time with the same result on every machine.

mod parse;
mod program;

pub use parse::Fault;
pub use program::{Columns, Expression, Stack};
