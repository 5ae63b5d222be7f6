//! `slipsweep run SPEC`: computes the missing parts of a dataset or of one shard, and summarises it.

use std::ffi::OsStr;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::kind::{self, Kind as PathKind};
use super::plan::too_large;
use super::shards::quoted;
use super::watch::{waiting, watched};
use super::{
    EXIT_FAILURE, EXIT_NOT_CONVERGED, EXIT_TEMPFAIL, Failure, is_stdout, load, opened, refused, say, summary, whole,
    words, wrong,
};
use crate::dataset::atomic::nearest_folder;
use crate::dataset::{DatasetError, Folder};
use crate::file::folder_of;
use crate::protocol::Status;
use crate::sweep::{self, Outcome, Plan, RunError, Shard, Sweep, contains_part};
use crate::table::Signal;

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep run granite.toml
  slipsweep run granite.toml --out /scratch/results --threads 8 --quiet")]
pub struct Arguments {
    /// The sweep spec, a TOML file; or the folder of an incomplete dataset
    spec: PathBuf,
    /// Parent folder of the dataset [default: results, or that of the dataset]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of threads, at most 1024 [default: one for each processor]
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = whole::<u16>(1, 1024))]
    threads: Option<u16>,
    /// Compute only shard I of N, counted from 0; all shards may run at the same time
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Exit with code 75 instead of 2 after a temporary failure, so that a scheduler requeues the job
    #[arg(long)]
    requeue: bool,
    /// Print errors only
    #[arg(short, long)]
    quiet: bool,
    /// Fail with exit code 3 if any row is not_converged
    #[arg(long)]
    strict: bool,
}

/// Runs a spec: reads and plans it, computes, encodes and publishes the missing parts, and summarises the tables.
///
/// # Errors
///
/// A spec that is wrong, an interrupted run, failed rows, or, with `--strict`, rows that are not `ok`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let start = Instant::now();
    if let Some(out) = arguments.out.as_deref().filter(|out| is_stdout(out) || out.exists() && !out.is_dir()) {
        let found = format!("--out {}: not a folder", out.display());
        return Err(refused(found, "a folder, which the run makes if it is missing", "name a folder"));
    }
    let (sweep, folder) = subject(arguments)?;
    let (plan, parts) = waiting("planning the sweep", || {
        let plan = Plan::new(&sweep);
        let parts = arguments.shard.unwrap_or(Shard::WHOLE).parts(&sweep, &plan).map_err(wrong)?;
        check_room(&sweep, &plan, &parts, &folder)?;
        Ok::<_, Failure>((plan, parts))
    })?;
    let outcome = solve(arguments, &sweep, &folder, &plan, &parts)?;
    if !arguments.quiet {
        say(&report(&sweep, &plan, &folder, &outcome, arguments.shard, start))?;
    }
    let defects: u64 =
        outcome.statistics.iter().map(|statistics| statistics.status[Status::NotConverged as usize]).sum();
    if arguments.strict && defects > 0 {
        let message = format!("error: {} not_converged", words::things(defects, "row"));
        return Err(Failure { code: EXIT_NOT_CONVERGED, message });
    }
    Ok(())
}

/// Computes the missing `parts` of each table, and shows the progress.
fn solve(
    arguments: &Arguments,
    sweep: &Sweep,
    folder: &Folder,
    plan: &Plan,
    parts: &[Vec<Range<u64>>],
) -> Result<Outcome, Failure> {
    let tables = plan.tables.iter().zip(parts).zip(&sweep.requests).map(|((table, parts), request)| {
        let parts = parts.iter().filter(|range| !range.is_empty());
        let rows = parts.map(|range| table.rows_of(range.end - 1).end - table.rows_of(range.start).start);
        (rows.fold(0_u64, u64::saturating_add), request.table.cost())
    });
    let (signal, threads) = (Signal::default(), arguments.threads.map_or(0, usize::from));
    let (done, caught) = watched(&signal, tables.collect(), arguments.quiet, || match arguments.shard {
        None => sweep::run(sweep, folder, threads, &signal),
        Some(shard) => sweep::run_shard(sweep, folder, shard, threads, &signal),
    });
    done.map_err(|error| {
        let there = plan.tables.iter().map(|table| folder.parts_there(table).len() as u64).sum();
        let all = plan.tables.iter().map(|table| table.parts).sum();
        explain(error, caught, arguments, (there, all))
    })
}

/// The report: contents of the tables, work since `start`, and next commands.
fn report(
    sweep: &Sweep,
    plan: &Plan,
    folder: &Folder,
    outcome: &Outcome,
    shard: Option<Shard>,
    start: Instant,
) -> String {
    let mut text = String::new();
    for ((table, statistics), done) in plan.tables.iter().zip(&outcome.statistics).zip(&outcome.tables) {
        let all = done.kept + done.made;
        match shard {
            None => {
                text.push_str(&summary::statistics(&table.name, table.rows, statistics));
                text.push_str(&summary::infeasibility(folder.path(), &table.name, statistics));
            }
            Some(shard) => {
                let (ours, parts) = (words::count(all), words::things(table.parts, "part"));
                let (index, count) = (shard.index(), shard.count());
                text.push_str(&format!("{}: {ours} of {parts} in shard {index} of {count}\n", table.name));
            }
        }
        if done.kept > 0 {
            let (kept, all) = (words::count(done.kept), words::things(all, "part"));
            text.push_str(&format!("  {kept} of {all} kept\n"));
        }
        if done.damaged > 0 {
            text.push_str(&format!("  {} recomputed\n", words::things(done.damaged, "damaged part")));
        }
        if shard.is_none() {
            text.push('\n');
        }
    }
    text.push_str(&account(outcome, start.elapsed().as_secs_f64()));
    text.push_str(&format!("written to {}\n", folder.path().display()));
    if shard.is_none() {
        text.push_str(&next_commands(sweep, folder.path()));
    }
    text
}

/// Greatest size of a cell on disk, without long labels, in bytes: twice that of a double, the longest type.
const MAX_CELL_BYTES: f64 = 16.0;

/// Greatest size of a part without its rows and the spec, in bytes. Chosen: five times that of `compliant`, the longest of all tables, whose part of one
/// row has 12 kB.
const MAX_FOOTER_BYTES: f64 = 65536.0;

/// Checks that the missing parts of `shards`, given for each table, fit on the disk.
fn check_room(sweep: &Sweep, plan: &Plan, shards: &[Vec<Range<u64>>], folder: &Folder) -> Result<(), Failure> {
    let Ok(free) = fs4::available_space(nearest_folder(folder.path())) else { return Ok(()) };
    let free = free as f64;
    let missing: Vec<u64> = (plan.tables.iter().zip(shards))
        .map(|(table, shard)| {
            let there = folder.parts_there(table).iter().filter(|part| contains_part(shard, **part)).count() as u64;
            shard.iter().map(|range| range.end - range.start).sum::<u64>() - there
        })
        .collect();
    let most = (sweep.requests.iter().zip(&plan.tables).zip(&missing)).map(|((request, table), &parts)| {
        let rows = parts as f64 * table.rows_per_part.min(table.rows) as f64;
        let cells = request.table.axes().len() + request.projection.indices().len() + 1;
        rows * cells as f64 * MAX_CELL_BYTES + parts as f64 * (MAX_FOOTER_BYTES + sweep.text.len() as f64)
    });
    if most.sum::<f64>() <= free {
        return Ok(());
    }
    // If the upper bound does not fit, a sample estimates the size.
    let estimates = sweep::estimate(sweep, folder.path()).map_err(Failure::failed)?;
    let bytes = (estimates.tables.iter().zip(&plan.tables).zip(missing))
        .map(|((estimate, table), missing)| estimate.bytes * missing as f64 / table.parts as f64)
        .sum::<f64>();
    if bytes <= free { Ok(()) } else { Err(wrong(too_large(folder.path(), bytes, free))) }
}

/// The sweep and its folder, from a spec or from a dataset, which contains its spec.
fn subject(arguments: &Arguments) -> Result<(Sweep, Folder), Failure> {
    let path = &arguments.spec;
    if !path.is_dir() {
        kind::expect_spec(path)?;
        let sweep = if arguments.quiet { Sweep::load(path)? } else { load(path)? };
        let folder = Folder::new(arguments.out.as_deref().unwrap_or(Path::new("results")), &sweep.name);
        return Ok((sweep, folder));
    }
    let (folder, manifest) = opened(path, &[PathKind::Spec, PathKind::Dataset])?;
    if manifest.spec.is_empty() {
        let message = "the manifest is missing, and the parts do not contain the spec";
        return Err(wrong(format!("{}: {message}\n  help: run the spec file of this dataset", path.display())));
    }
    let sweep = Sweep::parse_at(&manifest.spec, &folder.manifest_path()).map_err(|error| {
        let what = format!("{}: its spec refers to files that are not in the dataset", path.display());
        wrong(format!("{what}\n  found: {}\n  help: run the spec file: {}", error.found, by_spec(path, &manifest.name)))
    })?;
    let folder = arguments.out.as_deref().map_or(folder, |out| Folder::new(out, &sweep.name));
    Ok((sweep, folder))
}

/// The commands that continue the dataset in `path`, called `name`, with its spec file: the folder has the name of the dataset then.
pub fn by_spec(path: &Path, name: &str) -> String {
    let out = folder_of(path);
    let home = out.join(name);
    let is_home = std::path::absolute(path).ok().is_some_and(|path| path.file_name() == Some(OsStr::new(name)));
    let rename = if is_home { String::new() } else { format!("mv {} {} && ", quoted(path), quoted(&home)) };
    format!("{rename}slipsweep run SPEC --out {}", quoted(out))
}

fn explain(error: RunError, caught: Option<i32>, arguments: &Arguments, (there, all): (u64, u64)) -> Failure {
    match error {
        RunError::Stopped(_) => {
            let (there, all) = (words::count(there), words::things(all, "part"));
            let message = format!("stopped; {there} of {all} finished; the same command continues");
            Failure { code: caught.and_then(|number| u8::try_from(128 + number).ok()).unwrap_or(EXIT_FAILURE), message }
        }
        RunError::Dataset(
            DatasetError::Foreign { .. }
            | DatasetError::OtherSpec { .. }
            | DatasetError::OtherTables { .. }
            | DatasetError::ForeignPart { .. }
            | DatasetError::Occupied { .. },
        ) => wrong(error),
        RunError::Threads { .. } if arguments.threads.is_some() => wrong(error),
        _ if arguments.requeue && may_pass(&error) => {
            Failure { code: EXIT_TEMPFAIL, message: format!("error: {error}") }
        }
        _ => Failure::failed(error),
    }
}

/// Whether another attempt may succeed.
fn may_pass(error: &RunError) -> bool {
    match error {
        RunError::Dataset(DatasetError::Busy { .. } | DatasetError::Taken { .. }) => true,
        RunError::Dataset(DatasetError::Io { source, .. }) => is_passing(source),
        _ => false,
    }
}

/// Whether a failure may be temporary: of a disk, a network or a server, but not of free space or permissions.
fn is_passing(error: &io::Error) -> bool {
    use io::ErrorKind as Kind;
    let waits = [Kind::Interrupted, Kind::TimedOut, Kind::WouldBlock, Kind::ResourceBusy, Kind::StaleNetworkFileHandle];
    let network = [Kind::HostUnreachable, Kind::NetworkUnreachable, Kind::NetworkDown, Kind::NotConnected];
    let connection = [Kind::ConnectionReset, Kind::ConnectionAborted, Kind::ConnectionRefused];
    let kinds = waits.iter().chain(&network).chain(&connection);
    // "Input/output error", for which `io::ErrorKind` has no variant.
    error.raw_os_error() == Some(libc::EIO) || kinds.into_iter().any(|kind| *kind == error.kind())
}

/// The work of the run, in words.
fn account(outcome: &Outcome, seconds: f64) -> String {
    let rows: u64 = outcome.tables.iter().map(|table| table.rows).sum();
    if rows == 0 {
        let is_empty = outcome.tables.iter().all(|table| table.kept == 0);
        let why = if is_empty { "this shard has no parts" } else { "every part exists" };
        return format!("nothing to compute: {why}\n");
    }
    let work = outcome.work;
    let (all, rate) = (words::things(rows, "row"), words::count((rows as f64 / seconds) as u64));
    let mut text = format!("{all} in {}: {rate} rows per second, writing included\n", words::duration(seconds));
    let spent: Vec<String> = [
        (work.optima + work.own_optima, "optimal protocol"),
        (work.landscapes, "landscape"),
        (work.best, "best shortcut"),
        (work.shortcuts, "family shortcut"),
        (work.crossovers, "transition"),
        (work.simulations, "simulation"),
        (work.steps, "step"),
        (work.quadratures, "quadrature"),
        (work.nodes, "node"),
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

/// Commands that inspect the dataset of `sweep` in `path`.
fn next_commands(sweep: &Sweep, path: &Path) -> String {
    let path = quoted(path);
    let mut text = format!("next:\n  slipsweep head {path}\n  slipsweep plot {path}\n");
    // A build without SQL does not suggest it.
    if let Some(request) = sweep.requests.first().filter(|_| cfg!(feature = "query")) {
        let sql = format!("SELECT status, count(*) FROM {} GROUP BY status", request.table.name());
        text.push_str(&format!("  slipsweep query {path} \"{sql}\"\n"));
    }
    text
}
