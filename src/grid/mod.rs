//! What a sweep varies: quantities, the axes they run over, and the product of axes whose rows a number decodes.

mod axis;
mod product;
mod quantity;

pub use axis::{Axis, Values};
pub use product::{Factor, Grid, Projection, Runs, Tuples};
pub use quantity::{Domain, Point, Quantity, RTOL, Scale};
