//! `gap_min`, `gap_quantiles`, `gap_histogram`: the landscape of the row, computed and reduced again; some of its shortcuts are solved by the route
//! that checks `gap`.

use std::path::Path;

use indexmap::IndexMap;

use super::{Checked, CheckedRow, Context, scale, shortcut};
use crate::dataset::{Cell, Row};
use crate::grid::{Quantity, Scale};
use crate::model::Units;
use crate::sweep::{AxisSpec, AxisValue, BlockSpec, Request, Spec, Sweep, TableSpec};
use crate::table::{ColumnBuffer, OPTIMUM_AXES, OptimumCache, STATUS, Signal};

/// Number of shortcuts of a landscape that are solved by an independent route. Chosen: a check takes milliseconds.
const CHECKED_SHORTCUTS: u64 = 3;

/// The axes of a landscape.
const COEFFICIENTS: [Quantity; 2] = [Quantity::Alpha2, Quantity::Alpha3];

/// Checks a row as it was written, in `units`, of the table of the reduction `word`.
pub fn check(written: &mut CheckedRow<'_>, word: &str, units: &Units, spec: &Spec) -> Checked {
    let again = |reduce| alone(written, spec, reduce).ok_or("its shortcuts are in a points file");
    let (reduced, landscape) = (again(Some(word))?, again(None)?);
    let [request, gap] = [&reduced, &landscape].map(|sweep| &sweep.requests[0]);
    // Nothing else has the signal, so nothing stops the computation.
    let (signal, optima) = (Signal::default(), OptimumCache::new(0, 0));
    let row = reduced.rows(request, &signal).map_err(|_| "its landscape does not fit into memory")?;
    written.compare_word(STATUS, row.status[0].name());
    for (name, value) in results(request, &row) {
        let is_count = name == "shortcuts" || request.table.name() == "gap_histogram";
        written.compare_relative(name, (!value.is_nan()).then_some(value), if is_count { 1.0 } else { value.abs() });
    }
    let job = landscape.job(gap, &optima, &signal);
    let relative = COEFFICIENTS.map(|alpha| landscape.grid.scale(alpha) != Some(Scale::Model));
    let context = Context { relative, ..written.context };
    for part in 0..CHECKED_SHORTCUTS {
        // The middle of one of equal parts of the landscape.
        let row = ((2 * part + 1) as f64 / (2 * CHECKED_SHORTCUTS) as f64 * gap.rows as f64) as u64;
        let mut buffer = ColumnBuffer::new(gap.projection.indices().len());
        buffer.resize(1);
        if gap.table.compute(&job, row..row + 1, &mut buffer).is_ok() {
            let mut member = member(gap, row, &buffer);
            scale(&mut member, gap.table, units, relative);
            written.extend(CheckedRow::new(&member, context, shortcut::gap));
        }
    }
    Ok(())
}

/// Names and values of the columns of a row in memory, NaN for a missing one.
fn results(request: &Request, row: &ColumnBuffer) -> impl Iterator<Item = (&'static str, f64)> {
    let columns = request.projection.indices().iter().zip(&row.columns);
    columns.map(|(&index, cells)| (request.table.columns()[index].name, cells[0]))
}

/// The sweep of a row alone, reduced or not: its transition and time, and the coefficients of the sweep.
fn alone(written: &CheckedRow<'_>, spec: &Spec, reduce: Option<&str>) -> Option<Sweep> {
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

/// Row number `row` of the landscape, whose results are in `buffer`, as a row of `gap`.
fn member(gap: &Request, row: u64, buffer: &ColumnBuffer) -> Row {
    let point = gap.row_index.point(row);
    let axes = gap.table.axes().iter().map(|axis| (axis.name(), point[*axis]));
    let cell = |value: f64| if value.is_nan() { Cell::Missing } else { Cell::Number(value) };
    let cells = axes.chain(results(gap, buffer)).map(|(name, value)| (name.to_owned(), cell(value)));
    cells.chain([(STATUS.to_owned(), Cell::Word(buffer.status[0].name().to_owned()))]).collect()
}
