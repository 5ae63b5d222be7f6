//! The kind of a path. If an argument has the wrong kind, the message names the command that accepts it.

use std::io::{BufRead, BufReader};
use std::path::Path;

use super::{Failure, refused};
use crate::dataset::{Folder, MANIFEST, frame};
use crate::file;
use crate::sweep::path_hint;

/// The kind of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The folder of a dataset.
    Dataset,
    /// A spec.
    Spec,
    /// A protocol over time.
    Trace,
    /// Another file or folder, or nothing.
    Other,
}

impl Kind {
    /// The kind of `path`.
    pub fn of(path: &Path) -> Kind {
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
        let has_columns_of_trace = || {
            let columns = columns(path, &ending);
            ["t", "v"].iter().all(|name| columns.iter().any(|column| column == name))
        };
        match ending.as_str() {
            _ if path.is_dir() && is_dataset(path) => Kind::Dataset,
            _ if path.is_dir() => Kind::Other,
            "toml" => Kind::Spec,
            "csv" | "parquet" if has_columns_of_trace() => Kind::Trace,
            _ => Kind::Other,
        }
    }

    /// The kind in words, as an expected argument.
    fn words(self) -> &'static str {
        match self {
            Kind::Dataset => "the folder of a dataset, such as results/NAME",
            Kind::Spec => "a spec, such as NAME.toml",
            Kind::Trace => "a trace, which `slipsweep trace … --out FILE.csv` writes",
            Kind::Other => "another file",
        }
    }
}

/// Whether a folder is a dataset: it has a manifest, or parts, which replace a lost one.
pub fn is_dataset(folder: &Path) -> bool {
    folder.join(MANIFEST).exists() || matches!(Folder::at(folder).manifest(), Ok(Some(_)))
}

/// The names of the columns of a CSV, after its comment lines, or of a Parquet file.
fn columns(path: &Path, ending: &str) -> Vec<String> {
    let Ok(file) = file::open(path) else { return Vec::new() };
    if ending == "parquet" {
        let headings = frame::headings(path).map(|(headings, _)| headings).unwrap_or_default();
        return headings.into_iter().map(|heading| heading.name).collect();
    }
    let mut lines = BufReader::new(file).lines().map_while(Result::ok);
    let names = lines.find(|line| !line.starts_with('#')).unwrap_or_default();
    names.split(',').map(|name| name.trim().to_owned()).collect()
}

/// Checks that `path` is one of `kinds`.
///
/// # Errors
///
/// What the path is instead.
pub fn expect(path: &Path, kinds: &[Kind]) -> Result<(), Failure> {
    if kinds.contains(&Kind::of(path)) { Ok(()) } else { Err(unexpected(path, kinds)) }
}

/// The failure of a `path` that is none of `kinds`.
pub fn unexpected(path: &Path, kinds: &[Kind]) -> Failure {
    let shown = path.display();
    let (found, help) = match Kind::of(path) {
        _ if !path.exists() => ("there is no such file or folder".to_owned(), path_hint(path, "")),
        Kind::Dataset => ("a dataset".to_owned(), format!("`slipsweep summary {shown}` shows its contents")),
        Kind::Spec => ("a spec".to_owned(), format!("`slipsweep run {shown}` computes its dataset; name that folder")),
        Kind::Trace => ("a trace".to_owned(), format!("`slipsweep plot {shown}` draws it")),
        Kind::Other => {
            let found = match file::open(path) {
                Err(error) if !path.is_dir() => error.to_string(),
                _ => "a file or folder of another kind".to_owned(),
            };
            (found, "name a folder that `slipsweep run` wrote".to_owned())
        }
    };
    let expected: Vec<&str> = kinds.iter().map(|kind| kind.words()).collect();
    refused(format!("{shown}: {found}"), expected.join(", or "), help)
}

/// Checks that `path` may be a spec; the reader of specs reports other errors.
///
/// # Errors
///
/// What the path is instead.
pub fn expect_spec(path: &Path) -> Result<(), Failure> {
    if matches!(Kind::of(path), Kind::Spec | Kind::Other) { Ok(()) } else { Err(unexpected(path, &[Kind::Spec])) }
}

/// Checks that `path` may contain rows; the readers of datasets and of files report other errors.
///
/// # Errors
///
/// What the path is instead.
pub fn expect_rows(path: &Path) -> Result<(), Failure> {
    if Kind::of(path) == Kind::Spec { Err(unexpected(path, &[Kind::Dataset])) } else { Ok(()) }
}
