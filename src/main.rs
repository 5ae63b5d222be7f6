//! The command line of `slipsweep`. The library contains everything else.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

/// Each part allocates and frees some megabytes. The allocator of the system returns them to the kernel each time, and page faults then cost a
/// fifth of a run.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Whether standard output was closed when the process began. Before `main`, the standard library opens `/dev/null` in its place, which would
/// swallow an answer without an error. So this flag is set before.
static STDOUT_IS_CLOSED: AtomicBool = AtomicBool::new(false);

#[cfg(any(target_os = "linux", target_os = "macos"))]
#[allow(unsafe_code)]
mod early {
    use super::{Ordering, STDOUT_IS_CLOSED};

    /// Called by the loader before the start of the standard library.
    #[used]
    #[cfg_attr(target_os = "linux", unsafe(link_section = ".init_array"))]
    #[cfg_attr(target_os = "macos", unsafe(link_section = "__DATA,__mod_init_func"))]
    static LOOK: extern "C" fn() = look;

    extern "C" fn look() {
        // Reads the flags of the descriptor, which changes nothing.
        let is_closed = unsafe { libc::fcntl(libc::STDOUT_FILENO, libc::F_GETFD) } == -1;
        STDOUT_IS_CLOSED.store(is_closed, Ordering::Relaxed);
    }
}

fn main() -> ExitCode {
    slipsweep::cli::main(STDOUT_IS_CLOSED.load(Ordering::Relaxed))
}
