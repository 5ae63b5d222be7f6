//! `tests/budgets.csv`: the committed budgets.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::fs;
use std::path::PathBuf;

use super::case::Route;
use super::measure::Found;

/// The least budget of a number in units of the accuracy: a unit in the last place is 2e-6 of 1e-10.
pub const LEAST_RTOLS: f64 = 1e-5;

/// The least budget of a number in units of the last place.
const LEAST_ULPS: f64 = 1.0;

/// The least budget of a bound in fractions of it: a bound holds if the fraction is at most 1.
const MIN_FRACTION: f64 = 0.1;

/// How many times a budget may be what is measured.
const LOOSE: f64 = 10.0;

/// How many times what is measured a new budget is.
const ROOM: f64 = 3.0;

/// A column of a table in a regime.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key {
    table: String,
    column: String,
    regime: String,
}

impl Key {
    pub fn new(table: &str, column: &str, regime: &str) -> Key {
        Key { table: table.to_owned(), column: column.to_owned(), regime: regime.to_owned() }
    }

    pub fn table(&self) -> &str {
        &self.table
    }
}

impl Display for Key {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{} ({})", self.table, self.column, self.regime)
    }
}

/// What an error may be.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Budget {
    /// In units of the accuracy requested; 0 is exact; of a bound, in fractions of it.
    pub rtols: f64,
    /// In units of the last place at the tightest accuracy; 0 is exact; of a bound, in fractions of it.
    pub ulps: f64,
    /// Whether what a unit in the last place of the inputs does is taken off.
    pub conditioned: bool,
    /// How the truth is known.
    pub routes: Vec<Route>,
}

impl Budget {
    /// About three times what is measured.
    fn about(found: &Found) -> Budget {
        let (least, most) = limits(&found.routes);
        // Taken off only where it makes much of the error.
        let conditioned = found.conditioned && found.raw[1] > (LOOSE * found.ulps).max(LOOSE * LEAST_ULPS);
        let measured = if conditioned { [found.rtols, found.ulps] } else { found.raw };
        let about = |i: usize| if found.exact { 0.0 } else { round(ROOM * measured[i]).max(least[i]).min(most) };
        Budget { rtols: about(0), ulps: about(1), conditioned, routes: found.routes.clone() }
    }

    /// What is wrong with it.
    pub fn faults(&self, found: &Found) -> Vec<String> {
        let (least, _) = limits(&self.routes);
        let mut faults = Vec::new();
        let sides = [("rtol", self.rtols, found.rtols, least[0]), ("ulp", self.ulps, found.ulps, least[1])];
        for (unit, budget, measured, least) in sides {
            if measured.is_nan() || budget.is_nan() || measured > budget {
                faults.push(format!("{budget} {unit} is exceeded: {found}"));
            } else if budget > least && budget > LOOSE * measured {
                faults.push(format!("{budget} {unit} is more than ten times what is needed: {found}"));
            }
        }
        if self.conditioned && found.raw[1] <= self.ulps {
            faults.push(format!("keeps its budget without taking anything off: {found}"));
        }
        if self.routes != found.routes {
            faults.push(format!("the truth is known by {:?}, not by {:?}", found.routes, self.routes));
        }
        faults
    }
}

/// The least and the greatest budget of what is known by these routes.
fn limits(routes: &[Route]) -> ([f64; 2], f64) {
    if routes == [Route::TrueError] { ([MIN_FRACTION; 2], 1.0) } else { ([LEAST_RTOLS, LEAST_ULPS], f64::INFINITY) }
}

/// The next of 1, 2, 3, 5 times a power of ten.
fn round(x: f64) -> f64 {
    if x <= 0.0 || !x.is_finite() {
        return x;
    }
    let text = format!("{x:e}");
    let (digits, exponent) = text.split_once('e').expect("has an exponent");
    let digits: f64 = digits.parse().expect("is a number");
    let next = [1, 2, 3, 5, 10].into_iter().find(|step| f64::from(*step) >= digits).expect("is below ten");
    format!("{next}e{exponent}").parse().expect("is a number")
}

/// As short as it reads well.
pub fn number(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e4).contains(&x) { format!("{x:e}") } else { format!("{x}") }
}

/// All budgets.
#[derive(Debug, Clone)]
pub struct Ledger(pub BTreeMap<Key, Budget>);

const HEADER: &str = "table,column,regime,rtol,ulp,conditioned,truth";

const COMMENT: &str = "\
# The greatest error that each column of each table may have in each regime.
# rtol: in units of the accuracy requested. ulp: in units of the last place at the tightest accuracy, 1e-13. 0 is exact.
# Of work_error and gap_error both are the true error over the bound.
# conditioned: what four units in the last place of each input do is taken off first. truth: how it is known.
# docs/accuracy-appendix.md shows and explains them; tests/solver/budgets holds the tables to them.
";

impl Ledger {
    fn path() -> PathBuf {
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/budgets.csv")
    }

    pub fn read() -> Ledger {
        let text = fs::read_to_string(Ledger::path()).expect("is readable");
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        assert_eq!(lines.next(), Some(HEADER));
        let mut budgets = BTreeMap::new();
        for line in lines {
            let cells: Vec<&str> = line.split(',').collect();
            let [table, column, regime, rtols, ulps, conditioned, routes] = cells[..] else {
                panic!("`{line}` has not as many cells as `{HEADER}`");
            };
            let number = |cell: &str| cell.parse().unwrap_or_else(|_| panic!("`{cell}` in `{line}` is no number"));
            let budget = Budget {
                rtols: number(rtols),
                ulps: number(ulps),
                conditioned: conditioned == "yes",
                routes: routes.split(" and ").map(Route::of).collect(),
            };
            let before = budgets.insert(Key::new(table, column, regime), budget);
            assert!(before.is_none(), "`{line}` is a duplicate");
        }
        Ledger(budgets)
    }

    pub fn write(&self) {
        let mut text = format!("{COMMENT}{HEADER}\n");
        for (Key { table, column, regime }, budget) in &self.0 {
            let routes = budget.routes.iter().map(|route| route.name()).collect::<Vec<_>>().join(" and ");
            let conditioned = if budget.conditioned { "yes" } else { "no" };
            let (rtols, ulps) = (number(budget.rtols), number(budget.ulps));
            text += &format!("{table},{column},{regime},{rtols},{ulps},{conditioned},{routes}\n");
        }
        fs::write(Ledger::path(), text).expect("is writable");
    }

    pub fn is_conditioned(&self, key: &Key) -> bool {
        self.0.get(key).is_some_and(|budget| budget.conditioned)
    }

    /// Whether a column has a budget in some regime.
    pub fn knows(&self, table: &str, column: &str) -> bool {
        self.0.keys().any(|key| key.table == table && key.column == column)
    }

    /// Budgets for all that is measured: those that hold and are tight, else new ones.
    pub fn renewed(&self, measured: &BTreeMap<Key, Found>) -> Ledger {
        let renewed = |(key, found): (&Key, &Found)| {
            let kept = self.0.get(key).filter(|budget| budget.faults(found).is_empty());
            (key.clone(), kept.cloned().unwrap_or_else(|| Budget::about(found)))
        };
        Ledger(measured.iter().map(renewed).collect())
    }
}
