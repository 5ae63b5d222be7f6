//! A column chunk made here, page by page, and spliced into a Parquet file.
//!
//! The writer of the `parquet` crate takes values one by one; here the runs of an axis, of the rows that have a value and of
//! values that repeat are known, so that most of its work need not be done.

use bytes::Bytes;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::column::page::{CompressedPage, Page, PageWriter};
use parquet::column::writer::ColumnCloseResult;
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::ColumnChunkMetaData;
use parquet::file::statistics::Statistics;
use parquet::file::writer::{SerializedPageWriter, TrackedWrite};
use parquet::schema::types::ColumnDescPtr;
use zstd::bulk::Compressor;

use super::hybrid;
use super::part::ZSTD_LEVEL;

/// Runs of equal codes: a code, and for how many rows.
pub type Runs = Vec<(u32, usize)>;

/// Pages of fewer bytes are not compressed: it would cost more than it saves.
const WORTH_COMPRESSING: usize = 1 << 12;

/// A column chunk of one data page.
pub struct Chunk {
    /// Rows, with and without a value.
    pub rows: usize,
    /// The dictionary: its values in Parquet's plain encoding, and how many.
    pub dictionary: Option<(Vec<u8>, u32)>,
    /// The data page: levels and encoded values.
    pub data: Vec<u8>,
    /// How the values are encoded.
    pub encoding: Encoding,
    /// Least and greatest value and number of nulls.
    pub statistics: Statistics,
}

/// Begins a data page of up to `size` bytes with the levels of a column with nulls: which rows have a value (1) and which have none (0).
pub fn page(present: Option<&Runs>, size: usize) -> Vec<u8> {
    let Some(present) = present else { return Vec::with_capacity(size) };
    let levels = hybrid::encode(present.iter().copied(), 1);
    let mut data = Vec::with_capacity(4 + levels.len() + size);
    data.extend((levels.len() as u32).to_le_bytes());
    data.extend(levels);
    data
}

impl Chunk {
    /// The bytes of the chunk and what the file has to know of them.
    pub fn encode(self, column: ColumnDescPtr, zstd: &mut Compressor<'_>) -> Result<(Bytes, ColumnCloseResult)> {
        let raw = self.data.len() + self.dictionary.as_ref().map_or(0, |(plain, _)| plain.len());
        let compression = if raw < WORTH_COMPRESSING {
            Compression::UNCOMPRESSED
        } else {
            Compression::ZSTD(ZstdLevel::try_new(ZSTD_LEVEL)?)
        };
        let mut compress = |bytes: Vec<u8>| match compression {
            Compression::UNCOMPRESSED => Ok(bytes),
            _ => zstd.compress(&bytes).map_err(|error| ParquetError::External(Box::new(error))),
        };

        let mut file = TrackedWrite::new(Vec::with_capacity(raw));
        let mut pages = SerializedPageWriter::new(&mut file);
        let (mut compressed, mut uncompressed) = (0, 0);
        let mut dictionary_offset = None;
        if let Some((plain, count)) = self.dictionary {
            let size = plain.len();
            let page = Page::DictionaryPage {
                buf: compress(plain)?.into(),
                num_values: count,
                encoding: Encoding::PLAIN,
                is_sorted: false,
            };
            let written = pages.write_page(CompressedPage::new(page, size))?;
            (compressed, uncompressed) = (written.compressed_size, written.uncompressed_size);
            dictionary_offset = Some(written.offset as i64);
        }
        let size = self.data.len();
        let page = Page::DataPage {
            buf: compress(self.data)?.into(),
            num_values: self.rows as u32,
            encoding: self.encoding,
            def_level_encoding: Encoding::RLE,
            rep_level_encoding: Encoding::RLE,
            statistics: None,
        };
        let written = pages.write_page(CompressedPage::new(page, size))?;
        pages.close()?;

        let mut encodings = vec![Encoding::RLE, self.encoding];
        if dictionary_offset.is_some() {
            encodings.insert(0, Encoding::PLAIN);
        }
        let metadata = ColumnChunkMetaData::builder(column)
            .set_compression(compression)
            .set_encodings(encodings)
            .set_num_values(self.rows as i64)
            .set_total_compressed_size((compressed + written.compressed_size) as i64)
            .set_total_uncompressed_size((uncompressed + written.uncompressed_size) as i64)
            .set_dictionary_page_offset(dictionary_offset)
            .set_data_page_offset(written.offset as i64)
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
        Ok((file.into_inner()?.into(), close))
    }
}
