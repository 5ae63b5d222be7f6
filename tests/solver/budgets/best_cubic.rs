//! `best_cubic`: against Newton's method on quadratures at 30 digits.

use super::Known;
use super::case::{Case, Route, Truth};
use super::optimal::AXES;
use super::sweeps::Grid;
use crate::reference::{self, Row};

pub const KNOWN: Known = Known {
    table: "best_cubic",
    grid: Grid::Points,
    regimes: &[
        ("inside", "the best shortcut touches no bound"),
        ("touching", "the best shortcut touches v = 1 between its ends"),
        ("infeasible", "a duration below t_min"),
    ],
    cases,
};

fn cases() -> Vec<Case> {
    let columns = ["alpha_2", "alpha_3", "work", "work_optimal", "gap", "v_min", "v_max", "work_error"];
    let none = Case::at(AXES.into_iter().zip([0.39, 0.03, 0.05, 100.0, 3.0])).within("infeasible");
    let none = none.nulls(&columns, Route::Formula).word("status", "infeasible", Route::Formula);
    let inside = reference::table("best_cubic").into_iter().map(|row| {
        let status = if row.number("v_min") < 1.0 { "below_bound" } else { "ok" };
        let case = point(&row).within("inside").reference(&row, &["v_min"]);
        case.word("status", status, Route::Reference)
    });
    let touching = reference::table("best_cubic_touching").into_iter().map(|row| {
        let case = point(&row).within("touching").knows("v_min", Truth::Exact(1.0), Route::Reference);
        case.word("status", "ok", Route::Reference)
    });
    inside.chain(touching).chain([none]).collect()
}

fn point(row: &Row) -> Case {
    let bounded = row.text("bounded") == "1";
    let case = Case { bounded, ..Case::of(row, &AXES) };
    let case = case.number("alpha_2", row.number("a_2"), Route::Reference);
    let case = case.number("alpha_3", row.number("a_3"), Route::Reference);
    case.reference(row, &["work", "work_optimal", "gap", "v_max"])
}
