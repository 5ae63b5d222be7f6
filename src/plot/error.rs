//! The error of a picture.

use crate::dataset::{DatasetError, FrameError};
use crate::names::hint;

/// The error of a picture.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum PlotError {
    /// A request that makes no picture: the message, with its help.
    #[error("{0}")]
    Refused(String),
    /// There is nothing to draw.
    #[error(
        "nothing to draw: no row has a number in these columns\n  help: `slipsweep summary` counts the rows by status"
    )]
    Nothing,
    /// The table has no rows.
    #[error("the table `{table}` has no rows yet\n  help: compute them with `slipsweep run`")]
    Empty { table: String },
    /// A Parquet trace cannot be read.
    #[error("{0}\n  help: delete the file and trace it again")]
    Trace(FrameError),
    /// A part is damaged, or belongs to another dataset.
    #[error(transparent)]
    Part(#[from] DatasetError),
    /// A part is found to be damaged during reading.
    #[error("{0}\n  help: run the sweep again; it recomputes damaged parts alone")]
    Frame(#[from] FrameError),
}

impl PlotError {
    /// A `name` that is not among the `known` ones.
    pub(super) fn unknown(found: &str, name: &str, known: &[String]) -> PlotError {
        let help = hint(name, known.iter().map(String::as_str));
        PlotError::Refused(format!("{found} `{name}`\n  found: {}\n  help: {help}", known.join(", ")))
    }

    /// One axis for both directions.
    pub(super) fn same_axes(axis: &str) -> PlotError {
        let expected = "two axes, or a column in --y";
        PlotError::Refused(format!(
            "--x and --y are both `{axis}`\n  expected: {expected}\n  help: leave out one of the two"
        ))
    }
}
