//! `slipsweep tables`: every table and column, from their definitions.

use super::{Failure, say, words};
use crate::grid::{Grid, Quantity, Scale};
use crate::table::{self, Kind, STATUS, STATUS_DOC};

/// Prints all tables.
pub fn tables() -> Result<(), Failure> {
    let mut text = String::new();
    let no_axes = Grid::default();
    for table in table::ALL.into_iter().chain(table::REDUCED.map(|(_, table)| table)) {
        text.push_str(&format!("{}: {}\n", table.name(), table.doc()));
        let mut rows: Vec<Vec<String>> = Vec::new();
        for axis in Quantity::ALL.into_iter().filter(|axis| table.axes().contains(axis)) {
            let unit = if axis.words().is_empty() { axis.unit(Scale::Model) } else { "word" };
            rows.push([axis.name(), unit, axis.doc()].map(str::to_owned).into());
        }
        for column in table.columns() {
            let unit = match column.kind {
                Kind::Label(_) => "word",
                Kind::Flag => "true or false",
                _ => column.unit(&no_axes),
            };
            let note = if column.optional { " (only if a spec names it)" } else { "" };
            rows.push(vec![column.name.to_owned(), unit.to_owned(), format!("{}{note}", column.doc)]);
        }
        rows.push([STATUS, "word", STATUS_DOC].map(str::to_owned).into());
        text.push_str(&words::aligned(&rows, 2));
        text.push('\n');
    }
    say(text.trim_end_matches('\n')).and_then(|()| say("\n"))
}
