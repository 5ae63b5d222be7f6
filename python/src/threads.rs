//! Threads: the pool of the process, and work that Ctrl-C interrupts.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicPtr, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use std::{process, ptr, thread};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use slipsweep::table::Signal;

use crate::error::defect;

/// Time between two looks at signals. Chosen: a quarter of the 0.2 s in which Ctrl-C answers.
const LOOK: Duration = Duration::from_millis(50);

/// Time that a stopped run has to end, before it is left to end by itself. Chosen: with `LOOK`, half of the 0.2 s in which Ctrl-C answers.
const GRACE: Duration = Duration::from_millis(50);

/// Runs that were left, and their processes.
static LEFT: Mutex<Vec<(u32, JoinHandle<()>)>> = Mutex::new(Vec::new());

/// Where the result of work, or its panic, arrives.
type Arrival<T> = Mutex<Receiver<thread::Result<T>>>;

/// The pool of one process.
struct Pool {
    process: u32,
    threads: ThreadPool,
}

static POOL: AtomicPtr<Pool> = AtomicPtr::new(ptr::null_mut());

/// The pool of this process, with as many threads as there are processors, or as RAYON_NUM_THREADS states.
///
/// Threads do not survive a fork: a child makes a pool of its own, and leaves that of its parent alone, whose locks may be held forever.
#[allow(unsafe_code)]
pub fn pool() -> PyResult<&'static ThreadPool> {
    let known = POOL.load(Ordering::Acquire);
    // A pool is never freed once it is here.
    if let Some(pool) = unsafe { known.as_ref() }
        && pool.process == process::id()
    {
        return Ok(&pool.threads);
    }
    let threads = ThreadPoolBuilder::new().build().map_err(defect)?;
    let pool = Box::into_raw(Box::new(Pool { process: process::id(), threads }));
    match POOL.compare_exchange(known, pool, Ordering::AcqRel, Ordering::Acquire) {
        Ok(_) => Ok(unsafe { &(*pool).threads }),
        Err(other) => {
            // Another thread was faster.
            drop(unsafe { Box::from_raw(pool) });
            Ok(unsafe { &(*other).threads })
        }
    }
}

/// The result of `work`, which runs in the pool. Python's other threads continue; Ctrl-C calls `stop` and leaves the work, whose result is lost.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    stop: impl Fn(),
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (work, receive) = sent(work);
    pool()?.spawn(work);
    awaited(py, &receive, |py| py.check_signals()).inspect_err(|_| stop())
}

/// The result of a run, on a thread of its own that calls `look` from time to time.
///
/// Ctrl-C, or an error of `look`, calls `stop`. A run that does not end within `GRACE` is left: it publishes the parts that it writes, and the next run
/// of this process waits for its end.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    stop: impl Fn(),
    mut look: impl FnMut(Python<'_>) -> PyResult<()>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (work, receive) = sent(|| {
        join_left();
        work()
    });
    let thread = thread::Builder::new().spawn(work)?;
    awaited(py, &receive, |py| py.check_signals().and_then(|()| look(py))).inspect_err(|_| {
        stop();
        let ended = py.detach(|| lock(&receive).recv_timeout(GRACE));
        if matches!(ended, Err(RecvTimeoutError::Timeout)) {
            lock(&LEFT).push((process::id(), thread));
        }
    })
}

/// Waits for the runs of this process that were left. Those of its parent do not exist here.
fn join_left() {
    for (process, thread) in std::mem::take(&mut *lock(&LEFT)) {
        if process == process::id() {
            // Its result is lost, and its panic with it.
            let _ = thread.join();
        } else {
            std::mem::forget(thread);
        }
    }
}

/// Work that sends its result, or its panic, and the place where that arrives.
fn sent<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> (impl FnOnce() + Send + 'static, Arrival<T>) {
    let (send, receive) = sync_channel(1);
    let work = move || {
        // A caller that left does not receive the result.
        let _ = send.send(catch_unwind(AssertUnwindSafe(work)));
    };
    (work, Mutex::new(receive))
}

/// What arrives, with a call of `look` from time to time.
fn awaited<T: Send>(
    py: Python<'_>,
    arrival: &Arrival<T>,
    mut look: impl FnMut(Python<'_>) -> PyResult<()>,
) -> PyResult<T> {
    loop {
        match py.detach(|| lock(arrival).recv_timeout(LOOK)) {
            Ok(Ok(result)) => return Ok(result),
            Ok(Err(panic)) => return Err(defect(panicked(&*panic))),
            Err(RecvTimeoutError::Disconnected) => return Err(defect("a thread of slipsweep ended early")),
            Err(RecvTimeoutError::Timeout) => look(py)?,
        }
    }
}

/// The content of `mutex`, including a poisoned one.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The message of a panic.
fn panicked(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
    format!("{text}\n  help: this is a bug in slipsweep: please report it")
}

/// A signal and how to stop it.
pub fn stopper(signal: &std::sync::Arc<Signal>) -> impl Fn() + use<> {
    let signal = signal.clone();
    move || signal.stop()
}
