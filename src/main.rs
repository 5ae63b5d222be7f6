//! The command line of `slipsweep`; everything it does is in the library.

use std::process::ExitCode;

/// Parts take and give back some megabytes each. The system's allocator returns them to the kernel every time, which then costs a
/// fifth of a run in page faults.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    slipsweep::cli::main()
}
