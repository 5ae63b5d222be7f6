//! `slipsweep plan SPEC`: rows, solves, time and size of a sweep, before it runs.

use std::path::{Path, PathBuf};
use std::thread::available_parallelism;
use std::time::Instant;

use super::watch::waiting;
use super::{Failure, load, say, words};
use crate::dataset::atomic::nearest_folder;
use crate::sweep::{Estimates, Plan, Sweep, estimate};

/// Arguments of `plan`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  slipsweep plan granite.toml")]
pub struct Arguments {
    /// The sweep spec, a TOML file
    spec: PathBuf,
    /// Parent folder of the dataset, whose free disk space is compared with the size
    #[arg(short, long, value_name = "DIR", default_value = "results")]
    out: PathBuf,
}

/// Seconds below which the start of the process and its first pages of memory count as much as the rows: `benches/waiting/run` prints committed
/// sweeps that take up to 0.07 s more than their rows.
const SHORT_SECONDS: f64 = 0.2;

/// Prints the plan of a spec.
///
/// # Errors
///
/// A spec that is wrong.
pub fn plan(arguments: &Arguments) -> Result<(), Failure> {
    let start = Instant::now();
    let sweep = load(&arguments.spec)?;
    let reading = start.elapsed().as_secs_f64();
    let estimates = waiting("computing a sample", || estimate(&sweep, &arguments.out)).map_err(Failure::failed)?;
    let mut text = format!("{}\n{}", sweep.name, in_words(&sweep, &estimates, reading));
    if let Ok(free) = fs4::available_space(nearest_folder(&arguments.out)) {
        let (bytes, free) = (estimates.bytes(), free as f64);
        text.push_str(&match bytes > free {
            true => format!("does not fit: {}\n", too_large(&arguments.out, bytes, free)),
            false => format!("{} free on the disk of {}\n", words::bytes(free), arguments.out.display()),
        });
    }
    say(&text)
}

/// The message for a dataset of `bytes` that does not fit on the disk of `folder` with `free` bytes.
pub fn too_large(folder: &Path, bytes: f64, free: f64) -> String {
    format!(
        "{}: about {} to write, but {} free on the disk\n  help: write less, with `reduce` or fewer `columns`, or write elsewhere with --out DIR",
        folder.display(),
        words::bytes(bytes),
        words::bytes(free),
    )
}

/// The rows of each table and their estimated cost; reading the spec takes `reading` seconds.
pub fn in_words(sweep: &Sweep, estimates: &Estimates, reading: f64) -> String {
    let plan = Plan::new(sweep);
    let threads = available_parallelism().map_or(1, |threads| threads.get());
    let has_condition = sweep.grid.blocks.iter().any(|block| block.condition.is_some());
    let header = ["table", "rows", "dropped by where", "parts", "size", "time on one thread"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for ((table, dropped), estimate) in plan.tables.iter().zip(&plan.dropped).zip(&estimates.tables) {
        rows.push(vec![
            table.name.clone(),
            words::count(table.rows),
            words::count(*dropped),
            words::count(table.parts),
            words::bytes(estimate.bytes),
            words::duration(estimate.seconds),
        ]);
    }
    if !has_condition {
        rows.iter_mut().for_each(|row| drop(row.remove(2)));
    }
    let mut text = words::aligned(&rows, 2);
    // More than can be kept are solved where they are needed, and their time is that of the tables.
    if plan.optima > 0 && estimates.shared > 0.0 {
        let (solves, time) = (words::things(plan.optima, "optimal protocol"), words::duration(estimates.shared));
        text.push_str(&format!("shared: {solves} solved once each, {time} on one thread\n"));
    }
    let seconds = reading + estimates.elapsed(threads);
    text.push_str(&format!(
        "total: about {} on disk, {} on {}\n",
        words::bytes(estimates.bytes()),
        if seconds < SHORT_SECONDS {
            "less than 0.3 s".to_owned()
        } else {
            format!("about {}", words::duration(seconds))
        },
        words::things(threads as u64, "thread"),
    ));
    text.push_str("(sizes and times from a small sample)\n");
    text
}
