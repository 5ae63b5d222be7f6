//! The optimal protocol asked at a given time: derivatives, what happens between two places, and the control it takes.

use super::arc::friction_range;
use super::extremal::{Extremal, Problem};
use super::floor;
use super::motion::{Floor, Timed};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, phi};
use crate::numerics::radau::radau;
use crate::numerics::root::crossing;
use crate::protocol::control::{Jet, Tolerance, ValueRange};

/// A place on the protocol.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathPoint {
    /// On the floor arc, after this time.
    Held(f64),
    /// On the arc, from 0 at its start to 1 at its end.
    Moving(f64),
}

/// The work, time and slip between two points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathSegment {
    /// Duration.
    pub time: f64,
    /// `int theta v dt`, the time less the growth of theta.
    pub lag: f64,
    /// Work of friction.
    pub work: f64,
}

/// The free optimal protocol: the floor arc, then the free arc.
pub struct Route {
    t_f: f64,
    floor: Floor,
    arc: Option<Timed>,
}

/// A part of an arc: from which place to which.
type Stretch<'a> = (&'a Timed, [f64; 2]);

impl Route {
    /// The route along `extremal`, or along the floor arc alone, in time `t_f`.
    pub(super) fn new(problem: &Problem, t_f: f64, extremal: Option<Extremal>) -> Route {
        let theta_s = extremal.map_or(problem.to.theta, |found| found.theta_s);
        let arc = extremal.map(|found| {
            let mut arc = Timed::new(&found.arc);
            // Rounding of the search goes to the floor arc, if there is one.
            let start = if found.time_at_floor > 0.0 { (t_f - arc.times.left[0]).max(0.0) } else { 0.0 };
            arc.times.set(start, t_f);
            arc
        });
        let floor = Floor::new(problem, theta_s, arc.as_ref().map_or(t_f, |arc| arc.times.start));
        Route { t_f, floor, arc }
    }

    /// Duration `t_f`.
    pub fn duration(&self) -> f64 {
        self.t_f
    }

    /// When the floor arc ends and the free arc begins; `None` if there is only one of them.
    pub fn corner(&self) -> Option<f64> {
        self.arc.as_ref().map(|arc| arc.times.start).filter(|&start| start > 0.0)
    }

    /// The place just after the start.
    pub fn first(&self) -> PathPoint {
        if self.arc.is_some() && self.floor.time == 0.0 { PathPoint::Moving(0.0) } else { PathPoint::Held(0.0) }
    }

    /// The place just before the end.
    pub fn last(&self) -> PathPoint {
        if self.arc.is_some() { PathPoint::Moving(1.0) } else { PathPoint::Held(self.t_f) }
    }

    /// The place at a time after the start.
    pub fn after(&self, time: f64) -> PathPoint {
        match &self.arc {
            Some(arc) if time >= arc.times.start => PathPoint::Moving(arc.place_after(time - arc.times.start)),
            _ => PathPoint::Held(time),
        }
    }

    /// The place at a time before the end.
    pub fn before(&self, time: f64) -> PathPoint {
        match &self.arc {
            Some(arc) if time <= arc.times.left[0] => PathPoint::Moving(arc.place_before(time)),
            _ => PathPoint::Held(self.t_f - time),
        }
    }

    /// Velocity with its derivatives, and theta.
    pub fn jet(&self, site: PathPoint) -> Jet {
        let (arc, place) = match (site, &self.arc) {
            (PathPoint::Moving(place), Some(arc)) => (arc, place),
            (PathPoint::Moving(_), None) => return self.held(self.t_f),
            (PathPoint::Held(time), _) => return self.held(time),
        };
        let law = &self.floor.law;
        let &Law { a, b } = law;
        let here = arc.pieces.at(place);
        let (theta, friction) = (here.theta, here.friction(law));
        let v = exp(here.ln_u - here.ln_theta);
        let rate = -exp_m1(here.ln_u);
        // Derivatives of ln v = q, ln theta = y and friction, from q' = (tau + a - b)/(a theta) and theta' = 1 - theta
        // v.
        let y1 = rate / theta;
        let q1 = (friction + a - b) / (a * theta);
        let y2 = -(y1 / theta + v * q1);
        let friction1 = a * q1 + b * y1;
        let q2 = friction1 / (a * theta) - q1 * y1;
        let friction2 = a * q2 + b * y2;
        let q3 = (friction2 - friction1 * y1) / (a * theta) - q2 * y1 - q1 * y2;
        Jet { v: [v, v * q1, v * (q2 + q1 * q1), v * (q3 + 3.0 * q1 * q2 + q1 * q1 * q1)], theta, rate }
    }

    fn held(&self, time: f64) -> Jet {
        let now = self.floor.from.aged(time);
        Jet { v: [1.0, 0.0, 0.0, 0.0], theta: now.theta, rate: now.rest }
    }

    /// When a place is reached.
    pub fn time(&self, site: PathPoint) -> f64 {
        match (site, &self.arc) {
            (PathPoint::Moving(place), Some(arc)) => arc.time(place),
            (PathPoint::Moving(_), None) => self.t_f,
            (PathPoint::Held(time), _) => time,
        }
    }

    /// Between two points: from which time to which on the floor arc, and from which place to which on the arc.
    fn stretches(&self, from: PathPoint, to: PathPoint) -> (Option<[f64; 2]>, Option<Stretch<'_>>) {
        let held = match (from, to) {
            (PathPoint::Held(start), PathPoint::Held(end)) => Some([start, end]),
            (PathPoint::Held(start), PathPoint::Moving(_)) => Some([start, self.floor.time]),
            (PathPoint::Moving(_), _) => None,
        };
        let places = match (from, to) {
            (_, PathPoint::Held(_)) => None,
            (PathPoint::Held(_), PathPoint::Moving(end)) => Some([0.0, end]),
            (PathPoint::Moving(start), PathPoint::Moving(end)) => Some([start, end]),
        };
        (held, self.arc.as_ref().zip(places))
    }

    /// Places between two, with them, between which the protocol is smooth and shows no detail much narrower.
    pub fn landmarks(&self, from: PathPoint, to: PathPoint) -> Vec<PathPoint> {
        let mut sites = vec![from];
        let (held, moving) = self.stretches(from, to);
        if let Some([start, end]) = held {
            // Theta changes over its first value, and then over 1.
            let mut time = start;
            while time < end && sites.len() < MAX_MARKS {
                time = (time + 0.5 * self.floor.from.aged(time).theta).min(end);
                sites.push(PathPoint::Held(time));
            }
        }
        if let Some((arc, [start, end])) = moving {
            if held.is_some() {
                sites.push(PathPoint::Moving(0.0));
            }
            sites.extend(arc.parts(start, end).map(|[_, to]| PathPoint::Moving(to)));
        }
        sites
    }

    /// Least friction between two places: at one of them, or in between if it falls below 0 there.
    pub fn friction_min(&self, from: PathPoint, to: PathPoint) -> f64 {
        let mut least = f64::INFINITY;
        let (law, (held, moving)) = (&self.floor.law, self.stretches(from, to));
        if let Some([start, _]) = held {
            // It rises all the way.
            least = 1.0 + law.b * self.floor.from.aged(start).ln;
        }
        if let Some((arc, ends)) = moving {
            least = least.min(friction_range(law, arc.c, &ends.map(|place| arc.pieces.at(place)))[0]);
        }
        least
    }

    /// The work, time and slip from one point to a later one.
    pub fn span(&self, from: PathPoint, to: PathPoint) -> PathSegment {
        let mut span = PathSegment { time: 0.0, lag: 0.0, work: 0.0 };
        let (held, moving) = self.stretches(from, to);
        if let Some([start, end]) = held {
            let (now, time) = (self.floor.from.aged(start), end - start);
            span.time += time;
            span.lag += lag_at_bound(now.theta, time);
            span.work += floor::work(&self.floor.law, now, time);
        }
        if let Some((arc, [start, end])) = moving {
            for [from, to] in arc.parts(start, end) {
                let sums = arc.pieces.sums(from, to);
                span.time += sums.time;
                span.lag += sums.lag;
                span.work += sums.work;
            }
        }
        span
    }

    /// Extends a range to a function of the protocol between two places, good to `tolerance`; `moment` is its value and slope in time.
    pub fn range(
        &self,
        from: PathPoint,
        to: PathPoint,
        tolerance: Tolerance,
        extent: &mut ValueRange,
        moment: impl Fn(&Jet) -> [f64; 2],
    ) {
        let (held, moving) = self.stretches(from, to);
        // v_c = 1 + (b/k) theta'/theta falls all the way, and v rests.
        held.iter().flatten().for_each(|&time| extent.add(moment(&self.held(time))[0]));
        let Some((arc, [start, end])) = moving else { return };
        let moment_at = |place| moment(&self.jet(PathPoint::Moving(place)));
        for [from, to] in arc.parts(start, end) {
            let mut before = (from, moment_at(from));
            extent.add(before.1[0]);
            for u in radau().u {
                let place = from * (1.0 - u) + to * u;
                let after = (place, moment_at(place));
                extent.add(after.1[0]);
                if (before.1[1] > 0.0) != (after.1[1] > 0.0) {
                    let pace = arc.pieces.time(before.0, after.0) / (after.0 - before.0);
                    let along = |place, [value, slope]: [f64; 2]| (place, [value, pace * slope]);
                    let (first, last) = (along(before.0, before.1), along(after.0, after.1));
                    extent.add_interval(first, last, tolerance, &|place| along(place, moment_at(place)).1);
                }
                before = after;
            }
        }
    }
}

impl Timed {
    /// The parts of `[from, to]` that lie in one piece each.
    fn parts(&self, from: f64, to: f64) -> impl Iterator<Item = [f64; 2]> {
        self.pieces.edges().map(move |[first, last]| [first.max(from), last.min(to)]).filter(|[from, to]| from < to)
    }

    /// The place at a time after the start of the arc.
    fn place_after(&self, time: f64) -> f64 {
        let piece = self.times.gone.partition_point(|&gone| gone <= time).clamp(1, self.times.gone.len() - 1) - 1;
        let [from, to] = self.pieces.edges_of(piece);
        from + inverse(time - self.times.gone[piece], to - from, |d| self.pieces.time(from, from + d))
    }

    /// The place at a time before the end of the arc.
    fn place_before(&self, time: f64) -> f64 {
        let piece = self.times.left.partition_point(|&left| left > time).clamp(1, self.times.left.len() - 1) - 1;
        let [from, to] = self.pieces.edges_of(piece);
        to - inverse(time - self.times.left[piece + 1], to - from, |d| self.pieces.time(to - d, to))
    }
}

/// `int theta v dt` over a time on `v = 1`, from theta on: no difference of times, of which it may be a small part.
pub fn lag_at_bound(theta: f64, time: f64) -> f64 {
    phi(-time) - theta * exp_m1(-time)
}

/// Most landmarks of a floor arc. Chosen: beyond, `e^-100`, nothing changes any more.
const MAX_MARKS: usize = 100;

/// The argument in `[0, most]` at which a rising function with f(0) = 0 takes a value.
fn inverse(value: f64, most: f64, f: impl Fn(f64) -> f64) -> f64 {
    let excess = |d: f64| f(d) - value;
    let last = excess(most);
    // Rounding may leave it at the end.
    if last <= 0.0 { most } else { crossing(excess, [0.0, most], [-value, last], f64::EPSILON * most).clamp(0.0, most) }
}

#[cfg(test)]
mod tests {
    use super::lag_at_bound;

    /// `t - 1 + e^-t + theta (1 - e^-t)` by its series in `t`, forty terms, where they do not cancel.
    fn series(theta: f64, time: f64) -> f64 {
        let (mut power, mut sum) = (time, theta * time);
        for k in 2..40 {
            power *= -time / f64::from(k);
            sum += (theta - 1.0) * power;
        }
        sum
    }

    #[test]
    fn reference_the_lag_at_the_bound_is_its_series() {
        for theta in [1e-12, 1e-3, 0.5, 1.0 - 1e-12] {
            for time in [1e-300, 1e-13, 1e-6, 1e-3, 0.0999, 0.1, 0.1001, 0.5, 1.0] {
                let (found, expected) = (lag_at_bound(theta, time), series(theta, time));
                assert!((found / expected - 1.0).abs() <= 2e-15, "{theta} {time}: {found:e} {expected:e}");
            }
        }
        assert_eq!(lag_at_bound(0.3, 800.0), 799.3);
    }
}
