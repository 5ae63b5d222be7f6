//! A table of a sweep as Arrow record batches in row order, without a file.

use std::sync::Arc;

use arrow_array::RecordBatch;
use arrow_schema::{ArrowError, SchemaRef};

use super::check::{Request, Sweep};
use super::plan::Plan;
use crate::dataset::{Layout, ManifestTable, batch};
use crate::table::{ColumnBuffer, OptimumCache, Signal};

/// An iterator over the batches of a table. All threads compute the next batch on request.
pub struct Batches<'a> {
    sweep: &'a Sweep,
    request: &'a Request,
    table: ManifestTable,
    layout: Layout,
    optimum_cache: Arc<OptimumCache>,
    next: u64,
}

impl Sweep {
    /// The rows of a table as Arrow record batches, with the columns, types, units and row order of the Parquet files of a run.
    /// `None` if the spec does not request this table.
    pub fn batches(&self, table: &str) -> Option<Batches<'_>> {
        let plan = Plan::new(self);
        let tables = self.requests.iter().zip(plan.tables).zip(self.optimum_cache());
        let ((request, table), optimum_cache) = tables.into_iter().find(|((_, planned), _)| planned.name == table)?;
        Some(Batches {
            sweep: self,
            request,
            table,
            layout: Layout::new(request.table, &request.projection, &self.grid),
            optimum_cache,
            next: 0,
        })
    }
}

impl Batches<'_> {
    /// The schema of every batch, with units and meanings in the field metadata.
    pub fn schema(&self) -> SchemaRef {
        self.layout.schema.clone()
    }
}

impl Iterator for Batches<'_> {
    type Item = Result<RecordBatch, ArrowError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.next >= self.table.parts {
            return None;
        }
        let rows = self.table.rows_of(self.next);
        self.next += 1;
        let signal = Signal::default();
        let job = self.sweep.job(self.request, &self.optimum_cache, &signal);
        let mut buffer = ColumnBuffer::new(self.request.projection.indices().len());
        buffer.resize((rows.end - rows.start) as usize);
        // The signal is private, so nothing stops the computation.
        self.request.table.compute(&job, rows.clone(), &mut buffer).ok()?;
        Some(batch(&self.layout, job.rows, rows, buffer))
    }
}
