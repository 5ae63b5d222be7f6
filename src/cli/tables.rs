//! `slipsweep tables [TABLE]`: tables and their columns, from their definitions.

use super::{Failure, no_table, say, words};
use crate::grid::{Grid, Quantity, Scale};
use crate::table::{self, Kind, STATUS, STATUS_DOC, Table};

/// Arguments of `tables`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep tables | less
  slipsweep tables gap")]
pub struct Arguments {
    /// Table; all by default
    table: Option<String>,
}

/// Prints one table or all.
///
/// # Errors
///
/// An unknown table.
pub fn tables(arguments: &Arguments) -> Result<(), Failure> {
    let all: Vec<&Table> = table::ALL.into_iter().chain(table::REDUCED.map(|(_, table)| table)).collect();
    let chosen = match &arguments.table {
        None => all,
        Some(name) => match all.iter().find(|table| table.name() == name) {
            Some(table) => vec![*table],
            None => return Err(no_table("", name, &all.iter().map(|table| table.name()).collect::<Vec<_>>())),
        },
    };
    let texts: Vec<String> = chosen.into_iter().map(text).collect();
    say(&texts.join("\n"))
}

/// The title of a table, then its columns with units and meanings.
fn text(table: &Table) -> String {
    let no_axes = Grid::default();
    let mut rows: Vec<Vec<String>> = Vec::new();
    for axis in Quantity::ALL.into_iter().filter(|axis| table.axes().contains(axis)) {
        let unit = if axis.words().is_empty() { axis.unit(Scale::Model) } else { "word" };
        rows.push(vec![axis.name().to_owned(), unit.to_owned(), with_words(table, axis.name(), axis.doc())]);
    }
    for column in table.columns() {
        let unit = match column.kind {
            Kind::Label(_) => "word",
            Kind::Flag => "true or false",
            _ => column.unit(&no_axes),
        };
        let note = if column.optional { " (optional)" } else { "" };
        rows.push(vec![
            column.name.to_owned(),
            unit.to_owned(),
            format!("{}{note}", with_words(table, column.name, column.doc)),
        ]);
    }
    rows.push(vec![STATUS.to_owned(), "word".to_owned(), with_words(table, STATUS, STATUS_DOC)]);
    format!("{}: {}\n{}", table.name(), table.doc(), words::aligned(&rows, 2))
}

/// The meaning of a column, with the words that it can have unless the meaning has them.
fn with_words(table: &Table, column: &str, doc: &str) -> String {
    let words = table::vocabulary(table.name(), column);
    if words.iter().all(|word| doc.contains(word)) {
        return doc.to_owned();
    }
    format!("{doc}; one of {}", words.join(", "))
}
