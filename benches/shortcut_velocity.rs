//! One solve of the families `step`, `cubic` and `bounded_velocity`, compared with bounded_velocity solved the paper's way:
//! shooting with a library's ODE integrator, at the same error. One core.
//!
//! `cargo bench --bench shortcut_velocity`. The cases: 1,000 random ones (a, b in 0.005 … 0.1, v_i in 2 … 50, v_f/v_i or
//! its inverse in 2 … 100, t_f in 1e-3 … 10 l/v_f beyond the least time), 1,000 over the whole range (v up to 1e8, t_f
//! in 1e-6 … 1e3 l/v_f), and the rows of `tests/reference/shortcut_velocity.csv`, which hold the hard corners.
//!
//! The floor is one exponential at every node of `bounded_velocity` and two logarithms at every node of the others, over
//! an array and vectorised: the velocity is an exponential, friction has two logarithms. (Sums of `cubic` do without
//! the latter, those of `step` are closed forms without nodes.)

#[path = "../tests/reference/mod.rs"]
mod reference;
mod support;

use std::cell::Cell;
use std::hint::black_box;

use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, SVector, System};
use slipsweep::model::{Law, Transition};
use slipsweep::numerics::root::{Probe, newton};
use slipsweep::protocol::SolverStats;
use slipsweep::protocol::shortcut::{Case, find};
use support::{median, one_ln, one_vector_exp, one_vector_ln};

const RUNS: usize = 9;
/// Cases that the shooting is given: it takes much longer.
const SHOTS: usize = 40;

fn main() {
    let ln = one_ln();
    let (vector_ln, vector_exp) = (one_vector_ln(), one_vector_exp());
    println!(
        "one scalar ln: {:.2} ns; one of a vector: {:.2} ns, exponential: {:.2} ns",
        1e9 * ln,
        1e9 * vector_ln,
        1e9 * vector_exp
    );
    println!(
        "{:<44} {:>6} {:>6} {:>9} {:>8} {:>7} {:>10} {:>6} {:>10}",
        "", "rtol", "cases", "us", "in ln", "nodes", "floor, us", "of it", "error"
    );
    let mild = random(1000, (2.0, 50.0), (2.0, 100.0), (1e-3, 10.0));
    let wide = random(1000, (1.001, 1e8), (1.0, 1e8), (1e-6, 1e3));
    let table = |family: &str| -> Vec<Case> {
        let rows = reference::table("shortcut_velocity");
        let rows = rows.iter().filter(|row| row.text("family") == family && row.text("status") != "infeasible");
        rows.map(|row| {
            let law = Law { a: row.number("a"), b: row.number("b") };
            let transition = Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") };
            Case { transition, t_f: row.number("t_f"), tau_ceiling: f64::INFINITY }
        })
        .collect()
    };
    for (family, name, cases) in [
        ("step", "step, random", &mild),
        ("cubic", "cubic, random", &mild),
        ("bounded_velocity", "bounded_velocity, random", &mild),
        ("bounded_velocity", "bounded_velocity, whole range", &wide),
        ("bounded_velocity", "bounded_velocity, reference table", &table("bounded_velocity")),
    ] {
        let of_a_node = if family == "bounded_velocity" { vector_exp } else { 2.0 * vector_ln };
        let family = find(family).expect("is a family");
        for rtol in [1e-6, 1e-10, 1e-13] {
            let mut stats = SolverStats::default();
            for case in cases {
                let _ = family.solve(case, rtol, &mut stats);
            }
            let time = median(RUNS, || {
                for case in cases {
                    let _ = black_box(family.solve(case, rtol, &mut SolverStats::default()));
                }
            });
            let (count, nodes) = (cases.len() as f64, f64::from(stats.nodes));
            let each = time / count;
            let floor = nodes / count * of_a_node;
            let fraction = if floor > 0.0 { format!("{:.1}", each / floor) } else { "-".to_owned() };
            println!(
                "{name:<44} {rtol:>6e} {count:>6} {:>9.2} {:>8.0} {:>7.0} {:>10.3} {fraction:>6}",
                1e6 * each,
                each / ln,
                nodes / count,
                1e6 * floor
            );
        }
    }
    for tolerance in [1e-8, 1e-12] {
        shooting(&mild[..SHOTS], tolerance, ln);
    }
}

/// The root by shooting: DOP853 at `tolerance`, Newton's method with a difference quotient in the same bracketed
/// search, work as a third equation. The error is that of the work against the library's at 1e-13.
fn shooting(cases: &[Case], tolerance: f64, ln: f64) {
    let family = find("bounded_velocity").expect("is a family");
    let mut error = 0.0f64;
    let mut solved = 0;
    let shots = Cell::new(0u32);
    let time = median(3, || {
        solved = 0;
        shots.set(0);
        for case in cases {
            let probe = |c: f64| {
                let [miss, near] = [c, c + 1e-5].map(|c| {
                    shots.set(shots.get() + 1);
                    shoot(case, c, tolerance).map(|(theta, _)| (theta * case.transition.v_f).ln())
                });
                Some(Probe { value: miss?, slope: (near? - miss?) / 1e-5 })
            };
            let root = newton(probe, -4.0, (-400.0, f64::INFINITY), false, 10.0 * tolerance);
            let work = root.and_then(|root| shoot(case, root.x, tolerance)).map(|(_, work)| work);
            if let (Some(work), Ok(shortcut)) = (work, family.solve(case, 1e-13, &mut SolverStats::default())) {
                solved += 1;
                error = error.max((work / shortcut.work - 1.0).abs());
            }
        }
    });
    let each = time / cases.len() as f64;
    println!(
        "{:<44} {tolerance:>6e} {:>6} {:>9.0} {:>8.0} {:>25} {error:>10.1e}  {solved} solved, {:.0} integrations each",
        "bounded_velocity, random, by shooting",
        cases.len(),
        1e6 * each,
        each / ln,
        "",
        f64::from(shots.get()) / cases.len() as f64
    );
}

/// Theta, work and `x = t/t_f` along the formula with `alpha_3 t_f^2 = c`. `x` is a variable, since the library's steps
/// shrink to nothing where a system depends on its argument.
struct Sliding {
    case: Case,
    l: f64,
    c: f64,
}

impl System<f64, SVector<f64, 3>> for Sliding {
    fn system(&self, _: f64, y: &SVector<f64, 3>, dy: &mut SVector<f64, 3>) {
        let Transition { law, v_i, .. } = self.case.transition;
        let x = y[2];
        let v = 1.0 + (v_i - 1.0) * (self.l * x - self.c * (1.0 - x) * x).exp();
        dy[0] = self.case.t_f * (1.0 - y[0] * v);
        dy[1] = self.case.t_f * (1.0 + law.a * v.ln() + law.b * y[0].ln()) * v;
        dy[2] = 1.0;
    }
}

fn shoot(case: &Case, c: f64, tolerance: f64) -> Option<(f64, f64)> {
    let Transition { v_i, v_f, .. } = case.transition;
    let sliding = Sliding { case: *case, l: ((v_f - 1.0) / (v_i - 1.0)).ln(), c };
    let start = SVector::<f64, 3>::new(1.0 / v_i, 0.0, 0.0);
    let atol = tolerance * 1e-3 / v_f.max(v_i);
    let mut stepper = Dop853::from_param(
        sliding,
        0.0,
        1.0,
        1.0,
        start,
        tolerance,
        atol,
        0.9,
        0.0,
        0.333,
        6.0,
        1.0,
        0.0,
        2_000,
        u32::MAX,
        OutputType::Sparse,
    );
    stepper.integrate().ok()?;
    let last = stepper.y_out().last()?;
    last[0].is_finite().then_some((last[0], last[1]))
}

fn random(count: usize, v: (f64, f64), ratio: (f64, f64), fraction: (f64, f64)) -> Vec<Case> {
    let mut next = support::xorshift();
    let mut cases = Vec::with_capacity(count);
    while cases.len() < count {
        let mut log_uniform = |(low, high): (f64, f64)| low * (high / low).powf(next());
        let law = Law { a: log_uniform((0.005, 0.1)), b: log_uniform((0.005, 0.1)) };
        let low = log_uniform(v);
        let high = (low * log_uniform(ratio)).min(1e8);
        let (v_i, v_f) = if log_uniform((0.5, 2.0)) > 1.0 { (low, high) } else { (high, low) };
        let least = ((v_i - v_f) / (v_i * (v_f - 1.0))).ln_1p().max(0.0);
        let t_f = least + log_uniform(fraction) / v_f;
        cases.push(Case { transition: Transition { law, v_i, v_f }, t_f, tau_ceiling: f64::INFINITY });
    }
    cases
}
