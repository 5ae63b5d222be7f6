//! The shortcut families of the rigid limit, one file each; [`FAMILIES`] lists them.
//!
//! All but `step` lead from steady sliding at `v_i` to steady sliding at `v_f` within `t_f`.

mod bounded_friction;
mod bounded_velocity;
mod cubic;
mod step;

use std::fmt;

use super::{Motion, SolverStats, Status};
use crate::model::{Law, Transition};

/// Transition, duration and bound that a member of a family solves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// Initial and final velocity, and the friction law.
    pub transition: Transition,
    /// Duration, `t_f > 0`.
    pub t_f: f64,
    /// Bound on friction `tau_M`, in `mu_0 sigma`; only `bounded_friction` uses it.
    pub tau_ceiling: f64,
}

impl Case {
    /// The obstacle where an argument is outside its domain.
    fn check(&self) -> Result<(), Obstacle> {
        let Transition { law: Law { a, b }, v_i, v_f } = self.transition;
        let is_inside = a > 0.0 && b >= 0.0 && self.t_f > 0.0 && v_i >= 1.0 && v_f >= 1.0;
        let is_finite = [a, b, self.t_f, v_i, v_f].iter().all(|x| x.is_finite());
        if is_inside && is_finite { Ok(()) } else { Err(Obstacle::Domain) }
    }
}

/// Member of a family that solves a [`Case`]. Every number has the requested relative accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shortcut {
    /// Parameter of the family; `None` for a family without parameter.
    pub alpha: Option<f64>,
    /// Work of friction, `int tau v dt`.
    pub work: f64,
    /// Least velocity on the open interval `(0, t_f)`, without the values before and after a jump.
    pub v_min: f64,
    /// Greatest velocity there.
    pub v_max: f64,
    /// Greatest friction there.
    pub friction_max: f64,
    /// Least friction there, or a nonnegative lower bound of it.
    pub friction_min: f64,
    /// Relative deviation of theta from the target at `t_f`, `theta(t_f) v_f - 1`; 0 for a family that arrives.
    pub miss: f64,
}

impl Shortcut {
    /// Status `Ok`, or `BelowBound` or `NegativeFriction` outside the range of the friction law.
    pub fn status(&self) -> Status {
        let status = if self.v_min < 1.0 { Status::BelowBound } else { Status::Ok };
        status.with_friction(self.friction_min)
    }
}

/// Reason why a family has no certified member for a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Obstacle {
    /// An argument outside its domain: `a > 0`, `b >= 0`, `t_f > 0`, `v_i, v_f >= 1`, all finite.
    Domain,
    /// `t_f` is not above `t_min`: no protocol with `v >= 1` is fast enough.
    Time {
        /// The least duration under `v >= 1`.
        t_min: f64,
    },
    /// The family keeps `v > 1`, so neither end may lie on `v = 1`.
    End,
    /// `v <= 0` or `theta <= 0` somewhere.
    Velocity,
    /// `tau_ceiling` is not above the friction of both ends.
    FrictionAtEnds {
        /// The greater friction of the two ends.
        friction: f64,
    },
    /// Friction at `tau_ceiling` throughout does not arrive within `t_f`.
    Friction,
    /// A defect of the program: the answer could not be certified.
    NotConverged,
}

impl Obstacle {
    /// Names, in the order of [`Obstacle::code`].
    pub const NAMES: [&'static str; 5] = ["domain", "time", "velocity", "friction", "not_converged"];

    /// Index of the violated bound in [`Obstacle::NAMES`].
    pub fn code(self) -> usize {
        match self {
            Obstacle::Domain => 0,
            Obstacle::Time { .. } => 1,
            Obstacle::End | Obstacle::Velocity => 2,
            Obstacle::FrictionAtEnds { .. } | Obstacle::Friction => 3,
            Obstacle::NotConverged => 4,
        }
    }

    /// The status of the row.
    pub fn status(self) -> Status {
        if self == Obstacle::NotConverged { Status::NotConverged } else { Status::Infeasible }
    }
}

impl fmt::Display for Obstacle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Obstacle::Domain => {
                f.write_str("an argument is outside its domain (a > 0, b >= 0, t_f > 0, v_i, v_f >= 1)")
            }
            Obstacle::Time { t_min } => {
                write!(f, "the time is too short for v >= 1: the least is t_min = {t_min}")
            }
            Obstacle::End => f.write_str("v stays above 1, so v_i and v_f must be above 1"),
            Obstacle::Velocity => f.write_str("v or theta would not stay positive"),
            Obstacle::FrictionAtEnds { friction } => {
                write!(f, "tau_ceiling must be above the friction of both ends, {friction}")
            }
            Obstacle::Friction => {
                f.write_str("tau_ceiling is too low for this time: tau = tau_ceiling throughout does not arrive")
            }
            Obstacle::NotConverged => f.write_str("the solver could not certify its answer (a defect of slipsweep)"),
        }
    }
}

/// A family of shortcuts.
pub struct Family {
    /// Name in specs and tables.
    pub name: &'static str,
    /// Description in one line.
    pub doc: &'static str,
    /// Definition of the parameter in one line; `None` for a family without parameter.
    pub alpha: Option<&'static str>,
    /// Whether `tau_ceiling` bounds the friction of the family.
    pub uses_tau_ceiling: bool,
    /// Whether its members arrive at the final state.
    pub arrives: bool,
    /// [`Family::solve`] for a case inside the domain.
    solve: fn(&Case, f64, &mut SolverStats) -> Result<Shortcut, Obstacle>,
    /// [`Family::motion`] for a case inside the domain.
    motion: fn(&Case, f64) -> PathOrObstacle,
}

/// The path of a member, or why there is none.
type PathOrObstacle = Result<Box<dyn Motion>, Obstacle>;

impl Family {
    /// Member that solves `case`, every number to the relative tolerance `rtol`; adds to `stats`.
    ///
    /// # Errors
    ///
    /// The [`Obstacle`] where the family has no certified member.
    pub fn solve(&self, case: &Case, rtol: f64, stats: &mut SolverStats) -> Result<Shortcut, Obstacle> {
        case.check()?;
        (self.solve)(case, rtol, stats)
    }

    /// Motion of that member.
    ///
    /// # Errors
    ///
    /// The [`Obstacle`] where the family has no certified member.
    pub fn motion(&self, case: &Case, rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
        case.check()?;
        (self.motion)(case, rtol)
    }
}

/// All families, in the order in which they are listed.
pub const FAMILIES: [&Family; 4] =
    [&step::FAMILY, &cubic::FAMILY, &bounded_velocity::FAMILY, &bounded_friction::FAMILY];

/// The family of this name.
pub fn find(name: &str) -> Option<&'static Family> {
    FAMILIES.into_iter().find(|family| family.name == name)
}
