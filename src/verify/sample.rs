//! A reproducible sample of the rows of a table.

use std::collections::BTreeSet;

use crate::dataset::{CheckDepth, Folder, Manifest, ManifestTable, PROGRAM, Row, State, frame};

/// Steele, Lea and Flood's SplitMix64 (OOPSLA 2014): a counter, scrambled.
fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// `count` different row numbers below `rows`, ascending (Floyd's sampling); all if there are no more.
fn choose(rows: u64, count: u64, seed: u64) -> BTreeSet<u64> {
    if count >= rows {
        return (0..rows).collect();
    }
    let mut state = seed;
    let mut chosen = BTreeSet::new();
    for last in rows - count..rows {
        let row = next(&mut state) % (last + 1);
        chosen.insert(if chosen.contains(&row) { last } else { row });
    }
    chosen
}

/// The present rows of the sample, with their global numbers, and the number of rows in missing parts.
pub fn rows(
    folder: &Folder,
    manifest: &Manifest,
    table: &ManifestTable,
    count: u64,
    seed: u64,
) -> Result<(Vec<(u64, Row)>, u64), String> {
    let chosen = choose(table.rows, count, seed);
    let (mut found, mut missing) = (Vec::new(), 0);
    let numbers: BTreeSet<u64> = chosen.iter().map(|row| row / table.rows_per_part.max(1)).collect();
    for part in numbers {
        let range = table.rows_of(part);
        let inside: Vec<u64> = chosen.range(range.clone()).map(|row| row - range.start).collect();
        let path = folder.part(&table.name, part);
        match folder.state(manifest, &table.name, part, CheckDepth::Footer) {
            // The numbers of an edited part are compared, too.
            State::There { .. } | State::Damaged { .. } | State::Foreign { what: PROGRAM, .. } => {}
            State::Missing => {
                missing += inside.len() as u64;
                continue;
            }
            fault => return Err(folder.fault(&path, fault).to_string()),
        }
        let (frame, expected) = (frame::read_all(&path).map_err(|error| error.to_string())?, range.end - range.start);
        if frame.height as u64 != expected {
            return Err(format!("{}: {} rows; the manifest lists {expected}", path.display(), frame.height));
        }
        found.extend(inside.iter().map(|row| (row + range.start, frame.row(*row as usize))));
    }
    Ok((found, missing))
}
