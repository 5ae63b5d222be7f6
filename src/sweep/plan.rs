//! The plan: what there is to do, counted before anything is done.

use std::ops::Range;

use super::check::{Request, Sweep};
use crate::dataset::{Footer, Manifest, ManifestTable};
use crate::table::{Job, OPTIMUM_AXES, Optima, Signal};

/// What a sweep consists of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// The tables.
    pub tables: Vec<ManifestTable>,
    /// Different optimal protocols that the tables share.
    pub optima: u64,
}

impl Plan {
    /// Counts everything in `sweep`, however large, at once.
    pub fn new(sweep: &Sweep) -> Plan {
        let tables = sweep.requests.iter().map(|request| {
            let rows_per_part = request.table.rows_per_part();
            ManifestTable {
                name: request.table.name().to_owned(),
                rows: request.rows,
                parts: request.rows.div_ceil(rows_per_part),
                rows_per_part,
            }
        });
        Plan { tables: tables.collect(), optima: sweep.optimum_tuples() }
    }

    /// The manifest of the dataset.
    pub fn manifest(&self, sweep: &Sweep) -> Manifest {
        Manifest {
            name: sweep.name.clone(),
            identity: sweep.identity(),
            tables: self.tables.clone(),
            spec: sweep.text.clone(),
        }
    }
}

impl Sweep {
    /// The job of one of its tables; `None` if the rows cannot be counted, which a checked sweep excludes.
    pub fn job<'a>(&'a self, request: &'a Request, optima: &'a Optima, signal: &'a Signal) -> Option<Job<'a>> {
        let rows = self.grid.project(request.table.axes())?;
        let tuples = rows.tuples(OPTIMUM_AXES);
        Some(Job {
            grid: &self.grid,
            rows,
            tuples,
            selection: &request.selection,
            bounded: self.bounded,
            rtol: request.rtol,
            optima,
            signal,
        })
    }
}

/// What a part says of itself.
pub fn footer(manifest: &Manifest, table: &str, rows: Range<u64>) -> Footer {
    Footer {
        spec: manifest.spec.clone(),
        spec_hash: manifest.identity.spec_hash.clone(),
        version: manifest.identity.version.clone(),
        table: table.to_owned(),
        rows,
    }
}
