//! `slipsweep query` of a build without SQL, that of the Python package: names the replacements.

use super::{Failure, refused};

/// Arguments of `query`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// All of them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    rest: Vec<String>,
}

/// Refuses a question.
pub fn query(arguments: &Arguments) -> Result<(), Failure> {
    let dataset = arguments.rest.first().map_or("results/NAME", String::as_str);
    let help = format!(
        "in Python: slipsweep.open({dataset:?})[\"TABLE\"].scan() is a polars LazyFrame; or read the files with DuckDB"
    );
    Err(refused("`query` is not in the Python package", "the program that `cargo install slipsweep` builds", help))
}
