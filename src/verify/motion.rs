//! Errors of a traced protocol in the equations of motion: integral identities on half of each of its intervals, which determine the motion.

use super::Verdict;
use crate::dataset::Row;
use crate::model::{Law, StateLaw};
use crate::numerics::radau::radau;
use crate::protocol::{Moment, Motion, SpringBlock};

/// A traced protocol, with its work and its errors in the equations.
pub struct Followed {
    motion: Box<dyn Motion>,
    /// Parameters and moments, in the order of time.
    pub samples: Vec<(f64, Moment)>,
    /// `int tau v dt`.
    pub work: f64,
    /// Greatest relative error of friction, and of theta as `int G(theta v) dt` over an interval.
    pub equation: f64,
    /// Greatest error of the change of the spring force `tau + m v'` as `k int v_c - v dt`, relative to the transmitted force.
    pub control: f64,
    /// Greatest spring force, and greatest force by the control velocity alone, in units of `a`.
    pub force: f64,
    pub reach: f64,
}

/// Rounding of the slope at the end of a polynomial through sixteen values, in units of the values. Chosen: thirty times the sum, 640, of
/// the weights, since the values carry errors of the solver, too.
const SLOPE_ROUNDING: f64 = 2e4 * f64::EPSILON;

/// Rounding of a time in the slopes of a polynomial through sixteen of them. Chosen: four roundings for each value.
const TIME_ROUNDING: f64 = 64.0 * f64::EPSILON;

impl Followed {
    /// Follows a motion with ageing of a block on a spring, from steady sliding if the spring is elastic.
    pub fn new(motion: Box<dyn Motion>, slider: &SpringBlock) -> Followed {
        Followed::under(StateLaw::Ageing, motion, slider)
    }

    /// Follows a motion under an evolution law of the state.
    pub fn under(state_law: StateLaw, motion: Box<dyn Motion>, slider: &SpringBlock) -> Followed {
        let SpringBlock { law: Law { a, b }, k, m } = *slider;
        let rule = radau();
        let first = motion.at(0.0);
        let mut followed = Followed {
            motion,
            samples: vec![(0.0, first)],
            work: 0.0,
            equation: 0.0,
            control: 0.0,
            force: 0.0,
            reach: 0.0,
        };
        let (mut passed, mut friction_error) = (0.0, 0.0f64);
        let marks = followed.motion.landmarks();
        for ends in marks.windows(2) {
            let middle = 0.5 * (ends[0] + ends[1]);
            let before = followed.motion.at(ends[0]).theta;
            // An arrest takes no time.
            if followed.motion.at(ends[1]).t == followed.motion.at(ends[0]).t {
                continue;
            }
            let (mut growth, mut noise) = (0.0, 0.0f64);
            for [from, to] in [[ends[0], middle], [middle, ends[1]]] {
                let place = |u: f64| from * (1.0 - u) + to * u;
                let start = followed.motion.at(from);
                let at = rule.u.map(|u| followed.motion.at(place(u)));
                let times = at.map(|moment| moment.t - start.t);
                let dt = rule.slopes(&times);
                let integral = |f: &dyn Fn(&Moment) -> f64| -> f64 {
                    at.iter().zip(&dt).zip(&rule.w).map(|((at, dt), w)| w * f(at) * dt).sum()
                };
                growth += integral(&|at| state_law.rate(at.theta * at.v));
                followed.work += integral(&|at| at.friction * at.v);
                for Moment { t, v, theta, friction, .. } in at {
                    noise = noise.max(TIME_ROUNDING * (t * (1.0 / theta).max(v) + 1.0));
                    let error = (1.0 + a * v.ln() + b * theta.ln() - friction).abs() / (1.0 + friction.abs());
                    friction_error = friction_error.max(error);
                }
                if k.is_finite() {
                    let speeds = at.map(|moment| moment.v - start.v);
                    let last = at.len() - 1;
                    let force = at[last].friction + m * rule.slopes(&speeds)[last] / dt[last];
                    let extension = |at: &Moment| k * (at.v_c.unwrap_or(at.v) - at.v);
                    passed += integral(&extension);
                    followed.reach += integral(&|at| extension(at).abs()).abs() / a;
                    followed.force = followed.force.max(force.abs() / a);
                    let lack = (force - first.friction - passed).abs() - SLOPE_ROUNDING * m * at[last].v / times[last];
                    followed.control = followed.control.max(lack / (a * (1.0 + followed.reach)));
                }
                followed.samples.extend(rule.u.iter().map(|&u| place(u)).zip(at));
            }
            let theta = followed.motion.at(ends[1]).theta;
            followed.equation = followed.equation.max(((theta - before - growth) / theta).abs() - noise);
        }
        followed.equation = followed.equation.max(friction_error);
        followed
    }

    /// The moment at a parameter.
    pub fn at(&self, s: f64) -> Moment {
        self.motion.at(s)
    }

    /// Time and value of the maximum of the velocity (minimum for `sign` -1) about a sample: the vertex of a narrow parabola.
    pub fn extremum(&self, index: usize, sign: f64) -> (f64, f64) {
        let (low, high) = (self.samples[index - 1].0, self.samples[index + 1].0);
        let middle = golden(&|s| -sign * self.at(s).v, low, high).0;
        let h = 1e-3 * (high - low);
        let [before, here, after] = [middle - h, middle, middle + h].map(|s| self.at(s));
        let (rise, fall) = ((here.v - before.v) / (here.t - before.t), (after.v - here.v) / (after.t - here.t));
        let vertex = 0.5 * (before.t + here.t) + 0.5 * (after.t - before.t) * rise / (rise - fall);
        (if vertex.is_finite() { vertex } else { here.t }, here.v)
    }

    /// The last moment.
    pub fn end(&self) -> Moment {
        self.motion.at(1.0)
    }

    /// Least value of a function of the moment.
    pub fn least(&self, f: impl Fn(&Moment) -> f64) -> f64 {
        let values = self.samples.iter().map(|(_, moment)| f(moment)).enumerate();
        let (index, least) = values.min_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((0, f64::NAN));
        let s = |index: usize| self.samples[index.min(self.samples.len() - 1)].0;
        golden(&|s| f(&self.motion.at(s)), s(index.saturating_sub(1)), s(index + 1)).1.min(least)
    }

    /// Greatest value of a function of the moment.
    pub fn greatest(&self, f: impl Fn(&Moment) -> f64) -> f64 {
        -self.least(|moment| -f(moment))
    }

    /// Least and greatest control velocity: that of the block where the spring is rigid.
    fn control_range(&self) -> [f64; 2] {
        let control = |at: &Moment| at.v_c.unwrap_or(at.v);
        [self.least(control), self.greatest(control)]
    }

    /// Compares the least and the greatest velocity, and returns them.
    pub fn compare_velocities(&self, verdict: &mut Verdict, row: &Row) -> [f64; 2] {
        let v = [self.least(|at| at.v), self.greatest(|at| at.v)];
        verdict.compare(row, "v_min", Some(v[0]), None);
        verdict.compare(row, "v_max", Some(v[1]), None);
        v
    }

    /// Compares the least and the greatest control velocity, and returns the greatest magnitude.
    pub fn compare_control(&self, verdict: &mut Verdict, row: &Row) -> f64 {
        let range = self.control_range();
        let size = range[0].abs().max(range[1].abs());
        verdict.compare(row, "v_c_min", Some(range[0]), Some(size));
        verdict.compare(row, "v_c_max", Some(range[1]), Some(size));
        size
    }

    /// The time up to which the velocity is exactly 1.
    pub fn time_at_floor(&self) -> f64 {
        let marks = self.motion.landmarks();
        let held = marks.windows(2).take_while(|ends| self.motion.at(0.5 * (ends[0] + ends[1])).v == 1.0);
        held.last().map_or(0.0, |ends| self.motion.at(ends[1]).t)
    }
}

/// Bisections of a bracket. Derived: one of 1600 shrinks to rounding.
const BISECTIONS: u32 = 70;

/// The place between `low`, where `holds` is true, and `high`, where it is not, at which it changes.
pub fn bisect(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The least value on an interval, from `points` equal steps.
pub fn lowest(f: &dyn Fn(f64) -> f64, (low, high): (f64, f64), points: u32) -> f64 {
    let place = |index: u32| low + (high - low) * f64::from(index.min(points)) / f64::from(points);
    let values = (0..=points).map(|index| (index, f(place(index))));
    let (index, least) = values.min_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((0, f64::NAN));
    golden(f, place(index.saturating_sub(1)), place(index + 1)).1.min(least)
}

/// Position and value of the minimum in an interval that contains one.
pub fn golden(f: &dyn Fn(f64) -> f64, mut low: f64, mut high: f64) -> (f64, f64) {
    let fraction = 0.5 * (5.0_f64.sqrt() - 1.0);
    for _ in 0..80 {
        let (left, right) = (high - fraction * (high - low), low + fraction * (high - low));
        if f(left) < f(right) { high = right } else { low = left }
    }
    let middle = 0.5 * (low + high);
    (middle, f(middle))
}
