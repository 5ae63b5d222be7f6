//! `slipsweep status DATASET`: complete, missing, damaged and foreign parts of a dataset.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::kind::Kind;
use super::run::by_spec;
use super::shards::{quoted, scripts};
use super::{EXIT_FAILURE, Failure, opened, say, summary, words};
use crate::dataset::{Build, CheckDepth, Folder, Foreign, Manifest, Survey, TableSurvey};
use crate::sweep::{Plan, Sweep, shards_with};

/// Arguments of `status`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep status results/granite
  slipsweep status results/granite --check")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME
    dataset: PathBuf,
    /// Check every bit of each part, not only its footer
    #[arg(long)]
    check: bool,
}

/// Greatest number of listed parts or files of each kind. Chosen: five kinds fit on a screen.
const MAX_LISTED: usize = 10;

/// Reports the parts of a dataset.
///
/// # Errors
///
/// A path that is not a dataset, or damaged parts.
pub fn status(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.dataset;
    let (folder, manifest) = opened(path, &[Kind::Dataset])?;
    let survey =
        summary::survey(&folder, &manifest, if arguments.check { CheckDepth::Whole } else { CheckDepth::Footer });
    let mut text = format!("{}: {}, made by slipsweep {}\n", path.display(), manifest.name, manifest.build.version);
    if let Some(why) = &manifest.rebuilt {
        let _ =
            writeln!(text, "manifest.json is {why}; rebuilt from the footers of the parts; the next run rewrites it");
    }
    text.push_str(&counts(&survey));
    text.push_str(&faults(&folder, &survey));
    if survey.is_complete() {
        text.push_str(if arguments.check { "complete; all checksums match\n" } else { "complete\n" });
        return say(&text);
    }
    match folder.is_busy() {
        true => text.push_str("a run is writing this dataset\n"),
        false => text.push_str(&remedy(path, &manifest, &survey)),
    }
    say(&text)?;
    let (all, there) =
        survey.tables.iter().fold((0, 0), |(all, there), table| (all + table.parts, there + table.there));
    let message = format!("incomplete: {} of {} are present", words::count(there), words::things(all, "part"));
    Err(Failure { code: EXIT_FAILURE, message })
}

/// Parts and rows, table by table.
fn counts(survey: &Survey) -> String {
    let mut lines = vec![
        ["table", "parts", "present", "missing", "damaged", "foreign", "rows present"].map(str::to_owned).to_vec(),
    ];
    for table in &survey.tables {
        let missing = table.missing.iter().map(|range| range.end - range.start).sum();
        let (damaged, foreign) = (table.damaged.len() as u64, table.foreign.len() as u64);
        let rows = format!("{} of {}", words::count(table.statistics.status.iter().sum()), words::count(table.rows));
        let by_status = words::statuses(&table.statistics.status);
        let rows = if by_status.is_empty() { rows } else { format!("{rows}: {by_status}") };
        let numbers = [table.parts, table.there, missing, damaged, foreign].map(words::count);
        lines.push([table.name.clone()].into_iter().chain(numbers).chain([rows]).collect());
    }
    words::aligned(&lines, 2)
}

/// The damaged and foreign parts.
fn faults(folder: &Folder, survey: &Survey) -> String {
    let tables = || survey.tables.iter();
    let missing = tables().filter(|table| !table.missing.is_empty()).map(|table| {
        let first = table.missing.iter().take(MAX_LISTED).map(|parts| words::range(parts.start, parts.end - 1));
        let more = if table.missing.len() > MAX_LISTED { ", …" } else { "" };
        format!("{}: {}{more}", table.name, first.collect::<Vec<_>>().join(","))
    });
    let shown = |paths: &[PathBuf]| -> Vec<String> { paths.iter().map(|path| path.display().to_string()).collect() };
    let file = |table: &TableSurvey, part: u64| folder.part(&table.name, part).display().to_string();
    let damaged = tables()
        .flat_map(|table| table.damaged.iter().map(move |(part, why)| format!("{}: {why}", file(table, *part))));
    let foreign = |is_read: bool| {
        let of = move |table: &TableSurvey| {
            let all = table.foreign.iter().filter(|(_, why)| matches!(why, Foreign::Unreadable(_)) != is_read);
            all.map(|(part, why)| format!("{}: {why}", file(table, *part))).collect::<Vec<_>>()
        };
        tables().flat_map(of).collect::<Vec<_>>()
    };
    let lists: [(&str, Vec<String>); 6] = [
        ("missing parts:", missing.collect()),
        ("damaged parts (the next run recomputes them):", damaged.collect()),
        ("foreign files in the place of parts (a run leaves them alone and fails):", foreign(true)),
        ("files in the place of parts that this user may not read (a run fails):", foreign(false)),
        (
            "temporary files of running or killed processes (the next run removes those of killed ones):",
            shown(&survey.temporary),
        ),
        ("other files (ignored):", shown(&survey.others)),
    ];
    let mut text = String::new();
    for (title, lines) in lists.iter().filter(|(_, lines)| !lines.is_empty()) {
        let _ = writeln!(text, "{title}");
        for line in lines.iter().take(MAX_LISTED) {
            let _ = writeln!(text, "  {line}");
        }
        if lines.len() > MAX_LISTED {
            let _ = writeln!(text, "  and {} more", words::count((lines.len() - MAX_LISTED) as u64));
        }
    }
    text
}

/// The commands that would finish the dataset.
fn remedy(path: &Path, manifest: &Manifest, survey: &Survey) -> String {
    let mut text = "to finish the dataset:\n".to_owned();
    for table in &survey.tables {
        for (part, why) in &table.foreign {
            let place = Folder::at(path).part(&table.name, *part);
            let _ = match why {
                Foreign::Unreadable(_) => writeln!(text, "  chmod u+r {}", quoted(&place)),
                _ => writeln!(text, "  mv {} {}", quoted(&place), quoted(&place.with_extension("parquet.foreign"))),
            };
        }
    }
    let ours = Build::this();
    if manifest.build != ours {
        let [theirs, ours] = [&manifest.build, &ours]
            .map(|build| format!("slipsweep {}, numerics revision {}", build.version, build.revision));
        let _ = writeln!(text, "  run its spec with {theirs}; this is {ours}, whose parts would differ");
        return text;
    }
    let sweep = Sweep::parse_at(&manifest.spec, &Folder::at(path).manifest_path()).ok();
    let plan = sweep.as_ref().map(Plan::new);
    let is_same = plan.as_ref().is_some_and(|plan| plan.tables == manifest.tables);
    let (Some(sweep), Some(plan), true) = (sweep, plan, is_same) else {
        let _ = writeln!(text, "  {}", by_spec(path, &manifest.name));
        text.push_str("SPEC is the spec file of this dataset: it refers to files that are not in the dataset\n");
        return text;
    };
    let _ = writeln!(text, "  slipsweep run {}", quoted(path));
    for (count, submit) in scripts(path) {
        let wanted = |table: usize, part| survey.tables.get(table).is_some_and(|table| !table.has(part));
        let Ok(shards) = shards_with(&sweep, &plan, count, wanted) else { continue };
        let _ = writeln!(text, "or as tasks, {} of {count} shards:\n  {}", shards.len(), submit(&shards));
    }
    text
}
