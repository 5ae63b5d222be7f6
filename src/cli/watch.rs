//! Progress of long commands, and signals that stop them.

use std::io::{Write, stderr};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::process;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use signal_hook::consts::{SIGINT, SIGTERM};

use super::words;
use crate::table::{Phase, Signal};

/// The polling interval of progress. Chosen: Ctrl-C seems to answer at once.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// The interval of progress lines without a terminal. Chosen: a log of a day has less than 10,000 lines.
const LINE_INTERVAL: Duration = Duration::from_secs(10);

/// Time after which a terminal shows the progress. Chosen: a user should not wait longer than a second without a message.
pub const PROGRESS_DELAY: Duration = Duration::from_secs(1);

/// Runs `work`. Meanwhile it shows the progress through `tables`, the rows of each and their mean cost, unless `quiet`, and passes Ctrl-C and SIGTERM
/// on to `signal`.
///
/// Returns the result of `work`, and the signal received, if any. A second signal ends the process at once, and so does a signal after the end
/// of `work`.
pub fn watched<T>(signal: &Signal, tables: Vec<(u64, u64)>, quiet: bool, work: impl FnOnce() -> T) -> (T, Option<i32>) {
    let mut show = ProgressDisplay::new(tables, quiet);
    let look = |caught: Option<i32>| {
        if caught.is_some() {
            signal.stop();
        }
        show.update(signal);
    };
    let ended = while_looking(look, work);
    show.bar.finish_and_clear();
    ended
}

/// Runs `work`, which writes nothing, and shows what it is `doing` on a terminal after a second. Ctrl-C and SIGTERM end the process with a message
/// that nothing has changed. Waits must not be nested.
pub fn waiting<T>(doing: &str, work: impl FnOnce() -> T) -> T {
    let line = spinner(doing);
    let look = |caught: Option<i32>| {
        if let Some(number) = caught {
            line.finish_and_clear();
            // A message that cannot be written is ignored.
            let _ = writeln!(stderr(), "stopped while {doing}; nothing has changed");
            process::exit(128 + number);
        }
        if line.elapsed() > PROGRESS_DELAY {
            line.tick();
        }
    };
    let (result, _) = while_looking(look, work);
    line.finish_and_clear();
    result
}

/// Runs `work` while another thread calls `look` at intervals, with the signal received, if any. Returns the result of `work`, and that signal.
pub fn while_looking<T>(mut look: impl FnMut(Option<i32>) + Send, work: impl FnOnce() -> T) -> (T, Option<i32>) {
    let signals = signals();
    signals.idle.store(false, Ordering::Release);
    let finished = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let watch = || {
            while !finished.load(Ordering::Acquire) {
                look(signals.caught());
                std::thread::park_timeout(POLL_INTERVAL);
            }
        };
        // Without a second thread, there is no progress.
        let watcher = std::thread::Builder::new().spawn_scoped(scope, watch).ok();
        // The scope waits for the watcher, also if the work panics.
        let result = catch_unwind(AssertUnwindSafe(work));
        signals.idle.store(true, Ordering::Release);
        finished.store(true, Ordering::Release);
        watcher.inspect(|watcher| watcher.thread().unpark());
        (result.unwrap_or_else(|panic| resume_unwind(panic)), signals.caught())
    })
}

/// The signal handlers of the process, installed at the first watched operation.
struct Signals {
    /// The signal received, else 0.
    caught: Arc<AtomicUsize>,
    /// Whether no operation is watched: then a signal ends the process.
    idle: Arc<AtomicBool>,
}

impl Signals {
    fn caught(&self) -> Option<i32> {
        i32::try_from(self.caught.load(Ordering::Relaxed)).ok().filter(|&number| number != 0)
    }
}

fn signals() -> &'static Signals {
    static SIGNALS: OnceLock<Signals> = OnceLock::new();
    SIGNALS.get_or_init(|| {
        let signals = Signals { caught: Arc::default(), idle: Arc::default() };
        for number in [SIGINT, SIGTERM] {
            // A signal without a handler keeps its usual effect.
            let _ = listen(number, &signals);
        }
        signals
    })
}

/// Records the signal `number`, and ends the process if it comes again or while no operation is watched.
fn listen(number: i32, signals: &Signals) -> std::io::Result<()> {
    let again = Arc::new(AtomicBool::new(false));
    // Handlers run in the order in which they are registered: the first time `again` is still false.
    signal_hook::flag::register_conditional_shutdown(number, 128 + number, again.clone())?;
    signal_hook::flag::register_conditional_shutdown(number, 128 + number, signals.idle.clone())?;
    signal_hook::flag::register(number, again)?;
    signal_hook::flag::register_usize(number, signals.caught.clone(), number as usize)?;
    Ok(())
}

/// A line that states what a command is `doing`, on a terminal and once it ticks.
pub fn spinner(doing: &str) -> ProgressBar {
    bar(false, 0, "{msg} ({elapsed})").with_message(doing.to_owned())
}

/// A progress line, which appears only on a terminal and unless `quiet`.
fn bar(quiet: bool, length: u64, template: &str) -> ProgressBar {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(10) };
    ProgressBar::with_draw_target(Some(length), target).with_style(style(template))
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// The progress of a run: a bar on a terminal, else a line at intervals.
struct ProgressDisplay {
    /// The rows of each table, in the order of computation, and their mean cost.
    tables: Vec<(u64, u64)>,
    /// All rows.
    rows: u64,
    quiet: bool,
    /// The cost of the rows so far.
    bar: ProgressBar,
    /// Time of the last line.
    last: Instant,
    /// The current phase.
    phase: Phase,
    /// Start of the phase.
    since: Instant,
}

impl ProgressDisplay {
    fn new(tables: Vec<(u64, u64)>, quiet: bool) -> ProgressDisplay {
        let rows = tables.iter().fold(0_u64, |sum, (rows, _)| sum.saturating_add(*rows));
        let (now, bar) = (Instant::now(), bar(quiet, cost(&tables, rows), "{msg}"));
        ProgressDisplay { tables, rows, quiet, bar, last: now, phase: Phase::Checking, since: now }
    }

    fn update(&mut self, signal: &Signal) {
        let (done, kept, is_new) = (signal.rows(), signal.kept(), signal.phase() != self.phase);
        if is_new {
            (self.phase, self.since) = (signal.phase(), Instant::now());
        }
        let is_computing = self.phase == Phase::Computing;
        if is_new {
            self.bar.set_style(style(if is_computing { "{bar:20} {percent}% of {msg}" } else { "{msg}" }));
        }
        let text = self.text(signal);
        if is_computing || self.since.elapsed() > PROGRESS_DELAY {
            if self.bar.is_hidden() && !self.quiet && self.last.elapsed() >= LINE_INTERVAL {
                self.last = Instant::now();
                let done = if is_computing { format!("{} of ", words::count(kept + done)) } else { String::new() };
                // A progress line that cannot be written is no failure.
                let _ = writeln!(stderr(), "{done}{text}");
            }
            self.bar.set_message(text);
        }
        if is_computing {
            self.bar.set_position(cost(&self.tables, kept + done));
        }
        if is_new && is_computing {
            // Kept rows take no time.
            self.bar.reset_eta();
        }
    }

    fn text(&self, signal: &Signal) -> String {
        let all = words::things(self.rows, "row");
        match self.phase {
            Phase::Checking => format!("checking existing parts: {} of {all}", words::count(signal.kept())),
            Phase::Computing => {
                let seconds = self.since.elapsed().as_secs_f64().max(POLL_INTERVAL.as_secs_f64());
                let rate = words::count((signal.rows() as f64 / seconds) as u64);
                // The first rows do not determine the rest.
                match self.bar.eta().as_secs_f64() {
                    left if left > 0.0 && self.since.elapsed() > PROGRESS_DELAY => {
                        format!("{all}, {rate} per second, about {} left", words::duration(left))
                    }
                    _ => format!("{all}, {rate} per second"),
                }
            }
            Phase::Writing => "writing the last parts".to_owned(),
        }
    }
}

/// The cost of the first `rows` rows of tables with these numbers of rows and mean costs.
fn cost(tables: &[(u64, u64)], mut rows: u64) -> u64 {
    let costs = tables.iter().map(|&(all, cost)| {
        let first = rows.min(all);
        rows -= first;
        first as f64 * cost as f64
    });
    costs.sum::<f64>() as u64
}
