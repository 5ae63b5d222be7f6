//! `cubic`: theta is the cubic in time for which `v` is continuous at both ends.
//!
//! With `rise = 1/v_f - 1/v_i` it is the shortcut `alpha_2 = 0`, `alpha_3 t_f^2 = 3 rise` of the landscape.

use super::{Case, Family, Obstacle, Shortcut};
use crate::model::{Friction, Transition};
use crate::numerics::double_double::DoubleDouble;
use crate::protocol::cubic::{Landscape, Path, rise};
use crate::protocol::{Motion, SolverStats};

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
    let (landscape, place) = point_of(case, rtol);
    let Transition { law, v_i, v_f } = case.transition;
    let [friction_min, friction_max] = Path::exact(&landscape.ends, place[0], place[1]).friction_range(law);
    let mut member = Shortcut {
        alpha: None,
        work: friction_min * v_i * case.t_f,
        v_min: v_i,
        v_max: v_i,
        friction_max,
        friction_min,
        miss: 0.0,
    };
    if v_i != v_f {
        let point = landscape.point(place, Friction::Log, rtol, stats).ok_or(Obstacle::Velocity)?;
        // The landscape rounds the velocities of the ends.
        (member.work, member.v_min) = (point.work, point.v_min.min(v_i).min(v_f));
        member.v_max = point.v_max.max(v_i).max(v_f);
    }
    Ok(member)
}

fn motion(case: &Case, rtol: f64) -> Result<Box<dyn Motion>, Obstacle> {
    let (landscape, place) = point_of(case, rtol);
    landscape.motion(place, Friction::Log).ok_or(Obstacle::Velocity)
}

/// The landscape, and the scaled coefficients of the family's only member in it.
fn point_of(case: &Case, rtol: f64) -> (Landscape, [DoubleDouble; 2]) {
    let Transition { v_i, v_f, .. } = case.transition;
    let place = [DoubleDouble::new(0.0), DoubleDouble::new(3.0) * rise(v_i, v_f)];
    (Landscape::new(&case.transition, case.t_f, rtol), place)
}
