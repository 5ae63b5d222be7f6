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
pub fn one_ln() -> f64 {
    const CALLS: u32 = 1_000_000;
    let all = median(15, || {
        let mut sum = 0.0;
        for i in 0..CALLS {
            sum += black_box(0.5 + f64::from(i) * 1e-5).ln();
        }
        black_box(sum);
    });
    all / f64::from(CALLS)
}
