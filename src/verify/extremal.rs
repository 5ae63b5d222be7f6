//! Optimal protocols by integration along `z = ln(theta v)`, from `theta' = 1 - theta v` and the conserved `C`.

use std::cell::Cell;
use std::f64::consts::PI;

use super::route::integrate;
use crate::model::{Law, Transition};

/// An extremal from start to target.
#[derive(Debug, Clone, Copy)]
pub struct Extremal {
    pub time: f64,
    pub work: f64,
    pub v_start: f64,
    pub v_end: f64,
    pub time_at_floor: f64,
    pub c: f64,
    /// Greatest state variable theta.
    pub theta_max: f64,
    /// Work of the same protocol varied as requested; `None` where that is not admissible.
    pub varied: Option<f64>,
}

/// A variation of a protocol: `theta (1 + size sin^2(pi k s))`, `s` from 0 to 1 over the time from the end of the hold.
#[derive(Debug, Clone, Copy)]
pub struct Variation {
    pub size: f64,
    pub k: f64,
    /// When it ends: the duration of the protocol.
    pub t_f: f64,
    /// Whether `v >= 1` is imposed.
    pub bounded: bool,
}

/// The root of `e^z - 1 - z = h` above or below 0.
pub fn branch(h: f64, above: bool) -> Option<f64> {
    if h.is_nan() || h < 0.0 {
        return None;
    }
    let mut z = if above { (1.0 + h + (2.0 * h).sqrt()).ln() } else { -h - (2.0 * h).sqrt() };
    for _ in 0..100 {
        let slope = z.exp_m1();
        if slope == 0.0 {
            break;
        }
        let step = (slope - z - h) / slope;
        z -= step;
        if step.abs() <= 1e-15 * z.abs() {
            break;
        }
    }
    Some(z)
}

/// `e^z - 1 - z` at a theta.
pub fn energy(law: Law, c: f64, theta: f64) -> f64 {
    (1.0 + (law.b - law.a) * theta.ln() + c * theta) / law.a
}

/// The value of `z` beyond the turn at which the variable changes to `ln theta`.
const LN_THETA_MIN_Z: f64 = 0.2;

/// From `theta` at `z_0`, after a hold of `time_at_floor`, until `theta` is `1/v_f`, falling or rising.
fn arc(
    problem: &Transition,
    time_at_floor: f64,
    theta: f64,
    z_0: f64,
    falling: bool,
    variation: Option<&Variation>,
) -> Option<Extremal> {
    let law = problem.law;
    let v_start = z_0.exp() / theta;
    let c = law.a * v_start - (1.0 + law.a + law.a * v_start.ln() + law.b * theta.ln()) / theta;
    let end = -problem.v_f.ln();
    let z_1 = branch(energy(law, c, 1.0 / problem.v_f), falling)?;
    let friction = |y: &[f64; 5]| 1.0 + law.a * y[3] + (law.b - law.a) * y[0];
    let admissible = Cell::new(true);
    // The power of friction of the varied protocol.
    let varied = |y: &[f64; 5]| {
        let Some(Variation { size, k, t_f, bounded }) = variation else { return 0.0 };
        let length = t_f - time_at_floor;
        let (sin, cos) = (PI * k * (y[1] - time_at_floor) / length).sin_cos();
        let (factor, growth) = (1.0 + size * sin * sin, 2.0 * size * PI * k / length * sin * cos);
        let theta = y[0].exp();
        let v = (1.0 + y[3].exp_m1() * factor - theta * growth) / (theta * factor);
        if v.is_nan() || v <= if *bounded { 1.0 } else { 0.0 } {
            admissible.set(false);
            return 0.0;
        }
        v * (1.0 + law.a * v.ln() + law.b * (theta * factor).ln())
    };
    // `y` is ln theta, time, work, z and the work of the varied protocol.
    let by_z = |y: &[f64; 5]| {
        let (theta, z) = (y[0].exp(), y[3]);
        let dt = law.a * theta / (law.a - law.b - c * theta);
        [-z.exp_m1() * dt / theta, dt, friction(y) * z.exp() / theta * dt, 1.0, varied(y) * dt]
    };
    let by_theta = |y: &[f64; 5]| {
        let (theta, z) = (y[0].exp(), y[3]);
        let dt = -theta / z.exp_m1();
        let dz = (law.a - law.b - c * theta) / (law.a * theta) * dt;
        [1.0, dt, friction(y) * z.exp() / theta * dt, dz, varied(y) * dt]
    };
    let held = floor(law, 1.0 / problem.v_i, time_at_floor)?;
    let start = [theta.ln(), time_at_floor, held, z_0, held];
    let y = if falling && z_1 > LN_THETA_MIN_Z {
        let turned = if z_0 < LN_THETA_MIN_Z { integrate(by_z, start, (z_0, LN_THETA_MIN_Z))? } else { start };
        integrate(by_theta, turned, (turned[0], end))?
    } else {
        let near = integrate(by_z, start, (z_0, z_1))?;
        let rate = by_z(&near);
        // The step that remains by rounding of z_1 is too short for the integrator.
        let step = if rate[0].abs() > 1e-3 { (end - near[0]) / rate[0] } else { 0.0 };
        std::array::from_fn(|i| near[i] + rate[i] * step)
    };
    let arrived = (y[0] - end).abs() < 1e-6 && (y[3] - z_1).abs() < 1e-6 * (1.0 + z_1.abs());
    let turn = if z_0 < 0.0 && z_1 > 0.0 { integrate(by_z, start, (z_0, 0.0))?[0].exp() } else { theta };
    arrived.then(|| Extremal {
        time: y[1],
        work: y[2],
        v_start,
        v_end: y[3].exp() * problem.v_f,
        time_at_floor,
        c,
        theta_max: turn.max(1.0 / problem.v_f).max(theta),
        varied: (variation.is_some() && admissible.get()).then_some(y[4]),
    })
}

/// Shortest duration with `v >= 1`: a hold from `1/v_i` to `1/v_f`.
pub fn min_duration(problem: &Transition) -> f64 {
    ((problem.v_i - problem.v_f).max(0.0) / (problem.v_i * (problem.v_f - 1.0))).ln_1p()
}

/// Work of the hold at `v = 1`.
pub fn floor(law: Law, theta: f64, time: f64) -> Option<f64> {
    let slope = |y: &[f64; 2]| [1.0 - y[0], 1.0 + law.b * y[0].ln()];
    integrate(slope, [theta, 0.0], (0.0, time)).map(|y| y[1])
}

fn held(v_i: f64, time: f64) -> f64 {
    1.0 - (1.0 - 1.0 / v_i) * (-time).exp()
}

/// Acceleration: by `z` at the start; below `-ln v_i`, under the bound, by the time at the floor.
pub fn from_start(problem: &Transition, q: f64, bounded: bool, variation: Option<&Variation>) -> Option<Extremal> {
    let spare = -(q + problem.v_i.ln());
    if bounded && spare > 0.0 {
        let theta = held(problem.v_i, spare);
        arc(problem, spare, theta, theta.ln(), true, variation)
    } else {
        arc(problem, 0.0, 1.0 / problem.v_i, q, true, variation)
    }
}

/// Deceleration: by `z` at the end, which gives `C`, and `C` the start.
pub fn from_end(problem: &Transition, z: f64, bounded: bool, variation: Option<&Variation>) -> Option<Extremal> {
    let (law, theta_i, theta_f) = (problem.law, 1.0 / problem.v_i, 1.0 / problem.v_f);
    let c = (law.a * (z.exp_m1() - z) - 1.0 - (law.b - law.a) * theta_f.ln()) / theta_f;
    let on_bound = |theta: f64| law.a - (1.0 + law.a + law.b * theta.ln()) / theta;
    if bounded && c > on_bound(theta_i) {
        let (mut low, mut high) = (theta_i, 1.0);
        if c >= on_bound(high) {
            return None;
        }
        while high - low > 2.0 * f64::EPSILON * high {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if on_bound(middle) < c { low = middle } else { high = middle }
        }
        let time = ((1.0 - theta_i) / (1.0 - low)).ln();
        arc(problem, time, low, low.ln(), z > 0.0, variation)
    } else {
        arc(problem, 0.0, theta_i, branch(energy(law, c, theta_i), false)?, z > 0.0, variation)
    }
}

/// Logarithm of a time that counts as infinite.
const LN_INFINITE_TIME: f64 = 1e3;

/// The optimum of this duration, and the works of admissible variations of it.
pub fn solve_with(problem: &Transition, t_f: f64, bounded: bool, sizes: &[f64]) -> Option<(Extremal, Vec<f64>)> {
    let (extremal, member) = find(problem, t_f, bounded)?;
    let works = sizes.iter().flat_map(|&size| [1.0, 2.0, 3.0].map(|k| Variation { size, k, t_f, bounded }));
    let works = works.filter_map(|variation| at(problem, member, bounded, Some(&variation))?.varied).collect();
    Some((extremal, works))
}

/// The optimum of this duration.
pub fn solve(problem: &Transition, t_f: f64, bounded: bool) -> Option<Extremal> {
    find(problem, t_f, bounded).map(|(extremal, _)| extremal)
}

/// A member of the family of extremals, by the parameter with which time rises.
#[derive(Debug, Clone, Copy)]
enum Member {
    /// `-z` at the start of an acceleration.
    Start(f64),
    /// `z` at the end of a deceleration.
    End(f64),
    /// The time at the floor before theta falls.
    Held(f64),
}

fn at(problem: &Transition, member: Member, bounded: bool, variation: Option<&Variation>) -> Option<Extremal> {
    match member {
        Member::Start(p) => from_start(problem, -p, bounded, variation),
        Member::End(p) => from_end(problem, p, bounded, variation),
        Member::Held(time) => {
            let theta = held(problem.v_i, time);
            arc(problem, time, theta, theta.ln(), true, variation)
        }
    }
}

/// Time at the floor beyond which theta is so close to 1 that the end no longer determines it.
const MAX_TIME_AT_FLOOR: f64 = 12.0;

/// The optimum of a long duration: the path after the floor hardly depends on the duration.
fn find_held(problem: &Transition, t_f: f64) -> Option<(Extremal, Member)> {
    let mut floor = t_f;
    for _ in 0..50 {
        let member = Member::Held(floor);
        let extremal = at(problem, member, true, None)?;
        let next = t_f - (extremal.time - floor);
        if (next - floor).abs() <= 4.0 * f64::EPSILON * t_f {
            return Some((extremal, member));
        }
        floor = next;
    }
    None
}

/// The optimum of this duration, and which member it is.
fn find(problem: &Transition, t_f: f64, bounded: bool) -> Option<(Extremal, Member)> {
    let accelerates = problem.v_f > problem.v_i;
    if bounded && t_f > MAX_TIME_AT_FLOOR + min_duration(problem) {
        return find_held(problem, t_f);
    }
    let member = |p: f64| if accelerates { Member::Start(p) } else { Member::End(p) };
    let at = |p: f64| at(problem, member(p), bounded, None);
    // A deceleration has a last parameter, at which the time at the floor is infinite.
    let excess = |p: f64| match at(p) {
        Some(extremal) => Some((extremal.time / t_f).ln()),
        None if !accelerates && p > 0.0 => Some(LN_INFINITE_TIME),
        None => None,
    };
    // At the turn itself rounding decides whether there is an end.
    let first = if accelerates { 0.0 } else { 1e-3 };
    let (mut low, mut high) = (first, first);
    let (mut f_low, mut f_high) = (excess(first)?, excess(first)?);
    let mut step = 0.05;
    while f_low > 0.0 {
        (high, f_high) = (low, f_low);
        low -= step;
        f_low = excess(low)?;
        step *= 2.0;
    }
    step = 0.05;
    while f_high < 0.0 {
        (low, f_low) = (high, f_high);
        high += step;
        f_high = excess(high)?;
        step *= 2.0;
    }
    let mut side = 0;
    for _ in 0..120 {
        // Regula falsi, Illinois variant.
        let even = 0.5 * (low + high);
        let p = if f_high >= 1.0 { even } else { low - f_low * (high - low) / (f_high - f_low) };
        let Some(extremal) = at(p) else {
            (high, f_high) = (p, LN_INFINITE_TIME);
            continue;
        };
        let f = (extremal.time / t_f).ln();
        if f.abs() <= 1e-12 {
            return Some((extremal, member(p)));
        }
        if high - low <= 1e-15 * (1.0 + p.abs()) {
            // The parameter has no closer double: accepted if the error is small.
            return (f.abs() <= 1e-9).then_some((extremal, member(p)));
        }
        if f > 0.0 {
            (high, f_high) = (p, f);
            f_low *= if side == 1 { 0.5 } else { 1.0 };
            side = 1;
        } else {
            (low, f_low) = (p, f);
            f_high *= if side == -1 { 0.5 } else { 1.0 };
            side = -1;
        }
    }
    None
}
