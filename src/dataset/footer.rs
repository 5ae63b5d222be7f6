//! The footer of a part: key-value metadata.

use std::ops::Range;

use parquet::file::metadata::KeyValue;

use super::checksum;
use super::manifest::{Build, Manifest, ManifestTable};
use super::statistics::TableStatistics;
use crate::protocol::Status;

/// Greatest size of a spec in the footer of a part, in bytes. Chosen: a fortieth of a part of 2^18 landscape rows. Only the manifest contains a longer
/// spec; the hash of the table identifies it.
const MAX_SPEC_BYTES: usize = 1 << 16;

/// The origin of a part. Every part describes the whole dataset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Footer {
    /// The manifest of the dataset; read from a part, its spec is empty if it is too long for a footer.
    pub manifest: Manifest,
    /// The table.
    pub table: String,
    /// The rows, by global number.
    pub rows: Range<u64>,
}

/// The prefix of all keys.
pub const PREFIX: &str = "slipsweep.";

const NAME: &str = "slipsweep.name";
const SPEC: &str = "slipsweep.spec";
const VERSION: &str = "slipsweep.version";
const REVISION: &str = "slipsweep.revision";
const TABLES: &str = "slipsweep.tables";
const TABLE: &str = "slipsweep.table";
const HASH: &str = "slipsweep.hash";
const ROW_START: &str = "slipsweep.row_start";
const ROW_END: &str = "slipsweep.row_end";
const STATISTICS: &str = "slipsweep.statistics";

/// Rows by status, in the order of [`Status::ALL`].
pub type StatusCounts = [u64; Status::ALL.len()];

impl Footer {
    /// The footer of `rows` of `table` in the dataset of `manifest`.
    pub fn new(manifest: &Manifest, table: &str, rows: Range<u64>) -> Footer {
        Footer { manifest: manifest.clone(), table: table.to_owned(), rows }
    }

    /// The footer as Parquet metadata, with the statistics of the rows. The entries of the checksums follow.
    pub fn entries(&self, statistics: &TableStatistics) -> Vec<KeyValue> {
        let Manifest { name, build, tables, spec, .. } = &self.manifest;
        let tables = serde_json::to_string(tables).unwrap_or_default();
        let entries = [
            (NAME, name.clone()),
            (VERSION, build.version.clone()),
            (REVISION, build.revision.clone()),
            (TABLES, tables),
            (TABLE, self.table.clone()),
            (HASH, self.planned().map_or_else(String::new, |table| table.hash.clone())),
            (ROW_START, self.rows.start.to_string()),
            (ROW_END, self.rows.end.to_string()),
            (STATISTICS, serde_json::to_string(statistics).unwrap_or_default()),
        ];
        let spec = (spec.len() <= MAX_SPEC_BYTES).then(|| (SPEC, spec.clone()));
        let entries = spec.into_iter().chain(entries).map(|(key, value)| KeyValue::new(key.to_owned(), value));
        entries.chain(checksum::entries()).collect()
    }

    /// Reads the footer from Parquet metadata; `None` if an entry is missing.
    pub fn from_entries(entries: &[KeyValue]) -> Option<Footer> {
        let get = |key: &str| entries.iter().find(|entry| entry.key == key)?.value.clone();
        let manifest = Manifest {
            name: get(NAME)?,
            build: Build { version: get(VERSION)?, revision: get(REVISION)? },
            tables: serde_json::from_str(&get(TABLES)?).ok()?,
            spec: get(SPEC).unwrap_or_default(),
            rebuilt: None,
        };
        Some(Footer { manifest, table: get(TABLE)?, rows: get(ROW_START)?.parse().ok()?..get(ROW_END)?.parse().ok()? })
    }

    /// The statistics of the rows of the part, from its Parquet metadata.
    pub fn statistics(entries: &[KeyValue]) -> Option<TableStatistics> {
        let entry = entries.iter().find(|entry| entry.key == STATISTICS)?;
        serde_json::from_str(entry.value.as_deref()?).ok()
    }

    /// Its table in the manifest of the dataset.
    pub fn planned(&self) -> Option<&ManifestTable> {
        self.manifest.table(&self.table)
    }
}
