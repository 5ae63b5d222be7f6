//! The physics in scaled units: the friction law, the transition between steady states, and the units.

pub mod arcsinh;
mod friction;
mod friction_margin;
mod state_law;
mod units;

pub use arcsinh::Friction;
pub use friction::{Law, Transition};
pub(crate) use friction_margin::friction_margin;
pub use state_law::StateLaw;
pub use units::{Scales, Units, is_known};
