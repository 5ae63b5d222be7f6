//! The error of a spec: place, finding, expectation and help of each fault.

use std::fmt;
use std::path::{Path, PathBuf};
use std::{iter, mem};

use super::read;
use crate::names::{hint_or, shown};

/// The error of a spec: a fault, and others that do not follow from it.
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
    /// The other faults, at most nine.
    pub others: Box<[SpecError]>,
}

/// Greatest number of faults in an error. Chosen: they fit a screen.
const MAX_FAULTS: usize = 10;

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
            others: Box::default(),
        }
    }

    /// The faults as those of `file`.
    pub fn of(self, file: &Path) -> SpecError {
        self.each(|fault| fault.file = Some(file.to_owned()))
    }

    /// The faults with the lines of their keys in `text`, unless they have some.
    pub fn located(self, text: &str) -> SpecError {
        self.each(|fault| fault.line = fault.line.or_else(|| read::line(text, &fault.key)))
    }

    /// These faults, if any, and another, each once.
    pub fn and(faults: Option<SpecError>, mut other: SpecError) -> SpecError {
        let Some(mut first) = faults else { return other };
        let others = mem::take(&mut other.others);
        let mut known = Vec::from(mem::take(&mut first.others));
        for fault in iter::once(other).chain(others) {
            if fault != first && !known.contains(&fault) && known.len() + 1 < MAX_FAULTS {
                known.push(fault);
            }
        }
        first.others = known.into();
        first
    }

    /// Whether no other fault has a place.
    pub fn is_full(&self) -> bool {
        self.others.len() + 1 >= MAX_FAULTS
    }

    /// The faults after a `change` of each.
    pub fn each(mut self, mut change: impl FnMut(&mut SpecError)) -> SpecError {
        self.others.iter_mut().for_each(&mut change);
        change(&mut self);
        self
    }

    /// Writes this fault alone.
    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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

impl fmt::Display for SpecError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut faults: Vec<&SpecError> = iter::once(self).chain(&self.others).collect();
        // Faults of the whole spec come last.
        faults.sort_by_key(|fault| fault.line.unwrap_or(usize::MAX));
        for (place, fault) in faults.into_iter().enumerate() {
            if place > 0 {
                f.write_str("\nerror: ")?;
            }
            fault.write(f)?;
        }
        Ok(())
    }
}

impl std::error::Error for SpecError {}

/// The values of independent checks, or the faults of all as one error.
///
/// # Errors
///
/// The error of any check.
pub fn all<T>(checks: impl IntoIterator<Item = Result<T, SpecError>>) -> Result<Vec<T>, SpecError> {
    let (mut values, mut error) = (Vec::new(), None);
    for check in checks {
        match check {
            Ok(value) => values.push(value),
            Err(fault) => error = Some(SpecError::and(error, fault)),
        }
    }
    error.map_or(Ok(values), Err)
}

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
    let help = hint_or(name, known.iter().copied(), "remove it, or choose one of these");
    SpecError::new(key, format!("unknown {what} `{name}`"), known.join(", "), help)
}
