//! The physics in scaled units: the friction law, the transition between steady states, and the units.

mod friction;
mod units;

pub use friction::{Law, Transition};
pub use units::{Scales, Units, is_known};
