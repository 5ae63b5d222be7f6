//! Whether a file is the part that should be there.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use parquet::file::metadata::{KeyValue, ParquetMetaDataReader};

use super::claims::check_footer;
use super::folder::Manifest;
use super::footer::{Footer, PREFIX, StatusCounts};
use super::seal;

/// How closely a part is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// Its footer: finds a part that is cut short and one of another origin.
    Footer,
    /// Every bit, by the checksum.
    Whole,
}

/// What is found in the place of a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum State {
    /// Nothing.
    Missing,
    /// The part.
    There {
        /// Its rows by status.
        status: StatusCounts,
    },
    /// Something that was not made from this spec by this version; it may be of use to somebody.
    Foreign {
        /// What it differs in.
        what: &'static str,
        /// What the part has.
        expected: String,
        /// What the file has.
        found: String,
    },
    /// A part that is broken, of no use to anybody.
    Damaged {
        /// In what way.
        why: String,
    },
}

/// Looks at the file in the place of a part, number `part` of `table` in the dataset of `manifest`, which is written in `path`.
pub fn state(path: &Path, manifest: &Manifest, table: &str, part: u64, look: Look) -> State {
    let entries = match look {
        Look::Footer => footer_of(path),
        Look::Whole => whole(path),
    };
    match entries {
        Ok(Some(entries)) => compare(&entries, manifest, table, part),
        Ok(None) => State::Missing,
        Err(state) => state,
    }
}

/// The key-value metadata of a file, without a look at the rest of it.
pub fn footer_of(path: &Path) -> Result<Option<Vec<KeyValue>>, State> {
    match open(path)? {
        Some(file) => metadata(&file).map(Some),
        None => Ok(None),
    }
}

/// The file in `path`. What is no file is not opened: a named pipe would wait for somebody who writes, a device might never end.
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
    match seal::is_intact(&bytes) {
        Some(true) => metadata(&bytes).map(Some),
        Some(false) => damaged("its checksum does not fit its bytes"),
        // Either the checksum is broken, or the file is somebody else's.
        None => match metadata(&bytes) {
            Ok(entries) if !entries.iter().any(|entry| entry.key.starts_with(PREFIX)) => Ok(Some(entries)),
            Ok(_) => damaged("it has no checksum"),
            Err(state) => Err(state),
        },
    }
}

fn unreadable(error: &io::Error) -> String {
    format!("it cannot be read: {error}")
}

/// What no slipsweep made.
fn stranger(found: &str) -> State {
    State::Foreign { what: "program", expected: "a part that slipsweep wrote".to_owned(), found: found.to_owned() }
}

fn damaged<T>(why: &str) -> Result<T, State> {
    Err(State::Damaged { why: why.to_owned() })
}

fn metadata<R: parquet::file::reader::ChunkReader>(file: &R) -> Result<Vec<KeyValue>, State> {
    match check_footer(file).and_then(|()| ParquetMetaDataReader::new().parse_and_finish(file)) {
        Ok(metadata) => Ok(metadata.file_metadata().key_value_metadata().cloned().unwrap_or_default()),
        Err(error) => damaged(&format!("it is cut short or not Parquet: {error}")),
    }
}

/// Compares what a file says of itself with the part that should be there.
fn compare(entries: &[KeyValue], manifest: &Manifest, table: &str, part: u64) -> State {
    let foreign = |what, expected: &str, found: &str| State::Foreign {
        what,
        expected: expected.to_owned(),
        found: found.to_owned(),
    };
    let (Some(found), Some(status)) = (Footer::from_entries(entries), Footer::status_counts(entries)) else {
        return stranger("a Parquet file without its marks");
    };
    let rows = manifest.tables.iter().find(|known| known.name == table).map(|known| known.rows_of(part));
    let expected = &manifest.identity;
    if found.version != expected.version {
        foreign("version", &expected.version, &found.version)
    } else if found.spec_hash != expected.spec_hash {
        foreign("spec", &expected.spec_hash, &found.spec_hash)
    } else if found.table != table {
        foreign("table", table, &found.table)
    } else if Some(&found.rows) != rows.as_ref() {
        let show = |rows: &std::ops::Range<u64>| format!("rows {} to {}", rows.start, rows.end);
        foreign("place in the table", &rows.as_ref().map(show).unwrap_or_default(), &show(&found.rows))
    } else {
        State::There { status }
    }
}
