//! `swift`: the family's formula with the row's `alpha`, integrated over time in the direction in which it contracts.

use super::extremal::solve;
use super::gap::{Cubic, golden};
use super::route::integrate;
use super::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::model::Transition;
use crate::table::STATUS;

/// Pieces in which a protocol is integrated, and between which its extremes are looked for.
const PIECES: usize = 256;

/// What the formula of a family gives.
enum Formula {
    /// The velocity at a place `x = t/t_f`.
    Velocity(Box<dyn Fn(f64) -> f64>),
    /// The friction.
    Friction(Box<dyn Fn(f64) -> f64>),
}

/// A protocol on its way: `ln theta`, work, place.
type State = [f64; 3];

struct Course {
    problem: Transition,
    t_f: f64,
    formula: Formula,
    backward: bool,
}

impl Course {
    fn velocity(&self, y: &State) -> f64 {
        let law = self.problem.law;
        match &self.formula {
            Formula::Velocity(velocity) => velocity(y[2]),
            Formula::Friction(friction) => ((friction(y[2]) - 1.0 - law.b * y[0]) / law.a).exp(),
        }
    }

    fn friction(&self, y: &State) -> f64 {
        let law = self.problem.law;
        match &self.formula {
            Formula::Velocity(velocity) => 1.0 + law.a * velocity(y[2]).ln() + law.b * y[0],
            Formula::Friction(friction) => friction(y[2]),
        }
    }

    fn advance(&self, y: State, length: f64) -> Option<State> {
        let sign = if self.backward { -1.0 } else { 1.0 };
        let slope = |y: &State| {
            let v = self.velocity(y);
            [sign * self.t_f * ((-y[0]).exp() - v), self.t_f * self.friction(y) * v, sign]
        };
        integrate(slope, y, (0.0, length))
    }

    /// The states between the pieces, in the direction of integration.
    fn states(&self) -> Option<Vec<State>> {
        let (v, x) = if self.backward { (self.problem.v_f, 1.0) } else { (self.problem.v_i, 0.0) };
        let mut states = vec![[-v.ln(), 0.0, x]];
        for _ in 0..PIECES {
            states.push(self.advance(*states.last()?, 1.0 / PIECES as f64)?);
        }
        Some(states)
    }

    /// The least value of `f` along the way.
    fn least(&self, states: &[State], f: impl Fn(&State) -> f64) -> f64 {
        let values = states.iter().enumerate().map(|(i, y)| (i, f(y)));
        let (place, least) = values.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN));
        let at = |s: f64| {
            let piece = (s as usize).min(PIECES - 1);
            let state = self.advance(states[piece], (s - piece as f64) / PIECES as f64);
            state.map_or(f64::INFINITY, |y| f(&y))
        };
        let (low, high) = (place.saturating_sub(1), (place + 1).min(PIECES));
        golden(&at, low as f64, high as f64).min(least)
    }
}

pub fn check(row: &Row, context: &Context) -> Verdict {
    let (Some(problem), Some(t_f), Some(family)) = (transition(row), number(row, "t_f"), word(row, "family")) else {
        return Verdict::unchecked("an axis is missing");
    };
    let tau_max = number(row, "tau_max").unwrap_or(f64::INFINITY);
    match word(row, STATUS) {
        Some("ok" | "below_bound" | "infeasible") => {}
        _ => return Verdict::unchecked("status is neither ok, below_bound nor infeasible"),
    }
    let Some(bound) = obstacle(&problem, t_f, family, tau_max, context.bounded) else {
        return Verdict::unchecked("too close to the border to tell whether the family has a member");
    };
    let mut verdict = Verdict::default();
    verdict.status(row, bound.is_some());
    if let Some(bound) = bound {
        verdict.compare_word(row, "bound", bound);
        return verdict;
    }
    if word(row, STATUS) == Some("infeasible") {
        return verdict;
    }
    if tau_max == f64::INFINITY && family == "bounded_friction" {
        verdict.unchecked = Some("without a bound on friction alpha is 0, which tells nothing");
        return verdict;
    }
    let alpha = number(row, "alpha");
    if alpha.is_none() && family.starts_with("bounded") {
        verdict.unchecked = Some("alpha was not written");
        return verdict;
    }
    let course = |alpha: f64| course(problem, t_f, family, alpha, tau_max);
    let course_here = course(alpha.unwrap_or(0.0));
    let Some(states) = course_here.states() else {
        verdict.unchecked = Some("the integrator did not get there");
        return verdict;
    };
    let end = states[PIECES];
    let target = -(if course_here.backward { problem.v_i } else { problem.v_f }).ln();
    match alpha {
        Some(alpha) if alpha != 0.0 => {
            // How far alpha would have to be moved for theta to arrive.
            let moved = course(alpha * (1.0 + 1e-6)).states().map(|states| states[PIECES][0] - end[0]);
            let share = moved.map_or(f64::INFINITY, |moved| 1e-6 * (end[0] - target) / moved);
            verdict.compare(row, "alpha", Some(alpha * (1.0 - share)), None);
        }
        Some(_) => verdict.compare(row, "alpha", Some(0.0), None),
        None if family == "cubic" => verdict.differences.push(("arrival", (end[0] - target).abs())),
        None => {}
    }
    verdict.compare(row, "end_error", Some((end[0] - target).exp_m1()), Some(1.0));
    verdict.compare(row, "work", Some(end[1]), None);
    verdict.compare(row, "v_min", Some(course_here.least(&states, |y| course_here.velocity(y))), None);
    verdict.compare(row, "v_max", Some(-course_here.least(&states, |y| -course_here.velocity(y))), None);
    let friction_max = -course_here.least(&states, |y| -course_here.friction(y));
    verdict.compare(row, "friction_max", Some(friction_max), Some(friction_max.abs().max(1.0)));
    match solve(&problem, t_f, context.bounded) {
        Some(optimum) => {
            verdict.compare(row, "work_optimal", Some(optimum.work), None);
            let gap = (end[1] - optimum.work) / optimum.work;
            verdict.compare(row, "gap", Some(gap), Some(gap.abs().max(1.0)));
        }
        None => verdict.unchecked = Some("the integrator did not get there"),
    }
    verdict
}

/// How close to 0, relative to what it is made of, a number leaves open on which side of 0 it is.
const UNSURE: f64 = 1e-11;

/// Which bound leaves the family without a member, from the extreme protocols of the family integrated: `None` where
/// that is too close to call.
fn obstacle(problem: &Transition, t_f: f64, family: &str, tau_max: f64, bounded: bool) -> Option<Option<&'static str>> {
    let Transition { law, v_i, v_f } = *problem;
    let settle = |bound: &'static str, room: f64, size: f64| match room / size {
        room if room > UNSURE => Some(None),
        room if room < -UNSURE => Some(Some(bound)),
        _ => None,
    };
    // Along v = 1 theta ages most; it ends beyond its target if there is time to spare.
    let aged = integrate(|y: &[f64; 1]| [1.0 - y[0]], [1.0 / v_i], (0.0, t_f))?[0];
    let spare = settle("time", aged * v_f - 1.0, 1.0);
    if bounded && v_f < v_i && spare != Some(None) {
        return spare;
    }
    match family {
        "cubic" => {
            let slack = Cubic::new(problem, t_f, 0.0, -3.0 * (v_f - v_i) / (v_i * v_f)).slack();
            settle("velocity", slack, 1.0)
        }
        "bounded_velocity" if v_i == 1.0 || v_f == 1.0 => Some(Some("velocity")),
        "bounded_velocity" if v_f < v_i => spare,
        "bounded_friction" => {
            let steady = |v: f64| 1.0 + (law.a - law.b) * v.ln();
            let highest = steady(v_i).max(steady(v_f));
            match settle("friction", tau_max - highest, highest.abs() + 1.0) {
                Some(None) if v_f > v_i && tau_max.is_finite() => {
                    // With tau = tau_max throughout, the time in which theta falls to its target, over ln theta.
                    let time = |y: &[f64; 2]| {
                        let surplus = (tau_max - 1.0) / law.a + (1.0 - law.b / law.a) * y[0];
                        [-1.0, y[0].exp() / surplus.exp_m1()]
                    };
                    let fall = (v_f / v_i).ln();
                    let least = integrate(time, [-v_i.ln(), 0.0], (0.0, fall))?[1];
                    settle("friction", t_f - least, t_f)
                }
                // With v = 0 throughout, theta ages by the time.
                Some(None) if v_f < v_i => settle("velocity", t_f - (1.0 / v_f - 1.0 / v_i), t_f),
                decided => decided,
            }
        }
        _ => Some(None),
    }
}

fn course(problem: Transition, t_f: f64, family: &str, alpha: f64, tau_max: f64) -> Course {
    let Transition { law, v_i, v_f } = problem;
    let formula = match family {
        "step" => Formula::Velocity(Box::new(move |_| v_f)),
        "cubic" => {
            let cubic = Cubic::new(&problem, t_f, 0.0, -3.0 * (v_f - v_i) / (v_i * v_f));
            Formula::Velocity(Box::new(move |x| cubic.velocity(x)))
        }
        "bounded_velocity" => {
            let l = ((v_f - 1.0) / (v_i - 1.0)).ln();
            let scale = alpha * t_f * t_f;
            Formula::Velocity(Box::new(move |x| 1.0 + (v_i - 1.0) * (l * x - scale * x * (1.0 - x)).exp()))
        }
        _ => {
            let steady = |v: f64| 1.0 + (law.a - law.b) * v.ln();
            let (spare_i, spare_f) = (tau_max - steady(v_i), tau_max - steady(v_f));
            let l = (spare_f / spare_i).ln();
            Formula::Friction(Box::new(move |x| tau_max - spare_i * (l * x + alpha * x * (1.0 - x)).exp()))
        }
    };
    let backward = matches!(formula, Formula::Friction(_)) && law.b > law.a;
    Course { problem, t_f, formula, backward }
}
