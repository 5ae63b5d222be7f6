//! What a part says of itself: key-value metadata in its footer.

use std::collections::BTreeMap;
use std::ops::Range;

use parquet::file::metadata::KeyValue;

use super::folder::{Identity, Manifest, ManifestTable};
use super::seal;
use crate::protocol::Status;

/// The origin of a part. Any part tells what the whole dataset consists of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Footer {
    /// The name of the dataset.
    pub name: String,
    /// The text of the spec.
    pub spec: String,
    /// The hash of the spec.
    pub spec_hash: String,
    /// The version of the program.
    pub version: String,
    /// All tables of the dataset.
    pub tables: Vec<ManifestTable>,
    /// The table.
    pub table: String,
    /// The rows, by global number.
    pub rows: Range<u64>,
}

/// What all keys begin with.
pub const PREFIX: &str = "slipsweep.";

const NAME: &str = "slipsweep.name";
const SPEC: &str = "slipsweep.spec";
const SPEC_HASH: &str = "slipsweep.spec_hash";
const VERSION: &str = "slipsweep.version";
const TABLES: &str = "slipsweep.tables";
const TABLE: &str = "slipsweep.table";
const ROW_START: &str = "slipsweep.row_start";
const ROW_END: &str = "slipsweep.row_end";
const STATUS: &str = "slipsweep.status";

/// Rows by status, in the order of [`Status::ALL`].
pub type StatusCounts = [u64; Status::ALL.len()];

impl Footer {
    /// The footer of `rows` of `table` in the dataset of `manifest`.
    pub fn new(manifest: &Manifest, table: &str, rows: Range<u64>) -> Footer {
        Footer {
            name: manifest.name.clone(),
            spec: manifest.spec.clone(),
            spec_hash: manifest.identity.spec_hash.clone(),
            version: manifest.identity.version.clone(),
            tables: manifest.tables.clone(),
            table: table.to_owned(),
            rows,
        }
    }

    /// As Parquet metadata, with how many of the rows, of these `status`, have which, and the place of the checksum last.
    pub fn entries(&self, status: &[Status]) -> Vec<KeyValue> {
        let mut counts = StatusCounts::default();
        status.iter().for_each(|status| counts[*status as usize] += 1);
        let counts: BTreeMap<&str, u64> = Status::ALL.map(Status::name).into_iter().zip(counts).collect();
        let counts = serde_json::to_string(&counts).unwrap_or_default();
        let tables = serde_json::to_string(&self.tables).unwrap_or_default();
        let entries = [
            (NAME, self.name.clone()),
            (SPEC, self.spec.clone()),
            (SPEC_HASH, self.spec_hash.clone()),
            (VERSION, self.version.clone()),
            (TABLES, tables),
            (TABLE, self.table.clone()),
            (ROW_START, self.rows.start.to_string()),
            (ROW_END, self.rows.end.to_string()),
            (STATUS, counts),
        ];
        let entries = entries.into_iter().map(|(key, value)| KeyValue::new(key.to_owned(), value));
        entries.chain([seal::entry()]).collect()
    }

    /// From Parquet metadata, `None` if anything is missing.
    pub fn from_entries(entries: &[KeyValue]) -> Option<Footer> {
        let get = |key: &str| entries.iter().find(|entry| entry.key == key)?.value.clone();
        Some(Footer {
            name: get(NAME)?,
            spec: get(SPEC)?,
            spec_hash: get(SPEC_HASH)?,
            version: get(VERSION)?,
            tables: serde_json::from_str(&get(TABLES)?).ok()?,
            table: get(TABLE)?,
            rows: get(ROW_START)?.parse().ok()?..get(ROW_END)?.parse().ok()?,
        })
    }

    /// Rows of the part by status, from its Parquet metadata.
    pub fn status_counts(entries: &[KeyValue]) -> Option<StatusCounts> {
        let counts = entries.iter().find(|entry| entry.key == STATUS)?.value.as_ref()?;
        let counts: BTreeMap<String, u64> = serde_json::from_str(counts).ok()?;
        Some(Status::ALL.map(|status| counts.get(status.name()).copied().unwrap_or(0)))
    }

    /// The manifest of the dataset that the part belongs to.
    pub fn manifest(self) -> Manifest {
        let identity = Identity { spec_hash: self.spec_hash, version: self.version };
        Manifest { name: self.name, identity, tables: self.tables, spec: self.spec }
    }
}
