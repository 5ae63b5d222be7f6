//! Destination and format of an answer: standard output or a file, in the requested format or that of the file's ending.

use std::io::{self, IsTerminal};
use std::path::PathBuf;

use clap::ValueEnum;

use super::{Failure, is_stdout, wrong};
use crate::file;

/// The endings of files and the names of their formats, those of a format together, the usual one first.
const ENDINGS: [(&str, &str); 5] =
    [("csv", "csv"), ("jsonl", "jsonl"), ("ndjson", "jsonl"), ("parquet", "parquet"), ("txt", "table")];

/// Arguments for destination and format.
#[derive(Debug, clap::Args)]
pub struct Output<F: ValueEnum + Send + Sync + 'static> {
    /// Output format [default: by the ending of the file, else table]
    #[arg(long)]
    format: Option<F>,
    /// Output file; - is standard output
    #[arg(short, long, value_name = "FILE", default_value = "-", hide_default_value = true)]
    pub out: PathBuf,
}

impl<F: ValueEnum + Copy + PartialEq + Send + Sync> Output<F> {
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
        let [parquet, table] = ["parquet", "table"].map(|name| F::from_str(name, false).ok());
        // The endings of the formats of this answer.
        let endings = || ENDINGS.iter().filter_map(|(ending, name)| Some((*ending, F::from_str(name, false).ok()?)));
        let ending = file::ending(&self.out);
        let known = endings().find(|(known, _)| *known == ending);
        if let (Some(format), Some((ending, of_ending))) = (self.format, known)
            && (Some(format) == parquet) != (Some(of_ending) == parquet)
        {
            return Err(wrong(format!(
                "--out {}: the ending .{ending} contradicts --format\n  help: leave out --format, or change the ending",
                self.out.display()
            )));
        }
        let usual = table.filter(|_| self.is_stdout());
        let Some(format) = self.format.or(known.map(|(_, format)| format)).or(usual) else {
            let mut usual: Vec<(&str, F)> = endings().collect();
            usual.dedup_by_key(|(_, format)| *format);
            let usual: Vec<String> = usual.iter().map(|(ending, _)| format!(".{ending}")).collect();
            return Err(wrong(format!(
                "--out {}: the ending is none of {}\n  help: add --format",
                self.out.display(),
                usual.join(", ")
            )));
        };
        if Some(format) == parquet && self.is_stdout() && io::stdout().is_terminal() {
            return Err(wrong(
                "Parquet is not written to a terminal\n  help: name a file with --out, or pipe the output",
            ));
        }
        Ok(format)
    }
}
