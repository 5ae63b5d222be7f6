//! A row computed again by its own table, alone: a changed number, word or null of any column differs from it. Whether the table itself is right is
//! the question of the other checks.

use super::{CheckedRow, reduced};
use crate::dataset::{Layout, Row, batch, first_row};
use crate::grid::{Quantity, Scale};
use crate::sweep::{Direct, Spec, Sweep};
use crate::table::{ColumnBuffer, Kind, OptimumCache, Signal, Table};

/// A row of `table` as it was `written`, or of its reduction with the word `reduced`, computed again.
///
/// # Errors
///
/// The reason why it cannot be.
pub fn again(
    written: &CheckedRow<'_>,
    table: &'static Table,
    reduced: Option<&str>,
    spec: &Spec,
) -> Result<Row, &'static str> {
    let alone = match reduced {
        Some(word) => reduced::alone(written, spec, Some(word)).ok_or("its shortcuts are in a points file")?,
        None => alone(written, table, spec).ok_or("its units or axes are not those of a row alone")?,
    };
    row(&alone, 0).ok_or("it could not be computed again")
}

/// A row of the only table of a sweep.
pub fn row(sweep: &Sweep, number: u64) -> Option<Row> {
    let request = &sweep.requests[0];
    // Nothing else has the signal, so nothing stops the computation.
    let (signal, optima) = (Signal::default(), OptimumCache::new(0, 0));
    let mut buffer = ColumnBuffer::new(request.projection.indices().len());
    buffer.resize(1);
    let rows = number..number + 1;
    request.table.compute(&sweep.job(request, &optima, &signal), rows.clone(), &mut buffer).ok()?;
    let layout = Layout::new(request.table, &request.projection, &sweep.grid);
    let batch = batch(&layout, &request.row_index, rows, buffer).ok()?;
    let names = layout.schema.fields().iter().map(|field| field.name().clone());
    Some(names.zip(first_row(&batch)).collect())
}

/// The sweep of a row alone, in the units in which it was written; `None` if its coefficients have units that a table over values in memory lacks.
fn alone(written: &CheckedRow<'_>, table: &'static Table, spec: &Spec) -> Option<Sweep> {
    let is_quantity = |kind: Kind| matches!(kind, Kind::Quantity(_));
    let scale = match written.context.relative {
        [true, true] => Scale::Duration,
        [false, false] if !table.columns().iter().any(|column| is_quantity(column.kind)) => Scale::Model,
        _ => return None,
    };
    let value = |&axis: &Quantity| {
        // With the axis of ceilings the table is that of all laws, also without a ceiling.
        let is_law = axis == Quantity::Law && written.cell("v_ceiling").is_some();
        (is_law || written.cell(axis.name()).is_some()).then(|| (axis, vec![written.point[axis]]))
    };
    let direct = Direct {
        table,
        points: table.axes().iter().filter_map(value).collect(),
        grid: Vec::new(),
        scale,
        model: spec.model.clone(),
        rtol: Some(written.context.rtol),
        columns: spec.tables.get(table.name()).and_then(|table| table.columns.as_deref()),
    };
    Sweep::direct(direct).ok()
}
