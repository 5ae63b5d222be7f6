//! Limits on the metadata of a Parquet file, checked before its reader allocates: a few bytes can claim gigabytes.
//!
//! Footers and page headers are structs of Thrift's compact protocol. The walk does not need to know all of their fields: no list may be longer
//! than the remaining bytes, and only numbers that determine an allocation are checked. The reader expects the field types of the Parquet format
//! whatever the file states, so both must agree.

use std::fs::File;
use std::sync::Arc;

use arrow_schema::{DataType, FieldRef, Fields, Schema};
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use parquet::errors::ParquetError;
use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataReader};
use parquet::file::reader::ChunkReader;

use super::guard::guarded;
use super::layout::label;

/// Greatest size of a footer, in bytes.
const MOST_OF_FOOTER: usize = 1 << 24;
/// Greatest size of a page header, in bytes.
const MOST_OF_HEADER: usize = 1 << 16;
/// Greatest size of a decompressed page, in bytes: more than four million doubles.
const MOST_OF_PAGE: i64 = 40 << 20;
/// Greatest number of values of a page or of a dictionary.
const MOST_VALUES: i64 = 1 << 22;
/// The checked metadata of a Parquet file. Words are read as codes, from any writer.
///
/// Type hints of Arrow or pandas are ignored: the type of a column is that of Parquet.
pub(crate) fn coded(file: &File) -> Result<ArrowReaderMetadata, ParquetError> {
    check_footer(file)?;
    let plain = ArrowReaderMetadata::load(file, ArrowReaderOptions::new().with_skip_arrow_metadata(true))?;
    check_pages(file, plain.metadata())?;
    let coded = |field: &FieldRef| match field.data_type() {
        DataType::Utf8 => Arc::new(field.as_ref().clone().with_data_type(label())),
        _ => field.clone(),
    };
    let schema: Fields = plain.schema().fields().iter().map(coded).collect();
    let options = ArrowReaderOptions::new().with_schema(Arc::new(Schema::new(schema)));
    ArrowReaderMetadata::try_new(plain.metadata().clone(), options)
}

/// The checked footer of a Parquet file.
///
/// # Errors
///
/// A footer that is damaged or too large.
pub fn footer(file: &impl ChunkReader) -> Result<ParquetMetaData, ParquetError> {
    check_footer(file)?;
    guarded(|| ParquetMetaDataReader::new().parse_and_finish(file)).unwrap_or_else(|| Err(damaged("footer")))
}

/// Checks that the lists of the footer, if any, are as long as stated.
///
/// # Errors
///
/// A footer that is damaged or too large.
pub fn check_footer(file: &impl ChunkReader) -> Result<(), ParquetError> {
    const TRAILER: u64 = 8;
    let Some(before) = file.len().checked_sub(TRAILER) else { return Ok(()) };
    let trailer = file.get_bytes(before, TRAILER as usize)?;
    let [a, b, c, d, b'P', b'A', b'R', b'1'] = trailer[..] else { return Ok(()) };
    let length = u32::from_le_bytes([a, b, c, d]) as usize;
    let Some(start) = before.checked_sub(length as u64) else { return Ok(()) };
    if length > MOST_OF_FOOTER {
        return Err(excess("a footer", length as i64, MOST_OF_FOOTER as i64, "bytes"));
    }
    let footer = file.get_bytes(start, length)?;
    let (mut elements, mut limits) = (0, Ok(()));
    let end = walk(&footer, &mut |path, value| match path {
        [2] => elements = value,
        [2, 5] if !(0..=elements).contains(&value) => limits = Err(excess("a node", value, elements, "children")),
        _ => {}
    });
    end.ok_or_else(|| damaged("footer")).and(limits)
}

/// Checks that no page exceeds the limits, and that the decoded length of every page is known in advance.
///
/// # Errors
///
/// A header of a page that is damaged or too large.
pub fn check_pages(file: &impl ChunkReader, metadata: &ParquetMetaData) -> Result<(), ParquetError> {
    page_headers(file, metadata, |_| {})
}

/// Checks the pages, and passes the header of each to `visit`.
///
/// # Errors
///
/// A header of a page that is damaged or too large.
pub fn page_headers(
    file: &impl ChunkReader,
    metadata: &ParquetMetaData,
    mut visit: impl FnMut(&[u8]),
) -> Result<(), ParquetError> {
    for chunk in metadata.row_groups().iter().flat_map(|group| group.columns()) {
        let start = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset());
        let (Ok(mut at), Ok(length)) = (u64::try_from(start), u64::try_from(chunk.compressed_size())) else {
            return Err(damaged("list of columns"));
        };
        let end = at.checked_add(length).filter(|&end| end <= file.len()).ok_or_else(|| damaged("list of columns"))?;
        while at < end {
            let left = usize::try_from(end - at).unwrap_or(usize::MAX).min(MOST_OF_HEADER);
            // Headers are short, except if the least and greatest values are long words.
            let mut bytes = file.get_bytes(at, left.min(256))?;
            let mut page = check_page(&bytes)?;
            if page.is_none() {
                bytes = file.get_bytes(at, left)?;
                page = check_page(&bytes)?;
            }
            let (header, page) = page.ok_or_else(|| damaged("page header"))?;
            visit(bytes.get(..header).unwrap_or_default());
            at += page;
        }
    }
    Ok(())
}

/// The length of a header, and of header and page together; `None` if the header extends beyond `bytes`.
fn check_page(bytes: &[u8]) -> Result<Option<(usize, u64)>, ParquetError> {
    let (mut compressed, mut limits) = (None, Ok(()));
    let header = walk(bytes, &mut |path, value| match path {
        [2] if value > MOST_OF_PAGE => limits = Err(excess("a page", value, MOST_OF_PAGE, "bytes")),
        [3] => compressed = u64::try_from(value).ok(),
        [5 | 7 | 8, 1] if value > MOST_VALUES => limits = Err(excess("a page", value, MOST_VALUES, "values")),
        [5 | 7, 2] | [8, 4] if matches!(value, 6 | 7) => {
            limits = Err(ParquetError::General("words are encoded as differences".to_owned()));
        }
        _ => {}
    });
    let Some(header) = header else { return Ok(None) };
    let compressed = compressed.ok_or_else(|| damaged("page header"))?;
    limits.map(|()| (header as u64).checked_add(compressed).map(|page| (header, page)))
}

fn excess(what: &str, found: i64, most: i64, unit: &str) -> ParquetError {
    ParquetError::General(format!("{what} of {found} {unit}, where {most} are possible"))
}

fn damaged(what: &str) -> ParquetError {
    ParquetError::General(format!("its {what} is damaged"))
}

/// Walks the struct that `bytes` begin with and passes every integer in it to `visit`, and the length of every
/// list, each with the numbers of the fields that lead there. Returns the length of the struct; `None` if it is damaged
/// or goes on beyond `bytes`.
fn walk(bytes: &[u8], visit: &mut dyn FnMut(&[i16], i64)) -> Option<usize> {
    let mut walker = Walker { bytes, at: 0, path: Vec::new(), visit };
    walker.fields()?;
    Some(walker.at)
}

/// Greatest depth of nested structs; Parquet has six.
const MAX_NESTED_STRUCTS: usize = 16;

struct Walker<'a> {
    bytes: &'a [u8],
    at: usize,
    path: Vec<i16>,
    visit: &'a mut dyn FnMut(&[i16], i64),
}

impl Walker<'_> {
    fn byte(&mut self) -> Option<u8> {
        let byte = self.bytes.get(self.at).copied()?;
        self.at += 1;
        Some(byte)
    }

    fn skip(&mut self, length: u64) -> Option<()> {
        let at = self.at.checked_add(usize::try_from(length).ok()?)?;
        self.at = at;
        (at <= self.bytes.len()).then_some(())
    }

    /// A variable-length integer: groups of seven bits, the lowest first.
    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }

    /// A signed integer, with the sign in the lowest bit.
    fn whole(&mut self) -> Option<i64> {
        let value = self.varint()?;
        Some((value >> 1) as i64 ^ -((value & 1) as i64))
    }

    fn fields(&mut self) -> Option<()> {
        if self.path.len() >= MAX_NESTED_STRUCTS {
            return None;
        }
        let mut field = 0_i16;
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Some(());
            }
            field = match head >> 4 {
                0 => i16::try_from(self.whole()?).ok()?,
                step => field.checked_add(step.into())?,
            };
            self.path.push(field);
            // The type of a field is its value where that is true or false.
            if !matches!(head & 0xf, 1 | 2) {
                self.value(head & 0xf)?;
            }
            self.path.pop();
        }
    }

    fn value(&mut self, kind: u8) -> Option<()> {
        match kind {
            1..=3 => self.skip(1),
            4..=6 => {
                let value = self.whole()?;
                (self.visit)(&self.path, value);
                Some(())
            }
            7 => self.skip(8),
            8 => {
                let length = self.varint()?;
                self.skip(length)
            }
            9 | 10 => {
                let head = self.byte()?;
                let count = match head >> 4 {
                    15 => self.varint()?,
                    count => count.into(),
                };
                // An element has at least one byte.
                let left = (self.bytes.len() - self.at) as u64;
                let count = (count <= left).then_some(count)?;
                (self.visit)(&self.path, count as i64);
                // Parquet has no lists of lists, and no maps.
                let kind = Some(head & 0xf).filter(|kind| !matches!(kind, 9 | 10))?;
                (0..count).try_for_each(|_| self.value(kind))
            }
            12 => self.fields(),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    //! Malformed footers, byte by byte; whole files are in `tests/bad_specs` and `fuzz/corpus`.

    use super::*;
    use bytes::Bytes;

    fn message(result: Result<(), ParquetError>) -> String {
        result.err().map_or_else(String::new, |error| error.to_string())
    }

    /// The error of a file that consists of this footer.
    fn footer(bytes: &[u8]) -> String {
        let length = u32::try_from(bytes.len()).expect("is short").to_le_bytes();
        message(check_footer(&Bytes::from([bytes, &length, b"PAR1"].concat())))
    }

    #[test]
    fn a_footer_claims_no_more_than_there_can_be() {
        // Field 2, a list of one struct whose field 5 is 1000.
        assert!(
            footer(&[0x29, 0x1c, 0x55, 0xd0, 0x0f, 0, 0]).ends_with("a node of 1000 children, where 1 are possible")
        );
        // A list of lists; nested structs; a list and a text longer than the remaining bytes; a missing end.
        let deep = [0x1c; 20];
        for damaged in [&[0x19, 0x19, 0x05, 0, 0][..], &deep, &[0x19, 0xf5, 0x7f, 0], &[0x18, 0x7f, 0], &[0x15]] {
            assert!(footer(damaged).ends_with("its footer is damaged"), "{damaged:x?}");
        }
        assert_eq!(footer(&[0x15, 0x02, 0]), "");
    }

    #[test]
    fn a_page_claims_no_more_than_there_can_be() {
        // Type, both sizes, and a struct of a number of values and an encoding.
        let header = |size: u8, values: u8, encoding: u8| {
            [0x15, 0, 0x15, size, 0x15, 20, 0x2c, 0x15, values, 0x15, encoding, 0, 0]
        };
        assert_eq!(check_page(&header(20, 2, 0)).expect("claims little"), Some((13, 13 + 10)));
        for encoding in [6, 7] {
            let error = check_page(&header(20, 2, 2 * encoding)).expect_err("is refused");
            assert!(error.to_string().ends_with("words are encoded as differences"));
        }
        // A text of 300 bytes extends beyond the first 256.
        let long = [&header(20, 2, 0)[..12], &[0x18, 0xac, 0x02], &[b'v'; 300], &[0]].concat();
        assert_eq!(check_page(&long[..256]).expect("claims little"), None);
        assert_eq!(check_page(&long).expect("claims little"), Some((316, 316 + 10)));
    }

    #[test]
    fn columns_lie_within_their_file() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/points/bare.parquet");
        let whole = std::fs::File::open(&path).expect("is there");
        let metadata = ParquetMetaDataReader::new().parse_and_finish(&whole).expect("is sound");
        assert_eq!(message(check_pages(&whole, &metadata)), "");
        assert!(message(check_pages(&Bytes::from("PAR1"), &metadata)).ends_with("its list of columns is damaged"));
    }
}
