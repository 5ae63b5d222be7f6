//! Progress of long commands, and signals that stop them.

use std::io::{IsTerminal, Write, stderr};
use std::process;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::Thread;
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
const PROGRESS_DELAY: Duration = Duration::from_secs(1);

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
    let result = while_looking(look, work);
    show.bar.iter().for_each(ProgressBar::finish_and_clear);
    (result, signals().caught())
}

/// Runs `work`, which writes nothing, and shows what it is `doing` on a terminal after a second. Ctrl-C and SIGTERM end the process with a message
/// that nothing has changed. Waits must not be nested.
pub fn waiting<T>(doing: &str, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let mut line: Option<ProgressBar> = None;
    let look = |caught: Option<i32>| {
        if let Some(number) = caught {
            line.iter().for_each(ProgressBar::finish_and_clear);
            // A message that cannot be written is ignored.
            let _ = writeln!(stderr(), "stopped while {doing}; nothing has changed");
            process::exit(128 + number);
        }
        if start.elapsed() > PROGRESS_DELAY && stderr().is_terminal() {
            let seconds = words::duration(start.elapsed().as_secs_f64().floor());
            line.get_or_insert_with(text_line).set_message(format!("{doing} ({seconds})"));
        }
    };
    let result = while_looking(look, work);
    line.iter().for_each(ProgressBar::finish_and_clear);
    result
}

/// Runs `work` while another thread calls `look` at intervals, with the signal received, if any.
fn while_looking<T>(mut look: impl FnMut(Option<i32>) + Send, work: impl FnOnce() -> T) -> T {
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
        // Ends the watcher also if the work panics, since the scope waits for it.
        let _end = End { finished: &finished, signals, watcher: watcher.as_ref().map(|watcher| watcher.thread()) };
        work()
    })
}

/// Ends the progress display on drop.
struct End<'a> {
    finished: &'a AtomicBool,
    signals: &'a Signals,
    watcher: Option<&'a Thread>,
}

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.signals.idle.store(true, Ordering::Release);
        self.finished.store(true, Ordering::Release);
        self.watcher.inspect(|watcher| watcher.unpark());
    }
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

/// A progress line on a terminal: a message.
fn text_line() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr_with_hz(10));
    set_style(&bar, false);
    bar
}

/// Shows a message, after a bar if `has_bar`.
fn set_style(bar: &ProgressBar, has_bar: bool) {
    let template = if has_bar { "{bar:20} {percent}% of {human_len} rows, {msg}" } else { "{msg}" };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
}

/// The progress of a run: a bar on a terminal, else a line at intervals.
struct ProgressDisplay {
    /// The rows of each table, in the order of computation, and their mean cost.
    tables: Vec<(u64, u64)>,
    /// All rows.
    rows: u64,
    quiet: bool,
    bar: Option<ProgressBar>,
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
        let bar = (!quiet && stderr().is_terminal()).then(text_line);
        let now = Instant::now();
        ProgressDisplay { tables, rows, quiet, bar, last: now, phase: Phase::Checking, since: now }
    }

    fn update(&mut self, signal: &Signal) {
        let is_new = signal.phase() != self.phase;
        if is_new {
            (self.phase, self.since) = (signal.phase(), Instant::now());
        }
        let done = signal.rows() + signal.kept();
        let is_computing = self.phase == Phase::Computing;
        match &self.bar {
            Some(bar) if is_computing => {
                if is_new {
                    bar.set_length(self.rows);
                    set_style(bar, true);
                }
                bar.set_position(done);
                bar.set_message(self.text(signal));
            }
            Some(bar) if self.since.elapsed() > PROGRESS_DELAY => {
                set_style(bar, false);
                bar.set_message(self.text(signal));
            }
            None if !self.quiet && self.last.elapsed() >= LINE_INTERVAL => {
                self.last = Instant::now();
                let rows = format!("{} of {} rows, ", words::count(done), words::count(self.rows));
                // A progress line that cannot be written is no failure.
                let _ = writeln!(stderr(), "{}{}", if is_computing { &rows } else { "" }, self.text(signal));
            }
            _ => {}
        }
    }

    /// The cost of the first `rows` rows.
    fn cost(&self, mut rows: u64) -> f64 {
        let costs = self.tables.iter().map(|&(all, cost)| {
            let first = rows.min(all);
            rows -= first;
            first as f64 * cost as f64
        });
        costs.sum()
    }

    fn text(&self, signal: &Signal) -> String {
        let (done, kept) = (signal.rows(), signal.kept());
        match self.phase {
            Phase::Checking => {
                let (kept, all) = (words::count(kept), words::things(self.rows, "row"));
                format!("checking existing parts: {kept} of {all}")
            }
            Phase::Computing => {
                let seconds = self.since.elapsed().as_secs_f64().max(POLL_INTERVAL.as_secs_f64());
                let mut text = format!("{} per second", words::count((done as f64 / seconds) as u64));
                let [before, now, all] = [kept, kept + done, self.rows].map(|rows| self.cost(rows));
                // The first rows do not determine the rest.
                if now > before && self.since.elapsed() > PROGRESS_DELAY {
                    let left = seconds * (all - now) / (now - before);
                    text.push_str(&format!(", about {} left", words::duration(left)));
                }
                text
            }
            Phase::Writing => "writing the last parts".to_owned(),
        }
    }
}
