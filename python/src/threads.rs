//! Threads: the pool of the process, and work that Ctrl-C interrupts.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicPtr, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;
use std::{process, ptr, thread};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use slipsweep::table::Signal;

use crate::error::defect;

/// Time between two looks at signals. Chosen: a quarter of the 0.2 s in which Ctrl-C answers.
const LOOK: Duration = Duration::from_millis(50);

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

/// What happens to work that is interrupted.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Interrupted {
    /// It ends by itself, and its result is lost.
    Left,
    /// Its end is awaited.
    Awaited,
}

/// The result of `work`, which runs in the pool or, if it is `Awaited`, on a thread of its own. Python's other threads continue, `look` is called
/// from time to time, and Ctrl-C stops `signal`.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    interrupted: Interrupted,
    stop: impl Fn(),
    mut look: impl FnMut(Python<'_>) -> PyResult<()>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (send, receive) = sync_channel(1);
    let work = move || {
        // A caller that left does not receive the result.
        let _ = send.send(catch_unwind(AssertUnwindSafe(work)));
    };
    match interrupted {
        Interrupted::Left => pool()?.spawn(work),
        Interrupted::Awaited => drop(thread::Builder::new().spawn(work)?),
    }
    let receive = Mutex::new(receive);
    let mut error = None;
    loop {
        let received = py.detach(|| receive.lock().map(|receive| receive.recv_timeout(LOOK)).ok());
        match received.unwrap_or(Err(RecvTimeoutError::Disconnected)) {
            Ok(Ok(result)) => return error.map_or(Ok(result), Err),
            Ok(Err(panic)) => return Err(error.unwrap_or_else(|| defect(panicked(&*panic)))),
            Err(RecvTimeoutError::Disconnected) => return Err(defect("a thread of slipsweep ended early")),
            Err(RecvTimeoutError::Timeout) if error.is_some() => {}
            Err(RecvTimeoutError::Timeout) => {
                if let Err(raised) = py.check_signals().and_then(|()| look(py)) {
                    stop();
                    if interrupted == Interrupted::Left {
                        return Err(raised);
                    }
                    error = Some(raised);
                }
            }
        }
    }
}

/// The message of a panic.
fn panicked(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
    format!("{text}\n  help: this is a bug in slipsweep: please report it")
}

/// The result of `work` in the pool of the process, where nothing interrupts it for long.
pub fn on_pool<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = pool()?;
    Ok(py.detach(|| pool.install(work)))
}

/// A signal and how to stop it.
pub fn stopper(signal: &std::sync::Arc<Signal>) -> impl Fn() + use<> {
    let signal = signal.clone();
    move || signal.stop()
}
