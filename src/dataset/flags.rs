//! Column chunks of flags: one bit each, in Parquet's plain encoding.

use parquet::basic::Encoding;
use parquet::file::statistics::Statistics;

use super::chunk::{Chunk, page};
use super::numbers::presence;

/// The chunk of `cells`: 1, 0, or NaN for a missing value.
pub fn chunk(cells: &[f64]) -> Chunk {
    let present = presence(cells);
    let flags: Vec<bool> = cells.iter().filter(|cell| !cell.is_nan()).map(|&cell| cell != 0.0).collect();
    let mut data = page(Some(&present));
    data.extend(flags.chunks(8).map(|eight| eight.iter().rev().fold(0, |byte, &flag| byte << 1 | u8::from(flag))));
    let range = flags.iter().min().copied().zip(flags.iter().max().copied());
    let (least, greatest) = range.unzip();
    let nulls = (cells.len() - flags.len()) as u64;
    Chunk {
        rows: cells.len(),
        dictionary: None,
        data,
        encoding: Encoding::PLAIN,
        statistics: Statistics::boolean(least, greatest, None, Some(nulls), false),
    }
}
