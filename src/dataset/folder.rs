//! The folder of a dataset: `<name>/manifest.json` and `<name>/<table>/part-000000.parquet`.

use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::atomic;

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
    /// The rows of part number `part`.
    pub fn rows_of(&self, part: u64) -> Range<u64> {
        let start = part * self.rows_per_part;
        start..(start + self.rows_per_part).min(self.rows)
    }
}

/// `manifest.json`: what the finished dataset consists of. It is there before the first part.
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
    /// The manifest cannot be understood.
    #[error("{path}: not a manifest: {source}\n  help: delete the folder, or write elsewhere with --out DIR")]
    Manifest {
        /// The file.
        path: String,
        /// Why.
        source: serde_json::Error,
    },
    /// The system refused.
    #[error("{path}: cannot {action}: {source}\n  help: write elsewhere with --out DIR")]
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
        match fs::read(&path) {
            Ok(bytes) => serde_json::from_slice(&bytes)
                .map(Some)
                .map_err(|source| DatasetError::Manifest { path: path.display().to_string(), source }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(failed(&path, "read", error)),
        }
    }

    /// Makes the folder ready for the parts of `manifest`, or refuses if it belongs to something else.
    pub fn open(&self, manifest: &Manifest) -> Result<(), DatasetError> {
        match self.manifest()? {
            Some(found) => self.compare(manifest, &found)?,
            None => {
                let occupied = fs::read_dir(&self.path).is_ok_and(|entries| {
                    entries.flatten().any(|entry| !entry.file_name().to_string_lossy().starts_with('.'))
                });
                if occupied {
                    return Err(DatasetError::Occupied { folder: self.path.display().to_string() });
                }
            }
        }
        fs::create_dir_all(&self.path).map_err(|error| failed(&self.path, "create the folder", error))?;
        let path = self.path.join("manifest.json");
        let mut text = serde_json::to_vec_pretty(manifest)
            .map_err(|source| DatasetError::Manifest { path: path.display().to_string(), source })?;
        text.push(b'\n');
        atomic::write(&path, &text).map_err(|error| failed(&path, "write", error))?;
        for table in &manifest.tables {
            let folder = self.path.join(&table.name);
            fs::create_dir_all(&folder).map_err(|error| failed(&folder, "create the folder", error))?;
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

    /// Whether a part is finished. A part has its name only once it is whole.
    pub fn has_part(&self, table: &str, part: u64) -> bool {
        self.part(table, part).is_file()
    }

    /// Writes a part, whole or not at all.
    pub fn write_part(&self, table: &str, part: u64, bytes: &[u8]) -> Result<(), DatasetError> {
        let path = self.part(table, part);
        atomic::write(&path, bytes).map_err(|error| failed(&path, "write", error))
    }
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

fn failed(path: &Path, action: &'static str, source: io::Error) -> DatasetError {
    DatasetError::Io { path: path.display().to_string(), action, source }
}
