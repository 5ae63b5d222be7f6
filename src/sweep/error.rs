//! The error of a spec: place, finding, expectation and help.

use std::fmt;
use std::path::{Path, PathBuf};

use super::read;
use crate::names::{nearest, shown};

/// The error of a spec: its first fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpecError {
    /// The file, if there is one.
    pub file: Option<PathBuf>,
    /// The line, from 1.
    pub line: Option<usize>,
    /// The key, as in `axes.v_i[2]`; empty if it concerns the whole file.
    pub key: Box<str>,
    /// The finding.
    pub found: Box<str>,
    /// The expected input.
    pub expected: Box<str>,
    /// The help.
    pub help: Box<str>,
}

/// Greatest length of a key or finding in a message, in characters. Chosen: more than the 1000 of the longest expression.
const MAX_SHOWN_CHARS: usize = 1200;

impl SpecError {
    /// A fault at `key`, without a line yet.
    pub fn new(
        key: impl Into<Box<str>>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
        help: impl Into<Box<str>>,
    ) -> SpecError {
        SpecError {
            file: None,
            line: None,
            key: key.into(),
            found: found.into(),
            expected: expected.into(),
            help: help.into(),
        }
    }

    /// The fault as one of `file`.
    pub fn of(self, file: &Path) -> SpecError {
        SpecError { file: Some(file.to_owned()), ..self }
    }

    /// The fault with the line of its key in `text`, unless it has one.
    pub fn located(self, text: &str) -> SpecError {
        SpecError { line: self.line.or_else(|| read::line(text, &self.key)), ..self }
    }
}

impl fmt::Display for SpecError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.file, self.line) {
            (Some(file), Some(line)) => write!(f, "{}:{line}: ", file.display())?,
            (Some(file), None) => write!(f, "{}: ", file.display())?,
            (None, Some(line)) => write!(f, "line {line}: ")?,
            (None, None) => {}
        }
        if !self.key.is_empty() {
            write!(f, "{}: ", shown(&self.key, MAX_SHOWN_CHARS))?;
        }
        write!(f, "{}\n  expected: {}\n  help: {}", shown(&self.found, MAX_SHOWN_CHARS), self.expected, self.help)
    }
}

impl std::error::Error for SpecError {}

/// The fault at `key` as the result of a check.
///
/// # Errors
///
/// Always.
pub fn refuse<T>(
    key: impl Into<Box<str>>,
    found: impl Into<Box<str>>,
    expected: impl Into<Box<str>>,
    help: impl Into<Box<str>>,
) -> Result<T, SpecError> {
    Err(SpecError::new(key, found, expected, help))
}

/// The fault of a name that is not in `known`, with the nearest known name.
pub fn unknown(key: String, what: &str, name: &str, known: &[&str]) -> SpecError {
    let help = match nearest(name, known.iter().copied()) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => "remove it, or choose one of these".to_owned(),
    };
    SpecError::new(key, format!("unknown {what} `{name}`"), known.join(", "), help)
}
