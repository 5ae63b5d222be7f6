//! `gap`: the work of the row's cubic, integrated over time; `W*` by integration of the extremal.

use super::motion::golden;
use super::optimal::{self, min_duration};
use super::route::integrate;
use super::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::model::{Law, Transition};
use crate::table::STATUS;

/// Places at which a velocity is evaluated before its least value is refined.
const PLACES: usize = 2000;

pub fn check(row: &Row, context: &Context) -> Verdict {
    let coefficients = [number(row, "alpha_2"), number(row, "alpha_3"), number(row, "t_f")];
    let (Some(problem), [Some(alpha_2), Some(alpha_3), Some(t_f)]) = (transition(row), coefficients) else {
        return Verdict::unchecked("an axis is missing");
    };
    let a_2 = if context.relative[0] { alpha_2 } else { alpha_2 * t_f };
    let a_3 = if context.relative[1] { alpha_3 } else { alpha_3 * t_f * t_f };
    let cubic = Cubic::new(&problem, t_f, a_2, a_3);
    let mut verdict = Verdict::default();
    let slack = cubic.slack();
    if slack.abs() < 1e-9 {
        return Verdict::unchecked("within 1e-9 of the border of feasibility");
    }
    let infeasible = slack <= 0.0 || context.bounded && t_f < min_duration(&problem);
    verdict.status(row, infeasible);
    if infeasible || word(row, STATUS) == Some("infeasible") {
        return verdict;
    }
    let work = cubic.work();
    verdict.compare(row, "v_min", Some(cubic.v_min()), None);
    verdict.friction(row, cubic.friction_min());
    match work {
        Some(work) => verdict.compare(row, "work", Some(work), None),
        None => verdict.miss("the independent integrator failed"),
    }
    optimal::compare(&mut verdict, row, (&problem, t_f), work, context.bounded);
    verdict
}

/// A cubic shortcut over `x = t/t_f`.
pub struct Cubic {
    law: Law,
    t_f: f64,
    /// Coefficients of theta.
    theta: [f64; 4],
}

impl Cubic {
    pub fn new(problem: &Transition, t_f: f64, a_2: f64, a_3: f64) -> Cubic {
        let (theta_0, theta_1) = (1.0 / problem.v_i, 1.0 / problem.v_f);
        Cubic { law: problem.law, t_f, theta: [theta_0, a_2, a_3, theta_1 - theta_0 - a_2 - a_3] }
    }

    pub fn theta(&self, x: f64) -> f64 {
        let [c_0, c_1, c_2, c_3] = self.theta;
        c_0 + x * (c_1 + x * (c_2 + x * c_3))
    }

    pub fn velocity(&self, x: f64) -> f64 {
        let [_, c_1, c_2, c_3] = self.theta;
        (1.0 - (c_1 + x * (2.0 * c_2 + 3.0 * c_3 * x)) / self.t_f) / self.theta(x)
    }

    /// The least value of theta and of `1 - theta'`; not positive if there is no such shortcut.
    pub fn slack(&self) -> f64 {
        lowest(&|x| self.theta(x).min(self.velocity(x) * self.theta(x)))
    }

    pub fn v_min(&self) -> f64 {
        lowest(&|x| self.velocity(x))
    }

    fn friction(&self, x: f64) -> f64 {
        1.0 + self.law.a * self.velocity(x).ln() + self.law.b * self.theta(x).ln()
    }

    pub fn friction_min(&self) -> f64 {
        lowest(&|x| self.friction(x))
    }

    pub fn work(&self) -> Option<f64> {
        let slope = |y: &[f64; 2]| [self.t_f * self.velocity(y[1]) * self.friction(y[1]), 1.0];
        integrate(slope, [0.0, 0.0], (0.0, 1.0)).map(|y| y[0])
    }
}

/// The least value on `[0, 1]`.
fn lowest(f: &dyn Fn(f64) -> f64) -> f64 {
    let place = |i: usize| i as f64 / PLACES as f64;
    let values = (0..=PLACES).map(|i| (i, f(place(i))));
    let least = values.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i);
    golden(f, place(least.saturating_sub(1)), place((least + 1).min(PLACES))).1.min(f(place(least)))
}
