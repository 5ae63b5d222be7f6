//! `optimal`: against quadratures at 40 digits.

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::Status;
use slipsweep::protocol::optimal;

use super::Known;
use super::case::{Case, Route, Value};
use super::sweeps::Grid;
use crate::judge;
use crate::reference::{self, Row};

pub const KNOWN: Known = Known {
    table: "optimal",
    grid: Grid::Points,
    regimes: &[
        ("speeds up", "accelerations with v(0+) > v_i"),
        ("slows down", "accelerations that slow down first and stay above v = 1"),
        ("floor", "accelerations with time at the floor v = 1"),
        ("short floor", "accelerations a relative 1e-4 to 1e-10 longer than t_floor"),
        ("deceleration", "decelerations longer than 1.01 t_min"),
        ("near t_min", "decelerations of 1 to 1.01 t_min"),
        (
            "special times",
            "a relative 1e-7 and 1e-13 beyond t_cross, t_floor, t_cheapest, t_turn, t_free_in and t_free_out",
        ),
        ("v near 1", "the lower velocity 1e-3 to 1e-12 above v = 1"),
        ("no bound", "accelerations with velocity_bound = false"),
        ("no bound down", "decelerations with velocity_bound = false"),
        ("under ceilings", "ceilings of velocity and friction, every sequence of arcs, near their limits"),
        ("infeasible", "decelerations shorter than t_min"),
        ("slip", "the slip law: waits, then slides on the ceiling, or the reverse"),
        ("rise", "the slip law: decelerations faster than at v = 1"),
        ("ceiling below v_i", "laws slip and prz: a velocity ceiling between both velocities"),
        ("prz", "the law of Perrin, Rice and Zheng, with one switch"),
        ("chatter", "the law of Perrin, Rice and Zheng, with chattering"),
        ("regularised friction", "the ageing law without a floor, with a turning point or not"),
    ],
    cases,
};

/// The axes of an optimal problem.
pub const AXES: [&str; 5] = ["t_f", "a", "b", "v_i", "v_f"];

/// The transition of a row of a reference table.
pub fn transition(row: &Row) -> Transition {
    let law = Law { a: row.number("a"), b: row.number("b") };
    Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") }
}

/// The least time under the bound.
pub fn min_duration(v_i: f64, v_f: f64) -> f64 {
    ((v_i - v_f) / (v_i * (v_f - 1.0))).ln_1p()
}

/// `W*` by the judge, where the optimum is the only one and the judge can determine.
pub fn least_work(transition: &Transition, t_f: f64, bounded: bool) -> Option<f64> {
    let solved = optimal::solve(transition, t_f, bounded, 1e-13);
    let optimum = solved.value.filter(|_| matches!(solved.status, Status::Ok | Status::BelowBound))?;
    let (work, late) = judge::optimal_work(transition, t_f, &optimum)?;
    // What is left grows with the square.
    (late < 1e-12).then_some(work)
}

fn regime(row: &Row) -> &'static str {
    let Transition { v_i, v_f, .. } = transition(row);
    let bounded = row.text("bounded") == "1";
    match row.text("strategy") {
        _ if row.text("regime") == "short_floor" => "short floor",
        _ if row.text("regime") == "v_near_1" => "v near 1",
        _ if row.text("regime").starts_with("near_") => "special times",
        _ if v_f < v_i && !bounded => "no bound down",
        _ if v_f < v_i && row.number("t_f") < 1.01 * min_duration(v_i, v_f) => "near t_min",
        _ if v_f < v_i => "deceleration",
        _ if !bounded => "no bound",
        "speed_up" => "speeds up",
        "slow_down" => "slows down",
        "floor" => "floor",
        word => panic!("`{word}` is no strategy"),
    }
}

fn cases() -> Vec<Case> {
    let numbers = ["work", "v_start", "v_end", "time_at_floor", "hamiltonian", "theta_max"];
    let mut cases: Vec<Case> = Vec::new();
    for row in reference::table("optimal").into_iter().chain(reference::table("optimal_edges")) {
        let bounded = row.text("bounded") == "1";
        let strategy = ["speed_up", "slow_down", "floor"].into_iter().find(|word| *word == row.text("strategy"));
        let below = !bounded && row.number("v_start") < 1.0;
        let case = Case { bounded, ..Case::of(&row, &AXES).within(regime(&row)) };
        let case = case.reference(&row, &numbers);
        // Whether v(0+) is above v_i is reported only where they differ by more than the accuracy.
        let reported = (row.number("v_start") / row.number("v_i") - 1.0).abs() > 1e-6;
        let case = match reported {
            true => case.word("strategy", strategy.expect("is a strategy"), Route::Reference),
            false => case,
        };
        cases.push(case.word("status", if below { "below_bound" } else { "ok" }, Route::Reference));
        // In a little less than the least time there is none.
        if cases.last().is_some_and(|case| case.regime == "near t_min") {
            let Transition { v_i, v_f, .. } = transition(&row);
            let mut case = Case::of(&row, &AXES).within("infeasible");
            case.axes[0].1 = Value::Number(min_duration(v_i, v_f) * (1.0 - 1e-12));
            let case = case.nulls(&numbers, Route::Formula).nulls(&["strategy", "binding"], Route::Formula);
            let case = case.word("bound", "too_fast", Route::Formula);
            cases.push(case.word("status", "infeasible", Route::Formula));
        }
    }
    let none = ["v_ceiling", "tau_ceiling"].map(|axis| (axis, Value::Number(f64::INFINITY)));
    cases.iter_mut().for_each(|case| case.axes.extend(none));
    cases.extend(reference::table("optimal_ceilings").iter().map(under_ceilings));
    cases.iter_mut().for_each(|case| case.axes.push(("law", Value::Word("ageing"))));
    cases.extend(reference::table("relaxed").iter().flat_map(relaxed));
    cases.extend(reference::table("arcsinh_optimal").iter().map(|row| {
        let numbers = [
            ["work", "v_start", "v_end", "hamiltonian", "theta_max"],
            ["t_least", "dwork_da", "dwork_db", "dwork_dv_i", "dwork_dv_f"],
        ];
        let case = Case { friction: "regularised", ..Case::of(row, &AXES).within("regularised friction") };
        case.reference(row, numbers.as_flattened()).word("status", "ok", Route::Reference)
    }));
    cases
}

/// A row of another law than ageing, and the same in a little less than the least time.
fn relaxed(row: &Row) -> [Case; 2] {
    let law = if row.text("law") == "slip" { "slip" } else { "prz" };
    let strategies = ["wait_jerk", "jerk_wait", "chatter", "rise"];
    let strategy = strategies.into_iter().find(|word| *word == row.text("strategy")).expect("is a strategy");
    let regime = match strategy {
        _ if row.number("v_i") > row.number("v_ceiling") => "ceiling below v_i",
        "rise" | "chatter" => strategy,
        _ => law,
    };
    let at = |t_f: f64, regime: &'static str| {
        let mut case = Case::of(row, &AXES).within(regime);
        case.axes[0].1 = Value::Number(t_f);
        let ceilings = [("v_ceiling", row.number("v_ceiling")), ("tau_ceiling", f64::INFINITY)];
        case.axes.extend(ceilings.map(|(axis, value)| (axis, Value::Number(value))));
        case.axes.push(("law", Value::Word(law)));
        case
    };
    let (t_f, t_least) = (row.number("t_f"), row.number("t_least"));
    let numbers = ["work", "v_start", "v_end", "hamiltonian", "theta_max", "friction_max", "t_least"];
    let case = at(t_f, regime).reference(row, &numbers).word("strategy", strategy, Route::Reference);
    // A time is what is left of t_f.
    let times = ["time_at_floor", "time_at_v_ceiling"];
    let case = times.iter().fold(case, |case, &time| case.scaled(time, row.number(time), t_f, Route::Reference));
    let chatter = ["chatter_theta", "chatter_duty", "work_bang_bang"];
    let case = match row.optional("chatter_time") {
        Some(time) => case.reference(row, &chatter).scaled("chatter_time", time, t_f, Route::Reference),
        None => case.nulls(&chatter, Route::Reference).nulls(&["chatter_time"], Route::Reference),
    };
    let case = match row.optional("v_ceiling_least") {
        Some(_) => case.reference(row, &["v_ceiling_least"]),
        None if row.number("v_f") <= row.number("v_i") => case.nulls(&["v_ceiling_least"], Route::Formula),
        None => case,
    };
    let case = case.scaled("dwork_dtau_ceiling", 0.0, 1.0, Route::Formula);
    let case = match row.optional("dwork_dv_ceiling") {
        Some(0.0) => case.scaled("dwork_dv_ceiling", 0.0, 1.0, Route::Reference),
        Some(_) => case.reference(row, &["dwork_dv_ceiling"]),
        None => case,
    };
    let case = match row.optional("dwork_da") {
        Some(_) => case.reference(row, &["dwork_da", "dwork_db", "dwork_dv_i", "dwork_dv_f"]),
        None => case,
    };
    // Friction is positive at any state.
    let highest = row.number("v_ceiling").max(row.number("v_i"));
    let is_positive = 1.0 - row.number("b") * highest.ln() > 0.0;
    let case = if is_positive { case.word("status", "ok", Route::Formula) } else { case };
    let short = at(t_least * (1.0 - 1e-12), "infeasible").nulls(&["work", "strategy"], Route::Formula);
    [case, short.word("status", "infeasible", Route::Formula).word("bound", "too_fast", Route::Formula)]
}

fn under_ceilings(row: &Row) -> Case {
    let bounded = row.text("bounded") == "1";
    let axes = [&AXES[..], &["v_ceiling", "tau_ceiling"]].concat();
    let case = Case { bounded, ..Case::of(row, &axes).within("under ceilings") };
    let numbers = ["work", "v_start", "v_end", "hamiltonian", "theta_max", "friction_max", "t_least"];
    let case = case.reference(row, &numbers).reference(row, &["v_ceiling_least", "tau_ceiling_least"]);
    // A time is what is left of t_f.
    let times = ["time_at_floor", "time_at_v_ceiling", "time_at_tau_ceiling"];
    let t_f = row.number("t_f");
    let case = times.iter().fold(case, |case, &time| case.scaled(time, row.number(time), t_f, Route::Reference));
    // Where the protocol ends in steady sliding the work has a corner.
    let case = match row.text("arcs").ends_with("sit") {
        true => case,
        false => case.reference(
            row,
            &["dwork_da", "dwork_db", "dwork_dv_i", "dwork_dv_f", "dwork_dv_ceiling", "dwork_dtau_ceiling"],
        ),
    };
    let binding = match [row.number("time_at_v_ceiling") > 0.0, row.number("time_at_tau_ceiling") > 0.0] {
        [false, false] => "none",
        [true, false] => "v_ceiling",
        [false, true] => "tau_ceiling",
        [true, true] => "both",
    };
    let case = case.word("binding", binding, Route::Reference).nulls(&["bound"], Route::Reference);
    let below = !bounded && row.number("v_start") < 1.0;
    case.word("status", if below { "below_bound" } else { "ok" }, Route::Reference)
}
