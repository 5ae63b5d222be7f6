//! `compliant`: against Taylor series at 50 digits, least works by the judge.

use super::Known;
use super::case::{self, Case, Route, Truth};
use super::optimal::{AXES, least_work, transition};
use super::sweeps::Grid;
use crate::reference::{self, Row};

pub const KNOWN: Known = Known {
    table: "compliant",
    grid: Grid::Points,
    regimes: &[
        ("with mass", "m > 0 on a spring"),
        ("no mass", "m = 0"),
        ("rigid", "k = inf"),
        ("sampled", "the control velocity is held for dt"),
        ("infeasible", "a duration below t_min"),
    ],
    cases,
};

fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = reference::table("compliant").iter().map(point).collect();
    cases.extend(reference::table("compliant_held").iter().map(held));
    let none = at([0.39, 0.03, 0.05, 100.0, 3.0], 0.5, 1e-6, 1e-3).within("infeasible");
    let columns = [
        "alpha",
        "work",
        "work_optimal",
        "gap",
        "v_min",
        "v_max",
        "v_c_min",
        "v_c_max",
        "amplification",
        "sampling_error",
        "stiffness_ratio",
        "open_loop_error",
        "work_error",
        "gap_error",
    ];
    cases.push(none.nulls(&columns, Route::Formula).word("status", "infeasible", Route::Formula));
    cases
}

/// A point with these axes.
fn at(optimum: [f64; 5], k: f64, m: f64, dt: f64) -> Case {
    Case::at(AXES.into_iter().zip(optimum).chain([("k", k), ("m", m), ("dt", dt)]))
}

fn axes(row: &Row, dt: f64) -> Case {
    at(AXES.map(|axis| row.number(axis)), row.number("k"), row.number("m"), dt)
}

fn point(row: &Row) -> Case {
    let (k, m, t_f) = (row.number("k"), row.number("m"), row.number("t_f"));
    let regime = match () {
        () if k.is_infinite() => "rigid",
        () if m == 0.0 => "no mass",
        () => "with mass",
    };
    let case = axes(row, 0.0).within(regime);
    let case = case.reference(row, &["alpha", "work", "v_min", "v_max", "amplification"]);
    let (low, high) = (row.number("v_c_min"), row.number("v_c_max"));
    let greater = low.abs().max(high.abs());
    let case =
        case.scaled("v_c_min", low, greater, Route::Reference).scaled("v_c_max", high, greater, Route::Reference);
    let case = case.nulls(&["sampling_error"], Route::Law);
    let case = match m > 0.0 && k.is_finite() {
        true => case.number("stiffness_ratio", k * t_f * t_f / m, Route::Formula),
        false => case.knows("stiffness_ratio", Truth::Exact(f64::INFINITY), Route::Formula),
    };
    // Under continuous control the error is rounding, amplified.
    let grown = 1.0 + row.number("amplification");
    let case = case.scaled("open_loop_error", 0.0, grown, Route::Law);
    match least_work(&transition(row), t_f, true) {
        Some(least) => case::gap(case, row.number("work"), least, Route::Judge).word("status", "ok", Route::Reference),
        None => case,
    }
}

fn held(row: &Row) -> Case {
    axes(row, row.number("dt")).within("sampled").scaled(
        "sampling_error",
        row.number("sampling_error"),
        1.0,
        Route::Reference,
    )
}
