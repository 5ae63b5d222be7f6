//! The optimal solve: ours, and the paper's shooting.

use std::rc::Rc;

use slipsweep::model::{Law, Transition};
use slipsweep::numerics::root::crossing;
use slipsweep::protocol::optimal::{Bounds, solve};

use super::integrate::dop853;
use super::measure::{Answer, Kind, Method, Subject, Truth, relative};
use super::reference::{self, Row};

/// A row of `tests/reference/optimal.csv`.
pub struct Case {
    pub transition: Transition,
    pub t_f: f64,
    pub bounded: bool,
}

pub fn subjects(tolerances: &[f64]) -> [Subject; 2] {
    let (easy, hard) = reference::table("optimal").into_iter().enumerate().partition(|(_, row)| is_regular(row));
    [
        subject("accelerations that stay off the bound", easy, tolerances),
        subject("on the floor, decelerations, unbounded", hard, tolerances),
    ]
}

/// Optima under ceilings of velocity and friction: ours; direct collocation is among the peers.
pub fn under_ceilings(tolerances: &[f64]) -> Subject {
    let rows = reference::table("optimal_ceilings");
    let under = |row: &Row| {
        let Truth { answer, doubt } = truth(row, row.number("t_least"));
        Truth { answer, doubt: doubt + rounding_of_inputs(row) }
    };
    let truths = rows.iter().map(under).collect();
    let case = |row: &Row| {
        let bounds = Bounds::new(row.text("bounded") == "1");
        let bounds = bounds.with_v_ceiling(row.number("v_ceiling")).with_tau_ceiling(row.number("tau_ceiling"));
        (transition(row), row.number("t_f"), bounds)
    };
    let cases: Rc<Vec<(Transition, f64, Bounds)>> = Rc::new(rows.iter().map(case).collect());
    let ours = Method::each("ours", Kind::Ours, tolerances, &cases, |(transition, t_f, bounds), rtol| {
        let optimum = solve(transition, *t_f, bounds, rtol).value?;
        Some([optimum.work, optimum.v_start])
    });
    Subject {
        name: "ceilings",
        cases: "every sequence of arcs, near least ceilings and least times",
        error: "relative error of the work",
        truths,
        rows: (0..rows.len()).collect(),
        judge: relative,
        methods: vec![ours],
    }
}

/// Relative change of the work by four units in the last place of each input, from the slopes of the reference.
fn rounding_of_inputs(row: &Row) -> f64 {
    let inputs = ["a", "b", "v_i", "v_f", "v_ceiling", "tau_ceiling"];
    let slope = |name: &str| row.text(&format!("dwork_d{name}")).parse::<f64>().unwrap_or(0.0);
    let by_time = (row.number("hamiltonian") * row.number("t_f")).abs();
    let effects = inputs.map(|name| slope(name) * row.number(name)).map(f64::abs);
    let change: f64 = effects.into_iter().filter(|effect| effect.is_finite()).sum();
    4.0 * f64::EPSILON * (by_time + change) / row.number("work")
}

/// Whether the paper's own equations hold all along: nothing but the extremal, and `v >= 1` on it.
fn is_regular(row: &Row) -> bool {
    row.number("v_f") > row.number("v_i") && row.text("bounded") == "1" && row.text("strategy") != "floor"
}

pub fn transition(row: &Row) -> Transition {
    let law = Law { a: row.number("a"), b: row.number("b") };
    Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") }
}

fn subject(cases: &'static str, rows: Vec<(usize, Row)>, tolerances: &[f64]) -> Subject {
    let (places, rows): (Vec<usize>, Vec<Row>) = rows.into_iter().unzip();
    let truths = rows.iter().map(|row| truth(row, least_time(row))).collect();
    let solved =
        |row: &Row| Case { transition: transition(row), t_f: row.number("t_f"), bounded: row.text("bounded") == "1" };
    let rows = Rc::new(rows.iter().map(solved).collect());
    let methods = vec![
        Method::each("ours", Kind::Ours, tolerances, &rows, |case: &Case, rtol| {
            let optimum = solve(&case.transition, case.t_f, case.bounded, rtol).value?;
            Some([optimum.work, optimum.v_start])
        }),
        Method::each("shooting, DOP853", Kind::Other, tolerances, &rows, shooting),
    ];
    Subject {
        name: "optimal",
        cases,
        error: "relative error of the work",
        truths,
        rows: places,
        judge: relative,
        methods,
    }
}

/// The least time by its formula.
fn least_time(row: &Row) -> f64 {
    let Transition { v_i, v_f, .. } = transition(row);
    match (v_f < v_i, row.text("bounded") == "1") {
        (false, _) => 0.0,
        (true, true) => ((v_i - v_f) / (v_i * (v_f - 1.0))).ln_1p(),
        (true, false) => 1.0 / v_f - 1.0 / v_i,
    }
}

fn truth(row: &Row, least: f64) -> Truth {
    let (t_f, bounded) = (row.number("t_f"), row.text("bounded") == "1");
    // What is beyond the least time is known no better than t_f itself.
    let doubt = 8.0 * f64::EPSILON + 4.0 * f64::EPSILON * t_f / (t_f - least);
    // Without the bound v(0+) may be as small as e^(-1/a): its tenth is not requested.
    let v_start = if bounded { row.number("v_start") } else { f64::NAN };
    Truth { answer: [row.number("work"), v_start], doubt }
}

/// The paper's equations for theta, v and the multiplier beta, and the work, from a `v(0+)` that makes theta arrive: a
/// bracket of doubling steps in `ln v(0+)`, and the Illinois method inside.
fn shooting(case: &Case, tolerance: f64) -> Option<Answer> {
    let Transition { law: Law { a, b }, v_i, v_f } = case.transition;
    let (theta_0, theta_1) = (1.0 / v_i, 1.0 / v_f);
    let shoot = |ln_v: f64| {
        let v = ln_v.exp();
        let beta = -(1.0 + a + a * ln_v + b * theta_0.ln()) / theta_0;
        let slope = |&[theta, v, beta, _]: &[f64; 4]| {
            let pull = b / theta + beta;
            let work = (1.0 + a * v.ln() + b * theta.ln()) * v;
            [1.0 - theta * v, -v / a * pull, v * pull, work].map(|rate| rate * case.t_f)
        };
        dop853(slope, [theta_0, v, beta, 0.0], 1.0, tolerance, 1e-3 * tolerance * theta_1.min(theta_0))
    };
    // Where it does not get to the end, v has run away, and theta with it towards 0.
    let miss = |ln_v: f64| shoot(ln_v).map_or(-1.0, |[theta, ..]| (theta / theta_1).max(1e-300).ln().max(-1.0));
    let mut low = v_i.ln();
    let (mut at_low, mut step) = (miss(low), 0.5);
    let outwards = if at_low > 0.0 { 1.0 } else { -1.0 };
    let (high, at_high) = loop {
        let next = low + outwards * step;
        let at_next = miss(next);
        if (at_next > 0.0) != (at_low > 0.0) {
            break (next, at_next);
        }
        (low, at_low, step) = (next, at_next, 2.0 * step);
        if step > 100.0 {
            return None;
        }
    };
    let ln_v = crossing(miss, [low, high], [at_low, at_high], tolerance);
    let [theta, _, _, work] = shoot(ln_v)?;
    ((theta / theta_1 - 1.0).abs() < 1e-2).then_some([work, ln_v.exp()])
}
