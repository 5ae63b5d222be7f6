//! Exact parameter sweeps over the control of rate-and-state friction.
//!
//! The rooms of the crate, each of which imports only from those before it:
//!
//! - [`model`]: the friction law, the change of velocity required of it, and units;
//! - [`numerics`]: tools that know no friction;
//! - [`protocol`]: the optimal protocol, its crossover times, and the cubic shortcuts;
//! - [`stability`]: steady sliding of a block on a spring;
//! - [`grid`]: quantities, axes, expressions, and the rows of a grid of blocks;
//! - [`table`]: what a row means;
//! - [`dataset`]: tables as Parquet parts on disk, and reading them back;
//! - [`query`]: questions to tables on disk, in SQL;
//! - [`trace`]: one protocol over time;
//! - [`plot`]: pictures of traces and tables;
//! - [`sweep`]: a spec, checked, planned and run;
//! - [`verify`]: a sample of a dataset, solved again by an independent method;
//! - [`cli`]: the commands.
//!
#![doc = include_str!("../docs/library.md")]

#[cfg(feature = "cli")]
pub mod cli;
pub mod dataset;
mod file;
pub mod grid;
pub mod model;
mod names;
pub mod numerics;
#[cfg(feature = "plot")]
pub mod plot;
pub mod protocol;
#[cfg(feature = "query")]
pub mod query;
pub mod stability;
pub mod sweep;
pub mod table;
pub mod trace;
#[cfg(feature = "read")]
pub mod verify;
