//! What is wrong with a spec: where, what was found, what was expected, and what to do.

use std::fmt;
use std::path::{Path, PathBuf};

use super::read;
use crate::names::{nearest, shown};

/// What is wrong with a spec: a fault, and those that are independent of it.
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
    /// The other faults of the spec, in the order of their lines; of many, the first that were found.
    pub others: Box<[SpecError]>,
}

/// Characters of a key that a message shows. Chosen: twice those of the longest legal key.
const MAX_KEY_CHARS: usize = 200;

/// Characters of a name, or of a cell of a file, that a message shows. Chosen: a line.
pub const MAX_NAME_CHARS: usize = 100;

/// Characters of what was found that a message shows: more than twice the 1000 of the longest expression.
const MAX_FOUND_CHARS: usize = 2500;

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

/// Faults that one message names. Chosen: they fit a screen.
const MAX_FAULTS: usize = 10;

/// The faults that a check has found so far.
#[derive(Debug, Default)]
pub struct Faults {
    found: Vec<SpecError>,
    /// Keys that are wrong, or that a misspelt one was meant to be.
    suspects: Vec<String>,
}

impl Faults {
    /// Adds a fault, unless it is known or there are enough.
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

    /// Adds a key about which nothing more can be said.
    pub fn suspect(&mut self, key: String) {
        if !self.are_enough() {
            self.suspects.push(key);
        }
    }

    /// Whether a fault at `key`, above or below it, or one that was not added, may be the cause of what looks wrong there.
    pub fn concern(&self, key: &str) -> bool {
        let is_below = |key: &str, above: &str| {
            key.strip_prefix(above).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        self.are_enough() || self.suspects.iter().any(|suspect| is_below(suspect, key) || is_below(key, suspect))
    }

    /// Whether there is no fault so far.
    pub fn are_none(&self) -> bool {
        self.found.is_empty()
    }

    /// Whether no more are added: there are more than are named.
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
            f.write_str("\nerror: there are more; correct these first")?;
        }
        Ok(())
    }
}

impl std::error::Error for SpecError {}

/// The fault at `key` as the result of a check.
pub fn refuse<T>(
    key: impl Into<Box<str>>,
    found: impl Into<Box<str>>,
    expected: impl Into<Box<str>>,
    help: impl Into<Box<str>>,
) -> Result<T, SpecError> {
    Err(SpecError::new(key, found, expected, help))
}

/// A fault of a name that is none of `known`, with the nearest of them.
pub fn unknown(key: String, what: &str, name: &str, known: &[&str]) -> SpecError {
    let help = match nearest(name, known.iter().copied()) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => "remove it, or choose one of these".to_owned(),
    };
    SpecError::new(key, format!("unknown {what} `{}`", shown(name, MAX_NAME_CHARS)), known.join(", "), help)
}
