//! The errors of a table at points whose truth is known.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};

use super::Known;
use super::case::{Case, Route, Truth, Value};
use super::ledger::{Key, Ledger};
use super::sweeps::{Cell, Columns, compute};

/// Accuracies at which errors are counted in units of the accuracy.
const ROUGH: [f64; 2] = [1e-6, 1e-10];

/// The tightest accuracy that a spec may request, at which errors are counted in units of the last place.
const TIGHTEST: f64 = 1e-13;

/// Units of the last place beyond which an error is asked whether the inputs account for it.
const SUSPECT: f64 = 1000.0;

/// Units in the last place of every input that a solver may be wrong by before its error counts as its own.
const ROUNDINGS: f64 = 4.0;

/// Units in the last place by which inputs are changed: differences over many rise above rounding.
const NUDGES: [i64; 3] = [1 << 20, 1 << 10, 1 << 5];

/// The greatest errors of a column in a regime.
#[derive(Debug, Clone, Default)]
pub struct Found {
    /// In units of the accuracy requested; of a bound, in fractions of it.
    pub rtols: f64,
    /// In units of the last place at the tightest accuracy; of a bound, in fractions of it.
    pub ulps: f64,
    /// Both without taking off what the inputs account for.
    pub raw: [f64; 2],
    /// Whether what the inputs account for is taken off.
    pub conditioned: bool,
    /// Whether nothing but words, flags, nulls and counts is compared.
    pub exact: bool,
    pub routes: Vec<Route>,
    /// Where the greatest error in the last place is.
    pub worst: String,
}

impl Display for Found {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Found { rtols, ulps, raw, worst, .. } = self;
        write!(f, "{rtols:.2e} rtol, {ulps:.1} ulp")?;
        if self.conditioned {
            write!(f, " beyond what rounding of the inputs does, {:.1e} with it", raw[1])?;
        }
        write!(f, "; worst at {worst}")
    }
}

/// Measures a table. `ledger` subtracts the part of the inputs; to `propose` budgets it is so
/// wherever an error is suspect and the ledger has none.
pub fn measure(known: &Known, cases: &[Case], ledger: &Ledger, propose: bool) -> BTreeMap<Key, Found> {
    let table = |rtol| compute(known.table, known.grid, cases, rtol);
    let (rough, fine) = (ROUGH.map(table), table(TIGHTEST));
    let checks: Vec<Vec<Check>> = cases.iter().map(|case| checks(case, &fine)).collect();
    // A regime is suspect as a whole.
    let mut suspect: Vec<&str> = Vec::new();
    for (place, case) in cases.iter().enumerate() {
        for check in checks[place].iter().filter(|check| check.is_conditionable()) {
            let marked = ledger.is_conditioned(&check.key(known, case));
            let large = check.ulps(check.error(&fine, place), &fine, place) > SUSPECT;
            if (marked || (propose && large)) && !suspect.contains(&case.regime) {
                suspect.push(case.regime);
            }
        }
    }
    let suspects: Vec<usize> = (0..cases.len()).filter(|&place| suspect.contains(&cases[place].regime)).collect();
    let sensitivity = sensitivity(known, cases, &suspects);
    let mut found: BTreeMap<Key, Found> = BTreeMap::new();
    for (place, case) in cases.iter().enumerate() {
        for check in &checks[place] {
            let key = check.key(known, case);
            let entry = found.entry(key.clone()).or_insert_with(|| Found { exact: true, ..Found::default() });
            let by_inputs = sensitivity.get(&(place, check.column)).copied().unwrap_or(0.0);
            let marked = ledger.is_conditioned(&key) || (propose && !ledger.0.contains_key(&key));
            let taken = if marked && check.is_conditionable() { by_inputs } else { 0.0 };
            let error = |columns: &Columns| check.error(columns, place);
            for (columns, rtol) in rough.iter().zip(ROUGH) {
                let rtols = |error: f64| check.rtols(error, rtol, columns, place);
                entry.raw[0] = entry.raw[0].max(rtols(error(columns)));
                entry.rtols = entry.rtols.max(rtols((error(columns) - taken).max(0.0)));
            }
            let ulps = |error: f64| check.ulps(error, &fine, place);
            let may_be_null = check.column == CONFIRMED && fine[CONFIRMED][place] == Cell::Null;
            let finest = if may_be_null { 0.0 } else { error(&fine) };
            let here = ulps((finest - taken).max(0.0));
            if here >= entry.ulps || entry.rtols.is_infinite() && entry.worst.is_empty() {
                entry.worst = format!("{case}: {}", check.reported(&fine, place));
            }
            entry.raw[1] = entry.raw[1].max(ulps(finest));
            entry.ulps = entry.ulps.max(here);
            entry.conditioned |= taken > 0.0;
            entry.exact &= check.is_exact();
            if !entry.routes.contains(&check.route) {
                entry.routes.push(check.route);
                entry.routes.sort();
            }
        }
    }
    found
}

/// A column whose numbers a second simulation confirms: the tightest accuracy may be below the rounding of both.
const CONFIRMED: &str = "sampling_error";

/// A cell and what it must hold.
struct Check {
    column: &'static str,
    truth: Truth,
    route: Route,
    /// The column that this one bounds the error of.
    bounds: Option<&'static str>,
}

/// Columns of bounds, and what they bound the error of.
const BOUNDS: [(&str, &str); 2] = [("work_error", "work"), ("gap_error", "gap")];

/// What is checked of a point: its truths, and the bounds of errors that are known from them.
fn checks(case: &Case, columns: &Columns) -> Vec<Check> {
    let check = |&(column, truth, route)| Check { column, truth, route, bounds: None };
    // With regularised friction there are no bounds.
    let is_bound = |bound: &str| columns.contains_key(bound) && case.friction == "log";
    let bounds = BOUNDS.into_iter().filter(|(bound, _)| is_bound(bound)).filter_map(|(bound, column)| {
        let truth = case.truths.iter().find(|(known, ..)| *known == column)?.1;
        Some(Check { column: bound, truth, route: Route::TrueError, bounds: Some(column) })
    });
    case.truths.iter().map(check).chain(bounds).collect()
}

impl Check {
    fn key(&self, known: &Known, case: &Case) -> Key {
        Key::new(known.table, self.column, case.regime)
    }

    fn is_exact(&self) -> bool {
        matches!(self.truth, Truth::Null | Truth::Word(_) | Truth::Flag(_) | Truth::Exact(_))
    }

    fn is_conditionable(&self) -> bool {
        matches!(self.truth, Truth::Number { .. }) && self.bounds.is_none()
    }

    /// The absolute error of what is compared; infinite where a cell holds what it must not.
    fn error(&self, columns: &Columns, place: usize) -> f64 {
        let compared = &columns[self.bounds.unwrap_or(self.column)][place];
        let fault = |right: bool| if right { 0.0 } else { f64::INFINITY };
        match (self.truth, compared) {
            (Truth::Null, cell) => fault(*cell == Cell::Null && columns[self.column][place] == Cell::Null),
            (Truth::Word(word), Cell::Word(found)) => fault(found == word),
            (Truth::Flag(flag), Cell::Flag(found)) => fault(*found == flag),
            (Truth::Exact(number), Cell::Number(found)) => fault(*found == number),
            (Truth::Number { value, .. }, Cell::Number(found)) => (found - value).abs(),
            (Truth::AtLeast(_), Cell::Null) => 0.0,
            (Truth::AtLeast(least), Cell::Number(found)) => (least - found).max(0.0),
            _ => f64::INFINITY,
        }
    }

    /// What an error is measured by: the scale of the number, or the bound itself.
    fn size(&self, columns: &Columns, place: usize) -> f64 {
        match (self.bounds, self.truth, &columns[self.column][place]) {
            (Some(_), _, Cell::Number(bound)) => *bound,
            (Some(_), ..) => 0.0,
            (None, Truth::Number { scale, .. }, _) => scale,
            (None, Truth::AtLeast(least), _) => least.abs(),
            (None, ..) => 1.0,
        }
    }

    /// What is compared, in words.
    fn reported(&self, columns: &Columns, place: usize) -> String {
        let compared = &columns[self.bounds.unwrap_or(self.column)][place];
        let bound =
            if self.bounds.is_some() { format!(" within {:?}", columns[self.column][place]) } else { String::new() };
        format!("{compared:?} for {:?}{bound}", self.truth)
    }

    fn rtols(&self, error: f64, rtol: f64, columns: &Columns, place: usize) -> f64 {
        let unit = if self.bounds.is_some() { 1.0 } else { rtol };
        fraction(error, self.size(columns, place)) / unit
    }

    fn ulps(&self, error: f64, columns: &Columns, place: usize) -> f64 {
        let size = self.size(columns, place);
        fraction(error, if self.bounds.is_some() { size } else { last_place(size) })
    }
}

/// `error` in units of `size`.
fn fraction(error: f64, size: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / size }
}

/// The distance of the doubles about `x`.
fn last_place(x: f64) -> f64 {
    x.abs().next_up() - x.abs()
}

/// What a change of each input by [`ROUNDINGS`] units in its last place does to the numbers of some points, all inputs
/// together: by differences of the table itself over far more units, so that its own rounding does not count.
fn sensitivity(known: &Known, cases: &[Case], places: &[usize]) -> BTreeMap<(usize, &'static str), f64> {
    let mut nudged = Vec::new();
    for &place in places {
        for (axis, (_, value)) in cases[place].axes.iter().enumerate() {
            let Value::Number(number) = *value else { continue };
            if number == 0.0 || number.is_infinite() {
                continue;
            }
            for nudge in NUDGES {
                for units in [nudge, -nudge] {
                    let mut case = cases[place].clone();
                    let units = if number < 0.0 { -units } else { units };
                    case.axes[axis].1 = Value::Number(f64::from_bits(number.to_bits().saturating_add_signed(units)));
                    nudged.push(case);
                }
            }
        }
    }
    let mut sensitivity: BTreeMap<(usize, &'static str), f64> = BTreeMap::new();
    if nudged.is_empty() {
        return sensitivity;
    }
    let columns = compute(known.table, known.grid, &nudged, TIGHTEST);
    let mut row = 0;
    for &place in places {
        let inputs = cases[place].axes.iter().filter(|(_, value)| match value {
            Value::Number(number) => *number != 0.0 && number.is_finite(),
            Value::Word(_) => false,
        });
        for _ in inputs {
            for (column, cells) in &columns {
                let mut slope: Option<f64> = None;
                for (i, nudge) in NUDGES.into_iter().enumerate() {
                    if let [Cell::Number(above), Cell::Number(below)] = cells[row + 2 * i..row + 2 * i + 2] {
                        let one = (above - below).abs() / (2 * nudge) as f64;
                        slope = Some(slope.map_or(one, |slope| slope.min(one)));
                    }
                }
                *sensitivity.entry((place, column)).or_default() += ROUNDINGS * slope.unwrap_or(0.0);
            }
            row += 2 * NUDGES.len();
        }
    }
    sensitivity
}
