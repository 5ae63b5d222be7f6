//! The pipeline against its own computation: how much encoding and writing add, and what a second thread brings.
//!
//! `cargo bench --bench pipeline` computes the landscape of sixty durations (9.6 million rows) into memory on one and
//! on two threads, then in turn with runs that write Parquet to disk, each several times, and prints the least time of
//! each and their ratios. Two runs side by side that share nothing tell what the machine allows a second thread.

use std::path::Path;
use std::time::Instant;

use slipsweep::dataset::Folder;
use slipsweep::sweep::{self, Plan, Sweep};
use slipsweep::table::{Optima, Signal};

/// As in the program.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const SPEC: &str = r#"
name = "pipeline"

[axes]
t_f = { linspace = [0.02, 0.049, 60] }
a = 0.03
b = 0.05
v_i = 3.0
v_f = 100.0
alpha_2 = { linspace = [-0.5, 0.5, 401], unit = "1/t_f" }
alpha_3 = { linspace = [-0.5, 0.5, 401], unit = "1/t_f^2" }

[tables.gap]
"#;

const ROUNDS: usize = 15;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Outcome<()> {
    let folder = std::env::temp_dir().join(format!("slipsweep-pipeline-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let done = measure(&folder);
    std::fs::remove_dir_all(&folder)?;
    done
}

fn measure(folder: &Path) -> Outcome<()> {
    let path = folder.join("spec.toml");
    std::fs::write(&path, SPEC)?;
    let sweep = Sweep::load(&path)?;
    let rows = Plan::new(&sweep).tables[0].rows as f64;
    // Nothing is written before these are done: the system writes files back long after the run.
    let alone = least(|| Ok([compute(&sweep, 1)?, compute(&sweep, 2)?, side_by_side(&sweep)?]))?;
    let [one, two, one_on_disk, two_on_disk] = least(|| {
        Ok([compute(&sweep, 1)?, compute(&sweep, 2)?, pipeline(&sweep, folder, 1)?, pipeline(&sweep, folder, 2)?])
    })?;
    for (name, seconds) in [
        ("compute alone, 1 thread", alone[0]),
        ("compute alone, 2 threads", alone[1]),
        ("compute, 1 thread", one),
        ("compute, 2 threads", two),
        ("pipeline, 1 thread", one_on_disk),
        ("pipeline, 2 threads", two_on_disk),
    ] {
        println!("{name:24} {:7.1} ns a row  {:5.2} million rows a second", seconds / rows * 1e9, rows / seconds / 1e6);
    }
    println!("two threads over one, compute alone: {:.2}", alone[0] / alone[1]);
    println!("two runs side by side over one, compute alone: {:.2}", 2.0 * alone[0] / alone[2]);
    println!("pipeline over compute, 1 thread: {:.2}", one_on_disk / one);
    println!("pipeline over compute, 2 threads: {:.2}", two_on_disk / two);
    Ok(())
}

/// The least of each of several times, measured in turn.
fn least<const N: usize>(measure: impl Fn() -> Outcome<[f64; N]>) -> Outcome<[f64; N]> {
    let mut least = [f64::INFINITY; N];
    for _ in 0..ROUNDS {
        for (least, seconds) in least.iter_mut().zip(measure()?) {
            *least = least.min(seconds);
        }
    }
    Ok(least)
}

/// Seconds to compute every part and throw it away.
fn compute(sweep: &Sweep, threads: usize) -> Outcome<f64> {
    let pool = sweep::pool(threads)?;
    let plan = Plan::new(sweep);
    let optima = Optima::new(plan.optima, sweep.bounded, sweep.optimum_rtol());
    let signal = Signal::default();
    let request = &sweep.requests[0];
    let job = sweep.job(request, &optima, &signal).ok_or("too many rows")?;
    let start = Instant::now();
    sweep::compute(&pool, request.table, &job, &plan.tables[0], 0..plan.tables[0].parts, |_, _| {})?;
    Ok(start.elapsed().as_secs_f64())
}

/// Seconds to compute every part twice, by two pools of one thread each at the same time.
fn side_by_side(sweep: &Sweep) -> Outcome<f64> {
    let start = Instant::now();
    std::thread::scope(|scope| {
        let other = scope.spawn(|| compute(sweep, 1).is_ok());
        compute(sweep, 1)?;
        if other.join().unwrap_or(false) { Ok(()) } else { Err("the other run failed".into()) }
    })
    .map(|()| start.elapsed().as_secs_f64())
}

/// Seconds to run the sweep with its parts on disk.
fn pipeline(sweep: &Sweep, folder: &Path, threads: usize) -> Outcome<f64> {
    let out = folder.join("out");
    let start = Instant::now();
    sweep::run(sweep, &Folder::new(&out, &sweep.name), threads, &Signal::default())?;
    let seconds = start.elapsed().as_secs_f64();
    std::fs::remove_dir_all(&out)?;
    Ok(seconds)
}
