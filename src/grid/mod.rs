//! What a sweep varies: quantities, the axes they run over, and the grid, whose rows a number decodes.

mod axis;
mod block;
mod design;
mod expression;
mod projection;
mod quantity;
mod sampler;
mod sieve;
mod view;

pub use axis::{Axis, Values};
pub use block::{Block, Derived, Digit, Digits, Factor, Label};
pub use design::Design;
pub use expression::{Expression, Fault};
pub use projection::{Grid, Projection, Stretch, TooMany, Tuples};
pub use quantity::{Domain, Point, Quantity, RTOL, Scale};
pub use sieve::first_wrong;
pub use view::{Runs, Segment, View};
