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
mod step;
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
    differences: Vec<Difference>,
    /// What could not be checked, and why.
    unchecked: Option<&'static str>,
}

/// One comparison.
#[derive(Debug)]
struct Difference {
    column: &'static str,
    /// Relative difference; infinite where only one route has a number.
    size: f64,
    /// What the independent route has, in words.
    expected: String,
}

impl Verdict {
    /// Notes a relative difference that has no counterpart in the row.
    fn push(&mut self, column: &'static str, size: f64) {
        self.differences.push(Difference { column, size, expected: "0".to_owned() });
    }

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
        let size = if difference.is_nan() { f64::INFINITY } else { difference };
        let expected = expected.map_or_else(|| "nothing".to_owned(), |expected| format!("{expected:?}"));
        self.differences.push(Difference { column, size, expected });
    }

    fn compare_word(&mut self, row: &Row, column: &'static str, expected: &str) {
        let Some((_, cell)) = row.iter().find(|(name, _)| name == column) else { return };
        let wrong = !matches!(cell, Cell::Word(found) if found == expected);
        let size = if wrong { f64::INFINITY } else { 0.0 };
        self.differences.push(Difference { column, size, expected: expected.to_owned() });
    }

    /// Notes an error where a column that must have a number was written without.
    fn demand(&mut self, row: &Row, column: &'static str) {
        if row.iter().any(|(name, cell)| name == column && *cell == Cell::Missing) {
            self.differences.push(Difference { column, size: f64::INFINITY, expected: "a number".to_owned() });
        }
    }

    fn status(&mut self, row: &Row, expected: bool) {
        let wrong = word(row, STATUS).is_none_or(|status| (status == "infeasible") != expected);
        let size = if wrong { f64::INFINITY } else { 0.0 };
        let expected = if expected { "infeasible" } else { "not infeasible" }.to_owned();
        self.differences.push(Difference { column: STATUS, size, expected });
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
    /// For each column the row with the greatest difference, worst first.
    pub worst: Vec<Worst>,
    /// Rows that were not checked, by reason.
    pub unchecked: Vec<(&'static str, u64)>,
}

/// The greatest difference in a column.
#[derive(Debug)]
pub struct Worst {
    /// The column.
    pub column: &'static str,
    /// In units of rtol.
    pub difference: f64,
    /// What the independent route has.
    pub expected: String,
    /// Number of the row.
    pub number: u64,
    /// Its cells.
    pub row: Row,
}

/// Why a dataset cannot be audited.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct VerifyError(String);

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
        let (rows, missing) = sample::rows(&folder, table, sample, seed).map_err(VerifyError)?;
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
                "step" => step::check(&row, &context),
                "stability" => stability::check(&row, &context),
                _ => Verdict::unchecked("there is no independent route for this table"),
            };
            audit.add(number, row, verdict);
        }
        if missing > 0 {
            audit
                .unchecked
                .push(("their part is missing; running the sweep again makes only what is missing", missing));
        }
        audit.columns.iter_mut().for_each(|(_, differences)| differences.sort_by(f64::total_cmp));
        audit.worst.sort_by(|a, b| b.difference.total_cmp(&a.difference).then(a.number.cmp(&b.number)));
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
        for Difference { column, size, expected } in verdict.differences {
            let difference = size / self.rtol;
            match self.columns.iter_mut().find(|(known, _)| *known == column) {
                Some((_, all)) => all.push(difference),
                None => self.columns.push((column, vec![difference])),
            }
            let worst = Worst { column, difference, expected, number, row: row.clone() };
            match self.worst.iter_mut().find(|known| known.column == column) {
                Some(known) if difference > known.difference => *known = worst,
                Some(_) => {}
                None => self.worst.push(worst),
            }
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
