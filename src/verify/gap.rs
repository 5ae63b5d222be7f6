//! `gap`: the work of the row's cubic, integrated over time; `W*` by the traced optimum.

use super::motion::{self, bisect};
use super::route::integrate;
use super::task::Task;
use super::{Checked, CheckedRow, arcsinh, relaxed};
use crate::model::{Friction, Law, StateLaw, Transition};
use crate::numerics::cubic;
use crate::protocol::Status;

/// Number of points at which a function is evaluated before its least value is refined. Chosen: many for each extremum of a quotient of cubics.
const SCAN_POINTS: u32 = 2000;

pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (task, state) = (Task::of(row)?, row.state_law()?);
    let (Task { problem, t_f, .. }, friction) = (task, row.context.friction);
    let coefficients = row.coefficients(t_f).ok_or("an axis is missing")?;
    let cubic = Cubic::new(&problem, t_f, coefficients).under(state, friction);
    let slack = cubic.slack();
    if slack.abs() < 1e-9 {
        return Err("within 1e-9 of the border of feasibility");
    }
    let relaxed = (state != StateLaw::Ageing).then(|| relaxed::certify(row, &problem, state, t_f));
    let has_optimum = match &relaxed {
        Some(optimum) => Some(optimum.status != Status::Infeasible),
        None => task.is_feasible(),
    };
    if !row.compare_feasible(if slack <= 0.0 { Some(false) } else { has_optimum }) {
        return Ok(());
    }
    row.compare("v_min", cubic.v_min());
    compare_v_max(row, coefficients, |coefficients| Cubic::new(&problem, t_f, coefficients).under(state, friction));
    if friction == Friction::Log {
        row.compare_friction(cubic.friction_min());
    }
    let work = cubic.work();
    match work {
        Some(work) => row.compare("work", work),
        None => row.miss("the independent integrator failed"),
    }
    let least = match relaxed {
        Some(optimum) => optimum.value,
        None if friction == Friction::Regularised => arcsinh::least_work(row, &problem, t_f),
        None => row.certify(&task).map(|optimum| optimum.work),
    };
    if let Some(least) = least {
        row.compare_gap(least, work);
    }
    Ok(())
}

/// Compares the greatest velocity, if it is written, with that of the cubic `at` the coefficients, up to their rounding.
pub fn compare_v_max(row: &mut CheckedRow<'_>, [a_2, a_3]: [f64; 2], at: impl Fn([f64; 2]) -> Cubic) {
    if row.has_column("v_max") {
        let nudge = 1.0 + 2.0 * f64::EPSILON;
        let places = [[a_2, a_3], [a_2 * nudge, a_3], [a_2, a_3 * nudge]];
        let [v_max, by_2, by_3] = places.map(|place| at(place).v_max());
        let noise = 4.0 * ((by_2 - v_max).abs() + (by_3 - v_max).abs());
        row.compare_relative("v_max", v_max, v_max + noise / row.context.rtol);
    }
}

/// A cubic shortcut over `x = t/t_f`.
pub struct Cubic {
    state: StateLaw,
    law: Law,
    form: Friction,
    t_f: f64,
    /// Coefficients of theta, by the distance from the start and from the end.
    theta: [[f64; 4]; 2],
}

/// A place on the path: whether it is nearer to the end, and the distance from the nearer one, in units of `t_f`.
pub type Place = (bool, f64);

/// The place at `x`.
pub fn place(x: f64) -> Place {
    if x <= 0.5 { (false, x) } else { (true, 1.0 - x) }
}

impl Cubic {
    /// With ageing and the logarithm.
    pub fn new(problem: &Transition, t_f: f64, [a_2, a_3]: [f64; 2]) -> Cubic {
        let (theta_0, theta_1) = (1.0 / problem.v_i, 1.0 / problem.v_f);
        let (state, form) = (StateLaw::Ageing, Friction::Log);
        let change = theta_1 - theta_0;
        let from_start = [theta_0, a_2, a_3, change - a_2 - a_3];
        let from_end = [theta_1, 2.0 * a_2 + a_3 - 3.0 * change, 3.0 * (change - a_2) - 2.0 * a_3, a_2 + a_3 - change];
        Cubic { state, form, law: problem.law, t_f, theta: [from_start, from_end] }
    }

    /// This cubic under an evolution law of the state and a form of friction.
    pub fn under(self, state: StateLaw, form: Friction) -> Cubic {
        Cubic { state, form, ..self }
    }

    fn theta(&self, (from_end, x): Place) -> f64 {
        let [c_0, c_1, c_2, c_3] = self.theta[usize::from(from_end)];
        c_0 + x * (c_1 + x * (c_2 + x * c_3))
    }

    fn rate(&self, (from_end, x): Place) -> f64 {
        let [_, c_1, c_2, c_3] = self.theta[usize::from(from_end)];
        let rate = (c_1 + x * (2.0 * c_2 + 3.0 * c_3 * x)) / self.t_f;
        if from_end { -rate } else { rate }
    }

    pub fn velocity(&self, at: Place) -> f64 {
        let rate = self.rate(at);
        let u = match self.state {
            StateLaw::Ageing => 1.0 - rate,
            StateLaw::Slip => product_of_slip(rate),
            StateLaw::Prz => (1.0 - 2.0 * rate).sqrt(),
        };
        u / self.theta(at)
    }

    /// The least value of theta and of the distance of `theta'` from its bound; not positive if there is no such shortcut.
    pub fn slack(&self) -> f64 {
        let bound = match self.state {
            StateLaw::Ageing => 1.0,
            StateLaw::Slip => (-1.0_f64).exp(),
            StateLaw::Prz => 0.5,
        };
        lowest(&|at| self.theta(at).min(bound - self.rate(at)))
    }

    pub fn v_min(&self) -> f64 {
        lowest(&|at| self.velocity(at))
    }

    /// The inverse of the least `theta/u`, whose only narrow dip is that of theta.
    fn v_max(&self) -> f64 {
        let dip = cubic::Cubic { c: self.theta[0] }.minimum();
        let least = |range| motion::lowest(&|x| 1.0 / self.velocity(place(x)), range, SCAN_POINTS);
        1.0 / least((0.0, dip)).min(least((dip, 1.0)))
    }

    fn friction(&self, at: Place) -> f64 {
        match self.form {
            Friction::Log => 1.0 + self.law.a * self.velocity(at).ln() + self.law.b * self.theta(at).ln(),
            Friction::Regularised => arcsinh::tau(&self.law, self.velocity(at), self.theta(at)),
        }
    }

    pub fn friction_min(&self) -> f64 {
        lowest(&|at| self.friction(at))
    }

    pub fn work(&self) -> Option<f64> {
        let half = |from_end: bool| {
            let power = |at: Place| self.t_f * self.velocity(at) * self.friction(at);
            let part = |from: f64, to: f64| {
                integrate(|y: &[f64; 2]| [power((from_end, y[1])), 1.0], [0.0, from], (from, to)).map(|y| y[0])
            };
            // Under the slip law the velocity has a kink where theta rises as fast as it can.
            let [_, _, c_2, c_3] = self.theta[usize::from(from_end)];
            let fastest = (-c_2 / (3.0 * c_3)).clamp(0.0, 0.5);
            let cut = if fastest.is_nan() { 0.5 } else { fastest };
            Some(part(0.0, cut)? + part(cut, 0.5)?)
        };
        Some(half(false)? + half(true)?)
    }
}

/// `u >= 1/e` with `-u ln u = rate`.
fn product_of_slip(rate: f64) -> f64 {
    bisect(-1.0, 700.0, |ln_u| -ln_u * ln_u.exp() > rate).exp()
}

/// The least value along a path.
fn lowest(f: &dyn Fn(Place) -> f64) -> f64 {
    motion::lowest(&|x| f(place(x)), (0.0, 1.0), SCAN_POINTS)
}
