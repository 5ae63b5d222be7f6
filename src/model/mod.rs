//! The physics in scaled units: the friction law, the transition between steady states, and the units.

pub mod arcsinh;
mod friction;
mod state_law;
mod units;

pub use arcsinh::Friction;
pub use friction::{Law, Transition};
pub use state_law::StateLaw;
pub use units::{Scales, Units, is_known};
