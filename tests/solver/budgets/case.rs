//! A point whose cells are known by another route.

use std::fmt::{self, Display, Formatter};

use slipsweep::numerics::double_double::DoubleDouble;

use crate::reference::Row;

/// The value of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    Number(f64),
    Word(&'static str),
}

/// How the truth is known, which is never by the solver that is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Route {
    /// A table under `tests/reference`, to 25 digits.
    Reference,
    /// The definition, integrated in double-double arithmetic.
    Judge,
    /// A formula, in double-double arithmetic where it cancels.
    Formula,
    /// What a bound must hold of: the true error of another column.
    TrueError,
    /// What must hold, without a number to compare with.
    Law,
}

impl Route {
    const ALL: [(Route, &'static str); 5] = [
        (Route::Reference, "reference"),
        (Route::Judge, "judge"),
        (Route::Formula, "formula"),
        (Route::TrueError, "true error"),
        (Route::Law, "law"),
    ];

    pub fn name(self) -> &'static str {
        Route::ALL.into_iter().find(|(route, _)| *route == self).map_or("", |(_, name)| name)
    }

    pub fn of(name: &str) -> Route {
        let found = Route::ALL.into_iter().find(|(_, known)| *known == name);
        found.unwrap_or_else(|| panic!("`{name}` is no route")).0
    }
}

/// What a cell must hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Truth {
    /// Nothing.
    Null,
    Word(&'static str),
    Flag(bool),
    /// This number and no other.
    Exact(f64),
    /// A number, whose error is counted in fractions of `scale`.
    Number {
        value: f64,
        scale: f64,
    },
    /// At least this number, or nothing.
    AtLeast(f64),
}

/// A point.
#[derive(Debug, Clone)]
pub struct Case {
    pub regime: &'static str,
    /// Whether optimal protocols obey `v >= 1`.
    pub bounded: bool,
    /// The form of friction.
    pub friction: &'static str,
    /// The axes of the table, in one order for all its points of one form.
    pub axes: Vec<(&'static str, Value)>,
    pub truths: Vec<(&'static str, Truth, Route)>,
}

impl Case {
    /// A point whose axes stand in a row of a reference table.
    pub fn of(row: &Row, axes: &[&'static str]) -> Case {
        Case::at(axes.iter().map(|&axis| (axis, row.number(axis))))
    }

    /// A point with these axes.
    pub fn at(axes: impl IntoIterator<Item = (&'static str, f64)>) -> Case {
        let axes = axes.into_iter().map(|(axis, value)| (axis, Value::Number(value))).collect();
        Case { regime: "", bounded: true, friction: "log", axes, truths: Vec::new() }
    }

    /// This case in a regime.
    pub fn within(self, regime: &'static str) -> Case {
        Case { regime, ..self }
    }

    /// This case with one more known value.
    pub fn knows(mut self, column: &'static str, truth: Truth, route: Route) -> Case {
        self.truths.push((column, truth, route));
        self
    }

    /// A number that is known by a route, compared relatively.
    pub fn number(self, column: &'static str, value: f64, route: Route) -> Case {
        // Below the least normal double digits are lost.
        let scale = if value == 0.0 { 0.0 } else { value.abs().max(f64::MIN_POSITIVE) };
        self.scaled(column, value, scale, route)
    }

    /// A number whose error is a fraction of `scale`.
    pub fn scaled(self, column: &'static str, value: f64, scale: f64, route: Route) -> Case {
        self.knows(column, Truth::Number { value, scale }, route)
    }

    /// A number that may exist or not.
    pub fn maybe(self, column: &'static str, value: Option<f64>, route: Route) -> Case {
        match value {
            Some(value) => self.number(column, value, route),
            None => self.knows(column, Truth::Null, route),
        }
    }

    /// A word of which no other is right.
    pub fn word(self, column: &'static str, word: &'static str, route: Route) -> Case {
        self.knows(column, Truth::Word(word), route)
    }

    /// Nothing in all these columns.
    pub fn nulls(self, columns: &[&'static str], route: Route) -> Case {
        columns.iter().fold(self, |case, &column| case.knows(column, Truth::Null, route))
    }

    /// All these columns of a reference row, null where it has nothing.
    pub fn reference(self, row: &Row, columns: &[&'static str]) -> Case {
        columns.iter().fold(self, |case, &column| case.maybe(column, row.optional(column), Route::Reference))
    }
}

/// Least work and gap of a shortcut whose `work` is known, the gap to a fraction of one more than itself.
pub fn gap(case: Case, work: f64, work_optimal: f64, route: Route) -> Case {
    let excess = (DoubleDouble::new(work) - DoubleDouble::new(work_optimal)) / DoubleDouble::new(work_optimal);
    let case = case.number("work_optimal", work_optimal, route);
    case.scaled("gap", excess.high, 1.0 + excess.high.abs(), route)
}

impl Display for Case {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for (axis, value) in &self.axes {
            match value {
                Value::Number(number) => write!(f, "{axis} = {number:?} ")?,
                Value::Word(word) => write!(f, "{axis} = {word} ")?,
            }
        }
        f.write_str(if self.bounded { "with the bound" } else { "without the bound" })
    }
}
