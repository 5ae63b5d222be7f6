//! Errors of a traced protocol in the equations of motion: integral identities on half of each of its intervals, which determine the motion.

use crate::model::{Friction, Law, StateLaw};
use crate::numerics::radau::{NODES, Nodes, radau};
use crate::numerics::{LONG_ROUNDING_RTOL, golden_section};
use crate::protocol::{Moment, Motion, SpringBlock};

/// A traced protocol, with its work and its errors in the equations.
pub struct Followed {
    state_law: StateLaw,
    slider: SpringBlock,
    motion: Box<dyn Motion>,
    /// Parameters and moments, in the order of time.
    pub samples: Vec<(f64, Moment)>,
    /// The time that each moment stands for in an integral, and the time whose rounding it carries.
    weights: Vec<[f64; 2]>,
    /// `int tau v dt`.
    pub work: f64,
    /// Greatest relative error of friction, and of theta as `int G(theta v) dt` over an interval.
    pub equation: f64,
    /// Sums of the changes of theta without sign, of those by its equation, and of their rounding errors.
    changes: [f64; 3],
    /// Greatest error of the change of the spring force `tau + m v'` as `k int v_c - v dt`, relative to the transmitted force.
    pub control: f64,
    /// The transmitted force, and the sum of what the rounding of times is multiplied by in it.
    passed: f64,
    rounded: f64,
    /// Greatest spring force, and greatest force by the control velocity alone, in units of `a`.
    pub force: f64,
    reach: f64,
}

/// Rounding of the slope at the end of a polynomial through sixteen values, of the velocity or of the time, in units of the values. Chosen: thirty
/// times the sum, 640, of the weights, since the values carry errors of the solver, too.
const SLOPE_ROUNDING: f64 = 2e4 * f64::EPSILON;

/// Rounding of a time in the slopes of a polynomial through sixteen of them. Chosen: four roundings for each value.
const TIME_ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Relative difference between the works by one rule over an interval and by the rules of its halves, above which it may be split. Derived: rules of
/// sixteen nodes converge geometrically, and half the interval squares the ratio; the halves are then good to rounding.
const RESOLVED_WORK_RTOL: f64 = 1e-9;

/// Change of theta, relative to itself, whose error counts. Chosen: its rounding is then below the default `rtol`.
const LEAST_CHANGE: f64 = 1e-3;

/// Minima of the samples that are refined. Chosen: more than a protocol has that are about as low as the least.
const REFINED_MINIMA: usize = 8;

/// Half of an interval: moments at the nodes of the rule, and what the rule needs for integrals over time.
struct Half {
    start: Moment,
    places: Nodes,
    at: [Moment; NODES],
    times: Nodes,
    /// Derivative of the time by the part of the half: of the time itself, and by the evolution of theta where that is rounded less.
    dt: [Nodes; 2],
    /// The time whose rounding is in the latter.
    rounded: f64,
}

impl Half {
    fn new(motion: &dyn Motion, state_law: StateLaw, [from, to]: [f64; 2]) -> Half {
        let (rule, start) = (radau(), motion.at(from));
        let places = rule.u.map(|u| from * (1.0 - u) + to * u);
        let at = places.map(|s| motion.at(s));
        let times = at.map(|moment| moment.t - start.t);
        let slopes = rule.slopes(&times);
        let rates = at.map(|moment| state_law.rate(moment.theta * moment.v));
        let clock = at.iter().zip(&rates).map(|(at, rate)| at.theta / rate.abs()).fold(0.0, f64::max);
        let late = at[NODES - 1].t;
        if clock.is_nan() || clock >= late {
            return Half { start, places, at, times, dt: [slopes, slopes], rounded: late };
        }
        let mut by_theta = rule.slopes(&at.map(|moment| moment.theta - start.theta));
        by_theta.iter_mut().zip(&rates).for_each(|(change, rate)| *change /= rate);
        Half { start, places, at, times, dt: [slopes, by_theta], rounded: clock }
    }

    fn integral(&self, dt: &Nodes, f: &dyn Fn(&Moment) -> f64) -> f64 {
        self.at.iter().zip(dt).zip(&radau().w).map(|((at, dt), w)| w * f(at) * dt).sum()
    }
}

impl Followed {
    /// Follows a motion of a block on a spring under an evolution law of the state, and halves intervals that are not resolved up to `splits` times.
    pub fn new(motion: Box<dyn Motion>, state_law: StateLaw, slider: &SpringBlock, splits: u32) -> Followed {
        let first = motion.at(0.0);
        let mut followed = Followed {
            state_law,
            slider: *slider,
            motion,
            samples: vec![(0.0, first)],
            weights: vec![[0.0; 2]],
            work: 0.0,
            equation: 0.0,
            changes: [0.0; 3],
            control: 0.0,
            passed: 0.0,
            rounded: 0.0,
            force: 0.0,
            reach: 0.0,
        };
        for ends in followed.motion.landmarks().windows(2) {
            let error = followed.interval([ends[0], ends[1]], splits);
            followed.equation = followed.equation.max(error);
        }
        followed.work = followed.integral(|at| at.friction * at.v);
        followed
    }

    /// Adds an interval, and returns its relative error of theta.
    fn interval(&mut self, [from, to]: [f64; 2], splits: u32) -> f64 {
        let (middle, state_law) = (0.5 * (from + to), self.state_law);
        let [before, after] = [from, to].map(|s| self.motion.at(s));
        // An arrest takes no time.
        if after.t == before.t {
            return 0.0;
        }
        let halves = [[from, middle], [middle, to]].map(|ends| Half::new(&*self.motion, state_law, ends));
        let evolved = |half: &Half| half.integral(&half.dt[0], &|at| state_law.rate(at.theta * at.v));
        let growth: f64 = halves.iter().map(evolved).sum();
        let rounding = |at: &Moment| TIME_ROUNDING * (at.t * (1.0 / at.theta).max(at.v) + 1.0);
        let noise = halves.iter().flat_map(|half| &half.at).map(rounding).fold(0.0, f64::max);
        let change = after.theta - before.theta;
        let error = ((change - growth) / after.theta).abs() - noise;
        if splits > 0 && (error > LONG_ROUNDING_RTOL || !self.resolves_work([from, to], &halves)) {
            return self.interval([from, middle], splits - 1) + self.interval([middle, to], splits - 1);
        }
        let changes = [change.abs(), growth.abs(), noise * after.theta];
        self.changes.iter_mut().zip(changes).for_each(|(sum, change)| *sum += change);
        halves.iter().for_each(|half| self.add(half));
        error.max(0.0)
    }

    /// Whether one rule over the interval and the rules of its halves give the same work.
    fn resolves_work(&self, ends: [f64; 2], halves: &[Half]) -> bool {
        let power = |at: &Moment| at.friction * at.v;
        let work = |half: &Half| half.integral(&half.dt[1], &power);
        let whole = Half::new(&*self.motion, self.state_law, ends);
        let size = whole.integral(&whole.dt[1], &|at| power(at).abs()).abs();
        let rounding = whole.at.iter().map(|at| TIME_ROUNDING * whole.rounded * power(at).abs()).fold(0.0, f64::max);
        (halves.iter().map(work).sum::<f64>() - work(&whole)).abs() <= RESOLVED_WORK_RTOL * size + rounding
    }

    /// Adds half of an interval.
    fn add(&mut self, half: &Half) {
        let SpringBlock { law, k, m } = self.slider;
        let (a, form) = (law.a, self.motion.friction());
        let Half { start, places, at, times, dt: [slopes, dt], rounded } = half;
        // Below the normal numbers a velocity has no logarithm.
        for Moment { v, theta, friction, .. } in at.iter().filter(|at| at.v >= f64::MIN_POSITIVE) {
            let error = (tau(form, &law, *v, *theta) - friction).abs() / (1.0 + friction.abs());
            self.equation = self.equation.max(error);
        }
        if k.is_finite() {
            let (late, last) = (at[NODES - 1].t, at.len() - 1);
            let extension = |at: &Moment| k * (at.v_c.unwrap_or(at.v) - at.v);
            self.passed += half.integral(slopes, &extension);
            self.reach += half.integral(slopes, &|at| extension(at).abs()).abs() / a;
            // Velocities are exponential functions of terms of the size of their logarithms.
            let blurred = |v: f64, at: &Moment| v.abs() * (1.0 + at.v.ln().abs());
            self.rounded += late * at.iter().map(|at| extension(at).abs()).fold(0.0, f64::max);
            self.rounded += k * half.integral(slopes, &|at| blurred(at.v_c.unwrap_or(at.v), at));
            // Over shorter times rounding leaves no slope.
            if times[last] > SLOPE_ROUNDING * late {
                let speeds = at.map(|moment| moment.v - start.v);
                let push = m * radau().slopes(&speeds)[last] / slopes[last];
                let force = at[last].friction + push;
                self.force = self.force.max(force.abs() / a);
                let off = (force - self.samples[0].1.friction - self.passed).abs();
                let rounding = SLOPE_ROUNDING * (m * blurred(at[last].v, &at[last]) + late * push.abs()) / times[last];
                let lack = off - rounding - f64::EPSILON * self.rounded;
                self.control = self.control.max(lack / (a * (1.0 + self.reach)));
            }
        }
        self.samples.extend(places.iter().copied().zip(*at));
        self.weights.extend(dt.iter().zip(&radau().w).map(|(dt, w)| [dt * w, *rounded]));
    }

    /// Relative error of the sum of all changes of theta without sign.
    pub fn stretch(&self) -> f64 {
        let [change, growth, noise] = self.changes;
        ((growth - change).abs() - noise).max(0.0) / (change + LEAST_CHANGE * self.samples[0].1.theta)
    }

    /// The integral of a function of the moment over time.
    pub fn integral(&self, f: impl Fn(&Moment) -> f64) -> f64 {
        self.integral_along(|_, at| f(at))
    }

    /// The integral of a function of the moment before and the moment over time. The moment before lies on the same arc, also at the end of one.
    pub fn integral_along(&self, f: impl Fn(&Moment, &Moment) -> f64) -> f64 {
        let pairs = self.samples.windows(2).zip(&self.weights[1..]);
        pairs.map(|(pair, [dt, _])| f(&pair[0].1, &pair[1].1) * dt).sum()
    }

    /// The effect of the rounding of times on the integral of a function of the moment.
    pub fn rounding(&self, f: impl Fn(&Moment) -> f64) -> f64 {
        let errors = self.samples.iter().zip(&self.weights).map(|((_, at), [_, rounded])| rounded * f(at).abs());
        f64::EPSILON * errors.fold(0.0, f64::max)
    }

    /// The moment at a parameter.
    pub fn at(&self, s: f64) -> Moment {
        self.motion.at(s)
    }

    /// Time and value of the maximum of the velocity (minimum for `sign` -1) about a sample: the vertex of a narrow parabola.
    pub fn extremum(&self, index: usize, sign: f64) -> (f64, f64) {
        let (low, high) = (self.samples[index - 1].0, self.samples[index + 1].0);
        let middle = golden_section::least(|s| -sign * self.at(s).v, (low, high)).0;
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

    /// Least value of a function of the moment, refined about the lowest minima of the samples.
    pub fn least(&self, f: impl Fn(&Moment) -> f64) -> f64 {
        let values: Vec<f64> = self.samples.iter().map(|(_, moment)| f(moment)).collect();
        let (end, above) = (values.len() - 1, |index: usize| values.get(index).copied().unwrap_or(f64::INFINITY));
        let is_minimum = |&i: &usize| above(i) <= above(i.wrapping_sub(1)) && above(i) < above(i + 1);
        let mut minima: Vec<usize> = (0..values.len()).filter(is_minimum).collect();
        minima.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
        let around = |&i: &usize| {
            let [from, to] = [i.saturating_sub(1), (i + 1).min(end)].map(|index| self.samples[index].0);
            golden_section::least(|s| f(&self.motion.at(s)), (from, to)).1.min(values[i])
        };
        minima.iter().take(REFINED_MINIMA).map(around).fold(f64::NAN, f64::min)
    }

    /// Greatest value of a function of the moment.
    pub fn greatest(&self, f: impl Fn(&Moment) -> f64) -> f64 {
        -self.least(|moment| -f(moment))
    }

    /// Least and greatest control velocity, that of the block where the spring is rigid.
    pub fn control_range(&self) -> [f64; 2] {
        let control = |at: &Moment| at.v_c.unwrap_or(at.v);
        [self.least(control), self.greatest(control)]
    }

    /// Greatest value of a function of the samples, at least 0.
    pub fn worst(&self, f: impl Fn(&Moment) -> f64) -> f64 {
        self.samples.iter().map(|(_, at)| f(at)).fold(0.0, f64::max)
    }

    /// Relative distance of theta at the end from steady sliding at `v_f`.
    pub fn arrival(&self, v_f: f64) -> f64 {
        (self.end().theta * v_f - 1.0).abs()
    }

    /// The time in the intervals whose middle is on a bound.
    pub fn time_on(&self, bound: impl Fn(&Moment) -> bool) -> f64 {
        let marks = self.motion.landmarks();
        let on = marks.windows(2).filter(|ends| bound(&self.motion.at(0.5 * (ends[0] + ends[1]))));
        on.map(|ends| self.motion.at(ends[1]).t - self.motion.at(ends[0]).t).sum()
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

/// Steps at whose ends a function is evaluated before its least value is refined. Chosen: many for each extremum of a cubic.
const SCAN_STEPS: u32 = 2000;

/// The least value on an interval.
pub fn lowest(f: &dyn Fn(f64) -> f64, (low, high): (f64, f64)) -> f64 {
    let place = |index: u32| low + (high - low) * f64::from(index.min(SCAN_STEPS)) / f64::from(SCAN_STEPS);
    let values = (0..=SCAN_STEPS).map(|index| (index, f(place(index))));
    let (index, least) = values.min_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((0, f64::NAN));
    golden_section::least(f, (place(index.saturating_sub(1)), place(index + 1))).1.min(least)
}

/// Friction by its definition.
pub fn tau(form: Friction, law: &Law, v: f64, theta: f64) -> f64 {
    let rest = 1.0 + law.b * theta.ln();
    match form {
        Friction::Log => law.a * v.ln() + rest,
        Friction::Regularised => {
            let ln_2z = v.ln() + rest / law.a;
            law.a * if ln_2z > 30.0 { ln_2z } else { (0.5 * ln_2z.exp()).asinh() }
        }
    }
}
