//! Audit of a dataset: a sample of its rows is checked by the equations that their protocols obey, or solved by a second route.

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

use std::path::Path;

use indexmap::IndexMap;

use crate::dataset::{Folder, Manifest, ManifestTable, Row, frame};
use crate::model::{Friction, Units};
use crate::sweep::{self, Spec};
use crate::table;
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
        let definition = table::find(&table.name);
        let reduced = table::REDUCED.iter().find(|(_, known)| known.name() == table.name).map(|(word, _)| *word);
        let rtol = spec.rtol_of(&table.name);
        let Sample { mut rows, missing, fault } = sample::rows(&folder, manifest, table, sample, seed);
        let relative = relative(&folder, table);
        let context = Context { bounded, friction, relative, rtol };
        // Reduced rows are compared as they were written.
        if let Some(table) = definition.filter(|_| reduced.is_none()) {
            rows.iter_mut().for_each(|(_, row)| scale(row, table, &units, relative));
        }
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
        let check = |row: &mut CheckedRow<'_>| match table.name.as_str() {
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
            _ => match reduced {
                Some(word) => reduced::check(row, word, &units, &spec),
                None => Err("there is no independent route for this table"),
            },
        };
        for (number, row) in rows {
            let CheckedRow { differences, unchecked, .. } = CheckedRow::new(&row, context, check);
            audit.add(number, &row, differences, unchecked);
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

impl Audit {
    /// The audit of a table of which so many rows of the sample are missing.
    fn finished(mut self, missing: u64) -> Audit {
        if missing > 0 {
            self.unchecked.insert(("their part is missing; `slipsweep run` computes it", Extent::Whole), missing);
        }
        self.worst.sort_by(|a, b| b.difference.total_cmp(&a.difference).then(a.number.cmp(&b.number)));
        self
    }

    fn add(&mut self, number: u64, row: &Row, differences: Vec<Difference>, unchecked: Vec<&'static str>) {
        let extent = if differences.is_empty() { Extent::Whole } else { Extent::Part };
        for reason in unchecked {
            *self.unchecked.entry((reason, extent)).or_default() += 1;
        }
        for Difference { column, size, expected } in differences {
            let difference = size / self.rtol;
            self.errors += usize::from(difference > MAX_DIFFERENCE_RTOLS);
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
    }
}
