//! The logarithm of the kernels against the alternatives: nanoseconds a value over an array.
//!
//! `cargo bench --bench elementary`. `own` chooses its vector width at run time; `wide` when it is compiled
//! (`RUSTFLAGS=-Ctarget-cpu=native` shows it at its best).

mod support;

use std::hint::black_box;

use support::{median, vector_ln};
use wide::f64x8;

const COUNT: usize = 4096;
const PASSES: usize = 200;

fn main() {
    // Mixed exponents, so that no branch is learnt by heart.
    let x: Vec<f64> = (0..COUNT).map(|i| 1.37f64.powi((i * 7919 % 401) as i32 - 200)).collect();
    let mut y = vec![0.0; COUNT];
    let mut measure = |name: &str, f: &dyn Fn(&[f64], &mut [f64])| {
        let time = median(15, || {
            for _ in 0..PASSES {
                f(black_box(&x), black_box(&mut y));
            }
        });
        println!("{name:<8} {:.2} ns", 1e9 * time / (COUNT * PASSES) as f64);
    };
    measure("own", &vector_ln);
    measure("wide", &|x, y| {
        for (x, y) in x.chunks_exact(8).zip(y.chunks_exact_mut(8)) {
            let lanes: [f64; 8] = std::array::from_fn(|i| x[i]);
            y.copy_from_slice(&f64x8::from(lanes).ln().to_array());
        }
    });
    measure("std", &|x, y| {
        for (x, y) in x.iter().zip(y) {
            *y = x.ln();
        }
    });
}
