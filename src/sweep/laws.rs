//! What the evolution laws of the state demand of a spec: tables that know them, and bounds without which they have no optimum.

use super::error::{SpecError, refuse};
use crate::grid::{Block, Quantity};
use crate::model::StateLaw;
use crate::table::Table;

/// Checks that `table`, at `key` of a spec, knows every law of `block`, and that the block has the bounds that these laws need. Keys of the block
/// begin with `prefix`.
///
/// # Errors
///
/// The first law that the table does not support, or the first bound that is missing or unknown.
pub fn check(key: &str, table: &Table, block: &Block, prefix: &str, is_bounded: bool) -> Result<(), SpecError> {
    check_interpolated(key, table, block, prefix)?;
    let Some(axis) = block.axis(Quantity::Law) else { return Ok(()) };
    let mut laws = (0..axis.values.len()).filter_map(|step| StateLaw::ALL.get(axis.values.at(step) as usize));
    let Some(law) = laws.find(|law| **law != StateLaw::Ageing) else { return Ok(()) };
    let (name, law) = (table.name(), law.name());
    if !table.axes().contains(&Quantity::Law) {
        let found = format!("`{name}` does not support the law \"{law}\" of {prefix}axes.law");
        return refuse(key, found, "law = \"ageing\"", "remove the table, or move it to a spec of its own");
    }
    // Without an optimum no law needs bounds.
    if !table.axes().contains(&Quantity::VelocityCeiling) {
        return Ok(());
    }
    if !is_bounded {
        let found = format!("`{name}` has no optimum without a velocity floor for the law \"{law}\"");
        return refuse(
            "model.velocity_bound",
            found,
            "true",
            "remove the key, or compute the law in a spec of its own",
        );
    }
    if has_with_law(block, Quantity::VelocityCeiling, f64::is_infinite) {
        let found = format!(
            "`{name}` has no optimum without a velocity ceiling for the law \"{law}\": faster is always better"
        );
        let help = format!("add a finite {prefix}axes.v_ceiling, such as `v_ceiling = 1000.0`");
        return refuse(key, found, "a finite v_ceiling, at least v_i and v_f", help);
    }
    if has_with_law(block, Quantity::FrictionCeiling, f64::is_finite) {
        let found = format!("`{name}` supports no friction ceiling for the law \"{law}\"");
        return refuse(key, found, "tau_ceiling = inf", "remove tau_ceiling, or compute the law in a spec of its own");
    }
    Ok(())
}

/// Checks that `table` knows the interpolated law if `block` names it, and that the block names no other law.
fn check_interpolated(key: &str, table: &Table, block: &Block, prefix: &str) -> Result<(), SpecError> {
    let is_named = |quantity: Quantity| block.scale(quantity).is_some();
    if !is_named(Quantity::LawEps) {
        return Ok(());
    }
    if is_named(Quantity::Law) {
        let found = format!("{prefix}axes.law and {prefix}axes.law_eps both name the evolution law");
        return refuse(key, found, "one of the two axes", "remove one of them, or compute it in a spec of its own");
    }
    if !table.axes().contains(&Quantity::LawEps) {
        let found = format!("`{}` does not support the interpolated law of {prefix}axes.law_eps", table.name());
        return refuse(key, found, "no axis law_eps", "remove the table, or move it to a spec of its own");
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
