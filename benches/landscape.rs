//! One landscape point over the paper's landscape, in units of one scalar `f64::ln` and compared with two floors, all measured
//! in the same run: two logarithms a node, over an array and vectorised (what a sum of `tau v` needs), and the
//! multiplications and additions of the sum as it is done here, without logarithms, at the rate of independent ones.
//! The choice of the rule, feasibility and `v_min` are in neither.
//!
//! The second table compares the laws of slip and of Perrin, Rice and Zheng with ageing: time and nodes of a feasible point, and the time of any point,
//! for the same transition at durations at which all laws have feasible shortcuts.
//!
//! `cargo bench --bench landscape`. On one core; feasibility and `v_min` of all points, feasible or not, are in the
//! time. As many points are evaluated together as a run does; their coordinates are there before, as are the columns
//! that are written.

mod support;

use std::hint::black_box;

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::protocol::Status;
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use support::{least, one_ln, one_vector_ln, one_vector_operation};

const RTOLS: [f64; 3] = [1e-6, 1e-10, 1e-13];
const POINTS: usize = 401;
const ROUNDS: usize = 60;

/// Lines that are evaluated together: 8,020 points, where a run takes 8,192.
const SPELL: usize = 20;

/// Multiplications and additions at one node, without those of the bilinear form (one for each pair of nodes) and
/// without the division.
const OF_A_NODE: f64 = 27.0;

fn main() {
    let ln = one_ln();
    let vector_ln = one_vector_ln();
    let operation = one_vector_operation();
    println!("one scalar ln: {:.2} ns; one of a vector: {:.3} ns", 1e9 * ln, 1e9 * vector_ln);
    println!("one multiplication or addition of a vector: {:.4} ns", 1e9 * operation);
    println!(
        "{:>6} {:>6} {:>9} {:>12} {:>7} {:>7} {:>15} {:>9} {:>15} {:>9}",
        "rtol",
        "t_f",
        "feasible",
        "ns/feasible",
        "in ln",
        "nodes",
        "logarithms, ns",
        "of them",
        "arithmetic, ns",
        "of it"
    );
    let transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f: 100.0 };
    for rtol in RTOLS {
        for t_f in [0.02, 0.037, 0.049] {
            let Measured { feasible, nodes, each } = measure(&Landscape::new(&transition, t_f, rtol));
            let logarithms = 2.0 * nodes * vector_ln;
            // The square of the mean is below the mean square: a floor.
            let arithmetic = (OF_A_NODE * nodes + nodes * nodes) * operation;
            println!(
                "{rtol:>6e} {t_f:>6} {feasible:>9} {:>12.1} {:>7.1} {nodes:>7.1} {:>15.1} {:>9.2} {:>15.1} {:>9.2}",
                1e9 * each,
                each / ln,
                1e9 * logarithms,
                each / logarithms,
                1e9 * arithmetic,
                each / arithmetic
            );
        }
    }
    println!(
        "{:>6} {:>6} {:>7} {:>9} {:>12} {:>10} {:>7} {:>9} {:>10}",
        "rtol", "t_f", "law", "feasible", "ns/feasible", "of ageing", "nodes", "ns/point", "of ageing"
    );
    for rtol in RTOLS {
        for t_f in [0.1, 0.4] {
            let of = |law| measure(&Landscape::under(law, &transition, t_f, rtol));
            let ageing = of(StateLaw::Ageing);
            for law in StateLaw::ALL {
                let found = of(law);
                let Measured { feasible, nodes, each } = found;
                println!(
                    "{rtol:>6e} {t_f:>6} {:>7} {feasible:>9} {:>12.1} {:>10.2} {nodes:>7.1} {:>9.1} {:>10.2}",
                    law.name(),
                    1e9 * each,
                    each / ageing.each,
                    1e9 * found.of_a_point(),
                    found.of_a_point() / ageing.of_a_point()
                );
            }
        }
    }
}

/// Feasible points, nodes of each, and seconds of each.
struct Measured {
    feasible: u32,
    nodes: f64,
    each: f64,
}

impl Measured {
    /// Seconds of a point, feasible or not.
    fn of_a_point(&self) -> f64 {
        self.each * f64::from(self.feasible) / (POINTS * POINTS) as f64
    }
}

/// Measures the landscape of coefficients from -0.5 to 0.5.
fn measure(landscape: &Landscape) -> Measured {
    let axis: Vec<f64> = (0..POINTS).map(|i| -0.5 + i as f64 / (POINTS - 1) as f64).collect();
    let (a_3, mut columns) = (axis.repeat(SPELL), Columns::new());
    let lines = axis.chunks(SPELL);
    let spells: Vec<Vec<f64>> = lines.map(|lines| lines.iter().flat_map(|&a_2| [a_2; POINTS]).collect()).collect();
    let counts = spells.iter().map(|a_2| pass(landscape, a_2, &a_3, &mut columns));
    let (feasible, nodes) = counts.fold((0, 0), |sum, count| (sum.0 + count.0, sum.1 + count.1));
    let time = least(ROUNDS, &spells, |a_2| {
        black_box(pass(landscape, a_2, &a_3, &mut columns));
    });
    Measured { feasible, nodes: f64::from(nodes) / f64::from(feasible), each: time / f64::from(feasible) }
}

/// What is written of the points that are evaluated together.
struct Columns {
    work: Vec<f64>,
    v_min: Vec<f64>,
    status: Vec<Status>,
}

impl Columns {
    fn new() -> Columns {
        let count = SPELL * POINTS;
        Columns { work: vec![0.0; count], v_min: vec![0.0; count], status: vec![Status::NotConverged; count] }
    }
}

/// Evaluates some lines of the landscape together: feasible points and nodes.
fn pass(landscape: &Landscape, a_2: &[f64], a_3: &[f64], columns: &mut Columns) -> (u32, u32) {
    let Columns { work, v_min, status } = columns;
    let count = a_2.len().min(a_3.len());
    let (work, v_min, status) = (&mut work[..count], &mut v_min[..count], &mut status[..count]);
    let stats = landscape.evaluate(black_box(a_2), a_3, LandscapeBuffers { work, v_min, status });
    black_box(columns);
    (stats.quadratures, stats.nodes)
}
