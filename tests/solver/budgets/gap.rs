//! `gap`: works and least velocities by quadrature at 40 digits, least works by the judge.

use super::Known;
use super::case::{self, Case, Route, Value};
use super::optimal::{least_work, min_duration, transition};
use super::sweeps::Grid;
use crate::friction::of_cubic;
use crate::reference::{self, Row};

pub const KNOWN: Known = Known {
    table: "gap",
    grid: Grid::Shortcuts,
    regimes: &[
        ("v >= 1", "shortcuts of the paper's landscapes and random ones, above v = 1 throughout"),
        ("below v = 1", "the same, below v = 1 somewhere"),
        ("near the border", "shortcuts at a relative 1e-3 to 1e-12 from the border, where theta or v is 0"),
        ("slip and prz", "shortcuts under the other laws, up to the border of feasibility"),
        ("regularised friction", "shortcuts with regularised friction"),
        ("infeasible", "theta or v not positive somewhere, or durations below t_min"),
    ],
    cases,
};

/// Where the rows near the border of feasibility begin in the reference table.
const INSIDE: usize = 330;

fn cases() -> Vec<Case> {
    let rows = reference::table("landscape");
    assert_eq!((rows[0].text("t_f"), rows.len()), ("0.02", 406));
    let mut cases: Vec<Case> = rows.iter().enumerate().filter_map(|(place, row)| point(row, place >= INSIDE)).collect();
    cases.extend(reference::table("landscape_laws").iter().map(of_law));
    cases.extend(reference::table("arcsinh_gap").iter().map(|row| {
        let case = Case { friction: "regularised", ..shortcut(row).within("regularised friction") };
        let case = case.reference(row, &["work", "v_min"]).word("status", "ok", Route::Reference);
        case::gap(case, row.number("work"), row.number("work_optimal"), Route::Reference)
    }));
    cases
}

/// A shortcut with the coefficients of a row.
fn shortcut(row: &Row) -> Case {
    let case = Case::of(row, &super::optimal::AXES);
    let axes = [("alpha_2", row.number("a_2")), ("alpha_3", row.number("a_3"))];
    Case { axes: case.axes.into_iter().chain(Case::at(axes).axes).collect(), ..case }
}

/// A shortcut under the slip law, or that of Perrin, Rice and Zheng.
fn of_law(row: &Row) -> Case {
    let mut case = shortcut(row).within("slip and prz");
    let law = if row.text("law") == "slip" { "slip" } else { "prz" };
    case.axes.extend([("law", Value::Word(law)), ("v_ceiling", Value::Number(row.number("v_ceiling")))]);
    let case = case.reference(row, &["work", "v_min", "v_max"]);
    match (row.optional("work"), row.optional("work_optimal")) {
        (Some(work), Some(least)) => case::gap(case, work, least, Route::Reference),
        _ => case,
    }
}

fn point(row: &Row, border: bool) -> Option<Case> {
    let (transition, t_f) = (transition(row), row.number("t_f"));
    let case = shortcut(row);
    let late = t_f < min_duration(transition.v_i, transition.v_f);
    if late || row.text("status") == "infeasible" {
        let numbers = ["work", "work_optimal", "gap", "v_min", "v_max", "work_error", "gap_error"];
        let case = case.within("infeasible").nulls(&numbers, Route::Reference);
        return Some(case.word("status", "infeasible", Route::Reference));
    }
    // Where the optimum is not certain to be the least, only the status is compared.
    let work_optimal = least_work(&transition, t_f, true)?;
    let work = row.number("work");
    let (status, regime) = match row.text("status") {
        "ok" => ("ok", "v >= 1"),
        _ => ("below_bound", "below v = 1"),
    };
    let friction = of_cubic(&transition, t_f, row.number("a_2"), row.number("a_3"));
    let status = if friction < 0.0 { "negative_friction" } else { status };
    let case = case.within(if border { "near the border" } else { regime });
    let case = case.reference(row, &["work", "v_min", "v_max"]).word("status", status, Route::Reference);
    Some(case::gap(case, work, work_optimal, Route::Judge))
}
