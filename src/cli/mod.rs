//! The commands: each reads its arguments, calls the library and prints the result.

mod completions;
mod head;
mod init;
mod kind;
mod man;
mod output;
mod plan;
mod plot;
#[cfg(feature = "query")]
mod query;
#[cfg(not(feature = "query"))]
#[path = "without_query.rs"]
mod query;
mod report;
mod run;
mod shards;
mod status;
mod summary;
mod tables;
mod trace;
mod verify;
mod watch;
mod words;

use std::env;
use std::ffi::OsString;
use std::fmt::Display;
use std::fs::{self, OpenOptions};
use std::io::{self, BufWriter, StdoutLock, Write};
use std::panic;
use std::path::Path;
use std::process::ExitCode;
#[cfg(unix)]
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};

use self::watch::waiting;
use crate::dataset::{Folder, MANIFEST, Manifest, atomic};
use crate::file::folder_of;
use crate::names::{hint, nearest};
#[cfg(feature = "query")]
use crate::query::QueryError;
use crate::sweep::{SpecError, Sweep, schema};

use kind::Kind;

/// Exit code if the spec or the arguments are wrong.
const EXIT_REQUEST: u8 = 1;
/// Exit code if the command failed.
const EXIT_FAILURE: u8 = 2;
/// Exit code with `--strict` if some row is `not_converged`.
const EXIT_NOT_CONVERGED: u8 = 3;
/// Exit code with `--requeue` for a temporary failure (EX_TEMPFAIL of sysexits.h).
const EXIT_TEMPFAIL: u8 = 75;

/// Exact parameter sweeps over the control of rate-and-state friction.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Example:
  slipsweep init granite
  slipsweep run granite.toml
  slipsweep plot results/granite
  slipsweep query results/granite \"SELECT t_f, gap FROM best_cubic\"

`slipsweep COMMAND --help` shows an example of each command.

Exit codes:
  0    done
  1    the spec or the arguments are wrong, or the dataset does not fit on the disk
  2    the command failed, or the dataset of `status` is incomplete
  3    `run --strict` found a row that is not_converged, or `verify` found a difference beyond 10 rtol
  75   a temporary failure, with `run --requeue`
  130  stopped by Ctrl-C (SIGINT); finished parts are kept
  143  stopped by SIGTERM; finished parts are kept"
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented spec
    Init(init::Arguments),
    /// Compute the tables of a spec, or continue a stopped run
    Run(run::Arguments),
    /// Count the rows of a spec, and estimate time and size
    Plan(plan::Arguments),
    /// Show one protocol over time: v, theta, tau
    Trace(trace::Arguments),
    /// Summarise a dataset: rows by status, ranges of the columns, least gaps
    Summary(summary::Arguments),
    /// Show the first rows of a table
    Head(head::Arguments),
    /// Answer a query in SQL
    #[cfg_attr(not(feature = "query"), command(hide = true))]
    Query(query::Arguments),
    /// Report complete, missing, damaged and foreign parts of a dataset
    Status(status::Arguments),
    /// Write the job script of a sharded sweep, and print the command that submits it
    Shards(shards::Arguments),
    /// Draw pictures of a dataset or of traces, as SVG, PNG or PDF
    Plot(plot::Arguments),
    /// Write an HTML page with the pictures and the summary of a dataset
    Report(report::Arguments),
    /// Solve a sample of rows by an independent method, and report the differences
    Verify(verify::Arguments),
    /// List all tables or one, with columns and units
    Tables(tables::Arguments),
    /// Print the JSON Schema of a spec, for completion and checks in editors
    #[command(after_help = "Example:
  slipsweep schema > slipsweep.schema.json

With `#:schema ./slipsweep.schema.json` as its first line, a spec in its folder is completed and checked by editors that
use taplo, such as VS Code with Even Better TOML. `slipsweep init` writes both.")]
    Schema,
    /// Print the completion script of a shell
    Completions(completions::Arguments),
    /// Print the manual page of the program or of a command
    Man(man::Arguments),
}

/// The failure of a command: its message and its exit code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure {
    /// The exit code.
    pub code: u8,
    /// The message, from `error: ` on.
    pub message: String,
}

/// What commands print, for other interfaces.
pub mod text {
    pub use super::plan::in_words as plan;
    pub use super::summary::statistics as summary;
    pub use super::trace::{Traced, traced};
    pub use super::verify::report as audit;
}

impl Failure {
    fn failed(error: impl Display) -> Failure {
        Failure { code: EXIT_FAILURE, message: format!("error: {error}") }
    }
}

impl From<SpecError> for Failure {
    fn from(error: SpecError) -> Failure {
        wrong(error)
    }
}

#[cfg(feature = "query")]
impl From<QueryError> for Failure {
    fn from(error: QueryError) -> Failure {
        if error.is_wrong() { wrong(error) } else { Failure::failed(error) }
    }
}

/// Whether standard output was closed when the process began.
static STDOUT_IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Runs the command in the arguments of the process. It fails if standard output does not accept the answer, for example because it was closed
/// from the start.
pub fn main(stdout_is_closed: bool) -> ExitCode {
    main_of(env::args_os(), stdout_is_closed).into()
}

/// Runs the command of the arguments of a process, the first of which is its name. Returns the exit code.
pub fn main_of(arguments: impl Iterator<Item = OsString>, stdout_is_closed: bool) -> u8 {
    STDOUT_IS_CLOSED.store(stdout_is_closed, Ordering::Relaxed);
    hide_guarded_panics();
    // Without this signal, a file that exceeds the user's limit fails to write instead of ending the process.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false)));
    let words: Vec<OsString> = arguments.collect();
    let arguments = match Arguments::try_parse_from(&words) {
        Ok(arguments) => arguments,
        Err(error) => {
            let error = suggested(error, &words);
            let printed = error.print();
            if error.use_stderr() {
                // A lost terminal is ignored.
                return EXIT_REQUEST;
            }
            return ended(stdout().and_then(|mut stdout| written(printed.and_then(|()| stdout.flush()))));
        }
    };
    ended(perform(arguments))
}

/// The error of an unknown option among `words` with the option that was probably meant.
fn suggested(mut error: clap::Error, words: &[OsString]) -> clap::Error {
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidArg) else { return error };
    if error.kind() != ErrorKind::UnknownArgument {
        return error;
    }
    let plain = |option: &str| option.trim_start_matches('-').replace('-', "");
    let given = plain(given);
    let program = Arguments::command();
    let command = words.iter().skip(1).find_map(|word| program.find_subcommand(word)).unwrap_or(&program);
    let options: Vec<&str> = command.get_arguments().filter_map(clap::Arg::get_long).collect();
    let spelt: Vec<String> = options.iter().map(|option| plain(option)).collect();
    let meant = nearest(&given, spelt.iter().map(String::as_str));
    error.remove(ContextKind::SuggestedArg);
    error.remove(ContextKind::Suggested);
    if let Some(place) = spelt.iter().position(|option| Some(option.as_str()) == meant) {
        error.insert(ContextKind::SuggestedArg, ContextValue::String(format!("--{}", options[place])));
    }
    error
}

/// Writes a file completely or not at all, unless it belongs to a dataset.
fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    keep_datasets(path)?;
    to_file(path, |file| file.write_all(bytes)).map_err(|error| cannot_write(path, &error))
}

/// The failure for a file that cannot be written.
fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    let help = "name a file in an existing folder with write permission and free space";
    Failure::failed(format!("{}: cannot write: {error}\n  help: {help}", path.display()))
}

/// Refuses to replace a part or the manifest of a dataset.
fn keep_datasets(out: &Path) -> Result<(), Failure> {
    let real = fs::canonicalize(out).unwrap_or_else(|_| out.to_owned());
    let folder = fs::canonicalize(folder_of(&real)).unwrap_or_else(|_| folder_of(&real).to_owned());
    let is_manifest = real.file_name().is_some_and(|name| name == MANIFEST) && kind::is_dataset(&folder);
    if is_manifest || folder.parent().is_some_and(kind::is_dataset) {
        let what = "a file of a dataset, which only `slipsweep run` writes";
        return Err(wrong(format!("{}: {what}\n  help: write to another file", out.display())));
    }
    Ok(())
}

/// The failure for a table that is not among `names`; the message begins with `place`.
fn no_table(place: &str, name: &str, names: &[&str]) -> Failure {
    refused(format!("{place}no table `{name}`"), names.join(", "), hint(name, names.iter().copied()))
}

/// Runs the command of the arguments.
fn perform(arguments: Arguments) -> Result<(), Failure> {
    match arguments.command {
        Command::Init(arguments) => init::init(&arguments),
        Command::Run(arguments) => run::run(&arguments),
        Command::Plan(arguments) => plan::plan(&arguments),
        Command::Trace(arguments) => trace::trace(&arguments),
        Command::Summary(arguments) => summary::summary(&arguments),
        Command::Head(arguments) => head::head(&arguments),
        Command::Query(arguments) => query::query(&arguments),
        Command::Status(arguments) => status::status(&arguments),
        Command::Shards(arguments) => shards::shards(&arguments),
        Command::Plot(arguments) => plot::plot(&arguments),
        Command::Report(arguments) => report::report(&arguments),
        Command::Verify(arguments) => verify::verify(&arguments),
        Command::Tables(arguments) => tables::tables(&arguments),
        Command::Schema => say(&format!("{:#}\n", schema())),
        Command::Completions(arguments) => completions::completions(&arguments),
        Command::Man(arguments) => man::man(&arguments),
    }
}

/// Reports the failure of a command, if any, and returns the exit code.
fn ended(done: Result<(), Failure>) -> u8 {
    match done {
        Ok(()) => 0,
        Err(failure) => {
            let _ = writeln!(io::stderr(), "{}", failure.message);
            failure.code
        }
    }
}

/// Reads and checks the spec in `path`; prints warnings.
fn load(path: &Path) -> Result<Sweep, Failure> {
    kind::expect_spec(path)?;
    let sweep = waiting("reading the spec", || Sweep::load(path))?;
    for warning in &sweep.warnings {
        let _ = writeln!(io::stderr(), "warning: {warning}");
    }
    Ok(sweep)
}

/// A parser of whole numbers from `least` to `most`.
fn whole<T: TryFrom<u64>>(least: u64, most: u64) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| (least..=most).contains(number));
        number.and_then(|number| T::try_from(number).ok()).ok_or_else(|| match most {
            u64::MAX => format!("expected a whole number from {least} upwards"),
            _ => format!("expected a whole number from {least} to {most}"),
        })
    }
}

/// A parser of numbers from `least` to `most`.
fn within(least: f64, most: f64) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| (least..=most).contains(number));
        number.ok_or_else(|| format!("expected a number from {least} to {most}"))
    }
}

/// The failure for a wrong request.
fn wrong(message: impl Display) -> Failure {
    Failure { code: EXIT_REQUEST, message: format!("error: {message}") }
}

/// The failure for a wrong request, with the expected value and a line of help.
fn refused(found: impl Display, expected: impl Display, help: impl Display) -> Failure {
    wrong(format!("{found}\n  expected: {expected}\n  help: {help}"))
}

/// Opens the dataset in `path`, where one of `kinds` is expected.
fn opened(path: &Path, kinds: &[Kind]) -> Result<(Folder, Manifest), Failure> {
    let folder = Folder::at(path);
    let manifest = if path.is_dir() { folder.manifest().map_err(Failure::failed)? } else { None };
    Ok((folder, manifest.ok_or_else(|| kind::unexpected(path, kinds))?))
}

/// Opens the dataset in `path`, and prints a note if its manifest was reconstructed.
///
/// # Errors
///
/// The failure that a command reports.
pub fn dataset(path: &Path) -> Result<(Folder, Manifest), Failure> {
    let opened = opened(path, &[Kind::Dataset])?;
    note_rebuilt(path);
    Ok(opened)
}

/// Prints a note if the manifest of the dataset in `path` was reconstructed from the parts.
fn note_rebuilt(path: &Path) {
    let Ok(Some(Manifest { rebuilt: Some(why), .. })) = Folder::at(path).manifest() else { return };
    note(format!(
        "{} is {why}; rebuilt from the footers of the parts; `slipsweep run` rewrites it",
        Folder::at(path).manifest_path().display()
    ));
}

/// Prints a note. One that cannot be printed is no failure.
fn note(text: impl Display) {
    let _ = writeln!(io::stderr(), "note: {text}");
}

/// Prints no message for panics of a reader of damaged files, which become errors of the file.
fn hide_guarded_panics() {
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        if !crate::dataset::is_guarded() {
            usual(panic);
        }
    }));
}

/// Writes `text` to standard output.
fn say(text: &str) -> Result<(), Failure> {
    put(text.as_bytes())
}

/// Writes `bytes` to standard output.
fn put(bytes: &[u8]) -> Result<(), Failure> {
    let mut stdout = stdout()?;
    written(stdout.write_all(bytes).and_then(|()| stdout.flush()))
}

/// Standard output, for answers. The caller flushes it and passes the result to [`written`].
fn stdout() -> Result<BufWriter<StdoutLock<'static>>, Failure> {
    if STDOUT_IS_CLOSED.load(Ordering::Relaxed) {
        return Err(Failure::failed("cannot write to standard output: it is closed"));
    }
    Ok(BufWriter::new(io::stdout().lock()))
}

/// The result of writing to standard output; a reader that stops early is no failure.
fn written(result: io::Result<()>) -> Result<(), Failure> {
    match result {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::failed(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Whether the name of an output file stands for standard output.
fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

/// Writes a file completely or not at all; devices and named pipes are written directly.
fn to_file<E: From<io::Error>>(path: &Path, fill: impl FnOnce(&mut dyn Write) -> Result<(), E>) -> Result<(), E> {
    match fs::metadata(path) {
        Ok(found) if found.is_file() => atomic::write_with(&fs::canonicalize(path)?, |file| fill(file)),
        // A link such as /dev/stdout may lead to a pipe that has no path.
        Ok(_) => fill(&mut OpenOptions::new().write(true).open(path)?),
        Err(_) => {
            // A bare name belongs to the current folder, and a link to nothing to what it names.
            let path = fs::read_link(path).map_or_else(|_| path.to_owned(), |target| folder_of(path).join(target));
            atomic::write_with(&Path::new(".").join(path), |file| fill(file))
        }
    }
}
