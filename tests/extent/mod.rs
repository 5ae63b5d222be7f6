//! How much the tests try: what a person waits for, or everything with `SLIPSWEEP_TESTS=long`, as `tests/nightly/run` does.

use std::env::{self, VarError};

/// `quick`, or `long` with `SLIPSWEEP_TESTS=long`.
pub fn quick_or_long<T>(quick: T, long: T) -> T {
    match env::var("SLIPSWEEP_TESTS").as_deref() {
        Ok("long") => long,
        Ok("quick") | Err(VarError::NotPresent) => quick,
        found => panic!("SLIPSWEEP_TESTS: expected `quick` or `long`, found {found:?}"),
    }
}
