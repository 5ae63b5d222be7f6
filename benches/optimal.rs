//! One optimal solve and one crossover, in units of one scalar `f64::ln` measured in the same run, on one core.
//!
//! `cargo bench --bench optimal`. The cases: 2,000 random accelerations (a, b in 0.005 … 0.1, v_i in 2 … 50, v_f/v_i in
//! 2 … 100, t_f in 0.1 … 1.2 t_cross), and all rows of `tests/reference/optimal.csv`, which hold the hard corners.

#[path = "../tests/reference/mod.rs"]
mod reference;
mod support;

use std::hint::black_box;

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::optimal::crossover::{self, Wanted};
use slipsweep::protocol::optimal::solve;
use support::{median, one_ln};

const RUNS: usize = 15;
const ONLY_CROSS: Wanted = Wanted { cross: true, hold: false, cheapest: false, min: false, turn: false, free: false };

/// One problem: the transition, its time, and whether `v >= 1`.
type Case = (Transition, f64, bool);

fn main() {
    let ln = one_ln();
    println!("one scalar ln: {:.2} ns", 1e9 * ln);
    println!("{:<28} {:>6} {:>7} {:>9} {:>8} {:>12} {:>7}", "", "rtol", "cases", "ns", "in ln", "quadratures", "nodes");
    let random = random_accelerations(2000);
    let hard: Vec<Case> = reference::table("optimal")
        .iter()
        .map(|row| {
            let law = Law { a: row.number("a"), b: row.number("b") };
            let transition = Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") };
            (transition, row.number("t_f"), row.text("bounded") == "1")
        })
        .collect();
    for (name, cases) in [("optimal, random", &random), ("optimal, reference table", &hard)] {
        for rtol in [1e-6, 1e-10, 1e-12] {
            let (mut quadratures, mut nodes) = (0, 0);
            for (transition, t_f, bounded) in cases {
                let effort = solve(transition, *t_f, *bounded, rtol).effort;
                quadratures += effort.quadratures;
                nodes += effort.nodes;
            }
            let time = median(RUNS, || {
                for (transition, t_f, bounded) in cases {
                    black_box(solve(transition, *t_f, *bounded, rtol));
                }
            });
            report(name, rtol, cases.len(), time, ln, quadratures, nodes);
        }
    }
    let (mut quadratures, mut nodes) = (0, 0);
    for (transition, ..) in &random {
        let (_, _, effort) = crossover::solve(transition, true, 1e-12, ONLY_CROSS);
        quadratures += effort.quadratures;
        nodes += effort.nodes;
    }
    let time = median(RUNS, || {
        for (transition, ..) in &random {
            black_box(crossover::solve(transition, true, 1e-12, ONLY_CROSS));
        }
    });
    report("crossover t_cross", 1e-12, random.len(), time, ln, quadratures, nodes);
}

fn report(name: &str, rtol: f64, cases: usize, time: f64, ln: f64, quadratures: u32, nodes: u32) {
    let count = cases as f64;
    let each = time / count;
    println!(
        "{name:<28} {rtol:>6e} {cases:>7} {:>9.0} {:>8.0} {:>12.2} {:>7.1}",
        1e9 * each,
        each / ln,
        f64::from(quadratures) / count,
        f64::from(nodes) / count
    );
}

fn random_accelerations(count: usize) -> Vec<Case> {
    let mut state = 88172645463325252u64;
    let mut next = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut cases = Vec::with_capacity(count);
    while cases.len() < count {
        let mut log_uniform = |low: f64, high: f64| low * (high / low).powf(next());
        let law = Law { a: log_uniform(0.005, 0.1), b: log_uniform(0.005, 0.1) };
        let v_i = log_uniform(2.0, 50.0);
        let v_f = v_i * log_uniform(2.0, 100.0);
        let share = 0.1 + 1.1 * next();
        let transition = Transition { law, v_i, v_f };
        if let (_, crossover::CrossoverTimes { t_cross: Some(t_cross), .. }, _) =
            crossover::solve(&transition, true, 1e-12, ONLY_CROSS)
        {
            cases.push((transition, share * t_cross, true));
        }
    }
    cases
}
