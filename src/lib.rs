//! Exact parameter sweeps over the control of rate-and-state friction.
//!
//! The rooms of the crate, each of which imports only from those before it:
//!
//! - [`model`]: the friction law and the change of velocity asked of it;
//! - [`numerics`]: tools that know no friction;
//! - [`protocol`]: the optimal protocol, its crossover times, and the cubic shortcuts;
//! - [`stability`]: steady sliding of a block on a spring;
//! - [`grid`]: quantities, axes and the product of axes;
//! - [`table`]: what a row means;
//! - [`dataset`]: tables as Parquet parts on disk, and reading them back;
//! - [`trace`]: one protocol over time;
//! - [`sweep`]: a spec, checked, planned and run;
//! - [`verify`]: a sample of a dataset, solved again by an independent method;
//! - [`cli`]: the commands.

pub mod cli;
pub mod dataset;
pub mod grid;
pub mod model;
pub mod numerics;
pub mod protocol;
pub mod stability;
pub mod sweep;
pub mod table;
pub mod trace;
pub mod verify;
