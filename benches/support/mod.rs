//! What the benchmarks have in common: how times are taken, and the units of time.

#![allow(dead_code)]

use std::hint::black_box;
use std::time::Instant;

use multiversion::multiversion;
use slipsweep::numerics::elementary::{exp, ln};
use slipsweep::numerics::turning::turning_lanes;

#[path = "../../tests/support/mod.rs"]
pub mod tests;

/// Numbers between 0 and 1 by xorshift.
pub fn xorshift() -> impl FnMut() -> f64 {
    let mut state = 88172645463325252u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

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

/// The least time of each of many short spells over several rounds, added up, in seconds: what others do on the machine
/// meanwhile hardly counts.
pub fn least<T>(rounds: usize, spells: &[T], mut run: impl FnMut(&T)) -> f64 {
    let mut times = vec![f64::INFINITY; spells.len()];
    for _ in 0..rounds {
        for (spell, time) in spells.iter().zip(&mut times) {
            let start = Instant::now();
            run(spell);
            *time = time.min(start.elapsed().as_secs_f64());
        }
    }
    times.iter().sum()
}

/// Seconds of one scalar `f64::ln`: the unit that makes figures comparable across machines.
///
/// The arguments are as a solver meets them, over six decades and in no order; sorted ones take two thirds of the time.
pub fn one_ln() -> f64 {
    let arguments = arguments();
    let all = least(100, &[()], |()| {
        let mut sum = 0.0;
        for _ in 0..PASSES {
            for &x in &arguments {
                sum += black_box(x).ln();
            }
        }
        black_box(sum);
    });
    all / (PASSES * arguments.len()) as f64
}

/// Seconds of one logarithm of ours over an array of the same arguments, as vectorised as the machine allows.
pub fn one_vector_ln() -> f64 {
    of_one(vector_ln)
}

/// Seconds of one exponential of ours over an array, likewise.
pub fn one_vector_exp() -> f64 {
    of_one(vector_exp)
}

/// Seconds of one turning function `U(w)` of ours over an array, likewise.
pub fn one_vector_turning() -> f64 {
    of_one(vector_turning)
}

/// Seconds of one division over an array, likewise.
pub fn one_vector_division() -> f64 {
    of_one(divisions) / DIVISIONS as f64
}

/// Seconds of one multiplication or addition in a long loop over an array, likewise: independent ones, so that nothing
/// waits for a result.
pub fn one_vector_operation() -> f64 {
    of_one(polynomials) / (2 * CHAINS * DEGREE) as f64
}

/// Seconds of an element of an array.
fn of_one(run: impl Fn(&[f64], &mut [f64])) -> f64 {
    let arguments = arguments();
    let mut values = vec![0.0; arguments.len()];
    let all = least(100, &[()], |()| {
        for _ in 0..PASSES {
            run(black_box(&arguments), black_box(&mut values));
        }
    });
    all / (PASSES * arguments.len()) as f64
}

/// Divisions of one element of [`divisions`].
const DIVISIONS: usize = 4;

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn divisions(x: &[f64], y: &mut [f64]) {
    for (x, y) in x.iter().zip(y) {
        *y = (1.0 / x + 2.0 / (x + 1.0)) + (3.0 / (x + 2.0) + 5.0 / (x + 3.0));
    }
}

/// Polynomials of one element of [`polynomials`], and their degree.
const CHAINS: usize = 8;
const DEGREE: usize = 8;

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn polynomials(x: &[f64], y: &mut [f64]) {
    for (x, y) in x.iter().zip(y) {
        let mut sums = [1.0; CHAINS];
        for k in 0..DEGREE {
            for (c, sum) in sums.iter_mut().enumerate() {
                *sum = *sum * x + (k * CHAINS + c) as f64;
            }
        }
        *y = ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]));
    }
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn vector_exp(x: &[f64], y: &mut [f64]) {
    for (x, y) in x.iter().zip(y) {
        *y = exp(*x);
    }
}

/// `U(w)`, eight at a time as in the kernels.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn vector_turning(x: &[f64], y: &mut [f64]) {
    for (x, y) in x.chunks_exact(8).zip(y.chunks_exact_mut(8)) {
        let mut w = [0.0; 8];
        for (w, x) in w.iter_mut().zip(x) {
            *w = (x + 1.0).sqrt() - 3.0;
        }
        y.copy_from_slice(&turning_lanes(&w).excess);
    }
}

const PASSES: usize = 10;

fn arguments() -> Vec<f64> {
    (0..4096).map(|i| 1e-3 * 1e6f64.powf(f64::from(i * 2741 % 4096) / 4096.0)).collect()
}

/// The logarithm of the kernels over an array.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub fn vector_ln(x: &[f64], y: &mut [f64]) {
    for (x, y) in x.iter().zip(y) {
        *y = ln(*x);
    }
}
