//! What the benchmarks share: medians, and the unit of time.

#![allow(dead_code)]

use std::hint::black_box;
use std::time::Instant;

/// The median time of several runs, in seconds.
pub fn median(runs: usize, mut run: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[runs / 2]
}

/// Seconds of one scalar `f64::ln`: the unit that makes figures comparable across machines.
///
/// The arguments are as a solver meets them, over six decades and in no order; sorted ones take two thirds of the time.
pub fn one_ln() -> f64 {
    const PASSES: u32 = 100;
    let arguments: Vec<f64> = (0..4096).map(|i| 1e-3 * 1e6f64.powf(f64::from(i * 2741 % 4096) / 4096.0)).collect();
    let all = median(15, || {
        let mut sum = 0.0;
        for _ in 0..PASSES {
            for &x in &arguments {
                sum += black_box(x).ln();
            }
        }
        black_box(sum);
    });
    all / (f64::from(PASSES) * arguments.len() as f64)
}
