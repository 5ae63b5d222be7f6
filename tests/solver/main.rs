//! The mathematics without tables or files: every solver against references, invariants and limits. One binary of all
//! tests of a kind, since linking one for each file took most of the time and of the disk.

mod arcsinh;
mod best_cubic;
mod best_cubic_laws;
mod budgets;
mod ceilings;
mod compliant;
mod error;
#[path = "../extent/mod.rs"]
mod extent;
mod friction;
mod hopf;
mod judge;
mod landscape;
mod landscape_laws;
mod landscape_reference;
mod numerics;
mod optimal;
mod paper;
mod properties;
#[path = "../reference/mod.rs"]
mod reference;
mod regularised;
mod relaxed;
mod shortcut_edges;
mod shortcut_friction;
mod shortcut_velocity;
mod stability;
mod step_response;
mod stiff;
mod stress;
#[path = "../support/mod.rs"]
mod support;
mod trace;
