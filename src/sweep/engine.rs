//! The engine: computes the parts that are missing, one after another and each on all threads, and writes them meanwhile.
//!
//! Encoding and writing a part are tasks of the same threads, so they overlap the computation of the next part. Nothing of what is written
//! depends on how the work was spread.

use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::check::Sweep;
use super::plan::{Plan, footer};
use crate::dataset::{DatasetError, Folder, Layout, encode};
use crate::table::{Optima, Sheet, Signal, Stopped, Work};

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
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| RunError::Threads { threads, source })?;
    let optima = Optima::new(plan.optima, sweep.bounded, sweep.optimum_rtol());
    let mut outcome = Outcome { tables: Vec::new(), work: Work::default() };
    for (request, table) in sweep.requests.iter().zip(&plan.tables) {
        let Some(job) = sweep.job(request, &optima, signal) else { continue };
        let layout = Layout::new(request.table, &request.selection, &sweep.grid);
        let mut done = TableOutcome::default();
        let failure = Mutex::new(None);
        pool.in_place_scope(|scope| {
            // At most as many parts as threads wait to be written: that bounds the memory, and no thread waits for the disk alone.
            let (take, give_back) = sync_channel(pool.current_num_threads());
            let give_back = Arc::new(Mutex::new(give_back));
            for part in 0..table.parts {
                if folder.has_part(&table.name, part) {
                    done.kept += 1;
                    signal.advance(table.rows_of(part).end - table.rows_of(part).start);
                    continue;
                }
                signal.check()?;
                if locked(&failure).is_some() {
                    break;
                }
                let rows = table.rows_of(part);
                let count = rows.end - rows.start;
                let mut sheet = Sheet::new(count as usize, request.selection.indices().len());
                outcome.work += pool.install(|| request.table.compute(&job, rows.clone(), &mut sheet))?;
                done.made += 1;
                done.rows += count;
                // Blocks while too many parts wait; a task that ends makes room. Neither end of the channel is gone before that.
                let _ = take.send(());
                let (give_back, layout, job, failure) = (give_back.clone(), &layout, &job, &failure);
                let footer = footer(&manifest, &table.name, rows);
                scope.spawn(move |_| {
                    let written = encode(layout, &job.rows, &sheet, &footer)
                        .map_err(|source| DatasetError::encode(folder, &table.name, part, source))
                        .and_then(|bytes| folder.write_part(&table.name, part, &bytes));
                    if let Err(error) = written {
                        locked(failure).get_or_insert(error);
                    }
                    let _ = locked(&give_back).recv();
                });
            }
            Ok::<(), Stopped>(())
        })?;
        if let Some(error) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error.into());
        }
        outcome.tables.push(done);
    }
    Ok(outcome)
}

/// The content of `mutex`, also if a thread died while it held it.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
