//! `slipsweep head DATASET [TABLE]`: the first rows of a table, with units.

use std::path::PathBuf;

use super::query::unreadable;
use super::{Failure, kind, no_table, say, summary, words};
use crate::query::{Source, Tables};
use crate::table;

/// Arguments of `head`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep head results/granite
  slipsweep head results/granite gap -n 20")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME; or a Parquet or CSV file
    dataset: PathBuf,
    /// Table; all by default
    table: Option<String>,
    /// Number of rows
    #[arg(short = 'n', long, value_name = "N", default_value_t = 10)]
    rows: u32,
}

/// Prints the first rows of one table or of all tables.
///
/// # Errors
///
/// A path without tables, or a part that cannot be read.
pub fn head(arguments: &Arguments) -> Result<(), Failure> {
    kind::expect_rows(&arguments.dataset)?;
    super::note_at(&arguments.dataset);
    let tables = Tables::open(&arguments.dataset)?;
    let chosen: Vec<&Source> = match &arguments.table {
        None => tables.sources.iter().collect(),
        Some(name) => vec![tables.find(name).ok_or_else(|| {
            let names: Vec<&str> = tables.sources.iter().map(|source| source.name.as_str()).collect();
            no_table(&format!("{}: ", arguments.dataset.display()), name, &names)
        })?],
    };
    let texts: Vec<String> = chosen.into_iter().map(|source| first(source, arguments)).collect::<Result<_, _>>()?;
    say(&texts.join("\n"))
}

/// A title, then names, units and rows.
fn first(source: &Source, arguments: &Arguments) -> Result<String, Failure> {
    let mut lines = vec![source.columns.clone()];
    if source.units.iter().any(|unit| !unit.is_empty()) {
        lines.push(source.units.clone());
    }
    source
        .first(arguments.rows)?
        .rows(|piece| {
            lines.extend(piece.iter().map(|row| row.iter().map(summary::shown).collect()));
            Ok(())
        })
        .map_err(|error| unreadable(&arguments.dataset, &error))?;
    let mut text = source.name.clone();
    if let Some(rows) = source.rows {
        let meaning = table::find(&source.name).map(|table| format!("{}; ", table.doc())).unwrap_or_default();
        text.push_str(&format!(": {meaning}{}", words::things(rows, "row")));
        if source.missing > 0 {
            text.push_str(&format!("; {} missing", words::things(source.missing, "part")));
        }
    }
    text.push('\n');
    text.push_str(&words::aligned(&lines, 2));
    Ok(text)
}
