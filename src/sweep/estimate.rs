//! The cost of a sweep, estimated from samples that are computed, encoded and written like parts.

use std::ops::Range;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rayon::ThreadPool;
use rayon::prelude::*;

use super::check::{Request, Sweep};
use super::engine::{RunError, WRITERS, content, locked, pool};
use super::plan::Plan;
use crate::dataset::{DatasetError, Footer, Layout, Manifest, atomic, encode};
use crate::grid::{Point, SPLIT_MIX_INCREMENT};
use crate::table::{ColumnBuffer, Job, OptimumCache, Signal, uncapped_optimum};

/// Time for all samples of a sweep. Chosen: `plan` answers within two seconds where rows cost about the same.
const SAMPLE_TIME: Duration = Duration::from_millis(1500);

/// Greatest number of optimal protocols in a sample, whose points are kept in memory. Chosen: about a megabyte.
const MAX_OPTIMA: u64 = 1 << 14;

/// Time of samples, in seconds, after which none is extended because its rows differ. Chosen: the patience of a user of `plan`.
const MAX_SAMPLE_SECONDS: f64 = 5.0;

/// Relative standard error at which a sample is large enough. Chosen: two of them, and a machine whose speed varies by a fifth, stay within 30 %.
const MAX_STANDARD_ERROR: f64 = 0.05;

/// Ranges of rows below which their scatter is unknown. Chosen: the scatter of 16 ranges is known to 18 %, `1/sqrt(2 (16 - 1))`.
const MIN_RANGES: u64 = 16;

/// Greatest cost of a row, in units of the mean cost of its table. Chosen: rows of `step_response` differ by three orders of magnitude.
const MAX_COST_RATIO: f64 = 1000.0;

/// Greatest fraction of the cost of a range that does not grow with its rows. Chosen: a third of the error that is allowed.
const MAX_FIXED_FRACTION: f64 = 0.1;

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
    let (manifest, began) = (plan.manifest(sweep), Instant::now());
    let samples = sweep.requests.len() as u32 + u32::from(plan.optima > 0);
    let budget = SAMPLE_TIME.as_secs_f64() / f64::from(samples);
    let optimum = optimum_cost(sweep, &plan, &pool, budget);
    let (optima, signal) = (sweep.optimum_cache(), Signal::default());
    let tables = sweep.requests.iter().zip(&optima).map(|(request, optima)| {
        let job = sweep.job(request, optima, &signal);
        let layout = Layout::new(request.table, &request.projection, &sweep.grid);
        let (pool, manifest, all_began) = (&pool, &manifest, began);
        TableSampler { request, job, layout, pool, manifest, optimum, all_began, began: Instant::now(), budget }
            .estimate()
    });
    let tables: Vec<Estimate> = tables.collect::<Result<_, _>>()?;
    let parts: u64 = plan.tables.iter().map(|table| table.parts).sum();
    let bytes = tables.iter().map(|table| table.bytes).sum::<f64>() / parts as f64;
    // An estimate ignores write errors.
    let written = |bytes: f64| atomic::time(folder, bytes as usize).map_or(0.0, |time| time.as_secs_f64());
    let (sync, part) = (written(0.0), written(bytes));
    let shared = optimum * plan.optima as f64;
    Ok(Estimates { tables, shared, sync, part, parts })
}

/// The cost of ranges of one length.
#[derive(Debug, Clone, Copy, Default)]
struct CostSample {
    ranges: u64,
    rows: u64,
    /// Seconds of the threads that computed and encoded the ranges, without waiting.
    seconds: f64,
    /// The sum of the squared seconds of each range.
    squares: f64,
    bytes: u64,
}

impl CostSample {
    fn add(&mut self, rows: u64, seconds: f64, bytes: usize) {
        self.ranges += 1;
        self.rows += rows;
        self.seconds += seconds;
        self.squares += seconds * seconds;
        self.bytes += bytes as u64;
    }

    /// Seconds of a range, bytes and rows, on average.
    fn mean(&self) -> [f64; 3] {
        [self.seconds, self.bytes as f64, self.rows as f64].map(|all| all / self.ranges as f64)
    }

    fn seconds_of_row(&self) -> f64 {
        self.seconds / self.rows as f64
    }

    /// The relative standard error of the seconds of a row of a table of `rows` rows; infinite for too few ranges.
    fn standard_error(&self, rows: u64) -> f64 {
        if self.ranges < MIN_RANGES.min(rows) {
            return f64::INFINITY;
        }
        let (count, mean) = (self.ranges as f64, self.mean()[0]);
        let variance = (self.squares / count - mean * mean).max(0.0) / (count - 1.0).max(1.0);
        let unseen = 1.0 - (self.rows as f64 / rows as f64).min(1.0);
        (variance * unseen).sqrt() / mean
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

/// Seconds of one thread for an optimal protocol shared by tables; 0 if there is none.
fn optimum_cost(sweep: &Sweep, plan: &Plan, pool: &ThreadPool, budget: f64) -> f64 {
    let Some(rows) = sweep.optimum_rows.as_ref().filter(|_| plan.optima <= OptimumCache::MAX_CACHED) else {
        return 0.0;
    };
    let Sweep { bounded, friction, .. } = *sweep;
    let rtol = sweep.optimum_rtol();
    let solve = |point: &Point| _ = uncapped_optimum(point, bounded, friction, rtol);
    let (began, mut places) = (Instant::now(), rows.rows().min(MIN_RANGES));
    loop {
        let starts = (0..places).map(|place| place_of(rows.rows(), place, 1).start);
        let points: Vec<Point> = starts.map(|row| sweep.grid.scaled(&rows.point(row))).collect();
        let start = Instant::now();
        pool.install(|| points.par_iter().for_each(solve));
        let each = start.elapsed().as_secs_f64() * pool.current_num_threads() as f64 / places as f64;
        let most = rows.rows().min(MAX_OPTIMA);
        if places == most || began.elapsed().as_secs_f64() > 0.2 * budget {
            return each;
        }
        places = (8 * places).min(most);
    }
}

/// Samples one table.
struct TableSampler<'a> {
    request: &'a Request,
    job: Job<'a>,
    layout: Layout,
    pool: &'a ThreadPool,
    manifest: &'a Manifest,
    /// Seconds of an optimal protocol of several tables, which are counted apart.
    optimum: f64,
    /// When the samples of all tables began.
    all_began: Instant,
    began: Instant,
    /// Seconds for the samples.
    budget: f64,
}

impl TableSampler<'_> {
    fn estimate(&self) -> Result<Estimate, RunError> {
        let rows = self.request.rows;
        let samples = self.lengths()?;
        let ([.., (longest, long)], Some((_, one))) = (samples.as_slice(), samples.first()) else {
            return Ok(Estimate { seconds: 0.0, bytes: 0.0 });
        };
        let ([time, size, of_one], [long_time, long_size, of_long]) = (one.mean(), long.mean());
        let (mut seconds, mut bytes) = (LinearCost { range: 0.0, row: time }, LinearCost { range: size, row: 0.0 });
        if *longest > 1 {
            seconds = LinearCost::through((of_one, time), (of_long, long_time));
            bytes = LinearCost::through((of_one, size), (of_long, long_size));
        }
        let (length, sample) = shortest(&samples).unwrap_or((*longest, *long));
        let all = self.extended(sample, length, rows / length, |sample| {
            let is_late = self.all_began.elapsed().as_secs_f64() > MAX_SAMPLE_SECONDS;
            self.elapsed() > self.budget && (is_late || sample.standard_error(rows) < MAX_STANDARD_ERROR)
        })?;
        let [all_time, all_size, of_all] = all.mean();
        if length < *longest {
            seconds = LinearCost { range: 0.0, row: all_time / of_all };
        } else {
            seconds.row = ((all_time - seconds.range) / of_all).max(0.0);
            if length > 1 {
                bytes.row = ((all_size - bytes.range) / of_all).max(0.0);
            }
        }
        let parts = rows.div_ceil(self.request.table.rows_per_part());
        // Rows are compressed together: whole parts give their size, where they are cheap.
        let (part, places) = (rows.min(self.request.table.rows_per_part()), parts.min(MIN_RANGES));
        let threads = self.pool.current_num_threads() as f64;
        if seconds.of(places, places * part) < 0.5 * threads * self.budget {
            let [_, size, of_part] = self.extended(CostSample::default(), part, places, |_| false)?.mean();
            bytes = LinearCost { range: 0.0, row: size / of_part };
        }
        Ok(Estimate { seconds: seconds.of(parts, rows), bytes: bytes.of(parts, rows) })
    }

    /// Samples of ranges of 1, 4, 16 and more rows, which begin at the same rows. Ranges grow until the rows, not the fixed cost of a range, take
    /// most of the time. A single row may overestimate the cost a thousandfold.
    fn lengths(&self) -> Result<Vec<(u64, CostSample)>, RunError> {
        let Request { table, rows, .. } = self.request;
        let threads = self.pool.current_num_threads() as u64;
        // Expensive rows leave time for few ranges.
        let few = self.extended(CostSample::default(), 1, threads.min(*rows), |_| false)?;
        let is_cheap = self.elapsed() < 0.02 * self.budget;
        let places = if is_cheap { MIN_RANGES.max(threads) } else { threads }.min(*rows);
        let one = self.extended(few, 1, places, |_| false)?;
        let longest = table.rows_per_part().min(rows / places);
        let (mut length, mut last, mut samples) = (1, one, vec![(1, one)]);
        while length < longest {
            let [time, ..] = last.mean();
            let row = (MAX_COST_RATIO * 1e-9 * table.cost() as f64).min(time / length as f64);
            let next = (time + 3.0 * length as f64 * row) * places as f64 / threads as f64;
            let is_fixed = length == 1 || time < 2.0 * one.mean()[0];
            if self.elapsed() + next > if is_fixed { MAX_SAMPLE_SECONDS } else { 0.5 * self.budget } {
                break;
            }
            length = (4 * length).min(longest);
            last = self.extended(CostSample::default(), length, places, |_| false)?;
            samples.push((length, last));
            let [[time, _, of_one], [long_time, _, of_long]] = [one.mean(), last.mean()];
            let fixed = LinearCost::through((of_one, time), (of_long, long_time)).range;
            if fixed < MAX_FIXED_FRACTION * long_time && self.elapsed() > 0.2 * self.budget {
                break;
            }
        }
        Ok(samples)
    }

    fn elapsed(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// `sample` with further ranges of `length` rows, up to `most` or until it is enough. Each thread takes the next range.
    fn extended(
        &self,
        sample: CostSample,
        length: u64,
        most: u64,
        is_enough: impl Fn(&CostSample) -> bool + Sync,
    ) -> Result<CostSample, RunError> {
        let (next, result) = (AtomicU64::new(sample.ranges), Mutex::new(Ok(sample)));
        self.pool.broadcast(|_| {
            loop {
                let place = next.fetch_add(1, Ordering::Relaxed);
                let is_over = locked(&result).as_ref().map_or(true, |sample| sample.ranges > 0 && is_enough(sample));
                if place >= most || is_over {
                    break;
                }
                let computed = self.range(place_of(self.request.rows, place, length));
                let mut result = locked(&result);
                match (computed, result.as_mut()) {
                    (Ok((rows, seconds, bytes)), Ok(sample)) => sample.add(rows, seconds, bytes),
                    (Err(error), Ok(_)) => *result = Err(error),
                    (_, Err(_)) => {}
                }
            }
        });
        content(result)
    }

    /// Rows, seconds of this thread and bytes of a range that is computed and encoded.
    fn range(&self, rows: Range<u64>) -> Result<(u64, f64, usize), RunError> {
        let TableSampler { request, job, optimum, .. } = self;
        let start = Instant::now();
        let mut buffer = ColumnBuffer::new(request.projection.indices().len());
        buffer.resize((rows.end - rows.start) as usize);
        let work = request.table.compute(job, rows.clone(), &mut buffer)?;
        let footer = Footer::new(self.manifest, request.table.name(), rows.clone());
        let (bytes, _) = encode(&self.layout, job.rows, &buffer, &footer).map_err(DatasetError::Encode)?;
        let optima = if *optimum > 0.0 { work.optima } else { 0 };
        let seconds = start.elapsed().as_secs_f64() - optima as f64 * optimum;
        Ok((rows.end - rows.start, seconds.max(0.0), bytes.len()))
    }
}

/// The shortest ranges whose time goes into their rows: as many rows from fewer places would say less, since neighbours cost about the same.
fn shortest(samples: &[(u64, CostSample)]) -> Option<(u64, CostSample)> {
    let least = samples.iter().map(|(_, sample)| sample.seconds_of_row()).fold(f64::INFINITY, f64::min);
    let is_of_rows = |(_, sample): &&(u64, CostSample)| sample.seconds_of_row() <= (1.0 + MAX_FIXED_FRACTION) * least;
    samples.iter().find(is_of_rows).copied()
}

/// Range number `place` of a sample, which has `length` of the `rows`: any consecutive ranges lie nearly evenly among them.
fn place_of(rows: u64, place: u64, length: u64) -> Range<u64> {
    // Multiples of the golden ratio, modulo 1, are spread most evenly (Knuth, The Art of Computer Programming 3, section 6.4, theorem S).
    let part = (place + 1).wrapping_mul(SPLIT_MIX_INCREMENT);
    let length = length.min(rows);
    let start = ((u128::from(part) * u128::from(rows - length + 1)) >> 64) as u64;
    start..start + length
}

#[cfg(test)]
mod tests {
    //! Which ranges are sampled, and how well they determine a cost.

    use super::*;

    /// A sample of 16 ranges of `length` rows, each range with these seconds for itself and for each of its rows.
    fn sample(length: u64, range: f64, row: impl Fn(u64) -> f64) -> (u64, CostSample) {
        let mut sample = CostSample::default();
        (0..16).for_each(|place| sample.add(length, range + row(place) * length as f64, 100));
        (length, sample)
    }

    #[test]
    fn ranges_are_as_short_as_their_fixed_cost_allows() {
        let chosen = |range: f64, row: f64| {
            let samples = [1, 4, 16, 64].map(|length| sample(length, range, |_| row));
            shortest(&samples).expect("has samples").0
        };
        assert_eq!(chosen(0.0, 1e-3), 1);
        assert_eq!(chosen(2e-5, 1e-3), 1);
        assert_eq!(chosen(4e-4, 1e-3), 4);
        assert_eq!(chosen(1.0, 1e-6), 64);
    }

    #[test]
    fn a_standard_error_is_that_of_the_mean() {
        assert_eq!(sample(1, 0.0, |_| 1e-3).1.standard_error(1_000_000), 0.0);
        // Half of the rows cost nothing: the relative deviation is 1, that of the mean 1/sqrt(15) for the sample's own variance.
        let (_, uneven) = sample(1, 0.0, |place| (place % 2) as f64);
        assert!((uneven.standard_error(u64::MAX) - 1.0 / 15f64.sqrt()).abs() < 1e-12);
        // A sample of all rows has no error, one of too few ranges any.
        assert_eq!(uneven.standard_error(16), 0.0);
        let mut few = CostSample::default();
        (0..15).for_each(|_| few.add(1, 1.0, 100));
        assert_eq!(few.standard_error(1000), f64::INFINITY);
    }

    #[test]
    fn places_lie_evenly_among_the_rows() {
        for (rows, length) in [(40_000, 1), (40_000, 16), (2116, 4)] {
            let mut starts: Vec<u64> = (0..100).map(|place| place_of(rows, place, length).start).collect();
            starts.sort_unstable();
            let widest = starts.windows(2).map(|pair| pair[1] - pair[0]).max().expect("has pairs");
            assert!(widest <= 3 * rows / 100, "{rows} {length}: {widest}");
        }
    }
}
