//! Linear stability: rows per second of the whole table in memory, on one thread.
//!
//! `cargo bench --bench stability` computes all columns of four million rows several times and prints the least time.
//! The floor is twelve divisions a row, over an array and vectorised: the stiffnesses, and two roots of cubics, which
//! Newton's method finds in four steps each.

mod support;

use std::time::Instant;

use slipsweep::sweep::{self, Plan, Sweep};
use slipsweep::table::{OptimumCache, Signal};

const SPEC: &str = r#"
name = "stability"

[axes]
a = 0.005
b = 0.01
v_i = 1e5
m = 2.5e-16
v_f = { geomspace = [1e5, 1e7, 2000] }
k = { geomspace = [1e-3, 1e-1, 2000] }

[tables.stability]
"#;

const ROUNDS: usize = 7;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::temp_dir().join(format!("slipsweep-stability-{}.toml", std::process::id()));
    std::fs::write(&folder, SPEC)?;
    let sweep = Sweep::load(&folder)?;
    std::fs::remove_file(&folder)?;
    let plan = Plan::new(&sweep);
    let (optima, signal, pool) = (OptimumCache::new(0, 0), Signal::default(), sweep::pool(1)?);
    let (request, table) = (&sweep.requests[0], &plan.tables[0]);
    let job = sweep.job(request, &optima, &signal);
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        sweep::compute(&pool, request.table, &job, table, 0..table.parts, |_, _| {})?;
        least = least.min(start.elapsed().as_secs_f64());
    }
    let rows = table.rows as f64;
    println!("stability: {:.1} ns per row, {:.2} million rows per second", 1e9 * least / rows, rows / least / 1e6);
    let floor = 12.0 * support::one_vector_division();
    println!("floor: {:.1} ns per row, of which it is {:.1}", 1e9 * floor, least / rows / floor);
    Ok(())
}
