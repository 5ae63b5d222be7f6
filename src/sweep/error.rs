//! What is wrong with a spec: where, what was found, what was expected, and what to do.

use std::fmt;
use std::path::{Path, PathBuf};

/// A fault in a spec.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpecError {
    /// The file, if there is one.
    pub file: Option<PathBuf>,
    /// The line in the file, from 1.
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
        if let Some(file) = &self.file {
            write!(f, "{}:", file.display())?;
            match self.line {
                Some(line) => write!(f, "{line}: ")?,
                None => f.write_str(" ")?,
            }
        }
        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        write!(f, "{}\n  expected: {}\n  help: {}", self.found, self.expected, self.help)
    }
}

impl std::error::Error for SpecError {}

/// The name among `known`, all in lower case, that `name` was most likely meant to be.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(&name.to_lowercase(), candidate), candidate))
        .filter(|(distance, candidate)| *distance <= candidate.len().max(name.len()).div_ceil(3))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// A fault of a name that is none of `known`, with the nearest of them.
pub fn unknown(key: String, what: &str, name: &str, known: &[&str]) -> SpecError {
    let help = match nearest(name, known.iter().copied()) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => "remove it, or choose one of these".to_owned(),
    };
    SpecError::new(key, format!("unknown {what} `{name}`"), known.join(", "), help)
}

#[cfg(test)]
mod tests {
    //! Suggestions are near or not made.

    use super::nearest;

    #[test]
    fn nearest_name_or_none() {
        let known = ["linspace", "geomspace", "unit", "expr"];
        assert_eq!(nearest("lnspace", known), Some("linspace"));
        assert_eq!(nearest("geospace", known), Some("geomspace"));
        assert_eq!(nearest("unti", known), Some("unit"));
        assert_eq!(nearest("UNIT", known), Some("unit"));
        assert_eq!(nearest("temperature", known), None);
        assert_eq!(nearest("", known), None);
    }
}
