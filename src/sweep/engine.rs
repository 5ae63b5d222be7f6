//! The engine: computes the parts that are missing or damaged, encodes and writes them.
//!
//! A part is computed by all threads that have nothing else to do, and written by threads of their own while the next parts are computed. Those
//! also encode a part if they have not enough to do; else one of those that compute does. Nothing of what is written depends on how the work was
//! spread.

use std::fmt;
use std::ops::{Deref, Range};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, Scope};

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::check::Sweep;
use super::plan::Plan;
use super::shard::{Shard, TooManyParts, holds};
use crate::dataset::{
    Company, DatasetError, Folder, Footer, Layout, Look, ManifestTable, Session, State, TableStatistics, encode,
};
use crate::grid::Quantity;
use crate::table::{ColumnBuffer, Job, Phase, RunStats, Signal, Stopped, Table};

/// What a run did.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// What it did for each table, in the order of the spec.
    pub tables: Vec<TableOutcome>,
    /// What the parts of each table contain, those that were kept and those that were made.
    pub digests: Vec<TableStatistics>,
    /// All work that was spent.
    pub work: RunStats,
}

/// What a run did for one table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableOutcome {
    /// Parts that were there already.
    pub kept: u64,
    /// Parts that were made.
    pub made: u64,
    /// Those of them that were there, but damaged.
    pub damaged: u64,
    /// Rows that were computed.
    pub rows: u64,
}

/// Why a run did not finish.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The dataset cannot be written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The threads cannot be started.
    #[error("cannot start {threads} threads: {source}\n  help: use fewer with --threads N")]
    Threads {
        /// How many.
        threads: usize,
        /// Why not.
        source: rayon::ThreadPoolBuildError,
    },
    /// The thread that writes cannot be started.
    #[error("cannot start the thread that writes: {0}\n  help: allow the process more memory or more threads")]
    Writer(std::io::Error),
    /// It cannot be shared out.
    #[error(transparent)]
    Parts(#[from] TooManyParts),
    /// A row made the program panic; all other parts are finished.
    #[error("{defect}\n  help: this is a defect of slipsweep, please report it; {}", match others {
        0 => "all other parts are finished".to_owned(),
        _ => format!("{others} more parts have such a row, all others are finished"),
    })]
    Defect {
        /// The first of them.
        defect: Defect,
        /// How many parts more have such a row.
        others: usize,
    },
    /// It was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// A row that made the program panic, which no row should.
#[derive(Debug, Clone, PartialEq)]
pub struct Defect {
    /// The table.
    pub table: String,
    /// The row, by global number; several if no single one panics when it is computed on its own.
    pub rows: Range<u64>,
    /// The axes of the table at the first of them.
    pub axes: Vec<(&'static str, f64)>,
    /// What the program said.
    pub message: String,
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Defect { table, rows, axes, message } = self;
        match rows.end - rows.start {
            1 => write!(f, "{table}: row {} panicked: {message}\n  at ", rows.start)?,
            _ => write!(f, "{table}: rows {} to {} panicked: {message}\n  beginning at ", rows.start, rows.end)?,
        }
        let axes: Vec<String> = axes.iter().map(|(name, value)| format!("{name} = {value:?}")).collect();
        f.write_str(&axes.join(", "))
    }
}

/// Runs `sweep` on `threads` threads (0: one a processor) into `folder`; parts that are there already are kept. No other run may be at work
/// there.
pub fn run(sweep: &Sweep, folder: &Folder, threads: usize, signal: &Signal) -> Result<Outcome, RunError> {
    run_in(sweep, folder, (Shard::WHOLE, Company::Alone), threads, signal)
}

/// The same for the parts of one shard alone. Any number of processes may do that at the same time, with the same shard too.
///
/// Every bit of a part that is there is checked: one that is damaged is made again, one of another sweep is left alone and ends the run.
pub fn run_shard(
    sweep: &Sweep,
    folder: &Folder,
    shard: Shard,
    threads: usize,
    signal: &Signal,
) -> Result<Outcome, RunError> {
    run_in(sweep, folder, (shard, Company::Shards), threads, signal)
}

fn run_in(
    sweep: &Sweep,
    folder: &Folder,
    (shard, company): (Shard, Company),
    threads: usize,
    signal: &Signal,
) -> Result<Outcome, RunError> {
    // Plan: the parts of each table that are ours, and the dataset that takes them.
    let plan = Plan::new(sweep);
    let shares = shard.parts(sweep, &plan)?;
    let session = folder.open(&plan.manifest(sweep), company).map_err(|error| sweep.explain(error))?;
    let pool = pool(threads)?;
    let optimum_cache = sweep.optimum_cache();
    let run = Run {
        folder,
        session: &session,
        pool: &pool,
        signal,
        queued: AtomicUsize::new(0),
        failures: Failures::default(),
    };
    let stages: Vec<Stage<'_>> = (sweep.requests.iter().zip(&plan.tables))
        .zip(&optimum_cache)
        .map(|((request, table), optimum_cache)| Stage {
            run: &run,
            definition: request.table,
            table,
            job: sweep.job(request, optimum_cache, signal),
            layout: Layout::new(request.table, &request.projection, &sweep.grid),
            statistics: Mutex::default(),
        })
        .collect();

    // Parts that are there and sound are kept.
    signal.enter(Phase::Checking);
    let sound = stages.iter().zip(&shares).map(|(stage, share)| stage.check(share));
    let sound = sound.collect::<Result<Vec<_>, RunError>>()?;

    // The others are solved by the pool, encoded, and published by the writers.
    signal.enter(Phase::Computing);
    let mut outcome = Outcome { tables: Vec::new(), digests: Vec::new(), work: RunStats::default() };
    thread::scope(|scope| {
        let (to_disk, parts) = sync_channel(1);
        run.start_writers(scope, parts)?;
        for ((stage, share), sound) in stages.iter().zip(&shares).zip(&sound) {
            let (done, work) = stage.solve(share, sound, &to_disk)?;
            outcome.tables.push(done);
            outcome.work += work;
        }
        signal.enter(Phase::Writing);
        Ok::<(), RunError>(())
    })?;
    outcome.digests = stages.into_iter().map(|stage| content(stage.statistics)).collect();
    run.failures.into_result(&plan, || session.check())?;
    Ok(outcome)
}

/// The threads of a run.
pub fn pool(threads: usize) -> Result<ThreadPool, RunError> {
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|source| {
        let each_processor = || thread::available_parallelism().map_or(1, |threads| threads.get());
        RunError::Threads { threads: if threads == 0 { each_processor() } else { threads }, source }
    })
}

/// Bytes of the sheets that are being filled at most, unless there are fewer than two. Chosen: a part takes a few MiB, so it limits machines of many
/// threads alone.
const MAX_SHEET_BYTES: u64 = 1 << 27;

/// Threads that encode and write. Chosen: while one waits for the disk to sync its part, another one has the processor.
pub(super) const WRITERS: usize = 2;

/// Parts that those threads may have before them, the ones that they are at included: with fewer they would wait for the next.
const AHEAD: usize = WRITERS + 1;

/// Computes the parts `numbers` of a table and hands the number and the sheet of each to `take`, in no particular order; of a part with a
/// row that panics, the row.
///
/// One part more than there are threads is under way at a time, so that no thread waits for the end of a part, and three may be kept by
/// whoever takes them; fewer where parts are large and threads many, since the threads share the rows of a part.
pub fn compute(
    pool: &ThreadPool,
    table: &dyn Table,
    job: &Job<'_>,
    parts: &ManifestTable,
    numbers: impl Iterator<Item = u64>,
    take: impl Fn(u64, Result<Filled, Defect>) + Sync,
) -> Result<RunStats, Stopped> {
    let (give_back, free) = channel();
    let columns = job.projection.indices().len();
    let size = parts.rows_per_part.min(parts.rows).saturating_mul(8 * columns as u64 + 1);
    let buffers = (pool.current_num_threads() as u64 + 1 + AHEAD as u64).min((MAX_SHEET_BYTES / size.max(1)).max(2));
    for _ in 0..buffers {
        let _ = give_back.send(ColumnBuffer::new(columns));
    }
    let result = Mutex::new(Ok(RunStats::default()));
    pool.in_place_scope(|scope| {
        for number in numbers {
            // Never fails: every sheet is given back.
            let Ok(buffer) = free.recv() else { break };
            if locked(&result).is_err() {
                break;
            }
            let (mut filled, result, take) = (Filled { buffer, give_back: give_back.clone() }, &result, &take);
            scope.spawn(move |_| {
                let rows = parts.rows_of(number);
                let computed = match attempt(table, job, rows.clone(), &mut filled.buffer) {
                    Ok(computed) => computed.and_then(|work| job.signal.check().map(|()| work)).inspect(|_| {
                        take(number, Ok(filled));
                    }),
                    Err(message) => {
                        take(number, Err(culprit(table, job, rows, message)));
                        Ok(RunStats::default())
                    }
                };
                let mut result = locked(result);
                *result = result.and_then(|work| computed.map(|more| [work, more].into_iter().sum()));
            });
        }
    });
    content(result)
}

/// Computes `rows` into `buffer`; the message if that panics.
fn attempt(
    table: &dyn Table,
    job: &Job<'_>,
    rows: Range<u64>,
    buffer: &mut ColumnBuffer,
) -> Result<Result<RunStats, Stopped>, String> {
    buffer.resize((rows.end - rows.start) as usize);
    // What a panic leaves half done is the sheet, which is filled anew, and solves that were not stored.
    catch_unwind(AssertUnwindSafe(|| table.compute(job, rows, buffer))).map_err(|payload| {
        let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
        text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned())
    })
}

/// The row among `rows`, which panicked with `message`, that is to blame: found by halves, since any rows can be computed on their own.
fn culprit(table: &dyn Table, job: &Job<'_>, mut rows: Range<u64>, mut message: String) -> Defect {
    let mut buffer = ColumnBuffer::new(job.projection.indices().len());
    while rows.end - rows.start > 1 {
        let middle = rows.start + (rows.end - rows.start) / 2;
        let halves = [rows.start..middle, middle..rows.end];
        let panics = halves.into_iter().find_map(|half| {
            let said = attempt(table, job, half.clone(), &mut buffer).err()?;
            Some((half, said))
        });
        let Some((half, said)) = panics else { break };
        (rows, message) = (half, said);
    }
    let point = job.rows.point(rows.start);
    let axes = Quantity::ALL.into_iter().filter(|axis| table.axes().contains(axis));
    let axes = axes.map(|axis| (axis.name(), point[axis])).collect();
    Defect { table: table.name().to_owned(), rows, axes, message }
}

/// What the stages of a run have in common.
struct Run<'a> {
    folder: &'a Folder,
    session: &'a Session,
    pool: &'a ThreadPool,
    signal: &'a Signal,
    /// Parts that the disk has not finished.
    queued: AtomicUsize,
    failures: Failures,
}

impl Run<'_> {
    /// Starts the threads that publish parts. The disk has threads of its own, so that no thread that computes waits for it.
    fn start_writers<'scope, 'a: 'scope>(
        &'scope self,
        scope: &'scope Scope<'scope, '_>,
        parts: Receiver<Part<'a>>,
    ) -> Result<(), RunError> {
        let parts = Arc::new(Mutex::new(parts));
        let next = move || locked(&parts).recv();
        let write = move || {
            while let Ok(part) = next() {
                self.failures.keep(part.publish());
                self.queued.fetch_sub(1, Ordering::Relaxed);
            }
        };
        for write in std::iter::repeat_n(write, WRITERS) {
            thread::Builder::new().spawn_scoped(scope, write).map_err(RunError::Writer)?;
        }
        Ok(())
    }
}

/// One table of a run.
struct Stage<'a> {
    run: &'a Run<'a>,
    definition: &'a dyn Table,
    table: &'a ManifestTable,
    job: Job<'a>,
    layout: Layout,
    /// What the parts contain that are kept or made by now.
    statistics: Mutex<TableStatistics>,
}

impl<'a> Stage<'a> {
    /// The numbers of the sound parts of `share` that are there, ascending; every bit of them is checked, on all threads of the run.
    fn check(&self, share: &[Range<u64>]) -> Result<Vec<u64>, RunError> {
        let mut there = self.run.folder.parts_there(self.table);
        there.retain(|number| holds(share, *number));
        let sound = |number: u64| {
            self.run.signal.check()?;
            Ok((self.look(number)? == Found::Sound).then_some(number))
        };
        let sound = || there.into_par_iter().with_max_len(1).map(sound).collect::<Result<Vec<_>, RunError>>();
        Ok(self.run.pool.install(sound)?.into_iter().flatten().collect())
    }

    /// Computes the parts of `share` but for the `sound` ones, and hands them to the disk.
    fn solve(
        &'a self,
        share: &[Range<u64>],
        sound: &[u64],
        to_disk: &SyncSender<Part<'a>>,
    ) -> Result<(TableOutcome, RunStats), RunError> {
        let Run { pool, signal, failures, .. } = self.run;
        let mut done = TableOutcome { kept: sound.len() as u64, ..TableOutcome::default() };
        let missing = share.iter().cloned().flatten().filter(|number| sound.binary_search(number).is_err());
        let missing = missing.filter(|&number| self.is_missing(number, &mut done));
        let wanted = missing.take_while(|_| failures.is_empty() && signal.check().is_ok());
        let take = |number, buffer: Result<Filled, Defect>| match buffer {
            Ok(buffer) => self.hand_over(number, buffer, to_disk),
            Err(defect) => locked(&failures.defects).push(defect),
        };
        let work = compute(pool, self.definition, &self.job, self.table, wanted, take)?;
        signal.check()?;
        Ok((done, work))
    }

    /// Whether a part is to be computed: another run may have made it by now.
    fn is_missing(&self, number: u64, done: &mut TableOutcome) -> bool {
        match self.look(number) {
            Ok(Found::Sound) => {
                done.kept += 1;
                return false;
            }
            Ok(Found::Nothing) => {}
            Ok(Found::Damaged) => done.damaged += 1,
            Err(error) => {
                self.run.failures.keep(Err(error));
                return false;
            }
        }
        let rows = self.table.rows_of(number);
        done.made += 1;
        done.rows += rows.end - rows.start;
        true
    }

    /// Gives a part to the threads that publish, encoded if they have enough to do.
    fn hand_over(&'a self, number: u64, buffer: Filled, to_disk: &SyncSender<Part<'a>>) {
        let Run { queued, failures, .. } = self.run;
        let take = |parts: usize| (parts < AHEAD).then_some(parts + 1);
        let content = if queued.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).is_ok() {
            Content::ColumnBuffer(buffer)
        } else {
            match self.encode(number, &buffer) {
                Ok(bytes) => {
                    queued.fetch_add(1, Ordering::Relaxed);
                    Content::Bytes(bytes)
                }
                Err(error) => return failures.keep(Err(error)),
            }
        };
        // The other end is there until every sender is gone.
        let _ = to_disk.send(Part { stage: self, number, content });
    }

    /// What is in the place of a part; a sound one is counted.
    fn look(&self, number: u64) -> Result<Found, RunError> {
        let Run { folder, session, signal, .. } = self.run;
        match folder.state(&session.manifest, &self.table.name, number, Look::Whole) {
            State::There { statistics } => {
                let rows = self.table.rows_of(number);
                signal.keep(rows.end - rows.start);
                self.count(*statistics);
                Ok(Found::Sound)
            }
            State::Missing => Ok(Found::Nothing),
            State::Damaged { .. } => Ok(Found::Damaged),
            State::Foreign { what, expected, found } => {
                let path = folder.part(&self.table.name, number).display().to_string();
                Err(DatasetError::ForeignPart { path, what, expected, found }.into())
            }
        }
    }

    /// Adds what a part contains.
    fn count(&self, part: TableStatistics) {
        let mut statistics = locked(&self.statistics);
        *statistics = std::mem::take(&mut *statistics).merge(part);
    }

    /// The bytes of a part, which is counted.
    fn encode(&self, number: u64, buffer: &ColumnBuffer) -> Result<Vec<u8>, RunError> {
        let (Run { folder, session, .. }, name) = (self.run, &self.table.name);
        let footer = Footer::new(&session.manifest, name, self.table.rows_of(number));
        let (bytes, statistics) = encode(&self.layout, self.job.rows, buffer, &footer)
            .map_err(|source| DatasetError::encode(folder, name, number, source))?;
        self.count(statistics);
        Ok(bytes)
    }
}

/// What is in the place of a part.
#[derive(PartialEq)]
enum Found {
    /// The part, every bit of it.
    Sound,
    Damaged,
    Nothing,
}

/// A part on its way to the disk.
struct Part<'a> {
    stage: &'a Stage<'a>,
    number: u64,
    content: Content,
}

impl Part<'_> {
    /// Writes the part, encoded before if it is not yet.
    fn publish(self) -> Result<(), RunError> {
        let Part { stage, number, content } = self;
        // Who asks to stop does not want to wait for the parts that are queued here.
        stage.run.signal.check()?;
        let bytes = match content {
            Content::Bytes(bytes) => bytes,
            Content::ColumnBuffer(buffer) => stage.encode(number, &buffer)?,
        };
        Ok(stage.run.session.write_part(&stage.table.name, number, &bytes)?)
    }
}

/// What is there of a part.
enum Content {
    ColumnBuffer(Filled),
    Bytes(Vec<u8>),
}

/// The cells of a part. They go back to where the next part is computed once they are dropped.
pub struct Filled {
    buffer: ColumnBuffer,
    give_back: Sender<ColumnBuffer>,
}

impl Deref for Filled {
    type Target = ColumnBuffer;

    fn deref(&self) -> &ColumnBuffer {
        &self.buffer
    }
}

impl Drop for Filled {
    fn drop(&mut self) {
        // Nobody waits for it once all parts are computed.
        let _ = self.give_back.send(std::mem::replace(&mut self.buffer, ColumnBuffer::new(0)));
    }
}

/// The first failure of any thread, and all rows that panic.
#[derive(Default)]
struct Failures {
    first: Mutex<Option<RunError>>,
    defects: Mutex<Vec<Defect>>,
}

impl Failures {
    fn keep(&self, result: Result<(), RunError>) {
        if let Err(error) = result {
            locked(&self.first).get_or_insert(error);
        }
    }

    fn is_empty(&self) -> bool {
        locked(&self.first).is_none()
    }

    /// The failure of a run: the first one, else that of `check`, else that of the first defect.
    fn into_result(self, plan: &Plan, check: impl FnOnce() -> Result<(), DatasetError>) -> Result<(), RunError> {
        content(self.first).map_or(Ok(()), Err)?;
        check()?;
        let mut defects = content(self.defects);
        // Threads find them in no particular order.
        let table = |defect: &Defect| plan.tables.iter().position(|table| table.name == defect.table);
        defects.sort_by_key(|defect| (table(defect), defect.rows.start));
        let others = defects.len().saturating_sub(1);
        defects.into_iter().next().map_or(Ok(()), |defect| Err(RunError::Defect { defect, others }))
    }
}

/// The content of `mutex`, also if a thread died while it held it.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The same once no thread needs it.
fn content<T>(mutex: Mutex<T>) -> T {
    mutex.into_inner().unwrap_or_else(PoisonError::into_inner)
}
