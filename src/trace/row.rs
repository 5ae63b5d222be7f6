//! The protocol of a row of a dataset.

use super::Protocol;
use crate::dataset::{Cell, Row};
use crate::grid::{Point, Quantity};
use crate::model::Friction;
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

/// The axes of a row. An axis that it lacks, as in a table of an earlier version, has its default, or is NaN.
pub fn point_of(row: &Row) -> Point {
    let mut point = Point::default();
    for quantity in Quantity::ALL {
        let cell = row.iter().find(|(name, _)| name == quantity.name()).map(|(_, cell)| cell);
        let place = |word: &str| quantity.words().iter().position(|known| *known == word).map(|place| place as f64);
        let written = match cell {
            Some(Cell::Number(number)) => Some(*number),
            Some(Cell::Word(word)) => place(word),
            _ => None,
        };
        point[quantity] = written.or(quantity.default().first().copied()).unwrap_or(f64::NAN);
    }
    point
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
    let word = |name: &str| match row.iter().find(|(known, _)| known == name) {
        Some((_, Cell::Word(word))) => Some(word.as_str()),
        _ => None,
    };
    if word(STATUS) == Some(Status::NotConverged.name()) {
        return Err(Pathless::Status("its status is not_converged: the solver could not certify its answer"));
    }
    if table == "step_response" && t_f.is_none() {
        return Err(Pathless::Duration);
    }
    let point = point_of(row);
    let number = |quantity: Quantity| {
        let written = Some(point[quantity]).filter(|number| !number.is_nan());
        written.or(t_f.filter(|_| quantity == Quantity::Time))
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
