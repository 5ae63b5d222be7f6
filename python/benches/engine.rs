//! Time of the engine for optima in memory, without Python and without files: prints seconds, the least of several.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use slipsweep::sweep::{self, Plan, Sweep};
use slipsweep::table::Signal;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Repetitions.
const TIMES: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let count: u64 = std::env::args().nth(1).ok_or("usage: engine COUNT")?.parse()?;
    let axes = format!("t_f = {{ geomspace = [0.01, 0.1, {count}] }}\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0");
    let sweep = Sweep::parse(&format!("name = \"engine\"\n[axes]\n{axes}\n[tables.optimal]"), Path::new("."))?;
    let (plan, pool) = (Plan::new(&sweep), sweep::pool(0)?);
    let (request, parts) = (&sweep.requests[0], &plan.tables[0]);
    let mut least = f64::INFINITY;
    for _ in 0..TIMES {
        let start = Instant::now();
        let (signal, caches) = (Signal::default(), sweep.optimum_cache());
        let job = sweep.job(request, &caches[0], &signal);
        sweep::compute(&pool, request.table, &job, parts, 0..parts.parts, |_, _| {})?;
        least = least.min(start.elapsed().as_secs_f64());
    }
    println!("{least}");
    Ok(())
}
