//! The optimal protocols that benchmarks solve.

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::optimal::crossover::{self, Wanted};

#[path = "../../tests/reference/mod.rs"]
pub mod reference;

/// Only `t_cross`, `work_at_t_cross`.
pub const ONLY_CROSS: Wanted =
    Wanted { cross: true, floor: false, cheapest: false, min: false, turn: false, free: false };

/// One problem: the transition, its time, and whether `v >= 1`.
pub type Case = (Transition, f64, bool);

/// All rows of `tests/reference/optimal.csv`.
pub fn reference_cases() -> Vec<Case> {
    let case = |row: &reference::Row| {
        let law = Law { a: row.number("a"), b: row.number("b") };
        let transition = Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") };
        (transition, row.number("t_f"), row.text("bounded") == "1")
    };
    reference::table("optimal").iter().map(case).collect()
}

/// Accelerations: a, b in 0.005 … 0.1, v_i in 2 … 50, v_f/v_i in 2 … 100, t_f in 0.1 … 1.2 t_cross.
pub fn random_accelerations(count: usize) -> Vec<Case> {
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
        let fraction = 0.1 + 1.1 * next();
        let transition = Transition { law, v_i, v_f };
        if let (_, crossover::CrossoverTimes { t_cross: Some(t_cross), .. }, _) =
            crossover::solve(&transition, true, 1e-12, ONLY_CROSS)
        {
            cases.push((transition, fraction * t_cross, true));
        }
    }
    cases
}
