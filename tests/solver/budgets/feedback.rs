//! `feedback`: against quadratures at 54 digits.

use super::Known;
use super::case::{Case, Route};
use super::sweeps::Grid;
use crate::reference::{self, Row};

pub const KNOWN: Known = Known {
    table: "feedback",
    grid: Grid::Points,
    regimes: &[
        ("free", "states from which the optimum starts on no bound"),
        ("at the floor", "states from which it starts at v = 1"),
        ("at a ceiling", "states from which it starts at a ceiling"),
        ("infeasible", "states that cannot arrive in the time left"),
    ],
    cases,
};

const AXES: [&str; 7] = ["theta", "t_left", "a", "b", "v_f", "v_ceiling", "tau_ceiling"];

const NUMBERS: [&str; 4] = ["v", "work_to_go", "costate", "gain"];

fn cases() -> Vec<Case> {
    reference::table("feedback").iter().map(point).collect()
}

fn point(row: &Row) -> Case {
    let bounded = row.text("bounded") == "1";
    let case = Case { bounded, ..Case::of(row, &AXES) };
    let (regime, arc) = match row.text("arc") {
        "free" => ("free", "free"),
        "floor" => ("at the floor", "floor"),
        "v_ceiling" => ("at a ceiling", "v_ceiling"),
        "tau_ceiling" => ("at a ceiling", "tau_ceiling"),
        _ => {
            let case = case.within("infeasible").nulls(&NUMBERS, Route::Reference).nulls(&["arc"], Route::Reference);
            return case.word("status", "infeasible", Route::Reference);
        }
    };
    let case = case.within(regime).reference(row, &NUMBERS).word("arc", arc, Route::Reference);
    if bounded { case.word("status", "ok", Route::Reference) } else { case }
}
