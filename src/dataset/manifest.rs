//! The manifest of a dataset: its tables, each with the hash of its inputs, and the text of the spec.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::checksum::digits;

/// The build of the program that computes a dataset. Different builds never write to the same dataset.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Build {
    /// Its version.
    pub version: String,
    /// Its numerics revision: a hash of the sources that determine numbers, which may differ between commits of one version.
    pub revision: String,
}

impl Build {
    /// This program.
    pub fn this() -> Build {
        Build { version: env!("CARGO_PKG_VERSION").to_owned(), revision: env!("SLIPSWEEP_REVISION").to_owned() }
    }
}

/// One table of a dataset.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ManifestTable {
    /// Its name, also of its folder.
    pub name: String,
    /// SHA-256 of all inputs of its rows: grid, model, columns and accuracy. It does not depend on comments, spacing, description or other
    /// tables.
    pub hash: String,
    /// Number of rows.
    pub rows: u64,
    /// Number of parts.
    pub parts: u64,
    /// Rows of every part but the last, which may have fewer.
    pub rows_per_part: u64,
}

impl ManifestTable {
    /// The rows of part number `part`; empty if there is no such part, for any contents of a manifest.
    pub fn rows_of(&self, part: u64) -> Range<u64> {
        let start = part.saturating_mul(self.rows_per_part).min(self.rows);
        start..start.saturating_add(self.rows_per_part).min(self.rows)
    }
}

/// `manifest.json`: the contents of the complete dataset. It is written before the first part, and can be derived from the spec or from the
/// parts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// The name of the dataset.
    pub name: String,
    /// The program that computes it.
    #[serde(flatten)]
    pub build: Build,
    /// The tables, in the order of the spec.
    pub tables: Vec<ManifestTable>,
    /// The text of the spec; empty if the manifest is lost and the parts do not contain it.
    pub spec: String,
    /// The reason why the manifest comes from the parts.
    #[serde(skip)]
    pub rebuilt: Option<String>,
}

impl Manifest {
    /// The table of this name.
    pub fn table(&self, name: &str) -> Option<&ManifestTable> {
        self.tables.iter().find(|table| table.name == name)
    }

    /// Whether it contains all tables of `other`, with equal entries and the same build.
    pub fn covers(&self, other: &Manifest) -> bool {
        self.build == other.build && other.tables.iter().all(|table| self.table(&table.name) == Some(table))
    }

    /// The bytes of the file, which depend on the manifest alone. The last entry is the SHA-256 of the other text.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        // A struct of text and numbers always has a JSON.
        let text = serde_json::to_string_pretty(self).unwrap_or_default();
        let checksum = digits(Sha256::new().chain_update(&text));
        let body = text.trim_end_matches("\n}");
        format!("{body},\n  \"sha256\": \"{checksum}\"\n}}\n").into_bytes()
    }

    /// Reads the bytes of the file. Every changed bit is found, since only exactly the written bytes are accepted.
    ///
    /// # Errors
    ///
    /// The kind of damage.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Manifest, String> {
        let manifest: Manifest = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
        if manifest.to_bytes() == bytes { Ok(manifest) } else { Err("its checksum does not match".to_owned()) }
    }
}
