//! The plane of the coefficients of a cubic, and the convex set of its admissible points.

use crate::model::{Law, StateLaw};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::exp;
use crate::protocol::SolverStats;
use crate::protocol::cubic::{Basis, Landscape, Path, WorkDerivatives};

/// Two coefficients of theta, those of [`Basis`], to 32 digits: near the border the admissible set may be thinner than
/// the rounding of a double.
pub(super) type Coefficients = [DoubleDouble; 2];

/// Shortcuts of one landscape that are no slower than a velocity, and whose theta stays above a floor.
pub(super) struct Plane<'a> {
    pub landscape: &'a Landscape,
    pub basis: Basis,
    least_velocity: f64,
    floor: f64,
}

/// A constraint `value + along . (y - place) >= 0` on the points `y`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Constraint {
    pub value: f64,
    pub along: [f64; 2],
    pub of: Bound,
}

/// The admissible set of a constraint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Bound {
    /// theta above its floor.
    Lifetime,
    /// The velocity at or above its least.
    Velocity,
}

impl<'a> Plane<'a> {
    /// The admissible shortcuts. The floor of theta is 0, or, for `b > a`, the root of `1 + (b - a) ln theta = b - a`, below which a smaller
    /// theta costs less: no optimum has friction this low. If an end is below the root, the floor is half of the theta of that end.
    pub fn new(landscape: &'a Landscape, law: Law, least_velocity: f64) -> Plane<'a> {
        let ends = &landscape.ends;
        let floor = if law.b > law.a { exp(1.0 - 1.0 / (law.b - law.a)) } else { 0.0 };
        let lower = ends.theta_0.high.min(ends.theta_1.high);
        let floor = if floor < lower { floor } else { 0.5 * lower };
        let basis = if ends.rise.high < 0.0 { Basis::End } else { Basis::Start };
        Plane { landscape, basis, least_velocity, floor }
    }

    /// The straight line between the ends.
    pub fn line(&self) -> Coefficients {
        let rise = self.landscape.ends.rise;
        [if self.basis == Basis::End { -rise } else { rise }, DoubleDouble::new(0.0)]
    }

    /// The greatest distance of an admissible theta from the straight line: `theta' <= 1` bounds it by `t_f - (theta_1 -
    /// theta_0)`, and where `v >= 1`, `0 < theta < 1` does.
    pub fn reach(&self) -> f64 {
        let ends = &self.landscape.ends;
        let reach = (DoubleDouble::new(ends.t_f) - ends.rise).high;
        if self.least_velocity >= 1.0 { reach.min(1.0) } else { reach }
    }

    /// `a_2` and `a_3`.
    pub fn coefficients(&self, [y_1, y_2]: Coefficients) -> Coefficients {
        match self.basis {
            Basis::Start => [y_1, y_2],
            Basis::End => {
                let rise = self.landscape.ends.rise;
                let [two, three] = [2.0, 3.0].map(DoubleDouble::new);
                [three * rise + two * y_1 + y_2, -(three * (rise + y_1) + two * y_2)]
            }
        }
    }

    /// The shortcut at a point.
    pub fn path(&self, place: Coefficients) -> Path<'a> {
        let [a_2, a_3] = self.coefficients(place);
        Path::exact(&self.landscape.ends, a_2, a_3)
    }

    /// Work, gradient and Hessian at an admissible point.
    pub fn work_derivatives(&self, place: Coefficients, stats: &mut SolverStats) -> WorkDerivatives {
        self.landscape.work_derivatives(&self.path(place), self.basis, stats)
    }

    /// The conditions: theta above its floor and velocity above its least value, at their minima, and the
    /// velocity at both ends.
    pub fn conditions(&self, place: Coefficients) -> [Constraint; 4] {
        let path = self.path(place);
        if self.landscape.state != StateLaw::Ageing {
            return self.conditions_of_law(|x| path.at(x), path.exact_theta().minimum(), self.landscape.slowest(&path));
        }
        let mut theta = path.exact_theta();
        theta.c[0] = theta.c[0] - DoubleDouble::new(self.floor);
        let surplus = path.exact_surplus(self.least_velocity);
        let scale = self.least_velocity * self.landscape.ends.t_f;
        let velocity = |x: f64| {
            let (d_theta, d_n) = self.basis.changes(x, 1.0 - x);
            let along = [d_n[0] - scale * d_theta[0], d_n[1] - scale * d_theta[1]];
            Constraint { value: surplus.at(x).high, along, of: Bound::Velocity }
        };
        let x = theta.minimum();
        let along = self.basis.changes(x, 1.0 - x).0;
        let lifetime = Constraint { value: theta.at(x).high, along, of: Bound::Lifetime };
        [lifetime, velocity(surplus.minimum()), velocity(0.0), velocity(1.0)]
    }

    /// The conditions under another law than ageing in double precision.
    pub fn rough_conditions(&self, place: Coefficients) -> [Constraint; 4] {
        let [a_2, a_3] = self.coefficients(place).map(|a| a.high);
        let path = Path::new(&self.landscape.ends, a_2, a_3);
        let at = |x: f64| (path.theta.at(x), path.n.at(x));
        self.conditions_of_law(at, path.theta.minimum(), self.landscape.roughly_slowest(&path))
    }

    /// The conditions under another law than ageing, where `v >= 1` as long as the lack is at least a convex function of theta, from theta and `n`
    /// at a place, the place of the least theta and the slowest place.
    fn conditions_of_law(&self, at: impl Fn(f64) -> (f64, f64), lowest: f64, slowest: f64) -> [Constraint; 4] {
        let (state, t_f) = (self.landscape.state, self.landscape.ends.t_f);
        let velocity = |x: f64| {
            let ((theta, n), (d_theta, d_n)) = (at(x), self.basis.changes(x, 1.0 - x));
            let [least, slope] = state.lack(theta);
            let along = [0, 1].map(|i| d_n[i] / t_f - slope * d_theta[i]);
            Constraint { value: n / t_f - least, along, of: Bound::Velocity }
        };
        let along = self.basis.changes(lowest, 1.0 - lowest).0;
        let lifetime = Constraint { value: at(lowest).0 - self.floor, along, of: Bound::Lifetime };
        [lifetime, velocity(slowest), velocity(0.0), velocity(1.0)]
    }

    /// Whether a point is admissible.
    pub fn admits(&self, place: Coefficients) -> bool {
        self.conditions(place).iter().all(Constraint::holds)
    }
}

impl Constraint {
    /// theta is positive; the least velocity may be touched.
    pub fn holds(&self) -> bool {
        match self.of {
            Bound::Lifetime => self.value > 0.0,
            Bound::Velocity => self.value >= 0.0,
        }
    }
}

/// A point moved by a step.
pub(super) fn moved(place: Coefficients, step: [f64; 2]) -> Coefficients {
    [place[0] + DoubleDouble::new(step[0]), place[1] + DoubleDouble::new(step[1])]
}
