//! The kind of a path. If an argument has the wrong kind, the message names the command that accepts it.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use super::{Failure, refused};
use crate::dataset::{Folder, MANIFEST, frame};
use crate::file::{self, ending};
use crate::sweep::path_hint;

/// Greatest number of datasets that a message lists. Chosen: they fit on a line.
const MAX_NAMED_DATASETS: usize = 4;

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
        let ending = ending(path);
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
        Kind::Other => other(path, kinds),
    };
    let expected: Vec<&str> = kinds.iter().map(|kind| kind.words()).collect();
    refused(format!("{shown}: {found}"), expected.join(", or "), help)
}

/// The datasets in a folder.
fn datasets_in(folder: &Path) -> Vec<PathBuf> {
    file::sorted(folder, |folder| folder.join(MANIFEST).is_file())
}

/// A path of another kind in words, and the help for it where `kinds` are expected.
fn other(path: &Path, kinds: &[Kind]) -> (String, String) {
    let shown = path.display();
    if let Some(dataset) = path.ancestors().skip(1).take(2).find(|above| above.join(MANIFEST).is_file()) {
        let dataset = if dataset == Path::new("") { Path::new(".") } else { dataset };
        return ("a piece of a dataset".to_owned(), format!("name the dataset, {}", dataset.display()));
    }
    let help = match kinds {
        [Kind::Spec] => "name a spec; `slipsweep init NAME` writes one",
        _ => "name a folder that `slipsweep run` wrote",
    };
    let help = help.to_owned();
    if path.is_dir() {
        let names: Vec<String> =
            datasets_in(path).iter().take(MAX_NAMED_DATASETS).map(|path| path.display().to_string()).collect();
        return match names.is_empty() {
            true => ("a folder without a dataset".to_owned(), help),
            false => ("a folder of datasets".to_owned(), format!("name one of them: {}", names.join(", "))),
        };
    }
    match (file::open(path), ending(path).as_str()) {
        (Err(error), _) => (error.to_string(), help),
        (_, "csv" | "parquet") => {
            ("a file of rows".to_owned(), format!("`slipsweep head {shown}` shows it, and `slipsweep query` reads it"))
        }
        (_, "html" | "htm" | "svg" | "png" | "pdf") => {
            ("a page or a picture".to_owned(), "open it in a browser or a viewer".to_owned())
        }
        _ => ("a file of another kind".to_owned(), help),
    }
}

/// Checks that `path` may be a spec; the reader of specs reports other errors.
///
/// # Errors
///
/// What the path is instead.
pub fn expect_spec(path: &Path) -> Result<(), Failure> {
    let is_file_of_another_kind =
        || matches!(ending(path).as_str(), "csv" | "parquet" | "json" | "html" | "htm" | "svg" | "png" | "pdf");
    match Kind::of(path) {
        Kind::Spec => Ok(()),
        Kind::Other if !(path.is_file() && is_file_of_another_kind()) => Ok(()),
        _ => Err(unexpected(path, &[Kind::Spec])),
    }
}

/// Checks that `path` may contain rows; the readers of datasets and of files report other errors.
///
/// # Errors
///
/// What the path is instead.
pub fn expect_rows(path: &Path) -> Result<(), Failure> {
    let has_datasets = path.is_dir() && Kind::of(path) == Kind::Other && !datasets_in(path).is_empty();
    if has_datasets || Kind::of(path) == Kind::Spec { Err(unexpected(path, &[Kind::Dataset])) } else { Ok(()) }
}
