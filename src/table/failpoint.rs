//! A failpoint for tests: a row that panics on request.

use std::sync::OnceLock;

/// Panics if the environment variable `SLIPSWEEP_PANIC` is the number of one of `rows`.
pub fn panic_at(mut rows: impl Iterator<Item = u64>) {
    static ROW: OnceLock<Option<u64>> = OnceLock::new();
    let wanted = ROW.get_or_init(|| std::env::var("SLIPSWEEP_PANIC").ok()?.parse().ok());
    if let Some(wanted) = wanted {
        assert!(!rows.any(|row| row == *wanted), "requested by SLIPSWEEP_PANIC");
    }
}
