//! The command line of `slipsweep`; everything it does is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    slipsweep::cli::main()
}
