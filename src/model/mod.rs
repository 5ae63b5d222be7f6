//! The physics in scaled units: the friction law and the change of velocity that is asked of it.

mod friction;

pub use friction::{Law, Transition};
