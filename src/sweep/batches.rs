//! A table of a sweep as Arrow record batches in row order, without a file.

use std::sync::Arc;

use arrow_array::RecordBatch;
use arrow_schema::{ArrowError, SchemaRef};

use super::check::{Request, Sweep};
use crate::dataset::{Layout, batch};
use crate::table::{ColumnBuffer, OptimumCache, Signal};

/// An iterator over the batches of a table. All threads compute the next batch on request.
pub struct Batches<'a> {
    sweep: &'a Sweep,
    request: &'a Request,
    layout: Layout,
    optimum_cache: Arc<OptimumCache>,
    /// The first row of the next batch.
    next: u64,
}

impl Sweep {
    /// The rows of a table as Arrow record batches, with the columns, types, units and row order of the Parquet files of a run.
    /// `None` if the spec does not request this table.
    pub fn batches(&self, table: &str) -> Option<Batches<'_>> {
        let mut tables = self.requests.iter().zip(self.optimum_cache());
        let (request, optimum_cache) = tables.find(|(request, _)| request.table.name() == table)?;
        let layout = Layout::new(request.table, &request.projection, &self.grid);
        Some(Batches { sweep: self, request, layout, optimum_cache, next: 0 })
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
        // A batch has the rows of a part.
        let end = self.next.saturating_add(self.request.table.rows_per_part()).min(self.request.rows);
        let rows = self.next..end;
        self.next = end;
        if rows.is_empty() {
            return None;
        }
        let signal = Signal::default();
        let job = self.sweep.job(self.request, &self.optimum_cache, &signal);
        let mut buffer = ColumnBuffer::new(self.request.projection.indices().len());
        buffer.resize((rows.end - rows.start) as usize);
        // The signal is private, so nothing stops the computation.
        self.request.table.compute(&job, rows.clone(), &mut buffer).ok()?;
        Some(batch(&self.layout, job.rows, rows, buffer))
    }
}
