//! The predicate of a block: the exact number of kept rows, and the product row of each.
//!
//! A condition reads some factors. It is evaluated once for each combination of their steps, and a bitmap stores the kept combinations. Digits
//! that the condition does not read multiply the counts of the bitmap.

use std::ops::Range;

use rayon::prelude::*;
use roaring::RoaringBitmap;

use super::block::{Block, Digits};
use super::expression::{Expression, Scratch};
use super::quantity::Quantity;
use super::sampler::{BATCH_POINTS, Sampler};

/// Combinations that a thread evaluates in one task, a multiple of 64. Chosen: some milliseconds.
const CHUNK_COMBINATIONS: u64 = 1 << 16;

/// Greatest number of combinations that a condition or a computed axis reads. Chosen: their evaluation takes seconds, their bitmap 128 MiB.
pub const MAX_COMBINATIONS: u64 = 1 << 30;

/// The rows of a product that a condition keeps.
#[derive(Debug)]
pub struct RowFilter {
    /// Slowest first, at least one.
    levels: Vec<Level>,
    /// Combinations of the digits that are read.
    combinations: u64,
    kept: RoaringBitmap,
}

/// Adjacent digits: some that are read, then some that are not.
#[derive(Debug, Clone, Copy)]
struct Level {
    read: u64,
    free: u64,
}

impl RowFilter {
    /// The filter of rows over `digits` of `block`: a row is kept if the condition holds at any of its points. `None` beyond [`MAX_COMBINATIONS`].
    pub fn new(block: &Block, digits: &Digits, condition: &Expression) -> Option<RowFilter> {
        let reads = block.factors_of(&condition.reads());
        let (mut levels, mut factors) = (vec![Level { read: 1, free: 1 }], Vec::new());
        for digit in &digits.digits {
            let is_read = reads.contains(&digit.factor);
            if is_read {
                factors.push(digit.factor);
            }
            match levels.last_mut() {
                Some(level) if !is_read => level.free *= digit.len,
                Some(level) if level.free == 1 => level.read *= digit.len,
                _ => levels.push(Level { read: digit.len, free: 1 }),
            }
        }
        let combinations = levels.iter().map(|level| level.read).product();
        // A row is kept if the condition holds for any step of the factors that are not in the rows.
        factors.extend(reads.iter().filter(|factor| !digits.digits.iter().any(|digit| digit.factor == **factor)));
        let all = Digits::new(block, &factors).filter(|all| all.rows <= MAX_COMBINATIONS)?;
        let sampler = Sampler::new(block, &all, &[], Some(condition));
        let hidden = all.rows / combinations;
        let bits = |visible, scratch: &mut Scratch| evaluate(&sampler, condition, hidden, visible, scratch);
        let bytes = in_chunks(combinations, bits).concat();
        Some(RowFilter { levels, combinations, kept: RoaringBitmap::from_lsb0_bytes(0, &bytes) })
    }

    /// The number of kept rows.
    pub fn rows(&self) -> u64 {
        self.kept.len() * self.levels.iter().map(|level| level.free).product::<u64>()
    }

    /// The kept rows with numbers `kept`, as ascending ranges of product rows.
    pub fn ranges(&self, kept: Range<u64>) -> Vec<Range<u64>> {
        let mut ranges: Vec<Range<u64>> = Vec::new();
        let last = self.levels[self.levels.len() - 1];
        let mut left = kept.end.saturating_sub(kept.start);
        while left > 0 {
            let Location { row, combination, mut inside } = self.locate(kept.end - left);
            // To the end of the steps of the fastest digits that are read, or of `kept`.
            let group = combination / last.read * last.read;
            let mut following = self.kept.range(combination as u32..(group + last.read) as u32);
            while let Some(run) = following.next_range().filter(|_| left > 0) {
                let [first, end] = [u64::from(*run.start()), u64::from(*run.end()) + 1];
                let start = (row + (first - combination)) * last.free + inside;
                let stop = (start - inside + (end - first) * last.free).min(start + left);
                left -= stop - start;
                match ranges.last_mut() {
                    Some(last) if last.end == start => last.end = stop,
                    _ => ranges.push(start..stop),
                }
                inside = 0;
            }
        }
        ranges
    }

    /// The number of kept combinations below a number.
    fn before(&self, combination: u64) -> u64 {
        combination.checked_sub(1).map_or(0, |last| self.kept.rank(last as u32))
    }

    /// The location of a kept row.
    fn locate(&self, number: u64) -> Location {
        let mut free: u64 = self.levels.iter().map(|level| level.free).product();
        let (mut row, mut rest) = (0, number);
        // The combinations with the digits found so far: the first one, and their number.
        let (mut first, mut count) = (0, self.combinations);
        for (place, level) in self.levels.iter().enumerate() {
            count /= level.read;
            let start = self.before(first);
            // The kept combination of this row, if all rows before it had as many free steps.
            let combination = self.kept.select((start + rest / free) as u32).map_or(first, u64::from);
            let step = (combination - first) / count;
            first += step * count;
            rest -= free * (self.before(first) - start);
            row = row * level.read + step;
            if place + 1 == self.levels.len() {
                break;
            }
            free /= level.free;
            let each = free * (self.before(first + count) - self.before(first));
            row = row * level.free + rest / each;
            rest %= each;
        }
        Location { row, combination: first, inside: rest }
    }
}

/// The location of a kept row.
struct Location {
    /// The row of the product, without the fastest digits that are not read.
    row: u64,
    /// The combination.
    combination: u64,
    /// The step of the fastest digits that are not read.
    inside: u64,
}

/// The results of `each` for the ranges below `count`, on all threads for more than one.
fn in_chunks<T: Send>(count: u64, each: impl Fn(Range<u64>, &mut Scratch) -> T + Sync) -> Vec<T> {
    let chunks = 0..count.div_ceil(CHUNK_COMBINATIONS);
    let each = |scratch: &mut Scratch, number: u64| {
        each(number * CHUNK_COMBINATIONS..((number + 1) * CHUNK_COMBINATIONS).min(count), scratch)
    };
    match (count > CHUNK_COMBINATIONS).then(|| rayon::ThreadPoolBuilder::new().build().ok()).flatten() {
        Some(pool) => pool.install(|| chunks.into_par_iter().map_init(Scratch::default, each).collect()),
        None => {
            let mut scratch = Scratch::default();
            chunks.map(|number| each(&mut scratch, number)).collect()
        }
    }
}

/// `points` in batches that are evaluated at a time.
fn batches(points: Range<u64>) -> impl Iterator<Item = Range<u64>> {
    let starts = points.clone().step_by(BATCH_POINTS as usize);
    starts.map(move |start| start..(start + BATCH_POINTS).min(points.end))
}

/// A bit for each of `visible` combinations: whether `condition` holds for any of its `hidden` points.
fn evaluate(
    sampler: &Sampler<'_>,
    condition: &Expression,
    hidden: u64,
    visible: Range<u64>,
    scratch: &mut Scratch,
) -> Vec<u8> {
    let mut bits = vec![0; (visible.end - visible.start).div_ceil(8) as usize];
    for points in batches(visible.start * hidden..visible.end * hidden) {
        sampler.load(points.clone(), scratch);
        for (point, &holds) in points.zip(condition.evaluate(scratch)) {
            if holds != 0.0 {
                let bit = point / hidden - visible.start;
                bits[(bit / 8) as usize] |= 1 << (bit % 8);
            }
        }
    }
    bits
}

/// A wrong value, and its point as axis values.
pub type Wrong = (f64, Vec<(Quantity, f64)>);

/// The first kept point of `block` with a wrong value of `quantity`, if any. `None` beyond `MAX_COMBINATIONS`.
pub fn first_wrong(block: &Block, quantity: Quantity, wrong: impl Fn(f64) -> bool + Sync) -> Option<Option<Wrong>> {
    let mut reads = vec![quantity];
    reads.extend(block.condition.iter().flat_map(Expression::reads));
    let roots = block.roots(&reads);
    let digits = Digits::new(block, &block.factors_of(&reads)).filter(|digits| digits.rows <= MAX_COMBINATIONS)?;
    let sampler = Sampler::new(block, &digits, &[quantity], block.condition.as_ref());
    let search = |rows: Range<u64>, scratch: &mut Scratch| {
        batches(rows).find_map(|rows| {
            sampler.load(rows.clone(), scratch);
            let kept = block.condition.as_ref().map(|condition| condition.evaluate(scratch).to_vec());
            let values = &scratch.quantities[quantity as usize];
            let is_found = |&i: &usize| kept.as_ref().is_none_or(|kept| kept[i] != 0.0) && wrong(values[i]);
            (0..values.len()).find(is_found).map(|place| rows.start + place as u64)
        })
    };
    let found = in_chunks(digits.rows, search).into_iter().flatten().next();
    Some(found.map(|row| {
        let mut scratch = Scratch::default();
        sampler.pick(&[row], &mut scratch);
        let value = |quantity: Quantity| scratch.quantities[quantity as usize][0];
        (value(quantity), roots.iter().map(|root| (*root, value(*root))).collect())
    }))
}
