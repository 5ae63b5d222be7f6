//! The engine: computes the parts that are missing, encodes and writes them.
//!
//! A part is computed by all threads that have nothing else to do, encoded by one of them, and written by a thread of its own while the
//! next parts are computed. Nothing of what is written depends on how the work was spread.

use std::sync::mpsc::{channel, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::check::Sweep;
use super::plan::{Plan, footer};
use crate::dataset::{DatasetError, Folder, Layout, ManifestTable, encode};
use crate::table::{Job, Optima, Sheet, Signal, Stopped, Table, Work};

/// What a run did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// What it did for each table, in the order of the spec.
    pub tables: Vec<TableOutcome>,
    /// All work that was spent.
    pub work: Work,
}

/// What a run did for one table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableOutcome {
    /// Parts that were there already.
    pub kept: u64,
    /// Parts that were made.
    pub made: u64,
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
    /// It was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// Runs `sweep` on `threads` threads (0: one a processor) into `folder`; parts that are there already are kept.
pub fn run(sweep: &Sweep, folder: &Folder, threads: usize, signal: &Signal) -> Result<Outcome, RunError> {
    let plan = Plan::new(sweep);
    let manifest = plan.manifest(sweep);
    folder.open(&manifest)?;
    let pool = pool(threads)?;
    let optima = Optima::new(plan.optima, sweep.bounded, sweep.optimum_rtol());
    let mut outcome = Outcome { tables: Vec::new(), work: Work::default() };
    let failure = Failure::default();
    thread::scope(|scope| {
        // The disk has a thread of its own, so that no thread that computes waits for it.
        let (to_disk, parts) = sync_channel::<Part<'_>>(1);
        scope.spawn(|| {
            for part in parts {
                // Who asks to stop does not want to wait for the parts that are queued here.
                failure.keep(match signal.check() {
                    Ok(()) => folder.write_part(part.table, part.number, &part.bytes).map_err(RunError::from),
                    Err(stopped) => Err(stopped.into()),
                });
            }
        });
        for (request, table) in sweep.requests.iter().zip(&plan.tables) {
            let Some(job) = sweep.job(request, &optima, signal) else { continue };
            let layout = Layout::new(request.table, &request.selection, &sweep.grid);
            let mut done = TableOutcome::default();
            let missing = (0..table.parts).filter(|&number| {
                let rows = table.rows_of(number);
                let count = rows.end - rows.start;
                if folder.has_part(&table.name, number) {
                    done.kept += 1;
                    signal.advance(count);
                    return false;
                }
                done.made += 1;
                done.rows += count;
                true
            });
            let wanted = missing.take_while(|_| !failure.is_there());
            outcome.work += compute(&pool, request.table, &job, table, wanted, |number, sheet| {
                let footer = footer(&manifest, &table.name, table.rows_of(number));
                match encode(&layout, &job.rows, sheet, &footer) {
                    // The other end is there until every sender is gone.
                    Ok(bytes) => drop(to_disk.send(Part { table: &table.name, number, bytes })),
                    Err(source) => failure.keep(Err(DatasetError::encode(folder, &table.name, number, source).into())),
                }
            })?;
            outcome.tables.push(done);
        }
        Ok::<(), Stopped>(())
    })?;
    failure.into_result()?;
    Ok(outcome)
}

/// The threads of a run.
pub fn pool(threads: usize) -> Result<ThreadPool, RunError> {
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|source| RunError::Threads { threads, source })
}

/// Computes the parts `numbers` of a table and hands the number and the sheet of each to `take`, in no particular order.
///
/// One part more than there are threads is under way at a time, so that no thread waits for the end of a part.
pub fn compute(
    pool: &ThreadPool,
    table: &dyn Table,
    job: &Job<'_>,
    parts: &ManifestTable,
    numbers: impl Iterator<Item = u64>,
    take: impl Fn(u64, &Sheet) + Sync,
) -> Result<Work, Stopped> {
    let (give_back, free) = channel();
    for _ in 0..=pool.current_num_threads() {
        let _ = give_back.send(Sheet::new(job.selection.indices().len()));
    }
    let result = Mutex::new(Ok(Work::default()));
    pool.in_place_scope(|scope| {
        for number in numbers {
            // Never fails: every task gives its sheet back.
            let Ok(mut sheet) = free.recv() else { break };
            if locked(&result).is_err() {
                break;
            }
            let (give_back, result, take) = (give_back.clone(), &result, &take);
            scope.spawn(move |_| {
                let rows = parts.rows_of(number);
                sheet.resize((rows.end - rows.start) as usize);
                let computed = table.compute(job, rows, &mut sheet).and_then(|work| job.signal.check().map(|()| work));
                if computed.is_ok() {
                    take(number, &sheet);
                }
                let mut result = locked(result);
                *result = result.and_then(|work| computed.map(|more| [work, more].into_iter().sum()));
                let _ = give_back.send(sheet);
            });
        }
    });
    result.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// A part on its way to the disk.
struct Part<'a> {
    table: &'a str,
    number: u64,
    bytes: Vec<u8>,
}

/// The first failure of any thread.
#[derive(Default)]
struct Failure(Mutex<Option<RunError>>);

impl Failure {
    fn keep(&self, result: Result<(), RunError>) {
        if let Err(error) = result {
            locked(&self.0).get_or_insert(error);
        }
    }

    fn is_there(&self) -> bool {
        locked(&self.0).is_some()
    }

    fn into_result(self) -> Result<(), RunError> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
    }
}

/// The content of `mutex`, also if a thread died while it held it.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
