//! `step_response`: first peaks, troughs, settling times and limit cycles by Taylor series at 30 digits.

use super::Known;
use super::case::{Case, Route, Truth};
use super::stability::{AXES, with_law};
use super::sweeps::Grid;
use crate::reference::{self, Row};
use slipsweep::model::StateLaw;

pub const KNOWN: Known = Known {
    table: "step_response",
    grid: Grid::Points,
    regimes: &[
        ("settled", "responses that settle"),
        ("limit cycle", "responses that end on a limit cycle"),
        ("at once", "responses that settle at time 0: a rigid spring, or no change of velocity"),
        ("infeasible", "no mass, on a spring softer than b - a"),
        ("slip", "the slip law"),
        ("prz", "the law of Perrin, Rice and Zheng"),
        ("Hopf point", "the first Lyapunov coefficient from its definition"),
    ],
    cases,
};

const NUMBERS: [&str; 8] =
    ["v_peak", "v_trough", "t_peak", "settling_time", "period", "cycle_peak", "cycle_trough", "t_end"];

fn cases() -> Vec<Case> {
    let followed = reference::table("step_response_ends");
    let coefficients = reference::table("hopf");
    let others = reference::table("step_response_laws");
    let ageing = followed.iter().map(point).chain(at_once()).chain(coefficients.iter().map(coefficient));
    ageing.map(|case| with_law(case, "ageing")).chain(others.iter().map(with_other_law)).collect()
}

/// A response with another law than ageing.
fn with_other_law(row: &Row) -> Case {
    let law = StateLaw::find(row.text("law")).expect("is a law");
    let case = match row.text("outcome") {
        "diverged" => endless(Case::of(row, &AXES)),
        _ => point(row),
    };
    with_law(case.within(law.name()), law.name())
}

/// A response whose velocity becomes infinite.
fn endless(case: Case) -> Case {
    let case = case.nulls(&NUMBERS, Route::Law).nulls(&["stick_slip"], Route::Law);
    case.word("outcome", "diverged", Route::Law).word("status", "infeasible", Route::Law)
}

fn point(row: &Row) -> Case {
    let settled = row.optional("period").is_none();
    let case = Case::of(row, &AXES).within(if settled { "settled" } else { "limit cycle" });
    let case = case.reference(row, &["v_peak", "v_trough", "t_peak", "settling_time"]);
    let case = case.reference(row, &["period", "cycle_peak", "cycle_trough"]);
    let last = row.optional("settling_time").unwrap_or(0.0).max(row.optional("t_peak").unwrap_or(0.0));
    let case = case.knows("t_end", Truth::AtLeast(last), Route::Law);
    let case = case.word("outcome", if settled { "settled" } else { "limit_cycle" }, Route::Reference);
    let case = case.knows("stick_slip", Truth::Flag(!settled), Route::Reference);
    // Before v_f is first met it moves from v_i towards it.
    let below = row.number("v_trough").min(row.number("v_i")) < 1.0;
    case.word("status", if below { "below_bound" } else { "ok" }, Route::Reference)
}

/// What takes no time, and what has no end.
fn at_once() -> Vec<Case> {
    let axes = |v_i: f64, k: f64, m: f64| Case::at(AXES.into_iter().zip([0.005, 0.01, v_i, 3.2e6, k, m]));
    let at_once = [axes(1e5, f64::INFINITY, 2.5e-16), axes(3.2e6, 7.5e-3, 2.5e-16)].map(|case| {
        let case = case.within("at once");
        let case = ["v_peak", "v_trough"]
            .into_iter()
            .fold(case, |case, column| case.knows(column, Truth::Exact(3.2e6), Route::Law));
        let case = case.knows("settling_time", Truth::Exact(0.0), Route::Law);
        let case = case.nulls(&["t_peak", "period", "cycle_peak", "cycle_trough"], Route::Law);
        let case = case.word("outcome", "settled", Route::Law).knows("stick_slip", Truth::Flag(false), Route::Law);
        case.word("status", "ok", Route::Law)
    });
    at_once.into_iter().chain([endless(axes(1e5, 4e-3, 0.0).within("infeasible"))]).collect()
}

fn coefficient(row: &Row) -> Case {
    // It is that of any spring, so of one on which nothing is to be simulated.
    let axes = AXES.map(|axis| (axis, if axis == "k" { f64::INFINITY } else { row.number(axis) }));
    Case::at(axes).within("Hopf point").reference(row, &["first_lyapunov_coefficient"])
}
