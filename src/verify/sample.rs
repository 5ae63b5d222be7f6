//! A reproducible sample of the rows of a table.

use std::collections::BTreeSet;

use crate::dataset::{CheckDepth, Folder, Foreign, Manifest, ManifestTable, Row, State, frame};
use crate::grid::{SPLIT_MIX_INCREMENT, mixed};

/// `count` different row numbers below `rows`, ascending (Floyd's sampling); all if there are no more.
fn choose(rows: u64, count: u64, seed: u64) -> BTreeSet<u64> {
    if count >= rows {
        return (0..rows).collect();
    }
    let mut state = seed;
    let mut chosen = BTreeSet::new();
    for last in rows - count..rows {
        state = state.wrapping_add(SPLIT_MIX_INCREMENT);
        let row = mixed(state) % (last + 1);
        chosen.insert(if chosen.contains(&row) { last } else { row });
    }
    chosen
}

/// The rows of a sample that can be read.
#[derive(Debug, Default)]
pub struct Sample {
    /// The rows, with their global numbers.
    pub rows: Vec<(u64, Row)>,
    /// Number of rows in missing parts.
    pub missing: u64,
    /// What is wrong with the first part that cannot be read.
    pub fault: Option<String>,
}

/// A sample of `count` rows of a table.
pub fn rows(folder: &Folder, manifest: &Manifest, table: &ManifestTable, count: u64, seed: u64) -> Sample {
    let chosen = choose(table.rows, count, seed);
    let mut sample = Sample::default();
    let numbers: BTreeSet<u64> = chosen.iter().map(|row| row / table.rows_per_part.max(1)).collect();
    for part in numbers {
        let range = table.rows_of(part);
        let inside = chosen.range(range.clone());
        let path = folder.part(&table.name, part);
        let expected = range.end - range.start;
        let damaged = |why| State::Damaged { why };
        let read = match folder.state(manifest, &table.name, part, CheckDepth::Whole) {
            State::There { .. } => frame::read_all(&path).map_err(|error| damaged(error.reason)),
            State::Missing => {
                sample.missing += inside.count() as u64;
                continue;
            }
            // The numbers of an edited part are compared, too.
            fault @ (State::Damaged { .. } | State::Foreign { why: Foreign::OtherProgram }) => {
                sample.fault.get_or_insert_with(|| folder.fault(&path, fault.clone()).to_string());
                frame::read_all(&path).map_err(|_| fault)
            }
            fault => Err(fault),
        };
        let read = read.and_then(|frame| match frame.height as u64 {
            height if height == expected => Ok(frame),
            height => Err(damaged(format!("{height} rows; the manifest lists {expected}"))),
        });
        match read {
            Ok(frame) => sample.rows.extend(inside.map(|&row| (row, frame.row((row - range.start) as usize)))),
            Err(fault) => _ = sample.fault.get_or_insert_with(|| folder.fault(&path, fault).to_string()),
        }
    }
    sample
}
