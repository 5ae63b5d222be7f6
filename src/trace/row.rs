//! The protocol of a row of a dataset.

use super::Protocol;
use crate::dataset::{Cell, Row};
use crate::grid::Quantity;
use crate::model::{Law, Transition};
use crate::protocol::Status;
use crate::protocol::optimal::Bounds;
use crate::protocol::shortcut::{self, Case};
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
    (bounded, relative): (bool, [bool; 2]),
    t_f: Option<f64>,
) -> Result<(String, Protocol, Case), Pathless> {
    if !TABLES.contains(&table) {
        return Err(Pathless::Table(table.to_owned()));
    }
    let word = |name: &str| match row.iter().find(|(known, _)| known == name) {
        Some((_, Cell::Word(word))) => Some(word.as_str()),
        _ => None,
    };
    match word(STATUS) {
        Some(status) if status == Status::Infeasible.name() => {
            return Err(Pathless::Status("its status is infeasible: there is no such protocol"));
        }
        Some(status) if status == Status::NotConverged.name() => {
            return Err(Pathless::Status("its status is not_converged: the solver could not certify its answer"));
        }
        _ => {}
    }
    let number = |quantity: Quantity| match row.iter().find(|(known, _)| known == quantity.name()) {
        Some((_, Cell::Number(number))) => Ok(*number),
        _ => Err(Pathless::Missing(quantity.name())),
    };
    let transition = Transition {
        law: Law { a: number(Quantity::A)?, b: number(Quantity::B)? },
        v_i: if table == "feedback" { 1.0 / number(Quantity::Theta)? } else { number(Quantity::InitialVelocity)? },
        v_f: number(Quantity::FinalVelocity)?,
    };
    let t_f = match table {
        "step_response" => t_f.ok_or(Pathless::Duration)?,
        "feedback" => number(Quantity::TimeLeft)?,
        _ => number(Quantity::Time)?,
    };
    let family = word("family").and_then(shortcut::find);
    let tau_ceiling = number(Quantity::FrictionCeiling).unwrap_or(f64::INFINITY);
    let case = Case { transition, t_f, tau_ceiling };
    let [k, m] = [Quantity::Stiffness, Quantity::Mass].map(number);
    let protocol = match (table, family) {
        ("optimal", _) => Protocol::Optimal {
            bounds: Bounds {
                floor: bounded,
                // Tables of earlier versions have no such axis.
                v_ceiling: number(Quantity::VelocityCeiling).unwrap_or(f64::INFINITY),
                tau_ceiling,
            },
        },
        ("feedback", _) => Protocol::OptimalFrom {
            theta: number(Quantity::Theta)?,
            bounds: Bounds {
                floor: bounded,
                v_ceiling: number(Quantity::VelocityCeiling)?,
                tau_ceiling: number(Quantity::FrictionCeiling)?,
            },
        },
        ("best_cubic", _) => Protocol::BestCubic { bounded },
        ("gap" | "gap_min", _) => {
            let scaled =
                |alpha: Quantity, unit: f64, relative: bool| Ok(number(alpha)? * if relative { 1.0 } else { unit });
            Protocol::CubicPoint {
                a_2: scaled(Quantity::Alpha2, t_f, relative[0])?,
                a_3: scaled(Quantity::Alpha3, t_f * t_f, relative[1])?,
            }
        }
        ("step_response", _) => Protocol::step_response(k?, m?, transition.v_i != transition.v_f),
        ("compliant", _) => Protocol::Compliant { k: k?, m: m? },
        ("regularised", _) => Protocol::Regularised { k: k?, m: m?, delta_t: number(Quantity::Smoothing)?, bounded },
        (_, Some(family)) => Protocol::Family(family),
        _ => return Err(Pathless::Missing("family")),
    };
    let name = match protocol {
        Protocol::CubicPoint { .. } => "gap",
        Protocol::OptimalFrom { .. } => "optimal",
        Protocol::Family(family) => family.name(),
        _ => table,
    };
    Ok((name.to_owned(), protocol, case))
}
