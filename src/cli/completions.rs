//! `slipsweep completions SHELL`: the completion script of a shell.

use clap::CommandFactory;
use clap_complete::Shell;

use super::{Failure, put};

/// Arguments of `completions`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep completions bash > ~/.local/share/bash-completion/completions/slipsweep
  slipsweep completions zsh > ~/.zfunc/_slipsweep
  slipsweep completions fish > ~/.config/fish/completions/slipsweep.fish")]
pub struct Arguments {
    /// Shell
    shell: Shell,
}

/// Prints the completions of a shell.
pub fn completions(arguments: &Arguments) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut super::Arguments::command(), "slipsweep", &mut text);
    put(&text)
}
