//! One optimal solve and one crossover, in units of one scalar `f64::ln` measured in the same run, on one core.
//!
//! `cargo bench --bench optimal`. The cases: 2,000 random accelerations (a, b in 0.005 … 0.1, v_i in 2 … 50, v_f/v_i in
//! 2 … 100, t_f in 0.1 … 1.2 t_cross), the same under ceilings, and all rows of `tests/reference/optimal.csv`, which hold
//! the hard corners.
//!
//! The floor is one exponential (the map of the chart) and one turning function `U(w)` at every node, over an array and
//! vectorised: no quadrature of these integrals does without them.

#[path = "support/cases.rs"]
mod cases;
mod support;

use std::hint::black_box;

use cases::{Case, ONLY_CROSS, random_accelerations, reference_cases};
use slipsweep::model::Transition;
use slipsweep::protocol::SolverStats;
use slipsweep::protocol::optimal::crossover;
use slipsweep::protocol::optimal::{Bounds, least_tau_ceiling, least_v_ceiling, solve};
use support::{least, one_ln, one_vector_exp, one_vector_turning};

const ROUNDS: usize = 60;

/// Cases that are timed together.
const SPELL: usize = 50;

fn main() {
    let ln = one_ln();
    let node = one_vector_exp() + one_vector_turning();
    println!("one scalar ln: {:.2} ns; exponential and U(w) of a vector: {:.2} ns", 1e9 * ln, 1e9 * node);
    println!(
        "{:<28} {:>6} {:>7} {:>9} {:>8} {:>12} {:>7} {:>10} {:>6}",
        "", "rtol", "cases", "ns", "in ln", "quadratures", "nodes", "floor, ns", "of it"
    );
    let (random, hard) = (random_accelerations(2000), reference_cases());
    for (name, cases) in [("optimal, random", &random), ("optimal, reference table", &hard)] {
        for rtol in [1e-6, 1e-10, 1e-12] {
            measure(name, rtol, cases, [ln, node], |(transition, t_f, bounded)| {
                solve(transition, *t_f, *bounded, rtol).stats
            });
        }
    }
    for (name, which) in [("v_ceiling", [true, false]), ("tau_ceiling", [false, true]), ("both", [true, true])] {
        let cases = under_ceilings(&random, which);
        measure(&format!("optimal, random, {name}"), 1e-10, &cases, [ln, node], |(transition, t_f, bounds)| {
            solve(transition, *t_f, bounds, 1e-10).stats
        });
    }
    measure("crossover t_cross", 1e-12, &random, [ln, node], |(transition, ..)| {
        crossover::solve(transition, true, 1e-12, ONLY_CROSS).2
    });
}

/// Problems under ceilings of the velocity or of friction, halfway between the least feasible one and the peak without any.
fn under_ceilings(cases: &[Case], [of_v, of_tau]: [bool; 2]) -> Vec<(Transition, f64, Bounds)> {
    let bound = |&(transition, t_f, bounded): &Case| {
        let free = solve(&transition, t_f, bounded, 1e-10).value?;
        let mut bounds = Bounds::new(bounded);
        if of_v {
            let least = least_v_ceiling(&transition, t_f, bounds, 1e-6)?;
            bounds = bounds.with_v_ceiling((least * free.v_end).sqrt());
        }
        if of_tau {
            let least = least_tau_ceiling(&transition, t_f, bounds, 1e-6)?;
            bounds = bounds.with_tau_ceiling(0.5 * (least + free.friction_max));
        }
        Some((transition, t_f, bounds))
    };
    cases.iter().filter_map(bound).collect()
}

fn measure<T>(name: &str, rtol: f64, cases: &[T], [ln, node]: [f64; 2], run: impl Fn(&T) -> SolverStats) {
    let (mut quadratures, mut nodes) = (0, 0);
    for case in cases {
        let stats = run(case);
        quadratures += stats.quadratures;
        nodes += stats.nodes;
    }
    let spells: Vec<&[T]> = cases.chunks(SPELL).collect();
    let time = least(ROUNDS, &spells, |cases| {
        for case in *cases {
            black_box(run(case));
        }
    });
    let count = cases.len() as f64;
    let each = time / count;
    let floor = f64::from(nodes) / count * node;
    println!(
        "{name:<28} {rtol:>6e} {count:>7} {:>9.0} {:>8.0} {:>12.2} {:>7.1} {:>10.0} {:>6.2}",
        1e9 * each,
        each / ln,
        f64::from(quadratures) / count,
        f64::from(nodes) / count,
        1e9 * floor,
        each / floor
    );
}
