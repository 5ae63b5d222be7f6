//! What an evolution law of the state, and the form of friction, demand of a spec: tables that know them, and bounds without which they have no
//! optimum.

use super::error::{SpecError, refuse, unknown};
use super::spec::ModelSpec;
use crate::grid::{Block, Quantity};
use crate::model::{Friction, StateLaw};
use crate::table::Table;

/// The tables with regularised friction, and the columns that they lack.
const REGULARISED: [(&str, &[&str]); 3] = [
    ("gap", &["work_error", "gap_error"]),
    ("optimal", &["work_error", "v_ceiling_least", "tau_ceiling_least"]),
    ("stability", &["hopf_type", "first_lyapunov_coefficient", "slip_fraction_smooth", "law_eps_smooth"]),
];

/// The form of friction of `model`.
///
/// # Errors
///
/// An unknown word.
pub fn friction(model: &ModelSpec) -> Result<Friction, SpecError> {
    let names = Friction::ALL.map(Friction::name);
    Friction::find(&model.friction)
        .ok_or_else(|| unknown("model.friction".to_owned(), "form of friction", &model.friction, &names))
}

/// The fault of a table at `key` that does not support something.
fn unsupported(key: &str, table: &Table, what: &str, expected: &str) -> Result<(), SpecError> {
    let found = format!("`{}` does not support {what}", table.name());
    refuse(key, found, expected, "change this, or move the table to a spec of its own")
}

/// Checks that `table`, at `key` of a spec, and its requested `columns` exist with regularised friction, for the axes of `block`.
///
/// # Errors
///
/// A table, a column or a value of an axis that regularised friction does not support.
pub fn check_regularised(key: &str, table: &Table, columns: Option<&[String]>, block: &Block) -> Result<(), SpecError> {
    let Some((_, lacking)) = REGULARISED.iter().find(|(known, _)| *known == table.name()) else {
        let expected = format!("one of {}", REGULARISED.map(|(name, _)| name).join(", "));
        return unsupported(key, table, "regularised friction", &expected);
    };
    if let Some(column) = columns.into_iter().flatten().find(|column| lacking.contains(&column.as_str())) {
        let what = format!("the column `{column}` with regularised friction");
        return unsupported(&format!("{key}.columns"), table, &what, "the other columns");
    }
    for (quantity, only, expected) in [
        (Quantity::Law, 0.0, "law = \"ageing\""),
        (Quantity::VelocityCeiling, f64::INFINITY, "v_ceiling = inf"),
        (Quantity::FrictionCeiling, f64::INFINITY, "tau_ceiling = inf"),
    ] {
        if table.axes().contains(&quantity) && block.may_be(quantity, |value| value != only) {
            return unsupported(
                key,
                table,
                &format!("another {} with regularised friction", quantity.name()),
                expected,
            );
        }
    }
    Ok(())
}

/// Checks that `table`, at `key` of a spec, knows every law of `block`, and that the block has the bounds that these laws need.
///
/// # Errors
///
/// The first law that the table does not support, or the first bound that is missing or unknown.
pub fn check(key: &str, table: &Table, block: &Block, is_bounded: bool) -> Result<(), SpecError> {
    if block.scale(Quantity::LawEps).is_some() {
        if !table.axes().contains(&Quantity::LawEps) {
            return unsupported(key, table, "the interpolated law", "no axis law_eps");
        }
        if block.scale(Quantity::Law).is_some() {
            return unsupported(key, table, "two evolution laws", "one of the axes law and law_eps");
        }
    }
    let Some(axis) = block.axis(Quantity::Law) else { return Ok(()) };
    let mut laws = (0..axis.values.len()).filter_map(|step| StateLaw::ALL.get(axis.values.at(step) as usize));
    let Some(law) = laws.find(|law| **law != StateLaw::Ageing) else { return Ok(()) };
    let law = format!("the law \"{}\"", law.name());
    if !table.axes().contains(&Quantity::Law) {
        return unsupported(key, table, &law, "law = \"ageing\"");
    }
    // Without an optimum no law needs bounds.
    if !table.axes().contains(&Quantity::VelocityCeiling) {
        return Ok(());
    }
    if !is_bounded {
        return unsupported(key, table, &format!("{law} without a velocity floor"), "model.velocity_bound = true");
    }
    if has_with_law(block, Quantity::VelocityCeiling, f64::is_infinite) {
        let what = format!("{law} without a velocity ceiling: faster is always better");
        return unsupported(key, table, &what, "a finite v_ceiling above v_i and v_f, such as { expr = \"10 * v_f\" }");
    }
    if has_with_law(block, Quantity::FrictionCeiling, f64::is_finite) {
        return unsupported(key, table, &format!("a friction ceiling for {law}"), "tau_ceiling = inf");
    }
    Ok(())
}

/// Whether some point of a law other than ageing has a value of `quantity` that meets `is_wrong`. Values that are computed, and the condition of the
/// block, are left to the rows.
fn has_with_law(block: &Block, quantity: Quantity, is_wrong: fn(f64) -> bool) -> bool {
    let Some(axis) = block.axis(quantity) else { return false };
    let together =
        block.factors.iter().find(|factor| factor.holds_any(&[Quantity::Law]) && factor.holds_any(&[quantity]));
    if let (Some(factor), Some(law)) = (together, block.axis(Quantity::Law)) {
        return (0..factor.len()).any(|step| law.values.at(step) != 0.0 && is_wrong(axis.values.at(step)));
    }
    block.may_be(quantity, is_wrong)
}
