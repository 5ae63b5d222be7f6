//! The pipeline against its own computation: how much encoding and writing add, and what a second thread brings.
//!
//! `cargo bench --bench pipeline` computes the landscape of sixty durations (9.6 million rows) into memory on one and
//! on two threads, then runs it with Parquet on disk, each several times in turn, and prints the least time of each and
//! their ratios. Two runs side by side that share nothing tell what the machine allows a second thread.

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
    let mut least = [f64::INFINITY; 5];
    for _ in 0..ROUNDS {
        let seconds = [
            compute(&sweep, 1)?,
            compute(&sweep, 2)?,
            pipeline(&sweep, folder, 1)?,
            pipeline(&sweep, folder, 2)?,
            side_by_side(&sweep)?,
        ];
        for (least, seconds) in least.iter_mut().zip(seconds) {
            *least = least.min(seconds);
        }
    }
    let names = ["compute, 1 thread", "compute, 2 threads", "pipeline, 1 thread", "pipeline, 2 threads"];
    for (name, seconds) in names.iter().zip(least) {
        println!("{name:20} {:7.1} ns a row  {:5.2} million rows a second", seconds / rows * 1e9, rows / seconds / 1e6);
    }
    println!("two threads over one, compute: {:.2}", least[0] / least[1]);
    println!("two runs side by side over one, compute: {:.2}", 2.0 * least[0] / least[4]);
    println!("pipeline over compute, 1 thread: {:.2}", least[2] / least[0]);
    println!("pipeline over compute, 2 threads: {:.2}", least[3] / least[1]);
    Ok(())
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
