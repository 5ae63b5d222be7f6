//! The state of a part: whether its file is the expected one and intact.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use parquet::file::metadata::{KeyValue, ParquetMetaData};

use super::checksum;
use super::footer::{Footer, PREFIX};
use super::manifest::{Manifest, ManifestTable};
use super::metadata_limits;
use super::statistics::TableStatistics;

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
    /// A file of another spec or version, which may be valuable and is never replaced.
    Foreign { what: &'static str, expected: String, found: String },
    /// A damaged part, which a run replaces.
    Damaged { why: String },
}

/// The state of part number `part` of `table` in the dataset of `manifest`, whose file is `path`.
pub fn state(path: &Path, manifest: &Manifest, table: &str, part: u64, look: CheckDepth) -> State {
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

/// The entries of the footer of a file, if footer and page headers are as they were written; `None` if there is no file.
fn sealed_entries(path: &Path) -> Result<Option<Vec<KeyValue>>, State> {
    let Some(file) = open(path)? else { return Ok(None) };
    let metadata = metadata(&file)?;
    let entries = entries(&metadata);
    match checksum::is_head_intact(&file, &metadata) {
        Ok(Some(true)) => Ok(Some(entries)),
        Ok(None) if Footer::from_entries(&entries).is_none() => {
            Err(stranger("a Parquet file that slipsweep did not write"))
        }
        Ok(_) => damaged("the checksum of its footer and page headers does not match"),
        Err(error) => damaged(&error.to_string()),
    }
}

/// The footer of a part, if it is intact.
pub fn footer_of(path: &Path) -> Option<Footer> {
    Footer::from_entries(&sealed_entries(path).ok()??)
}

/// Opens the file in `path`. Only plain files are opened: a named pipe would wait for a writer, and a device might never end.
fn open(path: &Path) -> Result<Option<File>, State> {
    let opened = fs::metadata(path).and_then(|metadata| match metadata.file_type() {
        kind if kind.is_file() => File::open(path).map(Ok),
        kind if kind.is_dir() => Ok(Err("a folder")),
        _ => Ok(Err("a device, a named pipe or the like")),
    });
    match opened {
        Ok(Ok(file)) => Ok(Some(file)),
        Ok(Err(found)) => Err(stranger(found)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        // It may be intact.
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
            let expected = "a file that this user can read".to_owned();
            Err(State::Foreign { what: "user", expected, found: error.to_string() })
        }
        Err(error) => damaged(&unreadable(&error)),
    }
}

fn whole(path: &Path) -> Result<Option<Vec<KeyValue>>, State> {
    let Some(mut file) = open(path)? else { return Ok(None) };
    let mut bytes = Vec::new();
    if let Err(error) = file.read_to_end(&mut bytes) {
        return damaged(&unreadable(&error));
    }
    let bytes = bytes::Bytes::from(bytes);
    let is_intact = checksum::is_intact(&bytes);
    if is_intact == Some(false) {
        return damaged("its checksum does not match its bytes");
    }
    let entries = entries(&metadata(&bytes)?);
    // Without a checksum, either it is damaged, or the file is foreign.
    if is_intact.is_none() && entries.iter().any(|entry| entry.key.starts_with(PREFIX)) {
        return damaged("it has no checksum");
    }
    Ok(Some(entries))
}

fn unreadable(error: &io::Error) -> String {
    format!("it cannot be read: {error}")
}

/// What is foreign about a file of another program, such as a part that a user edited.
pub const PROGRAM: &str = "program";

/// The state of a file of another program.
fn stranger(found: &str) -> State {
    State::Foreign { what: PROGRAM, expected: "a part that slipsweep wrote".to_owned(), found: found.to_owned() }
}

fn damaged<T>(why: &str) -> Result<T, State> {
    Err(State::Damaged { why: why.to_owned() })
}

fn metadata<R: parquet::file::reader::ChunkReader>(file: &R) -> Result<ParquetMetaData, State> {
    metadata_limits::footer(file).or_else(|error| damaged(&format!("it is cut short or not Parquet: {error}")))
}

fn entries(metadata: &ParquetMetaData) -> Vec<KeyValue> {
    metadata.file_metadata().key_value_metadata().cloned().unwrap_or_default()
}

/// The statistics in the footer of a file, if it is that of the expected part.
fn belongs(entries: &[KeyValue], manifest: &Manifest, table: &str, part: u64) -> Result<TableStatistics, State> {
    let foreign = |what, expected: &str, found: &str| {
        Err(State::Foreign { what, expected: expected.to_owned(), found: found.to_owned() })
    };
    let (Some(found), Some(statistics)) = (Footer::from_entries(entries), Footer::statistics(entries)) else {
        return Err(stranger("a Parquet file that slipsweep did not write"));
    };
    let planned = manifest.table(table);
    let rows = planned.map(|planned| planned.rows_of(part));
    let hash = |table: Option<&ManifestTable>| table.map_or_else(String::new, |table| table.hash.clone());
    if let Some((what, expected, found)) = manifest.build.difference(&found.manifest.build) {
        foreign(what, expected, found)
    } else if found.table != table {
        foreign("table", table, &found.table)
    } else if hash(found.planned()) != hash(planned) {
        foreign("spec", &hash(planned), &hash(found.planned()))
    } else if found.planned() != planned {
        let show = |table: &ManifestTable| format!("{} rows in {} parts", table.rows, table.parts);
        let [planned, found] = [planned, found.planned()].map(|table| table.map(show).unwrap_or_default());
        foreign("plan", &planned, &found)
    } else if Some(&found.rows) != rows.as_ref() {
        let show = |rows: &std::ops::Range<u64>| format!("rows {} to {}", rows.start, rows.end);
        foreign("place in the table", &rows.as_ref().map(show).unwrap_or_default(), &show(&found.rows))
    } else {
        Ok(statistics)
    }
}
