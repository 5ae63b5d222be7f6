//! The shortcut of bounded friction: ours, and shooting in the direction that contracts.

use std::rc::Rc;

use slipsweep::model::Transition;
use slipsweep::numerics::root::{Probe, newton};
use slipsweep::protocol::SolverStats;
use slipsweep::protocol::shortcut::{Case, find};

use super::integrate::dop853;
use super::measure::{Answer, Kind, Method, Subject, Truth};
use super::optimal::transition;
use super::reference::{self, Row};

/// Cases are left out whose `t_f` is so little more than the least time that its rounding alone makes this error.
const LOST: f64 = 1e-12;

/// Step of the difference quotient in alpha.
const NUDGE: f64 = 1e-5;

/// Times of relaxation `l/v` within which nothing is stiff.
const SHORT: f64 = 30.0;

pub fn subjects(tolerances: &[f64]) -> [Subject; 2] {
    let rows = reference::table("shortcut_friction").into_iter();
    let is_known = |row: &Row| row.text("status") != "infeasible" && lost_in_time(row) <= LOST;
    let is_short = |row: &Row| row.number("t_f") * row.number("v_max") <= SHORT;
    let (short, stiff) = rows.filter(is_known).partition(is_short);
    [subject("short", short, tolerances), subject("stiff", stiff, tolerances)]
}

fn subject(cases: &'static str, rows: Vec<Row>, tolerances: &[f64]) -> Subject {
    let truth = |row: &Row| Truth { answer: [row.number("work"), row.number("alpha")], doubt: rounding(row) };
    let truths = rows.iter().map(truth).collect();
    let case = |row: &Row| Case {
        transition: transition(row),
        t_f: row.number("t_f"),
        tau_ceiling: row.number("tau_ceiling"),
    };
    let tasks = Rc::new(rows.iter().map(case).collect());
    let methods = vec![
        Method::each("ours", Kind::Ours, tolerances, &tasks, |case: &Case, rtol| {
            let shortcut = find("bounded_friction")?.solve(case, rtol, &mut SolverStats::default()).ok()?;
            Some([shortcut.work, shortcut.alpha?])
        }),
        Method::each("shooting, DOP853", Kind::Other, tolerances, &tasks, shooting),
    ];
    let error = "greater of the errors of the work and of alpha";
    Subject { name: "bounded_friction", cases, error, truths, rows: Vec::new(), judge, methods }
}

/// The relative error of the work, and that of alpha compared with 1.
fn judge(found: &Answer, truth: &Answer) -> f64 {
    let work = ((found[0] - truth[0]) / truth[0]).abs();
    let alpha = (found[1] - truth[1]).abs() / truth[1].abs().max(1.0);
    if work.is_nan() || alpha.is_nan() { f64::NAN } else { work.max(alpha) }
}

fn lost_in_time(row: &Row) -> f64 {
    let t_f = row.number("t_f");
    4.0 * f64::EPSILON * t_f / (t_f - row.number("t_least"))
}

/// What rounding of the case makes: of `t_f`, of the exponent `(tau - 1)/a` of theta, and of the rest that a great
/// change of velocity leaves of theta.
fn rounding(row: &Row) -> f64 {
    let [a, b, v_i, v_f, tau_ceiling] = ["a", "b", "v_i", "v_f", "tau_ceiling"].map(|name| row.number(name));
    let exponent = 64.0 * f64::EPSILON * (1.0 + (tau_ceiling.abs() + b) / a);
    let rest = f64::EPSILON * v_i / v_f + if (v_f / v_i).ln().abs() > 8.0 { 2e-11 } else { 0.0 };
    exponent + lost_in_time(row) + rest
}

/// Newton's method with a difference quotient in alpha; `ln theta`, the work and `x` are integrated forwards for `b <=
/// a` and backwards otherwise.
fn shooting(case: &Case, tolerance: f64) -> Option<Answer> {
    let Transition { law, v_i, v_f } = case.transition;
    let forward = law.b <= law.a;
    let (first, last) = if forward { (v_i, v_f) } else { (v_f, v_i) };
    let spare = |v: f64| case.tau_ceiling - 1.0 - (law.a - law.b) * v.ln();
    let way = (spare(v_f) / spare(v_i)).ln();
    let direction = if forward { 1.0 } else { -1.0 };
    let shoot = |alpha: f64| {
        let slope = |&[y, _, x]: &[f64; 3]| {
            let tau = case.tau_ceiling - spare(v_i) * (x * way + alpha * x * (1.0 - x)).exp();
            let v = ((tau - 1.0 - law.b * y) / law.a).exp();
            [direction * case.t_f * ((-y).exp() - v), case.t_f * tau * v, direction]
        };
        let start = [-first.ln(), 0.0, if forward { 0.0 } else { 1.0 }];
        dop853(slope, start, 1.0, tolerance, 0.1 * tolerance)
    };
    let miss = |[y, ..]: [f64; 3]| direction * (y + last.ln());
    let probe = |alpha: f64| {
        let (value, compared_with) = (miss(shoot(alpha)?), miss(shoot(alpha + NUDGE)?));
        Some(Probe { value, slope: (compared_with - value) / NUDGE })
    };
    let root = newton(probe, 0.0, (-400.0, 400.0), !forward, 10.0 * tolerance)?;
    Some([shoot(root.x)?[1], root.x])
}
