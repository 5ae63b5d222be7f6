//! The crossover time: ours is one quadrature, compared with a bisection in `t_f` over optimal solves.

use std::rc::Rc;

use slipsweep::model::Transition;
use slipsweep::protocol::optimal::{crossover, solve};

use super::cases::ONLY_CROSS;
use super::measure::{Answer, Kind, Method, Subject, Truth, relative};
use super::optimal::transition;
use super::reference;

pub fn subject(tolerances: &[f64]) -> Subject {
    let rows: Vec<_> =
        reference::table("crossover").into_iter().filter(|row| row.optional("t_cross").is_some()).collect();
    let truth = |row: &reference::Row| Truth {
        answer: [row.number("t_cross"), row.number("work_at_t_cross")],
        doubt: 256.0 * f64::EPSILON,
    };
    let truths = rows.iter().map(truth).collect();
    let cases = Rc::new(rows.iter().map(transition).collect());
    let methods = vec![
        Method::each("ours", Kind::Ours, tolerances, &cases, |transition: &Transition, rtol| {
            let (_, times, _) = crossover::solve(transition, true, rtol, ONLY_CROSS);
            Some([times.t_cross?, times.work_at_t_cross?])
        }),
        Method::each("bisection over our optimal solves", Kind::Other, tolerances, &cases, bisection),
    ];
    let error = "relative error of the time";
    Subject { name: "crossover", cases: "accelerations", error, truths, rows: Vec::new(), judge: relative, methods }
}

/// Where `v(0+)` falls to `v_i`: a bracket by doubling from `1/v_i`, then halves of it.
fn bisection(transition: &Transition, tolerance: f64) -> Option<Answer> {
    let solved = |t_f: f64| solve(transition, t_f, true, tolerance).value;
    let is_early = |t_f: f64| Some(solved(t_f)?.v_start > transition.v_i);
    let (mut low, mut high) = (1.0 / transition.v_i, 1.0 / transition.v_i);
    if is_early(low)? {
        while is_early(high)? {
            (low, high) = (high, 2.0 * high);
        }
    } else {
        while !is_early(low)? {
            (low, high) = (0.5 * low, low);
        }
    }
    while high - low > tolerance * high {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if is_early(middle)? {
            low = middle;
        } else {
            high = middle;
        }
    }
    let t_cross = 0.5 * (low + high);
    Some([t_cross, solved(t_cross)?.work])
}
