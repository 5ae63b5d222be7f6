//! One landscape point over the paper's landscape, in units of one scalar `f64::ln` measured in the same run.
//!
//! `cargo bench --bench landscape`. The least of several passes on one core; feasibility and `v_min` of all points,
//! feasible or not, are in the time.

use std::hint::black_box;
use std::time::Instant;

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::cubic::{Landscape, Shortcuts};
use slipsweep::protocol::{Effort, Status};

const POINTS: usize = 401;
const PASSES: usize = 15;

fn main() {
    // Arguments as a solver meets them: over six decades, in no order.
    let arguments: Vec<f64> = (0..4096).map(|i| 1e-3 * 1e6f64.powf(f64::from(i * 2741 % 4096) / 4096.0)).collect();
    let ln = least(|| {
        let start = Instant::now();
        let mut sum = 0.0;
        for _ in 0..100 {
            for &x in &arguments {
                sum += black_box(x).ln();
            }
        }
        black_box(sum);
        start.elapsed().as_secs_f64() / (100.0 * arguments.len() as f64)
    });
    println!("one scalar ln: {:.2} ns", 1e9 * ln);
    println!("{:>6} {:>6} {:>9} {:>12} {:>9} {:>7}", "rtol", "t_f", "feasible", "ns/feasible", "in ln", "nodes");
    let axis: Vec<f64> = (0..POINTS).map(|i| -0.5 + i as f64 / (POINTS - 1) as f64).collect();
    let transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f: 100.0 };
    for rtol in [1e-6, 1e-10, 1e-13] {
        for t_f in [0.02, 0.037, 0.049] {
            let landscape = Landscape::new(&transition, t_f, rtol);
            let (feasible, nodes) = pass(&landscape, &axis);
            let time = least(|| {
                let start = Instant::now();
                black_box(pass(&landscape, &axis));
                start.elapsed().as_secs_f64()
            });
            let each = time / f64::from(feasible);
            let nodes = f64::from(nodes) / f64::from(feasible);
            println!("{rtol:>6e} {t_f:>6} {feasible:>9} {:>12.1} {:>9.1} {nodes:>7.1}", 1e9 * each, each / ln);
        }
    }
}

/// Evaluates the whole landscape line by line: feasible points and nodes.
fn pass(landscape: &Landscape, axis: &[f64]) -> (u32, u32) {
    let (mut work, mut v_min) = ([0.0; POINTS], [0.0; POINTS]);
    let mut status = [Status::NotConverged; POINTS];
    let mut total = Effort::default();
    for &a_2 in axis {
        let out = Shortcuts { work: &mut work, v_min: &mut v_min, status: &mut status };
        let effort = landscape.evaluate(&[a_2; POINTS], axis, out);
        black_box((&work, &v_min, &status));
        total.quadratures += effort.quadratures;
        total.nodes += effort.nodes;
    }
    (total.quadratures, total.nodes)
}

/// The least of several measurements: what the machine does when nothing else disturbs it.
fn least(mut measure: impl FnMut() -> f64) -> f64 {
    (0..PASSES).map(|_| measure()).fold(f64::INFINITY, f64::min)
}
