//! Which rows of a product a condition keeps: their exact number, and the row that each kept one is, for any number of rows.
//!
//! A condition reads some factors only. It is evaluated once for each combination of those, not once a row, and the digits that it does
//! not read multiply what was counted. What is held in memory is a count for every chunk of combinations and, unless there are too many,
//! a bit for each.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::block::Block;
use super::digits::Digits;
use super::expression::Expression;
use super::quantity::Quantity;
use super::sampler::{Sampler, Scratch};

/// What bounds the memory of a sieve.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// Combinations that are counted together, a multiple of 64.
    chunk: u64,
    /// Most chunks whose counts are kept.
    chunks: u64,
    /// Most combinations of which a bit each is kept; beyond, a chunk is evaluated again where its rows are needed.
    bits: u64,
}

/// 32 MiB of counts, 8 MiB of bits.
const LIMITS: Limits = Limits { chunk: 1 << 16, chunks: 1 << 22, bits: 1 << 26 };

/// Points that are evaluated at a time.
const BATCH: u64 = 1 << 10;

/// Most combinations of the axes that a condition or a computed axis reads: evaluating them takes seconds.
pub const MOST_COMBINATIONS: u64 = 1 << 30;

/// Combinations from which on evaluation is worth several threads.
const WORTH_THREADS: u64 = 1 << 18;

/// The rows of a product that a condition keeps.
#[derive(Debug)]
pub struct Sieve {
    block: Arc<Block>,
    condition: Expression,
    limits: Limits,
    /// The factors that are read: those among the digits of the rows, then the hidden ones, which rows do not tell.
    combinations: Digits,
    /// Combinations of the hidden factors; a row is kept if the condition holds with any of them.
    hidden: u64,
    /// Digits slower than all that are read, as one number.
    lead: u64,
    levels: Vec<Level>,
    /// Combinations of the last level.
    group: u64,
    /// Chunks of a group.
    per_group: u64,
    /// Combinations kept before each chunk, and in all.
    before: Vec<u64>,
    bits: Option<Vec<u64>>,
}

/// Neighbouring digits: some that are read, then some that are not.
#[derive(Debug, Clone, Copy)]
struct Level {
    read: u64,
    free: u64,
}

/// A chunk evaluated: which of its combinations are kept.
struct Chunk {
    number: usize,
    words: Vec<u64>,
}

impl Sieve {
    /// The rows over `digits` of `block` for which its condition holds at any point; `None` if it reads too many combinations.
    pub fn new(block: &Arc<Block>, digits: &Digits, condition: &Expression) -> Option<Sieve> {
        Sieve::within(LIMITS, block, digits, condition)
    }

    fn within(limits: Limits, block: &Arc<Block>, digits: &Digits, condition: &Expression) -> Option<Sieve> {
        let reads = block.factors_of(&block.roots(&condition.reads()));
        let is_read: Vec<bool> = digits.digits.iter().map(|digit| reads.contains(&digit.factor)).collect();
        let sieve = Sieve::over(limits, block, digits, condition, &reads, &is_read)?;
        if sieve.chunks() <= limits.chunks {
            return sieve.count();
        }
        // Too many prefixes for a count each: what lies between the digits that are read is read too.
        let (first, last) = (is_read.iter().position(|read| *read)?, is_read.iter().rposition(|read| *read)?);
        let between: Vec<bool> = (0..is_read.len()).map(|place| (first..=last).contains(&place)).collect();
        Sieve::over(limits, block, digits, condition, &reads, &between)?.count()
    }

    fn over(
        limits: Limits,
        block: &Arc<Block>,
        digits: &Digits,
        condition: &Expression,
        reads: &[usize],
        is_read: &[bool],
    ) -> Option<Sieve> {
        let (mut lead, mut levels) = (1, Vec::<Level>::new());
        for (digit, &read) in digits.digits.iter().zip(is_read) {
            match levels.last_mut() {
                Some(level) if read && level.free == 1 => level.read *= digit.len,
                Some(level) if !read => level.free *= digit.len,
                None if !read => lead *= digit.len,
                _ => levels.push(Level { read: digit.len, free: 1 }),
            }
        }
        let told = digits.digits.iter().zip(is_read).filter(|(_, read)| **read).map(|(digit, _)| digit.factor);
        let mut factors: Vec<usize> = told.collect();
        let in_rows = |factor: usize| digits.digits.iter().any(|digit| digit.factor == factor);
        factors.extend(reads.iter().filter(|factor| !in_rows(**factor)));
        let combinations = Digits::new(block, &factors).filter(|all| all.rows <= MOST_COMBINATIONS)?;
        let told: u64 = levels.iter().map(|level| level.read).product();
        let group = levels.last().map_or(1, |level| level.read);
        Some(Sieve {
            block: block.clone(),
            condition: condition.clone(),
            limits,
            hidden: combinations.rows / told,
            combinations,
            lead,
            levels,
            group,
            per_group: group.div_ceil(limits.chunk),
            before: Vec::new(),
            bits: None,
        })
    }

    /// Combinations that rows tell.
    fn told(&self) -> u64 {
        self.combinations.rows / self.hidden
    }

    fn chunks(&self) -> u64 {
        self.told() / self.group * self.per_group
    }

    /// The combinations of a chunk: part of one group.
    fn range(&self, chunk: u64) -> Range<u64> {
        let (group, part) = (chunk / self.per_group, chunk % self.per_group);
        let start = group * self.group + part * self.limits.chunk;
        start..(start + self.limits.chunk).min((group + 1) * self.group)
    }

    fn count(mut self) -> Option<Sieve> {
        let several = self.combinations.rows >= WORTH_THREADS;
        // Without threads of its own it is done here.
        let pool = several.then(|| rayon::ThreadPoolBuilder::new().build().ok()).flatten();
        let in_pool = |work: &(dyn Fn() -> Vec<Vec<u64>> + Sync)| match &pool {
            Some(pool) => pool.install(work),
            None => work(),
        };
        let sampler = self.sampler();
        let each = |ranges: u64, made: &(dyn Fn(u64, &mut Scratch) -> Vec<u64> + Sync)| {
            in_pool(&|| {
                if several {
                    (0..ranges)
                        .into_par_iter()
                        .map_init(Scratch::default, |scratch, range| made(range, scratch))
                        .collect()
                } else {
                    let mut scratch = Scratch::default();
                    (0..ranges).map(|range| made(range, &mut scratch)).collect()
                }
            })
        };
        let told = self.told();
        let (chunks, chunk) = (self.chunks(), self.limits.chunk);
        let (counts, bits): (Vec<u64>, _) = if told <= self.limits.bits {
            let words = each(told.div_ceil(chunk), &|part, scratch| {
                self.evaluate(&sampler, part * chunk..((part + 1) * chunk).min(told), scratch)
            });
            let bits = words.concat();
            ((0..chunks).map(|chunk| count_ones(&bits, self.range(chunk))).collect(), Some(bits))
        } else {
            let counts = each(chunks, &|chunk, scratch| {
                let words = self.evaluate(&sampler, self.range(chunk), scratch);
                vec![words.iter().map(|word| u64::from(word.count_ones())).sum()]
            });
            (counts.concat(), None)
        };
        let mut sum = 0;
        let before = std::iter::once(0).chain(counts.into_iter().map(|count| {
            sum += count;
            sum
        }));
        self.before = before.collect();
        self.bits = bits;
        Some(self)
    }

    /// What the condition reads.
    fn sampler(&self) -> Sampler<'_> {
        let sampler = Sampler::new(&self.block, &self.combinations, &self.condition.reads());
        sampler.with_labels(&self.block, &self.combinations, Some(&self.condition))
    }

    /// A bit for each of `told` combinations, from the first on.
    fn evaluate(&self, sampler: &Sampler<'_>, told: Range<u64>, scratch: &mut Scratch) -> Vec<u64> {
        let mut words = vec![0; (told.end - told.start).div_ceil(64) as usize];
        let all = told.start * self.hidden..told.end * self.hidden;
        let mut start = all.start;
        while start < all.end {
            let end = (start + BATCH).min(all.end);
            sampler.load(start..end, scratch);
            for (place, &holds) in scratch.evaluate(&self.condition).iter().enumerate() {
                if holds != 0.0 {
                    let bit = (start + place as u64) / self.hidden - told.start;
                    words[(bit / 64) as usize] |= 1 << (bit % 64);
                }
            }
            start = end;
        }
        words
    }

    /// Whether it keeps every row.
    pub fn keeps_all(&self) -> bool {
        self.kept() == self.told()
    }

    fn kept(&self) -> u64 {
        self.before.last().copied().unwrap_or(0)
    }

    /// Number of rows that are kept.
    pub fn rows(&self) -> u64 {
        self.lead * self.kept() * self.levels.iter().map(|level| level.free).product::<u64>()
    }

    /// The kept rows of numbers `kept`, as ranges of rows of the product, in order.
    pub fn ranges(&self, kept: Range<u64>) -> Vec<Range<u64>> {
        let mut ranges: Vec<Range<u64>> = Vec::new();
        let mut chunk = Chunk { number: usize::MAX, words: Vec::new() };
        let sampler = self.bits.is_none().then(|| self.sampler());
        let mut scratch = Scratch::default();
        let trail = self.levels.last().map_or(1, |level| level.free);
        let mut row = kept.start;
        while row < kept.end {
            let place = self.locate(row);
            let combinations = self.range(place.chunk as u64);
            if chunk.number != place.chunk {
                chunk.number = place.chunk;
                if let Some(sampler) = &sampler {
                    chunk.words = self.evaluate(sampler, combinations.clone(), &mut scratch);
                }
            }
            let (words, base) = match &self.bits {
                Some(bits) => (bits.as_slice(), combinations.start),
                None => (chunk.words.as_slice(), 0),
            };
            let end = base + (combinations.end - combinations.start);
            let Some(mut bit) = nth_one(words, base..end, place.index) else { break };
            let mut inside = place.inside;
            // To the end of the chunk, or of what is asked for.
            while row < kept.end {
                let start = (place.first + bit - base) * trail + inside;
                let stop = (start - inside + trail).min(start + (kept.end - row));
                row += stop - start;
                match ranges.last_mut() {
                    Some(last) if last.end == start => last.end = stop,
                    _ => ranges.push(start..stop),
                }
                inside = 0;
                match nth_one(words, bit + 1..end, 0) {
                    Some(next) => bit = next,
                    None => break,
                }
            }
        }
        ranges
    }

    /// Where a kept row is.
    fn locate(&self, kept: u64) -> Place {
        let before = |group: u64| self.before[(group * self.per_group) as usize];
        let mut free: u64 = self.levels.iter().map(|level| level.free).product();
        let all = self.kept() * free;
        let (mut row, mut rest) = (kept / all, kept % all);
        // The groups below what is known of the row: their first, and how many.
        let (mut group, mut groups) = (0, self.told() / self.group);
        for level in self.levels.split_last().map_or(&[][..], |(_, outer)| outer) {
            groups /= level.read;
            let kept_below = |step: u64| free * (before(group + step * groups) - before(group));
            let step = last_below(level.read, |step| kept_below(step) <= rest);
            rest -= kept_below(step);
            group += step * groups;
            row = row * level.read + step;
            free /= level.free;
            let each = free * (before(group + groups) - before(group));
            row = row * level.free + rest / each;
            rest %= each;
        }
        let (index, inside) = (rest / free, rest % free);
        let first = group * self.per_group;
        let chunk = last_below(self.per_group, |chunk| self.before[(first + chunk) as usize] - before(group) <= index);
        let index = index - (self.before[(first + chunk) as usize] - before(group));
        Place { first: row * self.group + chunk * self.limits.chunk, chunk: (first + chunk) as usize, index, inside }
    }
}

/// Where a kept row is: which kept combination of which chunk, and how far into the digits faster than all that are read.
struct Place {
    /// The row of the product at which the chunk starts, without the fastest digits.
    first: u64,
    chunk: usize,
    index: u64,
    inside: u64,
}

/// The last number below `count` for which `holds`, which holds for 0 and then up to some number.
fn last_below(count: u64, holds: impl Fn(u64) -> bool) -> u64 {
    let (mut low, mut high) = (0, count);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// The bits of `words` that lie in `range`, word by word, with the number of the first bit of each.
fn masked(words: &[u64], range: Range<u64>) -> impl Iterator<Item = (u64, u64)> + '_ {
    let end = if range.is_empty() { range.start / 64 } else { range.end.div_ceil(64) };
    (range.start / 64..end).map(move |place| {
        let first = place * 64;
        let mut word = words[place as usize];
        if first < range.start {
            word &= u64::MAX << (range.start - first);
        }
        if range.end < first + 64 {
            word &= u64::MAX >> (first + 64 - range.end);
        }
        (first, word)
    })
}

fn count_ones(words: &[u64], range: Range<u64>) -> u64 {
    masked(words, range).map(|(_, word)| u64::from(word.count_ones())).sum()
}

/// The place of one number `index` in `range`.
fn nth_one(words: &[u64], range: Range<u64>, mut index: u64) -> Option<u64> {
    for (first, mut word) in masked(words, range) {
        let ones = u64::from(word.count_ones());
        if index >= ones {
            index -= ones;
            continue;
        }
        for _ in 0..index {
            word &= word - 1;
        }
        return Some(first + u64::from(word.trailing_zeros()));
    }
    None
}

/// A wrong value, and the point as values of the axes that tell it.
pub type Wrong = (f64, Vec<(Quantity, f64)>);

/// The first point of `block` that is kept and where `wrong` holds of the value of `quantity`, if there is one. `None` if too many combinations would have to be looked at.
pub fn first_wrong(block: &Block, quantity: Quantity, wrong: impl Fn(f64) -> bool + Sync) -> Option<Option<Wrong>> {
    let mut reads = vec![quantity];
    reads.extend(block.condition.iter().flat_map(Expression::reads));
    let roots = block.roots(&reads);
    let digits = Digits::new(block, &block.factors_of(&roots)).filter(|digits| digits.rows <= MOST_COMBINATIONS)?;
    let sampler = Sampler::new(block, &digits, &reads).with_labels(block, &digits, block.condition.as_ref());
    let search = |chunk: u64, scratch: &mut Scratch| -> Option<u64> {
        let end = ((chunk + 1) * LIMITS.chunk).min(digits.rows);
        let mut start = chunk * LIMITS.chunk;
        while start < end {
            let stop = (start + BATCH).min(end);
            sampler.load(start..stop, scratch);
            let kept = block.condition.as_ref().map(|condition| scratch.evaluate(condition).to_vec());
            let values = scratch.column(quantity);
            let found =
                (0..values.len()).find(|&i| kept.as_ref().is_none_or(|kept| kept[i] != 0.0) && wrong(values[i]));
            if let Some(place) = found {
                return Some(start + place as u64);
            }
            start = stop;
        }
        None
    };
    let chunks = digits.rows.div_ceil(LIMITS.chunk);
    let pool = (digits.rows >= WORTH_THREADS).then(|| rayon::ThreadPoolBuilder::new().build().ok()).flatten();
    let found = match pool {
        Some(pool) => pool.install(|| {
            let each = (0..chunks).into_par_iter().map_init(Scratch::default, |scratch, chunk| search(chunk, scratch));
            each.find_first(Option::is_some).flatten()
        }),
        None => {
            let mut scratch = Scratch::default();
            (0..chunks).find_map(|chunk| search(chunk, &mut scratch))
        }
    };
    Some(found.map(|row| {
        let mut scratch = Scratch::default();
        sampler.pick(&[row], &mut scratch);
        (scratch.column(quantity)[0], roots.iter().map(|root| (*root, scratch.column(*root)[0])).collect())
    }))
}

#[cfg(test)]
mod tests {
    //! Kept rows are those of nested loops, also where memory is short.

    use super::super::axis::{Axis, Values};
    use super::super::block::Factor;
    use super::super::quantity::Scale;
    use super::*;

    /// The factors `t_f`, `a`, `b`, `v_i`, `v_f` with the values 1, 2, 3 … each, and as many as `lengths` says.
    fn block(lengths: &[u64]) -> Arc<Block> {
        let factors = lengths.iter().zip(Quantity::ALL).map(|(&length, quantity)| {
            let values = Values::List((1..=length).map(|value| value as f64).collect());
            Factor { axes: vec![Axis { quantity, scale: Scale::Model, values }], labels: Vec::new() }
        });
        Arc::new(Block { factors: factors.collect(), ..Block::default() })
    }

    /// The kept rows over `factors`, by looking at every point.
    fn kept(lengths: &[u64], factors: &[usize], holds: impl Fn(&[u64]) -> bool) -> Vec<u64> {
        let points: u64 = lengths.iter().product();
        let mut rows: Vec<u64> = (0..points)
            .filter_map(|point| {
                let mut rest = point;
                let mut steps: Vec<u64> =
                    lengths.iter().rev().map(|length| (rest % length, rest /= length).0).collect();
                steps.reverse();
                let values: Vec<u64> = steps.iter().map(|step| step + 1).collect();
                let row = factors.iter().fold(0, |row, &factor| row * lengths[factor] + steps[factor]);
                holds(&values).then_some(row)
            })
            .collect();
        rows.sort_unstable();
        rows.dedup();
        rows
    }

    #[test]
    fn kept_rows_are_those_of_nested_loops() {
        type Holds = fn(&[u64]) -> bool;
        let conditions: [(&str, Holds); 7] = [
            ("v_f > v_i", |x| x[4] > x[3]),
            ("t_f < v_f", |x| x[0] < x[4]),
            ("t_f + b > v_f", |x| x[0] + x[2] > x[4]),
            ("a = 2", |x| x[1] == 2),
            ("b between 2 and 3 and t_f <> 1", |x| (2..=3).contains(&x[2]) && x[0] != 1),
            ("t_f * a * b * v_i * v_f > 30", |x| x.iter().product::<u64>() > 30),
            ("v_i > 100", |_| false),
        ];
        let limits = [
            LIMITS,
            Limits { bits: 0, ..LIMITS },
            Limits { chunk: 64, chunks: 1 << 22, bits: 0 },
            Limits { chunk: 64, chunks: 2, bits: 0 },
            Limits { chunk: 64, chunks: 2, bits: 1 << 26 },
        ];
        for lengths in [[3, 4, 2, 5, 6], [1, 3, 4, 1, 7], [70, 2, 1, 3, 2], [2, 1, 3, 2, 150]] {
            let block = block(&lengths);
            for (text, holds) in conditions {
                let condition = Expression::condition(text, &Quantity::ALL, None).expect("is a condition");
                for factors in [&[0, 1, 2, 3, 4][..], &[0, 2, 4], &[1], &[3, 4], &[]] {
                    let digits = Digits::new(&block, factors).expect("is small");
                    let expected = kept(&lengths, factors, holds);
                    for limits in limits {
                        let sieve = Sieve::within(limits, &block, &digits, &condition).expect("is small");
                        let place = format!("{text} over {factors:?} of {lengths:?} within {limits:?}");
                        assert_eq!(sieve.rows(), expected.len() as u64, "{place}");
                        let all: Vec<u64> = sieve.ranges(0..sieve.rows()).into_iter().flatten().collect();
                        assert_eq!(all, expected, "{place}");
                        for start in (0..expected.len()).step_by(1 + expected.len() / 7) {
                            let end = (start + 5).min(expected.len());
                            let some: Vec<u64> = sieve.ranges(start as u64..end as u64).into_iter().flatten().collect();
                            assert_eq!(some, expected[start..end], "{place}");
                        }
                    }
                }
            }
        }
    }
}
