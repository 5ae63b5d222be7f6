//! `gap_min`, `gap_quantiles`, `gap_histogram`: the landscape of a transition and duration reduced to one row.
//!
//! The landscape is computed in blocks, as `gap` computes it, and discarded. The results do not depend on the blocks: counts, a minimum whose
//! ties go to the first row, and quantiles that are values of the landscape.

use std::ops::Range;

use super::column::fields;
use super::gap;
use super::optimum_cache::OPTIMUM_AXES;
use super::{ColumnBuffer, Field, Job, Projection, RunStats, Signal, Stopped, Table, number};
use crate::grid::Quantity;
use crate::protocol::Status;

mod minimum {
    use super::*;
    use crate::table::Kind;

    fields! { Tally:
        shortcuts "1" "number of shortcuts with status ok; only these enter the other columns" => |tally| tally.ok();
        alpha_2 (Kind::Quantity(Quantity::Alpha2)) "coefficient of t of the shortcut of least gap"
            => |tally| tally.of_least(|least| least.alpha_2);
        alpha_3 (Kind::Quantity(Quantity::Alpha3)) "coefficient of t^2 of the shortcut of least gap"
            => |tally| tally.of_least(|least| least.alpha_3);
        work "mu_0 sigma l" "its work of friction W_s" => |tally| tally.of_least(|least| least.work);
        work_optimal "mu_0 sigma l" "least work of friction W* of any protocol"
            => |tally| tally.of_least(|least| least.work_optimal);
        gap "1" "least (W_s - W*)/W*; ties go to the first row of the landscape"
            => |tally| tally.of_least(|least| least.gap);
        v_min "v_0" "its least velocity" => |tally| tally.of_least(|least| least.v_min);
    }

    /// The shortcut of least gap.
    pub static MINIMUM: Table = reduced(
        "gap_min",
        "the shortcut of least gap of a landscape (reduce = \"min\" of gap)",
        &COLUMNS,
        |job, rows, buffer| compute(FIELDS, false, job, rows, buffer),
    );
}

mod quantiles {
    use super::*;

    fields! { Tally:
        shortcuts "1" "number of shortcuts with status ok; only these enter the other columns" => |tally| tally.ok();
        gap_min "1" "least gap" => |tally| tally.quantile(0);
        gap_q05 "1" "least gap that at least 5 % of the shortcuts do not exceed" => |tally| tally.quantile(5);
        gap_q25 "1" "least gap that at least 25 % of the shortcuts do not exceed" => |tally| tally.quantile(25);
        gap_q50 "1" "least gap that at least 50 % of the shortcuts do not exceed" => |tally| tally.quantile(50);
        gap_q75 "1" "least gap that at least 75 % of the shortcuts do not exceed" => |tally| tally.quantile(75);
        gap_q95 "1" "least gap that at least 95 % of the shortcuts do not exceed" => |tally| tally.quantile(95);
        gap_max "1" "greatest gap" => |tally| tally.quantile(100);
    }

    /// Quantiles of the gap.
    pub static QUANTILES: Table = reduced(
        "gap_quantiles",
        "quantiles of the gap of a landscape (reduce = \"quantiles\" of gap)",
        &COLUMNS,
        |job, rows, buffer| compute(FIELDS, true, job, rows, buffer),
    );
}

mod histogram {
    use super::*;

    fields! { Tally:
        shortcuts "1" "number of shortcuts with status ok; only these enter the other columns" => |tally| tally.ok();
        below_1e_8 "1" "shortcuts with a gap below 1e-8" => |tally| tally.class(0);
        from_1e_8 "1" "shortcuts with a gap from 1e-8 to below 1e-7" => |tally| tally.class(1);
        from_1e_7 "1" "shortcuts with a gap from 1e-7 to below 1e-6" => |tally| tally.class(2);
        from_1e_6 "1" "shortcuts with a gap from 1e-6 to below 1e-5" => |tally| tally.class(3);
        from_1e_5 "1" "shortcuts with a gap from 1e-5 to below 1e-4" => |tally| tally.class(4);
        from_1e_4 "1" "shortcuts with a gap from 1e-4 to below 1e-3" => |tally| tally.class(5);
        from_1e_3 "1" "shortcuts with a gap from 1e-3 to below 0.01" => |tally| tally.class(6);
        from_1e_2 "1" "shortcuts with a gap from 0.01 to below 0.1" => |tally| tally.class(7);
        from_1e_1 "1" "shortcuts with a gap from 0.1 to below 1" => |tally| tally.class(8);
        from_1 "1" "shortcuts with a gap from 1 to below 10" => |tally| tally.class(9);
        from_10 "1" "shortcuts with a gap of 10 or more" => |tally| tally.class(10);
    }

    /// Numbers of shortcuts by decades of the gap.
    pub static HISTOGRAM: Table = reduced(
        "gap_histogram",
        "histogram of the gap of a landscape (reduce = \"histogram\" of gap)",
        &COLUMNS,
        |job, rows, buffer| compute(FIELDS, false, job, rows, buffer),
    );
}

pub use histogram::HISTOGRAM;
pub use minimum::MINIMUM;
pub use quantiles::QUANTILES;

/// One row for each transition and duration. The cost is that of a landscape of 400 x 400 shortcuts.
const fn reduced(
    name: &'static str,
    doc: &'static str,
    columns: &'static [super::Column],
    compute: fn(&Job<'_>, Range<u64>, &mut ColumnBuffer) -> Result<RunStats, Stopped>,
) -> Table {
    Table {
        name,
        doc,
        axes: OPTIMUM_AXES,
        columns,
        rows_per_part: 1 << 8,
        cost: 16_000_000,
        needs_optimum: |_, _| true,
        compute,
    }
}

/// Rows of a landscape in memory at a time. Chosen: a few megabytes.
const BLOCK_ROWS: usize = 1 << 16;

/// Greatest number of shortcuts of a row of `gap_quantiles`, whose gaps are sorted in memory. Chosen: 16 MB of gaps for each thread.
pub const MAX_SORTED: u64 = 1 << 21;

/// Lower edges of the classes of the histogram, without the first. Chosen: decades.
pub const EDGES: [f64; 10] = [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0];

fn compute(
    fields: &[Field<Tally>],
    keeps_gaps: bool,
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
    let landscape = Job { rows: members, tuples, projection: &projection, signal: &signal, members: None, ..*job };
    let mut all = RunStats::default();
    // One after another: all threads work on one landscape, so a part holds one landscape in memory.
    for (place, row) in rows.enumerate() {
        let mut tally = Tally { keeps_gaps, ..Tally::default() };
        let work = tally.reduce(job, &landscape, row * each..(row + 1) * each)?;
        let status = tally.status();
        buffer.status[place] = status;
        for (column, &index) in buffer.columns.iter_mut().zip(job.projection.indices()) {
            column[place] = if status == Status::NotConverged { f64::NAN } else { (fields[index].cell)(&tally) };
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
    /// The shortcut of least gap.
    least: Option<Least>,
    /// Whether all gaps are kept, which takes time and memory.
    keeps_gaps: bool,
    /// The gaps of all shortcuts with status `ok`, in ascending order.
    gaps: Vec<f64>,
    /// Those shortcuts by class of the histogram.
    classes: [u64; EDGES.len() + 1],
}

/// A shortcut of a landscape.
struct Least {
    row: u64,
    alpha_2: f64,
    alpha_3: f64,
    work: f64,
    work_optimal: f64,
    gap: f64,
    v_min: f64,
}

impl Tally {
    /// The number of shortcuts with status `ok`.
    fn ok(&self) -> f64 {
        self.statuses[Status::Ok as usize] as f64
    }

    fn of_least(&self, value: impl Fn(&Least) -> f64) -> f64 {
        number(self.least.as_ref().map(value))
    }

    /// The least gap that this percentage of the shortcuts does not exceed.
    fn quantile(&self, percentage: u64) -> f64 {
        let rank = (percentage * self.gaps.len() as u64).div_ceil(100).max(1);
        number(self.gaps.get(rank as usize - 1).copied())
    }

    fn class(&self, place: usize) -> f64 {
        self.classes[place] as f64
    }

    /// Adds the landscape rows `rows`.
    fn reduce(&mut self, job: &Job<'_>, landscape: &Job<'_>, rows: Range<u64>) -> Result<RunStats, Stopped> {
        let mut buffer = ColumnBuffer::new(landscape.projection.indices().len());
        let mut work = RunStats::default();
        for start in rows.clone().step_by(BLOCK_ROWS) {
            job.signal.check()?;
            let piece = start..rows.end.min(start + BLOCK_ROWS as u64);
            buffer.resize((piece.end - piece.start) as usize);
            work += gap::compute(landscape, piece, &mut buffer)?;
            self.add(start, &buffer);
        }
        self.gaps.sort_unstable_by(f64::total_cmp);
        if let Some(least) = &mut self.least {
            let point = landscape.rows.point(least.row);
            (least.alpha_2, least.alpha_3) = (point[Quantity::Alpha2], point[Quantity::Alpha3]);
        }
        Ok(work)
    }

    /// The status of the row: the worst status of the landscape, or the reason why no shortcut is ok.
    fn status(&self) -> Status {
        [Status::NotConverged, Status::Ok, Status::Unproven, Status::NegativeFriction, Status::BelowBound]
            .into_iter()
            .find(|status| self.statuses[*status as usize] > 0)
            .unwrap_or(Status::Infeasible)
    }

    /// Adds a block of the landscape that begins at row `start`.
    fn add(&mut self, start: u64, buffer: &ColumnBuffer) {
        let [works, optima, gaps, v_mins] = [0, 1, 2, 3].map(|column| &buffer.columns[column]);
        for (place, status) in buffer.status.iter().enumerate() {
            self.statuses[*status as usize] += 1;
            let gap = gaps[place];
            if *status != Status::Ok || gap.is_nan() {
                continue;
            }
            self.classes[EDGES.partition_point(|edge| *edge <= gap)] += 1;
            if self.keeps_gaps {
                self.gaps.push(gap);
            }
            if self.least.as_ref().is_none_or(|least| gap < least.gap) {
                let (work, work_optimal, v_min) = (works[place], optima[place], v_mins[place]);
                let (row, nan) = (start + place as u64, f64::NAN);
                self.least = Some(Least { row, alpha_2: nan, alpha_3: nan, work, work_optimal, gap, v_min });
            }
        }
    }
}
