//! Sweeps, datasets and the commands as a user meets them.

mod analysis;
mod bad_specs;
mod batches;
mod commands;
mod common;
mod discontinuous;
mod docs;
mod engine;
#[path = "../extent/mod.rs"]
mod extent;
mod faults;
mod finite_stiffness;
mod grid;
mod identity;
mod init;
mod labels;
mod names;
mod output;
mod plot;
mod properties;
mod reduced;
#[path = "../reference/mod.rs"]
mod reference;
mod report;
mod schema;
mod shards;
mod statistics;
#[path = "../support/mod.rs"]
mod support;
mod trace_command;
mod verify;
