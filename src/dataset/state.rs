//! The state of a part: whether its file is the expected one and intact.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::file::metadata::{KeyValue, ParquetMetaData, ParquetMetaDataReader};

use super::checksum;
use super::footer::{Footer, PREFIX};
use super::manifest::{Manifest, ManifestTable};
use super::metadata_limits::check_footer;
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
pub enum State {
    /// No file.
    Missing,
    /// The expected part.
    There {
        /// The statistics of its rows.
        statistics: Box<TableStatistics>,
    },
    /// A file of another spec or version, which may be valuable and is never replaced.
    Foreign {
        /// The differing property.
        what: &'static str,
        /// The expected value of the part.
        expected: String,
        /// The value of the file.
        found: String,
    },
    /// A damaged part, which a run replaces.
    Damaged {
        /// The kind of damage.
        why: String,
    },
}

/// An open part, verified to be the expected one.
#[derive(Debug)]
pub struct OpenPart {
    /// Its path.
    pub path: PathBuf,
    /// The file.
    pub file: File,
    /// Its Parquet footer.
    pub metadata: Arc<ParquetMetaData>,
    /// Its footer entries.
    pub footer: Footer,
    /// The statistics of its rows.
    pub statistics: TableStatistics,
}

/// The state of part number `part` of `table` in the dataset of `manifest`, whose file is `path`.
pub fn state(path: &Path, manifest: &Manifest, table: &str, part: u64, look: CheckDepth) -> State {
    let found = match look {
        CheckDepth::Footer => open_part(path, manifest, table, part).map(|part| part.map(|part| part.statistics)),
        CheckDepth::Whole => whole(path).and_then(|entries| {
            entries
                .map(|entries| belongs(&entries, manifest, table, part).map(|(_, statistics)| statistics))
                .transpose()
        }),
    };
    match found {
        Ok(Some(statistics)) => State::There { statistics: Box::new(statistics) },
        Ok(None) => State::Missing,
        Err(state) => state,
    }
}

/// Opens a part if its file is the expected one; `None` if there is no file.
///
/// # Errors
///
/// [`State::Foreign`] or [`State::Damaged`].
pub fn open_part(path: &Path, manifest: &Manifest, table: &str, part: u64) -> Result<Option<OpenPart>, State> {
    let Some(file) = open(path)? else { return Ok(None) };
    let metadata = metadata(&file)?;
    let entries = entries(&metadata);
    match checksum::is_head_intact(&file, &metadata) {
        Ok(Some(true)) => {}
        Ok(None) if Footer::from_entries(&entries).is_none() => {
            return Err(stranger("a Parquet file that slipsweep did not write"));
        }
        Ok(_) => return damaged("the checksum of its footer and page headers does not match"),
        Err(error) => return damaged(&error.to_string()),
    }
    let (footer, statistics) = belongs(&entries, manifest, table, part)?;
    Ok(Some(OpenPart { path: path.to_owned(), file, metadata: metadata.into(), footer, statistics }))
}

/// The footer of a part, if it is intact.
pub fn footer_of(path: &Path) -> Option<Footer> {
    let file = open(path).ok()??;
    let metadata = metadata(&file).ok()?;
    let sound = checksum::is_head_intact(&file, &metadata).ok()??;
    if sound { Footer::from_entries(&entries(&metadata)) } else { None }
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
    match checksum::is_intact(&bytes) {
        Some(true) => metadata(&bytes).map(|metadata| Some(entries(&metadata))),
        Some(false) => damaged("its checksum does not match its bytes"),
        // Either the checksum is damaged, or the file is foreign.
        None => match metadata(&bytes).map(|metadata| entries(&metadata)) {
            Ok(entries) if !entries.iter().any(|entry| entry.key.starts_with(PREFIX)) => Ok(Some(entries)),
            Ok(_) => damaged("it has no checksum"),
            Err(state) => Err(state),
        },
    }
}

fn unreadable(error: &io::Error) -> String {
    format!("it cannot be read: {error}")
}

/// The state of a file of another program.
fn stranger(found: &str) -> State {
    State::Foreign { what: "program", expected: "a part that slipsweep wrote".to_owned(), found: found.to_owned() }
}

fn damaged<T>(why: &str) -> Result<T, State> {
    Err(State::Damaged { why: why.to_owned() })
}

fn metadata<R: parquet::file::reader::ChunkReader>(file: &R) -> Result<ParquetMetaData, State> {
    check_footer(file)
        .and_then(|()| ParquetMetaDataReader::new().parse_and_finish(file))
        .or_else(|error| damaged(&format!("it is cut short or not Parquet: {error}")))
}

fn entries(metadata: &ParquetMetaData) -> Vec<KeyValue> {
    metadata.file_metadata().key_value_metadata().cloned().unwrap_or_default()
}

/// The footer of a file, if it matches the expected part.
fn belongs(
    entries: &[KeyValue],
    manifest: &Manifest,
    table: &str,
    part: u64,
) -> Result<(Footer, TableStatistics), State> {
    let foreign = |what, expected: &str, found: &str| {
        Err(State::Foreign { what, expected: expected.to_owned(), found: found.to_owned() })
    };
    let (Some(found), Some(statistics)) = (Footer::from_entries(entries), Footer::statistics(entries)) else {
        return Err(stranger("a Parquet file that slipsweep did not write"));
    };
    let planned = manifest.table(table);
    let rows = planned.map(|planned| planned.rows_of(part));
    let build = &manifest.build;
    let hash = |table: Option<&ManifestTable>| table.map_or_else(String::new, |table| table.hash.clone());
    if found.build.version != build.version {
        foreign("version", &build.version, &found.build.version)
    } else if found.build.revision != build.revision {
        foreign("numerics revision", &build.revision, &found.build.revision)
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
        Ok((found, statistics))
    }
}
