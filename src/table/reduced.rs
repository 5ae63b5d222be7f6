//! `gap_min`, `gap_quantiles`, `gap_histogram`: the landscape of a transition and duration reduced to one row.
//!
//! The landscape is computed in blocks, as `gap` computes it, and discarded. The results do not depend on the blocks: counts, a minimum whose
//! ties go to the first row, and quantiles that are values of the landscape.

use std::ops::Range;

use super::gap;
use super::optimum_cache::OPTIMUM_AXES;
use super::{Column, ColumnBuffer, Definition, Job, Kind, Projection, RunStats, Signal, Stopped};
use crate::grid::Quantity;
use crate::protocol::Status;

/// The reduction of a landscape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reduction {
    Minimum,
    Quantiles,
    Histogram,
}

/// The shortcut of least gap.
pub static MINIMUM: Definition = reduced(
    "gap_min",
    "the shortcut of least gap of a landscape (reduce = \"min\" of gap)",
    MINIMUM_COLUMNS,
    |job, rows, buffer| compute(Reduction::Minimum, job, rows, buffer),
);

/// Quantiles of the gap.
pub static QUANTILES: Definition = reduced(
    "gap_quantiles",
    "quantiles of the gap of a landscape (reduce = \"quantiles\" of gap)",
    QUANTILE_COLUMNS,
    |job, rows, buffer| compute(Reduction::Quantiles, job, rows, buffer),
);

/// Numbers of shortcuts by decades of the gap.
pub static HISTOGRAM: Definition = reduced(
    "gap_histogram",
    "histogram of the gap of a landscape (reduce = \"histogram\" of gap)",
    HISTOGRAM_COLUMNS,
    |job, rows, buffer| compute(Reduction::Histogram, job, rows, buffer),
);

/// One row for each transition and duration. The cost is that of a landscape of 400 x 400 shortcuts.
const fn reduced(
    name: &'static str,
    doc: &'static str,
    columns: &'static [Column],
    compute: fn(&Job<'_>, Range<u64>, &mut ColumnBuffer) -> Result<RunStats, Stopped>,
) -> Definition {
    let needs_optimum = |_: &Projection| true;
    Definition {
        name,
        doc,
        axes: OPTIMUM_AXES,
        columns,
        rows_per_part: 1 << 8,
        cost: 16_000_000,
        needs_optimum,
        compute,
    }
}

/// Rows of a landscape in memory at a time.
const BLOCK_ROWS: usize = 1 << 16;

/// Greatest number of shortcuts of a row of `gap_quantiles`, whose gaps are sorted in memory.
pub const MAX_SORTED: u64 = 1 << 21;

const COUNT: Column =
    Column::number("shortcuts", "1", "number of shortcuts with status ok; only these enter the other columns");

const MINIMUM_COLUMNS: &[Column] = &[
    COUNT,
    Column::new("alpha_2", Kind::Quantity(Quantity::Alpha2), "coefficient of t of the shortcut of least gap"),
    Column::new("alpha_3", Kind::Quantity(Quantity::Alpha3), "coefficient of t^2 of the shortcut of least gap"),
    Column::number("work", "mu_0 sigma l", "its work of friction W_s"),
    Column::number("work_optimal", "mu_0 sigma l", "least work of friction W* of any protocol"),
    Column::number("gap", "1", "least (W_s - W*)/W*; ties go to the first row of the landscape"),
    Column::number("v_min", "v_0", "its least velocity"),
];

/// The quantiles in percent: the least gap that this percentage of the shortcuts does not exceed.
const PERCENTAGES: [u64; 7] = [0, 5, 25, 50, 75, 95, 100];

const QUANTILE_COLUMNS: &[Column] = &[
    COUNT,
    Column::number("gap_min", "1", "least gap"),
    Column::number("gap_q05", "1", "least gap that at least 5 % of the shortcuts do not exceed"),
    Column::number("gap_q25", "1", "least gap that at least 25 % of the shortcuts do not exceed"),
    Column::number("gap_q50", "1", "least gap that at least 50 % of the shortcuts do not exceed"),
    Column::number("gap_q75", "1", "least gap that at least 75 % of the shortcuts do not exceed"),
    Column::number("gap_q95", "1", "least gap that at least 95 % of the shortcuts do not exceed"),
    Column::number("gap_max", "1", "greatest gap"),
];

/// Lower edges of the classes of the histogram, without the first.
pub const EDGES: [f64; 10] = [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0];

const HISTOGRAM_COLUMNS: &[Column] = &[
    COUNT,
    Column::number("below_1e_8", "1", "shortcuts with a gap below 1e-8"),
    Column::number("from_1e_8", "1", "shortcuts with a gap from 1e-8 to below 1e-7"),
    Column::number("from_1e_7", "1", "shortcuts with a gap from 1e-7 to below 1e-6"),
    Column::number("from_1e_6", "1", "shortcuts with a gap from 1e-6 to below 1e-5"),
    Column::number("from_1e_5", "1", "shortcuts with a gap from 1e-5 to below 1e-4"),
    Column::number("from_1e_4", "1", "shortcuts with a gap from 1e-4 to below 1e-3"),
    Column::number("from_1e_3", "1", "shortcuts with a gap from 1e-3 to below 0.01"),
    Column::number("from_1e_2", "1", "shortcuts with a gap from 0.01 to below 0.1"),
    Column::number("from_1e_1", "1", "shortcuts with a gap from 0.1 to below 1"),
    Column::number("from_1", "1", "shortcuts with a gap from 1 to below 10"),
    Column::number("from_10", "1", "shortcuts with a gap of 10 or more"),
];

fn compute(
    reduction: Reduction,
    job: &Job<'_>,
    rows: Range<u64>,
    buffer: &mut ColumnBuffer,
) -> Result<RunStats, Stopped> {
    let Some(members) = job.members else {
        // A checked sweep has them.
        buffer.columns.iter_mut().for_each(|column| column.fill(f64::NAN));
        buffer.status.fill(Status::NotConverged);
        return Ok(RunStats::default());
    };
    let each = members.rows() / job.rows.rows().max(1);
    let (projection, signal) = (Projection::usual(gap::COLUMNS), Signal::default());
    let tuples = members.tuples(OPTIMUM_AXES);
    // Progress counts rows of this table, not of the landscape.
    let sizes: Vec<f64> = gap::COLUMNS.iter().map(|column| column.size(job.grid)).collect();
    let landscape = Job {
        rows: members,
        tuples,
        projection: &projection,
        sizes: &sizes,
        signal: &signal,
        members: None,
        repeated_rows: None,
        ..*job
    };
    let mut all = RunStats::default();
    // One after another: all threads work on one landscape, so a part holds one landscape in memory.
    for (place, row) in rows.enumerate() {
        let (status, cells, work) = reduction.cells(job, &landscape, row * each..(row + 1) * each)?;
        buffer.status[place] = status;
        for (column, &index) in buffer.columns.iter_mut().zip(job.projection.indices()) {
            column[place] = cells[index];
        }
        all += work;
        job.signal.advance(1);
    }
    Ok(all)
}

/// The accumulated reduction of a landscape.
#[derive(Default)]
struct Tally {
    /// Shortcuts of each status.
    statuses: [u64; Status::ALL.len()],
    /// The row of least gap and its cells.
    least: Option<(u64, [f64; 4])>,
    /// The gaps of all shortcuts with status `ok`.
    gaps: Vec<f64>,
    /// Those shortcuts by class of the histogram.
    classes: [u64; EDGES.len() + 1],
}

impl Tally {
    /// The status of the row: the worst status of the landscape, or the reason why no shortcut is ok.
    fn status(&self) -> Status {
        [Status::NotConverged, Status::Ok, Status::Unproven, Status::NegativeFriction, Status::BelowBound]
            .into_iter()
            .find(|status| self.statuses[*status as usize] > 0)
            .unwrap_or(Status::Infeasible)
    }

    /// Adds a block of the landscape that begins at row `start`.
    fn add(&mut self, reduction: Reduction, start: u64, buffer: &ColumnBuffer) {
        for (place, status) in buffer.status.iter().enumerate() {
            self.statuses[*status as usize] += 1;
            let gap = buffer.columns[gap::WORK_GAP][place];
            if *status != Status::Ok || gap.is_nan() {
                continue;
            }
            match reduction {
                Reduction::Minimum => {
                    if self.least.is_none_or(|(_, least)| gap < least[gap::WORK_GAP]) {
                        let cells = std::array::from_fn(|column| buffer.columns[column][place]);
                        self.least = Some((start + place as u64, cells));
                    }
                }
                Reduction::Quantiles => self.gaps.push(gap),
                Reduction::Histogram => self.classes[EDGES.partition_point(|edge| *edge <= gap)] += 1,
            }
        }
    }
}

impl Reduction {
    fn columns(self) -> &'static [Column] {
        match self {
            Reduction::Minimum => MINIMUM_COLUMNS,
            Reduction::Quantiles => QUANTILE_COLUMNS,
            Reduction::Histogram => HISTOGRAM_COLUMNS,
        }
    }

    /// Status and cells of the row that reduces the landscape rows `rows`.
    fn cells(
        self,
        job: &Job<'_>,
        landscape: &Job<'_>,
        rows: Range<u64>,
    ) -> Result<(Status, Vec<f64>, RunStats), Stopped> {
        let mut buffer = ColumnBuffer::new(landscape.projection.indices().len());
        let (mut work, mut tally) = (RunStats::default(), Tally::default());
        for start in rows.clone().step_by(BLOCK_ROWS) {
            job.signal.check()?;
            let piece = start..rows.end.min(start + BLOCK_ROWS as u64);
            buffer.resize((piece.end - piece.start) as usize);
            work += gap::compute(landscape, piece, &mut buffer)?;
            tally.add(self, start, &buffer);
        }
        let status = tally.status();
        let mut cells = vec![f64::NAN; self.columns().len()];
        if status == Status::NotConverged {
            return Ok((status, cells, work));
        }
        cells[0] = tally.statuses[Status::Ok as usize] as f64;
        match self {
            Reduction::Minimum => {
                if let Some((row, [work, work_optimal, gap, v_min])) = tally.least {
                    let point = landscape.rows.point(row);
                    let (alpha_2, alpha_3) = (point[Quantity::Alpha2], point[Quantity::Alpha3]);
                    cells[1..].copy_from_slice(&[alpha_2, alpha_3, work, work_optimal, gap, v_min]);
                }
            }
            Reduction::Quantiles => {
                tally.gaps.sort_unstable_by(f64::total_cmp);
                let count = tally.gaps.len() as u64;
                for (cell, hundredths) in cells[1..].iter_mut().zip(PERCENTAGES) {
                    let rank = (hundredths * count).div_ceil(100).max(1);
                    *cell = tally.gaps.get(rank as usize - 1).copied().unwrap_or(f64::NAN);
                }
            }
            Reduction::Histogram => {
                cells[1..].iter_mut().zip(tally.classes).for_each(|(cell, count)| *cell = count as f64);
            }
        }
        Ok((status, cells, work))
    }
}
