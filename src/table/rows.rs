//! Tables whose rows are computed independently.

use std::ops::Range;

use rayon::prelude::*;

use super::failpoint;
use super::{ColumnBuffer, Field, Job, RunStats, Stopped};
use crate::grid::{Point, Quantity, Runs};
use crate::protocol::Status;

/// A computed row: its status, its values if any, and solver statistics.
pub type ComputedRow<R> = (Status, Option<R>, RunStats);

/// Computes `rows` by calling `row` with the tuple number and the point of each. A row without values has missing cells.
///
/// The threads take chunks of `chunk` rows.
///
/// # Errors
///
/// A stop on request.
pub fn each<R>(
    job: &Job<'_>,
    rows: Range<u64>,
    chunk: usize,
    buffer: &mut ColumnBuffer,
    fields: &[Field<R>],
    row: impl Fn(u64, &Point) -> ComputedRow<R> + Sync,
) -> Result<RunStats, Stopped> {
    let view = job.rows.view(rows.clone());
    let tuples = view.tuples(&job.tuples, rows.clone());
    // Axis values are read once a step, not once a row.
    let axes: Vec<Steps> = Quantity::ALL
        .into_iter()
        .filter_map(|quantity| {
            let runs = view.runs(quantity, rows.clone())?;
            let values = runs.values().iter().map(|value| job.grid.scaled_value(quantity, *value)).collect();
            Some(Steps { quantity, runs, values })
        })
        .collect();
    let starts = rows.clone().step_by(chunk);
    let mut columns: Vec<_> = buffer.columns.iter_mut().map(|column| column.chunks_mut(chunk)).collect();
    let chunks: Vec<RowChunk<'_>> = starts
        .zip(buffer.status.chunks_mut(chunk))
        .map(|(start, status)| RowChunk {
            start,
            columns: columns.iter_mut().filter_map(Iterator::next).collect(),
            status,
        })
        .collect();
    on_all_threads(chunks, |chunk| {
        job.signal.check()?;
        let count = chunk.status.len() as u64;
        let work = chunk.compute(job, &axes, &tuples, fields, &row);
        job.signal.advance(count);
        Ok(work)
    })
}

/// Computes `chunks` on all threads, which take them one by one: their cost varies widely. A single chunk stays on this thread, since waking
/// another takes longer than a row.
pub(super) fn on_all_threads<C: Send>(
    chunks: Vec<C>,
    compute: impl Fn(C) -> Result<RunStats, Stopped> + Sync + Send,
) -> Result<RunStats, Stopped> {
    if chunks.len() <= 1 {
        return chunks.into_iter().map(compute).sum();
    }
    let works = chunks.into_par_iter().with_max_len(1).map(compute);
    Ok(works.collect::<Result<Vec<RunStats>, Stopped>>()?.into_iter().sum())
}

/// An axis over the rows of a part, its values in the units of the model.
struct Steps {
    quantity: Quantity,
    runs: Runs,
    values: Vec<f64>,
}

/// The cells of consecutive rows.
struct RowChunk<'a> {
    start: u64,
    /// The projected columns.
    columns: Vec<&'a mut [f64]>,
    status: &'a mut [Status],
}

impl RowChunk<'_> {
    fn compute<R>(
        mut self,
        job: &Job<'_>,
        axes: &[Steps],
        tuples: &[(u64, Range<u64>)],
        fields: &[Field<R>],
        row: &impl Fn(u64, &Point) -> ComputedRow<R>,
    ) -> RunStats {
        let count = self.status.len();
        let values: Vec<(Quantity, Vec<f64>)> = axes
            .iter()
            .map(|axis| {
                let mut values = Vec::with_capacity(count);
                for (step, length) in axis.runs.over(self.start..self.start + count as u64) {
                    values.resize(values.len() + length, axis.values[step]);
                }
                (axis.quantity, values)
            })
            .collect();
        let mut point = Point::default();
        let mut work = RunStats::default();
        let mut tuple = tuples.partition_point(|(_, rows)| rows.end <= self.start);
        for place in 0..count {
            let at = self.start + place as u64;
            while tuples[tuple].1.end <= at {
                tuple += 1;
            }
            for (quantity, values) in &values {
                point[*quantity] = values[place];
            }
            failpoint::panic_at(std::iter::once(at));
            let (status, values, spent) = row(tuples[tuple].0, &point);
            self.status[place] = status;
            for ((column, &index), size) in self.columns.iter_mut().zip(job.projection.indices()).zip(job.sizes) {
                column[place] = values.as_ref().map_or(f64::NAN, fields[index].cell) * size;
            }
            work += spent;
        }
        work
    }
}
