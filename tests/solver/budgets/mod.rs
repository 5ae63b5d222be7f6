//! Error budgets: what every column of every table is good to, regime by regime, as `tests/budgets.csv` states it.
//!
//! Each table is computed as a sweep computes it, on fixed points of each regime whose numbers are known by another
//! route. A budget fails where an error is larger, where ten times less would do, and where a column has none; the
//! tables of `docs/accuracy-appendix.md` are those of the file. `SLIPSWEEP_BUDGETS=write` rewrites both: budgets that hold
//! and are tight stay as they are, others become about three times the measured error. `SLIPSWEEP_BUDGETS=TABLE` measures
//! one table alone, `SLIPSWEEP_BUDGETS="write TABLE"` also writes its budgets.

mod best_cubic;
mod case;
mod compliant;
mod crossover;
mod feedback;
mod gap;
mod ledger;
mod measure;
mod optimal;
mod page;
mod reduced;
mod regularised;
mod shortcut;
mod stability;
mod step_response;
mod sweeps;

use std::collections::BTreeMap;

use slipsweep::grid::Quantity;
use slipsweep::table;

use case::{Case, Value};
use ledger::{Budget, Key, Ledger};
use measure::{Found, measure};
use sweeps::Grid;

/// What is known of a table by other routes.
struct Known {
    table: &'static str,
    /// How its points are made a sweep.
    grid: Grid,
    /// The name of each regime and what its points are.
    regimes: &'static [(&'static str, &'static str)],
    cases: fn() -> Vec<Case>,
}

/// Every table and its reductions, in the order in which they are listed.
static KNOWN: [Known; 13] = [
    gap::KNOWN,
    reduced::MINIMUM,
    reduced::QUANTILES,
    reduced::HISTOGRAM,
    best_cubic::KNOWN,
    optimal::KNOWN,
    feedback::KNOWN,
    crossover::KNOWN,
    shortcut::KNOWN,
    stability::KNOWN,
    step_response::KNOWN,
    compliant::KNOWN,
    regularised::KNOWN,
];

/// The request in `SLIPSWEEP_BUDGETS`: whether to write, and the tables to measure, all or one.
fn request() -> (bool, Vec<&'static Known>) {
    let request = std::env::var("SLIPSWEEP_BUDGETS").unwrap_or_default();
    let (writes, table) = match request.strip_prefix("write") {
        Some(table) => (true, table.trim_start()),
        None => (false, request.as_str()),
    };
    let chosen: Vec<&Known> = KNOWN.iter().filter(|known| table.is_empty() || known.table == table).collect();
    assert!(!chosen.is_empty(), "SLIPSWEEP_BUDGETS={request}: expected `write`, a table, or `write TABLE`");
    (writes, chosen)
}

#[test]
fn every_column_keeps_its_budget_and_needs_it() {
    let (writes, chosen) = request();
    let cases: Vec<Vec<Case>> = chosen.iter().map(|known| legal_cases(known)).collect();
    let mut points = BTreeMap::new();
    for (known, cases) in chosen.iter().zip(&cases) {
        for (regime, _) in known.regimes {
            let count = cases.iter().filter(|case| case.regime == *regime).count();
            assert!(count > 0, "{}: no point of `{regime}`", known.table);
            points.insert((known.table, *regime), count);
        }
        let stray = cases.iter().find(|case| known.regimes.iter().all(|(regime, _)| case.regime != *regime));
        assert!(stray.is_none(), "{}: {stray:?} is of no regime", known.table);
    }
    let all = |ledger: &Ledger, propose: bool| -> BTreeMap<Key, Found> {
        chosen.iter().zip(&cases).flat_map(|(known, cases)| measure(known, cases, ledger, propose)).collect()
    };
    let is_chosen = |table: &str| chosen.iter().any(|known| known.table == table);
    let mut ledger = Ledger::read();
    if writes {
        let mut renewed = ledger.renewed(&all(&ledger, true));
        renewed.0.extend(ledger.0.into_iter().filter(|(key, _)| !is_chosen(key.table())));
        ledger = renewed;
        ledger.write();
        page::write(&ledger, &points);
    }
    let measured = all(&ledger, false);
    let mut faults = Vec::new();
    for (key, found) in &measured {
        println!("{key}: {found}");
        match ledger.0.get(key) {
            None => faults.push(format!("{key} has no budget: {found}")),
            Some(budget) => faults.extend(budget.faults(found).into_iter().map(|fault| format!("{key}: {fault}"))),
        }
    }
    let idle = ledger.0.keys().filter(|key| is_chosen(key.table()) && !measured.contains_key(*key));
    faults.extend(idle.map(|key| format!("{key} has a budget, but nothing is known of it")));
    let is_known = |table: &str| KNOWN.iter().any(|known| known.table == table);
    let bare = columns().filter(|(table, _)| is_chosen(table) || !is_known(table));
    let bare = bare.filter(|(table, column)| !ledger.knows(table, column));
    faults.extend(bare.map(|(table, column)| format!("{table}.{column} has no budget in any regime")));
    assert!(
        faults.is_empty(),
        "{} faults; `SLIPSWEEP_BUDGETS=write cargo test --release --test solver budgets` states what is measured:\n{}",
        faults.len(),
        faults.join("\n")
    );
    page::check(&ledger, &points);
}

/// The points of a table that a spec may request: some in the reference tables lie beyond.
fn legal_cases(known: &Known) -> Vec<Case> {
    let legal = |&(axis, value): &(&str, Value)| match value {
        Value::Number(number) => Quantity::from_name(axis).is_some_and(|axis| axis.domain().contains(number)),
        Value::Word(_) => true,
    };
    (known.cases)().into_iter().filter(|case| case.axes.iter().all(legal)).collect()
}

/// Every column of every table, `status` among them.
fn columns() -> impl Iterator<Item = (&'static str, &'static str)> {
    let tables = table::ALL.into_iter().chain(table::REDUCED.map(|(_, table)| table));
    tables.flat_map(|table| {
        let columns = table.columns().iter().map(|column| column.name);
        columns.chain([table::STATUS]).map(move |column| (table.name(), column))
    })
}

/// The rules for budgets can fail.
#[test]
fn a_budget_that_is_exceeded_or_ten_times_too_large_is_a_fault() {
    let found = |rtols: f64, ulps: f64| Found { rtols, ulps, ..Found::default() };
    let budget = |rtols: f64, ulps: f64| Budget { rtols, ulps, ..Budget::default() };
    let faults = |budget: Budget, rtols: f64, ulps: f64| budget.faults(&found(rtols, ulps)).len();
    assert_eq!(faults(budget(0.3, 9.0), 0.1, 3.0), 0);
    assert_eq!(faults(budget(0.3, 9.0), 0.31, 3.0), 1);
    assert_eq!(faults(budget(0.3, 9.0), 0.1, 10.0), 1);
    assert_eq!(faults(budget(0.3, 9.0), 0.02, 0.5), 2);
    // What a number is good to in the last place can be no less than a unit, and no more is asked.
    assert_eq!(faults(budget(ledger::LEAST_RTOLS, 1.0), 0.0, 0.0), 0);
    assert_eq!(faults(budget(2.0 * ledger::LEAST_RTOLS, 2.0), 0.0, 0.0), 2);
    // Words are exact or wrong.
    assert_eq!(faults(budget(0.0, 0.0), f64::INFINITY, 0.0), 1);
    assert_eq!(faults(budget(f64::NAN, 1.0), 0.0, 0.0), 1);
}
