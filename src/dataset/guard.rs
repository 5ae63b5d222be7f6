//! Parquet whose bytes may be damaged: what its reader did not think of is a fault of the file like any other.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic of this thread is one that becomes a fault of a file, so that it is not reported.
#[cfg(feature = "cli")]
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// The result of `read`; `None` if it panics.
pub fn guarded<T>(read: impl FnOnce() -> T) -> Option<T> {
    GUARDED.set(true);
    // What a panic leaves half done is gone with it.
    let done = catch_unwind(AssertUnwindSafe(read));
    GUARDED.set(false);
    done.ok()
}
