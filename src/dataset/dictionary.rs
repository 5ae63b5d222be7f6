//! Column chunks with few distinct values: a dictionary, and runs of its codes.
//!
//! The axes of a product have runs of known length, so cells need no hashing. Seven axis columns therefore cost less than one column of numbers.

use std::collections::HashMap;

use parquet::basic::Encoding;
use parquet::file::statistics::Statistics;

use super::chunk::{Chunk, Runs, page};
use super::numbers::double_statistics;
use super::rle;

/// A chunk of numbers from runs of indices into `values`, which may contain duplicates.
pub fn numbers(values: &[f64], runs: impl Iterator<Item = (usize, usize)>, present: Option<&Runs>) -> Chunk {
    let mut distinct: Vec<f64> = Vec::new();
    let mut codes: HashMap<u64, u32> = HashMap::new();
    let code_of: Vec<u32> = values
        .iter()
        .map(|value| {
            *codes.entry(value.to_bits()).or_insert_with(|| {
                distinct.push(*value);
                distinct.len() as u32 - 1
            })
        })
        .collect();
    let least = distinct.iter().copied().min_by(f64::total_cmp);
    let greatest = distinct.iter().copied().max_by(f64::total_cmp);
    let plain = distinct.iter().flat_map(|value| value.to_le_bytes()).collect();
    let runs = runs.map(|(place, length)| (code_of[place], length));
    chunk(plain, distinct.len(), runs, present, |nulls| double_statistics(least.zip(greatest), nulls))
}

/// A chunk of words from runs of their indices.
pub fn words(words: &[&str], runs: &Runs, present: Option<&Runs>) -> Chunk {
    let mut plain = Vec::new();
    for word in words {
        plain.extend((word.len() as u32).to_le_bytes());
        plain.extend(word.as_bytes());
    }
    let used = || runs.iter().filter_map(|&(code, _)| words.get(code as usize));
    let bytes = |word: Option<&&str>| word.map(|word| word.as_bytes().to_vec().into());
    chunk(plain, words.len(), runs.iter().copied(), present, |nulls| {
        Statistics::byte_array(bytes(used().min()), bytes(used().max()), None, Some(nulls), false)
    })
}

fn chunk(
    plain: Vec<u8>,
    values: usize,
    runs: impl Iterator<Item = (u32, usize)>,
    present: Option<&Runs>,
    statistics: impl FnOnce(u64) -> Statistics,
) -> Chunk {
    let bit_width = rle::bit_width(values);
    let mut with_value = 0;
    let codes = rle::encode(runs.inspect(|(_, length)| with_value += length), bit_width);
    let rows = present.map_or(with_value, |present| present.iter().map(|(_, length)| length).sum());
    let mut data = page(present);
    data.push(bit_width);
    data.extend(codes);
    Chunk {
        rows,
        dictionary: Some((plain, values as u32)),
        data,
        encoding: Encoding::RLE_DICTIONARY,
        statistics: statistics((rows - with_value) as u64),
    }
}
