//! Shards: the distribution of the parts of a sweep over processes.
//!
//! It depends on the spec and the version alone, so the processes need no communication.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};
use std::ops::Range;
use std::str::FromStr;

use super::check::Sweep;
use super::plan::Plan;

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
        let mut parts = vec![Vec::new(); plan.tables.len()];
        deal(&part_groups(sweep, plan), self.count, |table, part, shard| {
            if shard == self.index {
                parts[table].push(part..part + 1);
            }
        });
        // The last part of a table is a group of its own.
        parts.iter_mut().for_each(|parts| parts.sort_unstable_by_key(|range| range.start));
        Ok(parts)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let form = || format!("expected I/N, such as 0/16 for the first of 16 shards, found `{text}`");
        let (index, count) = text.split_once('/').ok_or_else(form)?;
        let [index, count]: [u64; 2] = match (index.parse(), count.parse()) {
            (Ok(index), Ok(count)) => [index, count],
            _ => return Err(form()),
        };
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
    deal(&part_groups(sweep, plan), count, |table, part, shard| {
        if wanted(table, part) {
            shards.insert(shard);
        }
    });
    Ok(shards.into_iter().collect())
}

/// Parts of equal predicted cost: consecutive parts of one table.
#[derive(Debug, Clone, PartialEq, Eq)]
struct PartGroup {
    table: usize,
    parts: Range<u64>,
    /// Cost of a part, in nanoseconds.
    cost: u64,
}

/// The parts of a sweep in groups, the most expensive first. All parts of a table but the last have equal rows, and so equal predicted cost.
fn part_groups(sweep: &Sweep, plan: &Plan) -> Vec<PartGroup> {
    let mut part_groups = Vec::new();
    for (index, (request, table)) in sweep.requests.iter().zip(&plan.tables).enumerate() {
        let full = table.rows / table.rows_per_part;
        for parts in [0..full, full..table.parts] {
            if !parts.is_empty() {
                let rows = table.rows_of(parts.start);
                let cost = (rows.end - rows.start).saturating_mul(request.table.cost());
                part_groups.push(PartGroup { table: index, parts, cost });
            }
        }
    }
    part_groups.sort_by_key(|group| Reverse(group.cost));
    part_groups
}

/// Passes every part, by table and number, and its shard among `count` to `take`.
///
/// The parts of a group are dealt in rounds, one part to each shard. The remaining parts of all groups go, most expensive first, to the shard
/// with least cost. No shard then exceeds the mean by more than one part. Each round begins with another shard: otherwise periodic costs along a
/// table would meet in one shard whenever their period divides the number of shards.
fn deal(part_groups: &[PartGroup], count: u64, mut take: impl FnMut(usize, u64, u64)) {
    let mut loads: BinaryHeap<Reverse<(u64, u64, u64)>> =
        (0..count).map(|shard| Reverse((0, mix(shard), shard))).collect();
    for PartGroup { table, parts, cost } in part_groups {
        let rounds = (parts.end - parts.start) / count;
        for round in 0..rounds {
            let first = mix(round ^ mix(*table as u64)) % count;
            (0..count).for_each(|place| take(*table, parts.start + round * count + place, (first + place) % count));
        }
        for part in parts.start + rounds * count..parts.end {
            let Some(Reverse((load, order, shard))) = loads.pop() else { break };
            take(*table, part, shard);
            loads.push(Reverse((load.saturating_add(*cost), mix(order), shard)));
        }
    }
}

/// A hash of `x`: the finalizer of SplitMix64 after its increment.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    //! Every part is dealt once and evenly, also for periodic costs along a table.

    use super::*;

    fn part_groups() -> Vec<PartGroup> {
        [(0, 0..700, 20), (0, 700..701, 7), (1, 0..13, 90), (2, 0..1, 4), (3, 0..60, 1)]
            .map(|(table, parts, cost)| PartGroup { table, parts, cost })
            .into()
    }

    #[test]
    fn every_part_is_dealt_once_and_loads_differ_by_one_part() {
        let mut part_groups = part_groups();
        part_groups.sort_by_key(|group| Reverse(group.cost));
        let total: u64 = part_groups.iter().map(|group| group.cost * (group.parts.end - group.parts.start)).sum();
        for count in (1..50).chain([64, 100, 699, 700, 775, 776, 1000]) {
            let mut loads = vec![0; count as usize];
            let mut dealt = std::collections::BTreeMap::new();
            deal(&part_groups, count, |table, part, shard| {
                let group = part_groups.iter().find(|group| group.table == table && group.parts.contains(&part));
                loads[shard as usize] += group.expect("is of a pile").cost;
                assert_eq!(dealt.insert((table, part), shard), None);
            });
            assert_eq!(dealt.len(), 701 + 13 + 1 + 60);
            assert_eq!(loads.iter().sum::<u64>(), total);
            let greatest = loads.iter().copied().max().unwrap_or(0);
            assert!(greatest as f64 <= total as f64 / count as f64 + 90.0, "{count}: {greatest}");
        }
    }

    #[test]
    fn costs_that_repeat_along_a_table_do_not_meet() {
        let part_groups = [PartGroup { table: 0, parts: 0..4096, cost: 10 }];
        for count in [2_u64, 4, 8, 16] {
            // Every `count`-th part costs 100 times as much as predicted.
            let mut loads = vec![0; count as usize];
            deal(&part_groups, count, |_, part, shard| {
                loads[shard as usize] += if part % count == 0 { 100 } else { 1 }
            });
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
