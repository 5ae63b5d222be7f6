//! The tables of `docs/accuracy-appendix.md`, from the budgets.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use slipsweep::table::{self, STATUS};

use super::case::Route;
use super::ledger::{Key, Ledger, number};
use super::{KNOWN, Known};

/// How many points a regime of a table has.
type Points = BTreeMap<(&'static str, &'static str), usize>;

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/accuracy-appendix.md")
}

/// Fails unless the page shows these budgets.
pub fn check(ledger: &Ledger, points: &Points) {
    let text = fs::read_to_string(path()).expect("is readable");
    let right = filled(&text, ledger, points) == text;
    assert!(
        right,
        "docs/accuracy-appendix.md shows other budgets: `SLIPSWEEP_BUDGETS=write cargo test --release --test solver budgets`"
    );
}

/// Makes the page show these budgets; a table without a block gets one at the end.
pub fn write(ledger: &Ledger, points: &Points) {
    let mut text = fs::read_to_string(path()).expect("is readable");
    for known in measured(points) {
        if !text.contains(&begin(known)) {
            write!(text, "\n### {}\n\n{}<!-- END -->\n", known.table, begin(known)).expect("is text");
        }
    }
    fs::write(path(), filled(&text, ledger, points)).expect("is writable");
}

/// The tables with points.
fn measured(points: &Points) -> impl Iterator<Item = &'static Known> {
    KNOWN.iter().filter(|known| points.keys().any(|(table, _)| *table == known.table))
}

/// The line before the block of a table.
fn begin(known: &Known) -> String {
    format!("<!-- BEGIN budgets of {} -->\n", known.table)
}

/// The page with the block of every measured table, between `<!-- BEGIN budgets of TABLE -->` and `<!-- END -->`, from the budgets.
fn filled(text: &str, ledger: &Ledger, points: &Points) -> String {
    let mut text = text.to_owned();
    for known in measured(points) {
        let begin = begin(known);
        let (before, rest) =
            text.split_once(&begin).unwrap_or_else(|| panic!("no {begin}in docs/accuracy-appendix.md"));
        let (_, after) = rest.split_once("<!-- END -->").expect("every block has an end");
        text = format!("{before}{begin}\n{}\n<!-- END -->{after}", block(known, ledger, points));
    }
    text
}

/// What an error is measured against, as the page explains it.
fn description(route: Route) -> &'static str {
    match route {
        Route::Judge => "double-double",
        Route::Law => "invariant",
        Route::Reference | Route::Formula | Route::TrueError => route.name(),
    }
}

/// The regimes of a table, and its budgets: a line a column.
fn block(known: &Known, ledger: &Ledger, points: &Points) -> String {
    let mut text = String::new();
    for (regime, meaning) in known.regimes {
        let count = points[&(known.table, *regime)];
        writeln!(text, "- *{regime}*: {meaning}; {count} point{}", if count == 1 { "" } else { "s" }).expect("is text");
    }
    let names = known.regimes.iter().map(|(regime, _)| format!(" {regime} |")).collect::<String>();
    writeln!(text, "\n| column |{names} compared with |\n| --- |{} --- |", " --- |".repeat(known.regimes.len()))
        .expect("is text");
    let table = table::find(known.table).expect("is a table");
    for column in table.columns().iter().map(|column| column.name).chain([STATUS]) {
        let mut routes: Vec<Route> = Vec::new();
        let mut cells = String::new();
        for (regime, _) in known.regimes {
            let Some(budget) = ledger.0.get(&Key::new(known.table, column, regime)) else {
                cells += " - |";
                continue;
            };
            routes.extend(&budget.routes);
            if (budget.rtols, budget.ulps) == (0.0, 0.0) {
                cells += " exact |";
            } else if budget.routes == [Route::TrueError] {
                write!(cells, " {} bound |", budget.rtols.max(budget.ulps)).expect("is text");
            } else {
                let (rtols, ulps) = (number(budget.rtols), number(budget.ulps));
                let inputs = if budget.conditioned { "<br>+ inputs" } else { "" };
                write!(cells, " {rtols} rtol<br>{ulps} ulp{inputs} |").expect("is text");
            }
        }
        routes.sort();
        routes.dedup();
        let routes = routes.into_iter().map(description).collect::<Vec<_>>().join(", ");
        writeln!(text, "| `{column}` |{cells} {routes} |").expect("is text");
    }
    text
}
