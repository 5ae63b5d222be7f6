//! What a sweep will cost, from a small sample that is computed for real.

use std::ops::Range;
use std::time::{Duration, Instant};

use super::check::{Request, Sweep};
use super::engine::RunError;
use super::plan::Plan;
use crate::dataset::{DatasetError, Footer, Layout, encode};
use crate::table::{Optima, Sheet, Signal};

/// Places of a table at which samples are taken.
const PLACES: u64 = 8;

/// Time after which the sample of a table is large enough.
const ENOUGH: Duration = Duration::from_millis(100);

/// What a table will cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Seconds of one processor, without the optimal protocols it shares.
    pub seconds: f64,
    /// Bytes on disk.
    pub bytes: f64,
}

/// Estimates each table of `sweep`, and the seconds of one processor that the shared optimal protocols take.
pub fn estimate(sweep: &Sweep) -> Result<(Vec<Estimate>, f64), RunError> {
    let plan = Plan::new(sweep);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .map_err(|source| RunError::Threads { threads: 1, source })?;
    pool.install(|| {
        let optima = sweep.optima();
        let tables = sweep.requests.iter().map(|request| table(sweep, request, &plan, &optima));
        Ok((tables.collect::<Result<_, RunError>>()?, shared(sweep, &plan)))
    })
}

/// Where samples of `length` rows lie.
fn samples(rows: u64, length: u64) -> impl Iterator<Item = Range<u64>> {
    let places = PLACES.min(rows);
    (0..places).map(move |place| {
        let start = (u128::from(place) * u128::from(rows) / u128::from(places)) as u64;
        start..start.saturating_add(length).min(rows)
    })
}

fn table(sweep: &Sweep, request: &Request, plan: &Plan, optima: &Optima) -> Result<Estimate, RunError> {
    let signal = Signal::default();
    let job = sweep.job(request, optima, &signal);
    let layout = Layout::new(request.table, &request.selection, &sweep.grid);
    let manifest = plan.manifest(sweep);
    let measure = |rows: Range<u64>| -> Result<usize, RunError> {
        let mut sheet = Sheet::new(request.selection.indices().len());
        sheet.resize((rows.end - rows.start) as usize);
        request.table.compute(&job, rows.clone(), &mut sheet)?;
        let footer = Footer::new(&manifest, request.table.name(), rows);
        let bytes = encode(&layout, job.rows, &sheet, &footer).map_err(DatasetError::Sample)?;
        Ok(bytes.len())
    };
    // The first round solves the shared protocols of its places, which are counted on their own, and tells what an empty part weighs.
    let mut overhead = 0;
    for range in samples(request.rows, 1) {
        overhead = measure(range)?;
    }
    let mut length = 1;
    loop {
        let start = Instant::now();
        let (mut rows, mut bytes) = (0, 0);
        for range in samples(request.rows, length) {
            rows += range.end - range.start;
            bytes += measure(range)?.saturating_sub(overhead);
        }
        let elapsed = start.elapsed();
        if elapsed >= ENOUGH || rows >= request.rows || length >= request.table.rows_per_part() {
            let parts = request.rows.div_ceil(request.table.rows_per_part());
            let scale = request.rows as f64 / rows as f64;
            return Ok(Estimate {
                seconds: elapsed.as_secs_f64() * scale,
                bytes: bytes as f64 * scale + overhead as f64 * parts as f64,
            });
        }
        length *= 4;
    }
}

/// Seconds of one processor for all shared optimal protocols.
fn shared(sweep: &Sweep, plan: &Plan) -> f64 {
    let Some(projection) = sweep.optimum_rows.as_ref() else { return 0.0 };
    // A store without room: every protocol is solved anew.
    let optima = Optima::new(u64::MAX, sweep.bounded, sweep.optimum_rtol());
    let mut solved = 0;
    let start = Instant::now();
    while start.elapsed() < ENOUGH / 4 {
        for range in samples(projection.rows(), 1) {
            optima.get(range.start, &sweep.grid.scaled(&projection.point(range.start)));
            solved += 1;
        }
    }
    start.elapsed().as_secs_f64() / f64::from(solved) * plan.optima as f64
}
