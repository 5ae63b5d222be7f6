//! A survey of a dataset: present, missing, damaged and foreign parts.

use std::ops::Range;
use std::path::PathBuf;

use rayon::prelude::*;

use super::folder::Folder;
use super::manifest::Manifest;
use super::state::{CheckDepth, Foreign, State};
use super::statistics::TableStatistics;

/// The survey of a dataset folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Its tables, in the order of the manifest.
    pub tables: Vec<TableSurvey>,
    /// Temporary files of killed or active runs.
    pub temporary: Vec<PathBuf>,
    /// Files that do not belong to the dataset.
    pub others: Vec<PathBuf>,
}

/// The survey of a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TableSurvey {
    /// Its name.
    pub name: String,
    /// Number of rows.
    pub rows: u64,
    /// Number of parts.
    pub parts: u64,
    /// Number of present parts.
    pub there: u64,
    /// Missing parts, as ranges of their numbers.
    pub missing: Vec<Range<u64>>,
    /// Damaged parts, with the kind of damage.
    pub damaged: Vec<(u64, String)>,
    /// Foreign parts, with the reason.
    pub foreign: Vec<(u64, Foreign)>,
    /// The statistics of the existing parts.
    pub statistics: TableStatistics,
}

/// Parts inspected before their statistics are merged. Chosen: memory does not grow with the dataset, and merges are rare.
const PARTS_PER_MERGE: usize = 1 << 10;

impl TableSurvey {
    /// Whether part number `part` is present.
    pub fn has(&self, part: u64) -> bool {
        // All three lists are in the order of parts.
        let after = self.missing.partition_point(|range| range.end <= part);
        !self.missing.get(after).is_some_and(|range| range.contains(&part))
            && self.damaged.binary_search_by_key(&part, |(damaged, _)| *damaged).is_err()
            && self.foreign.binary_search_by_key(&part, |(foreign, _)| *foreign).is_err()
    }

    /// Records missing parts; they must follow all recorded ones.
    fn miss(&mut self, parts: Range<u64>) {
        match self.missing.last_mut() {
            _ if parts.is_empty() => {}
            Some(range) if range.end == parts.start => range.end = parts.end,
            _ => self.missing.push(parts),
        }
    }
}

impl Survey {
    /// Surveys the dataset of `manifest` in `folder`: inspects every part to the depth `look`, on all processors.
    pub fn new(folder: &Folder, manifest: &Manifest, look: CheckDepth) -> Survey {
        // Without further threads, this one does all the work.
        let pool = rayon::ThreadPoolBuilder::new().build().ok();
        let tables = manifest.tables.iter().map(|table| {
            let mut survey = TableSurvey {
                name: table.name.clone(),
                rows: table.rows,
                parts: table.parts,
                ..TableSurvey::default()
            };
            let mut next = 0;
            let there = folder.parts_there(table);
            let states = there.chunks(PARTS_PER_MERGE).flat_map(|parts| {
                let look = |part: &u64| (*part, folder.state(manifest, &table.name, *part, look));
                match &pool {
                    Some(pool) => pool.install(|| parts.par_iter().with_max_len(1).map(look).collect::<Vec<_>>()),
                    None => parts.iter().map(look).collect(),
                }
            });
            for (part, state) in states {
                survey.miss(next..part);
                next = part + 1;
                match state {
                    State::There { statistics } => {
                        survey.there += 1;
                        survey.statistics = std::mem::take(&mut survey.statistics).merge(*statistics);
                    }
                    // It was just removed.
                    State::Missing => survey.miss(part..part + 1),
                    State::Damaged { why } => survey.damaged.push((part, why)),
                    State::Foreign { why } => survey.foreign.push((part, why)),
                }
            }
            survey.miss(next..table.parts);
            survey
        });
        let tables = tables.collect();
        let (temporary, others) = folder.strays(manifest);
        Survey { tables, temporary, others }
    }

    /// Whether every part is present.
    pub fn is_complete(&self) -> bool {
        self.tables.iter().all(|table| table.there == table.parts)
    }
}
