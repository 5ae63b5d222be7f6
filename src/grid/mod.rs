//! The grid: quantities, axes, blocks, and the index of the rows of a table.

mod axis;
mod block;
mod design;
mod expression;
mod quantity;
mod row_filter;
mod row_index;
mod sampler;
mod view;

pub use axis::{Axis, Values};
pub use block::{Block, Derived, Digit, Digits, Factor, Label};
pub(crate) use block::{SPLIT_MIX_INCREMENT, mixed};
pub use design::Design;
pub use expression::{Expression, Fault};
pub use quantity::{Domain, Point, Quantity, RTOL, Scale};
pub use row_filter::first_wrong;
pub use row_index::{BlockRows, Grid, RowIndex, TooMany, Tuples};
pub use view::{Runs, Segment, View};
