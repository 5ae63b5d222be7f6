//! The commands: arguments in, a call of the library, words out.

mod plan;
mod run;
mod tables;
mod trace;
mod verify;
mod watch;
mod words;

use std::fmt::Display;
use std::io::{self, Write};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::sweep::SpecError;

/// The spec or the arguments are wrong.
const WRONG: u8 = 1;
/// The run failed.
const FAILED: u8 = 2;
/// `--strict`, and some row is `not_converged`.
const NOT_STRICT: u8 = 3;

/// Exact parameter sweeps over the control of rate-and-state friction.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compute the tables of a spec; a run that was stopped goes on where it was
    Run(run::Arguments),
    /// Say what a spec would compute, and estimate time and size
    Plan(plan::Arguments),
    /// Show one protocol over time: v, theta, friction
    Trace(trace::Arguments),
    /// Solve a sample of the rows of a dataset again by an independent method, and compare
    Verify(verify::Arguments),
    /// List all tables, their columns and units
    Tables,
}

/// A command that did not do its work: what to say, and the exit code.
struct Failure {
    code: u8,
    message: String,
}

impl Failure {
    fn failed(error: impl Display) -> Failure {
        Failure { code: FAILED, message: format!("error: {error}") }
    }
}

impl From<SpecError> for Failure {
    fn from(error: SpecError) -> Failure {
        Failure { code: WRONG, message: format!("error: {error}") }
    }
}

/// Reads the arguments of the process and does what they say.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Nothing can be done if the terminal is gone.
            let _ = error.print();
            return if error.use_stderr() { WRONG.into() } else { ExitCode::SUCCESS };
        }
    };
    let done = match arguments.command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Plan(arguments) => plan::plan(&arguments),
        Command::Trace(arguments) => trace::trace(&arguments),
        Command::Verify(arguments) => verify::verify(&arguments),
        Command::Tables => tables::tables(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            let _ = writeln!(io::stderr(), "{}", failure.message);
            failure.code.into()
        }
    }
}

/// Writes `text` to standard output; that a reader has had enough is no failure.
fn say(text: &str) -> Result<(), Failure> {
    put(text.as_bytes())
}

/// The same for bytes.
fn put(bytes: &[u8]) -> Result<(), Failure> {
    let mut stdout = io::stdout();
    match stdout.write_all(bytes).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::failed(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}
