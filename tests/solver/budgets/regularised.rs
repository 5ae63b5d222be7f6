//! `regularised`: against the definition at 40 digits.

use super::Known;
use super::case::{Case, Route};
use super::optimal::AXES;
use super::sweeps::Grid;
use crate::reference::{self, Row};

pub const KNOWN: Known = Known {
    table: "regularised",
    grid: Grid::Points,
    regimes: &[
        ("off the bound", "accelerations above v = 1 throughout"),
        ("floor", "accelerations with time at the floor, whose pieces dip below v = 1"),
        ("no bound", "accelerations with velocity_bound = false"),
        ("infeasible", "pieces that overlap, or durations below t_min"),
    ],
    cases,
};

const NUMBERS: [&str; 5] = ["work", "work_optimal", "gap", "v_min", "v_max"];

fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = reference::table("regularised").iter().map(point).collect();
    for (t_f, v_i, v_f, delta_t) in [(0.02, 3.0, 100.0, 0.0101), (0.39, 100.0, 3.0, 1e-3)] {
        let axes = AXES.into_iter().zip([t_f, 0.03, 0.05, v_i, v_f]);
        let case = Case::at(axes.chain([("k", 0.5), ("m", 1e-6), ("delta_t", delta_t)])).within("infeasible");
        let case = case.nulls(&NUMBERS, Route::Formula);
        let case = case.nulls(&["v_c_min", "v_c_max", "work_error", "gap_error"], Route::Formula);
        cases.push(case.word("status", "infeasible", Route::Formula));
    }
    cases
}

fn point(row: &Row) -> Case {
    let bounded = row.text("bounded") == "1";
    let axes = AXES.into_iter().chain(["k", "m", "delta_t"]).map(|axis| (axis, row.number(axis)));
    let regime = match row.text("floor") {
        "1" => "floor",
        _ if bounded => "off the bound",
        _ => "no bound",
    };
    let case = Case { bounded, ..Case::at(axes).within(regime) }.reference(row, &NUMBERS);
    let (low, high) = (row.number("v_c_min"), row.number("v_c_max"));
    let greater = low.abs().max(high.abs());
    let case =
        case.scaled("v_c_min", low, greater, Route::Reference).scaled("v_c_max", high, greater, Route::Reference);
    let status = if row.number("v_min") < 1.0 { "below_bound" } else { "ok" };
    case.word("status", status, Route::Reference)
}
