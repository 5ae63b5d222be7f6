//! Tables that are computed row by row, each row on its own.

use std::ops::Range;

use rayon::prelude::*;

use super::{Job, Sheet, Stopped, Work};
use crate::grid::Point;
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
    let starts: Vec<u64> = rows.clone().step_by(chunk).collect();
    let chunks: Vec<Chunk> = starts
        .into_par_iter()
        .with_max_len(1)
        .map(|start| {
            job.signal.check()?;
            let end = rows.end.min(start + chunk as u64);
            let mut done = Chunk::default();
            let mut cells = vec![f64::NAN; width];
            for number in start..end {
                cells.fill(f64::NAN);
                let (status, work) = row(number, &job.rows.point(number), &mut cells);
                done.status.push(status);
                done.cells.extend(job.selection.indices().iter().map(|&column| cells[column]));
                done.work += work;
            }
            job.signal.advance(end - start);
            Ok(done)
        })
        .collect::<Result<_, Stopped>>()?;
    sheet.status.clear();
    sheet.columns.iter_mut().for_each(Vec::clear);
    let mut work = Work::default();
    for done in chunks {
        sheet.status.extend(done.status);
        for (column, cells) in sheet.columns.iter_mut().enumerate() {
            cells.extend(done.cells.iter().skip(column).step_by(job.selection.indices().len()));
        }
        work += done.work;
    }
    Ok(work)
}

/// The selected cells of a few rows, row by row.
#[derive(Default)]
struct Chunk {
    cells: Vec<f64>,
    status: Vec<Status>,
    work: Work,
}
