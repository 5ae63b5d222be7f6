//! What a part says of itself: key-value metadata in its footer.

use std::ops::Range;

use parquet::file::metadata::KeyValue;

/// The origin of a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Footer {
    /// The text of the spec.
    pub spec: String,
    /// The hash of the spec.
    pub spec_hash: String,
    /// The version of the program.
    pub version: String,
    /// The table.
    pub table: String,
    /// The rows, by global number.
    pub rows: Range<u64>,
}

impl Footer {
    /// As Parquet metadata.
    pub fn entries(&self) -> Vec<KeyValue> {
        [
            ("slipsweep.spec", self.spec.clone()),
            ("slipsweep.spec_hash", self.spec_hash.clone()),
            ("slipsweep.version", self.version.clone()),
            ("slipsweep.table", self.table.clone()),
            ("slipsweep.row_start", self.rows.start.to_string()),
            ("slipsweep.row_end", self.rows.end.to_string()),
        ]
        .map(|(key, value)| KeyValue::new(key.to_owned(), value))
        .into()
    }
}
