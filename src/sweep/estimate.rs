//! The cost of a sweep, estimated from samples that are computed, encoded and written like parts.

use std::iter::Sum;
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};

use rayon::ThreadPool;
use rayon::prelude::*;

use super::check::{Request, Sweep};
use super::engine::{RunError, WRITERS, pool};
use super::plan::Plan;
use crate::dataset::{DatasetError, Footer, Layout, Manifest, atomic, encode};
use crate::grid::Point;
use crate::table::{ColumnBuffer, Job, OptimumCache, Signal};

/// Time for all samples of a sweep. Chosen: `plan` answers within two seconds.
const SAMPLE_TIME: Duration = Duration::from_millis(1500);

/// Ranges of rows in the first sample. Chosen: several threads are busy.
const FIRST_RANGES: u64 = 16;

/// Greatest number of ranges in a sample, whose costs are kept in memory.
const MAX_RANGES: u64 = 1 << 14;

/// Greatest time of the sample of a table with expensive rows, in seconds. Chosen: acceptable for a user of `plan`.
const MAX_SAMPLE_SECONDS: f64 = 5.0;

/// Greatest cost of a row, in units of the mean cost of its table. Chosen: rows of `step_response` differ by three orders of magnitude.
const MAX_COST_RATIO: f64 = 1000.0;

/// The estimated cost of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Seconds of one thread, without the optimal protocols shared by tables.
    pub seconds: f64,
    /// Bytes on disk.
    pub bytes: f64,
}

/// The estimated cost of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimates {
    /// Each of its tables, in the order of the spec.
    pub tables: Vec<Estimate>,
    /// Seconds of one thread for the optimal protocols shared by tables.
    pub shared: f64,
    /// Seconds to write an empty file and its name.
    sync: f64,
    /// Seconds to write a part of mean size.
    part: f64,
    /// All parts.
    parts: u64,
}

impl Estimates {
    /// Seconds of one thread for all computation.
    pub fn seconds(&self) -> f64 {
        self.shared + self.tables.iter().map(|table| table.seconds).sum::<f64>()
    }

    /// Bytes of all tables.
    pub fn bytes(&self) -> f64 {
        self.tables.iter().map(|table| table.bytes).sum()
    }

    /// Wall time of a run on `threads` threads, in seconds, without reading the spec.
    pub fn elapsed(&self, threads: usize) -> f64 {
        // First come the folder of the dataset, its manifest and the folders of the tables, one after the other.
        let opening = self.sync * (self.tables.len() + 2) as f64;
        // Parts are written while others are computed, but for the last one.
        let writing = self.part * self.parts as f64 / WRITERS as f64;
        opening + (self.seconds() / threads as f64).max(writing) + self.part
    }
}

/// Estimates `sweep` on all threads of a run, for a dataset in `folder`, which may not exist yet.
///
/// # Errors
///
/// Threads that cannot be started, and cells that cannot be encoded.
pub fn estimate(sweep: &Sweep, folder: &Path) -> Result<Estimates, RunError> {
    let (plan, pool) = (Plan::new(sweep), pool(0)?);
    let sampler = Sampler { sweep, plan: &plan, manifest: plan.manifest(sweep), pool: &pool };
    let samples = sweep.requests.len() as u32 + u32::from(plan.optima > 0);
    let budget = SAMPLE_TIME.as_secs_f64() / f64::from(samples);
    let optimum = sampler.optimum(budget);
    let optima = sweep.optimum_cache();
    let tables =
        sweep.requests.iter().zip(&optima).map(|(request, optima)| sampler.table(request, optima, optimum, budget));
    let tables: Vec<Estimate> = tables.collect::<Result<_, _>>()?;
    let parts: u64 = plan.tables.iter().map(|table| table.parts).sum();
    let bytes = tables.iter().map(|table| table.bytes).sum::<f64>() / parts as f64;
    // An estimate ignores write errors.
    let written = |bytes: f64| atomic::time(folder, bytes as usize).map_or(0.0, |time| time.as_secs_f64());
    let (sync, part) = (written(0.0), written(bytes));
    let shared = optimum * plan.optima as f64;
    Ok(Estimates { tables, shared, sync, part, parts })
}

/// Bytes of each table of `sweep` on disk, from samples of a fifth of the time.
///
/// # Errors
///
/// Those of [`estimate`].
pub fn sizes(sweep: &Sweep) -> Result<Vec<f64>, RunError> {
    let (plan, pool) = (Plan::new(sweep), pool(0)?);
    let sampler = Sampler { sweep, plan: &plan, manifest: plan.manifest(sweep), pool: &pool };
    let budget = 0.2 * SAMPLE_TIME.as_secs_f64() / sweep.requests.len() as f64;
    let optima = sweep.optimum_cache();
    let tables =
        sweep.requests.iter().zip(&optima).map(|(request, optima)| sampler.table(request, optima, 0.0, budget));
    tables.map(|table| table.map(|table| table.bytes)).collect()
}

/// The cost of a sample.
#[derive(Debug, Clone, Copy, Default)]
struct Sample {
    rows: u64,
    /// Seconds of the threads that computed and encoded the ranges, without waiting.
    seconds: f64,
    bytes: u64,
}

impl Sum for Sample {
    fn sum<I: Iterator<Item = Sample>>(samples: I) -> Sample {
        samples.fold(Sample::default(), |sum, one| Sample {
            rows: sum.rows + one.rows,
            seconds: sum.seconds + one.seconds,
            bytes: sum.bytes + one.bytes,
        })
    }
}

/// A cost that is linear in the number of rows: offset and slope, in seconds of one thread or in bytes.
#[derive(Debug, Clone, Copy)]
struct LinearCost {
    range: f64,
    row: f64,
}

impl LinearCost {
    /// The line through ranges of `shorter` and `longer` rows. A falling cost counts as constant.
    fn through(shorter: (f64, f64), longer: (f64, f64)) -> LinearCost {
        let row = ((longer.1 - shorter.1) / (longer.0 - shorter.0)).max(0.0);
        LinearCost { range: (shorter.1 - row * shorter.0).max(0.0), row }
    }

    fn of(self, ranges: u64, rows: u64) -> f64 {
        self.range * ranges as f64 + self.row * rows as f64
    }
}

/// Computes samples of the tables of a sweep.
struct Sampler<'a> {
    sweep: &'a Sweep,
    plan: &'a Plan,
    manifest: Manifest,
    pool: &'a ThreadPool,
}

impl Sampler<'_> {
    /// The cost of a table if a shared optimal protocol costs `optimum`, from samples that take about `budget`.
    fn table(&self, request: &Request, optima: &OptimumCache, optimum: f64, budget: f64) -> Result<Estimate, RunError> {
        let signal = Signal::default();
        let job = self.sweep.job(request, optima, &signal);
        let sample = |length, places, limit| self.mean(request, &job, optimum, (length, places, limit));
        let began = Instant::now();
        let left = || budget - began.elapsed().as_secs_f64();
        // Expensive rows leave time for few ranges.
        let threads = self.pool.current_num_threads();
        let mut places = threads as u64;
        let mut one = sample(1, places, f64::INFINITY)?;
        if left() > 0.8 * budget {
            places = FIRST_RANGES;
            one = sample(1, places, f64::INFINITY)?;
        }
        let longest = request.table.rows_per_part().min(request.rows / places);
        let (mut seconds, mut bytes) = (LinearCost { range: 0.0, row: one[0] }, LinearCost { range: one[1], row: 0.0 });
        let (mut length, mut long) = (1, one);
        // Ranges grow until the rows, not the fixed cost of a range, take most of the time. A single row may overestimate the cost a
        // thousandfold.
        while length < longest {
            let is_flat = length == 1 || long[0] < 2.0 * one[0];
            let row = (MAX_COST_RATIO * 1e-9 * request.table.cost() as f64).min(long[0] / length as f64);
            let next = (long[0] + 3.0 * length as f64 * row) * places as f64 / threads as f64;
            let is_bearable = began.elapsed().as_secs_f64() + next < MAX_SAMPLE_SECONDS;
            if left() < 0.6 * budget && !(is_flat && is_bearable) {
                break;
            }
            length = (4 * length).min(longest);
            long = sample(length, places, f64::INFINITY)?;
            seconds = LinearCost::through((one[2], one[0]), (long[2], long[0]));
            bytes = LinearCost::through((one[2], one[1]), (long[2], long[1]));
            if seconds.range < 0.1 * long[0] && left() < 0.8 * budget {
                break;
            }
        }
        // The remaining time goes into further ranges, since rows differ.
        if left() > 0.1 * budget {
            let all = sample(length, MAX_RANGES.min(request.rows / length), left())?;
            seconds.row = ((all[0] - seconds.range) / all[2]).max(0.0);
            if length > 1 {
                bytes.row = ((all[1] - bytes.range) / all[2]).max(0.0);
            }
        }
        let parts = request.rows.div_ceil(request.table.rows_per_part());
        Ok(Estimate { seconds: seconds.of(parts, request.rows), bytes: bytes.of(parts, request.rows) })
    }

    /// Seconds of one thread, bytes and rows of a range of a table, on the mean of `places` ranges of `length` rows, or as many as are begun within `limit`
    /// seconds.
    fn mean(
        &self,
        request: &Request,
        job: &Job<'_>,
        optimum: f64,
        (length, places, limit): (u64, u64, f64),
    ) -> Result<[f64; 3], RunError> {
        let layout = Layout::new(request.table, &request.projection, &self.sweep.grid);
        let compute = |rows: Range<u64>| -> Result<Sample, RunError> {
            let start = Instant::now();
            let mut buffer = ColumnBuffer::new(request.projection.indices().len());
            buffer.resize((rows.end - rows.start) as usize);
            let work = request.table.compute(job, rows.clone(), &mut buffer)?;
            let footer = Footer::new(&self.manifest, request.table.name(), rows.clone());
            let (bytes, _) = encode(&layout, job.rows, &buffer, &footer).map_err(DatasetError::Sample)?;
            let optima = if optimum > 0.0 { work.optima } else { 0 };
            let seconds = start.elapsed().as_secs_f64() - optima as f64 * optimum;
            Ok(Sample { rows: rows.end - rows.start, seconds: seconds.max(0.0), bytes: bytes.len() as u64 })
        };
        let start = Instant::now();
        let ranges = (0..places as usize).into_par_iter().with_max_len(1).filter_map(|place| {
            let is_late = start.elapsed().as_secs_f64() > limit && place > 0;
            (!is_late).then(|| compute(place_of(request.rows, place as u64, length)))
        });
        let taken = self.pool.install(|| ranges.collect::<Result<Vec<_>, _>>())?;
        let sum: Sample = taken.iter().copied().sum();
        Ok([sum.seconds, sum.bytes as f64, sum.rows as f64].map(|all| all / taken.len() as f64))
    }

    /// Seconds of one thread for an optimal protocol shared by tables; 0 if there is none.
    fn optimum(&self, budget: f64) -> f64 {
        let Some(rows) = self.sweep.optimum_rows.as_ref().filter(|_| self.plan.optima <= OptimumCache::MAX_CACHED)
        else {
            return 0.0;
        };
        // A cache without capacity: every request is solved.
        let optima = OptimumCache::new(u64::MAX, self.sweep.bounded, self.sweep.optimum_rtol());
        let (began, mut places) = (Instant::now(), rows.rows().min(FIRST_RANGES));
        loop {
            let starts = (0..places).map(|place| place_of(rows.rows(), place, 1).start);
            let points: Vec<Point> = starts.map(|row| self.sweep.grid.scaled(&rows.point(row))).collect();
            let start = Instant::now();
            self.pool.install(|| points.par_iter().for_each(|point| _ = optima.get(0, point)));
            let each = start.elapsed().as_secs_f64() * self.pool.current_num_threads() as f64 / places as f64;
            let most = rows.rows().min(MAX_RANGES);
            if places == most || began.elapsed().as_secs_f64() > 0.2 * budget {
                return each;
            }
            places = (8 * places).min(most);
        }
    }
}

/// Range number `place` of a sample, which has `length` of the `rows`: any consecutive ranges lie nearly evenly among them.
fn place_of(rows: u64, place: u64, length: u64) -> Range<u64> {
    // Multiples of the golden ratio, modulo 1, are spread most evenly (Knuth, The Art of Computer Programming 3, section 6.4, theorem S).
    const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
    let part = (place + 1).wrapping_mul(GOLDEN);
    let length = length.min(rows);
    let start = ((u128::from(part) * u128::from(rows - length + 1)) >> 64) as u64;
    start..start + length
}
