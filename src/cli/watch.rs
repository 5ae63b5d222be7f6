//! Watching a run: progress for whoever looks, and the wish to stop.

use std::fmt;
use std::io::{IsTerminal, Write, stderr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::Thread;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
#[cfg(unix)]
use signal_hook::consts::SIGXFSZ;
use signal_hook::consts::{SIGINT, SIGTERM};

use super::words;
use crate::table::Signal;

/// How often a run is looked at: Ctrl-C and the bar answer within this time.
const LOOK: Duration = Duration::from_millis(50);

/// How often a line is written where there is no terminal.
const LINE: Duration = Duration::from_secs(10);

/// Does `work`, and meanwhile shows progress towards `rows` rows unless `quiet`, and passes Ctrl-C and SIGTERM on to `signal`.
///
/// Returns what `work` returns, and which signal came, if one did. A second one ends the process at once, and so does one that
/// comes when `work` is done.
pub fn watched<T: Send>(signal: &Signal, rows: u64, quiet: bool, work: impl FnOnce() -> T + Send) -> (T, Option<i32>) {
    let caught = Arc::new(AtomicUsize::new(0));
    let finished = Arc::new(AtomicBool::new(false));
    for number in [SIGINT, SIGTERM] {
        // Where a signal cannot be listened to, it keeps its usual effect.
        let _ = listen(number, &caught, &finished);
    }
    // A file that grows beyond the limit of its user is then a write that fails, not the end of the process.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
    let result = std::thread::scope(|scope| {
        let watch = || {
            let mut show = Show::new(rows, quiet);
            while !finished.load(Ordering::Acquire) {
                if caught.load(Ordering::Relaxed) != 0 {
                    signal.stop();
                }
                show.update(signal.rows());
                std::thread::park_timeout(LOOK);
            }
            show.end();
        };
        // Where no thread can be had, nobody watches.
        let watcher = std::thread::Builder::new().spawn_scoped(scope, watch).ok();
        // Also if the work panics: the scope waits for the watcher.
        let _end = End { finished: &finished, watcher: watcher.as_ref().map(|watcher| watcher.thread()) };
        work()
    });
    let number = caught.load(Ordering::Relaxed);
    (result, i32::try_from(number).ok().filter(|&number| number != 0))
}

/// Tells the watcher, when it goes, that there is nothing to watch any more.
struct End<'a> {
    finished: &'a AtomicBool,
    watcher: Option<&'a Thread>,
}

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.finished.store(true, Ordering::Release);
        self.watcher.inspect(|watcher| watcher.unpark());
    }
}

/// Notes `number` in `caught` when it comes, and ends the process when it comes again or once all is `finished`.
fn listen(number: i32, caught: &Arc<AtomicUsize>, finished: &Arc<AtomicBool>) -> std::io::Result<()> {
    let again = Arc::new(AtomicBool::new(false));
    // Handlers run in the order in which they are registered: the first time `again` is still false.
    signal_hook::flag::register_conditional_shutdown(number, 128 + number, again.clone())?;
    signal_hook::flag::register_conditional_shutdown(number, 128 + number, finished.clone())?;
    signal_hook::flag::register(number, again)?;
    signal_hook::flag::register_usize(number, caught.clone(), number as usize)?;
    Ok(())
}

/// The ways to show progress.
enum Show {
    Nothing,
    Bar(ProgressBar),
    Lines { rows: u64, start: Instant, last: Instant },
}

impl Show {
    fn new(rows: u64, quiet: bool) -> Show {
        if quiet {
            return Show::Nothing;
        }
        if !stderr().is_terminal() {
            return Show::Lines { rows, start: Instant::now(), last: Instant::now() };
        }
        let bar = ProgressBar::with_draw_target(Some(rows), ProgressDrawTarget::stderr_with_hz(10));
        let template = "{bar:20} {percent}% of {human_len} rows, {rate} a second, {left} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            let rate = |state: &ProgressState, out: &mut dyn fmt::Write| {
                let _ = out.write_str(&words::count(state.per_sec() as u64));
            };
            let left = |state: &ProgressState, out: &mut dyn fmt::Write| {
                let known = state.pos() > 0;
                let left = if known { words::duration(state.eta().as_secs_f64()) } else { "?".to_owned() };
                let _ = out.write_str(&left);
            };
            bar.set_style(style.with_key("rate", rate).with_key("left", left));
        }
        Show::Bar(bar)
    }

    fn update(&mut self, done: u64) {
        match self {
            Show::Nothing => {}
            Show::Bar(bar) => bar.set_position(done),
            Show::Lines { rows, start, last } if last.elapsed() >= LINE => {
                *last = Instant::now();
                let rate = done as f64 / start.elapsed().as_secs_f64();
                let left =
                    if done == 0 { "?".to_owned() } else { words::duration(rows.saturating_sub(done) as f64 / rate) };
                let (done, rows) = (words::count(done), words::count(*rows));
                // Progress that cannot be told is not worth a failure.
                let _ =
                    writeln!(stderr(), "{done} of {rows} rows, {} a second, {left} left", words::count(rate as u64));
            }
            Show::Lines { .. } => {}
        }
    }

    fn end(self) {
        if let Show::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
