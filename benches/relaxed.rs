//! One optimum of the laws of slip and of Perrin, Rice and Zheng by strategy, in units of one scalar `f64::ln` measured in the same run, on one core.
//!
//! `cargo bench --bench relaxed`. The cases are all rows of `tests/reference/relaxed.csv`.

mod support;

use std::hint::black_box;

#[path = "../tests/reference/mod.rs"]
mod reference;

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::protocol::relaxed::solve;
use support::{least, one_ln};

const ROUNDS: usize = 60;

/// Cases that are timed together.
const SPELL: usize = 20;

/// Law, transition, duration and ceiling.
type Case = (StateLaw, Transition, f64, f64);

fn main() {
    let ln = one_ln();
    println!("one scalar ln: {:.2} ns", 1e9 * ln);
    println!("{:<20} {:>6} {:>9} {:>8}", "strategy", "cases", "ns", "in ln");
    for strategy in ["wait_jerk", "jerk_wait", "chatter", "rise"] {
        for (name, law) in [("slip", StateLaw::Slip), ("prz", StateLaw::Prz)] {
            let cases = cases(name, law, strategy);
            if !cases.is_empty() {
                measure(&format!("{strategy}, {name}"), &cases, ln);
            }
        }
    }
}

/// The rows of the reference table.
fn cases(name: &str, law: StateLaw, strategy: &str) -> Vec<Case> {
    let case = |row: &reference::Row| {
        let friction = Law { a: row.number("a"), b: row.number("b") };
        let transition = Transition { law: friction, v_i: row.number("v_i"), v_f: row.number("v_f") };
        (law, transition, row.number("t_f"), row.number("v_ceiling"))
    };
    let table = reference::table("relaxed");
    table.iter().filter(|row| row.text("law") == name && row.text("strategy") == strategy).map(case).collect()
}

fn measure(name: &str, cases: &[Case], ln: f64) {
    let spells: Vec<&[Case]> = cases.chunks(SPELL).collect();
    let time = least(ROUNDS, &spells, |cases| {
        for (law, transition, t_f, ceiling) in *cases {
            black_box(solve(*law, transition, *t_f, *ceiling));
        }
    });
    let each = time / cases.len() as f64;
    println!("{name:<20} {:>6} {:>9.0} {:>8.0}", cases.len(), 1e9 * each, each / ln);
}
