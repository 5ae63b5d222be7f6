//! `shortcut`: the families against tables to 25 digits, least works by the judge, under a friction ceiling from the table.

use slipsweep::model::Transition;

use super::Known;
use super::case::{self, Case, Route, Truth, Value};
use super::optimal::{AXES, least_work, min_duration, transition};
use super::sweeps::Grid;
use crate::friction::of_cubic;
use crate::reference::{self, Row};

pub const KNOWN: Known = Known {
    table: "shortcut",
    grid: Grid::Points,
    regimes: &[
        ("step", "family step"),
        ("cubic", "family cubic"),
        ("bounded_velocity", "family bounded_velocity: accelerations, and decelerations longer than 1.01 t_min"),
        ("near t_min", "family bounded_velocity: decelerations shorter than 1.01 t_min"),
        ("bounded_friction", "family bounded_friction, velocities within a factor of 3000"),
        ("short friction", "the same, shorter than 1.01 times its least duration"),
        ("far friction", "family bounded_friction, velocities beyond a factor of 3000"),
        ("infeasible", "no member of the family"),
    ],
    cases,
};

const NUMBERS: [&str; 9] =
    ["alpha", "work", "work_optimal", "gap", "v_min", "v_max", "friction_max", "work_error", "gap_error"];

fn cases() -> Vec<Case> {
    let velocity = reference::table("shortcut_velocity");
    let friction = reference::table("shortcut_friction");
    let families = ["step", "cubic", "bounded_velocity"];
    let velocity = velocity.iter().map(|row| {
        let family = families.into_iter().find(|family| *family == row.text("family")).expect("is a family");
        let Transition { v_i, v_f, .. } = transition(row);
        let near = family == "bounded_velocity" && v_f < v_i && row.number("t_f") < 1.01 * min_duration(v_i, v_f);
        let case = point(row, family, f64::INFINITY, if near { "near t_min" } else { family });
        match row.text("status") {
            "infeasible" => case,
            _ => case.reference(row, &["alpha"]).number("terminal_error", row.number("miss"), Route::Reference),
        }
    });
    let friction = friction.iter().map(|row| {
        let Transition { v_i, v_f, .. } = transition(row);
        let regime = match row.number("t_f") < 1.01 * row.optional("t_least").unwrap_or(0.0) {
            _ if (v_f / v_i).ln().abs() > 8.0 => "far friction",
            true => "short friction",
            false => "bounded_friction",
        };
        let case = point(row, "bounded_friction", row.number("tau_ceiling"), regime);
        match row.text("status") {
            "infeasible" => case,
            _ => case.reference(row, &["alpha"]).knows("terminal_error", Truth::Exact(0.0), Route::Formula),
        }
    });
    velocity.chain(friction).collect()
}

fn point(row: &Row, family: &'static str, tau_ceiling: f64, regime: &'static str) -> Case {
    let (transition, t_f) = (transition(row), row.number("t_f"));
    let late = t_f < min_duration(transition.v_i, transition.v_f);
    // Without the bound on v the families are what they are also in less than t_min.
    let mut case = Case { bounded: !late, ..Case::of(row, &AXES) };
    case.axes.push(("family", Value::Word(family)));
    case.axes.push(("tau_ceiling", Value::Number(tau_ceiling)));
    if row.text("status") == "infeasible" {
        let case = case.within("infeasible").nulls(&NUMBERS, Route::Reference);
        let bound = match family {
            "bounded_velocity" => "time",
            "cubic" => "velocity",
            _ if transition.v_f < transition.v_i => "velocity",
            _ => "friction",
        };
        return case.word("bound", bound, Route::Formula).word("status", "infeasible", Route::Reference);
    }
    let case = case.within(regime).reference(row, &["work", "v_min", "v_max", "friction_max"]);
    let case = case.nulls(&["bound"], Route::Reference);
    // A member under a friction ceiling is compared with the optimum under the same.
    let least = match family {
        "bounded_friction" => row.optional("work_optimal").map(|least| (least, Route::Reference)),
        _ => least_work(&transition, t_f, !late).map(|least| (least, Route::Judge)),
    };
    match least {
        Some((least, route)) => {
            let status = if row.number("v_min") < 1.0 { "below_bound" } else { "ok" };
            let status =
                if friction(row, family, &transition, tau_ceiling) < 0.0 { "negative_friction" } else { status };
            case::gap(case, row.number("work"), least, route).word("status", status, Route::Reference)
        }
        // Where the optimum is not certain to be the least, the status is unproven, and the other columns are compared.
        None => case,
    }
}

/// About the least friction, from the formula of the family; for `bounded_velocity` at both ends, where it is least.
fn friction(row: &Row, family: &str, transition: &Transition, tau_ceiling: f64) -> f64 {
    let &Transition { law, v_i, v_f } = transition;
    match family {
        "cubic" => of_cubic(transition, row.number("t_f"), 0.0, 3.0 * (v_i - v_f) / (v_i * v_f)),
        "bounded_friction" => {
            let room = |v: f64| tau_ceiling - 1.0 - (law.a - law.b) * v.ln();
            let (alpha, l) = (row.number("alpha"), (room(v_f) / room(v_i)).ln());
            let friction = |x: f64| tau_ceiling - room(v_i) * (l * x + alpha * x * (1.0 - x)).exp();
            (0..=5_000).map(|k| friction(f64::from(k) / 5_000.0)).fold(f64::INFINITY, f64::min)
        }
        "step" => {
            let end = 1.0 + (v_f / v_i - 1.0) * (-v_f * row.number("t_f")).exp();
            let friction = |theta_v: f64| 1.0 + (law.a - law.b) * v_f.ln() + law.b * theta_v.ln();
            friction(v_f / v_i).min(friction(end))
        }
        _ => [v_i, v_f].map(|v| 1.0 + (law.a - law.b) * v.ln()).into_iter().fold(f64::INFINITY, f64::min),
    }
}
