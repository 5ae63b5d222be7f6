//! `slipsweep plan SPEC`: what there is to do, before anything is done.

use std::path::PathBuf;

use super::{Failure, say, words};
use crate::sweep::{Plan, Sweep, estimate};

/// Arguments of `plan`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  slipsweep plan granite.toml")]
pub struct Arguments {
    /// The sweep spec, a TOML file
    spec: PathBuf,
}

/// Prints the plan of a spec.
pub fn plan(arguments: &Arguments) -> Result<(), Failure> {
    let sweep = Sweep::load(&arguments.spec)?;
    say(&format!("{}\n{}", sweep.name, in_words(&sweep)?))
}

/// The rows of each table, and what they cost.
pub fn in_words(sweep: &Sweep) -> Result<String, Failure> {
    let plan = Plan::new(sweep);
    let (estimates, shared) = estimate(sweep).map_err(Failure::failed)?;
    let threads = std::thread::available_parallelism().map_or(1, |threads| threads.get());
    let has_condition = sweep.grid.blocks.iter().any(|block| block.condition.is_some());
    let header = ["table", "rows", "left out by where", "parts", "size", "time on one thread"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for ((table, dropped), estimate) in plan.tables.iter().zip(&plan.dropped).zip(&estimates) {
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
    let seconds = shared + estimates.iter().map(|estimate| estimate.seconds).sum::<f64>();
    let bytes = estimates.iter().map(|estimate| estimate.bytes).sum();
    let mut text = words::aligned(&rows, 2);
    if plan.optima > 0 {
        let (solves, time) = (words::things(plan.optima, "optimal protocol"), words::duration(shared));
        text.push_str(&format!("shared: {solves} solved once each, {time} on one thread\n"));
    }
    text.push_str(&format!(
        "in all: about {} on disk, about {} on {}\n",
        words::bytes(bytes),
        words::duration(seconds / threads as f64),
        words::things(threads as u64, "thread"),
    ));
    text.push_str("(sizes and times from a small sample)\n");
    Ok(text)
}
