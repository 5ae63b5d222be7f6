//! `gap_min`, `gap_quantiles`, `gap_histogram`: the landscape of the row, of which some shortcuts are solved by the route that checks `gap`.

use std::path::Path;

use indexmap::IndexMap;

use super::{Checked, CheckedRow, Context, again, scale, shortcut};
use crate::grid::{Quantity, Scale};
use crate::model::Units;
use crate::sweep::{AxisSpec, AxisValue, BlockSpec, Spec, Sweep, TableSpec};
use crate::table::OPTIMUM_AXES;

/// Number of shortcuts of a landscape that are solved by an independent route. Chosen: a check takes milliseconds.
const CHECKED_SHORTCUTS: u64 = 3;

/// The axes of a landscape.
const COEFFICIENTS: [Quantity; 2] = [Quantity::Alpha2, Quantity::Alpha3];

/// Checks shortcuts of the landscape of a row as it was written, in `units`.
pub fn check(written: &mut CheckedRow<'_>, units: &Units, spec: &Spec) -> Checked {
    let landscape = alone(written, spec, None).ok_or("its shortcuts are in a points file")?;
    let gap = &landscape.requests[0];
    let relative = COEFFICIENTS.map(|alpha| landscape.grid.scale(alpha) != Some(Scale::Model));
    let context = Context { relative, ..written.context };
    for part in 0..CHECKED_SHORTCUTS {
        // The middle of one of equal parts of the landscape.
        let row = ((2 * part + 1) as f64 / (2 * CHECKED_SHORTCUTS) as f64 * gap.rows as f64) as u64;
        if let Some(mut member) = again::row(&landscape, row) {
            scale(&mut member, gap.table, units, relative);
            written.extend(CheckedRow::new(&member, context, shortcut::gap));
        }
    }
    Ok(())
}

/// The sweep of a row alone, reduced or not: its transition and time, and the coefficients of the sweep.
pub fn alone(written: &CheckedRow<'_>, spec: &Spec, reduce: Option<&str>) -> Option<Sweep> {
    let mut blocks = spec.blocks();
    let (Some((_, block)), None) = (blocks.next(), blocks.next()) else { return None };
    let mut axes = IndexMap::new();
    for axis in OPTIMUM_AXES {
        let value = AxisValue::Number(written.number(axis.name())?);
        axes.insert(axis.name().to_owned(), AxisSpec::One(value));
    }
    let axes_of_block = block.axes.clone().into_iter();
    axes.extend(axes_of_block.filter(|(name, _)| COEFFICIENTS.iter().any(|alpha| alpha.name() == name)));
    let rtol = spec.tables.get("gap").and_then(|table| table.rtol);
    let gap = TableSpec { rtol, reduce: reduce.map(str::to_owned), ..TableSpec::default() };
    let alone = Spec {
        top: BlockSpec { axes, ..BlockSpec::default() },
        tables: [("gap".to_owned(), gap)].into_iter().collect(),
        block: Vec::new(),
        ..spec.clone()
    };
    Sweep::check(&alone, "", Path::new("")).ok()
}
