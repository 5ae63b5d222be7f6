//! A row under check: its cells, the differences found, and the skipped checks.

use crate::dataset::{Cell, Row};
use crate::grid::{Point, Quantity};
use crate::model::Friction;
use crate::protocol::optimal::Bounds;
use crate::protocol::shortcut::Case;
use crate::table::{STATUS, Table};
use crate::trace::{Pathless, Protocol, point_of, protocol_of};

/// The context of a check: properties of the sweep.
#[derive(Debug, Clone, Copy)]
pub struct Context {
    pub bounded: bool,
    pub friction: Friction,
    /// Whether `alpha_2`, `alpha_3` are given relative to `t_f`.
    pub relative: [bool; 2],
    /// The accuracy of the table.
    pub rtol: f64,
}

/// A row under check.
#[derive(Debug)]
pub struct CheckedRow<'a> {
    cells: &'a Row,
    /// Its axes.
    pub point: Point,
    pub context: Context,
    pub differences: Vec<Difference>,
    /// The reasons for skipped checks.
    pub unchecked: Vec<&'static str>,
}

/// The end of a check, or the reason why the rest is not checked.
pub type Checked = Result<(), &'static str>;

/// One comparison.
#[derive(Debug)]
pub struct Difference {
    pub column: &'static str,
    /// Relative difference; infinite where only one route has a number.
    pub size: f64,
    /// The value of the independent route, and what `size` is relative to unless that is this value, as text.
    pub expected: String,
}

impl<'a> CheckedRow<'a> {
    /// The row of these cells after its `check`.
    pub fn new(cells: &'a Row, context: Context, check: impl FnOnce(&mut CheckedRow<'a>) -> Checked) -> CheckedRow<'a> {
        let point = point_of(cells);
        let mut row = CheckedRow { cells, point, context, differences: Vec::new(), unchecked: Vec::new() };
        if let Err(reason) = check(&mut row) {
            row.miss(reason);
        }
        row
    }

    pub fn cell(&self, column: &str) -> Option<&'a Cell> {
        self.cells.iter().find(|(name, _)| name == column).map(|(_, cell)| cell)
    }

    pub fn number(&self, column: &str) -> Option<f64> {
        self.cell(column)?.number()
    }

    pub fn word(&self, column: &str) -> Option<&'a str> {
        match self.cell(column)? {
            Cell::Word(word) => Some(word),
            _ => None,
        }
    }

    pub fn has_status(&self, name: &str) -> bool {
        self.word(STATUS) == Some(name)
    }

    /// Whether a column with such a name is written.
    pub fn has_column(&self, start: &str) -> bool {
        self.cells.iter().any(|(name, _)| name.starts_with(start))
    }

    /// The protocol of a row of `table`.
    pub fn protocol(&self, table: &str) -> Result<(Protocol, Case), &'static str> {
        let Context { friction, bounded, relative, .. } = self.context;
        match protocol_of(table, self.cells, (friction, bounded, relative), None) {
            Ok((_, protocol, case)) => Ok((protocol, case)),
            Err(Pathless::Status(reason)) => Err(reason),
            Err(_) => Err("an axis is missing"),
        }
    }

    /// The bounds of its optimum.
    pub fn bounds(&self) -> Bounds {
        let [v_ceiling, tau_ceiling] =
            [Quantity::VelocityCeiling, Quantity::FrictionCeiling].map(|axis| self.point[axis]);
        Bounds { floor: self.context.bounded, v_ceiling, tau_ceiling }
    }

    /// `alpha_2 t_f` and `alpha_3 t_f^2`; `None` if one was not written.
    pub fn coefficients(&self, t_f: f64) -> Option<[f64; 2]> {
        let [relative_2, relative_3] = self.context.relative;
        let (alpha_2, alpha_3) = (self.number("alpha_2")?, self.number("alpha_3")?);
        Some([if relative_2 { alpha_2 } else { alpha_2 * t_f }, if relative_3 { alpha_3 } else { alpha_3 * t_f * t_f }])
    }

    /// Records a relative difference that has no counterpart in the row.
    pub fn push(&mut self, column: &'static str, size: f64) {
        self.differences.push(Difference { column, size, expected: "0".to_owned() });
    }

    /// Records the differences and the skipped checks of another row.
    pub fn extend(&mut self, other: CheckedRow<'_>) {
        self.differences.extend(other.differences);
        other.unchecked.into_iter().for_each(|reason| self.miss(reason));
    }

    /// Records the reason for a skipped check.
    pub fn miss(&mut self, reason: &'static str) {
        if !self.unchecked.contains(&reason) {
            self.unchecked.push(reason);
        }
    }

    /// Compares the column, if written, with `expected`.
    pub fn compare(&mut self, column: &'static str, expected: impl Into<Option<f64>>) {
        let expected = expected.into();
        self.compare_relative(column, expected, expected.map_or(1.0, f64::abs));
    }

    /// Compares the column, if written, with `expected`, in units of `scale`.
    pub fn compare_relative(&mut self, column: &'static str, expected: impl Into<Option<f64>>, scale: f64) {
        let expected = expected.into();
        // A result may have the name of an axis, and comes after it.
        let Some((_, cell)) = self.cells.iter().rev().find(|(name, _)| name == column) else { return };
        let difference = match (cell, expected) {
            (Cell::Missing, None) => 0.0,
            // Also where both are infinite.
            (Cell::Number(found), Some(expected)) if *found == expected => 0.0,
            // Below the normal numbers digits are missing.
            (Cell::Number(found), Some(expected)) => (found - expected).abs() / scale.max(f64::MIN_POSITIVE),
            _ => f64::INFINITY,
        };
        // A number that cannot be compared is an error, not an agreement.
        let size = if difference.is_nan() { f64::INFINITY } else { difference };
        let shown = |number: f64| format!("{number:.3e}");
        let expected = match expected {
            // Unless the digits of both are the same.
            Some(expected) if shown(scale) != shown(expected.abs()) => {
                format!("{expected:?}, relative to {}", shown(scale))
            }
            Some(expected) => format!("{expected:?}"),
            None => "nothing".to_owned(),
        };
        self.differences.push(Difference { column, size, expected });
    }

    /// Compares the results of a row of `table` with those of the row computed `again`, which has no difference.
    pub fn compare_again(&mut self, table: &Table, again: &Row) {
        for column in table.columns().iter().map(|column| column.name).chain([STATUS]) {
            match again.iter().find(|(name, _)| name == column) {
                Some((_, Cell::Number(number))) => self.compare(column, *number),
                Some((_, Cell::Word(word))) => self.compare_word(column, word),
                Some((_, Cell::Missing)) => self.compare(column, None),
                None => {}
            }
        }
    }

    /// Compares a number, if there is one.
    pub fn compare_number(&mut self, column: &'static str, expected: f64, scale: f64) {
        if self.number(column).is_some() {
            self.compare_relative(column, expected, scale);
        }
    }

    pub fn compare_word(&mut self, column: &'static str, expected: &str) {
        if let Some(cell) = self.cell(column) {
            self.judge(column, matches!(cell, Cell::Word(found) if found == expected), expected);
        }
    }

    /// Records an error of a column unless it `holds`, with the expectation as text.
    pub fn judge(&mut self, column: &'static str, holds: bool, expected: &str) {
        let size = if holds { 0.0 } else { f64::INFINITY };
        self.differences.push(Difference { column, size, expected: expected.to_owned() });
    }

    /// Compares whether the status reports friction below 0 with the least friction along the path.
    pub fn compare_friction(&mut self, least: f64) {
        if least.abs() > MIN_FRICTION {
            self.judge_status(least < 0.0, [NEGATIVE, "not negative_friction"]);
        }
    }

    /// Compares whether the row is infeasible, unless rounding decides; whether it has numbers to compare.
    pub fn compare_feasible(&mut self, feasible: impl Into<Option<bool>>) -> bool {
        let feasible = feasible.into();
        match feasible {
            None => self.miss("it is too close to the border of what is feasible"),
            Some(feasible) => self.judge_status(!feasible, ["infeasible", "not infeasible"]),
        }
        feasible != Some(false) && !self.has_status("infeasible")
    }

    fn judge_status(&mut self, expected: bool, [name, other]: [&'static str; 2]) {
        let holds = self.word(STATUS).is_some_and(|status| (status == name) == expected);
        self.judge(STATUS, holds, if expected { name } else { other });
    }
}

/// The status of a path with friction below 0.
pub const NEGATIVE: &str = "negative_friction";

/// Least friction, in mu_0 sigma, that an independent route distinguishes from 0. Chosen: above the errors of every route.
const MIN_FRICTION: f64 = 1e-9;
