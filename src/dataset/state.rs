//! The state of a part: whether its file is the expected one and intact.

use std::io;
use std::path::Path;

use bytes::Bytes;
use parquet::file::metadata::{KeyValue, ParquetMetaData, ParquetMetaDataReader};
use parquet::file::reader::ChunkReader;

use super::checksum;
use super::folder::Folder;
use super::footer::{Footer, PREFIX};
use super::guard::sound;
use super::manifest::Manifest;
use super::statistics::TableStatistics;
use crate::file;

/// The depth of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CheckDepth {
    /// The footer only: detects truncated and foreign parts.
    Footer,
    /// Every bit, by the checksum.
    Whole,
}

/// The state of a part.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)]
pub enum State {
    /// No file.
    Missing,
    /// The expected part.
    There { statistics: Box<TableStatistics> },
    /// A file of another sweep, version or program, which may be valuable and is never replaced.
    Foreign { why: Foreign },
    /// A damaged part, which a run replaces.
    Damaged { why: String },
}

/// Why a file in the place of a part is not the expected part.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Foreign {
    /// It is a part of slipsweep, but not this one.
    #[error("it belongs to another place, sweep, version or numerics revision")]
    OtherPart,
    /// Another program wrote it, such as a part that a user edited.
    #[error("a Parquet file that slipsweep did not write")]
    OtherProgram,
    /// It is no file.
    #[error("{0}")]
    NotAFile(String),
    /// This user cannot read it; it may be the part.
    #[error("it cannot be read: {0}")]
    Unreadable(String),
}

impl Foreign {
    /// What to do with the file.
    pub(super) fn help(&self) -> &'static str {
        match self {
            Foreign::Unreadable(_) => "give yourself permission to read it",
            _ => "move the file away; `slipsweep run` then computes the part and keeps all others",
        }
    }
}

impl Folder {
    /// The state of a part in the dataset of `manifest`.
    pub fn state(&self, manifest: &Manifest, table: &str, part: u64, look: CheckDepth) -> State {
        let path = &self.part(table, part);
        let found = match look {
            CheckDepth::Footer => sealed_entries(path),
            CheckDepth::Whole => whole(path),
        };
        match found.and_then(|entries| entries.map(|entries| belongs(&entries, manifest, table, part)).transpose()) {
            Ok(Some(statistics)) => State::There { statistics: Box::new(statistics) },
            Ok(None) => State::Missing,
            Err(state) => state,
        }
    }
}

/// The entries of the footer of a file, if footer and page headers are as they were written; `None` if there is no file.
fn sealed_entries(path: &Path) -> Result<Option<Vec<KeyValue>>, State> {
    let Some(file) = there(file::open(path))? else { return Ok(None) };
    let metadata = metadata(&file)?;
    let entries = entries(&metadata);
    match sound(|| checksum::is_head_intact(&file, &metadata)) {
        Ok(Some(true)) => Ok(Some(entries)),
        Ok(None) if Footer::from_entries(&entries).is_none() => foreign(Foreign::OtherProgram),
        Ok(_) => damaged("the checksum of its footer and page headers does not match"),
        Err(error) => damaged(&error.to_string()),
    }
}

/// The footer of a part, if it is intact.
pub fn footer_of(path: &Path) -> Option<Footer> {
    Footer::from_entries(&sealed_entries(path).ok()??)
}

/// The result of opening or reading a file; `None` if there is none.
fn there<T>(read: io::Result<T>) -> Result<Option<T>, State> {
    let error = match read {
        Ok(found) => return Ok(Some(found)),
        Err(error) => error,
    };
    match error.kind() {
        io::ErrorKind::NotFound => Ok(None),
        io::ErrorKind::InvalidInput => foreign(Foreign::NotAFile(error.to_string())),
        io::ErrorKind::PermissionDenied => foreign(Foreign::Unreadable(error.to_string())),
        _ => damaged(&format!("it cannot be read: {error}")),
    }
}

fn whole(path: &Path) -> Result<Option<Vec<KeyValue>>, State> {
    let Some(bytes) = there(file::read(path))? else { return Ok(None) };
    let is_intact = checksum::is_intact(&bytes);
    if is_intact == Some(false) {
        return damaged("its checksum does not match its bytes");
    }
    let entries = entries(&metadata(&Bytes::from(bytes))?);
    // Without a checksum, either it is damaged, or the file is foreign.
    if is_intact.is_none() && entries.iter().any(|entry| entry.key.starts_with(PREFIX)) {
        return damaged("it has no checksum");
    }
    Ok(Some(entries))
}

fn foreign<T>(why: Foreign) -> Result<T, State> {
    Err(State::Foreign { why })
}

fn damaged<T>(why: &str) -> Result<T, State> {
    Err(State::Damaged { why: why.to_owned() })
}

fn metadata(file: &impl ChunkReader) -> Result<ParquetMetaData, State> {
    let read = sound(|| ParquetMetaDataReader::new().parse_and_finish(file));
    read.or_else(|error| damaged(&format!("it is cut short or not Parquet: {error}")))
}

fn entries(metadata: &ParquetMetaData) -> Vec<KeyValue> {
    metadata.file_metadata().key_value_metadata().cloned().unwrap_or_default()
}

/// The statistics in the footer of a file, if it is that of the expected part.
fn belongs(entries: &[KeyValue], manifest: &Manifest, table: &str, part: u64) -> Result<TableStatistics, State> {
    let (Some(found), Some(statistics)) = (Footer::from_entries(entries), Footer::statistics(entries)) else {
        return foreign(Foreign::OtherProgram);
    };
    let is_expected = manifest.table(table).is_some_and(|planned| {
        found.planned() == Some(planned) && found.table == table && found.rows == planned.rows_of(part)
    });
    if is_expected && found.manifest.build == manifest.build { Ok(statistics) } else { foreign(Foreign::OtherPart) }
}
