//! A row of a dataset in the units of the model, in which it is checked.

use crate::dataset::{Cell, Row};
use crate::grid::{Quantity, Scale};
use crate::model::Units;
use crate::table::{Kind, Table};

/// Converts a row of `table` to the units of the model; `relative` determines which of `alpha_2`, `alpha_3` are given relative to the duration.
pub fn scale(row: &mut Row, table: &Table, units: &Units, relative: [bool; 2]) {
    let unit = |quantity: Quantity| match quantity {
        Quantity::Alpha2 if relative[0] => quantity.unit(Scale::Duration),
        Quantity::Alpha3 if relative[1] => quantity.unit(Scale::Duration),
        _ => quantity.unit(Scale::Model),
    };
    let unit_of = |name: &str| {
        let axis = Quantity::from_name(name).map(unit);
        axis.or_else(|| match table.columns().iter().find(|column| column.name == name)?.kind {
            Kind::Number(unit) => Some(unit),
            _ => None,
        })
    };
    // Only one family has a parameter with a dimension.
    let is_rate = row.iter().any(|(name, cell)| name == "family" && *cell == Cell::Word("bounded_velocity".to_owned()));
    for (name, cell) in row {
        let Cell::Number(value) = cell else { continue };
        if let Some(unit) = unit_of(name) {
            *value = units.scaled(unit, *value);
        }
        if is_rate && name == "alpha" {
            *value /= units.size("v_0/l") * units.size("v_0/l");
        }
    }
}
