//! The engine: computes the parts that are missing or damaged, encodes and writes them.
//!
//! All idle compute threads share a part. One of them encodes it, and writer threads publish it while the next parts are computed.

use std::collections::BTreeMap;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, Scope};

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::check::Sweep;
use super::plan::Plan;
use super::shard::{Shard, TooManyParts, contains_part};
use crate::dataset::{
    CheckDepth, Concurrency, DatasetError, Folder, Footer, Layout, ManifestTable, Session, State, TableStatistics,
    encode,
};
use crate::table::{ColumnBuffer, Job, Phase, RunStats, Signal, Stopped, Table};

/// The result of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The result for each table, in the order of the spec.
    pub tables: Vec<TableOutcome>,
    /// The statistics of each table over kept and new parts.
    pub statistics: Vec<TableStatistics>,
    /// Solver statistics.
    pub work: RunStats,
}

/// The result of a run for one table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableOutcome {
    /// Intact parts that existed before.
    pub kept: u64,
    /// Parts that were written.
    pub made: u64,
    /// Written parts that replace damaged ones.
    pub damaged: u64,
    /// Computed rows.
    pub rows: u64,
}

/// The error of a run.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum RunError {
    /// The dataset cannot be written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The threads cannot be started.
    #[error("cannot start {threads} threads: {source}\n  help: use fewer with --threads N")]
    Threads { threads: usize, source: rayon::ThreadPoolBuildError },
    /// A writer thread cannot be started.
    #[error("cannot start the thread that writes: {0}\n  help: allow the process more memory or more threads")]
    Writer(std::io::Error),
    /// The sweep has too many parts for shards.
    #[error(transparent)]
    Parts(#[from] TooManyParts),
    /// A part panicked: a defect of the program. All other parts are complete.
    #[error(
        "{table}: part {part}, rows {} to {}, panicked: {message}\n  help: this is a bug in slipsweep: please report it; {}",
        rows.start,
        rows.end.saturating_sub(1),
        match others {
            0 => "all other parts are finished".to_owned(),
            _ => format!("{others} more parts panicked; all others are finished"),
        }
    )]
    Panic { table: String, part: u64, rows: Range<u64>, message: String, others: usize },
    /// The run was stopped on request.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// Runs `sweep` on `threads` threads (0: one for each processor) into `folder`, and keeps existing intact parts. No other run may use the
/// folder.
///
/// # Errors
///
/// A dataset that cannot be written, threads that cannot be started, a part that panicked, or a stop on request.
pub fn run(sweep: &Sweep, folder: &Folder, threads: usize, signal: &Signal) -> Result<Outcome, RunError> {
    run_in(sweep, folder, (Shard::WHOLE, Concurrency::Alone), threads, signal)
}

/// Runs the parts of one shard. Any number of processes may run shards of one dataset at the same time, including the same shard.
///
/// Every bit of an existing part is checked. A damaged part is recomputed; a part of another sweep stays and ends the run with an error.
///
/// # Errors
///
/// Those of [`run`], too many parts for shards, or a part of another sweep.
pub fn run_shard(
    sweep: &Sweep,
    folder: &Folder,
    shard: Shard,
    threads: usize,
    signal: &Signal,
) -> Result<Outcome, RunError> {
    run_in(sweep, folder, (shard, Concurrency::Shards), threads, signal)
}

fn run_in(
    sweep: &Sweep,
    folder: &Folder,
    (shard, company): (Shard, Concurrency),
    threads: usize,
    signal: &Signal,
) -> Result<Outcome, RunError> {
    // Plan: the parts of each table in this shard, and the dataset.
    let plan = Plan::new(sweep);
    let shards = shard.parts(sweep, &plan)?;
    let session = folder.open(&plan.manifest(sweep), company).map_err(|error| sweep.explain(error))?;
    let pool = pool(threads)?;
    let optimum_cache = sweep.optimum_cache();
    let run = Run { folder, session: &session, pool: &pool, signal, failure: Mutex::default() };
    let table_runs: Vec<TableRun<'_>> = (sweep.requests.iter().zip(&plan.tables))
        .zip(&optimum_cache)
        .map(|((request, table), optimum_cache)| TableRun {
            run: &run,
            definition: request.table,
            table,
            job: sweep.job(request, optimum_cache, signal),
            layout: Layout::new(request.table, &request.projection, &sweep.grid),
            statistics: Mutex::default(),
            panics: Mutex::default(),
        })
        .collect();

    // Check: intact parts are kept.
    signal.enter(Phase::Checking);
    let intact = table_runs.iter().zip(&shards).map(|(table_run, shard_parts)| table_run.check(shard_parts));
    let intact = intact.collect::<Result<Vec<_>, RunError>>()?;

    // Solve, encode and publish the other parts.
    signal.enter(Phase::Computing);
    let mut outcome = Outcome { tables: Vec::new(), statistics: Vec::new(), work: RunStats::default() };
    thread::scope(|scope| {
        let (to_writers, parts) = sync_channel(1);
        run.start_writers(scope, parts)?;
        for ((table_run, shard_parts), intact) in table_runs.iter().zip(&shards).zip(&intact) {
            let (done, work) = table_run.solve(shard_parts, intact, &to_writers)?;
            outcome.tables.push(done);
            outcome.work += work;
        }
        signal.enter(Phase::Writing);
        Ok::<(), RunError>(())
    })?;
    locked(&run.failure).take().map_or(Ok(()), Err)?;
    session.check()?;
    first_panic(&table_runs)?;
    outcome.statistics = table_runs.into_iter().map(|table_run| content(table_run.statistics)).collect();
    Ok(outcome)
}

/// The threads of a run.
///
/// # Errors
///
/// Threads that cannot be started.
pub fn pool(threads: usize) -> Result<ThreadPool, RunError> {
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|source| {
        let each_processor = || thread::available_parallelism().map_or(1, |threads| threads.get());
        RunError::Threads { threads: if threads == 0 { each_processor() } else { threads }, source }
    })
}

/// Greatest size of all column buffers, in bytes, for two or more parts. Chosen: a part takes a few MiB, so this limits only machines with
/// many threads.
const MAX_BUFFER_BYTES: u64 = 1 << 27;

/// Writer threads. Chosen: while one waits for the disk, the other writes.
pub(super) const WRITERS: usize = 2;

/// Computes the parts `numbers` of a table, and passes number and buffer of each to `take` in any order, or the message of its panic.
///
/// One part more than there are threads is in progress, so that no thread waits for the end of a part. Large parts on many threads are limited
/// by `MAX_BUFFER_BYTES`.
///
/// # Errors
///
/// A stop on request.
pub fn compute(
    pool: &ThreadPool,
    table: &Table,
    job: &Job<'_>,
    parts: &ManifestTable,
    numbers: impl Iterator<Item = u64>,
    take: impl Fn(u64, Result<&ColumnBuffer, String>) + Sync,
) -> Result<RunStats, Stopped> {
    let (give_back, free) = channel();
    let columns = job.projection.indices().len();
    let size = parts.rows_per_part.min(parts.rows).saturating_mul(8 * columns as u64 + 1);
    let buffers = (pool.current_num_threads() as u64 + 1).min((MAX_BUFFER_BYTES / size.max(1)).max(2));
    for _ in 0..buffers {
        let _ = give_back.send(ColumnBuffer::new(columns));
    }
    let result = Mutex::new(Ok(RunStats::default()));
    pool.in_place_scope(|scope| {
        for number in numbers {
            // Never fails: every buffer is returned.
            let Ok(mut buffer) = free.recv() else { break };
            if locked(&result).is_err() {
                break;
            }
            let (give_back, result, take) = (give_back.clone(), &result, &take);
            scope.spawn(move |_| {
                let computed = match attempt(table, job, parts.rows_of(number), &mut buffer) {
                    Ok(computed) => computed
                        .and_then(|work| job.signal.check().map(|()| work))
                        .inspect(|_| take(number, Ok(&buffer))),
                    Err(message) => {
                        take(number, Err(message));
                        Ok(RunStats::default())
                    }
                };
                // The receiver exists as long as the scope.
                let _ = give_back.send(buffer);
                let mut result = locked(result);
                *result = result.and_then(|work| computed.map(|more| [work, more].into_iter().sum()));
            });
        }
    });
    content(result)
}

/// Computes `rows` into `buffer`; the message if that panics.
fn attempt(
    table: &Table,
    job: &Job<'_>,
    rows: Range<u64>,
    buffer: &mut ColumnBuffer,
) -> Result<Result<RunStats, Stopped>, String> {
    buffer.resize((rows.end - rows.start) as usize);
    // A panic leaves a buffer that the next part overwrites, and solves that were not stored.
    catch_unwind(AssertUnwindSafe(|| table.compute(job, rows, buffer))).map_err(|payload| {
        let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
        text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned())
    })
}

/// The shared state of the stages of a run.
struct Run<'a> {
    folder: &'a Folder,
    session: &'a Session,
    pool: &'a ThreadPool,
    signal: &'a Signal,
    /// The first failure of any thread.
    failure: Mutex<Option<RunError>>,
}

impl Run<'_> {
    /// Keeps the first failure.
    fn fail(&self, error: RunError) {
        locked(&self.failure).get_or_insert(error);
    }

    /// Starts the writer threads, so that no compute thread waits for the disk.
    fn start_writers<'scope, 'a: 'scope>(
        &'scope self,
        scope: &'scope Scope<'scope, '_>,
        parts: Receiver<EncodedPart<'a>>,
    ) -> Result<(), RunError> {
        let parts = Arc::new(Mutex::new(parts));
        let next = move || locked(&parts).recv();
        let write = move || {
            while let Ok((table_run, number, bytes)) = next() {
                if let Err(error) = table_run.publish(number, &bytes) {
                    self.fail(error);
                }
            }
        };
        for write in std::iter::repeat_n(write, WRITERS) {
            thread::Builder::new().spawn_scoped(scope, write).map_err(RunError::Writer)?;
        }
        Ok(())
    }
}

/// One table of a run.
struct TableRun<'a> {
    run: &'a Run<'a>,
    definition: &'a Table,
    table: &'a ManifestTable,
    job: Job<'a>,
    layout: Layout,
    /// The statistics of the parts so far.
    statistics: Mutex<TableStatistics>,
    /// The messages of the parts that panicked.
    panics: Mutex<BTreeMap<u64, String>>,
}

impl<'a> TableRun<'a> {
    /// The numbers of the intact parts of `shard`, ascending. All threads of the run check every bit.
    fn check(&self, shard_parts: &[Range<u64>]) -> Result<Vec<u64>, RunError> {
        let mut existing = self.run.folder.parts_there(self.table);
        existing.retain(|number| contains_part(shard_parts, *number));
        let intact = |number: u64| {
            self.run.signal.check()?;
            Ok(self.look(number)?.is_none().then_some(number))
        };
        let intact = || existing.into_par_iter().with_max_len(1).map(intact).collect::<Result<Vec<_>, RunError>>();
        Ok(self.run.pool.install(intact)?.into_iter().flatten().collect())
    }

    /// Computes the parts of `shard` without the `intact` ones, and passes them to the writers.
    fn solve(
        &'a self,
        shard_parts: &[Range<u64>],
        intact: &[u64],
        to_writers: &SyncSender<EncodedPart<'a>>,
    ) -> Result<(TableOutcome, RunStats), RunError> {
        let Run { pool, signal, failure, .. } = self.run;
        let mut done = TableOutcome { kept: intact.len() as u64, ..TableOutcome::default() };
        let missing = shard_parts.iter().cloned().flatten().filter(|number| intact.binary_search(number).is_err());
        let missing = missing.filter(|&number| self.is_missing(number, &mut done));
        let wanted = missing.take_while(|_| locked(failure).is_none() && signal.check().is_ok());
        let take =
            |number, buffer: Result<&ColumnBuffer, String>| match buffer.map(|buffer| self.encode(number, buffer)) {
                // The receiver exists as long as a sender.
                Ok(Ok(bytes)) => _ = to_writers.send((self, number, bytes)),
                Ok(Err(error)) => self.run.fail(error),
                Err(message) => _ = locked(&self.panics).insert(number, message),
            };
        let work = compute(pool, self.definition, &self.job, self.table, wanted, take)?;
        signal.check()?;
        Ok((done, work))
    }

    /// Whether a part must be computed: another run may have written it.
    fn is_missing(&self, number: u64, done: &mut TableOutcome) -> bool {
        match self.look(number) {
            Ok(None) => {
                done.kept += 1;
                return false;
            }
            Ok(Some(fault)) => done.damaged += u64::from(matches!(fault, State::Damaged { .. })),
            Err(error) => {
                self.run.fail(error);
                return false;
            }
        }
        let rows = self.table.rows_of(number);
        done.made += 1;
        done.rows += rows.end - rows.start;
        true
    }

    /// Why a part must be computed: it is missing or damaged. An intact one is counted.
    fn look(&self, number: u64) -> Result<Option<State>, RunError> {
        let Run { folder, session, signal, .. } = self.run;
        match folder.state(&session.manifest, &self.table.name, number, CheckDepth::Whole) {
            State::There { statistics } => {
                let rows = self.table.rows_of(number);
                signal.keep(rows.end - rows.start);
                self.count(*statistics);
                Ok(None)
            }
            fault @ (State::Missing | State::Damaged { .. }) => Ok(Some(fault)),
            foreign => Err(folder.fault(&folder.part(&self.table.name, number), foreign).into()),
        }
    }

    /// Adds the statistics of a part.
    fn count(&self, part: TableStatistics) {
        let mut statistics = locked(&self.statistics);
        *statistics = std::mem::take(&mut *statistics).merge(part);
    }

    /// The bytes of a part, which is counted.
    fn encode(&self, number: u64, buffer: &ColumnBuffer) -> Result<Vec<u8>, RunError> {
        let footer = Footer::new(&self.run.session.manifest, &self.table.name, self.table.rows_of(number));
        let encoded = encode(&self.layout, self.job.rows, buffer, &footer);
        let (bytes, statistics) = encoded.map_err(DatasetError::Encode)?;
        self.count(statistics);
        Ok(bytes)
    }

    /// Writes an encoded part.
    fn publish(&self, number: u64, bytes: &[u8]) -> Result<(), RunError> {
        // A stopped run does not write queued parts.
        self.run.signal.check()?;
        Ok(self.run.session.write_part(&self.table.name, number, bytes)?)
    }
}

/// A part before publication: its table, number and bytes.
type EncodedPart<'a> = (&'a TableRun<'a>, u64, Vec<u8>);

/// The first part that panicked, in the order of tables and parts.
fn first_panic(table_runs: &[TableRun<'_>]) -> Result<(), RunError> {
    let panics: usize = table_runs.iter().map(|table_run| locked(&table_run.panics).len()).sum();
    for TableRun { table, panics: own, .. } in table_runs {
        if let Some((part, message)) = locked(own).pop_first() {
            let (table, rows) = (table.name.clone(), table.rows_of(part));
            return Err(RunError::Panic { table, part, rows, message, others: panics - 1 });
        }
    }
    Ok(())
}

/// The content of `mutex`, including a poisoned one.
pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The owned content of `mutex`, including a poisoned one.
pub(super) fn content<T>(mutex: Mutex<T>) -> T {
    mutex.into_inner().unwrap_or_else(PoisonError::into_inner)
}
