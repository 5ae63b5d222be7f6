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
    // Axis values are scaled once a step, not once a row.
    let axis = |quantity| {
        let runs = view.runs(quantity, rows.clone())?;
        Some((quantity, runs.map(|value| job.grid.scaled_value(quantity, value))))
    };
    let axes: Vec<(Quantity, Runs)> = Quantity::ALL.into_iter().filter_map(axis).collect();
    let sizes: Vec<f64> = job.projection.indices().iter().map(|&index| fields[index].column.size(job.grid)).collect();
    in_chunks(job, buffer, chunk, |RowChunk { place, mut columns, status }| {
        let start = rows.start + place as u64;
        let end = start + status.len() as u64;
        let values: Vec<_> = axes.iter().map(|(quantity, runs)| (*quantity, runs.cells(start..end))).collect();
        let mut point = Point::default();
        let mut work = RunStats::default();
        let mut tuple = tuples.partition_point(|(_, rows)| rows.end <= start);
        for (place, (at, status)) in (start..end).zip(status).enumerate() {
            while tuples[tuple].1.end <= at {
                tuple += 1;
            }
            for (quantity, values) in &values {
                point[*quantity] = values[place];
            }
            failpoint::panic_at(std::iter::once(at));
            let (found, values, spent) = row(tuples[tuple].0, &point);
            *status = found;
            for ((column, &index), size) in columns.iter_mut().zip(job.projection.indices()).zip(&sizes) {
                column[place] = values.as_ref().map_or(f64::NAN, fields[index].cell) * size;
            }
            work += spent;
        }
        work
    })
}

/// Consecutive rows of a buffer.
pub(super) struct RowChunk<'a> {
    /// The place of the first one in the buffer.
    pub(super) place: usize,
    /// The cells of the projected columns.
    pub(super) columns: Vec<&'a mut [f64]>,
    pub(super) status: &'a mut [Status],
}

/// Fills `buffer` in chunks of `length` rows on all threads, which take them one by one: their cost varies widely. A single chunk stays on this
/// thread, since waking another takes longer than a row.
///
/// # Errors
///
/// A stop on request.
pub(super) fn in_chunks(
    job: &Job<'_>,
    buffer: &mut ColumnBuffer,
    length: usize,
    compute: impl Fn(RowChunk<'_>) -> RunStats + Sync,
) -> Result<RunStats, Stopped> {
    let mut columns: Vec<_> = buffer.columns.iter_mut().map(|column| column.chunks_mut(length)).collect();
    let chunk = |(number, status)| RowChunk {
        place: number * length,
        columns: columns.iter_mut().filter_map(Iterator::next).collect(),
        status,
    };
    let chunks: Vec<RowChunk<'_>> = buffer.status.chunks_mut(length).enumerate().map(chunk).collect();
    let compute = |chunk: RowChunk<'_>| {
        job.signal.check()?;
        let rows = chunk.status.len() as u64;
        let work = compute(chunk);
        job.signal.advance(rows);
        Ok(work)
    };
    if chunks.len() <= 1 {
        return chunks.into_iter().map(compute).sum();
    }
    let works = chunks.into_par_iter().with_max_len(1).map(compute);
    Ok(works.collect::<Result<Vec<RunStats>, Stopped>>()?.into_iter().sum())
}
