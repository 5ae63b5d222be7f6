//! Audit of a dataset: a sample of its rows is computed again, and checked by the equations that their protocols obey, or solved by a second route.

mod again;
mod checked_row;
mod crossover;
mod feedback;
mod hopf;
mod motion;
mod open_loop;
mod optimal;
mod reduced;
mod relaxed;
mod route;
mod sample;
mod shortcut;
mod stability;
mod step_response;
mod task;
mod units;

use std::collections::BTreeSet;
use std::path::Path;

use indexmap::IndexMap;

use crate::dataset::{Folder, Manifest, ManifestTable, Row, frame};
use crate::model::{Friction, Units};
use crate::sweep::{self, Spec};
use crate::table::{self, Table};
use again::again;
use checked_row::{Checked, CheckedRow, Context, Difference};
use sample::Sample;
pub(crate) use units::scale;

/// Difference above which a number is an error, in units of `rtol`. Chosen: room for the errors of the second route.
pub const MAX_DIFFERENCE_RTOLS: f64 = 10.0;

/// The audit of one table.
#[derive(Debug)]
pub struct Audit {
    /// Its name.
    pub table: String,
    /// The `rtol` of the table.
    pub rtol: f64,
    /// Whether the shown rows are dimensionless, unlike those of the dataset.
    pub is_converted: bool,
    /// Rows of the sample.
    pub rows: usize,
    /// Numbers beyond [`MAX_DIFFERENCE_RTOLS`].
    pub errors: usize,
    /// For each column the row with the greatest difference, worst first.
    pub worst: Vec<Worst>,
    /// Rows that were not checked, or not in full, by reason.
    pub unchecked: IndexMap<(&'static str, Extent), u64>,
    /// What is wrong with a part that cannot be read; its rows are not checked.
    pub fault: Option<String>,
}

/// How much of a row was not checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Extent {
    /// All of its numbers.
    Whole,
    /// Some of its numbers.
    Part,
}

/// The greatest difference in a column.
#[derive(Debug)]
pub struct Worst {
    /// The column.
    pub column: &'static str,
    /// In units of rtol.
    pub difference: f64,
    /// The value of the independent route.
    pub expected: String,
    /// Number of the row.
    pub number: u64,
    /// Its cells.
    pub row: Row,
}

/// The error of an audit.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct VerifyError(String);

/// Audits `sample` rows of every table of the dataset in `path`.
///
/// # Errors
///
/// A manifest without a valid spec, or no row of the sample that is computed yet.
pub fn verify(path: &Path, manifest: &Manifest, sample: u64, seed: u64) -> Result<Vec<Audit>, VerifyError> {
    let refused = |error: &dyn std::error::Error| VerifyError(error.to_string());
    let spec = Spec::parse(&manifest.spec)
        .map_err(|error| VerifyError(format!("the spec in the manifest cannot be read: {error}")))?;
    let units = sweep::units(&spec.model).map_err(|error| refused(&error))?;
    let friction = sweep::friction(&spec.model).map_err(|error| refused(&error))?;
    let bounded = spec.model.velocity_bound && friction == Friction::Log;
    let folder = Folder::at(path);
    let mut audits = Vec::new();
    for table in &manifest.tables {
        let reduced = table::REDUCED.iter().find(|(_, known)| known.name() == table.name).map(|(word, _)| *word);
        let rtol = spec.rtol_of(&table.name);
        let Sample { rows, missing, fault } = sample::rows(&folder, manifest, table, sample, seed);
        let context = Context { bounded, friction, relative: relative(&folder, table), rtol };
        let mut audit = Audit {
            table: table.name.clone(),
            rtol,
            is_converted: reduced.is_none() && units != Units::Scaled,
            rows: rows.len(),
            errors: 0,
            worst: Vec::new(),
            unchecked: IndexMap::new(),
            fault,
        };
        let auditor = Auditor { spec: &spec, units: &units, table: table::find(&table.name), reduced, context };
        for (number, row) in rows {
            auditor.add(&mut audit, number, row);
        }
        audits.push(audit.finished(missing));
    }
    if audits.iter().all(|audit| audit.rows == 0 && audit.fault.is_none() && !audit.unchecked.is_empty()) {
        return Err(VerifyError(
            "no row of the sample is in a part that is there\n  help: raise --sample, or compute the parts with `slipsweep run`".to_owned(),
        ));
    }
    Ok(audits)
}

/// Whether `alpha_2`, `alpha_3` of `table` are given relative to the duration, by the units of its first part.
pub(crate) fn relative(folder: &Folder, table: &ManifestTable) -> [bool; 2] {
    let parts = folder.parts_there(table);
    let headings = parts.iter().find_map(|&part| frame::headings(&folder.part(&table.name, part)).ok());
    let headings = headings.map(|(headings, _)| headings).unwrap_or_default();
    // In any system of units.
    ["alpha_2", "alpha_3"]
        .map(|name| headings.iter().any(|heading| heading.name == name && heading.unit.contains("t_f")))
}

/// Checks the rows of a table of a sweep.
struct Auditor<'a> {
    spec: &'a Spec,
    units: &'a Units,
    table: Option<&'static Table>,
    /// The word of the reduction that writes the table.
    reduced: Option<&'static str>,
    context: Context,
}

/// Why rows of an unknown table are not checked.
const UNKNOWN: &str = "there is no independent route for this table";

impl Auditor<'_> {
    /// Checks a row by equations that do not depend on its table.
    fn check(&self, row: &mut CheckedRow<'_>) -> Checked {
        match self.table.map_or("", Table::name) {
            "gap" => shortcut::gap(row),
            "optimal" => optimal::check(row),
            "feedback" => feedback::check(row),
            "crossover" => crossover::check(row),
            "best_cubic" => shortcut::best_cubic(row),
            "shortcut" => shortcut::shortcut(row),
            "compliant" => shortcut::compliant(row),
            "regularised" => shortcut::regularised(row),
            "step_response" => step_response::check(row),
            "stability" => stability::check(row),
            _ if self.reduced.is_some() => reduced::check(row, self.units, self.spec),
            _ => Err(UNKNOWN),
        }
    }

    /// Adds a row, compared with itself computed again, and checked.
    fn add(&self, audit: &mut Audit, number: u64, mut row: Row) {
        let written = CheckedRow::new(&row, self.context, |_| Ok(()));
        let mut again = self.table.ok_or(UNKNOWN).and_then(|table| again(&written, table, self.reduced, self.spec));
        // Reduced rows are compared as they were written.
        if let Some(table) = self.table.filter(|_| self.reduced.is_none()) {
            let rows = [Some(&mut row), again.as_mut().ok()].into_iter().flatten();
            rows.for_each(|row| scale(row, table, self.units, self.context.relative));
        }
        let mut found = CheckedRow::new(&row, self.context, |row| self.check(row));
        let extent = if found.differences.is_empty() { Extent::Whole } else { Extent::Part };
        match again.and_then(|again| Ok((self.table.ok_or(UNKNOWN)?, again))) {
            Ok((table, again)) => found.compare_again(table, &again),
            Err(reason) => found.miss(reason),
        }
        let CheckedRow { differences, unchecked, .. } = found;
        for reason in unchecked {
            *audit.unchecked.entry((reason, extent)).or_default() += 1;
        }
        audit.compare(number, &row, differences);
    }
}

impl Audit {
    /// The audit of a table of which so many rows of the sample are missing.
    fn finished(mut self, missing: u64) -> Audit {
        if missing > 0 {
            self.unchecked.insert(("their part is missing; `slipsweep run` computes it", Extent::Whole), missing);
        }
        self.worst.sort_by(|a, b| b.difference.total_cmp(&a.difference).then(a.number.cmp(&b.number)));
        self
    }

    /// Adds the comparisons of a row. A column with several errors counts once.
    fn compare(&mut self, number: u64, row: &Row, differences: Vec<Difference>) {
        let mut failing = BTreeSet::new();
        for Difference { column, size, expected } in differences {
            let difference = size / self.rtol;
            if difference > MAX_DIFFERENCE_RTOLS {
                failing.insert(column);
            }
            let known = self.worst.iter().position(|known| known.column == column);
            if known.is_some_and(|place| difference <= self.worst[place].difference) {
                continue;
            }
            let worst = Worst { column, difference, expected, number, row: row.clone() };
            match known {
                Some(place) => self.worst[place] = worst,
                None => self.worst.push(worst),
            }
        }
        self.errors += failing.len();
    }
}
