//! Where an answer goes, standard output or a file, and in which format: the one requested, or what the name of the file ends in.

use std::io::{self, IsTerminal};
use std::path::PathBuf;

use clap::ValueEnum;

use super::{Failure, wrong};

/// A way to write an answer.
pub trait Format: ValueEnum + Copy + PartialEq + Send + Sync + 'static {
    /// The formats by the endings of files; of two for one format, the first is the usual one.
    const ENDINGS: &'static [(&'static str, Self)];
    /// Words for a terminal.
    const TABLE: Self;
    /// Bytes that are not for a terminal.
    const PARQUET: Self;
}

/// The arguments that say where and how.
#[derive(Debug, clap::Args)]
pub struct Output<F: Format> {
    /// Output format [default: by the ending of the file, else table]
    #[arg(long)]
    format: Option<F>,
    /// Output file; - is standard output
    #[arg(short, long, value_name = "FILE", default_value = "-", hide_default_value = true)]
    pub out: PathBuf,
}

impl<F: Format> Output<F> {
    /// Whether it goes to standard output.
    pub fn is_stdout(&self) -> bool {
        self.out.as_os_str() == "-"
    }

    /// The format that the arguments come to.
    pub fn format(&self) -> Result<F, Failure> {
        let ending = self.out.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let known = ending.and_then(|ending| F::ENDINGS.iter().find(|(known, _)| *known == ending));
        let format = match (self.format, known) {
            (Some(format), _) | (None, Some(&(_, format))) => format,
            (None, None) if self.is_stdout() => F::TABLE,
            (None, None) => {
                let name = self.out.display();
                let usual = F::ENDINGS
                    .iter()
                    .enumerate()
                    .filter(|(place, (_, format))| F::ENDINGS[..*place].iter().all(|(_, other)| other != format));
                let usual: Vec<String> = usual.map(|(_, (ending, _))| format!(".{ending}")).collect();
                return Err(wrong(format!(
                    "--out {name}: the ending is none of {}\n  help: add --format",
                    usual.join(", ")
                )));
            }
        };
        if format == F::PARQUET && self.is_stdout() && io::stdout().is_terminal() {
            return Err(wrong(
                "Parquet is not written to a terminal\n  help: name a file with --out, or pipe the output",
            ));
        }
        Ok(format)
    }
}
