//! `slipsweep summary DATASET`: what is in a dataset, as `run` tells it at its end.

use std::path::PathBuf;

use super::{Failure, dataset, say, words};
use crate::dataset::{Cell, Digest, Row};
use crate::grid::Quantity;
use crate::protocol::Status;
use crate::sweep::units_of;
use crate::table::{self, STATUS};

/// Arguments of `summary`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  slipsweep summary results/granite")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME
    dataset: PathBuf,
}

/// Tells what is in a dataset.
pub fn summary(arguments: &Arguments) -> Result<(), Failure> {
    let (folder, manifest) = dataset(&arguments.dataset)?;
    let units = units_of(&manifest.spec)?;
    let mut text = String::new();
    for table in &manifest.tables {
        let read = Digest::read(&folder, table, &units).map_err(Failure::failed)?;
        if !text.is_empty() {
            text.push('\n');
        }
        text.push_str(&digest(&table.name, table.rows, &read));
        if read.missing > 0 {
            text.push_str(&format!(
                "  {} of {} not there yet: `slipsweep run` makes what is missing\n",
                words::count(read.missing),
                words::things(table.parts, "part")
            ));
        }
    }
    say(&text)
}

/// One table in a few lines.
pub fn digest(name: &str, rows: u64, digest: &Digest) -> String {
    let counts: Vec<String> = Status::ALL
        .iter()
        .zip(digest.status)
        .filter(|(_, rows)| *rows > 0)
        .map(|(status, rows)| format!("{} {}", words::count(rows), status.name()))
        .collect();
    let mut text = format!("{name}: {} ({})\n", words::things(rows, "row"), counts.join(", "));
    if !digest.least.is_empty() && digest.rows.is_none() {
        // A family may hold protocols that miss the final state, with any work.
        let arriving = if name == "swift" { " and arrive" } else { "" };
        text.push_str(&format!("  least gap among the rows that are ok{arriving}:\n"));
        text.push_str(&listing(&digest.least));
    }
    match &digest.rows {
        Some(rows) => text.push_str(&listing(rows)),
        None => {
            let mut lines = vec![["column", "rows", "least", "greatest"].map(str::to_owned).to_vec()];
            for range in digest.ranges.iter().filter(|range| range.count > 0) {
                let ends = [range.least, range.greatest].map(words::number);
                lines.push([range.column.clone(), words::count(range.count)].into_iter().chain(ends).collect());
            }
            text.push_str(&words::aligned(&lines, 2));
            for (column, counts) in &digest.words {
                let counts: Vec<String> =
                    counts.iter().map(|(word, rows)| format!("{} {word}", words::count(*rows))).collect();
                text.push_str(&format!("  {column}: {}\n", counts.join(", ")));
            }
        }
    }
    if let Some(prediction) = table::find(name).and_then(|table| table.prediction())
        && !digest.predicted.is_empty()
    {
        text.push_str(&format!("  {} as {} predicts it, and as found:\n", prediction.column, prediction.theory));
        let mut lines = vec![["predicted", "found", "rows"].map(str::to_owned).to_vec()];
        for (predicted, found, rows) in &digest.predicted {
            lines.push(vec![(*predicted).to_owned(), found.clone(), words::count(*rows)]);
        }
        text.push_str(&words::aligned(&lines, 4));
        let surprises = digest
            .predicted
            .iter()
            .filter(|(predicted, found, _)| found.as_str() == prediction.surprise && *predicted != prediction.surprise);
        let differ: u64 = surprises.map(|(.., rows)| rows).sum();
        if differ > 0 {
            text.push_str(&format!(
                "    {} of {}: {}\n",
                words::things(differ, "row"),
                prediction.surprise,
                prediction.why
            ));
        }
    }
    text
}

/// Rows with a header; axes that do not vary stand above, columns without any value are left out.
fn listing(rows: &[Row]) -> String {
    let Some(first) = rows.first() else { return String::new() };
    let is_axis = |name: &str| Quantity::from_name(name).is_some();
    let mut common = Vec::new();
    let mut places = Vec::new();
    let mut results_begin = false;
    for (place, (name, cell)) in first.iter().enumerate() {
        // `best` has result columns of the same names as axes: axes end where they stop coming in the order of quantities.
        results_begin |= !is_axis(name);
        let varies = rows.iter().any(|row| row[place].1 != *cell);
        let missing = rows.iter().all(|row| row[place].1 == Cell::Missing);
        if !results_begin && !varies && Quantity::from_name(name).is_some_and(|axis| !axis.has_scale()) {
            common.push(format!("{name} = {}", shown(cell)));
        } else if !missing && (name != STATUS || varies) {
            places.push(place);
        }
    }
    let mut lines = vec![places.iter().map(|&place| first[place].0.clone()).collect::<Vec<_>>()];
    lines.extend(rows.iter().map(|row| places.iter().map(|&place| shown(&row[place].1)).collect()));
    let mut text = String::new();
    if !common.is_empty() {
        text.push_str(&format!("  at {}\n", common.join(", ")));
    }
    text.push_str(&words::aligned(&lines, 4));
    text
}

/// A cell as a reader sees it.
pub fn shown(cell: &Cell) -> String {
    match cell {
        Cell::Missing => "-".to_owned(),
        Cell::Number(value) => words::number(*value),
        Cell::Word(word) => word.clone(),
    }
}
