//! What to do with a dataset: the commands that come next, for what is in it.

use std::path::Path;

use super::shards::quoted;
use crate::grid::Quantity;
use crate::sweep::{Request, Sweep};
use crate::table::Kind;

/// The commands that look at the dataset of `sweep` in `path`.
pub fn commands(sweep: &Sweep, path: &Path) -> String {
    let path = quoted(path);
    let mut text = "next:\n".to_owned();
    text.push_str(&format!("  slipsweep head {path}\n  slipsweep plot {path}\n"));
    if let Some(question) = sweep.requests.iter().map(question).next() {
        text.push_str(&format!("  slipsweep query {path} \"{question}\"\n"));
    }
    text
}

/// A question that makes sense for a table: its least gap, work or crossover time, or how many rows have which word, over the axis that varies
/// slowest.
fn question(request: &Request) -> String {
    let table = request.table;
    let columns = || request.selection.indices().iter().map(|&index| &table.columns()[index]);
    let stretches = request.projection.stretches();
    let varies = |axis: &&Quantity| {
        stretches.iter().any(|stretch| stretch.axis(**axis).is_some_and(|(_, axis)| axis.values.len() > 1))
    };
    let axis = table.axes().iter().find(varies).map(|axis| axis.name());
    let least = ["gap", "work", "t_cross"].into_iter().find(|name| columns().any(|column| column.name == *name));
    let word = columns().find(|column| matches!(column.kind, Kind::Label(_) | Kind::Flag)).map(|column| column.name);
    let name = table.name();
    match (least, word, axis) {
        (Some(least), _, Some(axis)) => {
            format!("SELECT {axis}, min({least}) FROM {name} WHERE status = 'ok' GROUP BY {axis} ORDER BY {axis}")
        }
        (_, Some(word), _) => format!("SELECT {word}, count(*) AS points FROM {name} GROUP BY {word} ORDER BY {word}"),
        _ => format!("SELECT status, count(*) AS points FROM {name} GROUP BY status ORDER BY status"),
    }
}
