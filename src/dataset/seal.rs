//! The checksum of a part, kept in its own footer.
//!
//! It is the SHA-256 of all bytes of the file, those of the checksum itself taken as zeros: whoever has the file can check it, and no bit
//! of it, not one of the footer either, can change unnoticed.

use parquet::file::metadata::KeyValue;
use sha2::{Digest, Sha256};

/// The key of the checksum.
const KEY: &str = "slipsweep.sha256";

/// What stands in its place while it is computed: as long as the checksum in hexadecimal digits.
const BLANK: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// What Thrift's compact protocol writes between key and value: the next field, a string, and its length.
const BETWEEN: [u8; 2] = [0x18, BLANK.len() as u8];

/// The entry that a footer needs to be sealed; the last of its entries.
pub fn entry() -> KeyValue {
    KeyValue::new(KEY.to_owned(), BLANK.to_owned())
}

/// Writes the checksum into a finished file whose footer has the [`entry`]. `false` if it has none.
pub fn seal(bytes: &mut [u8]) -> bool {
    let Some(place) = place(bytes) else { return false };
    let checksum = checksum(bytes, place);
    bytes[place..place + BLANK.len()].copy_from_slice(checksum.as_bytes());
    true
}

/// Whether the bytes are those that were sealed; `None` if they bear no seal.
pub fn is_intact(bytes: &[u8]) -> Option<bool> {
    let place = place(bytes)?;
    Some(bytes[place..place + BLANK.len()] == *checksum(bytes, place).as_bytes())
}

/// Where the checksum stands: at the last occurrence of its key, since the text of a spec before it may hold anything.
fn place(bytes: &[u8]) -> Option<usize> {
    let key = bytes.windows(KEY.len()).rposition(|window| window == KEY.as_bytes())?;
    let place = key + KEY.len() + BETWEEN.len();
    let found = bytes.get(key + KEY.len()..place)? == BETWEEN && bytes.len() >= place + BLANK.len();
    found.then_some(place)
}

fn checksum(bytes: &[u8], place: usize) -> String {
    let digest = Sha256::new()
        .chain_update(&bytes[..place])
        .chain_update(BLANK)
        .chain_update(&bytes[place + BLANK.len()..])
        .finalize();
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}
