//! `slipsweep man [COMMAND]`: the manual page of the program, or of one command.

use clap::CommandFactory;
use clap_mangen::Man;

use super::{Failure, put, refused};
use crate::names::hint;

/// Arguments of `man`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep man | man -l -
  slipsweep man run > ~/.local/share/man/man1/slipsweep-run.1")]
pub struct Arguments {
    /// Command; the program itself by default
    command: Option<String>,
}

/// Prints a manual page.
///
/// # Errors
///
/// An unknown command.
pub fn man(arguments: &Arguments) -> Result<(), Failure> {
    let mut program = super::Arguments::command();
    program.build();
    let command = match &arguments.command {
        None => program,
        Some(name) => match program.find_subcommand(name) {
            Some(command) => command.clone(),
            None => {
                let names: Vec<&str> = program.get_subcommands().map(clap::Command::get_name).collect();
                let help = hint(name, names.iter().copied());
                return Err(refused(format!("no command `{name}`"), names.join(", "), help));
            }
        },
    };
    let mut page = Vec::new();
    Man::new(command).render(&mut page).map_err(Failure::failed)?;
    // The text after the options of a command contains its examples.
    put(String::from_utf8_lossy(&page).replace(".SH EXTRA", ".SH EXAMPLES").as_bytes())
}
