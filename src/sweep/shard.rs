//! Shards: the distribution of the parts of a sweep over processes.
//!
//! It depends on the spec and the version alone, so the processes need no communication.

use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::ops::Range;
use std::str::FromStr;

use super::check::Sweep;
use super::plan::Plan;
use crate::grid::{SPLIT_MIX_INCREMENT, mixed};

/// The error of a sweep with too many parts for shards: every shard counts all parts, and lists a folder with as many files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "{parts} parts are too many for shards\n  expected: at most {}\n  help: divide an axis over several specs",
    Shard::MAX_PARTS
)]
pub struct TooManyParts {
    /// All parts of the sweep.
    pub parts: u64,
}

/// Shard number `index` of `count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: u64,
    count: u64,
}

impl Shard {
    /// Greatest number of shards. Chosen: beyond the array size of any scheduler.
    pub const MAX_COUNT: u64 = 1_000_000;

    /// Greatest number of parts in shards. Chosen: their distribution takes a tenth of a second.
    pub const MAX_PARTS: u64 = 1 << 23;

    /// The whole sweep.
    pub const WHOLE: Shard = Shard { index: 0, count: 1 };

    /// Shard number `index`, from 0, of `count`; `None` if it does not exist, or for more than [`Shard::MAX_COUNT`].
    pub fn new(index: u64, count: u64) -> Option<Shard> {
        (index < count && count <= Self::MAX_COUNT).then_some(Shard { index, count })
    }

    /// The index of this shard, from 0.
    pub fn index(self) -> u64 {
        self.index
    }

    /// The number of shards.
    pub fn count(self) -> u64 {
        self.count
    }

    /// The parts of this shard, table by table in the order of the plan, ascending.
    ///
    /// # Errors
    ///
    /// [`TooManyParts`]; a single shard may have any number.
    pub fn parts(self, sweep: &Sweep, plan: &Plan) -> Result<Vec<Vec<Range<u64>>>, TooManyParts> {
        if self.count == 1 {
            return Ok(plan.tables.iter().map(|table| std::iter::once(0..table.parts).collect()).collect());
        }
        check_parts(plan)?;
        let own =
            |first: u64, parts: u64| (0..parts).filter(move |part| shard_of(first + part, self.count) == self.index);
        let tables = first_numbers(sweep, plan).into_iter().zip(&plan.tables);
        Ok(tables.map(|(first, table)| own(first, table.parts).map(|part| part..part + 1).collect()).collect())
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let numbers = text.split_once('/').and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
        let (index, count): (u64, u64) =
            numbers.ok_or_else(|| format!("expected I/N, such as 0/16 for the first of 16 shards, found `{text}`"))?;
        if count == 0 || count > Self::MAX_COUNT {
            return Err(format!("{count} shards; expected from 1 to {}", Self::MAX_COUNT));
        }
        Shard::new(index, count)
            .ok_or_else(|| format!("no shard {index} of {count}: shards are numbered from 0 to {}", count - 1))
    }
}

/// Whether `part` is in `shard`, ascending ranges of parts.
pub fn contains_part(shard_parts: &[Range<u64>], part: u64) -> bool {
    shard_parts.get(shard_parts.partition_point(|range| range.end <= part)).is_some_and(|range| range.contains(&part))
}

/// Checks that the parts of `plan` can be distributed over shards.
///
/// # Errors
///
/// More parts than shards can distribute.
pub fn check_parts(plan: &Plan) -> Result<(), TooManyParts> {
    let parts = plan.tables.iter().fold(0, |parts: u64, table| parts.saturating_add(table.parts));
    if parts <= Shard::MAX_PARTS { Ok(()) } else { Err(TooManyParts { parts }) }
}

/// The shards among `count` with at least one part for which `wanted(table, part)` holds, ascending.
///
/// # Errors
///
/// [`TooManyParts`].
pub fn shards_with(
    sweep: &Sweep,
    plan: &Plan,
    count: u64,
    mut wanted: impl FnMut(usize, u64) -> bool,
) -> Result<Vec<u64>, TooManyParts> {
    check_parts(plan)?;
    let mut shards = BTreeSet::new();
    for (place, (first, table)) in first_numbers(sweep, plan).into_iter().zip(&plan.tables).enumerate() {
        let parts = (0..table.parts).filter(|part| wanted(place, *part));
        shards.extend(parts.map(|part| shard_of(first + part, count)));
    }
    Ok(shards.into_iter().collect())
}

/// The number of the first part of each table, if all parts are numbered from those of the greatest predicted cost on.
fn first_numbers(sweep: &Sweep, plan: &Plan) -> Vec<u64> {
    let cost = |place: usize| {
        let table = &plan.tables[place];
        table.rows.min(table.rows_per_part).saturating_mul(sweep.requests[place].table.cost())
    };
    let mut order: Vec<usize> = (0..plan.tables.len()).collect();
    order.sort_by_key(|&place| Reverse(cost(place)));
    let (mut firsts, mut next) = (vec![0; order.len()], 0);
    for place in order {
        firsts[place] = next;
        next += plan.tables[place].parts;
    }
    firsts
}

/// The shard among `count` of part `number`.
///
/// Parts are dealt in rounds, one part to each shard, so that the shards have equally many parts of each table, up to one. Each round begins with
/// another shard: otherwise periodic costs along a table would meet in one shard whenever their period divides the number of shards.
fn shard_of(number: u64, count: u64) -> u64 {
    let hash = mixed((number / count).wrapping_add(SPLIT_MIX_INCREMENT));
    (hash % count + number % count) % count
}

#[cfg(test)]
mod tests {
    //! Parts are dealt evenly, also for periodic costs along a table.

    use super::*;

    #[test]
    fn parts_are_dealt_evenly() {
        for count in (1..50).chain([64, 100, 699, 700, 1000]) {
            for parts in [0..700_u64, 700..713, 713..714] {
                let (least, most) = ((parts.end - parts.start) / count, (parts.end - parts.start).div_ceil(count));
                let mut loads = vec![0; count as usize];
                parts.for_each(|part| loads[shard_of(part, count) as usize] += 1);
                // Up to one of each round that is cut by an end of the table.
                assert!(
                    loads.iter().all(|load| (least.saturating_sub(1)..=most + 1).contains(load)),
                    "{count}: {loads:?}"
                );
            }
        }
    }

    #[test]
    fn costs_that_repeat_along_a_table_do_not_meet() {
        for count in [2_u64, 4, 8, 16] {
            // Every `count`-th part costs 100 times as much as predicted.
            let mut loads = vec![0; count as usize];
            (0..4096).for_each(|part| loads[shard_of(part, count) as usize] += if part % count == 0 { 100 } else { 1 });
            let mean = loads.iter().sum::<u64>() as f64 / count as f64;
            // As even as random; dealt in turn, one shard would have nearly all cost.
            assert!(loads.iter().all(|load| (*load as f64) < 1.6 * mean), "{count}: {loads:?}");
        }
    }

    #[test]
    fn messages_of_wrong_shards() {
        assert_eq!("3/16".parse(), Ok(Shard { index: 3, count: 16 }));
        for (text, message) in [
            ("16/16", "no shard 16 of 16: shards are numbered from 0 to 15"),
            ("0/0", "0 shards; expected from 1 to 1000000"),
            ("1", "expected I/N, such as 0/16 for the first of 16 shards, found `1`"),
            ("-1/4", "expected I/N, such as 0/16 for the first of 16 shards, found `-1/4`"),
            ("0/9999999", "9999999 shards; expected from 1 to 1000000"),
        ] {
            assert_eq!(text.parse::<Shard>(), Err(message.to_owned()));
        }
    }
}
