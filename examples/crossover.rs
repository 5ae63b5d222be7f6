//! Locates the duration at which the protocol of least work ceases to speed up at once.
//!
//! `cargo run --release --example crossover`

use std::error::Error;

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::optimal::{self, Strategy, crossover};

fn main() -> Result<(), Box<dyn Error>> {
    for v_f in [10.0, 100.0, 1000.0] {
        let transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f };
        let wanted =
            crossover::Wanted { cross: true, floor: false, cheapest: false, min: false, turn: false, free: false };
        let (status, times, _) = crossover::solve(&transition, true, 1e-10, wanted);
        let t_cross = times.t_cross.ok_or(status.name())?;
        // Just before it speeds up, just after it slows down.
        let strategy = |t_f: f64| optimal::solve(&transition, t_f, true, 1e-10).value.map(|optimum| optimum.strategy);
        assert_eq!(strategy(0.999 * t_cross), Some(Strategy::SpeedUp));
        assert_ne!(strategy(1.001 * t_cross), Some(Strategy::SpeedUp));
        println!("crossover: v_f={v_f} t_cross={t_cross:.6}");
    }
    Ok(())
}
