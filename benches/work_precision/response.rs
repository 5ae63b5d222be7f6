//! The step response over its first three cycles: ours, and the explicit integrator of a library. The stiff integrators
//! of other libraries are in `benches/peers`.

use std::rc::Rc;

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::stability::step_response::{Orbit, ScaledStep, VelocityStep};

use super::integrate::dop853;
use super::measure::{Answer, Kind, Method, Subject, Truth};
use super::reference::{self, Row};

/// Cycles that are followed.
const CYCLES: usize = 3;

/// Steps of the integrator after which an orbit is given up.
const MOST_STEPS: u32 = 100_000;

/// A step, and the time of the third upward crossing of `v = v_f`.
struct Case {
    scaled: ScaledStep,
    t: f64,
}

pub fn subject(tolerances: &[f64]) -> Subject {
    let rows = reference::table("step_response");
    let truth = |row: &Row| {
        let z = row.number("k") * row.number("s_3") / row.number("a");
        Truth { answer: [z, row.number("theta_3").ln()], doubt: 64.0 * f64::EPSILON }
    };
    let truths = rows.iter().map(truth).collect();
    let cases = Rc::new(rows.iter().filter_map(case).collect());
    let methods = vec![
        Method::each("ours", Kind::Ours, tolerances, &cases, ours),
        Method::each("DOP853 (ode_solvers)", Kind::Other, tolerances, &cases, explicit),
    ];
    let error = "greater of the errors of force and state variable after three cycles";
    Subject {
        name: "step",
        cases: "from overshoot to deep stick-slip",
        error,
        truths,
        rows: Vec::new(),
        judge,
        methods,
    }
}

fn case(row: &Row) -> Option<Case> {
    let law = Law { a: row.number("a"), b: row.number("b") };
    let transition = Transition { law, v_i: row.number("ratio"), v_f: 1.0 };
    let scaled = VelocityStep { state_law: StateLaw::Ageing, transition, k: row.number("k"), m: row.number("inertia") }
        .scaled()?;
    Some(Case { scaled, t: row.number("t_3") })
}

/// Force in units of `a`, and `ln theta`: of either, 1 changes the velocity by about a factor e.
fn judge(found: &Answer, truth: &Answer) -> f64 {
    let [force, age] = [0, 1].map(|i| (found[i] - truth[i]).abs());
    if force.is_nan() || age.is_nan() { f64::NAN } else { force.max(age) }
}

/// To the crossing itself, which it finds.
fn ours(case: &Case, tolerance: f64) -> Option<Answer> {
    let ScaledStep { slider, ratio } = &case.scaled;
    // The errors of the steps add up.
    let mut orbit = Orbit::new(slider, slider.steady(ratio.ln()), 0.05 * tolerance, tolerance);
    let mut budget = MOST_STEPS;
    let mut end = [f64::NAN; 3];
    for _ in 0..CYCLES {
        end = orbit.cycle(false, &mut budget).ok()?.end;
    }
    Some([end[0] / slider.a, end[1]])
}

/// To the time of the crossing, which is an input.
fn explicit(case: &Case, tolerance: f64) -> Option<Answer> {
    let ScaledStep { slider, ratio } = &case.scaled;
    let (a, b, inertia, k) = (slider.a, slider.b, slider.inertia, slider.k);
    let slope = |&[z, y, x]: &[f64; 3]| {
        let v = x.exp();
        // The force in units of a, so that all three are of order 1.
        [k / a * (1.0 - v), (-y).exp() - v, (a * (z - x) - b * y) / (inertia * v)]
    };
    let [z, y, x] = slider.steady(ratio.ln());
    let [z, y, _] = dop853(slope, [z / a, y, x], case.t, tolerance, tolerance)?;
    Some([z, y])
}
