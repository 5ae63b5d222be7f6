//! `cubic`: theta is the cubic in time for which `v` is continuous at both ends.
//!
//! With `x = t/t_f`, `z = 1 - x` and `rise = 1/v_f - 1/v_i`: `theta = 1/v_i + rise (3 x^2 - 2 x^3)` and `n = t_f (1 -
//! theta') = t_f - 6 rise x z`, so `v = n/(t_f theta)`. It is the shortcut `alpha_2 = 0`, `alpha_3 t_f^2 = 3 rise` of
//! the landscape, which gives its work. The extrema of `p ln n + q ln theta` are roots of a polynomial of degree four;
//! both halves have their own, in the distance from their end.

use super::{Case, Family, Obstacle, Shortcut};
use crate::model::{Law, Transition};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::ln;
use crate::numerics::polynomial::roots_between;
use crate::protocol::control::ValueRange;
use crate::protocol::cubic::{Landscape, LandscapeBuffers, rise};
use crate::protocol::profile::ProtocolEnd;
use crate::protocol::{Moment, Motion, SolverStats, Status, equal_landmarks, interval_at};

/// The family `cubic`.
pub(super) const FAMILY: Family = Family {
    name: "cubic",
    doc: "theta a cubic in time, v continuous at both ends",
    alpha: None,
    uses_tau_ceiling: false,
    arrives: true,
    solve,
    motion,
};

fn solve(case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<Shortcut, Obstacle> {
    let curve = Curve::new(case)?;
    let work = curve.work(case, rtol, stats)?;
    let Law { a, b } = case.transition.law;
    let (mut v, mut friction) = (ValueRange::NONE, ValueRange::NONE);
    curve.extrema(1.0, -1.0).into_iter().for_each(|(side, d)| v.add(curve.velocity(side, d)));
    curve.extrema(a, b - a).into_iter().for_each(|(side, d)| friction.add(curve.friction(side, d)));
    Ok(Shortcut {
        alpha: None,
        work,
        v_min: v.low,
        v_max: v.high,
        friction_max: friction.high,
        friction_min: friction.low,
        miss: 0.0,
    })
}

fn motion(case: &Case, _rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
    let curve = Curve::new(case)?;
    Ok(Box::new(CubicMotion { curve, breakpoints: curve.breakpoints() }))
}

/// The only member of the family.
#[derive(Debug, Clone, Copy)]
struct Curve {
    law: Law,
    t_f: f64,
    v_i: f64,
    v_f: f64,
    theta_i: f64,
    theta_f: f64,
    /// `1/v_f - 1/v_i`.
    rise: f64,
    /// `n` at `x = 1/2`, its least value where theta rises: `t_f - 1.5 rise`.
    waist: f64,
}

impl Curve {
    fn new(case: &Case) -> Result<Curve, Obstacle> {
        let (Transition { law, v_i, v_f }, t_f) = (case.transition, case.t_f);
        let rise = rise(v_i, v_f);
        let waist = (DoubleDouble::new(t_f) - DoubleDouble::new(1.5) * rise).high;
        if waist <= 0.0 {
            return Err(Obstacle::Velocity);
        }
        Ok(Curve { law, t_f, v_i, v_f, theta_i: 1.0 / v_i, theta_f: 1.0 / v_f, rise: rise.high, waist })
    }

    /// Work from the landscape: one point of it.
    fn work(&self, case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<f64, Obstacle> {
        if self.v_i == self.v_f {
            return Ok(self.friction(ProtocolEnd::Start, 0.0) * self.v_i * self.t_f);
        }
        let (mut work, mut status) = ([0.0], [Status::Infeasible]);
        let out = LandscapeBuffers { work: &mut work, v_min: &mut [], status: &mut status };
        *stats += Landscape::new(&case.transition, self.t_f, rtol).evaluate(&[0.0], &[3.0 * self.rise], out);
        if status[0] == Status::Infeasible { Err(Obstacle::Velocity) } else { Ok(work[0]) }
    }

    fn theta(&self, side: ProtocolEnd, d: f64) -> f64 {
        match side {
            ProtocolEnd::Start => self.theta_i + self.rise * d * d * (3.0 - 2.0 * d),
            ProtocolEnd::End => self.theta_f - self.rise * d * d * (3.0 - 2.0 * d),
        }
    }

    fn velocity(&self, side: ProtocolEnd, d: f64) -> f64 {
        if d == 0.0 || self.rise == 0.0 {
            return if side == ProtocolEnd::Start { self.v_i } else { self.v_f };
        }
        let n = if self.rise > 0.0 {
            let y = 0.5 - d;
            self.waist + 6.0 * self.rise * y * y
        } else {
            self.t_f - 6.0 * self.rise * d * (1.0 - d)
        };
        n / (self.t_f * self.theta(side, d))
    }

    fn friction(&self, side: ProtocolEnd, d: f64) -> f64 {
        1.0 + self.law.a * ln(self.velocity(side, d)) + self.law.b * ln(self.theta(side, d))
    }

    /// The ends and the stationary points of `p ln n + q ln theta`, which are roots of `-p (1 - 2 x) theta + q x z n`.
    fn extrema(&self, p: f64, q: f64) -> Vec<(ProtocolEnd, f64)> {
        let Curve { t_f, rise, .. } = *self;
        let mut points = Vec::with_capacity(8);
        for (side, start) in [(ProtocolEnd::Start, -p * self.theta_i), (ProtocolEnd::End, p * self.theta_f)] {
            let mixed = rise * (2.0 * p + 3.0 * q);
            let square = -3.0 * p * rise - q * t_f - 6.0 * q * rise;
            let c = [start, q * t_f - 2.0 * start, square, 4.0 * mixed, -2.0 * mixed];
            points.push((side, 0.0));
            points.extend(roots_between(&c, 0.0, 0.5).into_iter().map(|d| (side, d)));
        }
        points.push((ProtocolEnd::Start, 0.5));
        points
    }

    /// Breakpoints in the order of time; the curve is smooth on the scale of their distance. Distances double from the
    /// ends, from the scales on which `n` and theta leave their end values.
    fn breakpoints(&self) -> Vec<(ProtocolEnd, f64)> {
        let steepest = 6.0 * self.rise.abs();
        let doubling = |theta: f64| {
            let grain = (2.0 * theta / steepest).sqrt().min(self.t_f / steepest).min(MAX_FIRST_DISTANCE);
            std::iter::successors(Some(grain), |d| Some(2.0 * d)).take_while(|&d| d < 0.4)
        };
        let mut breakpoints = vec![(ProtocolEnd::Start, 0.0)];
        breakpoints.extend(doubling(self.theta_i).map(|d| (ProtocolEnd::Start, d)));
        breakpoints.push((ProtocolEnd::Start, 0.5));
        let mut last: Vec<_> = doubling(self.theta_f).map(|d| (ProtocolEnd::End, d)).collect();
        last.reverse();
        breakpoints.extend(last);
        breakpoints.push((ProtocolEnd::End, 0.0));
        breakpoints
    }
}

/// Distance of the first breakpoint from an end, in units of `t_f`, at most. Chosen; the budgets of `shortcut` judge it.
const MAX_FIRST_DISTANCE: f64 = 0.125;

/// The member as a motion: the breakpoints are equidistant in the parameter `s`.
struct CubicMotion {
    curve: Curve,
    breakpoints: Vec<(ProtocolEnd, f64)>,
}

impl Motion for CubicMotion {
    fn duration(&self) -> f64 {
        self.curve.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        equal_landmarks(self.breakpoints.len() - 1)
    }

    fn at(&self, s: f64) -> Moment {
        let (k, fraction) = interval_at(s, self.breakpoints.len() - 1);
        // The middle is a breakpoint at equal distance from both ends.
        let ((_, from), (side, to)) = (self.breakpoints[k], self.breakpoints[k + 1]);
        let d = from * (1.0 - fraction) + to * fraction;
        let x = if side == ProtocolEnd::Start { d } else { 1.0 - d };
        Moment {
            t: self.curve.t_f * x,
            v: self.curve.velocity(side, d),
            theta: self.curve.theta(side, d),
            friction: self.curve.friction(side, d),
            v_c: None,
            beta: None,
        }
    }
}
