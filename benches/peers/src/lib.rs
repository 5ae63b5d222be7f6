//! The solvers of slipsweep, from its own sources: without what writes tables they build in seconds.

#[path = "../../../src/model/mod.rs"]
pub mod model;
#[path = "../../../src/numerics/mod.rs"]
pub mod numerics;
#[path = "../../../src/protocol/mod.rs"]
pub mod protocol;
#[path = "../../../src/stability/mod.rs"]
pub mod stability;
