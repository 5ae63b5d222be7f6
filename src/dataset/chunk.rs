//! A column chunk, encoded here page by page and appended to a Parquet file.
//!
//! The writer of the `parquet` crate processes values one by one and writes no checksums of pages. Here the runs of axes, of missing numbers and
//! of repeated values are known, which avoids most of this work. With the writer of the crate, computing and encoding a landscape takes 2.2
//! times as long (`cargo bench --bench pipeline -- writers`).

use bytes::Bytes;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::column::writer::ColumnCloseResult;
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::ColumnChunkMetaData;
use parquet::file::statistics::Statistics;
use parquet::schema::types::ColumnDescPtr;
use zstd::bulk::Compressor;

use super::part::ZSTD_LEVEL;
use super::rle;

/// Runs of equal codes: code and number of rows.
pub type Runs = Vec<(u32, usize)>;

/// Least size of a compressed page, in bytes. Chosen: smaller pages cost more time than they save space.
const MIN_COMPRESSED_BYTES: usize = 1 << 12;

/// A column chunk of one data page.
pub struct Chunk {
    /// Rows, with and without a value.
    pub rows: usize,
    /// The dictionary: its values in Parquet's plain encoding, and their number.
    pub dictionary: Option<(Vec<u8>, u32)>,
    /// The data page: levels and encoded values.
    pub data: Vec<u8>,
    /// The encoding of the values.
    pub encoding: Encoding,
    /// Least value, greatest value and number of nulls.
    pub statistics: Statistics,
}

/// A new data page, beginning with the definition levels of a column with nulls: 1 for a value, 0 for null.
pub fn page(present: Option<&Runs>) -> Vec<u8> {
    let Some(present) = present else { return Vec::new() };
    let levels = rle::encode(present.iter().copied(), 1);
    let mut data = Vec::from((levels.len() as u32).to_le_bytes());
    data.extend(levels);
    data
}

impl Chunk {
    /// The bytes of the chunk, and its metadata for the file.
    ///
    /// # Errors
    ///
    /// The error of the compressor or of the encoder.
    pub fn encode(self, column: ColumnDescPtr, zstd: &mut Compressor<'_>) -> Result<(Bytes, ColumnCloseResult)> {
        let raw = self.data.len() + self.dictionary.as_ref().map_or(0, |(plain, _)| plain.len());
        let compression = if raw < MIN_COMPRESSED_BYTES {
            Compression::UNCOMPRESSED
        } else {
            Compression::ZSTD(ZstdLevel::try_new(ZSTD_LEVEL)?)
        };
        let mut compress = |bytes: Vec<u8>| match compression {
            Compression::UNCOMPRESSED => Ok(bytes),
            _ => zstd.compress(&bytes).map_err(|error| ParquetError::External(Box::new(error))),
        };

        let mut file = Vec::with_capacity(raw);
        let mut uncompressed = 0;
        let mut dictionary_offset = None;
        if let Some((plain, count)) = self.dictionary {
            dictionary_offset = Some(0);
            uncompressed += add_page(&mut file, Kind::Dictionary, count, plain, &mut compress)?;
        }
        let offset = file.len();
        uncompressed += add_page(&mut file, Kind::Data(self.encoding), self.rows as u32, self.data, &mut compress)?;

        let mut encodings = vec![Encoding::RLE, self.encoding];
        if dictionary_offset.is_some() {
            encodings.insert(0, Encoding::PLAIN);
        }
        let metadata = ColumnChunkMetaData::builder(column)
            .set_compression(compression)
            .set_encodings(encodings)
            .set_num_values(self.rows as i64)
            .set_total_compressed_size(file.len() as i64)
            .set_total_uncompressed_size(uncompressed as i64)
            .set_dictionary_page_offset(dictionary_offset)
            .set_data_page_offset(offset as i64)
            .set_statistics(self.statistics)
            .build()?;
        let close = ColumnCloseResult {
            bytes_written: metadata.compressed_size() as u64,
            rows_written: self.rows as u64,
            metadata,
            bloom_filter: None,
            column_index: None,
            offset_index: None,
        };
        Ok((file.into(), close))
    }
}

/// The kind of a page.
enum Kind {
    /// Dictionary values in plain encoding.
    Dictionary,
    /// Levels and encoded values.
    Data(Encoding),
}

/// Appends a page and its header, which contains the checksum of the page; returns the size before compression, including the header.
///
/// The header is the struct `PageHeader` of <https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift> in Thrift's
/// compact protocol: the `parquet` crate writes none with a checksum.
fn add_page(
    file: &mut Vec<u8>,
    kind: Kind,
    count: u32,
    content: Vec<u8>,
    compress: &mut impl FnMut(Vec<u8>) -> Result<Vec<u8>>,
) -> Result<usize> {
    let size = content.len();
    let content = compress(content)?;
    let size_as = |size: usize| i32::try_from(size).map_err(|error| ParquetError::External(Box::new(error)));
    let (tag, code) = match kind {
        Kind::Dictionary => (2, Encoding::PLAIN as i32),
        Kind::Data(encoding) => (0, encoding as i32),
    };
    let start = file.len();
    // Type, both sizes, and the checksum as a signed number.
    for field in [tag, size_as(size)?, size_as(content.len())?, crc32fast::hash(&content).cast_signed()] {
        add_field(file, field);
    }
    let (field, rest) = match kind {
        // Field 7, with the flag that the dictionary is not sorted.
        Kind::Dictionary => (0x3c, &[][..]),
        // Field 5, with the encodings of both levels.
        Kind::Data(_) => (0x1c, &[Encoding::RLE as i32; 2][..]),
    };
    file.push(field);
    for &field in [count.cast_signed(), code].iter().chain(rest) {
        add_field(file, field);
    }
    if let Kind::Dictionary = kind {
        file.push(0x12);
    }
    file.extend([0, 0]);
    let header = file.len() - start;
    file.extend(content);
    Ok(header + size)
}

/// Appends the next field of a struct: a 32-bit number with the sign in the lowest bit.
fn add_field(file: &mut Vec<u8>, value: i32) {
    file.push(0x15);
    rle::varint(file, (value << 1 ^ value >> 31).cast_unsigned().into());
}
