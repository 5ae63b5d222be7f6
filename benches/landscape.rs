//! One landscape point over the paper's landscape, in units of one scalar `f64::ln` measured in the same run.
//!
//! `cargo bench --bench landscape`. The median of several passes on one core; feasibility and `v_min` of all points,
//! feasible or not, are in the time.

mod support;

use std::hint::black_box;

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::cubic::{Landscape, Shortcuts};
use slipsweep::protocol::{Effort, Status};
use support::{median, one_ln};

const POINTS: usize = 401;
const PASSES: usize = 15;

fn main() {
    let ln = one_ln();
    println!("one scalar ln: {:.2} ns", 1e9 * ln);
    println!("{:>6} {:>6} {:>9} {:>12} {:>9} {:>7}", "rtol", "t_f", "feasible", "ns/feasible", "in ln", "nodes");
    let axis: Vec<f64> = (0..POINTS).map(|i| -0.5 + i as f64 / (POINTS - 1) as f64).collect();
    let transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f: 100.0 };
    for rtol in [1e-6, 1e-10, 1e-13] {
        for t_f in [0.02, 0.037, 0.049] {
            let landscape = Landscape::new(&transition, t_f, rtol);
            let (feasible, nodes) = pass(&landscape, &axis);
            let time = median(PASSES, || {
                black_box(pass(&landscape, &axis));
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
