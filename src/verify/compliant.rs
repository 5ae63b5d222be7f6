//! `compliant`: the traced shortcut obeys the equations and its formula, arrives, and its control moves the spring; open loop again.

use super::motion::Followed;
use super::open_loop::ControlledProtocol;
use super::task::{Task, min_duration};
use super::verdict::{Checked, Context, Verdict, axis, number, transition, word};
use crate::dataset::{Cell, Row};
use crate::model::Transition;
use crate::protocol::{Moment, SpringBlock, compliant};
use crate::table::STATUS;

/// `ln(v - 1)` over `x = t/t_f`: a quintic between both ends, and `alpha x^3 (1 - x)^3`.
#[derive(Clone, Copy)]
struct Exponent {
    start: f64,
    change: f64,
    alpha: f64,
}

impl Exponent {
    fn new(problem: &Transition, alpha: f64) -> Exponent {
        let (start, end) = ((problem.v_i - 1.0).ln(), (problem.v_f - 1.0).ln());
        Exponent { start, change: end - start, alpha }
    }

    /// Velocity and its first two derivatives in time.
    fn moment(&self, x: f64, t_f: f64) -> [f64; 3] {
        let &Exponent { start, change, alpha } = self;
        let p = x * (1.0 - x);
        let f = start + x * x * x * change * (10.0 + x * (6.0 * x - 15.0)) + alpha * p * p * p;
        let g = p * p * (30.0 * change + 3.0 * alpha * (1.0 - 2.0 * x));
        let h = p * (60.0 * change * (1.0 - 2.0 * x) + 6.0 * alpha * (1.0 - 5.0 * p));
        let w = f.exp();
        [1.0 + w, w * g / t_f, w * (h + g * g) / (t_f * t_f)]
    }
}

pub fn check(row: &Row, context: &Context, rtol: f64) -> Checked {
    let (problem, t_f, k, m) = (transition(row)?, axis(row, "t_f")?, axis(row, "k")?, axis(row, "m")?);
    let mut verdict = Verdict::default();
    let infeasible = t_f <= min_duration(&problem, true);
    verdict.status(row, infeasible);
    if infeasible || word(row, STATUS) == Some("infeasible") {
        return Ok(verdict);
    }
    let Transition { law, v_i, v_f } = problem;
    let slider = SpringBlock { law, k, m };
    let Ok(path) = compliant::path(&slider, (v_i, v_f), t_f, rtol) else {
        verdict.push("motion", f64::INFINITY);
        return Ok(verdict);
    };
    let followed = Followed::new(Box::new(path), &slider);
    let plain = Exponent::new(&problem, 0.0);
    // alpha from one moment, and its rounding.
    let coefficient = |(t, v): (f64, f64)| {
        let x = t / t_f;
        let bump = (x * (1.0 - x)).powi(3);
        let noise = 8.0 * f64::EPSILON * (v / (v - 1.0) + 10.0 * (v_f - 1.0).ln().abs() + (v_i - 1.0).ln().abs());
        (((v - 1.0) / (plain.moment(x, t_f)[0] - 1.0)).ln() / bump, noise / bump)
    };
    let all = followed.samples.iter().map(|(_, at)| coefficient((at.t, at.v)));
    let determined = all.filter(|(alpha, noise)| alpha.is_finite() && noise.is_finite());
    let Some((alpha, noise)) = determined.min_by(|x, y| x.1.total_cmp(&y.1)) else { return Ok(verdict) };
    verdict.demand(row, "alpha", true);
    verdict.compare(row, "alpha", Some(alpha), Some(alpha.abs() + noise / rtol));
    let alpha = number(row, "alpha").unwrap_or(alpha);
    let exponent = Exponent::new(&problem, alpha);
    let off = |at: &Moment| (exponent.moment(at.t / t_f, t_f)[0] / at.v - 1.0).abs();
    let formula = followed.samples.iter().map(|(_, at)| off(at)).fold(0.0, f64::max);
    let arrival = (followed.end().theta * v_f - 1.0).abs();
    verdict.push("motion", followed.equation + arrival + formula);
    verdict.push("control", followed.control);
    verdict.compare(row, "work", Some(followed.work), None);
    let v = followed.compare_velocities(&mut verdict, row);
    verdict.friction(row, followed.least(|at| at.friction));
    let size = followed.compare_control(&mut verdict, row);
    verdict.compare(row, "stiffness_ratio", Some(if m > 0.0 { k * t_f * t_f / m } else { f64::INFINITY }), None);
    let control = |x: f64, ln_theta: f64| {
        let [v, v1, v2] = exponent.moment(x, t_f);
        v + (law.a * v1 / v + law.b * ((-ln_theta).exp() - v) + m * v2) / k
    };
    let velocity = |x: f64| exponent.moment(x, t_f)[0];
    let protocol = ControlledProtocol { slider, v_i, v_f, t_f, velocity, control };
    // The spring force under the greatest control alone, in units of a. Errors of the control act in proportion to it, and rounding in
    // proportion to the greatest force of the motion.
    let reach = if k.is_finite() { k / law.a * t_f * size } else { 0.0 };
    open_loop(&mut verdict, row, &protocol, (v[0], 1.0 + reach + 1e-14 / rtol * followed.force), rtol);
    Task::new(&problem, t_f, context.bounded).compare_gap(&mut verdict, row, Some(followed.work));
    Ok(verdict)
}

/// Number of samples from which `sampling_error` is not checked. Chosen: limits the time of a check.
const MAX_SAMPLES: f64 = 3000.0;

/// Amplification below which the error is absolute. Chosen: smaller ones are differences of terms of size 1.
const MIN_AMPLIFICATION: f64 = 1e-2;

const TOO_STIFF: &str = "motions too stiff for an explicit integrator";

/// The columns of open-loop control of a protocol of this `least` velocity; `felt` is the effect of an error of the control at once.
fn open_loop<V, C>(
    verdict: &mut Verdict,
    row: &Row,
    protocol: &ControlledProtocol<V, C>,
    (least, felt): (f64, f64),
    rtol: f64,
) where
    V: Fn(f64) -> f64,
    C: Fn(f64, f64) -> f64,
{
    let dt = number(row, "dt").unwrap_or(0.0);
    if dt == 0.0 {
        verdict.compare(row, "sampling_error", None, None);
    }
    let columns = ["amplification", "sampling_error", "open_loop_error"];
    if row.iter().any(|(name, cell)| {
        *cell == Cell::Missing && (name != "sampling_error" || dt > 0.0) && columns.contains(&name.as_str())
    }) {
        verdict.miss("numbers of a motion that was given up");
    }
    let [grown, held, closed] = columns.map(|column| number(row, column));
    if grown.or(held).or(closed).is_none() {
        return;
    }
    let Some(growth) = (!protocol.is_stiff(least)).then(|| protocol.growth()).flatten() else {
        return verdict.miss(TOO_STIFF);
    };
    let noise = 1e-11 * growth.most / rtol;
    verdict.compare_number(row, "amplification", growth.whole, growth.whole.max(MIN_AMPLIFICATION).max(noise));
    // Effect at the end of an error rtol of the control at any time.
    let felt = felt * (1.0 + growth.most);
    let mut compare = |column: &'static str, dt: Option<f64>| match protocol.miss(dt) {
        Some(expected) => verdict.compare_number(row, column, expected, felt.max(expected)),
        None => verdict.miss(TOO_STIFF),
    };
    if closed.is_some() {
        compare("open_loop_error", None);
    }
    if held.is_some() && protocol.t_f / dt <= MAX_SAMPLES {
        compare("sampling_error", Some(dt));
    } else if held.is_some() {
        verdict.miss("controls sampled more than 3000 times");
    }
}
