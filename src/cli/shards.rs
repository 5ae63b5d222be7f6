//! `slipsweep shards SPEC`: the array job of a scheduler that runs a sweep in shards.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::ValueEnum;

use super::watch::waiting;
use super::{Failure, cannot_write, load, refused, say, whole, within, words, write_file, wrong};
use crate::dataset::Folder;
use crate::sweep::{Plan, Shard, check_parts, estimate};

/// Arguments of `shards`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  slipsweep shards granite.toml --engine slurm --shards 100 --out /shared/results")]
pub struct Arguments {
    /// The sweep spec, a TOML file
    spec: PathBuf,
    /// Scheduler
    #[arg(long, value_enum)]
    engine: Engine,
    /// Greatest number of shards; fewer if a task would have too little work
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1, Shard::MAX_COUNT))]
    shards: u64,
    /// Parent folder of the dataset, on a file system common to all machines
    #[arg(short, long, value_name = "DIR", default_value = "results")]
    out: PathBuf,
    /// Processors of a task
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = whole::<u64>(1, 1024))]
    cpus: u64,
    /// Least predicted work of a task, in minutes
    #[arg(long, value_name = "M", default_value_t = 5.0, value_parser = within(0.0, 1e9))]
    minutes: f64,
}

/// A scheduler with array jobs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// Slurm: `sbatch`
    Slurm,
    /// HyperQueue: `hq submit`
    Hyperqueue,
}

/// The prefix of the number of shards in a job script.
const SHARDS: &str = "# shards: ";

impl Engine {
    /// The job script of a dataset, in the folder of the dataset folder.
    fn script(self, dataset: &Path) -> PathBuf {
        let mut name = dataset.file_name().unwrap_or_default().to_owned();
        name.push(format!(".{self:?}.sh").to_lowercase());
        dataset.with_file_name(name)
    }

    /// The command that submits `script`, or only some shards of it.
    fn submit(self, script: &Path, shards: Option<&[u64]>) -> String {
        let submit = match self {
            Engine::Slurm => "sbatch",
            Engine::Hyperqueue => "hq submit",
        };
        let array = shards.map(|shards| format!(" --array={}", words::ranges(shards.iter().copied())));
        format!("{submit}{} {}", array.unwrap_or_default(), quoted(script))
    }

    /// Greatest number of tasks of an array. Slurm limits the index of a task, by default to 1000.
    fn most_tasks(self) -> u64 {
        match self {
            Engine::Slurm => slurm_config("MaxArraySize").and_then(|size| size.parse().ok()).unwrap_or(1001).max(1),
            Engine::Hyperqueue => Shard::MAX_COUNT,
        }
    }
}

/// The job scripts of `dataset`: for each, the number of shards and the command that submits some of them.
pub fn scripts(dataset: &Path) -> Vec<(u64, impl Fn(&[u64]) -> String)> {
    let scripts = Engine::value_variants().iter().filter_map(|engine| {
        let path = engine.script(dataset);
        let text = fs::read_to_string(&path).ok()?;
        let count: u64 = text.lines().find_map(|line| line.strip_prefix(SHARDS))?.parse().ok()?;
        let known = (1..=Shard::MAX_COUNT).contains(&count);
        known.then_some((count, move |shards: &[u64]| engine.submit(&path, Some(shards))))
    });
    scripts.collect()
}

/// Writes the job script and prints the command that submits it.
///
/// # Errors
///
/// A spec that is wrong, too many parts, or a script that cannot be written.
pub fn shards(arguments: &Arguments) -> Result<(), Failure> {
    let sweep = load(&arguments.spec)?;
    let plan = Plan::new(&sweep);
    check_parts(&plan).map_err(wrong)?;
    let sample = waiting("computing a sample", || estimate(&sweep, &arguments.out));
    let seconds = sample.map_err(Failure::failed)?.seconds();
    let parts: u64 = plan.tables.iter().map(|table| table.parts).sum();
    let rows = plan.tables.iter().fold(0_u64, |sum, table| sum.saturating_add(table.rows));

    let engine = arguments.engine;
    let (shards, fewer) = tasks(arguments, parts, seconds);
    let each = seconds / (shards * arguments.cpus) as f64;

    let out = absolute(&arguments.out)?;
    // Slurm removes them from the path of a log.
    if engine == Engine::Slurm && out.to_string_lossy().contains('\\') {
        let found = format!("{}: Slurm writes no log below a folder whose name has a backslash", out.display());
        return Err(refused(found, "a path without `\\`", "write elsewhere with --out DIR"));
    }
    let folder = Folder::new(&out, &sweep.name);
    let script = engine.script(folder.path());
    fs::create_dir_all(&arguments.out).map_err(|error| cannot_write(&arguments.out, &error))?;
    let program = std::env::current_exe()
        .map_err(|error| Failure::failed(format!("cannot find the path of the running program: {error}")))?;
    let spec = absolute(&arguments.spec)?;
    let paths = [program.as_path(), &spec, &out, folder.path()].map(quoted);
    let size = (shards, arguments.cpus, each);
    let text = script_of(engine, &sweep.name, &script.with_extension(""), size, paths);
    write_file(&script, text.as_bytes())?;

    let (rows, parts, work) = (words::things(rows, "row"), words::things(parts, "part"), words::duration(seconds));
    let (tasks, cpus) = (words::things(shards, "task"), words::things(arguments.cpus, "processor"));
    let mut said = format!("{}: {rows} in {parts}, about {work} on one processor\n", sweep.name);
    let _ = writeln!(said, "{tasks} of about {} on {cpus} each", words::duration(each));
    if let Some(reason) = fewer {
        let _ = writeln!(said, "fewer than the {} requested: {reason}", words::count(arguments.shards));
    }
    if engine == Engine::Slurm
        && slurm_config("RequeueExit").is_some_and(|codes| !codes.split(',').any(|code| code == "75"))
    {
        said.push_str("RequeueExit of this Slurm lacks 75: submit tasks with a temporary failure again by hand\n");
    }
    let _ = writeln!(said, "written: {}\nsubmit with\n  {}", script.display(), engine.submit(&script, None));
    let _ = writeln!(said, "then list missing parts with\n  slipsweep status {}", quoted(folder.path()));
    say(&said)
}

/// The number of tasks, and the reason if it is less than requested.
fn tasks(arguments: &Arguments, parts: u64, seconds: f64) -> (u64, Option<String>) {
    let worth = match arguments.minutes {
        0.0 => Shard::MAX_COUNT,
        minutes => (seconds / (60.0 * minutes * arguments.cpus as f64)) as u64,
    };
    let bounds = [
        (parts, "the sweep has only so many parts".to_owned()),
        (arguments.engine.most_tasks(), "MaxArraySize of Slurm allows no more tasks in an array".to_owned()),
        (worth.max(1), format!("more of them would have less than {} minutes of work each", arguments.minutes)),
    ];
    let tasks = bounds.iter().map(|(most, _)| *most).fold(arguments.shards, u64::min);
    let reason = bounds.into_iter().find(|(most, _)| *most == tasks && tasks < arguments.shards);
    (tasks, reason.map(|(_, reason)| reason))
}

/// The absolute path; refused if it is not Unicode, since a script cannot contain it.
fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    let absolute = std::path::absolute(path).ok().filter(|path| path.to_str().is_some());
    absolute.ok_or_else(|| wrong(format!("{}: not a path in UTF-8\n  help: rename it", path.display())))
}

/// A path, quoted for the shell.
pub fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=@%,:".contains(c);
    if !text.is_empty() && text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

/// An entry of the Slurm configuration of this machine, if it has Slurm.
fn slurm_config(key: &str) -> Option<String> {
    let output =
        Command::new("scontrol").args(["show", "config"]).output().ok().filter(|output| output.status.success())?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines().find_map(|line| {
        let (found, value) = line.split_once('=')?;
        (found.trim() == key).then(|| value.trim().to_owned())
    })
}

/// The job script for a scheduler: the number of its tasks, their processors and the predicted time of each in s, and the quoted paths of program, spec,
/// output and dataset.
fn script_of(
    engine: Engine,
    name: &str,
    log: &Path,
    (shards, cpus, each): (u64, u64, f64),
    [program, spec, out, dataset]: [String; 4],
) -> String {
    let (last, about) = (shards - 1, words::duration(each));
    // Predictions come from a small sample, and other machines may be slower.
    let minutes = (10.0 + 3.0 * each / 60.0).ceil();
    // Slurm interprets % as a pattern.
    let log = log.display().to_string().replace('%', "%%").replace('"', "\\\"");
    let task = format!(
        "# A task is about {about} of work. It may be killed, repeated, or run twice at the same time without harm."
    );
    let (head, again, number) = match engine {
        Engine::Slurm => (
            format!(
                "#SBATCH --job-name={name}\n#SBATCH --array=0-{last}\n#SBATCH --cpus-per-task={cpus}\n#SBATCH --time={minutes}\n\
                     #SBATCH --requeue\n#SBATCH --open-mode=append\n#SBATCH --output=\"{log}-%a.log\"\n"
            ),
            "# Exit code 75 requeues the task, at most five times, if it is in RequeueExit of Slurm.\n\
                 again=--requeue\n\
                 [ \"${SLURM_RESTART_COUNT:-0}\" -lt 5 ] || again=\n",
            ("$SLURM_ARRAY_TASK_ID", " $again"),
        ),
        Engine::Hyperqueue => {
            (format!("#HQ --name={name}\n#HQ --array=0-{last}\n#HQ --cpus={cpus}\n"), "", ("$HQ_TASK_ID", ""))
        }
    };
    let (number, flag) = number;
    format!(
        "#!/bin/bash\n{head}{SHARDS}{shards}\n{task}\n{again}\
             exec {program} run {spec} --out {out} --shard \"{number}/{shards}\" --threads {cpus}{flag}\n\
             # Missing parts: {program} status {dataset}\n"
    )
}
