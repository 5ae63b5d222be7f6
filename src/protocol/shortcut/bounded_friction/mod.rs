//! `bounded_friction`: `tau < tau_M` by construction.
//!
//! `tau = tau_M - (tau_M - tau_i) R^x e^(alpha_3 x (1 - x))` with `x = t/t_f` and `R = (tau_M - tau_f)/(tau_M - tau_i)`
//! falls strictly with `alpha_3` at every inner `x`. By comparison `theta' = 1 - theta^(1 - b/a) e^((tau - 1)/a)` makes
//! `theta(t_f)` from `theta(0) = 1/v_i` rise strictly with `alpha_3`. Its limits are that of `tau = tau_M` throughout
//! and that of `v = 0`, which is `1/v_i + t_f`. So there is one member if `1/v_f` lies strictly between them, none
//! otherwise. Read backwards from `t_f`, `theta(0)` falls with `alpha_3`, and the conditions are the same.
//!
//! As `tau_M` grows, `alpha_3` tends to 0 and friction to a parabola in time, `tau_i + (tau_f - tau_i) x + A x (1 -
//! x)`, which is the member for an infinite `tau_M`: there is no bound.
//!
//! `d(theta')/d(theta) = (b/a - 1) v`: theta is integrated forwards for `b <= a` and backwards for `b > a`, as both
//! contract. Where the time is just long enough, theta arrives whatever `alpha_3` is, but for little. Then the time to
//! spare is compared with what takes it: the slip `int theta v dt` beyond the time of `v = 0`, and beyond that of
//! `tau = tau_M`, with `z_M = ln(theta v)` for friction `tau_M`,
//!
//! ```text
//! int [1 - e^(-(tau_M - tau)/a)]/[1 - e^(-z_M)] dt.
//! ```
//!
//! Both are sums of positive terms and fall like `1/|alpha_3|`.
//!
//! Where the block stands still in between, either pass would lose in the standstill what tells its start from its end:
//! there both ends are followed to a place in it, and the slip on both ways is compared with the time to spare.

mod extent;
mod gap;
mod motion;
mod panel;
mod path;

use super::{Case, Family, Obstacle, Shortcut};
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::gauss::rule;
use crate::numerics::root::{Probe, newton};
use crate::protocol::{Motion, SolverStats};
use extent::Extent;
use gap::gap;
use motion::Resolution;
use panel::Panel;
use path::{FrictionPath, Measure, Stop, WorkSums};

/// The family.
pub struct BoundedFriction;

impl Family for BoundedFriction {
    fn name(&self) -> &'static str {
        "bounded_friction"
    }

    fn doc(&self) -> &'static str {
        "tau < tau_ceiling by construction, v continuous at both ends"
    }

    fn alpha(&self) -> Option<&'static str> {
        Some("alpha_3 in tau = tau_ceiling - (tau_ceiling - tau_i) R^x exp[alpha_3 x (1 - x)], x = t/t_f")
    }

    fn uses_tau_ceiling(&self) -> bool {
        true
    }

    fn solve(&self, case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<Shortcut, Obstacle> {
        let mut extent = None;
        let path = member(case, rtol, stats, |path, panel| match panel {
            Some(panel) => extent.get_or_insert_with(|| Extent::new(&case.transition)).add(path, panel),
            None => extent = None,
        })?;
        let extent = extent.unwrap_or_else(|| Extent::steady(&path, case.transition.v_i));
        if !extent.work.is_finite() {
            return Err(Obstacle::NotConverged);
        }
        Ok(Shortcut {
            alpha: Some(if case.tau_ceiling == f64::INFINITY { 0.0 } else { path.alpha }),
            work: extent.work,
            v_min: extent.v_min,
            v_max: extent.v_max,
            friction_max: path.friction_max().min(case.tau_ceiling),
            friction_min: path.friction_min(),
            miss: 0.0,
        })
    }

    fn motion(&self, case: &Case, rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
        let mut panels = Vec::new();
        let mut path = member(case, rtol, &mut SolverStats::default(), |_, panel| match panel {
            Some(panel) => panels.push(*panel),
            None => panels.clear(),
        })?;
        if panels.is_empty() {
            // Steady sliding: one panel tells it all.
            let tolerances = (0.1 * rtol, 0.1 * rtol);
            let work = WorkSums { accuracy: rtol, expected: 0.0 };
            let again = path.pass(tolerances, Some(work), &mut SolverStats::default(), |_, panel| panels.push(*panel));
            again.map_err(|_| Obstacle::NotConverged)?;
            path.alpha = 0.0;
        }
        // What was integrated backwards lies behind what was integrated forwards.
        let (mut panels, backward): (Vec<Panel>, Vec<Panel>) = panels.into_iter().partition(|panel| panel.forward);
        panels.extend(backward.into_iter().rev());
        Ok(Box::new(Resolution { path, panels }))
    }
}

/// Stands for an infinite distance from the bound.
const FAR: f64 = 1e100;

/// Below this share of [`FrictionPath::worth`] the time to spare is what a course is measured by.
const CLOSE: f64 = 0.1;

/// Share of the time that a standstill takes beyond which the ways to it are compared with the time to spare.
const STANDSTILL: f64 = 0.1;

/// Tolerance of the first search.
const COARSE: f64 = 1e-4;

/// Logarithm of the ratio of the velocities beyond which they count as far apart, and `b/a` times it.
const FAR_APART: f64 = 7.0;
const FAR_APART_FOR_THETA: f64 = 1e3;

/// What ends it.
const ENOUGH: f64 = 1e-3;

/// Accuracy of what is not to be had at less.
const FINE: f64 = 1e-8;

/// Growth of errors beyond which the other direction is tried.
const MOST_ERRORS: f64 = 1e3;

/// Rounding of theta beyond which a pass counts as lost, where less is not asked for: as long as another way may have
/// less, and then.
const LITTLE_NOISE: f64 = 1e-11;
const MOST_NOISE: f64 = 1e-9;

/// Most passes after the first search: Newton's method needs two or three, and a dozen more where theta has all but
/// relaxed at the end.
const MOST_PASSES: u32 = 40;

/// Change of some velocity by the last step beyond which rounding has left too little of a way, as long as there may be
/// another.
const SURE: f64 = 1e-3;

/// Tolerance of the nodes of the last pass, in units of rtol.
const LAST: f64 = 0.1;

/// Least tolerance of nodes: rounding allows no less.
const FINEST: f64 = 1e-13;

/// What rounding of `w` may leave of the target.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// The course of the member that solves the case; the panels of its last pass go to `visit`, `None` when a pass begins.
/// No panel is visited where the protocol is steady sliding.
fn member(
    case: &Case,
    rtol: f64,
    stats: &mut SolverStats,
    mut visit: impl FnMut(&FrictionPath, Option<&Panel>),
) -> Result<FrictionPath, Obstacle> {
    let (law, v_i, v_f, t_f) = (case.transition.law, case.transition.v_i, case.transition.v_f, case.t_f);
    let sound = law.a > 0.0 && law.b >= 0.0 && t_f > 0.0 && v_i >= 1.0 && v_f >= 1.0;
    if !sound || ![law.a, law.b, t_f, v_i, v_f].iter().all(|x| x.is_finite()) || case.tau_ceiling.is_nan() {
        return Err(Obstacle::Domain);
    }
    let unbounded = case.tau_ceiling == f64::INFINITY;
    let distance = |v: f64| if unbounded { FAR } else { gap(law, case.tau_ceiling, v) };
    let (gap_i, gap_f) = (distance(v_i), distance(v_f));
    if gap_i <= 0.0 || gap_f <= 0.0 {
        return Err(Obstacle::FrictionAtEnds { friction: case.tau_ceiling - gap_i.min(gap_f) });
    }
    let change = (v_i - v_f) / v_f;
    let log_ratio = if change.abs() < 0.5 { ln_1p(change) } else { ln(v_i / v_f) };
    let share = (law.a - law.b) * log_ratio / gap_i;
    let ln_r = if share.abs() < 0.5 { ln_1p(share) } else { ln(gap_f / gap_i) };
    if v_i == v_f {
        return Ok(FrictionPath::new(case, (gap_i, gap_f), ln_r, log_ratio, Measure::Level));
    }
    // Time beyond that of v = 0 or that of tau = tau_M.
    let accelerates = v_f > v_i;
    let spare = t_f
        - if accelerates {
            fastest(law.a, v_i, -log_ratio, (gap_i, gap_f), stats)
        } else {
            (v_i - v_f) / v_i * (1.0 / v_f)
        };
    if spare <= 0.0 {
        return Err(if accelerates { Obstacle::Friction } else { Obstacle::Velocity });
    }
    let measure = if accelerates { Measure::Lag { spare } } else { Measure::Slip { spare } };
    let path = FrictionPath::new(case, (gap_i, gap_f), ln_r, log_ratio, measure);
    let close = spare < CLOSE * path.worth(0.0).min(t_f);
    // From a standstill theta grows, and forgets forwards what it was.
    let measured = if accelerates { path } else { path.towards(true) };
    let level = path.measured_by(Measure::Level);
    let meeting = path.towards(true).measured_by(Measure::Meeting { spare });
    let all = [measured, measured.reversed(), level, level.reversed(), meeting];
    // What a pass through a standstill loses grows like the ratio of the velocities, and where theta runs away, b/a
    // times.
    let far = log_ratio > FAR_APART || log_ratio * law.b > FAR_APART_FOR_THETA * law.a;
    let standstill = !accelerates && far && t_f - spare > STANDSTILL * t_f;
    let order: &[usize] = match (standstill, close) {
        (true, true) => &[4, 0, 1, 2, 3],
        (true, false) => &[4, 2, 3, 0, 1],
        (false, true) => &[0, 1, 2, 3, 4],
        (false, false) => &[2, 3, 4, 0, 1],
    };
    let order = order.iter().filter(|&&place| !(accelerates && place == 4));
    let mut start = None;
    // Rounding of the time, spent at the greater velocity, allows no better.
    let blur = 100.0 * f64::EPSILON * t_f * v_i.max(v_f);
    let (little, most) = (LITTLE_NOISE.max(rtol), MOST_NOISE.max(rtol).max(blur));
    // Where errors grow on every way, a rough pass may be lost and a fine one not.
    let fine = rtol.min(FINE);
    for (strict, most_noise, rtol) in
        [(true, little, rtol), (true, most, rtol), (false, most, rtol), (false, most, fine)]
    {
        for path in order.clone().map(|&place| all[place]) {
            let Some((alpha, errors)) = rough(&path, start, strict, stats) else { continue };
            start = start.or((path.measure == Measure::Level || errors < MOST_ERRORS).then_some(alpha));
            if strict && errors > MOST_ERRORS {
                continue;
            }
            if let Some(found) = refined(path.with(alpha), (rtol, most_noise), strict, stats, &mut visit) {
                return Ok(found);
            }
        }
    }
    Err(Obstacle::NotConverged)
}

/// `alpha_3` to [`COARSE`], and by how much errors on the way would grow.
fn rough(path: &FrictionPath, start: Option<f64>, strict: bool, stats: &mut SolverStats) -> Option<(f64, f64)> {
    match path.measure {
        Measure::Level => search(path, start.unwrap_or(0.0), strict, stats),
        Measure::Slip { spare } | Measure::Meeting { spare } => closest(path, 2.0 * path.t_f / spare, strict, stats),
        Measure::Lag { spare } => closest(path, -2.0 * path.t_f / spare, strict, stats),
    }
}

/// [`close`], and once more to as much as the growth of errors asks for where there is no way on which they grow less.
fn closest(path: &FrictionPath, start: f64, strict: bool, stats: &mut SolverStats) -> Option<(f64, f64)> {
    let (alpha, errors) = close(path, start, (COARSE, ENOUGH), stats)?;
    if strict || errors < MOST_ERRORS {
        return Some((alpha, errors));
    }
    let fine = ((COARSE / errors).max(FINEST), ENOUGH * ENOUGH);
    close(path, alpha / path.unit(), fine, stats).or(Some((alpha, errors)))
}

/// The course from a rough `alpha_3` on to the one that arrives; `None` where it does not come so far.
fn refined(
    mut path: FrictionPath,
    (rtol, most_noise): (f64, f64),
    strict: bool,
    stats: &mut SolverStats,
    visit: &mut impl FnMut(&FrictionPath, Option<&Panel>),
) -> Option<FrictionPath> {
    visit(&path, None);
    let (mut last_pass, mut before, mut tolerance, mut expected) = (false, f64::INFINITY, 0.1 * rtol, 0.0);
    for _ in 0..MOST_PASSES {
        let pass = |path: &FrictionPath, panel: &Panel| {
            if last_pass {
                visit(path, Some(panel));
            }
        };
        // The last pass tells the work and the extremes too, which lie between the nodes.
        let nodes = (LAST * rtol).max(FINEST);
        let fine = nodes * nodes.sqrt();
        let (within_pass, work) = if last_pass {
            ((tolerance.min(fine), fine), Some(WorkSums { accuracy: nodes, expected: 0.5 * expected }))
        } else {
            ((tolerance, 0.1 * rtol), None)
        };
        let end = path.pass(within_pass, work, stats, pass).ok()?;
        expected = end.work;
        let (_, step) = path.miss(&end);
        let scale = path.scale(&end);
        let within = |share: f64| step.abs() <= share * scale;
        // Rounding allows no better, once Newton's method no longer gains; that of the bound, and of alpha itself, only
        // where no other way tells more.
        let neighbours = step.abs() <= f64::EPSILON * path.alpha.abs();
        let rounding = path.rounding(&end).max(if strict { 0.0 } else { path.blur });
        let spent = step.abs() <= ROUNDING * rounding && step.abs() >= 0.5 * before
            || path.alpha + step == path.alpha
            || neighbours && !strict;
        if end.noise * f64::EPSILON > most_noise {
            return None;
        }
        // Slips that add up to the time to spare are known to its rounding. Where that leaves more of alpha than is asked for,
        // theta at the end may tell the rest. What rounding of t_f itself leaves, no way tells.
        let vague = ROUNDING * path.lost_in_sum(&end) > 0.5 * rtol.max(LITTLE_NOISE) * scale;
        if strict && last_pass && vague {
            return None;
        }
        if last_pass && (within(0.5 * rtol) || spent) {
            // Where nothing depends on alpha but by rounding, this way tells nothing.
            return within(if strict { SURE } else { 1.0 }).then_some(path);
        }
        // From side to side of the next double: another way to the end may tell more.
        if !step.is_finite() || last_pass && neighbours {
            return None;
        }
        // What a panel may lack for the end to be as good as the step that is to come.
        let share = 5.0 * rtol * scale * path.precision(&end) / path.size;
        let wanted =
            if path.measure == Measure::Level { share } else { 0.1 * rtol * (scale / path.alpha.abs()).min(1.0) };
        tolerance = wanted.clamp(f64::MIN_POSITIVE, 0.1 * rtol);
        // Newton's method doubles the digits.
        last_pass = within(rtol.sqrt()) || spent;
        before = step.abs();
        path = path.with(path.alpha + step);
        visit(&path, None);
    }
    None
}

/// The time in which an acceleration arrives with `tau = tau_M` throughout, `int e^y/(e^z - 1) dy` over `y = ln theta`.
///
/// `z = ln(theta v)` is linear in `y` there, from `gap_i/a` to `gap_f/a`; panels double with `z`, so that the pole at
/// `z = 0` stays away.
fn fastest(a: f64, v_i: f64, span: f64, (gap_i, gap_f): (f64, f64), stats: &mut SolverStats) -> f64 {
    let rule = rule(24);
    let (z_i, z_f) = (gap_i / a, gap_f / a);
    let growth = (z_f / z_i).abs().max(z_i / z_f);
    let panels = (1.5 * ln(growth) + span).ceil().clamp(1.0, 400.0);
    stats.quadratures += 1;
    let mut time = 0.0;
    for panel in 0..panels as u32 {
        // The share of the way and z: geometric in z, or even in y where z hardly changes.
        let place = |s: f64| {
            if growth > 2.0 {
                let power = s * ln(z_f / z_i);
                (z_i * (exp_m1(power) / (z_f - z_i)), z_i * exp(power))
            } else {
                (s, z_i + s * (z_f - z_i))
            }
        };
        let (low, high) = (place(f64::from(panel) / panels), place(f64::from(panel + 1) / panels));
        stats.nodes += rule.x.len() as u32;
        for (x, w) in rule.x.iter().zip(&rule.w) {
            let between = |low: f64, high: f64| low + 0.5 * (high - low) * (1.0 + x);
            let (share, z) = (between(low.0, high.0), between(low.1, high.1));
            time += 0.5 * (high.0 - low.0) * w * span * exp(-share * span) / v_i / exp_m1(z);
        }
    }
    time
}

/// `alpha_3` to [`COARSE`], from a start, and the growth of errors.
fn search(path: &FrictionPath, start: f64, strict: bool, stats: &mut SolverStats) -> Option<(f64, f64)> {
    let unit = path.unit();
    let (mut gave_up, mut errors) = (false, f64::INFINITY);
    let probe = |x: f64| {
        let path = path.with(unit * x);
        let end = match path.pass((COARSE, COARSE), None, stats, |_, _| ()) {
            Ok(end) => end,
            Err(Stop::Little) => return Some(Probe { value: -f64::MAX, slope: 0.0 }),
            Err(Stop::Much) => return Some(Probe { value: f64::MAX, slope: 0.0 }),
            Err(Stop::GaveUp) => {
                gave_up = true;
                return Some(Probe { value: 0.0, slope: 0.0 });
            }
        };
        errors = end.errors;
        let (miss, step) = path.miss(&end);
        // In units of the change that alpha bears; a step that doubles alpha is far enough.
        let scale = 1.0 + x.abs();
        let bounded = (step / unit).clamp(-FARTHEST * scale, FARTHEST * scale);
        let wrong = bounded.is_nan() || (bounded < 0.0) != (miss > 0.0);
        if wrong {
            return Some(Probe { value: miss, slope: 0.0 });
        }
        // A step that is small beside alpha may still lead beyond a theta that is about to be lost.
        let weight = (1.0 / scale).max(FAR_OFF * miss.abs() / path.size / bounded.abs());
        // Theta may be about to arrive whatever alpha is: what grows there vanishes beyond.
        let weight = if strict && errors > MOST_ERRORS { weight.max(2.0 * ENOUGH / bounded.abs()) } else { weight };
        Some(Probe { value: -bounded * weight, slope: weight })
    };
    let root = newton(probe, start / unit, (f64::NEG_INFINITY, f64::INFINITY), false, ENOUGH);
    root.filter(|_| !gave_up).map(|root| (unit * root.x, errors))
}

/// What a theta at the end that is off by itself counts, beside the relative change of `alpha_3` that ends the search.
const FAR_OFF: f64 = 0.1;

/// Longest step of the search, in units of what alpha bears.
const FARTHEST: f64 = 4.0;

/// `alpha_3` to a tolerance where the time is just long enough: far out, where the layers at the ends shrink like
/// `1/alpha_3`, from a start in units of [`FrictionPath::unit`].
fn close(
    path: &FrictionPath,
    start: f64,
    (tolerance, enough): (f64, f64),
    stats: &mut SolverStats,
) -> Option<(f64, f64)> {
    let unit = path.unit();
    let (mut gave_up, mut errors) = (false, f64::INFINITY);
    let place = |q: f64| 0.5 * unit * (exp_m1(q) - exp_m1(-q));
    let probe = |q: f64| {
        let path = path.with(place(q));
        match path.pass((tolerance, tolerance), None, stats, |_, _| ()) {
            Ok(end) => {
                errors = end.errors;
                let (value, step) = path.miss(&end);
                let stretch = 0.5 * unit * (exp(q) + exp(-q));
                Some(Probe { value, slope: (-value / step * stretch).max(0.0) })
            }
            Err(Stop::Little) => Some(Probe { value: -f64::MAX, slope: 0.0 }),
            Err(Stop::Much) => Some(Probe { value: f64::MAX, slope: 0.0 }),
            Err(Stop::GaveUp) => {
                gave_up = true;
                Some(Probe { value: 0.0, slope: 0.0 })
            }
        }
    };
    let start = start.signum() * ln_1p(2.0 * start.abs());
    let root = newton(probe, start, (-FARTHEST_OUT, FARTHEST_OUT), false, enough);
    root.filter(|_| !gave_up).map(|root| (place(root.x), errors))
}

/// Logarithm of the greatest `alpha_3` in units of [`FrictionPath::unit`].
const FARTHEST_OUT: f64 = 100.0;
