//! A dataset audited: a sample of its rows solved again by a route that shares nothing with the solvers that made it.

mod best;
mod compliant;
mod course;
mod crossover;
mod extremal;
mod gap;
mod optimal;
mod route;
mod sample;
mod stability;
mod swift;

use std::path::Path;

use crate::dataset::{Cell, Folder, Manifest, Row};
use crate::grid::Quantity;
use crate::model::{Law, Transition};
use crate::sweep::{AxisSpec, Spec};
use crate::table::{self, STATUS};

/// Differences above this many rtol are errors.
pub const LIMIT: f64 = 10.0;

/// What a check needs to know of the sweep.
#[derive(Debug, Clone, Copy)]
struct Context {
    bounded: bool,
    /// Whether `alpha_2`, `alpha_3` are given relative to `t_f`.
    relative: [bool; 2],
}

/// What a check found in one row.
#[derive(Debug, Default)]
struct Verdict {
    /// Column and relative difference of each number compared; infinite where only one route has a number.
    differences: Vec<(&'static str, f64)>,
    /// What could not be checked, and why.
    unchecked: Option<&'static str>,
}

impl Verdict {
    fn unchecked(reason: &'static str) -> Verdict {
        Verdict { unchecked: Some(reason), ..Verdict::default() }
    }

    /// Compares `found`, if the column was written, in units of `scale`.
    fn compare(&mut self, row: &Row, column: &'static str, expected: Option<f64>, scale: Option<f64>) {
        let Some((_, cell)) = row.iter().rev().find(|(name, _)| name == column) else { return };
        let difference = match (cell, expected) {
            (Cell::Missing, None) => 0.0,
            // Also where both are infinite.
            (Cell::Number(found), Some(expected)) if *found == expected => 0.0,
            (Cell::Number(found), Some(expected)) => {
                let size = scale.unwrap_or(expected.abs());
                (found - expected).abs() / size
            }
            _ => f64::INFINITY,
        };
        // A number that cannot be compared is an error, not an agreement.
        self.differences.push((column, if difference.is_nan() { f64::INFINITY } else { difference }));
    }

    fn compare_word(&mut self, row: &Row, column: &'static str, expected: &str) {
        let Some((_, cell)) = row.iter().find(|(name, _)| name == column) else { return };
        let wrong = !matches!(cell, Cell::Word(found) if found == expected);
        self.differences.push((column, if wrong { f64::INFINITY } else { 0.0 }));
    }

    fn status(&mut self, row: &Row, expected: bool) {
        let wrong = word(row, STATUS).is_none_or(|status| (status == "infeasible") != expected);
        self.differences.push((STATUS, if wrong { f64::INFINITY } else { 0.0 }));
    }
}

/// The audit of one table.
#[derive(Debug)]
pub struct Audit {
    /// Its name.
    pub table: String,
    /// Accuracy promised.
    pub rtol: f64,
    /// Rows of the sample.
    pub rows: usize,
    /// Differences of each column in units of rtol, ascending.
    pub columns: Vec<(&'static str, Vec<f64>)>,
    /// The rows with the greatest differences, worst first: number, difference, column, cells.
    pub worst: Vec<(u64, f64, &'static str, Row)>,
    /// Rows that were not checked, by reason.
    pub unchecked: Vec<(&'static str, u64)>,
}

/// Why a dataset cannot be audited.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct VerifyError(String);

/// Most rows named a table.
const WORST: usize = 5;

/// Audits `sample` rows of every table of the dataset in `path`.
pub fn verify(path: &Path, manifest: &Manifest, sample: u64, seed: u64) -> Result<Vec<Audit>, VerifyError> {
    let spec: Spec = toml::from_str(&manifest.spec)
        .map_err(|error| VerifyError(format!("the spec in the manifest cannot be read: {error}")))?;
    let relative = |quantity: Quantity| match spec.axes.get(quantity.name()) {
        Some(AxisSpec::Form(form)) => form.unit.as_deref().is_some_and(|unit| unit.starts_with("1/t_f")),
        Some(_) => false,
        None => true,
    };
    let context = Context {
        bounded: spec.model.velocity_bound,
        relative: [relative(Quantity::Alpha2), relative(Quantity::Alpha3)],
    };
    let folder = Folder::at(path);
    let mut audits = Vec::new();
    for table in &manifest.tables {
        let own = spec.tables.get(&table.name).and_then(|table| table.rtol);
        let rtol = own.or(table::find(&table.name).and_then(|table| table.default_rtol()));
        let rtol = rtol.unwrap_or(spec.accuracy.rtol);
        let rows = sample::rows(&folder, table, sample, seed).map_err(VerifyError)?;
        let mut audit = Audit {
            table: table.name.clone(),
            rtol,
            rows: rows.len(),
            columns: Vec::new(),
            worst: Vec::new(),
            unchecked: Vec::new(),
        };
        for (number, row) in rows {
            let verdict = match table.name.as_str() {
                "gap" => gap::check(&row, &context),
                "optimal" => optimal::check(&row, &context),
                "crossover" => crossover::check(&row, &context),
                "best" => best::check(&row, &context, rtol),
                "swift" => swift::check(&row, &context),
                "compliant" => compliant::check(&row, &context),
                "regularised" => compliant::check_regularised(&row, &context),
                "stability" => stability::check(&row, &context),
                _ => Verdict::unchecked("there is no independent route for this table"),
            };
            audit.add(number, row, verdict);
        }
        audit.columns.iter_mut().for_each(|(_, differences)| differences.sort_by(f64::total_cmp));
        audit.worst.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        audit.worst.truncate(WORST);
        audits.push(audit);
    }
    Ok(audits)
}

impl Audit {
    fn add(&mut self, number: u64, row: Row, verdict: Verdict) {
        if let Some(reason) = verdict.unchecked {
            match self.unchecked.iter_mut().find(|(known, _)| *known == reason) {
                Some((_, rows)) => *rows += 1,
                None => self.unchecked.push((reason, 1)),
            }
        }
        let mut worst: Option<(f64, &'static str)> = None;
        for (column, difference) in verdict.differences {
            let difference = difference / self.rtol;
            match self.columns.iter_mut().find(|(known, _)| *known == column) {
                Some((_, all)) => all.push(difference),
                None => self.columns.push((column, vec![difference])),
            }
            if worst.is_none_or(|(greatest, _)| difference > greatest) {
                worst = Some((difference, column));
            }
        }
        if let Some((difference, column)) = worst {
            self.worst.push((number, difference, column, row));
        }
    }

    /// Numbers beyond [`LIMIT`].
    pub fn errors(&self) -> usize {
        self.columns.iter().flat_map(|(_, all)| all).filter(|difference| **difference > LIMIT).count()
    }
}

fn number(row: &Row, column: &str) -> Option<f64> {
    match row.iter().find(|(name, _)| name == column)?.1 {
        Cell::Number(value) => Some(value),
        _ => None,
    }
}

fn word<'a>(row: &'a Row, column: &str) -> Option<&'a str> {
    match &row.iter().find(|(name, _)| name == column)?.1 {
        Cell::Word(word) => Some(word),
        _ => None,
    }
}

fn transition(row: &Row) -> Option<Transition> {
    let law = Law { a: number(row, "a")?, b: number(row, "b")? };
    Some(Transition { law, v_i: number(row, "v_i")?, v_f: number(row, "v_f")? })
}
