//! The step response: time of a response, of a plane of responses, and outcomes and errors over the physical domain.
//!
//! `cargo bench --bench step_response` prints all on one thread; `cargo bench --bench step_response -- domain 100000` prints the random points of the
//! physical domain alone, with the given number of points. Steps are exact; times are medians. The floor is the
//! arithmetic of a series at every step, 500 multiplications and as many additions, at the rate of a vectorised loop.

use std::hint::black_box;

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::stability::step_response::{Outcome, Response, VelocityStep};

mod support;

const PAPER: Law = Law { a: 0.005, b: 0.01 };
const MASS: f64 = 2.5e-16;
const V_F: f64 = 3.2e6;

/// Critical stiffness at `V_F`.
const CRITICAL: f64 = 0.00756;

/// Rows and columns of the plane of stiffness and final velocity.
const PLANE: usize = 60;

/// Random points of the physical domain.
const SAMPLE: usize = 2_000;

/// Accuracy of the random points, and of the responses that judge them.
const RTOL: [f64; 2] = [1e-6, 1e-8];

fn paper(k: f64, v_f: f64) -> VelocityStep {
    VelocityStep { state_law: StateLaw::Ageing, transition: Transition { law: PAPER, v_i: 1e5, v_f }, k, m: MASS }
}

/// Multiplications and additions of a step.
const OF_A_STEP: f64 = 1000.0;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(place) = arguments.iter().position(|argument| argument == "domain") {
        let points = arguments.get(place + 1).and_then(|points| points.parse().ok());
        return domain(points.expect("`domain` takes a number of points"));
    }
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
    let plane: Vec<VelocityStep> = (0..PLANE * PLANE)
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
    domain(SAMPLE);
}

/// Outcomes, times and errors at random points of the physical domain, logarithmically uniform; one in eleven without mass.
fn domain(points: usize) {
    let mut state = 7;
    let mut random = |least: f64, greatest: f64| least * (greatest / least).powf(support::tests::uniform(&mut state));
    let steps: Vec<VelocityStep> = (0..points)
        .map(|i| {
            let a = random(1e-3, 0.3);
            let law = Law { a, b: (a * random(0.05, 20.0)).min(0.5) };
            let m = if i % 11 == 0 { 0.0 } else { a * random(1e-8, 1e4) / 1e12 };
            let transition = Transition { law, v_i: 1e6 * random(1e-6, 1e6), v_f: 1e6 };
            VelocityStep { state_law: StateLaw::Ageing, transition, k: a * random(1e-4, 1e5), m }
        })
        .collect();
    let respond = |rtol| -> Vec<Option<Response>> { steps.iter().map(|step| step.respond(rtol).1).collect() };
    let (mut found, mut most) = (Vec::new(), 0);
    let seconds = support::median(1, || found = respond(RTOL[0]));
    let judges = respond(RTOL[1]);
    // Settled, limit cycles, undecided, infinite.
    let (mut counts, mut others) = ([0; 4], 0);
    let mut errors = [("v_peak", 0.0), ("v_trough", 0.0), ("settling_time", 0.0), ("period", 0.0)];
    for (found, judge) in found.iter().zip(&judges) {
        let place = found.map_or(3, |response| response.outcome as usize);
        counts[place] += 1;
        let (Some(found), Some(judge)) = (found, judge) else { continue };
        most = most.max(found.steps);
        if [found.outcome, judge.outcome].contains(&Outcome::Undecided) {
            continue;
        }
        if found.outcome != judge.outcome {
            others += 1;
            continue;
        }
        let numbers = |response: &Response| {
            let time = response.settling_time.unwrap_or(f64::NAN);
            let period = response.cycle.map_or(f64::NAN, |cycle| cycle.period);
            [response.v_peak, response.v_trough, time, period]
        };
        for (((_, largest), found), judge) in errors.iter_mut().zip(numbers(found)).zip(numbers(judge)) {
            // NaN, which is unknown, counts nothing.
            *largest = if found == judge { *largest } else { f64::max(*largest, (found / judge - 1.0).abs()) };
        }
    }
    let [settled, cycles, undecided, infinite] = counts;
    println!("{points} random points of the physical domain at {:e}:", RTOL[0]);
    println!("  {settled} settled, {cycles} limit cycles, {undecided} undecided, {infinite} infinite");
    println!("  {:.2} ms each, at most {most} steps", 1e3 * seconds / points as f64);
    println!("  {others} outcomes differ from those at {:e}; largest differences:", RTOL[1]);
    for (name, largest) in errors {
        println!("    {name:13} {largest:.1e}");
    }
}
