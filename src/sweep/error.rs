//! What is wrong with a spec: where, what was found, what was expected, and what to do.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::names::{nearest, shown};

/// A fault in a spec.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpecError {
    /// The file, if there is one.
    pub file: Option<PathBuf>,
    /// The line, from 1.
    pub line: Option<usize>,
    /// The key, as in `axes.v_i[2]`; empty if it concerns the whole file.
    pub key: Box<str>,
    /// What was found.
    pub found: Box<str>,
    /// What would be right.
    pub expected: Box<str>,
    /// What to do.
    pub help: Box<str>,
}

/// Characters of a key that a message shows.
const MOST_OF_KEY: usize = 200;

/// Characters of a name, or of a cell of a file, that a message shows.
pub const MOST_OF_NAME: usize = 100;

/// Characters of what was found that a message shows: more than twice those of the longest expression.
const MOST_OF_FOUND: usize = 2500;

impl SpecError {
    /// A fault at `key`, whose place is not known yet.
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

    /// The same fault with its place.
    pub fn at(self, file: &Path, line: Option<usize>) -> SpecError {
        SpecError { file: Some(file.to_owned()), line, ..self }
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
            write!(f, "{}: ", shown(&self.key, MOST_OF_KEY))?;
        }
        write!(f, "{}\n  expected: {}\n  help: {}", shown(&self.found, MOST_OF_FOUND), self.expected, self.help)
    }
}

impl std::error::Error for SpecError {}

/// A fault of a name that is none of `known`, with the nearest of them.
pub fn unknown(key: String, what: &str, name: &str, known: &[&str]) -> SpecError {
    let help = match nearest(name, known.iter().copied()) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => "remove it, or choose one of these".to_owned(),
    };
    SpecError::new(key, format!("unknown {what} `{}`", shown(name, MOST_OF_NAME)), known.join(", "), help)
}
