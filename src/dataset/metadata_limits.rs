//! Limits on the metadata of a Parquet file, checked before its reader allocates: a few bytes can claim gigabytes.
//!
//! Footers and page headers are structs of Thrift's compact protocol. No list may be longer than the remaining bytes, and numbers that determine
//! an allocation are checked. The reader expects the field types of the Parquet format whatever the file states: a field of another type is
//! refused, as the reader would go on at another byte than this walk.

use std::fs::File;
use std::sync::Arc;

use arrow_schema::{DataType, FieldRef, Fields, Schema};
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use parquet::errors::ParquetError;
use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataReader};
use parquet::file::reader::ChunkReader;

use super::guard::guarded;
use super::layout::label;
use super::thrift::{FILE_METADATA, PAGE_HEADER, walk};

/// Bytes after the footer: its length and `PAR1`.
pub const TRAILER: u64 = 8;
/// Greatest size of a footer, in bytes. Chosen: hundreds of times that of our parts.
const MAX_FOOTER_BYTES: usize = 1 << 24;
/// Greatest size of a page header, in bytes. Chosen: hundreds of times that of our pages.
const MAX_HEADER_BYTES: usize = 1 << 16;
/// Greatest size of a decompressed page, in bytes. Chosen: it holds [`MAX_VALUES`] doubles with a margin.
const MAX_PAGE_BYTES: i64 = 40 << 20;
/// Greatest number of values of a page or of a dictionary. Chosen: sixteen parts in one page.
const MAX_VALUES: i64 = 1 << 22;

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

/// The start and the length of the footer; `None` if the file does not end like a Parquet file.
///
/// # Errors
///
/// A file that cannot be read.
pub fn footer_place(file: &impl ChunkReader) -> Result<Option<(u64, usize)>, ParquetError> {
    let Some(before) = file.len().checked_sub(TRAILER) else { return Ok(None) };
    let trailer = file.get_bytes(before, TRAILER as usize)?;
    let [a, b, c, d, b'P', b'A', b'R', b'1'] = trailer[..] else { return Ok(None) };
    let length = u32::from_le_bytes([a, b, c, d]);
    Ok(before.checked_sub(length.into()).map(|start| (start, length as usize)))
}

/// Checks that the lists of the footer, if any, are as long as stated.
///
/// # Errors
///
/// A footer that is damaged or too large.
pub fn check_footer(file: &impl ChunkReader) -> Result<(), ParquetError> {
    let Some((start, length)) = footer_place(file)? else { return Ok(()) };
    if length > MAX_FOOTER_BYTES {
        return Err(excess("a footer", length as i64, MAX_FOOTER_BYTES as i64, "bytes"));
    }
    let footer = file.get_bytes(start, length)?;
    let (mut elements, mut limits) = (0, Ok(()));
    let end = walk(&footer, FILE_METADATA, &mut |path, value| match path {
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
            let left = usize::try_from(end - at).unwrap_or(usize::MAX).min(MAX_HEADER_BYTES);
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
    // The sizes and counts have 32 bits, whatever the type that the file states.
    let header = walk(bytes, PAGE_HEADER, &mut |path, value| match path {
        [2 | 3] | [5 | 7 | 8, 1] if i32::try_from(value).is_err() => limits = Err(damaged("page header")),
        [2] if value > MAX_PAGE_BYTES => limits = Err(excess("a page", value, MAX_PAGE_BYTES, "bytes")),
        [3] => compressed = u64::try_from(value).ok(),
        [5 | 7 | 8, 1] if value > MAX_VALUES => limits = Err(excess("a page", value, MAX_VALUES, "values")),
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
    ParquetError::General(format!("{what} of {found} {unit}, above the limit of {most}"))
}

fn damaged(what: &str) -> ParquetError {
    ParquetError::General(format!("its {what} is damaged"))
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
            footer(&[0x29, 0x1c, 0x55, 0xd0, 0x0f, 0, 0]).ends_with("a node of 1000 children, above the limit of 1")
        );
        // A list of lists; nested structs; a list and a text longer than the remaining bytes; a missing end.
        // A number that is a text, and a text within a list that is a number: the reader would go on at another byte.
        let deep = [0x8c; 20];
        let lists = [&[0x99, 0x19, 0x05, 0, 0][..], &[0x99, 0xf5, 0x7f, 0]];
        let types = [&[0x18, 0x01, 0x7f, 0][..], &[0x29, 0x1c, 0x45, 0x02, 0, 0], &[0x11, 0]];
        for damaged in [&deep[..], &[0x68, 0x7f, 0], &[0x15]].into_iter().chain(lists).chain(types) {
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
        // A size whose lowest 32 bits are 2,083,520,512, as one of 32 and as one of 64 bits.
        for kind in [0x15, 0x16] {
            let size = [0x15, 0, kind, 0xff, 0xff, 0xff, 0xbc, 0x30, 0x15, 20, 0];
            assert!(!matches!(check_page(&size), Ok(Some(_))), "{kind:x}");
        }
        // A text of 300 bytes extends beyond the first 256.
        let long = [&header(20, 2, 0)[..12], &[0x98, 0xac, 0x02], &[b'v'; 300], &[0]].concat();
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
