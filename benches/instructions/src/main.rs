//! One kernel at work, for `benches/instructions/run` to count its instructions.
//!
//! The argument names the kernel. What happens within `measured` counts; the Gauss rules are made before.

#[path = "../../support/cases.rs"]
mod cases;

use std::hint::black_box;

use cases::{ONLY_CROSS, random_accelerations, reference_cases};
use slipsweep::model::{Law, Transition};
use slipsweep::numerics::elementary::ln;
use slipsweep::protocol::Status;
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::optimal::{crossover, solve};

/// All kernels.
const KERNELS: [&str; 5] = ["ln", "optimal", "optimal_reference", "crossover", "landscape"];

/// Random cases.
const CASES: usize = 200;

fn main() -> Result<(), String> {
    match std::env::args().nth(1).as_deref() {
        None => println!("{}", KERNELS.join("\n")),
        Some("ln") => {
            let x: Vec<f64> = (1..=4096).map(|i| 1e-3 * f64::from(i)).collect();
            twice(|| x.iter().map(|&x| ln(black_box(x))).sum());
        }
        Some("optimal") => {
            let cases = random_accelerations(CASES);
            twice(|| cases.iter().map(|(transition, t_f, bounded)| least_work(transition, *t_f, *bounded)).sum());
        }
        Some("optimal_reference") => {
            let cases = reference_cases();
            twice(|| cases.iter().map(|(transition, t_f, bounded)| least_work(transition, *t_f, *bounded)).sum());
        }
        Some("crossover") => {
            let cases = random_accelerations(CASES);
            let time = |transition| crossover::solve(transition, true, 1e-12, ONLY_CROSS).1.t_cross.unwrap_or(0.0);
            twice(|| cases.iter().map(|(transition, ..)| time(transition)).sum());
        }
        Some("landscape") => {
            let transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f: 100.0 };
            let landscape = Landscape::new(&transition, 0.02, 1e-10);
            twice(|| works(&landscape));
        }
        Some(other) => return Err(format!("no kernel `{other}`; there are {}", KERNELS.join(", "))),
    }
    Ok(())
}

/// Once to warm up, once to be counted.
fn twice(run: impl Fn() -> f64) {
    black_box(run());
    black_box(measured(&run));
}

#[inline(never)]
fn measured(run: &dyn Fn() -> f64) -> f64 {
    run()
}

fn least_work(transition: &Transition, t_f: f64, bounded: bool) -> f64 {
    solve(black_box(transition), t_f, bounded, 1e-12).value.map_or(0.0, |optimum| optimum.work)
}

/// The works of the feasible points on 41 lines of the paper's landscape, about as many together as a run takes.
fn works(landscape: &Landscape) -> f64 {
    const POINTS: usize = 401;
    let axis: [f64; POINTS] = std::array::from_fn(|i| -0.5 + i as f64 / (POINTS - 1) as f64);
    let lines: Vec<f64> = axis.iter().copied().step_by(10).collect();
    let mut sum = 0.0;
    for lines in lines.chunks(5) {
        let a_2: Vec<f64> = lines.iter().flat_map(|&a_2| [a_2; POINTS]).collect();
        let a_3 = axis.repeat(lines.len());
        let (mut work, mut v_min) = (vec![0.0; a_2.len()], vec![0.0; a_2.len()]);
        let mut status = vec![Status::NotConverged; a_2.len()];
        let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
        landscape.evaluate(&a_2, &a_3, out);
        sum += work.iter().sum::<f64>();
    }
    sum
}
