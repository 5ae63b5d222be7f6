//! The error of a picture.

use crate::dataset::ReadError;
use crate::dataset::frame::FrameError;
use crate::names;

fn hint(name: &str, found: &[String]) -> String {
    names::hint(name, found.iter().map(String::as_str))
}

/// The error of a picture.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum PlotError {
    /// A file cannot be opened.
    #[error("{path}: cannot be read: {reason}")]
    Read { path: String, reason: String },
    /// A cell of a CSV file.
    #[error(
        "{path}, line {line}: found {found}\n  expected: {expected}\n  help: `slipsweep trace … --out FILE.csv` writes traces"
    )]
    Cell { path: String, line: usize, found: String, expected: String },
    /// A file is not a trace.
    #[error(
        "{path}: not a trace: it has no column `{missing}`\n  found: {}\n  help: `slipsweep trace … --out FILE` writes traces; \
         of a dataset, name the folder",
        .found.join(", ")
    )]
    NoTrace { path: String, missing: &'static str, found: Vec<String> },
    /// More traces than can be distinguished.
    #[error("{found} traces are too many for one picture\n  expected: at most {most}")]
    TooManyTraces { found: usize, most: usize },
    /// There is nothing to draw.
    #[error(
        "nothing to draw: no row has a number in these columns\n  help: `slipsweep summary` counts the rows by status"
    )]
    Nothing,
    /// Both axes of a map are the same.
    #[error(
        "--x and --y are both `{axis}`\n  expected: two axes, or a column in --y\n  help: leave out one of the two"
    )]
    SameAxes { axis: String },
    /// The horizontal axis has one value.
    #[error("--x {axis}: all rows have the same value\n  expected: one of {}\n  help: choose an axis that varies", .varying.join(", "))]
    Constant { axis: String, varying: Vec<String> },
    /// A column of words as lines.
    #[error(
        "--y {column}: words make no line\n  expected: a column of numbers\n  help: in a map over two axes, --color {column} shows them; \
         `slipsweep query` lists them"
    )]
    Words { column: String },
    /// The dataset has no table of this name.
    #[error("the dataset has no table `{name}`\n  found: {}\n  help: {}", .found.join(", "), hint(.name, .found))]
    NoTable { name: String, found: Vec<String> },
    /// The table has no column of this name.
    #[error("{argument}: the table `{table}` has no {what} `{name}`\n  found: {}\n  help: {}", .found.join(", "), hint(.name, .found))]
    NoColumn { argument: String, table: String, what: &'static str, name: String, found: Vec<String> },
    /// The trace has no column of this name.
    #[error("{argument}: the trace has no column `{name}`\n  found: {}\n  help: {}", .found.join(", "), hint(.name, .found))]
    NoTraceColumn { argument: &'static str, name: String, found: Vec<String> },
    /// A condition that cannot be read.
    #[error(
        "--where {text}: not a condition\n  expected: COLUMN=VALUE, or <, >, <=, >= or != between them, or COLUMN in (VALUE, VALUE); several of them separated by commas\n  help: such as --where \"a=0.03, v_f>=10\""
    )]
    Condition { text: String },
    /// A word for a column of numbers.
    #[error(
        "--where {text}: the column `{column}` has numbers\n  expected: a number without a unit, such as 0.03, 1e-6 or inf\n  help: correct the value"
    )]
    NotNumber { text: String, column: String },
    /// A word that a column never has.
    #[error(
        "--where {text}: `{column}` is never `{word}`\n  expected: {}\n  help: {}", .words.join(", "), crate::names::hint(.word, .words.iter().copied())
    )]
    NotWord { text: String, column: String, word: String, words: &'static [&'static str] },
    /// No row meets the conditions.
    #[error("--where {text}: no row of the table `{table}` meets this\n  found: {found}\n  help: {help}")]
    NoRows { table: String, text: String, found: String, help: String },
    /// The table has no rows.
    #[error("the table `{table}` has no rows yet\n  help: compute them with `slipsweep run`")]
    Empty { table: String },
    /// Every axis has a single value.
    #[error("the table `{table}` has a single matching row, which makes no picture\n  help: `slipsweep head` shows it")]
    OneRow { table: String },
    /// A label as an axis.
    #[error(
        "{argument} {label}: a label is no axis\n  expected: a column of numbers\n  help: --y {line} draws a line for each {label}; --where \"{label}=…\" selects one"
    )]
    Label { argument: &'static str, label: String, line: String },
    /// A map needs two axes.
    #[error(
        "--color {column}: a map needs two axes of several values, which the table `{table}` does not have\n  found: {found}\n  \
         help: --y {line} draws lines{}", if *.are_words { "; `slipsweep query` lists the words" } else { "" }
    )]
    NoMap { table: String, column: String, found: String, line: String, are_words: bool },
    /// Lines in the colours of a result.
    #[error(
        "--color {column} is a result, which colours maps\n  expected: an axis or a label, since --y draws lines{}\n  help: remove --color",
        if among.is_empty() { String::new() } else { format!(": {among}") }
    )]
    ColourOfLines { column: String, among: String },
    /// Traces in different units.
    #[error(
        "the traces differ in the unit of `{column}`\n  found: {} and {}\n  expected: the same units\n  help: draw them one by one, or \
         trace both in the same units", .units[0], .units[1]
    )]
    Units { column: String, units: [String; 2] },
    /// A Parquet trace cannot be read.
    #[error("{0}\n  help: delete the file and trace it again")]
    Trace(FrameError),
    /// A part of a table cannot be read.
    #[error(transparent)]
    Part(#[from] ReadError),
    /// The picture cannot be converted.
    #[error("cannot convert the picture: {0}\n  help: write it as .svg")]
    Convert(String),
    /// The picture has too many pixels.
    #[error("a picture of {width} x {height} pixels is too large\n  help: lower --dpi")]
    Size { width: f64, height: f64 },
}
