//! The step response: time of a response, what a sweep costs on average, and the fates of a random sample.
//!
//! `cargo bench --bench step` prints all three on one thread. Steps are exact; times are medians. The floor is the
//! arithmetic of a series at every step, 500 multiplications and as many additions, at the rate of a vectorised loop.

use std::hint::black_box;

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::Status;
use slipsweep::stability::response::{Outcome, Step};

mod support;

const PAPER: Law = Law { a: 0.005, b: 0.01 };
const MASS: f64 = 2.5e-16;
const V_F: f64 = 3.2e6;

/// Critical stiffness at `V_F`.
const CRITICAL: f64 = 0.00756;

/// Rows and columns of the plane of stiffness and final velocity.
const PLANE: usize = 60;

/// Random steps.
const SAMPLE: usize = 10_000;

fn paper(k: f64, v_f: f64) -> Step {
    Step { transition: Transition { law: PAPER, v_i: 1e5, v_f }, k, m: MASS }
}

/// Multiplications and additions of a step.
const OF_A_STEP: f64 = 1000.0;

fn main() {
    let series = OF_A_STEP * support::one_vector_operation();
    println!("a step's multiplications and additions of a vector: {:.1} ns", 1e9 * series);
    for (name, k) in [
        ("the paper's case", 7.5e-3),
        ("k = 0.5 k_c", 0.5 * CRITICAL),
        ("k = 2 k_c", 2.0 * CRITICAL),
        ("k = (1 + 1e-4) k_c", (1.0 + 1e-4) * CRITICAL),
        ("k = (1 - 1e-4) k_c", (1.0 - 1e-4) * CRITICAL),
    ] {
        for rtol in [1e-4, 1e-6, 1e-9] {
            let step = paper(k, V_F);
            let seconds = support::median(21, || {
                black_box(black_box(&step).respond(rtol));
            });
            let steps = step.respond(rtol).1.map_or(0, |response| response.steps);
            println!(
                "{name:18} rtol {rtol:e}: {:6.3} ms, {steps} steps, {:.0} of the floor",
                1e3 * seconds,
                seconds / (f64::from(steps) * series)
            );
        }
    }
    let plane: Vec<Step> = (0..PLANE * PLANE)
        .map(|i| {
            let place = |i: usize| i as f64 / (PLANE - 1) as f64;
            paper(1e-3 * 100_f64.powf(place(i / PLANE)), 1e5 * 100_f64.powf(place(i % PLANE)))
        })
        .collect();
    let seconds = support::median(1, || {
        plane.iter().for_each(|step| {
            black_box(step.respond(1e-6));
        })
    });
    println!("plane of k and v_f, {} responses: {:.3} ms each", plane.len(), 1e3 * seconds / plane.len() as f64);
    fates();
}

/// Steps over the whole range of every parameter, logarithmically uniform; one in eleven without mass.
fn fates() {
    let mut state = 7;
    let mut random = |least: f64, greatest: f64| least * (greatest / least).powf(uniform(&mut state));
    let steps: Vec<Step> = (0..SAMPLE)
        .map(|_| {
            let (a, share, m) = (random(1e-4, 0.3), random(1.0, 11.0) - 1.0, random(1e-22, 1e-3));
            let law = Law { a, b: share * a };
            let transition = Transition { law, v_i: random(1.001, 1e9), v_f: random(1.001, 1e9) };
            Step { transition, k: random(1e-6, 1e3), m: if m < 1e-20 { 0.0 } else { m } }
        })
        .collect();
    let (mut counts, mut most) = ([0; 4], 0);
    let seconds = support::median(1, || {
        for step in &steps {
            let (status, response) = step.respond(1e-6);
            most = most.max(response.map_or(0, |response| response.steps));
            counts[match (status, response.map(|response| response.outcome)) {
                (_, Some(Outcome::Settled)) => 0,
                (_, Some(Outcome::LimitCycle)) => 1,
                (_, Some(Outcome::Undecided)) => 2,
                (Status::Infeasible, None) => 3,
                (status, None) => panic!("{status:?} without a response: {step:?}"),
            }] += 1;
        }
    });
    let [settled, cycles, undecided, infinite] = counts;
    println!(
        "random sample of {SAMPLE}: {settled} settled, {cycles} limit cycles, {undecided} undecided, {infinite} infinite"
    );
    println!("  {:.2} ms each, at most {most} steps", 1e3 * seconds / SAMPLE as f64);
}

/// Numbers between 0 and 1 from a fixed linear congruence.
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 11) as f64 / (1_u64 << 53) as f64
}
