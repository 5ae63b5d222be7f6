//! `slipsweep run SPEC`: computes what is missing of a dataset, then reads it back and says what is in it.

use std::path::PathBuf;
use std::time::Instant;

use super::watch::watched;
use super::{FAILED, Failure, NOT_STRICT, WRONG, say, words};
use crate::dataset::{Cell, DatasetError, Digest, Folder, Row};
use crate::grid::Quantity;
use crate::protocol::Status;
use crate::sweep::{self, Outcome, Plan, RunError, Sweep};
use crate::table::{self, STATUS, Signal, Work};

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The sweep spec, a TOML file
    spec: PathBuf,
    /// Folder in which the dataset's folder is made
    #[arg(long, value_name = "DIR", default_value = "results")]
    out: PathBuf,
    /// Threads to use, at most 1024; one a processor by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Say nothing but errors
    #[arg(long)]
    quiet: bool,
    /// Fail with exit code 3 if any row is not_converged
    #[arg(long)]
    strict: bool,
}

/// Runs a spec.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let sweep = Sweep::load(&arguments.spec)?;
    let folder = Folder::new(&arguments.out, &sweep.name);
    let plan = Plan::new(&sweep);
    let rows = plan.tables.iter().fold(0_u64, |sum, table| sum.saturating_add(table.rows));
    let signal = Signal::default();
    let start = Instant::now();
    let threads = arguments.threads.map_or(0, usize::from);
    let (done, caught) = watched(&signal, rows, arguments.quiet, || sweep::run(&sweep, &folder, threads, &signal));
    let outcome = done.map_err(|error| {
        let parts =
            plan.tables.iter().flat_map(|table| (0..table.parts).map(|part| folder.has_part(&table.name, part)));
        let (there, all) = parts.fold((0, 0), |(there, all), is| (there + u64::from(is), all + 1));
        explain(error, caught, arguments, (there, all))
    })?;
    let seconds = start.elapsed().as_secs_f64();

    if arguments.quiet && !arguments.strict {
        return Ok(());
    }
    let read = plan.tables.iter().map(|table| Digest::read(&folder, table));
    let digests: Vec<Digest> = read.collect::<Result<_, _>>().map_err(Failure::failed)?;
    if !arguments.quiet {
        let mut text = String::new();
        for ((table, digest), done) in plan.tables.iter().zip(&digests).zip(&outcome.tables) {
            text.push_str(&summary(&table.name, table.rows, digest));
            if done.kept > 0 {
                text.push_str(&format!(
                    "  {} of {} kept from before\n",
                    words::count(done.kept),
                    words::things(table.parts, "part")
                ));
            }
            text.push('\n');
        }
        text.push_str(&account(&outcome, seconds));
        text.push_str(&format!("written to {}\n", folder.path().display()));
        say(&text)?;
    }
    let defects: u64 = digests.iter().map(|digest| digest.status[Status::NotConverged as usize]).sum();
    if arguments.strict && defects > 0 {
        let message = format!("error: {} not_converged", words::things(defects, "row"));
        return Err(Failure { code: NOT_STRICT, message });
    }
    Ok(())
}

fn explain(error: RunError, caught: Option<i32>, arguments: &Arguments, (there, all): (u64, u64)) -> Failure {
    match error {
        RunError::Stopped(_) => Failure {
            code: caught.and_then(|number| u8::try_from(128 + number).ok()).unwrap_or(FAILED),
            message: format!(
                "stopped; {} of {} finished: the same command goes on from there",
                words::count(there),
                words::things(all, "part")
            ),
        },
        RunError::Dataset(DatasetError::Foreign { .. } | DatasetError::Occupied { .. }) => {
            Failure { code: WRONG, message: format!("error: {error}") }
        }
        RunError::Threads { .. } if arguments.threads.is_some() => {
            Failure { code: WRONG, message: format!("error: {error}") }
        }
        _ => Failure::failed(error),
    }
}

/// One table in a few lines.
fn summary(name: &str, rows: u64, digest: &Digest) -> String {
    let counts: Vec<String> = Status::ALL
        .iter()
        .zip(digest.status)
        .filter(|(_, rows)| *rows > 0)
        .map(|(status, rows)| format!("{} {}", words::count(rows), status.name()))
        .collect();
    let mut text = format!("{name}: {} ({})\n", words::things(rows, "row"), counts.join(", "));
    if !digest.least.is_empty() && digest.rows.is_none() {
        // A family may hold protocols that miss the final state, with any work.
        let arriving = if name == "swift" { " and arrive" } else { "" };
        text.push_str(&format!("  least gap among the rows that are ok{arriving}:\n"));
        text.push_str(&listing(&digest.least));
    }
    match &digest.rows {
        Some(rows) => text.push_str(&listing(rows)),
        None => {
            let mut lines = vec![["column", "rows", "least", "greatest"].map(str::to_owned).to_vec()];
            for range in digest.ranges.iter().filter(|range| range.count > 0) {
                let ends = [range.least, range.greatest].map(words::number);
                lines.push([range.column.clone(), words::count(range.count)].into_iter().chain(ends).collect());
            }
            text.push_str(&words::aligned(&lines, 2));
            for (column, counts) in &digest.words {
                let counts: Vec<String> =
                    counts.iter().map(|(word, rows)| format!("{} {word}", words::count(*rows))).collect();
                text.push_str(&format!("  {column}: {}\n", counts.join(", ")));
            }
        }
    }
    if let Some(prediction) = table::find(name).and_then(|table| table.prediction())
        && !digest.predicted.is_empty()
    {
        text.push_str(&format!("  {} as {} predicts it, and as found:\n", prediction.column, prediction.theory));
        let mut lines = vec![["predicted", "found", "rows"].map(str::to_owned).to_vec()];
        for (predicted, found, rows) in &digest.predicted {
            lines.push(vec![(*predicted).to_owned(), found.clone(), words::count(*rows)]);
        }
        text.push_str(&words::aligned(&lines, 4));
        let surprises = digest
            .predicted
            .iter()
            .filter(|(predicted, found, _)| found.as_str() == prediction.surprise && *predicted != prediction.surprise);
        let differ: u64 = surprises.map(|(.., rows)| rows).sum();
        if differ > 0 {
            text.push_str(&format!(
                "    {} of {}: {}\n",
                words::things(differ, "row"),
                prediction.surprise,
                prediction.why
            ));
        }
    }
    text
}

/// Rows with a header; axes that do not vary stand above, columns without any value are left out.
fn listing(rows: &[Row]) -> String {
    let Some(first) = rows.first() else { return String::new() };
    let is_axis = |name: &str| Quantity::from_name(name).is_some();
    let mut common = Vec::new();
    let mut shown = Vec::new();
    let mut results_begin = false;
    for (place, (name, cell)) in first.iter().enumerate() {
        // `best` has result columns of the same names as axes: axes end where they stop coming in the order of quantities.
        results_begin |= !is_axis(name);
        let varies = rows.iter().any(|row| row[place].1 != *cell);
        let missing = rows.iter().all(|row| row[place].1 == Cell::Missing);
        if !results_begin && !varies && Quantity::from_name(name).is_some_and(|axis| !axis.has_scale()) {
            common.push(format!("{name} = {}", cell_text(cell)));
        } else if !missing && (name != STATUS || varies) {
            shown.push(place);
        }
    }
    let mut lines = vec![shown.iter().map(|&place| first[place].0.clone()).collect::<Vec<_>>()];
    lines.extend(rows.iter().map(|row| shown.iter().map(|&place| cell_text(&row[place].1)).collect()));
    let mut text = String::new();
    if !common.is_empty() {
        text.push_str(&format!("  at {}\n", common.join(", ")));
    }
    text.push_str(&words::aligned(&lines, 4));
    text
}

fn cell_text(cell: &Cell) -> String {
    match cell {
        Cell::Missing => "-".to_owned(),
        Cell::Number(value) => words::number(*value),
        Cell::Word(word) => word.clone(),
    }
}

/// What the run spent.
fn account(outcome: &Outcome, seconds: f64) -> String {
    let rows: u64 = outcome.tables.iter().map(|table| table.rows).sum();
    if rows == 0 {
        return "nothing to compute: every part was there\n".to_owned();
    }
    let Work { optima, landscapes, best, swifts, crossovers, simulations, steps, quadratures, nodes } = outcome.work;
    let mut text = format!(
        "{} in {}: {} rows a second, Parquet on disk included\n",
        words::things(rows, "row"),
        words::duration(seconds),
        words::count((rows as f64 / seconds) as u64),
    );
    let spent: Vec<String> = [
        (optima, "optimal protocol"),
        (landscapes, "landscape"),
        (best, "best shortcut"),
        (swifts, "family shortcut"),
        (crossovers, "transition"),
        (simulations, "simulation"),
        (steps, "step"),
        (quadratures, "quadrature"),
        (nodes, "node"),
    ]
    .into_iter()
    .filter(|(number, _)| *number > 0)
    .map(|(number, thing)| words::things(number, thing))
    .collect();
    if !spent.is_empty() {
        text.push_str(&format!("work: {}\n", spent.join(", ")));
    }
    text
}
