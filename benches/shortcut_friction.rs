//! One solve of the family `bounded_friction`, compared with the same root by shooting with a library's ODE integrator, in the
//! paper's forward direction and in the one that contracts. One core.
//!
//! `cargo bench --bench shortcut_friction`. The cases: 300 random ones (a, b in 0.01 … 0.1, v in 2 … 100, tau_M in 1.2 … 3, t_f in
//! 0.1 … 10 l/v_f beyond the least), and 300 over a wide range (a in 1e-4 … 0.1, b/a in 0 … 50, v in 1.001 … 1e8, tau_M up to
//! 100, t_f in 1e-6 … 1e3 l/v_f).
//!
//! The floor is three exponentials at every node, over an array and vectorised: friction, `1/theta` and `theta v`, once
//! each, as if Newton's method took one step.

mod support;

use std::collections::BTreeMap;
use std::hint::black_box;

use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, SVector, System};
use slipsweep::model::{Law, Transition};
use slipsweep::numerics::root::{Probe, newton};
use slipsweep::protocol::SolverStats;
use slipsweep::protocol::shortcut::{Case, Obstacle, find};
use support::{median, one_vector_exp};

const CASES: usize = 300;
/// Cases that the shooting is given: it takes much longer.
const SHOTS: usize = 40;

fn main() {
    let family = find("bounded_friction").expect("is a family");
    let node = 3.0 * one_vector_exp();
    println!("three exponentials of a vector: {:.2} ns", 1e9 * node);
    for (name, cases, rtols) in [("typical", typical(), &[1e-6, 1e-10, 1e-13][..]), ("wide", wide(), &[1e-10])] {
        for &rtol in rtols {
            let mut stats = SolverStats::default();
            let mut ends = BTreeMap::new();
            for case in &cases {
                let end = match family.solve(case, rtol, &mut stats) {
                    Ok(_) => "solved",
                    Err(Obstacle::NotConverged) => "not converged",
                    Err(_) => "infeasible",
                };
                *ends.entry(end).or_insert(0) += 1;
            }
            let time = median(3, || {
                for case in &cases {
                    let _ = black_box(family.solve(case, rtol, &mut SolverStats::default()));
                }
            });
            let count = cases.len() as f64;
            let floor = f64::from(stats.nodes) * node;
            println!(
                "{name:<10} {rtol:>6e}: {:>8.1} us, {:>4.1} of the floor, {:>6.0} nodes, {:>4.1} passes, {ends:?}",
                1e6 * time / count,
                time / floor,
                f64::from(stats.nodes) / count,
                f64::from(stats.quadratures) / count
            );
        }
    }
    for contracting in [true, false] {
        shooting(&typical()[..SHOTS], contracting);
    }
}

/// The root by DOP853 at 1e-11, Newton's method with a difference quotient in the same bracketed search.
fn shooting(cases: &[Case], contracting: bool) {
    let family = find("bounded_friction").expect("is a family");
    let (mut solved, mut feasible, mut error) = (0, 0, 0.0f64);
    let members: Vec<_> = cases
        .iter()
        .map(|case| family.solve(case, 1e-12, &mut SolverStats::default()).ok().and_then(|s| s.alpha))
        .collect();
    let time = median(1, || {
        for (case, member) in cases.iter().zip(&members) {
            let Some(member) = member else { continue };
            feasible += 1;
            let forward = !contracting || case.transition.law.b <= case.transition.law.a;
            let probe = |alpha: f64| {
                let miss = shoot(case, alpha, forward)?;
                let near = shoot(case, alpha + 1e-5, forward)?;
                Some(Probe { value: miss, slope: (near - miss) / 1e-5 })
            };
            if let Some(root) = newton(probe, 0.0, (-400.0, 400.0), !forward, 1e-9) {
                solved += 1;
                error = error.max((root.x - member).abs() / (1.0 + member.abs()));
            }
        }
    });
    let direction = if contracting { "contracting" } else { "forward" };
    println!(
        "shooting, {direction}: {:.0} us, {solved} of {feasible} solved, alpha off by {error:.1e}",
        1e6 * time / f64::from(feasible.max(1))
    );
}

struct Sliding {
    case: Case,
    alpha: f64,
    forward: bool,
}

impl System<f64, SVector<f64, 2>> for Sliding {
    fn system(&self, _: f64, y: &SVector<f64, 2>, dy: &mut SVector<f64, 2>) {
        let Transition { law, v_i, v_f } = self.case.transition;
        let gap = |v: f64| self.case.tau_ceiling - 1.0 - (law.a - law.b) * v.ln();
        let x = y[1];
        let fall = gap(v_i) * (x * (gap(v_f) / gap(v_i)).ln() + self.alpha * x * (1.0 - x)).exp();
        let v = ((self.case.tau_ceiling - fall - 1.0 - law.b * y[0]) / law.a).exp();
        let sign = if self.forward { 1.0 } else { -1.0 };
        dy[0] = sign * self.case.t_f * ((-y[0]).exp() - v);
        dy[1] = sign;
    }
}

/// How far `ln theta` ends beyond its target; rises with `alpha`.
fn shoot(case: &Case, alpha: f64, forward: bool) -> Option<f64> {
    let Transition { v_i, v_f, .. } = case.transition;
    let (first, last, x) = if forward { (v_i, v_f, 0.0) } else { (v_f, v_i, 1.0) };
    let start = SVector::<f64, 2>::new(-f64::ln(first), x);
    let sliding = Sliding { case: *case, alpha, forward };
    let mut stepper = Dop853::from_param(
        sliding,
        0.0,
        1.0,
        1.0,
        start,
        1e-11,
        1e-12,
        0.9,
        0.0,
        0.333,
        6.0,
        1.0,
        0.0,
        20_000,
        u32::MAX,
        OutputType::Sparse,
    );
    stepper.integrate().ok()?;
    let miss = stepper.y_out().last()?[0] + last.ln();
    miss.is_finite().then_some(if forward { miss } else { -miss })
}

fn typical() -> Vec<Case> {
    let mut next = support::xorshift();
    let mut within = |low: f64, high: f64| low * (high / low).powf(next());
    (0..CASES)
        .map(|_| {
            let law = Law { a: within(0.01, 0.1), b: within(0.01, 0.1) };
            let (v_i, v_f) = (within(2.0, 100.0), within(2.0, 100.0));
            let t_f = (1.0 / v_f - 1.0 / v_i).max(0.0) + within(0.1, 10.0) / v_f;
            Case { transition: Transition { law, v_i, v_f }, t_f, tau_ceiling: within(1.2, 3.0) }
        })
        .collect()
}

fn wide() -> Vec<Case> {
    let mut next = support::xorshift();
    let mut within = |low: f64, high: f64| low * (high / low).powf(next());
    (0..CASES)
        .map(|_| {
            let a = within(1e-4, 0.1);
            let law = Law { a, b: a * (within(1.0, 51.0) - 1.0) };
            let (v_i, v_f) = (within(1.001, 1e8), within(1.001, 1e8));
            let t_f = (1.0 / v_f - 1.0 / v_i).max(0.0) + within(1e-6, 1e3) / v_f;
            Case { transition: Transition { law, v_i, v_f }, t_f, tau_ceiling: 1.0 + within(1e-2, 99.0) }
        })
        .collect()
}
