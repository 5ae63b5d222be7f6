//! Column chunks of flags, one bit each, and of mostly distinct numbers: byte stream split, that is, the first bytes of all numbers, then the
//! second bytes, …
//!
//! Format: <https://parquet.apache.org/docs/file-format/data-pages/encodings/#BYTESTREAMSPLIT>. In a smooth column, the last two streams (sign,
//! exponent and leading mantissa bits) compress well.

use multiversion::multiversion;
use parquet::basic::Encoding;
use parquet::file::statistics::Statistics;

use super::chunk::{Chunk, Runs, page};
use super::dictionary;

/// Numbers split in one block. Chosen: they stay in the first-level cache while all eight streams are written.
const BLOCK: usize = 512;

/// Runs of rows with a number (1) and without one (0).
pub fn presence(cells: &[f64]) -> Runs {
    let runs = cells.chunk_by(|one, next| one.is_nan() == next.is_nan());
    runs.map(|run| (u32::from(!run[0].is_nan()), run.len())).collect()
}

/// The chunk of `cells`; NaN is null.
pub fn chunk(cells: &[f64]) -> Chunk {
    let present = presence(cells);
    let values = cells.split(|cell| cell.is_nan()).collect::<Vec<_>>().concat();
    if let Some((distinct, runs)) = repeating(&values) {
        return dictionary::numbers(&distinct, runs.into_iter(), Some(&present));
    }
    let mut data = page(Some(&present));
    let start = data.len();
    data.resize(start + 8 * values.len(), 0);
    split(&values, &mut data[start..]);
    let range = (!values.is_empty()).then(|| range(&values));
    Chunk {
        rows: cells.len(),
        dictionary: None,
        data,
        encoding: Encoding::BYTE_STREAM_SPLIT,
        statistics: double_statistics(range, (cells.len() - values.len()) as u64),
    }
}

/// The chunk of flags, which are 1, 0, or NaN for a missing value, in Parquet's plain encoding.
pub fn flags(cells: &[f64]) -> Chunk {
    let flags: Vec<bool> = cells.iter().filter(|cell| !cell.is_nan()).map(|&cell| cell != 0.0).collect();
    let mut data = page(Some(&presence(cells)));
    data.extend(flags.chunks(8).map(|eight| eight.iter().rev().fold(0, |byte, &flag| byte << 1 | u8::from(flag))));
    let (least, greatest) = (flags.iter().min().copied(), flags.iter().max().copied());
    let nulls = (cells.len() - flags.len()) as u64;
    Chunk {
        rows: cells.len(),
        dictionary: None,
        data,
        encoding: Encoding::PLAIN,
        statistics: Statistics::boolean(least, greatest, None, Some(nulls), false),
    }
}

/// Distinct consecutive numbers and runs of their indices.
type Repeated = (Vec<f64>, Vec<(usize, usize)>);

/// Numbers with long runs, such as the optimal work along a landscape; `None` for a column without them.
fn repeating(values: &[f64]) -> Option<Repeated> {
    let most = values.len().div_ceil(16);
    let runs = values.chunk_by(|one, next| one.to_bits() == next.to_bits());
    let (distinct, lengths): (Vec<f64>, Vec<usize>) = runs.map(|run| (run[0], run.len())).take(most + 1).unzip();
    let is_repeating = (1..=most).contains(&distinct.len());
    is_repeating.then(|| (distinct, lengths.into_iter().enumerate().collect()))
}

/// Splits `values` into eight streams of bytes, one after another in `streams`.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn split(values: &[f64], streams: &mut [u8]) {
    let mut streams: Vec<&mut [u8]> = streams.chunks_mut(values.len().max(1)).collect();
    for (number, block) in values.chunks(BLOCK).enumerate() {
        for (byte, stream) in streams.iter_mut().enumerate() {
            let places = number * BLOCK..number * BLOCK + block.len();
            for (out, value) in stream[places].iter_mut().zip(block) {
                *out = (value.to_bits() >> (8 * byte)) as u8;
            }
        }
    }
}

/// Values compared side by side, so that the compiler uses vector instructions. Chosen: the widest vectors.
const LANES: usize = 8;

/// The least and the greatest of `values` that are not NaN; infinity and its opposite if there is none.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub fn range(values: &[f64]) -> (f64, f64) {
    let (mut least, mut greatest) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    for chunk in values.chunks(LANES) {
        for ((value, least), greatest) in chunk.iter().zip(&mut least).zip(&mut greatest) {
            *least = if *value < *least { *value } else { *least };
            *greatest = if *value > *greatest { *value } else { *greatest };
        }
    }
    (least.into_iter().fold(f64::INFINITY, f64::min), greatest.into_iter().fold(f64::NEG_INFINITY, f64::max))
}

/// Statistics of a column of doubles: `range` is its least and greatest value.
pub fn double_statistics(range: Option<(f64, f64)>, nulls: u64) -> Statistics {
    // Readers may treat zeros of both signs as equal, so the format requires -0 as least and +0 as greatest value.
    let least = range.map(|(least, _)| if least == 0.0 { -0.0 } else { least });
    let greatest = range.map(|(_, greatest)| if greatest == 0.0 { 0.0 } else { greatest });
    Statistics::double(least, greatest, None, Some(nulls), false)
}

#[cfg(test)]
mod tests {
    //! Repeated numbers.

    use super::*;

    #[test]
    fn repetition_is_found_where_it_pays() {
        assert_eq!(repeating(&[]), None);
        assert_eq!(repeating(&[2.0; 40]), Some((vec![2.0], vec![(0, 40)])));
        let two: Vec<f64> = [vec![1.0; 20], vec![3.0; 21]].concat();
        assert_eq!(repeating(&two), Some((vec![1.0, 3.0], vec![(0, 20), (1, 21)])));
        assert_eq!(repeating(&(0..40).map(f64::from).collect::<Vec<_>>()), None);
        // Zeros of either sign are different numbers.
        assert_eq!(repeating(&[[0.0; 20], [-0.0; 20]].concat()).map(|(distinct, _)| distinct.len()), Some(2));
    }
}
