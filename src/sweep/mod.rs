//! A sweep: spec (as written) -> check (against what is legal) -> plan (what there is to do) -> engine (doing it).

mod check;
mod engine;
mod error;
mod estimate;
mod place;
mod plan;
mod points;
mod spec;

pub use check::{Request, Sweep};
pub use engine::{Outcome, RunError, TableOutcome, compute, pool, run};
pub use error::SpecError;
pub use estimate::{Estimate, estimate};
pub use plan::Plan;
pub use spec::{AccuracySpec, AxisForm, AxisSpec, AxisValue, ModelSpec, Spec, TableSpec};
