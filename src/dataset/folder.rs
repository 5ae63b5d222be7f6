//! The folder of a dataset: `<name>/manifest.json` and `<name>/<table>/part-000000.parquet`.

use std::borrow::Cow;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::atomic;
use super::manifest::{Manifest, ManifestTable};
use super::state::{self, CheckDepth, Foreign, State};
use crate::file::{self, sorted};

/// The name of the file of the manifest.
pub const MANIFEST: &str = "manifest.json";

/// Why a manifest without a file comes from the parts.
pub(super) const MISSING: &str = "missing";

/// The help if the folder contains another dataset.
const OTHER_SPEC_HELP: &str = "change `name` in the spec, or write elsewhere with --out DIR, or remove the dataset";

/// The errors of the files of a dataset.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum DatasetError {
    /// The folder contains a dataset of another version or revision of the program.
    #[error(
        "{folder}: holds a dataset of another {what}\n  expected: {expected}\n  found: {found}\n  help: {OTHER_SPEC_HELP}"
    )]
    Foreign { folder: String, what: &'static str, expected: String, found: String },
    /// The folder contains a dataset of another spec.
    #[error(
        "{folder}: holds a dataset of another spec\n  in the spec: {expected}\n  in the dataset: {found}\n  help: {OTHER_SPEC_HELP}"
    )]
    OtherSpec { folder: String, table: String, expected: String, found: String, spec: String },
    /// The folder contains tables that the spec lacks, and lacks tables of the spec.
    #[error(
        "{folder}: the spec and the dataset each have a table that the other lacks\n  in the spec: {expected}\n  in the dataset: {found}\n  help: add the \
         tables of the dataset to the spec, which keeps its rows and computes yours; or {OTHER_SPEC_HELP}"
    )]
    OtherTables { folder: String, expected: String, found: String },
    /// Another run writes the dataset.
    #[error(
        "{folder}: another run is writing this dataset\n  help: wait for its end (`slipsweep status {folder}` shows its progress); only \
         shards (--shard I/N) run side by side"
    )]
    Busy { folder: String },
    /// The dataset was changed during this run.
    #[error(
        "{folder}: {what} during this run, which stopped\n  help: run the same command again; it keeps finished parts"
    )]
    Taken { folder: String, what: &'static str },
    /// The folder contains no dataset, but other files.
    #[error(
        "{folder}: neither a dataset nor empty\n  expected: an empty folder, or one with a manifest.json\n  help: change \
         `name` in the spec, or write elsewhere with --out DIR"
    )]
    Occupied { folder: String },
    /// A file with the name of a part does not belong to this sweep.
    #[error(
        "{path}: not a part of this dataset: {why}\n  help: {}", why.help()
    )]
    ForeignPart { path: String, why: Foreign },
    /// A part is damaged.
    #[error(
        "{path}: the part is damaged: {why}\n  help: `slipsweep run {dataset}` recomputes it and keeps all intact parts"
    )]
    DamagedPart { path: String, why: String, dataset: String },
    /// The manifest is damaged, and no part can replace it.
    #[error(
        "{path}: damaged, or of another version of slipsweep: {why}\n  help: run the spec of the dataset, which rewrites it if no part \
         is there; else {OTHER_SPEC_HELP}"
    )]
    Manifest { path: String, why: String },
    /// An error of the operating system.
    #[error("{path}: cannot {action}: {source}\n  help: {}", io_help(action, source))]
    Io { path: String, action: &'static str, source: io::Error },
    /// A part, or a sample of one, could not be encoded.
    #[error("cannot encode a part: {0}")]
    Encode(#[from] parquet::errors::ParquetError),
}

/// What to do after an error of the operating system.
fn io_help(action: &str, source: &io::Error) -> &'static str {
    match (action, source.kind()) {
        (_, io::ErrorKind::NotADirectory) => "a folder of this path is a file: write elsewhere with --out DIR",
        ("read", io::ErrorKind::PermissionDenied) => "give yourself permission to read it",
        ("read", _) => "solve this and run the same command again",
        _ => "solve this and run the same command again, which keeps finished parts; or write elsewhere with --out DIR",
    }
}

/// The folder of one dataset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Folder {
    path: PathBuf,
}

impl Folder {
    /// The folder of the dataset `name` in `out`; nothing is created yet.
    pub fn new(out: &Path, name: &str) -> Folder {
        Folder { path: out.join(name) }
    }

    /// The dataset in `path`.
    pub fn at(path: &Path) -> Folder {
        Folder { path: path.to_owned() }
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path of a part.
    pub fn part(&self, table: &str, part: u64) -> PathBuf {
        self.path.join(table).join(format!("part-{part:06}.parquet"))
    }

    /// The path of the manifest.
    pub fn manifest_path(&self) -> PathBuf {
        self.path.join(MANIFEST)
    }

    /// The manifest, if any; reconstructed from the parts if its file is missing or damaged.
    ///
    /// # Errors
    ///
    /// If it cannot be read, or if it is damaged and there are no parts.
    pub fn manifest(&self) -> Result<Option<Manifest>, DatasetError> {
        let read = self.read_manifest();
        let why = match &read {
            Ok(None) => MISSING.to_owned(),
            Err(DatasetError::Manifest { why, .. }) => format!("damaged: {why}"),
            _ => return read,
        };
        match self.manifest_of_parts() {
            Some(manifest) => Ok(Some(Manifest { rebuilt: Some(why), ..manifest })),
            None => read,
        }
    }

    /// The manifest from its file; `None` if there is no file.
    pub(super) fn read_manifest(&self) -> Result<Option<Manifest>, DatasetError> {
        let path = self.manifest_path();
        match file::read(&path) {
            Ok(bytes) => Manifest::from_bytes(&bytes)
                .map(Some)
                .map_err(|why| DatasetError::Manifest { path: path.display().to_string(), why }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(failed(&path, "read", error)),
        }
    }

    /// The manifest reconstructed from the parts, if any part can be read.
    fn manifest_of_parts(&self) -> Option<Manifest> {
        let first = |table: PathBuf| sorted(&table, is_part).into_iter().find_map(|part| state::footer_of(&part));
        let footers = sorted(&self.path, Path::is_dir).into_iter().filter_map(first);
        // Tables are only added, so the manifest with the most tables is the last one.
        footers.map(|footer| footer.manifest).reduce(|most, next| if next.covers(&most) { next } else { most })
    }

    /// Whether any file has the name of a part.
    pub(super) fn has_parts(&self) -> bool {
        sorted(&self.path, Path::is_dir).iter().any(|table| !sorted(table, is_part).is_empty())
    }

    /// Checks that a run of `expected` may write to the dataset of `found`.
    pub(super) fn compare(&self, expected: &Manifest, found: &Manifest) -> Result<(), DatasetError> {
        let folder = self.path.display().to_string();
        let (ours, theirs) = (&expected.build, &found.build);
        for (what, here, there) in
            [("version", &ours.version, &theirs.version), ("numerics revision", &ours.revision, &theirs.revision)]
        {
            if here != there {
                let expected = format!("{here}, of this program");
                return Err(DatasetError::Foreign { folder, what, expected, found: there.clone() });
            }
        }
        for table in &expected.tables {
            if let Some(other) = found.table(&table.name)
                && other.hash != table.hash
            {
                let (expected, there) = (table.hash.clone(), other.hash.clone());
                let (table, spec) = (table.name.clone(), found.spec.clone());
                return Err(DatasetError::OtherSpec { folder, table, expected, found: there, spec });
            }
        }
        let names = |manifest: &Manifest| manifest.tables.iter().map(|table| table.name.clone()).collect::<Vec<_>>();
        let (expected, found) = (names(expected), names(found));
        if found.iter().any(|name| !expected.contains(name)) && expected.iter().any(|name| !found.contains(name)) {
            let (expected, found) = (expected.join(", "), found.join(", "));
            return Err(DatasetError::OtherTables { folder, expected, found });
        }
        Ok(())
    }

    /// The numbers of the parts of `table` for which a file exists, or may exist in a folder of another user, ascending. Lists the folder once, so
    /// that missing parts cost nothing.
    pub fn parts_there(&self, table: &ManifestTable) -> Vec<u64> {
        let entries = fs::read_dir(self.path.join(&table.name));
        if entries.as_ref().is_err_and(|error| error.kind() == io::ErrorKind::PermissionDenied) {
            return (0..table.parts).collect();
        }
        let entries = entries.into_iter().flatten().flatten();
        let mut parts: Vec<u64> = entries.filter_map(|entry| self.part_at(table, &entry.path())).collect();
        parts.sort_unstable();
        parts
    }

    /// The paths of the present parts of `table` in order, and the number of missing parts. The footer of each part is verified here, its pages when they are read.
    ///
    /// # Errors
    ///
    /// If a part is damaged, or does not belong to the dataset.
    pub fn verified(&self, manifest: &Manifest, table: &ManifestTable) -> Result<(Vec<PathBuf>, u64), DatasetError> {
        let there = self.parts_there(table).into_par_iter();
        let opened = there.filter_map(|part| self.verified_part(manifest, table, part).transpose());
        let paths = opened.collect::<Result<Vec<PathBuf>, DatasetError>>()?;
        let missing = table.parts - paths.len() as u64;
        Ok((paths, missing))
    }

    /// The path of a part whose footer is verified; `None` if it is missing.
    ///
    /// # Errors
    ///
    /// If the part is damaged, or does not belong to this place of the dataset.
    pub fn verified_part(
        &self,
        manifest: &Manifest,
        table: &ManifestTable,
        part: u64,
    ) -> Result<Option<PathBuf>, DatasetError> {
        let path = self.part(&table.name, part);
        match self.state(manifest, &table.name, part, CheckDepth::Footer) {
            State::There { .. } => Ok(Some(path)),
            State::Missing => Ok(None),
            fault => Err(self.fault(&path, fault)),
        }
    }

    /// The error for a damaged or foreign file with the name of a part.
    pub fn fault(&self, path: &Path, state: State) -> DatasetError {
        let (path, dataset) = (path.display().to_string(), self.path.display().to_string());
        match state {
            State::Foreign { why } => DatasetError::ForeignPart { path, why },
            State::Damaged { why } => DatasetError::DamagedPart { path, why, dataset },
            State::Missing | State::There { .. } => {
                DatasetError::DamagedPart { path, why: "it changed while it was read".to_owned(), dataset }
            }
        }
    }

    /// Files below the folder that do not belong to the dataset of `manifest`: temporary files of a run, and others.
    pub fn strays(&self, manifest: &Manifest) -> (Vec<PathBuf>, Vec<PathBuf>) {
        let mut strays = Vec::new();
        for path in sorted(&self.path, |path| *path != self.manifest_path()) {
            match manifest.table(&name(&path)) {
                Some(table) if path.is_dir() => {
                    strays.extend(sorted(&path, |path| self.part_at(table, path).is_none()));
                }
                _ => strays.push(path),
            }
        }
        strays.into_iter().partition(|path| atomic::is_temporary(&name(path)))
    }

    /// The number of the part of `table` with this `path`.
    fn part_at(&self, table: &ManifestTable, path: &Path) -> Option<u64> {
        let part = name(path).strip_prefix("part-")?.strip_suffix(".parquet")?.parse().ok()?;
        (part < table.parts && self.part(&table.name, part) == path).then_some(part)
    }
}

/// The name of a file.
fn name(path: &Path) -> Cow<'_, str> {
    path.file_name().unwrap_or_default().to_string_lossy()
}

/// Whether a file has the name of a part.
fn is_part(path: &Path) -> bool {
    let name = name(path);
    name.starts_with("part-") && name.ends_with(".parquet")
}

/// The error that `path` cannot be created, read or written.
pub(super) fn failed(path: &Path, action: &'static str, source: io::Error) -> DatasetError {
    DatasetError::Io { path: path.display().to_string(), action, source }
}
