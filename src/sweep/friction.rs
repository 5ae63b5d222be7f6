//! `[model] friction`: what regularised friction demands of a spec.

use super::error::{SpecError, refuse};
use super::spec::ModelSpec;
use crate::grid::{Block, Quantity};
use crate::model::Friction;
use crate::names::nearest;
use crate::table::Table;

/// The tables with regularised friction, and the columns that they lack.
const REGULARISED: [(&str, &[&str]); 3] = [
    ("gap", &["work_error", "gap_error"]),
    ("optimal", &["work_error", "v_ceiling_least", "tau_ceiling_least"]),
    ("stability", &["hopf_type", "first_lyapunov_coefficient", "slip_fraction_smooth", "law_eps_smooth"]),
];

/// The axes whose values regularised friction restricts, and the only value.
const RESTRICTED: [(Quantity, f64, &str); 3] = [
    (Quantity::Law, 0.0, "law = \"ageing\""),
    (Quantity::VelocityCeiling, f64::INFINITY, "v_ceiling = inf"),
    (Quantity::FrictionCeiling, f64::INFINITY, "tau_ceiling = inf"),
];

/// The form of friction of `model`.
///
/// # Errors
///
/// An unknown word.
pub fn friction(model: &ModelSpec) -> Result<Friction, SpecError> {
    Friction::find(&model.friction).ok_or_else(|| {
        let names = Friction::ALL.map(Friction::name);
        let help = nearest(&model.friction, names)
            .map_or_else(|| "remove the line".to_owned(), |name| format!("did you mean \"{name}\"?"));
        let found = format!("unknown form of friction {:?}", model.friction);
        SpecError::new("model.friction", found, "\"log\" or \"regularised\"", help)
    })
}

/// Checks that `table`, at `key` of a spec, and its requested `columns` exist with `friction`, for the axes of `block`.
///
/// # Errors
///
/// A table, a column or a value of an axis that regularised friction does not support.
pub fn check(
    key: &str,
    table: &Table,
    columns: Option<&[String]>,
    block: &Block,
    friction: Friction,
) -> Result<(), SpecError> {
    if friction == Friction::Log {
        return Ok(());
    }
    let name = table.name();
    let Some((_, lacking)) = REGULARISED.iter().find(|(known, _)| *known == name) else {
        let expected = format!("one of {}", REGULARISED.map(|(name, _)| name).join(", "));
        let found = format!("`{name}` does not support regularised friction");
        return refuse(key, found, expected, "remove the table, or move it to a spec of its own");
    };
    if let Some(column) = columns.into_iter().flatten().find(|column| lacking.contains(&column.as_str())) {
        let found = format!("`{name}` has no column `{column}` with regularised friction");
        return refuse(format!("{key}.columns"), found, "the other columns", format!("remove \"{column}\""));
    }
    for (quantity, only, expected) in RESTRICTED.into_iter().filter(|(quantity, ..)| table.axes().contains(quantity)) {
        if block.may_be(quantity, |value| value != only) {
            let found = format!("`{name}` supports no other {} with regularised friction", quantity.name());
            return refuse(key, found, expected, format!("remove the axis {}", quantity.name()));
        }
    }
    Ok(())
}
