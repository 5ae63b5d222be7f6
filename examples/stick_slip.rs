//! Finds which materials fall into stick-slip when the velocity of the far end of the spring jumps.
//!
//! `cargo run --release --example stick_slip`

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::stability::SteadySliding;
use slipsweep::stability::step_response::{Outcome, VelocityStep};

fn main() {
    let (k, m, v_i, v_f) = (7.5e-3, 2.5e-16, 1e5, 3.2e6);
    for (a, b) in [(0.005, 0.01), (0.005, 0.012), (0.005, 0.014), (0.01, 0.005)] {
        let law = Law { a, b };
        let sliding = SteadySliding::new(law, k, m, v_f);
        let step = VelocityStep { state_law: StateLaw::Ageing, transition: Transition { law, v_i, v_f }, k, m };
        let (status, response) = step.respond(1e-6);
        let end = match response.map(|response| response.outcome) {
            Some(Outcome::Settled) => "settles",
            Some(Outcome::LimitCycle) => "ends in stick-slip",
            Some(Outcome::Undecided) => "is undecided",
            Some(Outcome::Diverged) | None => status.name(),
        };
        println!(
            "stick-slip: a={a} b={b} {end}; critical stiffness {:.4}, stiffness {k}",
            sliding.critical_stiffness()
        );
    }
}
