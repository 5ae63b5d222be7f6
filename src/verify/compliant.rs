//! `compliant` and `regularised`: the smooth shortcut integrated over time, its control velocity looked at on the way.

use super::course::{Course, Formula, State, arriving};
use super::extremal::{least_time, solve};
use super::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::model::Transition;
use crate::table::STATUS;

/// `ln(v - 1)` over `x = t/t_f`, as the sum of the powers from 0 to 6.
#[derive(Clone, Copy)]
struct Exponent([f64; 7]);

impl Exponent {
    fn new(problem: &Transition, alpha: f64) -> Exponent {
        let (start, end) = ((problem.v_i - 1.0).ln(), (problem.v_f - 1.0).ln());
        let l = end - start;
        Exponent([start, 0.0, 0.0, 10.0 * l + alpha, -15.0 * l - 3.0 * alpha, 6.0 * l + 3.0 * alpha, -alpha])
    }

    /// Value, slope and curvature.
    fn at(&self, x: f64) -> [f64; 3] {
        self.0.iter().rev().fold([0.0; 3], |[f, g, h], c| [f * x + c, g * x + f, h * x + 2.0 * g])
    }

    fn velocity(&self, x: f64) -> f64 {
        1.0 + self.at(x)[0].exp()
    }
}

pub fn check(row: &Row, context: &Context) -> Verdict {
    let numbers = ["t_f", "k", "m"].map(|name| number(row, name));
    let (Some(problem), [Some(t_f), Some(k), Some(m)]) = (transition(row), numbers) else {
        return Verdict::unchecked("an axis is missing");
    };
    let mut verdict = Verdict::default();
    let infeasible = t_f <= least_time(&problem);
    verdict.status(row, infeasible);
    if infeasible || word(row, STATUS) == Some("infeasible") {
        return verdict;
    }
    verdict.demand(row, "alpha");
    let Some(alpha) = number(row, "alpha") else {
        verdict.unchecked = Some("alpha was not written");
        return verdict;
    };
    let course = |alpha: f64| {
        let exponent = Exponent::new(&problem, alpha);
        let formula = Formula::Velocity(Box::new(move |x| exponent.velocity(x)));
        Course { problem, t_f, formula, backward: false }
    };
    let here = course(alpha);
    let Some(states) = here.states() else { return Verdict::unchecked("the integrator did not get there") };
    let Some(&[ln_theta, work, _]) = states.last() else { return verdict };
    let arriving = if alpha == 0.0 { 0.0 } else { arriving(alpha, ln_theta, here.target(), course) };
    verdict.compare(row, "alpha", Some(arriving), None);
    verdict.compare(row, "work", Some(work), None);
    verdict.compare(row, "v_min", Some(here.least(&states, |y| here.velocity(y))), None);
    verdict.compare(row, "v_max", Some(-here.least(&states, |y| -here.velocity(y))), None);
    let exponent = Exponent::new(&problem, alpha);
    let control = |y: &State| {
        let [f, g, h] = exponent.at(y[2]);
        let w = f.exp();
        let (v, v1, v2) = (1.0 + w, w * g / t_f, w * (h + g * g) / (t_f * t_f));
        let rate = (-y[0]).exp() - v;
        v + (problem.law.a * v1 / v + problem.law.b * rate + m * v2) / k
    };
    let (low, high) = (here.least(&states, control), -here.least(&states, |y| -control(y)));
    let size = Some(low.abs().max(high.abs()));
    verdict.compare(row, "v_c_min", Some(low), size);
    verdict.compare(row, "v_c_max", Some(high), size);
    verdict.compare(row, "rigid", Some(k * t_f * t_f / m), None);
    compare_optimum(&mut verdict, row, &problem, t_f, context);
    let simulated = ["amplification", "end_error", "loop_error"];
    if simulated.iter().any(|column| number(row, column).is_some()) {
        verdict.unchecked = Some("simulated columns have no independent route");
    }
    verdict
}

/// `regularised`: its optimum, and that the gap belongs to the works.
pub fn check_regularised(row: &Row, context: &Context) -> Verdict {
    let (Some(problem), Some(t_f)) = (transition(row), number(row, "t_f")) else {
        return Verdict::unchecked("an axis is missing");
    };
    let mut verdict = Verdict::default();
    if word(row, STATUS) != Some("infeasible") {
        compare_optimum(&mut verdict, row, &problem, t_f, context);
        ["work", "gap", "v_min", "v_max", "v_c_min", "v_c_max"].iter().for_each(|column| verdict.demand(row, column));
    }
    verdict.unchecked = verdict.unchecked.or(Some("the smooth pieces have no independent route"));
    verdict
}

fn compare_optimum(verdict: &mut Verdict, row: &Row, problem: &Transition, t_f: f64, context: &Context) {
    let Some(optimum) = solve(problem, t_f, context.bounded) else {
        verdict.unchecked = Some("the integrator did not get there");
        return;
    };
    verdict.compare(row, "work_optimal", Some(optimum.work), None);
    if let Some(work) = number(row, "work") {
        verdict.compare(row, "gap", Some((work - optimum.work) / optimum.work), Some(1.0));
    }
}
