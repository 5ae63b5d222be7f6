//! The smooth shortcut and the regularised optimum on a spring: time of a row without and with the columns that are
//! simulated, and the statuses of a random sample.
//!
//! `cargo bench --bench compliant` prints both on one thread. Nodes and steps are exact; times are medians.

use std::hint::black_box;

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::{SpringBlock, Status, compliant, regularised};
use slipsweep::stability::{amplification, held_error, open_loop_error};

mod support;

/// The paper's case.
const SLIDER: SpringBlock = SpringBlock { law: Law { a: 0.005, b: 0.01 }, k: 7.5e-3, m: 2.5e-16 };
const VELOCITIES: (f64, f64) = (1e5, 3.2e6);
const TIME: f64 = 3.1e-6;

/// Random points.
const SAMPLE: usize = 10_000;

fn main() {
    for rtol in [1e-6, 1e-10] {
        let report = |name: &str, work: String, run: &dyn Fn()| {
            println!("{name:34} rtol {rtol:e}: {:8.4} ms, {work}", 1e3 * support::median(21, run));
        };
        let solve = || compliant::solve(black_box(&SLIDER), VELOCITIES, TIME, rtol);
        report("compliant", format!("{} nodes", solve().stats.nodes), &|| {
            black_box(solve());
        });
        let path = || compliant::path(black_box(&SLIDER), VELOCITIES, TIME, rtol).expect("exists");
        let here = path();
        let steps = |steps: u32| format!("{steps} steps");
        let amplified = || amplification(black_box(&SLIDER), VELOCITIES, TIME, rtol);
        report("  amplification", steps(amplified().steps), &|| {
            black_box(amplified());
        });
        report("  open_loop_error", steps(open_loop_error(&here, rtol).steps), &|| {
            black_box(open_loop_error(&path(), rtol));
        });
        for samples in [100.0, 1000.0] {
            let held = || held_error(black_box(&SLIDER), VELOCITIES, TIME, TIME / samples, rtol);
            report(&format!("  sampling_error, {samples} samples"), steps(held().steps), &|| {
                black_box(held());
            });
        }
        let pieces = || regularised::solve(black_box(&SLIDER), VELOCITIES, TIME, 0.1 * TIME, true, rtol);
        report("regularised", format!("{} nodes", pieces().stats.nodes), &|| {
            black_box(pieces());
        });
    }
    statuses();
}

/// Points over the range of every parameter, logarithmically uniform; one in ten without mass, one in ten on a rigid spring.
fn statuses() {
    let mut state = 7;
    let mut random = |least: f64, greatest: f64| least * (greatest / least).powf(support::tests::uniform(&mut state));
    let (mut smooth, mut pieces, mut most) = ([0; 5], [0; 5], 0);
    let seconds = support::median(1, || {
        for _ in 0..SAMPLE {
            let (a, fraction) = (random(1e-4, 0.3), random(1.0, 11.0) - 1.0);
            let law = Law { a, b: fraction * a };
            let (k, m) = (random(1e-6, 1e4), random(1e-22, 1e-1));
            let slider =
                SpringBlock { law, k: if k > 1e3 { f64::INFINITY } else { k }, m: if m > 1e-3 { 0.0 } else { m } };
            let (v_i, v_f) = (1.0 + random(1e-9, 1e9), 1.0 + random(1e-9, 1e9));
            let t_min = Transition { law, v_i, v_f }.min_duration();
            let t_f = t_min + random(1e-9, 1e9) / v_i.max(v_f);
            let found = compliant::solve(&slider, (v_i, v_f), t_f, 1e-10);
            let regular = regularised::solve(&slider, (v_i, v_f), t_f, t_f * random(1e-6, 0.5), true, 1e-10);
            smooth[found.status as usize] += 1;
            pieces[regular.status as usize] += 1;
            most = most.max(found.stats.nodes).max(regular.stats.nodes);
        }
    });
    for (name, counts) in [("compliant", smooth), ("regularised", pieces)] {
        let counts = Status::ALL.map(|status| format!("{} {}", counts[status as usize], status.name()));
        println!("random sample of {SAMPLE}, {name}: {}", counts.join(", "));
    }
    println!("  {:.3} ms a point, at most {most} nodes", 1e3 * seconds / SAMPLE as f64);
}
