//! The protocol of a row of a dataset.

use super::Protocol;
use crate::dataset::{Cell, Row};
use crate::grid::Quantity;
use crate::model::{Friction, StateLaw};
use crate::protocol::Status;
use crate::protocol::shortcut::Case;
use crate::table::STATUS;

/// Tables whose rows have a path over time.
pub const TABLES: [&str; 9] =
    ["optimal", "feedback", "gap", "gap_min", "best_cubic", "shortcut", "step_response", "compliant", "regularised"];

/// The reason for a missing path.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Pathless {
    /// A row of this table describes no protocol, or many.
    #[error("a row of table `{0}` has no path over time\n  expected: a table of {list}", list = TABLES.join(", "))]
    Table(String),
    /// According to its status there is no path.
    #[error("{0}")]
    Status(&'static str),
    /// The row lacks a number that determines the protocol.
    #[error("it has no `{0}`, which the protocol needs")]
    Missing(&'static str),
    /// The response to a step has no end.
    #[error("the response to a step has no duration of its own\n  help: add --t-f T, in the units of the dataset")]
    Duration,
}

/// The name, the protocol and the case of a row of `table` in scaled units. `relative` states which of `alpha_2` and `alpha_3` are relative to
/// the duration; `t_f` is the time span of a step response.
///
/// # Errors
/// If the row has no path.
pub fn protocol_of(
    table: &str,
    row: &Row,
    (friction, bounded, relative): (Friction, bool, [bool; 2]),
    t_f: Option<f64>,
) -> Result<(String, Protocol, Case), Pathless> {
    if !TABLES.contains(&table) {
        return Err(Pathless::Table(table.to_owned()));
    }
    let cell = |name: &str| row.iter().find(|(known, _)| known == name).map(|(_, cell)| cell);
    let word = |name: &str| match cell(name) {
        Some(Cell::Word(word)) => Some(word.as_str()),
        _ => None,
    };
    if word(STATUS) == Some(Status::NotConverged.name()) {
        return Err(Pathless::Status("its status is not_converged: the solver could not certify its answer"));
    }
    if table == "step_response" && t_f.is_none() {
        return Err(Pathless::Duration);
    }
    let written = |quantity: Quantity| cell(quantity.name()).and_then(Cell::number);
    let number = |quantity: Quantity| {
        let time = written(Quantity::Time);
        let value = match quantity {
            Quantity::Time => time.or(t_f),
            Quantity::Law => word("law").and_then(StateLaw::find).map(|law| f64::from(law as u8)),
            _ => written(quantity),
        };
        // Tables of earlier versions lack some axes.
        value.or(quantity.default().first().copied())
    };
    let name = match table {
        "gap_min" => "gap",
        "shortcut" => word("family").ok_or(Pathless::Missing("family"))?,
        name => name,
    };
    let (protocol, case) = Protocol::new(name, (friction, bounded, relative), number)
        .map_err(|quantity| Pathless::Missing(quantity.name()))?;
    let name = match protocol {
        Protocol::OptimalFrom { .. } => "optimal",
        Protocol::Family(family) => family.name,
        _ => name,
    };
    Ok((name.to_owned(), protocol, case))
}
