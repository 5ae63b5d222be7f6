//! The physics in scaled units: the friction law and the change of velocity that is asked of it; and what the units are.

mod friction;
mod units;

pub use friction::{Law, Transition};
pub use units::{Scales, Units, is_known};
