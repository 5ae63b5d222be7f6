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
use crate::table::{ColumnBuffer, OPTIMUM_AXES, STATUS, Signal};

/// Number of shortcuts of a landscape in memory at a time. Chosen: a few megabytes.
const SHORTCUTS_AT_ONCE: usize = 1 << 16;

/// Number of shortcuts of a landscape that are solved by an independent route. Chosen: a check takes milliseconds.
const CHECKED_SHORTCUTS: u64 = 3;

/// Whether `table` is one of these.
pub fn is_reduced(table: &str) -> bool {
    ["gap_min", "gap_quantiles", "gap_histogram"].contains(&table)
}

/// The axes of a landscape.
const COEFFICIENTS: [Quantity; 2] = [Quantity::Alpha2, Quantity::Alpha3];

/// The columns of quantiles, and their percentages.
const QUANTILES: [(&str, u64); 7] = [
    ("gap_min", 0),
    ("gap_q05", 5),
    ("gap_q25", 25),
    ("gap_q50", 50),
    ("gap_q75", 75),
    ("gap_q95", 95),
    ("gap_max", 100),
];

/// The columns of the histogram, and their lower edges.
const CLASSES: [(&str, f64); 11] = [
    ("below_1e_8", f64::NEG_INFINITY),
    ("from_1e_8", 1e-8),
    ("from_1e_7", 1e-7),
    ("from_1e_6", 1e-6),
    ("from_1e_5", 1e-5),
    ("from_1e_4", 1e-4),
    ("from_1e_3", 1e-3),
    ("from_1e_2", 1e-2),
    ("from_1e_1", 1e-1),
    ("from_1", 1.0),
    ("from_10", 10.0),
];

/// The reduction of a landscape.
#[derive(Default)]
struct Reduced {
    status: [u64; Status::ALL.len()],
    /// Number and cells of the first shortcut of least gap.
    least: Option<(u64, Vec<f64>)>,
    /// Numbers of shortcuts with a gap below each quantile, and with exactly that gap.
    quantiles: [[u64; 2]; QUANTILES.len()],
    classes: [u64; CLASSES.len()],
}

/// Checks a row as it was written, in `units`.
pub fn check(written: &mut CheckedRow<'_>, units: &Units, spec: &Spec) -> Checked {
    let sweep = landscape(written, spec).ok_or("its shortcuts are in a points file")?;
    let (stores, signal) = (sweep.optimum_cache(), Signal::default());
    let (Some(request), Some(optima)) = (sweep.requests.first(), stores.first()) else {
        return Err("its spec does not request it");
    };
    let job = sweep.job(request, optima, &signal);
    let relative = COEFFICIENTS.map(|alpha| sweep.grid.scale(alpha) != Some(Scale::Model));
    let context = Context { relative, ..written.context };
    let mut buffer = ColumnBuffer::new(request.projection.indices().len());
    let mut reduced = Reduced::default();
    let cells =
        |buffer: &ColumnBuffer, place: usize| buffer.columns.iter().map(|column| column[place]).collect::<Vec<f64>>();
    let all = request.rows;
    // From the middle of equal parts of the landscape.
    let middle = |part: u64| ((2 * part + 1) as f64 / (2 * CHECKED_SHORTCUTS) as f64 * all as f64) as u64;
    let solved: Vec<u64> = (0..CHECKED_SHORTCUTS).map(middle).collect();
    for start in (0..all).step_by(SHORTCUTS_AT_ONCE) {
        let rows = start..all.min(start + SHORTCUTS_AT_ONCE as u64);
        buffer.resize((rows.end - rows.start) as usize);
        // Nothing else has the signal, so nothing stops the computation.
        if request.table.compute(&job, rows.clone(), &mut buffer).is_err() {
            break;
        }
        for (row, place) in rows.zip(0..) {
            reduced.see(written, row, buffer.status[place], || cells(&buffer, place));
            if solved.contains(&row) {
                let mut member = member(&sweep, row, &cells(&buffer, place), buffer.status[place]);
                scale(&mut member, request.table, units, relative);
                written.extend(CheckedRow::new(&member, context, shortcut::gap));
            }
        }
    }
    let order = [
        Status::NotConverged,
        Status::Ok,
        Status::Unproven,
        Status::NegativeFriction,
        Status::BelowBound,
        Status::Infeasible,
    ];
    let status = order.into_iter().find(|status| reduced.status[*status as usize] > 0);
    written.compare_word(STATUS, status.map_or("", Status::name));
    if status != Some(Status::NotConverged) {
        reduced.compare(written, &sweep);
    }
    Ok(())
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
fn member(sweep: &Sweep, row: u64, cells: &[f64], status: Status) -> Row {
    let request = &sweep.requests[0];
    let point = request.row_index.point(row);
    let axes = request.table.axes().iter().map(|axis| (axis.name().to_owned(), Cell::Number(point[*axis])));
    let columns = request.projection.indices().iter().zip(cells).map(|(&column, &value)| {
        let cell = if value.is_nan() { Cell::Missing } else { Cell::Number(value) };
        (request.table.columns()[column].name.to_owned(), cell)
    });
    axes.chain(columns).chain([(STATUS.to_owned(), Cell::Word(status.name().to_owned()))]).collect()
}

/// The index of `gap` among the columns of the table `gap`.
const GAP: usize = 2;

impl Reduced {
    fn see(&mut self, written: &CheckedRow<'_>, row: u64, status: Status, cells: impl FnOnce() -> Vec<f64>) {
        self.status[status as usize] += 1;
        if status != Status::Ok {
            return;
        }
        let cells = cells();
        let gap = cells[GAP];
        for ((column, _), [below, same]) in QUANTILES.iter().zip(&mut self.quantiles) {
            if let Some(quantile) = written.number(column) {
                *below += u64::from(gap < quantile);
                *same += u64::from(gap == quantile);
            }
        }
        let class = CLASSES.iter().rposition(|(_, from)| gap >= *from).unwrap_or(0);
        self.classes[class] += 1;
        if self.least.as_ref().is_none_or(|(_, least)| gap < least[GAP]) {
            self.least = Some((row, cells));
        }
    }

    /// Compares the written columns of the reduction.
    fn compare(&self, written: &mut CheckedRow<'_>, sweep: &Sweep) {
        let ok = self.status[Status::Ok as usize];
        written.compare_relative("shortcuts", ok as f64, 1.0);
        for ((column, hundredths), [below, same]) in QUANTILES.iter().zip(self.quantiles) {
            if ok > 0 && written.number(column).is_some() {
                // A quantile is the least gap that so many shortcuts do not exceed.
                let enough = 100 * (below + same) >= hundredths * ok;
                let least = below == 0 || 100 * below < hundredths * ok;
                written.push(column, if same > 0 && enough && least { 0.0 } else { f64::INFINITY });
            } else {
                written.demand(column, ok > 0);
            }
        }
        for ((column, _), count) in CLASSES.iter().zip(self.classes) {
            written.compare_relative(column, count as f64, 1.0);
        }
        let request = &sweep.requests[0];
        let point = self.least.as_ref().map(|(row, _)| request.row_index.point(*row));
        for axis in COEFFICIENTS {
            written.compare_relative(axis.name(), point.as_ref().map(|point| point[axis]), 1.0);
        }
        for (place, name) in ["work", "work_optimal", "gap", "v_min"].into_iter().enumerate() {
            written.compare(name, self.least.as_ref().map(|(_, cells)| cells[place]));
        }
    }
}
