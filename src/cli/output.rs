//! Destination and format of an answer: standard output or a file, in the requested format or that of the file's ending.

use std::io::{self, IsTerminal};
use std::path::PathBuf;

use clap::ValueEnum;

use super::{Failure, is_stdout, wrong};

/// A format of answers.
pub trait Format: ValueEnum + Copy + PartialEq + Send + Sync + 'static {
    /// The formats with the endings of their files, those of a format together, the usual one first.
    const ENDINGS: &'static [(&'static str, Self)];
    /// Text for a terminal.
    const TABLE: Self;
    /// A binary format, which is not printed on a terminal.
    const PARQUET: Self;
}

/// Arguments for destination and format.
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
    /// Whether the answer goes to standard output.
    pub fn is_stdout(&self) -> bool {
        is_stdout(&self.out)
    }

    /// The format that the arguments select.
    ///
    /// # Errors
    ///
    /// A file extension that determines no format, or Parquet on a terminal.
    pub fn format(&self) -> Result<F, Failure> {
        let ending = self.out.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let known = ending.and_then(|ending| F::ENDINGS.iter().find(|(known, _)| *known == ending));
        if let (Some(format), Some((ending, of_ending))) = (self.format, known)
            && (format == F::PARQUET) != (*of_ending == F::PARQUET)
        {
            return Err(wrong(format!(
                "--out {}: the ending .{ending} contradicts --format\n  help: leave out --format, or change the ending",
                self.out.display()
            )));
        }
        let format = match (self.format, known) {
            (Some(format), _) | (None, Some(&(_, format))) => format,
            (None, None) if self.is_stdout() => F::TABLE,
            (None, None) => {
                let name = self.out.display();
                let mut usual = F::ENDINGS.to_vec();
                usual.dedup_by_key(|(_, format)| *format);
                let usual: Vec<String> = usual.iter().map(|(ending, _)| format!(".{ending}")).collect();
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
