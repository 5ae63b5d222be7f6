//! The kind of a path. If an argument has the wrong kind, the message names the command that accepts it.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::{Failure, refused};
use crate::dataset::Folder;
use crate::sweep::path_hint;

/// The file that makes a folder a dataset.
pub const MANIFEST: &str = "manifest.json";

/// Bytes at the start of a file that are inspected. Chosen: the whole of a handwritten spec.
const MAX_START_BYTES: u64 = 1 << 20;

/// Greatest number of datasets that a message lists. Chosen: they fit on a line.
const MAX_NAMED_DATASETS: usize = 4;

/// The kind of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The folder of a dataset.
    Dataset,
    /// A folder that contains datasets, such as `results`.
    Datasets,
    /// The folder of a table of a dataset.
    Table,
    /// A part of a table.
    Part,
    /// The manifest of a dataset.
    Manifest,
    /// Another folder.
    Folder,
    /// A spec.
    Spec,
    /// A protocol over time.
    Trace,
    /// Another file of rows, CSV or Parquet.
    Rows,
    /// An HTML page, such as one by `report`.
    Page,
    /// A picture, such as one by `plot`.
    Picture,
    /// Another file.
    File,
    /// A device or a named pipe, which can be read only once.
    Device,
    /// Nothing.
    Nothing,
}

impl Kind {
    /// The kind of `path`.
    pub fn of(path: &Path) -> Kind {
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
        if path.is_dir() {
            return match () {
                () if path.join(MANIFEST).exists() => Kind::Dataset,
                () if above(path).is_some_and(|above| above.join(MANIFEST).exists()) => Kind::Table,
                () if !datasets(path).is_empty() => Kind::Datasets,
                // The parts replace a lost manifest.
                () if matches!(Folder::at(path).manifest(), Ok(Some(_))) => Kind::Dataset,
                () => Kind::Folder,
            };
        }
        if !path.is_file() {
            return if path.exists() { Kind::Device } else { Kind::Nothing };
        }
        let Ok(start) = start(path) else { return Kind::File };
        let is_in_dataset = above(path).and_then(|table| above(&table)).is_some_and(|f| f.join(MANIFEST).exists());
        match ending.as_str() {
            "json" if path.file_name().is_some_and(|name| name == MANIFEST) => Kind::Manifest,
            "html" | "htm" => Kind::Page,
            "svg" | "png" | "pdf" => Kind::Picture,
            _ if start.starts_with(b"PAR1") && is_in_dataset => Kind::Part,
            _ if start.starts_with(b"PAR1") || ending == "parquet" => rows(has_columns_of_trace(path)),
            "csv" => rows(is_trace(&String::from_utf8_lossy(&start))),
            "toml" => Kind::Spec,
            _ if is_spec(&start) => Kind::Spec,
            _ => Kind::File,
        }
    }

    /// The expected argument, in words.
    fn expected(self) -> &'static str {
        match self {
            Kind::Spec => "a spec, such as NAME.toml",
            Kind::Trace => "a trace, which `slipsweep trace … --out FILE.csv` writes",
            _ => "the folder of a dataset, such as results/NAME",
        }
    }

    /// The kind in words, and the help for a `path` of this kind.
    fn words(self, path: &Path) -> (&'static str, String) {
        let shown = path.display();
        let name = |path: Option<PathBuf>, what: &str| {
            let path = path.map_or_else(String::new, |path| path.display().to_string());
            format!("name its {what}, {path}")
        };
        let ours = || "name a folder that `slipsweep run` wrote".to_owned();
        match self {
            Kind::Dataset => ("a dataset", format!("`slipsweep summary {shown}` shows its contents")),
            Kind::Datasets => ("a folder of datasets", format!("name one of them: {}", datasets(path).join(", "))),
            Kind::Table => ("the folder of a table", name(above(path), "dataset")),
            Kind::Part => ("a part of a table", name(above(path).and_then(|table| above(&table)), "dataset")),
            Kind::Manifest => ("the manifest of a dataset", name(above(path), "folder")),
            Kind::Folder if fs::read_dir(path).is_err() => {
                ("a folder that cannot be read", "check its permissions".to_owned())
            }
            Kind::Folder => ("a folder without a dataset", ours()),
            Kind::Spec => {
                ("a spec", format!("`slipsweep run {shown}` computes the dataset {}; name that folder", results(path)))
            }
            Kind::Trace => ("a trace", format!("`slipsweep plot {shown}` draws it")),
            Kind::Rows => {
                let table = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
                ("a file of rows", format!("`slipsweep query {shown} \"SELECT * FROM \\\"{table}\\\"\"` shows it"))
            }
            Kind::Page => ("a page of HTML", "open it in a browser".to_owned()),
            Kind::Picture => ("a picture", "open it in a viewer".to_owned()),
            Kind::File => ("a file of another kind", ours()),
            Kind::Device => ("a device or a named pipe, not a file", ours()),
            Kind::Nothing => ("there is no such file or folder", path_hint(path, "")),
        }
    }
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
    let found = Kind::of(path);
    let not: Vec<&str> = kinds.iter().map(|kind| kind.words(path).0).collect();
    let expected: Vec<&str> = kinds.iter().map(|kind| kind.expected()).collect();
    let (mut what, help) = found.words(path);
    let not = format!("{what}, not {}", not.join(" or "));
    if !matches!(found, Kind::Nothing | Kind::Device) {
        what = &not;
    }
    refused(format!("{}: {what}", path.display()), expected.join(", or "), help)
}

/// Checks that `path` may be a spec; the reader of specs reports other errors.
///
/// # Errors
///
/// What the path is instead.
pub fn expect_spec(path: &Path) -> Result<(), Failure> {
    match Kind::of(path) {
        Kind::Spec | Kind::File | Kind::Folder | Kind::Device | Kind::Nothing => Ok(()),
        _ => expect(path, &[Kind::Spec]),
    }
}

/// Checks that `path` may contain rows; the readers of datasets and of files report other errors.
///
/// # Errors
///
/// What the path is instead.
pub fn expect_rows(path: &Path) -> Result<(), Failure> {
    match Kind::of(path) {
        Kind::Spec | Kind::Manifest | Kind::Datasets | Kind::Page | Kind::Picture => expect(path, &[Kind::Dataset]),
        _ => Ok(()),
    }
}

/// The parent folder of a path.
fn above(path: &Path) -> Option<PathBuf> {
    let real = fs::canonicalize(path).ok()?;
    let real = real.parent()?.to_owned();
    // As typed, if that path leads to the folder.
    let typed = path.parent().filter(|typed| fs::canonicalize(typed).is_ok_and(|typed| typed == real));
    Some(typed.map_or(real.clone(), Path::to_owned))
}

/// The first datasets in a folder.
fn datasets(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    let mut found: Vec<PathBuf> = entries.filter(|path| path.join(MANIFEST).exists()).collect();
    found.sort();
    found.truncate(MAX_NAMED_DATASETS);
    found.into_iter().map(|path| path.display().to_string()).collect()
}

fn start(path: &Path) -> io::Result<Vec<u8>> {
    let mut start = Vec::new();
    File::open(path)?.take(MAX_START_BYTES).read_to_end(&mut start)?;
    Ok(start)
}

fn rows(is_trace: bool) -> Kind {
    if is_trace { Kind::Trace } else { Kind::Rows }
}

/// Whether a CSV has columns of time and velocity, after its comment lines.
fn is_trace(text: &str) -> bool {
    let names = text.lines().find(|line| !line.starts_with('#')).unwrap_or_default();
    ["t", "v"].iter().all(|name| names.split(',').any(|column| column.trim() == *name))
}

fn has_columns_of_trace(path: &Path) -> bool {
    let names = crate::dataset::frame::headings(path).map(|(headings, _)| headings).unwrap_or_default();
    ["t", "v"].iter().all(|name| names.iter().any(|heading| heading.name == *name))
}

/// Whether a text is a spec although the name of its file does not end like one.
fn is_spec(text: &[u8]) -> bool {
    toml_of(text).is_some_and(|table| ["axes", "tables", "block"].iter().any(|key| table.contains_key(*key)))
}

fn toml_of(text: &[u8]) -> Option<toml::Table> {
    std::str::from_utf8(text).ok()?.parse().ok()
}

/// The default dataset of a spec.
fn results(spec: &Path) -> String {
    let table = start(spec).ok().and_then(|text| toml_of(&text));
    let name = table.as_ref().and_then(|table| table.get("name")).and_then(toml::Value::as_str);
    format!("results/{}", name.unwrap_or("NAME"))
}
