//! Reading of possibly damaged Parquet files: a panic of the reader is reported as damage of the file.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic of this thread is converted to an error of a file, and therefore not printed.
#[cfg(feature = "cli")]
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// The result of `read`; `None` if it panics.
pub fn guarded<T>(read: impl FnOnce() -> T) -> Option<T> {
    GUARDED.set(true);
    // The state left by a panic is dropped.
    let done = catch_unwind(AssertUnwindSafe(read));
    GUARDED.set(false);
    done.ok()
}
