//! The plan: counts of rows and solves, before any computation.

use super::check::{Request, Sweep};
use crate::dataset::{Build, Manifest, ManifestTable};
use crate::table::{Job, OPTIMUM_AXES, OptimumCache, Signal};

/// The plan of a sweep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// The tables.
    pub tables: Vec<ManifestTable>,
    /// Rows of each table that `where` drops.
    pub dropped: Vec<u64>,
    /// Different optimal protocols shared by the tables.
    pub optima: u64,
}

impl Plan {
    /// Counts rows and solves of `sweep` in closed form.
    pub fn new(sweep: &Sweep) -> Plan {
        let tables = sweep.requests.iter().map(|request| {
            let rows_per_part = request.table.rows_per_part();
            ManifestTable {
                name: request.table.name().to_owned(),
                hash: sweep.hash(request),
                rows: request.rows,
                parts: request.rows.div_ceil(rows_per_part),
                rows_per_part,
            }
        });
        let dropped = sweep.requests.iter().map(|request| request.row_index.dropped()).collect();
        Plan { tables: tables.collect(), dropped, optima: sweep.optimum_tuples() }
    }

    /// The manifest of the dataset.
    pub fn manifest(&self, sweep: &Sweep) -> Manifest {
        Manifest {
            name: sweep.name.clone(),
            build: Build::this(),
            tables: self.tables.clone(),
            spec: sweep.text.clone(),
            rebuilt: None,
        }
    }
}

impl Sweep {
    /// The job of one of its tables.
    pub fn job<'a>(&'a self, request: &'a Request, optimum_cache: &'a OptimumCache, signal: &'a Signal) -> Job<'a> {
        Job {
            grid: &self.grid,
            rows: &request.row_index,
            tuples: request.row_index.tuples(OPTIMUM_AXES),
            members: request.members.as_ref(),
            projection: &request.projection,
            bounded: self.bounded,
            friction: self.friction,
            rtol: request.rtol,
            optimum_cache,
            signal,
        }
    }
}
