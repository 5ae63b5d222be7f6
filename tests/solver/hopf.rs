//! The kind of the Hopf point, from closed form, against limit cycles of simulated responses on both sides of it.

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::stability::step_response::{Outcome, Response, VelocityStep};
use slipsweep::stability::{Hopf, SteadySliding};

const A: f64 = 0.005;
const MASS: f64 = 2.5e-16;

/// The paper's material but for `b`, at the velocity at which `m v^2/a` is this fraction of where the kind changes.
fn sliding(ratio: f64, fraction: f64) -> (Law, f64) {
    let mu = fraction / (3.0 + 2.0 * (3.0 + ratio).sqrt());
    (Law { a: A, b: ratio * A }, (mu * A / MASS).sqrt())
}

/// The response to a step from `v_i` times the final velocity, `1 + distance` times as stiff as critical.
fn response((law, v_f): (Law, f64), distance: f64, v_i: f64) -> Response {
    let k = (1.0 + distance) * SteadySliding::new(law, 1.0, MASS, v_f).critical_stiffness();
    let step =
        VelocityStep { state_law: StateLaw::Ageing, transition: Transition { law, v_i: v_i * v_f, v_f }, k, m: MASS };
    step.respond(1e-6).1.expect("is followed")
}

/// Range of `ln v` on the limit cycle.
fn amplitude(response: &Response) -> f64 {
    let cycle = response.cycle.unwrap_or_else(|| panic!("{response:?}"));
    (cycle.v_peak / cycle.v_trough).ln()
}

#[test]
fn supercritical_cycles_grow_from_nothing_below_the_critical_stiffness() {
    for ratio in [1.2, 2.0, 6.0] {
        let sliding = sliding(ratio, 1.25);
        assert_eq!(Hopf::of(StateLaw::Ageing, sliding.0, MASS, sliding.1), Some(Hopf::Supercritical));
        let [far, near] = [-1e-4, -1e-6].map(|distance| amplitude(&response(sliding, distance, 0.999)));
        assert!((far / near / 10.0 - 1.0).abs() < 0.05 && near < 0.03, "{ratio}: {far} {near}");
        assert_eq!(response(sliding, 1e-4, 0.999).outcome, Outcome::Settled, "{ratio}");
    }
}

#[test]
fn subcritical_cycles_are_there_at_once_and_on_both_sides() {
    for ratio in [1.2, 2.0, 6.0] {
        let sliding = sliding(ratio, 0.8);
        assert_eq!(Hopf::of(StateLaw::Ageing, sliding.0, MASS, sliding.1), Some(Hopf::Subcritical));
        // None is small: the response jumps to one that hardly depends on the distance,
        let [far, near] = [-1e-4, -1e-6].map(|distance| amplitude(&response(sliding, distance, 0.999)));
        assert!((far / near - 1.0).abs() < 0.05 && near > 0.5, "{ratio}: {far} {near}");
        // which is still there where small steps settle.
        let [small, large] = [0.999, 0.1].map(|v_i| response(sliding, 1e-4, v_i));
        assert_eq!(small.outcome, Outcome::Settled, "{ratio}");
        assert!((amplitude(&large) / near - 1.0).abs() < 0.05, "{ratio}: {large:?}");
    }
}
