//! A column chunk of few different values, spliced into a Parquet file as a dictionary and the runs of its codes.
//!
//! The axes of a product are runs of known length, so their codes need no hashing of every cell: that makes seven axis columns
//! cost less than one column of numbers.

use std::collections::HashMap;

use bytes::Bytes;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::column::page::{CompressedPage, Page, PageWriter};
use parquet::column::writer::ColumnCloseResult;
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::ColumnChunkMetaData;
use parquet::file::statistics::Statistics;
use parquet::file::writer::{SerializedPageWriter, TrackedWrite};
use parquet::schema::types::ColumnDescPtr;

use super::hybrid;
use super::part::ZSTD_LEVEL;

/// Pages of fewer bytes are not compressed: it would cost more than it saves.
const WORTH_COMPRESSING: usize = 1 << 12;

/// A column chunk: different values, and which of them each row has.
pub struct Chunk<'a> {
    /// The different values, in Parquet's plain encoding.
    pub plain: Vec<u8>,
    /// How many values that is.
    pub values: u32,
    /// Which value, for how many rows that have one.
    pub codes: &'a [(u32, usize)],
    /// Of a column with nulls: for how many rows there is one (1) or none (0).
    pub present: Option<&'a [(u32, usize)]>,
    /// Least and greatest value and number of nulls.
    pub statistics: Statistics,
}

impl Chunk<'_> {
    /// The bytes of the chunk and what the file has to know of them.
    pub fn encode(self, column: ColumnDescPtr) -> Result<(Bytes, ColumnCloseResult)> {
        let total = |runs: &[(u32, usize)]| runs.iter().map(|(_, length)| length).sum::<usize>();
        let rows = self.present.map_or_else(|| total(self.codes), total);

        let mut data = Vec::new();
        if let Some(present) = self.present {
            let levels = hybrid::encode(present.iter().copied(), 1);
            data.extend((levels.len() as u32).to_le_bytes());
            data.extend(levels);
        }
        let bit_width = hybrid::bit_width(self.values as usize);
        data.push(bit_width);
        data.extend(hybrid::encode(self.codes.iter().copied(), bit_width));

        let compression = if data.len() + self.plain.len() < WORTH_COMPRESSING {
            Compression::UNCOMPRESSED
        } else {
            Compression::ZSTD(ZstdLevel::try_new(ZSTD_LEVEL)?)
        };
        let compress = |bytes: Vec<u8>| match compression {
            Compression::UNCOMPRESSED => Ok(bytes),
            _ => zstd::bulk::compress(&bytes, ZSTD_LEVEL).map_err(|error| ParquetError::External(Box::new(error))),
        };

        let mut file = TrackedWrite::new(Vec::new());
        let mut pages = SerializedPageWriter::new(&mut file);
        let size = self.plain.len();
        let page = Page::DictionaryPage {
            buf: compress(self.plain)?.into(),
            num_values: self.values,
            encoding: Encoding::PLAIN,
            is_sorted: false,
        };
        let dictionary = pages.write_page(CompressedPage::new(page, size))?;
        let size = data.len();
        let page = Page::DataPage {
            buf: compress(data)?.into(),
            num_values: rows as u32,
            encoding: Encoding::RLE_DICTIONARY,
            def_level_encoding: Encoding::RLE,
            rep_level_encoding: Encoding::RLE,
            statistics: None,
        };
        let codes = pages.write_page(CompressedPage::new(page, size))?;
        pages.close()?;

        let metadata = ColumnChunkMetaData::builder(column)
            .set_compression(compression)
            .set_encodings(vec![Encoding::PLAIN, Encoding::RLE, Encoding::RLE_DICTIONARY])
            .set_num_values(rows as i64)
            .set_total_compressed_size((dictionary.compressed_size + codes.compressed_size) as i64)
            .set_total_uncompressed_size((dictionary.uncompressed_size + codes.uncompressed_size) as i64)
            .set_dictionary_page_offset(Some(dictionary.offset as i64))
            .set_data_page_offset(codes.offset as i64)
            .set_statistics(self.statistics)
            .build()?;
        let close = ColumnCloseResult {
            bytes_written: metadata.compressed_size() as u64,
            rows_written: rows as u64,
            metadata,
            bloom_filter: None,
            column_index: None,
            offset_index: None,
        };
        Ok((file.into_inner()?.into(), close))
    }
}

/// Different numbers, numbered in the order in which they come.
#[derive(Default)]
pub struct Numbers {
    /// The numbers.
    pub values: Vec<f64>,
    codes: HashMap<u64, u32>,
}

impl Numbers {
    /// The code of `value`, told apart by its bits.
    pub fn code(&mut self, value: f64) -> u32 {
        let next = self.values.len() as u32;
        *self.codes.entry(value.to_bits()).or_insert_with(|| {
            self.values.push(value);
            next
        })
    }

    /// A chunk of these numbers.
    pub fn chunk<'a>(&self, codes: &'a [(u32, usize)], present: Option<&'a [(u32, usize)]>, nulls: u64) -> Chunk<'a> {
        let least = self.values.iter().copied().min_by(f64::total_cmp);
        let greatest = self.values.iter().copied().max_by(f64::total_cmp);
        // Readers may compare zeros of either sign as equal: the format asks for the outer one.
        let least = least.map(|value| if value == 0.0 { -0.0 } else { value });
        let greatest = greatest.map(|value| if value == 0.0 { 0.0 } else { value });
        Chunk {
            plain: self.values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            values: self.values.len() as u32,
            codes,
            present,
            statistics: Statistics::double(least, greatest, None, Some(nulls), false),
        }
    }
}

/// A chunk of words, all of which are in the dictionary; `codes` are their indices.
pub fn words<'a>(
    words: &[&str],
    codes: &'a [(u32, usize)],
    present: Option<&'a [(u32, usize)]>,
    nulls: u64,
) -> Chunk<'a> {
    let mut plain = Vec::new();
    for word in words {
        plain.extend((word.len() as u32).to_le_bytes());
        plain.extend(word.as_bytes());
    }
    let used = || codes.iter().filter_map(|&(code, _)| words.get(code as usize));
    let bytes = |word: Option<&&str>| word.map(|word| word.as_bytes().to_vec().into());
    Chunk {
        plain,
        values: words.len() as u32,
        codes,
        present,
        statistics: Statistics::byte_array(bytes(used().min()), bytes(used().max()), None, Some(nulls), false),
    }
}
