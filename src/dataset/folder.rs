//! The folder of a dataset: `<name>/manifest.json` and `<name>/<table>/part-000000.parquet`.

use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};

use super::atomic::{self, Unwritten};
use super::footer::Footer;
use super::state::{self, Look, State};

/// What a dataset was made from: parts of different identity never share a folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// SHA-256 of the checked spec: comments, spacing and description do not enter it.
    pub spec_hash: String,
    /// Version of the program.
    pub version: String,
}

/// One table of a dataset.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ManifestTable {
    /// Its name, also of its folder.
    pub name: String,
    /// All its rows.
    pub rows: u64,
    /// Its parts.
    pub parts: u64,
    /// Rows of every part but the last, which may have fewer.
    pub rows_per_part: u64,
}

impl ManifestTable {
    /// The rows of part number `part`; none if there is no such part, whatever a manifest claims.
    pub fn rows_of(&self, part: u64) -> Range<u64> {
        let start = part.saturating_mul(self.rows_per_part).min(self.rows);
        start..start.saturating_add(self.rows_per_part).min(self.rows)
    }
}

/// `manifest.json`: what the finished dataset consists of. It is there before the first part, and follows from the spec as well as from any
/// part, so that nobody has to guard it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// The name of the dataset.
    pub name: String,
    /// What it was made from.
    #[serde(flatten)]
    pub identity: Identity,
    /// The tables, in the order of the spec.
    pub tables: Vec<ManifestTable>,
    /// The text of the spec.
    pub spec: String,
}

/// What can go wrong with the files of a dataset.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// The folder holds a dataset of another spec or version.
    #[error(
        "{folder}: holds a dataset of another {what}\n  expected: {expected}\n  found: {found}\n  help: delete the folder, or write \
         elsewhere with --out DIR"
    )]
    Foreign {
        /// The folder.
        folder: String,
        /// `spec` or `version`.
        what: &'static str,
        /// What this run has.
        expected: String,
        /// What the folder has.
        found: String,
    },
    /// The folder holds something else.
    #[error(
        "{folder}: not a dataset, but not empty either\n  expected: an empty folder, or one with a manifest.json\n  help: change \
         `name` in the spec, or write elsewhere with --out DIR"
    )]
    Occupied {
        /// The folder.
        folder: String,
    },
    /// A file in the place of a part was not made by this sweep.
    #[error(
        "{path}: belongs to another {what}\n  expected: {expected}\n  found: {found}\n  help: move the file away, or delete it; the same \
         command then makes the part and keeps all others"
    )]
    ForeignPart {
        /// The file.
        path: String,
        /// In what it differs.
        what: &'static str,
        /// What the part has.
        expected: String,
        /// What the file has.
        found: String,
    },
    /// The manifest cannot be understood.
    #[error("{path}: not a manifest: {source}\n  help: delete the file; the next run makes it again")]
    Manifest {
        /// The file.
        path: String,
        /// Why.
        source: serde_json::Error,
    },
    /// The system refused.
    #[error(
        "{path}: cannot {action}: {source}\n  help: mend that, then run the same command again, which keeps what is finished; or write \
         elsewhere with --out DIR"
    )]
    Io {
        /// The file or folder.
        path: String,
        /// What was tried.
        action: &'static str,
        /// Why not.
        source: io::Error,
    },
    /// A sample of a table could not be encoded.
    #[error("cannot encode a sample: {0}")]
    Sample(parquet::errors::ParquetError),
    /// A part could not be encoded.
    #[error("{path}: cannot encode: {source}")]
    Encode {
        /// The part.
        path: String,
        /// Why not.
        source: parquet::errors::ParquetError,
    },
}

impl DatasetError {
    /// Part number `part` of `table` could not be encoded.
    pub fn encode(folder: &Folder, table: &str, part: u64, source: parquet::errors::ParquetError) -> DatasetError {
        DatasetError::Encode { path: folder.part(table, part).display().to_string(), source }
    }
}

/// The folder of one dataset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Folder {
    path: PathBuf,
}

impl Folder {
    /// The folder of the dataset `name` in `out`; nothing is touched yet.
    pub fn new(out: &Path, name: &str) -> Folder {
        Folder { path: out.join(name) }
    }

    /// The dataset in `path`.
    pub fn at(path: &Path) -> Folder {
        Folder { path: path.to_owned() }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where a part is or will be.
    pub fn part(&self, table: &str, part: u64) -> PathBuf {
        self.path.join(table).join(format!("part-{part:06}.parquet"))
    }

    /// The manifest, if there is one.
    pub fn manifest(&self) -> Result<Option<Manifest>, DatasetError> {
        let path = self.path.join("manifest.json");
        let read = fs::metadata(&path).and_then(|metadata| {
            // Reading a named pipe would wait for somebody who writes, and a device might never end.
            if metadata.is_file() { fs::read(&path) } else { Err(io::Error::other("it is not a file")) }
        });
        match read {
            Ok(bytes) => serde_json::from_slice(&bytes)
                .map(Some)
                .map_err(|source| DatasetError::Manifest { path: path.display().to_string(), source }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(failed(&path, "read", error)),
        }
    }

    /// The manifest as the parts tell it, if there is a part that can be read.
    pub fn manifest_of_parts(&self) -> Option<Manifest> {
        let is_part = |path: &Path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with("part-") && name.ends_with(".parquet")
        };
        let parts = sorted(&self.path, Path::is_dir).into_iter().flat_map(|table| sorted(&table, is_part));
        let mut footers = parts.filter_map(|part| Footer::from_entries(&state::footer_of(&part).ok()??));
        footers.next().map(Footer::manifest)
    }

    /// Makes the folder ready for the parts of `manifest`, or refuses if it belongs to something else.
    pub fn open(&self, manifest: &Manifest) -> Result<(), DatasetError> {
        let mut found = self.manifest()?;
        let occupied = found.is_none()
            && fs::read_dir(&self.path).is_ok_and(|entries| {
                entries.flatten().any(|entry| !entry.file_name().to_string_lossy().starts_with('.'))
            });
        if occupied {
            // Another run may have published its manifest, the first file with a name, a moment ago.
            found = self.manifest()?;
        }
        match found.clone().or_else(|| self.manifest_of_parts()) {
            Some(found) => self.compare(manifest, &found)?,
            None if occupied => {
                return Err(DatasetError::Occupied { folder: self.path.display().to_string() });
            }
            None => {}
        }
        let create =
            |folder: &Path| atomic::create_folder(folder).map_err(|error| failed(folder, "create the folder", error));
        create(&self.path)?;
        // Thousands of shards find it as it should be: none of them needs to write it again.
        if found.as_ref() != Some(manifest) {
            let path = self.path.join("manifest.json");
            let mut text = serde_json::to_vec_pretty(manifest)
                .map_err(|source| DatasetError::Manifest { path: path.display().to_string(), source })?;
            text.push(b'\n');
            atomic::write(&path, &text).map_err(|error| unwritten(&path, error))?;
        }
        let now = SystemTime::now();
        atomic::sweep(&self.path, now);
        for table in &manifest.tables {
            let folder = self.path.join(&table.name);
            create(&folder)?;
            atomic::sweep(&folder, now);
        }
        Ok(())
    }

    fn compare(&self, expected: &Manifest, found: &Manifest) -> Result<(), DatasetError> {
        let foreign = |what, expected: &str, found: &str| DatasetError::Foreign {
            folder: self.path.display().to_string(),
            what,
            expected: expected.to_owned(),
            found: found.to_owned(),
        };
        let (here, there) = (&expected.identity, &found.identity);
        if here.version != there.version {
            return Err(foreign("version", &here.version, &there.version));
        }
        if here.spec_hash != there.spec_hash {
            return Err(match first_difference(&expected.spec, &found.spec) {
                Some([here, there]) => foreign("spec", &here, &there),
                // What a spec refers to differs.
                None => foreign("spec", &here.spec_hash, &there.spec_hash),
            });
        }
        Ok(())
    }

    /// The numbers of the parts of `table` in whose place there is something, ascending. One look at the folder tells, so that parts
    /// that are missing cost nothing, however many.
    pub fn parts_there(&self, table: &ManifestTable) -> Vec<u64> {
        let entries = fs::read_dir(self.path.join(&table.name)).into_iter().flatten().flatten();
        let mut parts: Vec<u64> = entries.filter_map(|entry| self.part_at(table, &entry.path())).collect();
        parts.sort_unstable();
        parts
    }

    /// Whether there is a file in the place of a part; [`Folder::state`] tells what it is.
    pub fn has_part(&self, table: &str, part: u64) -> bool {
        self.part(table, part).is_file()
    }

    /// What is in the place of a part of the dataset of `manifest`.
    pub fn state(&self, manifest: &Manifest, table: &str, part: u64, look: Look) -> State {
        state::state(&self.part(table, part), manifest, table, part, look)
    }

    /// Writes a part, whole or not at all.
    pub fn write_part(&self, table: &str, part: u64, bytes: &[u8]) -> Result<(), DatasetError> {
        let path = self.part(table, part);
        atomic::write(&path, bytes).map_err(|error| unwritten(&path, error))
    }

    /// Files below the folder that are no part of the dataset of `manifest`, and whether they are temporary files of a run.
    pub fn strays(&self, manifest: &Manifest) -> Vec<(PathBuf, bool)> {
        let mut strays = Vec::new();
        for path in sorted(&self.path, |_| true) {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            match manifest.tables.iter().find(|table| table.name == name) {
                Some(table) if path.is_dir() => {
                    strays.extend(sorted(&path, |path| self.part_at(table, path).is_none()));
                }
                _ if name == "manifest.json" => {}
                _ => strays.push(path),
            }
        }
        let is_temporary = |path: &Path| atomic::is_temporary(&path.file_name().unwrap_or_default().to_string_lossy());
        strays.into_iter().map(|path| (is_temporary(&path), path)).map(|(temporary, path)| (path, temporary)).collect()
    }

    /// The number of the part of `table` whose place `path` is.
    fn part_at(&self, table: &ManifestTable, path: &Path) -> Option<u64> {
        let name = path.file_name()?.to_string_lossy();
        let part = name.strip_prefix("part-")?.strip_suffix(".parquet")?.parse().ok()?;
        (part < table.parts && self.part(&table.name, part) == path).then_some(part)
    }
}

/// What is `wanted` of what is in a folder, in the order of names; nothing if it cannot be read.
fn sorted(folder: &Path, wanted: impl Fn(&Path) -> bool) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| wanted(path)).collect();
    paths.sort();
    paths
}

/// The first lines in which two specs differ, blank lines and comments aside, each with its number.
fn first_difference(here: &str, there: &str) -> Option<[String; 2]> {
    fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
        let bare = text.lines().map(|line| line.split(" #").next().unwrap_or(line).trim());
        (1..).zip(bare).filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
    }
    let show = |line: Option<(usize, &str)>| match line {
        Some((number, line)) => format!("`{line}` (line {number})"),
        None => "nothing more".to_owned(),
    };
    let (mut here, mut there) = (lines(here), lines(there));
    loop {
        let pair = [here.next(), there.next()];
        if pair.iter().all(Option::is_none) {
            return None;
        }
        if pair[0].map(|(_, line)| line) != pair[1].map(|(_, line)| line) {
            return Some(pair.map(show));
        }
    }
}

fn unwritten(path: &Path, Unwritten { action, source }: Unwritten) -> DatasetError {
    failed(path, action, source)
}

fn failed(path: &Path, action: &'static str, source: io::Error) -> DatasetError {
    DatasetError::Io { path: path.display().to_string(), action, source }
}
