//! A sweep: spec (keys and types), check (legal values, grid), plan (rows and solves), engine (computation and publication).

mod axis;
mod batches;
mod block;
mod check;
mod direct;
mod engine;
mod error;
mod estimate;
mod identity;
mod laws;
mod plan;
mod points;
mod read;
mod schema;
mod shard;
mod spec;
mod units;

pub use axis::word;
pub use batches::Batches;
#[cfg(feature = "cli")]
pub(crate) use check::check_name;
#[cfg(any(feature = "cli", feature = "query"))]
pub(crate) use check::path_hint;
pub use check::{Request, Sweep};
#[cfg(feature = "query")]
pub(crate) use direct::available_bytes;
pub use direct::{Direct, Given, RowsError};
pub use engine::{Outcome, RunError, TableOutcome, compute, pool, run, run_shard};
pub use error::SpecError;
pub use estimate::{Estimate, Estimates, estimate};
pub use laws::friction;
pub use plan::Plan;
pub use schema::schema;
#[cfg(feature = "cli")]
pub(crate) use shard::contains_part;
pub use shard::{Shard, TooManyParts, check_parts, shards_with};
pub use spec::{AccuracySpec, AxisForm, AxisSpec, AxisValue, BlockSpec, ModelSpec, Spec, TableSpec};
pub use units::{units, units_of};
