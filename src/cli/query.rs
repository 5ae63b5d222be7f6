//! `slipsweep query DATASET "SELECT …"`: a query in SQL, with the answer as a table, CSV, JSON lines or Parquet.
//!
//! A separate process answers each query. So a query that is too large (a product of tables that exceeds the memory, an expression too deep for
//! the stack) ends with one message and leaves no file behind.

use std::env;
use std::fs;
use std::io::{self, BufWriter, IsTerminal, Read, Write};
use std::mem;
use std::panic;
use std::path::{Path, PathBuf};
use std::process::{ChildStdout, Command, ExitStatus, Stdio};
use std::thread;
use std::time::SystemTime;

use clap::ValueEnum;
use indicatif::ProgressBar;

use super::output::Output;
use super::watch;
use super::{
    Failure, cannot_write, keep_datasets, kind, note, note_rebuilt, say, stdout, summary, to_file, words, written,
    wrong,
};
use crate::dataset::{Folder, atomic};
use crate::file::folder_of;
use crate::query::{self, Answer, AnswerError, Comparisons, Tables};
#[cfg(target_os = "linux")]
use crate::sweep::available_bytes;

/// Arguments of `query`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep query results/granite \"SELECT t_f, min(gap), max(gap) FROM gap GROUP BY t_f ORDER BY t_f\"
  slipsweep query results/granite \"SELECT status, count(*) FROM gap GROUP BY status\"
  slipsweep query results/granite \"SELECT * FROM best_cubic WHERE status = 'ok'\" --out best_cubic.csv")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME; or a Parquet or CSV file, which is a table under its own name
    dataset: PathBuf,
    /// One SELECT in quotes; it refers to the tables of the dataset by name
    sql: String,
    #[command(flatten)]
    output: Output<Format>,
}

/// Format of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Aligned columns of nine digits (.txt)
    Table,
    /// All digits (.csv)
    Csv,
    /// One JSON object per line (.jsonl)
    Jsonl,
    /// Parquet (.parquet)
    Parquet,
}

/// Environment variable of the query process.
const INSIDE: &str = "SLIPSWEEP_ANSWERS";

/// Stack for parsing and planning a query, in bytes. Chosen: a term takes some kilobytes, and a query has thousands at most.
const STACK_BYTES: usize = 256 << 20;

/// Answers a query.
///
/// # Errors
///
/// A query that is wrong, or tables that cannot be read.
pub fn query(arguments: &Arguments) -> Result<(), Failure> {
    if env::var_os(INSIDE).is_some() {
        return inside(arguments);
    }
    arguments.output.format()?;
    if arguments.output.is_stdout() {
        // The query process could not detect a closed standard output.
        drop(stdout()?);
    } else {
        keep_datasets(&arguments.output.out)?;
        let same = |path: &Path| fs::canonicalize(path).ok();
        if same(&arguments.dataset).is_some_and(|source| Some(source) == same(&arguments.output.out)) {
            let path = arguments.output.out.display();
            return Err(wrong(format!(
                "{path}: the answer would replace the file that it is read from\n  help: write it elsewhere, such as --out answer.csv"
            )));
        }
    }
    apart(arguments)
}

/// Answers a query in a separate process: this program again, whose messages come through a pipe. It ends when its
/// standard input closes.
fn apart(arguments: &Arguments) -> Result<(), Failure> {
    let no_process = |error| cannot_start("the query process", error);
    let program = env::current_exe().map_err(no_process)?;
    let mut command = Command::new(program);
    command.args(env::args_os().skip(1)).env(INSIDE, "1").stdin(Stdio::piped()).stderr(Stdio::piped());
    let bar = watch::spinner("answering the query");
    // On a terminal the answer goes through this process, which removes the progress line first.
    if io::stdout().is_terminal() {
        command.stdout(Stdio::piped());
    }
    let mut child = command.spawn().map_err(no_process)?;
    let (mut open, answer) = (child.stdin.take(), child.stdout.take());
    let look = |caught: Option<i32>| {
        if caught.is_some() {
            open = None;
        }
        if bar.elapsed() > watch::PROGRESS_DELAY && !bar.is_finished() {
            bar.tick();
        }
    };
    let work = || {
        thread::scope(|scope| {
            if let Some(answer) = answer {
                thread::Builder::new().spawn_scoped(scope, || pass_on(answer, &bar))?;
            }
            child.wait_with_output()
        })
    };
    let (ended, caught) = watch::while_looking(look, work);
    bar.finish_and_clear();
    if let Some(number) = caught {
        sweep(&arguments.output.out);
        let message = "stopped while answering the query; nothing has changed".to_owned();
        return Err(Failure { code: u8::try_from(128 + number).unwrap_or(u8::MAX), message });
    }
    let ended = ended.map_err(no_process)?;
    let (status, text) = (ended.status, String::from_utf8_lossy(&ended.stderr));
    match status.code() {
        Some(0) => {
            let _ = write!(io::stderr(), "{text}");
            Ok(())
        }
        Some(code @ 1..=2) => Err(Failure { code: code as u8, message: text.trim_end().to_owned() }),
        _ => {
            sweep(&arguments.output.out);
            Err(Failure::failed(reason(status, &text)))
        }
    }
}

fn cannot_start(what: &str, error: io::Error) -> Failure {
    let help = "raise the limit on processes (ulimit -u), or end other processes";
    Failure::failed(format!("cannot start {what}: {error}\n  help: {help}"))
}

/// Copies the answer of the query process to standard output, without the progress line. An answer that nobody reads is no failure.
fn pass_on(mut answer: ChildStdout, bar: &ProgressBar) {
    let mut bytes = [0; 1 << 13];
    while let Ok(length @ 1..) = answer.read(&mut bytes) {
        bar.finish_and_clear();
        let mut out = io::stdout();
        if out.write_all(&bytes[..length]).and_then(|()| out.flush()).is_err() {
            break;
        }
    }
}

/// The reason why the query process ended early.
fn reason(status: ExitStatus, said: &str) -> String {
    #[cfg(unix)]
    let signal = std::os::unix::process::ExitStatusExt::signal(&status);
    #[cfg(not(unix))]
    let signal: Option<i32> = None;
    // A machine without free memory sends SIGKILL.
    if said.contains("memory allocation of") || signal == Some(9) {
        return "the query needs more memory than is free\n  help: request fewer columns, a WHERE, a LIMIT; or join on a column"
            .to_owned();
    }
    if said.contains("overflowed its stack") {
        return "the query is too long\n  help: split it into several queries".to_owned();
    }
    let said = said.lines().next().unwrap_or_default();
    format!("the query failed ({status}): {said}\n  help: rewrite the query")
}

/// Removes the temporary files that an ended process left for `out`.
fn sweep(out: &Path) {
    let real = fs::canonicalize(out).unwrap_or_else(|_| out.to_owned());
    atomic::sweep(folder_of(&real), SystemTime::now());
}

/// Answers a query in this process, which ends after its answer, or when the process that started it ends.
fn inside(arguments: &Arguments) -> Result<(), Failure> {
    let no_thread = |error| cannot_start("a thread", error);
    limit_memory();
    // The failure of the query reports a panic.
    panic::set_hook(Box::new(|_| ()));
    rayon::ThreadPoolBuilder::new().build_global().map_err(|error| no_thread(io::Error::other(error)))?;
    let watch = || {
        // Returns when the other process ends.
        let _ = io::stdin().read(&mut [0]);
        std::process::exit(2);
    };
    thread::Builder::new().spawn(watch).map_err(no_thread)?;
    thread::scope(|scope| {
        let work = || answer(arguments);
        let thread = thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, work).map_err(no_thread)?;
        thread.join().unwrap_or_else(|_| {
            Err(Failure::failed("the query failed: it is not supported\n  help: rewrite the query"))
        })
    })
}

/// Limits this process to the free memory, so that a query that is too large fails instead of slowing the machine down.
#[cfg(target_os = "linux")]
fn limit_memory() {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmSize:"));
    let taken = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok());
    let (Some(free), Some(taken)) = (available_bytes(), taken) else { return };
    let most = free + 1024 * taken;
    let Rlimit { current, maximum } = getrlimit(Resource::As);
    let most = current.map_or(most, |current| current.min(most));
    // Without the limit, the machine ends the process if necessary.
    let _ = setrlimit(Resource::As, Rlimit { current: Some(most), maximum });
}

#[cfg(not(target_os = "linux"))]
fn limit_memory() {}

/// Answers a query.
fn answer(arguments: &Arguments) -> Result<(), Failure> {
    let format = arguments.output.format()?;
    kind::expect_rows(&arguments.dataset)?;
    note_rebuilt(&arguments.dataset);
    let tables = Tables::open(&arguments.dataset)?;
    let mut answer = tables.query(&arguments.sql)?;
    for source in tables.sources.iter().filter(|source| source.missing > 0) {
        let (missing, all) = (source.missing, source.missing + source.paths.len() as u64);
        note(format!(
            "`{}` lacks {} of {}, which `slipsweep run` computes",
            source.name,
            words::count(missing),
            words::things(all, "part")
        ));
    }
    let Comparisons { words, numbers } = mem::take(&mut answer.comparisons);
    words.iter().for_each(note);
    let note_empty = |rows| {
        let is_unexplained = rows <= 1 && words.is_empty();
        numbers.iter().filter(|_| is_unexplained).filter_map(|number| tables.note_on(number)).for_each(note);
    };
    if arguments.output.is_stdout() {
        let mut out = stdout()?;
        return match write(answer, format, &mut out) {
            Err(AnswerError::Write(error)) => written(Err(error)),
            done => done.map(note_empty).map_err(|error| failure(&tables, arguments, error)),
        };
    }
    let path = arguments.output.out.display();
    let mut rows = 0;
    let fill = |file: &mut dyn Write| {
        rows = write(answer, format, &mut BufWriter::new(file))?;
        Ok(())
    };
    to_file(&arguments.output.out, fill).map_err(|error| match error {
        AnswerError::Write(error) => cannot_write(&arguments.output.out, &error),
        error => failure(&tables, arguments, error),
    })?;
    note_empty(rows);
    say(&format!("written to {path}\n"))
}

/// The failure of a query, or of files that cannot be read to the end.
fn failure(tables: &Tables, arguments: &Arguments, error: AnswerError) -> Failure {
    let other = || match &error {
        AnswerError::Failed(cause) if !query::is_unreadable(cause) => {
            Failure::failed(format!("{error}\n  help: rewrite the query"))
        }
        _ => unreadable(&arguments.dataset, &error),
    };
    tables.diagnose(&arguments.sql).map_or_else(other, Failure::from)
}

/// The failure for tables that cannot be read to the end, usually because of a damaged file.
pub(super) fn unreadable(dataset: &Path, error: &AnswerError) -> Failure {
    let path = dataset.display();
    let help = if Folder::at(dataset).manifest_path().exists() {
        format!("`slipsweep status {path} --check` names damaged files, and the next run recomputes them")
    } else if error.to_string().contains("Disabled feature") {
        "write the file with Snappy or zstd, or without compression".to_owned()
    } else {
        "write the file again".to_owned()
    };
    Failure::failed(format!("{path}: {error}\n  help: {help}"))
}

fn write(answer: Answer, format: Format, out: &mut dyn Write) -> Result<usize, AnswerError> {
    match format {
        Format::Table => table(answer, out),
        Format::Csv => answer.write(query::Format::Csv, out),
        Format::Jsonl => answer.write(query::Format::JsonLines, out),
        Format::Parquet => answer.write(query::Format::Parquet, out),
    }
}

/// Writes aligned columns under their names and, if known, their units, and returns the number of rows.
fn table(answer: Answer, out: &mut dyn Write) -> Result<usize, AnswerError> {
    let mut columns = words::Columns::default();
    let mut lines = words::headed(answer.columns.clone(), answer.units.clone(), Vec::new());
    let rows = answer.rows(|rows| {
        lines.extend(rows.iter().map(|row| row.iter().map(summary::shown).collect()));
        out.write_all(columns.lines(&lines, 0).as_bytes())?;
        lines.clear();
        Ok(())
    })?;
    out.flush()?;
    Ok(rows)
}
