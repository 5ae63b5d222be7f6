//! `crossover`: against quadratures at 40 digits.

use super::Known;
use super::case::{Case, Route};
use super::optimal::transition;
use super::sweeps::Grid;
use crate::reference::{self, Row};
use slipsweep::model::Transition;

pub const KNOWN: Known = Known {
    table: "crossover",
    grid: Grid::Points,
    regimes: &[
        ("acceleration", "velocities away from each other and from 1"),
        ("deceleration", "the same, downwards"),
        ("v near 1", "the lower velocity within 0.1 of v = 1"),
        ("v_f near v_i", "velocities within a relative 0.1 of each other"),
    ],
    cases,
};

fn regime(row: &Row) -> &'static str {
    let Transition { v_i, v_f, .. } = transition(row);
    match () {
        () if (v_f / v_i).ln().abs() < 0.1 => "v_f near v_i",
        () if v_i.min(v_f) < 1.1 => "v near 1",
        () if v_f < v_i => "deceleration",
        () => "acceleration",
    }
}

fn cases() -> Vec<Case> {
    let columns = [
        "t_cross",
        "t_floor",
        "t_cheapest",
        "t_min",
        "t_turn",
        "t_free_in",
        "t_free_out",
        "work_at_t_cross",
        "work_at_t_floor",
        "work_at_t_cheapest",
        "work_at_t_min",
        "work_at_t_turn",
    ];
    let case = |row: Row| {
        let case = Case::of(&row, &["a", "b", "v_i", "v_f"]).within(regime(&row)).reference(&row, &columns);
        case.word("status", "ok", Route::Reference)
    };
    reference::table("crossover").into_iter().map(case).collect()
}
