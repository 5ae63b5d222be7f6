//! A sweep: spec (as written) -> check (against what is legal; block and axis make the grid) -> plan (what there is to do) -> engine (doing it).

mod axis;
mod batches;
mod block;
mod check;
mod engine;
mod error;
mod estimate;
mod identity;
mod plan;
mod points;
mod read;
mod schema;
mod shard;
mod spec;
mod units;

pub use batches::Batches;
#[cfg(feature = "cli")]
pub(crate) use check::check_name;
pub use check::{Request, Sweep};
pub use engine::{Defect, Outcome, RunError, TableOutcome, compute, pool, run, run_shard};
pub use error::SpecError;
pub use estimate::{Estimate, Estimates, estimate, sizes};
pub use plan::Plan;
pub use schema::schema;
#[cfg(feature = "cli")]
pub(crate) use shard::holds;
pub use shard::{Shard, TooManyParts, check_parts, shares_with};
pub use spec::{AccuracySpec, AxisForm, AxisSpec, AxisValue, BlockSpec, ModelSpec, Spec, TableSpec};
pub use units::{units, units_of};
