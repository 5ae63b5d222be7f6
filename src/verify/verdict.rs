//! The verdict of a check: differences, and skipped checks.

use crate::dataset::{Cell, Row};
use crate::model::{Friction, Law, StateLaw, Transition};
use crate::table::STATUS;

/// The context of a check: properties of the sweep.
#[derive(Debug, Clone, Copy)]
pub struct Context {
    pub bounded: bool,
    pub friction: Friction,
    /// Whether `alpha_2`, `alpha_3` are given relative to `t_f`.
    pub relative: [bool; 2],
}

/// The verdict on one row.
#[derive(Debug, Default)]
pub struct Verdict {
    pub differences: Vec<Difference>,
    /// The reason for a skipped check.
    pub unchecked: Vec<&'static str>,
}

/// The verdict on a row, or the reason why it cannot be checked.
pub type Checked = Result<Verdict, &'static str>;

/// One comparison.
#[derive(Debug)]
pub struct Difference {
    pub column: &'static str,
    /// Relative difference; infinite where only one route has a number.
    pub size: f64,
    /// The value of the independent route, and what `size` is relative to unless that is this value, as text.
    pub expected: String,
}

impl Verdict {
    /// Records a relative difference that has no counterpart in the row.
    pub fn push(&mut self, column: &'static str, size: f64) {
        self.differences.push(Difference { column, size, expected: "0".to_owned() });
    }

    /// Records the greatest difference of another verdict, and its skipped checks.
    pub fn confirm(&mut self, column: &'static str, other: Verdict) {
        self.push(column, other.differences.iter().map(|difference| difference.size).fold(0.0, f64::max));
        other.unchecked.into_iter().for_each(|reason| self.miss(reason));
    }

    /// The verdict on a row that cannot be checked.
    pub fn unchecked(reason: &'static str) -> Verdict {
        Verdict { unchecked: vec![reason], ..Verdict::default() }
    }

    /// Records the reason for a skipped check.
    pub fn miss(&mut self, reason: &'static str) {
        if !self.unchecked.contains(&reason) {
            self.unchecked.push(reason);
        }
    }

    /// Compares the column, if written, with `expected`, in units of `scale`.
    pub fn compare(&mut self, row: &Row, column: &'static str, expected: Option<f64>, scale: Option<f64>) {
        let Some((_, cell)) = row.iter().rev().find(|(name, _)| name == column) else { return };
        let difference = match (cell, expected) {
            (Cell::Missing, None) => 0.0,
            // Also where both are infinite.
            (Cell::Number(found), Some(expected)) if *found == expected => 0.0,
            (Cell::Number(found), Some(expected)) => {
                // Below the normal numbers digits are missing.
                (found - expected).abs() / scale.unwrap_or(expected.abs()).max(f64::MIN_POSITIVE)
            }
            _ => f64::INFINITY,
        };
        // A number that cannot be compared is an error, not an agreement.
        let size = if difference.is_nan() { f64::INFINITY } else { difference };
        let expected = match (expected, scale) {
            (Some(expected), Some(scale)) if (scale / expected.abs() - 1.0).abs() > SAME_SCALE => {
                format!("{expected:?}, relative to {scale:.3e}")
            }
            (Some(expected), _) => format!("{expected:?}"),
            (None, _) => "nothing".to_owned(),
        };
        self.differences.push(Difference { column, size, expected });
    }

    /// Compares a number, if there is one.
    pub fn compare_number(&mut self, row: &Row, column: &'static str, expected: f64, scale: f64) {
        if number(row, column).is_some() {
            self.compare(row, column, Some(expected), Some(scale));
        }
    }

    pub fn compare_word(&mut self, row: &Row, column: &'static str, expected: &str) {
        let Some((_, cell)) = row.iter().find(|(name, _)| name == column) else { return };
        self.judge(column, matches!(cell, Cell::Word(found) if found == expected), expected);
    }

    /// Records an error of a column unless it `holds`, with the expectation as text.
    pub fn judge(&mut self, column: &'static str, holds: bool, expected: &str) {
        let size = if holds { 0.0 } else { f64::INFINITY };
        self.differences.push(Difference { column, size, expected: expected.to_owned() });
    }

    /// Records an error if a column that must have a value is null, or the reverse.
    pub fn demand(&mut self, row: &Row, column: &'static str, exists: bool) {
        if row.iter().any(|(name, cell)| name == column && (*cell != Cell::Missing) != exists) {
            self.judge(column, false, if exists { "a number" } else { "nothing" });
        }
    }

    /// Compares whether the status reports friction below 0 with the least friction along the path.
    pub fn friction(&mut self, row: &Row, least: f64) {
        if least.abs() > MIN_FRICTION {
            let negative = least < 0.0;
            self.judge_status(row, negative, [NEGATIVE, "not negative_friction"]);
        }
    }

    /// Compares whether the row is infeasible.
    pub fn status(&mut self, row: &Row, expected: bool) {
        self.judge_status(row, expected, ["infeasible", "not infeasible"]);
    }

    fn judge_status(&mut self, row: &Row, expected: bool, [name, other]: [&'static str; 2]) {
        let holds = word(row, STATUS).is_some_and(|status| (status == name) == expected);
        self.judge(STATUS, holds, if expected { name } else { other });
    }
}

/// Relative difference of a scale from the number below which it is not stated. Chosen: it does not change the shown digits of a difference.
const SAME_SCALE: f64 = 1e-3;

/// The status of a path with friction below 0.
pub const NEGATIVE: &str = "negative_friction";

/// Least friction, in mu_0 sigma, that an independent route distinguishes from 0. Chosen: above the errors of every route.
const MIN_FRICTION: f64 = 1e-9;

pub fn number(row: &Row, column: &str) -> Option<f64> {
    match row.iter().find(|(name, _)| name == column)?.1 {
        Cell::Number(value) => Some(value),
        _ => None,
    }
}

pub fn word<'a>(row: &'a Row, column: &str) -> Option<&'a str> {
    match &row.iter().find(|(name, _)| name == column)?.1 {
        Cell::Word(word) => Some(word),
        _ => None,
    }
}

/// The number of an axis.
pub fn axis(row: &Row, name: &str) -> Result<f64, &'static str> {
    number(row, name).ok_or("an axis is missing")
}

/// The evolution law of the state: ageing without such a column.
pub fn state_law(row: &Row) -> Result<StateLaw, &'static str> {
    word(row, "law").map_or(Some(StateLaw::Ageing), StateLaw::find).ok_or("the law is unknown")
}

pub fn transition(row: &Row) -> Result<Transition, &'static str> {
    let law = Law { a: axis(row, "a")?, b: axis(row, "b")? };
    Ok(Transition { law, v_i: axis(row, "v_i")?, v_f: axis(row, "v_f")? })
}
