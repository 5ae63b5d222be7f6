//! Exact parameter sweeps over the control of rate-and-state friction.
//!
//! ```text
//! spec.toml ── sweep::Sweep ── sweep::Plan ── sweep::run ───────────────────────────────┐
//!              keys, values    rows, solves   one part at a time, on all threads:       │
//!              grid: rows by                  table  rows -> columns ── protocol,       │
//!              number                                 stability, numerics, model        │
//!                                             dataset columns -> Parquet part, manifest │
//!                                                                                       │
//! results/NAME/TABLE/part-000000.parquet  <─────────────────────────────────────────────┘
//!   ├─ query   SQL            ├─ plot    SVG, PNG, PDF, HTML
//!   ├─ verify  second solve   └─ trace   one row over time
//! ```
//!
//! The modules, in the order in which a row meets them. Each imports only from those above it in `CONTRIBUTING.md`.
//!
//! - [`cli`]: the commands: arguments in, one call of the library, text out;
//! - [`sweep`]: spec, check, plan, engine, shards;
//! - [`grid`]: quantities, axes, expressions, and the index of the rows of a table;
//! - [`table`]: the tables: axes, columns and computation, one file each;
//! - [`protocol`]: optimal protocols, crossover times and shortcuts;
//! - [`stability`]: linear stability and step responses of a block on a spring;
//! - [`numerics`]: quadrature, roots and the stiff integrator, without friction;
//! - [`model`]: the friction law, transitions and units;
//! - [`dataset`]: Parquet parts, manifest and their readers;
//! - [`query`]: SQL over the tables of a dataset;
//! - [`plot`]: pictures of tables and traces;
//! - [`trace`]: one protocol over time;
//! - [`verify`]: an independent solution of sampled rows.
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
