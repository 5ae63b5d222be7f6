//! `slipsweep schema`: the JSON Schema of a spec, with which editors complete and check it.

use super::{Failure, say};
use crate::sweep::schema;

/// Prints the schema.
pub fn print() -> Result<(), Failure> {
    say(&text())
}

/// The schema as a file.
pub fn text() -> String {
    format!("{:#}\n", schema())
}
