//! Tables that are computed row by row, each row on its own.

use std::ops::Range;

use rayon::prelude::*;

use super::{Job, Sheet, Stopped, Work};
use crate::grid::{Point, Quantity, Runs};
use crate::protocol::Status;

/// Computes `rows` with `row`, which fills the cells of all `width` columns of the table (given as missing) and returns the status.
///
/// Rows are spread over the threads in chunks of `chunk` rows.
pub fn each(
    job: &Job<'_>,
    rows: Range<u64>,
    (width, chunk): (usize, usize),
    sheet: &mut Sheet,
    row: impl Fn(u64, &Point, &mut [f64]) -> (Status, Work) + Sync,
) -> Result<Work, Stopped> {
    // Values are taken from the axes once a step, not once a row.
    let axes: Vec<Steps<'_>> = Quantity::ALL
        .into_iter()
        .filter_map(|quantity| {
            let runs = job.rows.runs(quantity, rows.clone())?;
            Some(Steps { quantity, values: runs.values(), runs })
        })
        .collect();
    let starts = rows.clone().step_by(chunk);
    let mut columns: Vec<_> = sheet.columns.iter_mut().map(|column| column.chunks_mut(chunk)).collect();
    let chunks: Vec<Chunk<'_>> = starts
        .zip(sheet.status.chunks_mut(chunk))
        .map(|(start, status)| Chunk {
            start,
            columns: columns.iter_mut().filter_map(Iterator::next).collect(),
            status,
        })
        .collect();
    let works = chunks.into_par_iter().with_max_len(1).map(|chunk| {
        job.signal.check()?;
        let count = chunk.status.len() as u64;
        let work = chunk.compute(job, &axes, width, &row);
        job.signal.advance(count);
        Ok(work)
    });
    Ok(works.collect::<Result<Vec<Work>, Stopped>>()?.into_iter().sum())
}

/// An axis over the rows of a part.
struct Steps<'a> {
    quantity: Quantity,
    values: Vec<f64>,
    runs: Runs<'a>,
}

/// The cells of consecutive rows.
struct Chunk<'a> {
    start: u64,
    /// The selected columns.
    columns: Vec<&'a mut [f64]>,
    status: &'a mut [Status],
}

impl Chunk<'_> {
    fn compute(
        mut self,
        job: &Job<'_>,
        axes: &[Steps<'_>],
        width: usize,
        row: &impl Fn(u64, &Point, &mut [f64]) -> (Status, Work),
    ) -> Work {
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
        let (mut point, mut cells) = (Point::default(), vec![f64::NAN; width]);
        let mut work = Work::default();
        for place in 0..count {
            for (quantity, values) in &values {
                point[*quantity] = values[place];
            }
            cells.fill(f64::NAN);
            let (status, spent) = row(self.start + place as u64, &point, &mut cells);
            self.status[place] = status;
            for (column, &index) in self.columns.iter_mut().zip(job.selection.indices()) {
                column[place] = cells[index];
            }
            work += spent;
        }
        work
    }
}
