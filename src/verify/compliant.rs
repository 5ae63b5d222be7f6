//! `compliant`: the smooth shortcut integrated over time, with the extremes of its control velocity.

use super::extremal::{min_duration, solve};
use super::formula_path::{Formula, FormulaPath, State, arriving};
use super::open_loop::{ControlledProtocol, growth, is_stiff};
use super::verdict::{Context, Verdict, number, transition, word};
use crate::dataset::{Cell, Row};
use crate::model::Transition;
use crate::protocol::SpringBlock;
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

    /// Velocity and its first two derivatives in time.
    fn moment(&self, x: f64, t_f: f64) -> [f64; 3] {
        let [f, g, h] = self.at(x);
        let w = f.exp();
        [1.0 + w, w * g / t_f, w * (h + g * g) / (t_f * t_f)]
    }
}

pub fn check(row: &Row, context: &Context, rtol: f64) -> Verdict {
    let numbers = ["t_f", "k", "m"].map(|name| number(row, name));
    let (Some(problem), [Some(t_f), Some(k), Some(m)]) = (transition(row), numbers) else {
        return Verdict::unchecked("an axis is missing");
    };
    let mut verdict = Verdict::default();
    let infeasible = t_f <= min_duration(&problem);
    verdict.status(row, infeasible);
    if infeasible || word(row, STATUS) == Some("infeasible") {
        return verdict;
    }
    verdict.demand(row, "alpha");
    let formula_path = |alpha: f64| {
        let exponent = Exponent::new(&problem, alpha);
        let formula = Formula::Velocity(Box::new(move |x| exponent.velocity(x)));
        FormulaPath { problem, t_f, formula, backward: false }
    };
    let Some(alpha) = number(row, "alpha").or_else(|| member(&problem, formula_path)) else {
        verdict.miss("alpha was not written, and theta at the end does not determine it");
        return verdict;
    };
    let here = formula_path(alpha);
    let Some(states) = here.states() else { return Verdict::unchecked("the integrator did not get there") };
    let Some(&[ln_theta, work, _]) = states.last() else { return verdict };
    let arriving = if alpha == 0.0 { 0.0 } else { arriving(alpha, ln_theta, here.target(), formula_path) };
    verdict.compare(row, "alpha", Some(arriving), None);
    verdict.compare(row, "work", Some(work), None);
    verdict.compare(row, "v_min", Some(here.least(&states, |y| here.velocity(y))), None);
    verdict.compare(row, "v_max", Some(-here.least(&states, |y| -here.velocity(y))), None);
    verdict.friction(row, here.least(&states, |y| here.friction(y)));
    let slider = SpringBlock { law: problem.law, k, m };
    let exponent = Exponent::new(&problem, alpha);
    let control = |x: f64, ln_theta: f64| {
        let [v, v1, v2] = exponent.moment(x, t_f);
        v + (problem.law.a * v1 / v + problem.law.b * ((-ln_theta).exp() - v) + m * v2) / k
    };
    let low = here.least(&states, |y| control(y[2], y[0]));
    let high = -here.least(&states, |y| -control(y[2], y[0]));
    let size = Some(low.abs().max(high.abs()));
    verdict.compare(row, "v_c_min", Some(low), size);
    verdict.compare(row, "v_c_max", Some(high), size);
    verdict.compare(row, "stiffness_ratio", Some(if m > 0.0 { k * t_f * t_f / m } else { f64::INFINITY }), None);
    let protocol = ControlledProtocol {
        slider,
        v_i: problem.v_i,
        v_f: problem.v_f,
        t_f,
        velocity: |x| exponent.velocity(x),
        control,
    };
    let least = states.iter().map(|y| here.velocity(y)).fold(f64::INFINITY, f64::min);
    // The pull of the spring in units of a, and its pull under the greatest control alone: rounding errors are proportional to the former,
    // errors of the control to the latter.
    let pull = |y: &State| (here.friction(y) + m * exponent.moment(y[2], t_f)[1]).abs() / problem.law.a;
    let pull = states.iter().map(pull).fold(0.0, f64::max);
    let reach = if k.is_finite() { k / problem.law.a * t_f * low.abs().max(high.abs()) } else { 0.0 };
    open_loop(&mut verdict, row, &protocol, &Along { formula_path: &here, states: &states, least, pull, reach }, rtol);
    compare_optimum(&mut verdict, row, &problem, t_f, context);
    verdict
}

/// Extremes along a protocol.
struct Along<'a> {
    formula_path: &'a FormulaPath,
    states: &'a [State],
    /// Least velocity.
    least: f64,
    /// Greatest pull of the spring, in units of `a`.
    pull: f64,
    /// The greatest extension of the spring, in the same units.
    reach: f64,
}

/// Number of samples beyond which the row is not checked.
const MOST_SAMPLES: f64 = 3000.0;

/// Amplifications below this have fewer digits.
const MIN_AMPLIFICATION: f64 = 1e-2;

/// The columns of open-loop control.
fn open_loop<V, C>(verdict: &mut Verdict, row: &Row, protocol: &ControlledProtocol<V, C>, along: &Along<'_>, rtol: f64)
where
    V: Fn(f64) -> f64,
    C: Fn(f64, f64) -> f64,
{
    let dt = number(row, "dt").unwrap_or(0.0);
    if dt == 0.0 {
        verdict.compare(row, "sampling_error", None, None);
    }
    let columns = ["amplification", "sampling_error", "open_loop_error"];
    let [grown, held, closed] = columns.map(|column| number(row, column));
    if row.iter().any(|(name, cell)| {
        *cell == Cell::Missing && (name != "sampling_error" || dt > 0.0) && columns.contains(&name.as_str())
    }) {
        verdict.miss("numbers of a motion that was given up");
    }
    if grown.or(held).or(closed).is_none() {
        return;
    }
    if is_stiff(&protocol.slider, along.least, protocol.t_f) {
        verdict.miss("motions too stiff for an explicit integrator");
        return;
    }
    let Some(growth) = growth(&protocol.slider, along.formula_path, along.states, &protocol.velocity) else {
        verdict.miss("motions too stiff for an explicit integrator");
        return;
    };
    let noise = 1e-11 * growth.most / rtol;
    verdict.compare_number(row, "amplification", growth.whole, growth.whole.max(MIN_AMPLIFICATION).max(noise));
    // An error of the control of size rtol, at any time, has grown at the end.
    let felt = (1.0 + along.reach + 1e-14 / rtol * along.pull) * (1.0 + growth.most);
    let mut compare = |column: &'static str, dt: Option<f64>, scale: f64| match protocol.miss(dt) {
        Some(expected) => verdict.compare_number(row, column, expected, scale.max(expected)),
        None => verdict.miss("motions too stiff for an explicit integrator"),
    };
    if closed.is_some() {
        compare("open_loop_error", None, felt);
    }
    if held.is_some() && protocol.t_f / dt <= MOST_SAMPLES {
        compare("sampling_error", Some(dt), felt);
    } else if held.is_some() {
        verdict.miss("controls sampled more than 3000 times");
    }
}

/// The parameter for which theta arrives; `None` if theta does not determine it.
fn member(problem: &Transition, formula_path: impl Fn(f64) -> FormulaPath) -> Option<f64> {
    const ARRIVAL_DISTANCE: f64 = 1e-10;
    let miss = |alpha: f64| {
        let formula_path = formula_path(alpha);
        Some(formula_path.states()?.last()?[0] - formula_path.target())
    };
    // Theta at the end falls as alpha rises.
    let rise = ((problem.v_f - 1.0) / (problem.v_i - 1.0)).ln().abs().max(1.0);
    let (mut low, mut high) = (-rise, rise);
    while miss(low)? < ARRIVAL_DISTANCE {
        low *= 2.0;
        if low < -1e9 {
            return None;
        }
    }
    while miss(high)? > -ARRIVAL_DISTANCE {
        high *= 2.0;
        if high > 1e9 {
            return None;
        }
    }
    for _ in 0..70 {
        let middle = 0.5 * (low + high);
        if miss(middle)? > 0.0 { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

fn compare_optimum(verdict: &mut Verdict, row: &Row, problem: &Transition, t_f: f64, context: &Context) {
    let Some(optimum) = solve(problem, t_f, context.bounded) else {
        verdict.miss("the integrator did not get there");
        return;
    };
    verdict.compare(row, "work_optimal", Some(optimum.work), None);
    if let Some(work) = number(row, "work") {
        verdict.compare(row, "gap", Some((work - optimum.work) / optimum.work), Some(1.0));
    }
}
