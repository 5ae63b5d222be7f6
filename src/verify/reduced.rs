//! `gap_min`, `gap_quantiles`, `gap_histogram`: the landscape of the row, computed and reduced independently; some of its shortcuts
//! are solved by the route that checks `gap`.

use std::path::Path;

use indexmap::IndexMap;

use super::{Checked, CheckedRow, Context, scale, shortcut};
use crate::dataset::{Cell, Row};
use crate::grid::{Quantity, Scale};
use crate::model::Units;
use crate::protocol::Status;
use crate::sweep::{AxisSpec, AxisValue, BlockSpec, Spec, Sweep, TableSpec};
use crate::table::{BLOCK_ROWS, ColumnBuffer, HISTOGRAM_EDGES, OPTIMUM_AXES, STATUS, Signal, Table};

/// Number of shortcuts of a landscape that are solved by an independent route. Chosen: a check takes milliseconds.
const CHECKED_SHORTCUTS: u64 = 3;

/// The axes of a landscape.
const COEFFICIENTS: [Quantity; 2] = [Quantity::Alpha2, Quantity::Alpha3];

/// Checks a row of `table` as it was written, in `units`.
pub fn check(written: &mut CheckedRow<'_>, table: &Table, units: &Units, spec: &Spec) -> Checked {
    let sweep = landscape(written, spec).ok_or("its shortcuts are in a points file")?;
    let (stores, signal) = (sweep.optimum_cache(), Signal::default());
    let (Some(request), Some(optima)) = (sweep.requests.first(), stores.first()) else {
        return Err("its spec does not request it");
    };
    let job = sweep.job(request, optima, &signal);
    let relative = COEFFICIENTS.map(|alpha| sweep.grid.scale(alpha) != Some(Scale::Model));
    let context = Context { relative, ..written.context };
    let columns = request.projection.indices().iter().map(|&index| request.table.columns()[index].name);
    let columns: Vec<&str> = columns.collect();
    let gap = columns.iter().position(|column| *column == "gap").ok_or("its spec does not request it")?;
    let all = request.rows;
    // From the middle of equal parts of the landscape.
    let middle = |part: u64| ((2 * part + 1) as f64 / (2 * CHECKED_SHORTCUTS) as f64 * all as f64) as u64;
    let solved: Vec<u64> = (0..CHECKED_SHORTCUTS).map(middle).collect();
    let mut buffer = ColumnBuffer::new(columns.len());
    let mut reduction = Reduction::default();
    for start in (0..all).step_by(BLOCK_ROWS) {
        let rows = start..all.min(start + BLOCK_ROWS as u64);
        buffer.resize((rows.end - rows.start) as usize);
        // Nothing else has the signal, so nothing stops the computation.
        if request.table.compute(&job, rows.clone(), &mut buffer).is_err() {
            break;
        }
        for (row, place) in rows.zip(0..) {
            let status = buffer.status[place];
            let cells = || buffer.columns.iter().map(|column| column[place]).collect::<Vec<f64>>();
            reduction.add(row, status, gap, cells);
            if solved.contains(&row) {
                let mut member = member(&sweep, row, &columns, &cells(), status);
                scale(&mut member, request.table, units, relative);
                written.extend(CheckedRow::new(&member, context, shortcut::gap));
            }
        }
    }
    reduction.gaps.sort_unstable_by(f64::total_cmp);
    let status = reduction.status();
    written.compare_word(STATUS, status.map_or("", Status::name));
    if status != Some(Status::NotConverged) {
        let point = reduction.least.as_ref().map(|(row, _)| request.row_index.point(*row));
        reduction.compare(written, table, &columns, point.map(|point| COEFFICIENTS.map(|alpha| point[alpha])));
    }
    Ok(())
}

/// The shortcuts of a landscape, reduced.
#[derive(Default)]
struct Reduction {
    /// Shortcuts by status.
    statuses: [u64; Status::ALL.len()],
    /// The gaps of those that are `ok`.
    gaps: Vec<f64>,
    /// Row and cells of the first of least gap.
    least: Option<(u64, Vec<f64>)>,
}

impl Reduction {
    /// Adds a shortcut, whose gap is cell number `gap`.
    fn add(&mut self, row: u64, status: Status, gap: usize, cells: impl Fn() -> Vec<f64>) {
        self.statuses[status as usize] += 1;
        if status == Status::Ok {
            let cells = cells();
            self.gaps.push(cells[gap]);
            if self.least.as_ref().is_none_or(|(_, least)| cells[gap] < least[gap]) {
                self.least = Some((row, cells));
            }
        }
    }

    /// The status of the row: the first of these that a shortcut has.
    fn status(&self) -> Option<Status> {
        use Status::{BelowBound, Infeasible, NegativeFriction, NotConverged, Ok, Unproven};
        let order = [NotConverged, Ok, Unproven, NegativeFriction, BelowBound, Infeasible];
        order.into_iter().find(|status| self.statuses[*status as usize] > 0)
    }

    /// Compares the columns of the row, with the gaps in order. `columns` are those of the cells; the shortcut of least gap has the `coefficients`.
    fn compare(&self, written: &mut CheckedRow<'_>, table: &Table, columns: &[&str], coefficients: Option<[f64; 2]>) {
        let Reduction { gaps, least, .. } = self;
        let (mut edges, mut below) = (HISTOGRAM_EDGES.iter(), 0);
        for column in table.columns().iter().map(|column| column.name) {
            let place = columns.iter().position(|known| *known == column);
            match (column, percentage(column)) {
                ("shortcuts", _) => written.compare_relative(column, gaps.len() as f64, 1.0),
                ("alpha_2", _) => written.compare_relative(column, coefficients.map(|[alpha_2, _]| alpha_2), 1.0),
                ("alpha_3", _) => written.compare_relative(column, coefficients.map(|[_, alpha_3]| alpha_3), 1.0),
                (_, Some(percentage)) => {
                    // The least gap that so many shortcuts do not exceed.
                    let rank = (percentage * gaps.len()).div_ceil(100).max(1);
                    written.compare(column, gaps.get(rank - 1).copied());
                }
                _ if place.is_some() => {
                    written.compare(column, place.and_then(|place| least.as_ref().map(|(_, cells)| cells[place])));
                }
                // The classes of the histogram come in order.
                _ => {
                    let next = edges.next().map_or(gaps.len(), |edge| gaps.partition_point(|gap| gap < edge));
                    written.compare_relative(column, (next - below) as f64, 1.0);
                    below = next;
                }
            }
        }
    }
}

/// The percentage of a column of quantiles.
fn percentage(column: &str) -> Option<usize> {
    match column {
        "gap_min" => Some(0),
        "gap_max" => Some(100),
        _ => column.strip_prefix("gap_q")?.parse().ok(),
    }
}

/// The landscape of a row alone: its transition and time, and the coefficients of the sweep.
fn landscape(written: &CheckedRow<'_>, spec: &Spec) -> Option<Sweep> {
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
    let gap = TableSpec { rtol, ..TableSpec::default() };
    let alone = Spec {
        top: BlockSpec { axes, ..BlockSpec::default() },
        tables: [("gap".to_owned(), gap)].into_iter().collect(),
        block: Vec::new(),
        ..spec.clone()
    };
    Sweep::check(&alone, "", Path::new("")).ok()
}

/// Row number `row` of the landscape as a row of `gap`.
fn member(sweep: &Sweep, row: u64, columns: &[&str], cells: &[f64], status: Status) -> Row {
    let request = &sweep.requests[0];
    let point = request.row_index.point(row);
    let axes = request.table.axes().iter().map(|axis| (axis.name(), point[*axis]));
    let numbers = axes.chain(columns.iter().copied().zip(cells.iter().copied()));
    let cell = |value: f64| if value.is_nan() { Cell::Missing } else { Cell::Number(value) };
    let cells = numbers.map(|(name, value)| (name.to_owned(), cell(value)));
    cells.chain([(STATUS.to_owned(), Cell::Word(status.name().to_owned()))]).collect()
}
