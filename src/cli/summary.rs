//! `slipsweep summary DATASET`: the summary that `run` prints at its end, from the footers of the parts.

use std::path::{Path, PathBuf};

use super::trace::reason;
use super::watch::waiting;
use super::{Failure, dataset, say, words};
use crate::dataset::{
    Cell, CheckDepth, Counts, Folder, MAX_KEPT_ROWS, Manifest, StatisticsRow, Survey, TableStatistics,
};
use crate::grid::Quantity;
use crate::protocol::Status;
use crate::table::{self, STATUS};
use crate::trace::TABLES;

/// Arguments of `summary`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  slipsweep summary results/granite")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME
    dataset: PathBuf,
}

/// Prints the summary of a dataset.
///
/// # Errors
///
/// A path that is not a dataset, or damaged parts.
pub fn summary(arguments: &Arguments) -> Result<(), Failure> {
    let (folder, manifest) = dataset(&arguments.dataset)?;
    let mut text = String::new();
    for table in &contents(&folder, &manifest)?.tables {
        if !text.is_empty() {
            text.push('\n');
        }
        text.push_str(&statistics(&table.name, table.rows, &table.statistics));
        text.push_str(&infeasibility(&arguments.dataset, &table.name, &table.statistics));
        let missing = table.parts - table.there;
        if missing > 0 {
            let (missing, all) = (words::count(missing), words::things(table.parts, "part"));
            text.push_str(&format!("  {missing} of {all} missing: `slipsweep run` computes them\n"));
        }
    }
    say(&text)
}

/// Surveys a dataset.
pub fn survey(folder: &Folder, manifest: &Manifest, look: CheckDepth) -> Survey {
    let doing = match look {
        CheckDepth::Footer => "reading the footers",
        CheckDepth::Whole => "checking existing parts",
    };
    waiting(doing, || Survey::new(folder, manifest, look))
}

/// The contents of a dataset without damaged parts.
///
/// # Errors
///
/// Damaged parts, or parts of another sweep.
pub fn contents(folder: &Folder, manifest: &Manifest) -> Result<Survey, Failure> {
    let survey = survey(folder, manifest, CheckDepth::Footer);
    for (table, planned) in survey.tables.iter().zip(&manifest.tables) {
        if !(table.damaged.is_empty() && table.foreign.is_empty()) {
            folder.verified(manifest, planned).map_err(Failure::failed)?;
        }
    }
    Ok(survey)
}

/// An element of the summary of a table, for text or HTML.
pub enum SummaryBlock {
    /// A line with an indentation.
    Line(usize, String),
    /// A table with indentation, names, units (empty if unknown) and rows.
    Table(usize, Vec<String>, Vec<String>, Vec<Vec<String>>),
}

/// One table in a few lines.
pub fn statistics(name: &str, rows: u64, statistics: &TableStatistics) -> String {
    let lines = blocks(name, rows, statistics).into_iter().map(|piece| match piece {
        SummaryBlock::Line(indent, line) => format!("{:indent$}{line}\n", ""),
        SummaryBlock::Table(indent, names, units, rows) => words::aligned(&words::headed(names, units, rows), indent),
    });
    lines.collect()
}

/// The summary of a table of `rows` rows.
pub fn blocks(name: &str, rows: u64, statistics: &TableStatistics) -> Vec<SummaryBlock> {
    let counts = words::statuses(&statistics.status);
    let there = statistics.status.iter().sum::<u64>();
    let of = if there < rows { format!("{} of ", words::count(there)) } else { String::new() };
    let counts = if counts.is_empty() { String::new() } else { format!(" ({counts})") };
    let mut blocks = vec![SummaryBlock::Line(0, format!("{name}: {of}{}{counts}", words::things(rows, "row")))];
    match &statistics.rows {
        Some(rows) => blocks.extend(listing(statistics, &rows.iter().collect::<Vec<_>>())),
        None => {
            let least: Vec<&StatisticsRow> = statistics.least().collect();
            if !least.is_empty() {
                // Protocols of a family may miss the final state, with any work.
                let arriving = if name == "shortcut" { " that reach the final state" } else { "" };
                blocks.push(SummaryBlock::Line(2, format!("least gap of the rows with status ok{arriving}:")));
                blocks.extend(listing(statistics, &least));
            }
            blocks.extend(ranges(statistics));
            let counted = |column: &str, counts: &Counts| {
                let counts = counts.iter().map(|(word, rows)| (word.as_str(), *rows));
                SummaryBlock::Line(2, format!("{column}: {}", words::counts(counts)))
            };
            blocks.extend(statistics.labels.iter().map(|(label, counts)| match counts {
                Some(counts) => counted(label, counts),
                None => SummaryBlock::Line(2, format!("{label}: more than {MAX_KEPT_ROWS} different labels")),
            }));
            let words = statistics.words.iter().filter(|(_, counts)| !counts.is_empty());
            blocks.extend(words.map(|(column, counts)| counted(column, counts)));
        }
    }
    blocks.extend(predicted(name, statistics));
    let has_bound = table::find(name).is_some_and(|table| table.columns().iter().any(|column| column.name == "bound"));
    let is_written = statistics.columns.iter().any(|(column, _)| column == "bound");
    if statistics.status[Status::Infeasible as usize] > 0 && has_bound && !is_written {
        let help =
            "help: the column `bound` states why a row is infeasible: columns = [..., \"bound\"] under another `name`";
        blocks.push(SummaryBlock::Line(2, help.to_owned()));
    }
    blocks
}

/// Why the first row of a table without any feasible row is infeasible, on a line; empty for other tables.
pub fn infeasibility(dataset: &Path, name: &str, statistics: &TableStatistics) -> String {
    let infeasible = statistics.status[Status::Infeasible as usize];
    if infeasible == 0 || infeasible < statistics.status.iter().sum() || !TABLES.contains(&name) {
        return String::new();
    }
    let reason = reason(&dataset.to_string_lossy(), name, 0);
    reason.map_or_else(String::new, |reason| format!("  row 0 is infeasible: {reason}\n"))
}

/// The columns of numbers.
fn ranges(statistics: &TableStatistics) -> Option<SummaryBlock> {
    let ranges = statistics.ranges.iter().filter(|range| range.count > 0).map(|range| {
        let ends = [range.least, range.greatest].map(words::number);
        let of = [range.column.clone(), statistics.unit(&range.column).to_owned(), words::count(range.count)];
        of.into_iter().chain(ends).collect()
    });
    let names = ["column", "unit", "rows", "least", "greatest"].map(str::to_owned);
    let ranges: Vec<Vec<String>> = ranges.collect();
    (!ranges.is_empty()).then(|| SummaryBlock::Table(2, names.to_vec(), Vec::new(), ranges))
}

/// The prediction of linear theory for a column, compared with the rows.
fn predicted(name: &str, statistics: &TableStatistics) -> Vec<SummaryBlock> {
    let prediction = table::find(name).and_then(|table| table.prediction());
    let Some(prediction) = prediction.filter(|_| !statistics.predicted.is_empty()) else { return Vec::new() };
    let mut lines = Vec::new();
    for (predicted, found) in &statistics.predicted {
        lines.extend(found.iter().map(|(word, rows)| vec![predicted.clone(), word.clone(), words::count(*rows)]));
    }
    let names = ["predicted", "found", "rows"].map(str::to_owned);
    let mut blocks = vec![
        SummaryBlock::Line(2, format!("{} as {} predicts it, and as found:", prediction.column, prediction.theory)),
        SummaryBlock::Table(4, names.to_vec(), Vec::new(), lines),
    ];
    for (word, why) in prediction.surprises {
        let others = statistics.predicted.iter().filter(|(predicted, _)| predicted.as_str() != *word);
        let differ: u64 = others.filter_map(|(_, found)| found.get(*word)).sum();
        if differ > 0 {
            blocks.push(SummaryBlock::Line(4, format!("{} of {word}: {why}", words::things(differ, "row"))));
        }
    }
    blocks
}

/// Rows under names and units. Constant axes are listed above; columns without any value are omitted.
fn listing(statistics: &TableStatistics, rows: &[&StatisticsRow]) -> Vec<SummaryBlock> {
    let Some(first) = rows.first() else { return Vec::new() };
    let is_axis = |name: &str| Quantity::from_name(name).is_some();
    let mut common = Vec::new();
    let mut places = Vec::new();
    let mut results_begin = false;
    for (place, (name, unit)) in statistics.columns.iter().enumerate() {
        let cell = first.cell(place);
        // `best_cubic` has result columns with names of axes: the axes end where the order of quantities ends.
        results_begin |= !is_axis(name);
        let varies = rows.iter().any(|row| row.cell(place) != cell);
        let missing = rows.iter().all(|row| *row.cell(place) == Cell::Missing);
        if !results_begin && !varies && Quantity::from_name(name).is_some_and(|axis| !axis.has_scale()) {
            let unit = if unit == "1" { "" } else { unit };
            common.push(format!("{name} = {} {unit}", shown(cell)).trim_end().to_owned());
        } else if !missing && (name != STATUS || varies) {
            places.push(place);
        }
    }
    let at = (!common.is_empty()).then(|| SummaryBlock::Line(2, format!("at {}", common.join(", "))));
    let names = places.iter().map(|&place| statistics.columns[place].0.clone()).collect();
    let units = places.iter().map(|&place| statistics.columns[place].1.clone()).collect();
    let rows = rows.iter().map(|row| places.iter().map(|&place| shown(row.cell(place))).collect()).collect();
    let table = (!places.is_empty()).then_some(SummaryBlock::Table(4, names, units, rows));
    at.into_iter().chain(table).collect()
}

/// A cell as text.
pub fn shown(cell: &Cell) -> String {
    match cell {
        Cell::Missing => "-".to_owned(),
        Cell::Number(value) => words::number(*value),
        Cell::Word(word) => word.clone(),
    }
}
