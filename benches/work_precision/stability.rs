//! Linear stability of steady sliding: ours, and the eigenvalues of the matrix from a library.

use std::rc::Rc;

use nalgebra::Matrix3;
use slipsweep::model::Law;
use slipsweep::stability::SteadySliding;

use super::measure::{Answer, Kind, Method, Setting, Subject, Truth};
use super::reference::{self, Row};

/// Steady sliding of a block on a spring.
struct Case {
    law: Law,
    k: f64,
    m: f64,
    v: f64,
}

pub fn subject() -> Subject {
    let rows = reference::table("stability");
    let truth = |row: &Row| Truth { answer: [row.number("growth_rate"), row.number("frequency")], doubt: 0.0 };
    let truths = rows.iter().map(truth).collect();
    let case = |row: &Row| Case {
        law: Law { a: row.number("a"), b: row.number("b") },
        k: row.number("k"),
        m: row.number("m"),
        v: row.number("v"),
    };
    let cases = Rc::new(rows.iter().map(case).collect());
    let once = |name: &str, kind, solve: fn(&Case, f64) -> Option<Answer>| {
        // Nothing is required of the others.
        let tolerance = (kind == Kind::Ours).then_some(TOLERANCE);
        let setting = Setting { name: String::new(), tolerance, ..Setting::each(TOLERANCE, &cases, solve) };
        Method { name: name.into(), kind, settings: vec![setting] }
    };
    let methods = vec![once("ours", Kind::Ours, ours), once("eigenvalues (nalgebra)", Kind::Other, matrix)];
    let error = "relative error of the growth rate";
    Subject {
        name: "stability",
        cases: "up to 1e-13 from the critical stiffness",
        error,
        truths,
        rows: (0..cases.len()).collect(),
        judge,
        methods,
    }
}

/// What ours promises, whatever is asked.
const TOLERANCE: f64 = 1e-13;

/// The relative error of the growth rate; of the wrong sign it is no answer.
fn judge(found: &Answer, truth: &Answer) -> f64 {
    let stable = (found[0] < 0.0) == (truth[0] < 0.0);
    if stable { ((found[0] - truth[0]) / truth[0]).abs() } else { f64::INFINITY }
}

fn ours(case: &Case, _: f64) -> Option<Answer> {
    let found = SteadySliding::new(case.law, case.k, case.m, case.v).eigenvalues()?;
    Some([found.growth_rate, found.frequency])
}

/// Of `(ln v, ln theta, force)`, in units of `l/v`.
fn matrix(case: &Case, _: f64) -> Option<Answer> {
    let Law { a, b } = case.law;
    let inertia = case.m * case.v * case.v;
    let rates = Matrix3::new(-a / inertia, -b / inertia, 1.0 / inertia, -1.0, -1.0, 0.0, -case.k, 0.0, 0.0);
    let found = rates.try_schur(f64::EPSILON, MOST_SWEEPS)?.complex_eigenvalues();
    // The pair if there is one, else the greatest.
    let pair = found.iter().find(|value| value.im != 0.0);
    let real = found.iter().map(|value| value.re).fold(f64::NEG_INFINITY, f64::max);
    Some([case.v * pair.map_or(real, |value| value.re), case.v * pair.map_or(0.0, |value| value.im.abs())])
}

/// Sweeps of the library's iteration after which it gives up.
const MOST_SWEEPS: usize = 1000;
