//! The errors of a spec: place, finding, expectation and help.

use std::fmt;
use std::path::{Path, PathBuf};

use super::read;
use crate::names::{nearest, shown};

/// The error of a spec: its first fault, and the independent others.
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
    /// The other faults of the spec, by line; the first ones of many.
    pub others: Box<[SpecError]>,
}

/// Greatest length of a key in a message, in characters. Chosen: twice the longest legal key.
const MAX_KEY_CHARS: usize = 200;

/// Greatest length of a name or cell in a message, in characters. Chosen: a line.
pub const MAX_NAME_CHARS: usize = 100;

/// Greatest length of a finding in a message, in characters. Chosen: twice the 1000 of the longest expression.
const MAX_FOUND_CHARS: usize = 2500;

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
            others: Box::default(),
        }
    }

    /// The fault and its `others`, as faults of `file`.
    pub fn of(mut self, file: &Path) -> SpecError {
        for fault in std::iter::once(&mut self.file).chain(self.others.iter_mut().map(|other| &mut other.file)) {
            *fault = Some(file.to_owned());
        }
        self
    }
}

/// Greatest number of faults in a message. Chosen: they fit a screen.
const MAX_FAULTS: usize = 10;

/// The faults of a check.
#[derive(Debug, Default)]
pub struct Faults {
    found: Vec<SpecError>,
    /// Keys with a fault, and the probable meaning of misspelt keys.
    suspects: Vec<String>,
}

impl Faults {
    /// Adds a fault, unless it is known or the limit is reached.
    pub fn push(&mut self, fault: SpecError) {
        self.suspect(fault.key.to_string());
        if !self.are_enough() && !self.found.contains(&fault) {
            self.found.push(fault);
        }
    }

    /// The value of `result`; its error is added.
    pub fn take<T>(&mut self, result: Result<T, SpecError>) -> Option<T> {
        result.map_err(|fault| self.push(fault)).ok()
    }

    /// Excludes a key from further checks.
    pub fn suspect(&mut self, key: String) {
        if !self.are_enough() {
            self.suspects.push(key);
        }
    }

    /// Whether a known fault at, above or below `key` may cause a fault there.
    pub fn concern(&self, key: &str) -> bool {
        let is_below = |key: &str, above: &str| {
            key.strip_prefix(above).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        self.are_enough() || self.suspects.iter().any(|suspect| is_below(suspect, key) || is_below(key, suspect))
    }

    /// Whether no fault is known.
    pub fn are_none(&self) -> bool {
        self.found.is_empty()
    }

    /// Whether the limit is reached.
    pub fn are_enough(&self) -> bool {
        self.found.len() > MAX_FAULTS
    }

    /// All faults as one error, in the order of their lines in `text`.
    ///
    /// # Errors
    ///
    /// If there is any fault.
    pub fn finish(mut self, text: &str) -> Result<(), SpecError> {
        read::find_lines(text, &mut self.found);
        // Faults of the whole spec come last.
        self.found.sort_by_key(|fault| fault.line.unwrap_or(usize::MAX));
        let mut found = self.found.into_iter();
        match found.next() {
            Some(first) => Err(SpecError { others: found.collect(), ..first }),
            None => Ok(()),
        }
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
            write!(f, "{}: ", shown(&self.key, MAX_KEY_CHARS))?;
        }
        write!(f, "{}\n  expected: {}\n  help: {}", shown(&self.found, MAX_FOUND_CHARS), self.expected, self.help)?;
        let (named, rest) = self.others.split_at(self.others.len().min(MAX_FAULTS - 1));
        for other in named {
            write!(f, "\nerror: {other}")?;
        }
        if !rest.is_empty() {
            f.write_str("\nerror: more errors follow; correct these first")?;
        }
        Ok(())
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
    SpecError::new(key, format!("unknown {what} `{}`", shown(name, MAX_NAME_CHARS)), known.join(", "), help)
}
