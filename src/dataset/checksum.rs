//! The checksums of a part, stored in its footer.
//!
//! One is the SHA-256 of all bytes of the file, including the footer, so that every changed bit is found. The other is the SHA-256 of the footer
//! and of the page headers, which is checked when a part is opened. The contents of pages have their own checksums (CRC-32), checked when a page
//! is read. During the computation, the checksums themselves count as zeros.

use std::ops::Range;

use bytes::Bytes;
use parquet::errors::{ParquetError, Result};
use parquet::file::FOOTER_SIZE;
use parquet::file::metadata::{FooterTail, KeyValue, ParquetMetaData, ParquetMetaDataReader};
use parquet::file::reader::ChunkReader;
use sha2::{Digest, Sha256};

/// The key of the checksum of footer and headers.
const HEAD_KEY: &str = "slipsweep.head_sha256";

/// The key of the checksum of the file.
const FILE_KEY: &str = "slipsweep.sha256";

/// The placeholder of a checksum during its computation, as long as its hexadecimal digits.
const BLANK: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// Bytes of Thrift's compact protocol between key and value: the header of the next field, a string, and its length.
const KEY_VALUE_SEPARATOR: [u8; 2] = [0x18, BLANK.len() as u8];

/// The entries of a footer that hold the checksums; they must be its last entries.
pub fn entries() -> [KeyValue; 2] {
    [HEAD_KEY, FILE_KEY].map(|key| KeyValue::new(key.to_owned(), BLANK.to_owned()))
}

/// Inserts the checksums into a file whose footer has the [`entries`].
///
/// # Errors
///
/// Bytes that are not a Parquet file with the [`entries`].
pub fn with_checksums(bytes: Vec<u8>) -> Result<Vec<u8>> {
    let bytes = Bytes::from(bytes);
    let metadata = ParquetMetaDataReader::new().parse_and_finish(&bytes)?;
    let head = head(&bytes, &metadata)?;
    let mut bytes = Vec::from(bytes);
    for key in [HEAD_KEY, FILE_KEY] {
        let place = place(&bytes, key).ok_or_else(|| ParquetError::General("no place for a checksum".to_owned()))?;
        let checksum = if key == HEAD_KEY { head.clone() } else { whole(&bytes, place) };
        bytes[place..place + BLANK.len()].copy_from_slice(checksum.as_bytes());
    }
    Ok(bytes)
}

/// Whether the bytes of a file match its checksum; `None` without a checksum.
pub fn is_intact(bytes: &[u8]) -> Option<bool> {
    let place = place(bytes, FILE_KEY)?;
    Some(bytes[place..place + BLANK.len()] == *whole(bytes, place).as_bytes())
}

/// Whether footer and page headers of a file match their checksum; `None` without a checksum.
///
/// # Errors
///
/// If they cannot be read.
pub fn is_head_intact(file: &impl ChunkReader, metadata: &ParquetMetaData) -> Result<Option<bool>> {
    let entries = metadata.file_metadata().key_value_metadata().into_iter().flatten();
    let Some(stored) = entries.filter(|entry| entry.key == HEAD_KEY).find_map(|entry| entry.value.as_ref()) else {
        // A flipped bit may hide the entries of a footer, although its bytes still contain them.
        let footer = footer(file)?;
        return Ok([HEAD_KEY, FILE_KEY].iter().any(|key| place(&footer, key).is_some()).then_some(false));
    };
    Ok(Some(*stored == head(file, metadata)?))
}

/// The bytes of the footer with its length and `PAR1`.
fn footer(file: &impl ChunkReader) -> Result<Vec<u8>> {
    let length = |end: u64, length: usize| end.checked_sub(length as u64).ok_or_else(|| damaged("footer"));
    let end = length(file.len(), FOOTER_SIZE)?;
    let tail = FooterTail::try_from(&file.get_bytes(end, FOOTER_SIZE)?[..])?;
    let start = length(end, tail.metadata_length())?;
    Ok(file.get_bytes(start, tail.metadata_length() + FOOTER_SIZE)?.to_vec())
}

/// The checksum of the page headers, in order, and of the footer.
fn head(file: &impl ChunkReader, metadata: &ParquetMetaData) -> Result<String> {
    let mut hash = Sha256::new();
    for chunk in metadata.row_groups().iter().flat_map(|group| group.columns()) {
        let (start, length) = chunk.byte_range();
        let data = u64::try_from(chunk.data_page_offset()).map_err(|_| damaged("list of columns"))?;
        let dictionary = chunk.dictionary_page_offset().map(|_| start..data);
        for page in dictionary.into_iter().chain(Some(data..start.saturating_add(length))) {
            hash.update(page_header(file, page)?);
        }
    }
    let mut footer = footer(file)?;
    for key in [HEAD_KEY, FILE_KEY] {
        if let Some(place) = place(&footer, key) {
            footer[place..place + BLANK.len()].copy_from_slice(BLANK.as_bytes());
        }
    }
    hash.update(&footer);
    Ok(digits(hash))
}

/// Greatest size of the header of a page of a part, in bytes: 52 at most, see `chunk::add_page`.
const MAX_HEADER_BYTES: u64 = 64;

/// The header of a page of a part: the bytes before its content.
fn page_header(file: &impl ChunkReader, page: Range<u64>) -> Result<Bytes> {
    let length = page.end.checked_sub(page.start).ok_or_else(|| damaged("list of columns"))?;
    let bytes = file.get_bytes(page.start, length.min(MAX_HEADER_BYTES) as usize)?;
    // Every field is a byte and an integer in groups of seven bits. The third one is the size of the content, with the sign in the lowest bit.
    let content = bytes.split_inclusive(|byte| *byte < 0x80).nth(5);
    let content =
        content.map(|digits| digits.iter().rev().fold(0, |size, digit| size << 7 | u64::from(digit & 0x7f)) >> 1);
    let header = content.and_then(|content| length.checked_sub(content)).filter(|header| *header <= bytes.len() as u64);
    header.map(|header| bytes.slice(..header as usize)).ok_or_else(|| damaged("page header"))
}

fn damaged(what: &str) -> ParquetError {
    ParquetError::General(format!("its {what} is damaged"))
}

/// The offset of the checksum of a key: its last occurrence, since the spec before it may contain anything.
fn place(bytes: &[u8], key: &str) -> Option<usize> {
    let key_at = bytes.windows(key.len()).rposition(|window| window == key.as_bytes())?;
    let place = key_at + key.len() + KEY_VALUE_SEPARATOR.len();
    let found = bytes.get(key_at + key.len()..place)? == KEY_VALUE_SEPARATOR && bytes.len() >= place + BLANK.len();
    found.then_some(place)
}

/// The checksum of a file that stores it at `place`.
fn whole(bytes: &[u8], place: usize) -> String {
    let hash = Sha256::new().chain_update(&bytes[..place]).chain_update(BLANK);
    digits(hash.chain_update(&bytes[place + BLANK.len()..]))
}

/// A checksum in hexadecimal digits.
pub fn digits(hash: Sha256) -> String {
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
