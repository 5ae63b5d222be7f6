//! `regularised`: its pieces constructed between states of the optimum and integrated with a library.

use super::extremal::{Extremal, min_duration, solve};
use super::formula_path::{Formula, FormulaPath, State};
use super::gap::golden;
use super::route::integrate;
use super::verdict::{Context, Verdict, number, transition, word};
use crate::dataset::Row;
use crate::model::{Law, Transition};
use crate::protocol::SpringBlock;
use crate::table::STATUS;

/// State of the optimum at one time: `ln v` with two derivatives in time, `ln theta`, and work done.
#[derive(Debug, Clone, Copy)]
struct Moment {
    q: [f64; 3],
    y: f64,
    work: f64,
}

impl Moment {
    /// On an arc, from `v' = v (tau + a - b)/(a theta)`.
    fn moving(law: Law, q: f64, y: f64, work: f64) -> Moment {
        let Law { a, b } = law;
        let (theta, rate) = (y.exp(), (-y).exp() - q.exp());
        let slope = (1.0 + a * q + b * y + a - b) / (a * theta);
        let bend = (a * slope + b * rate) / (a * theta) - slope * rate;
        Moment { q: [q, slope, bend], y, work }
    }

    fn steady(v: f64) -> Moment {
        Moment { q: [v.ln(), 0.0, 0.0], y: -v.ln(), work: 0.0 }
    }

    /// `v` with two derivatives.
    fn velocity(&self) -> [f64; 3] {
        let [q, slope, bend] = self.q;
        let v = q.exp();
        [v, v * slope, v * (bend + slope * slope)]
    }
}

/// Sums and extremes along the motion.
struct MotionExtremes<'a> {
    slider: &'a SpringBlock,
    excess: f64,
    /// Work of the replaced segments: the scale of the rounding error of the excess.
    replaced: f64,
    /// `theta` over what of it a piece takes, `int theta v dt`: where that is little, its rounding limits the piece.
    vague: f64,
    v: [f64; 2],
    friction_min: f64,
    control: [f64; 2],
}

impl MotionExtremes<'_> {
    fn take(&mut self, v: [f64; 2], control: [f64; 2]) {
        self.v = [self.v[0].min(v[0]), self.v[1].max(v[1])];
        self.control = [self.control[0].min(control[0]), self.control[1].max(control[1])];
    }

    fn control(&self, [v, v1, v2]: [f64; 3], y: f64) -> f64 {
        let SpringBlock { law, k, m } = self.slider;
        v + (law.a * v1 / v + law.b * ((-y).exp() - v) + m * v2) / k
    }

    /// Follows the optimum for a time from a state on its arc, forwards or backwards; returns the final state.
    fn keep(&mut self, from: Moment, time: f64) -> Option<Moment> {
        const LEGS: usize = 64;
        let mut moments = vec![from];
        for _ in 0..LEGS {
            moments.push(further(self.slider.law, moments.last()?, time / LEGS as f64)?);
        }
        let at = |s: f64| {
            let leg = (s as usize).min(LEGS - 1);
            further(self.slider.law, &moments[leg], (s - leg as f64) * time / LEGS as f64)
        };
        let law = self.slider.law;
        let friction = |moment: &Moment| 1.0 + law.a * moment.q[0] + law.b * moment.y;
        self.friction_min = moments.iter().map(friction).fold(self.friction_min, f64::min);
        let control_velocity = |moment: &Moment| self.control(moment.velocity(), moment.y);
        let extreme = |sign: f64| {
            let places = moments.iter().enumerate().map(|(i, moment)| (i, sign * control_velocity(moment)));
            let (place, least) = places.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN));
            let f = |s: f64| at(s).map_or(f64::INFINITY, |moment| sign * control_velocity(&moment));
            sign * golden(&f, place.saturating_sub(1) as f64, (place + 1).min(LEGS) as f64).min(least)
        };
        self.take([f64::INFINITY, f64::NEG_INFINITY], [extreme(1.0), extreme(-1.0)]);
        moments.pop()
    }

    /// A piece between two states `time` apart that replaces a segment with `work`; `outer` states which of them are ends of the protocol.
    fn replace(&mut self, ends: [Moment; 2], outer: [bool; 2], time: f64, work: f64) -> Option<()> {
        let mut piece = Piece::new(self.slider.law, 0.0, ends, outer, time)?;
        let off_bound = ends.iter().all(|end| end.q[0] > 0.0);
        if off_bound && piece.range(|_, v| v[0])[0] < 1.0 {
            piece = Piece::new(self.slider.law, 1.0, ends, outer, time).unwrap_or(piece);
        }
        self.excess += piece.states.last()?[1] - work;
        self.replaced += work.abs();
        let theta = ends.map(|end| end.y.exp());
        self.vague = self.vague.max(theta[1] / (time - (theta[1] - theta[0])));
        let (v, control) = (piece.range(|_, v| v[0]), piece.range(|y, v| self.control(v, y)));
        let law = self.slider.law;
        self.friction_min = self.friction_min.min(piece.range(|y, v| 1.0 + law.a * v[0].ln() + law.b * y)[0]);
        self.take(v, control);
        Some(())
    }
}

/// The state on an arc after a time, or before.
fn further(law: Law, from: &Moment, time: f64) -> Option<Moment> {
    let slope = |s: &[f64; 3]| {
        let at = Moment::moving(law, s[0], s[1], 0.0);
        let v = s[0].exp();
        [at.q[1], (-s[1]).exp() - v, (1.0 + law.a * s[0] + law.b * s[1]) * v]
    };
    let [q, y, work] = integrate(slope, [from.q[0], from.y, 0.0], (0.0, time))?;
    Some(Moment::moving(law, q, y, from.work + work))
}

/// `ln(v - floor)` over the fraction `x` of the time: a quintic without a rise, the rise over the stretched place, and a bump.
#[derive(Debug, Clone, Copy)]
struct Exponent {
    floor: f64,
    level: f64,
    rise: f64,
    /// Of the powers from 1 to 5.
    quintic: [f64; 5],
    stretch: [f64; 2],
    /// Of `x^3 (1 - x)^3`.
    bump: f64,
    time: f64,
}

impl Exponent {
    /// `v` with two derivatives in time.
    fn velocity(&self, x: f64) -> [f64; 3] {
        let horner = |c: &[f64]| c.iter().rev().fold([0.0; 3], |[f, g, h], c| [f * x + c, g * x + f, h * x + 2.0 * g]);
        let [c1, c2, c3, c4, c5] = self.quintic;
        let bump = self.bump;
        let plain = horner(&[self.level, c1, c2, c3 + bump, c4 - 3.0 * bump, c5 + 3.0 * bump, -bump]);
        let [p, q] = self.stretch;
        let below = 1.0 + p * x + q * (1.0 - x);
        let xi = (1.0 + p) * x / below;
        let xi_1 = (1.0 + p) * (1.0 + q) / (below * below);
        let xi_2 = -2.0 * xi_1 * (p - q) / below;
        let step = [
            xi * xi * xi * (10.0 - 15.0 * xi + 6.0 * xi * xi),
            30.0 * xi * xi * (1.0 - xi) * (1.0 - xi),
            60.0 * xi * (1.0 - xi) * (1.0 - 2.0 * xi),
        ];
        let f1 = (plain[1] + self.rise * step[1] * xi_1) / self.time;
        let f2 = (plain[2] + self.rise * (step[2] * xi_1 * xi_1 + step[1] * xi_2)) / (self.time * self.time);
        let w = (plain[0] + self.rise * step[0]).exp();
        [self.floor + w, w * f1, w * (f2 + f1 * f1)]
    }
}

/// An integrated piece.
struct Piece {
    exponent: Exponent,
    formula_path: FormulaPath,
    states: Vec<State>,
}

/// Slip at the end of the protocol after which theta follows `1/v` there.
const MIN_END_SLIP: f64 = 5.0;

/// The stretching of an end `rho` times as high as the mean.
fn stretch(rho: f64) -> f64 {
    if rho > 1.0 { (4.0 * (rho * (1.0 + 10.0 * rho.ln()).powf(-1.0 / 3.0) - 1.0)).max(0.0) } else { 0.0 }
}

impl Piece {
    fn new(law: Law, floor: f64, ends: [Moment; 2], outer: [bool; 2], time: f64) -> Option<Piece> {
        let theta = ends.map(|end| end.y.exp());
        let growth = theta[1] - theta[0];
        let mean = (time - growth) / (time * (theta[0] * theta[1]).sqrt()) - floor;
        let v = ends.map(|end| end.velocity());
        let mut stretches = [0, 1].map(|i| if outer[i] { stretch((v[i][0] - floor) / mean) } else { 0.0 });
        if v[1][0] * time > MIN_END_SLIP * (1.0 + stretches[1]) {
            stretches[1] = 0.0;
        }
        // Slope and curvature of ln(v - floor) over the fraction of the time.
        let [[p, q], [s, t]] = v.map(|[v, v1, v2]| {
            let slope = v1 / (v - floor);
            [time * slope, time * time * (v2 / (v - floor) - slope * slope)]
        });
        let (sum, slopes, curvatures) = (-(p + 0.5 * q), s - p - q, t - q);
        let quintic = [
            p,
            0.5 * q,
            10.0 * sum - 4.0 * slopes + 0.5 * curvatures,
            -15.0 * sum + 7.0 * slopes - curvatures,
            6.0 * sum - 3.0 * slopes + 0.5 * curvatures,
        ];
        let levels = v.map(|v| (v[0] - floor).ln());
        let exponent = Exponent {
            floor,
            level: levels[0],
            rise: levels[1] - levels[0],
            quintic,
            stretch: stretches,
            bump: 0.0,
            time,
        };
        let problem = Transition { law, v_i: 1.0 / theta[0], v_f: 1.0 / theta[1] };
        let follow = |bump: f64| {
            let exponent = Exponent { bump, ..exponent };
            let formula = Formula::Velocity(Box::new(move |x| exponent.velocity(x)[0]));
            let formula_path = FormulaPath { problem, t_f: time, formula, backward: false };
            let states = formula_path.states()?;
            Some(Piece { exponent, formula_path, states })
        };
        // Theta falls as the bump rises; a protocol that cannot be integrated counts as theta = 0.
        let miss = |bump: f64| {
            let end = follow(bump).and_then(|piece| Some(piece.states.last()?[0] - ends[1].y));
            end.filter(|miss| miss.is_finite()).unwrap_or(-1e3)
        };
        let (mut low, mut high) = (-10.0, 10.0);
        while miss(low) < 0.0 {
            low *= 2.0;
            if low < -1e12 {
                return None;
            }
        }
        while miss(high) > 0.0 {
            high *= 2.0;
            if high > 1e12 {
                return None;
            }
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if miss(middle) > 0.0 { low = middle } else { high = middle }
        }
        follow(0.5 * (low + high))
    }

    /// The range of `f(ln theta, v)`, searched in equal parts of the stretched place, which resolves the layers at the ends.
    fn range(&self, f: impl Fn(f64, [f64; 3]) -> f64) -> [f64; 2] {
        let [p, q] = self.exponent.stretch;
        let at = |s: f64| {
            let xi = (s / PLACES).clamp(0.0, 1.0);
            let x = xi * (1.0 + q) / (1.0 + p * (1.0 - xi) + q * xi);
            let cell = ((x * (self.states.len() - 1) as f64) as usize).min(self.states.len() - 2);
            let from = &self.states[cell];
            let slope = |s: &[f64; 2]| [self.formula_path.t_f * ((-s[0]).exp() - self.exponent.velocity(s[1])[0]), 1.0];
            let y = integrate(slope, [from[0], from[2]], (0.0, x - from[2])).map_or(f64::NAN, |s| s[0]);
            f(y, self.exponent.velocity(x))
        };
        let values: Vec<f64> = (0..=PLACES as usize).map(|i| at(i as f64)).collect();
        let extreme = |sign: f64| {
            let places = values.iter().enumerate().map(|(i, value)| (i, sign * value));
            let (place, least) = places.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN));
            let (low, high) = ((place as f64 - 1.0).max(0.0), (place as f64 + 1.0).min(PLACES));
            sign * golden(&|s| sign * at(s), low, high).min(least)
        };
        [extreme(1.0), extreme(-1.0)]
    }
}

/// Places at which a piece is evaluated before an extreme is refined.
const PLACES: f64 = 600.0;

/// All of it.
fn again<'a>(
    slider: &'a SpringBlock,
    problem: &Transition,
    t_f: f64,
    delta_t: f64,
    best: &Extremal,
) -> Option<MotionExtremes<'a>> {
    let law = slider.law;
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let mut found = MotionExtremes {
        slider,
        excess: 0.0,
        replaced: 0.0,
        vague: 0.0,
        v: none,
        friction_min: f64::INFINITY,
        control: none,
    };
    let floor = best.time_at_floor;
    let held = |t: f64| Moment { q: [0.0; 3], y: (1.0 - (1.0 - 1.0 / problem.v_i) * (-t).exp()).ln(), work: 0.0 };
    let worked = |from: f64, to: f64| super::extremal::floor(law, held(from).y.exp(), to - from);
    // Where the arc begins, and where the optimum ends.
    let begin = Moment::moving(law, best.v_start.ln(), held(floor).y, 0.0);
    let last = Moment::moving(law, best.v_end.ln(), -problem.v_f.ln(), 0.0);
    if t_f - floor < delta_t {
        return None;
    }
    let arriving = further(law, &last, -delta_t)?;
    let (leaving, work) = if floor > delta_t {
        (held(delta_t), worked(0.0, delta_t)?)
    } else {
        let leaving = further(law, &begin, delta_t - floor)?;
        (leaving, worked(0.0, floor)? + leaving.work)
    };
    found.replace([Moment::steady(problem.v_i), leaving], [true, false], delta_t, work)?;
    let (mut from, mut gone) = (leaving, delta_t.max(floor));
    if floor > delta_t {
        let start = (floor - 0.5 * delta_t).max(delta_t);
        let (end, work, until) = if floor + 0.5 * delta_t < t_f - delta_t {
            let end = further(law, &begin, 0.5 * delta_t)?;
            (end, worked(start, floor)? + end.work, floor + 0.5 * delta_t)
        } else {
            let end = further(law, &begin, t_f - delta_t - floor)?;
            (end, worked(start, floor)? + end.work, t_f - delta_t)
        };
        for moment in [leaving, held(start)] {
            let control_velocity = found.control(moment.velocity(), moment.y);
            found.take([1.0, 1.0], [control_velocity, control_velocity]);
        }
        found.replace([held(start), end], [false, false], until - start, work)?;
        (from, gone) = (end, until);
    }
    let middle = 0.5 * (t_f - delta_t - gone);
    if middle > 0.0 {
        // From both ends, since errors grow in either direction.
        found.keep(from, middle)?;
        found.keep(arriving, -middle)?;
    }
    found.replace([arriving, Moment::steady(problem.v_f)], [false, true], delta_t, -arriving.work)?;
    Some(found)
}

/// Ratio of theta to its change in a piece beyond which the eleven digits of the integrator leave fewer than six of the change.
const MAX_THETA_RATIO: f64 = 1e5;

/// Velocity below which `v(0+)` is poorly determined by the duration.
const MIN_START_VELOCITY: f64 = 0.1;

pub fn check(row: &Row, context: &Context, rtol: f64) -> Verdict {
    let numbers = ["t_f", "k", "m", "delta_t"].map(|name| number(row, name));
    let (Some(problem), [Some(t_f), Some(k), Some(m), Some(delta_t)]) = (transition(row), numbers) else {
        return Verdict::unchecked("an axis is missing");
    };
    let mut verdict = Verdict::default();
    let overlaps = 2.0 * delta_t > t_f || context.bounded && t_f < min_duration(&problem);
    let infeasible = word(row, STATUS) == Some("infeasible");
    if infeasible && !overlaps && !context.bounded {
        verdict.miss("optima that nearly come to rest");
        return verdict;
    }
    if overlaps || infeasible {
        verdict.status(row, overlaps);
        return verdict;
    }
    if word(row, STATUS) == Some("unproven") {
        verdict.miss("status is unproven");
        return verdict;
    }
    ["work", "gap", "v_min", "v_max", "v_c_min", "v_c_max"].iter().for_each(|column| verdict.demand(row, column));
    let slider = SpringBlock { law: problem.law, k, m };
    let Some(best) = solve(&problem, t_f, context.bounded) else {
        return Verdict::unchecked("the integrator did not get there");
    };
    verdict.compare(row, "work_optimal", Some(best.work), None);
    let Some(found) = again(&slider, &problem, t_f, delta_t, &best) else {
        verdict.miss("smooth pieces that an explicit integrator cannot follow");
        return verdict;
    };
    verdict.compare(row, "work", Some(best.work + found.excess), None);
    // The relative error of both works is about 1e-12.
    let gap = found.excess / best.work;
    verdict.compare(row, "gap", Some(gap), Some(gap.abs() + 1e-11 * found.replaced / best.work / rtol));
    verdict.compare(row, "v_max", Some(found.v[1]), None);
    if best.v_start < MIN_START_VELOCITY {
        verdict.miss("ranges of pieces that lead to a near standstill");
        return verdict;
    }
    if found.vague > MAX_THETA_RATIO {
        verdict.miss("ranges of pieces that take too little of theta to be distinguished from it");
        return verdict;
    }
    let size = 1.0 + 1e-13 * found.vague / rtol;
    verdict.compare(row, "v_min", Some(found.v[0]), Some(size * found.v[0]));
    let range = if k.is_finite() { found.control } else { found.v };
    let size = size * range[0].abs().max(range[1].abs());
    verdict.compare(row, "v_c_min", Some(range[0]), Some(size));
    verdict.compare(row, "v_c_max", Some(range[1]), Some(size));
    verdict.friction(row, found.friction_min);
    if (found.v[0] - 1.0).abs() > 100.0 * rtol && found.friction_min > 0.0 {
        verdict.compare_word(row, STATUS, if found.v[0] < 1.0 { "below_bound" } else { "ok" });
    }
    verdict
}
