//! The kernels of slipsweep, from its own sources.

#[path = "../../../src/model/mod.rs"]
pub mod model;
#[path = "../../../src/numerics/mod.rs"]
pub mod numerics;
#[path = "../../../src/protocol/mod.rs"]
pub mod protocol;
