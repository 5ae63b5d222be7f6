//! The least-work cubic shortcut, and its gap to the optimum without cancellation.
//!
//! The admissible shortcuts form a convex set in the plane of two coefficients (`plane`): `v >= m` means that the cubic
//! `n - m t_f theta`, linear in the coefficients, is not negative on `[0, 1]`, with `m = 1` under the bound and `m = 0`
//! without. The ellipsoid method (`ellipse`) comes close to the least work. If that lies inside, Newton's method ends
//! there (`newton`); on the border, where some shortcut touches `v = m`, the ellipsoid method goes on to the end. A small
//! gap is an integral of positive terms (`excess`).

mod ellipse;
mod excess;
mod newton;
mod plane;

use super::cubic::Landscape;
use super::{Solved, SolverStats, Status, optimal};
use crate::model::Transition;
use crate::numerics::elementary::ln;
use ellipse::{Ellipse, Outcome, Until};
use plane::{Bound, Coefficients, Plane};

/// The best cubic shortcut of one transition in one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BestCubic {
    /// `alpha_2 t_f`.
    pub a_2: f64,
    /// `alpha_3 t_f^2`.
    pub a_3: f64,
    /// Its work `W_s`.
    pub work: f64,
    /// The optimal work `W*`.
    pub work_optimal: f64,
    /// `(W_s - W*)/W*`, to 1e-7 of itself or 1e-20, whichever is more.
    pub gap: f64,
    /// Its least velocity; 1 where it touches the bound.
    pub v_min: f64,
}

/// Gap from which the difference of two works, each good to 1e-12, is good to 1e-8 of itself.
const PLAIN_DIFFERENCE: f64 = 1e-4;
/// Error of that difference, relative to the works.
const DIFFERENCE_ERROR: f64 = 1e-11;

/// Roundings of the time beyond the least one.
const ROUNDINGS: f64 = 8.0;

/// Range of the work in the ellipse, relative to the work, at which the ellipse is small enough; times `a` where that is small,
/// since the work differs only by the velocities, multiplied by `a`. Newton's method converges from there.
const NEWTON_WORK_RANGE: f64 = 1e-5;

/// The shortcut of least work over the whole plane where `v >= 1` (`bounded`) or `v > 0`.
///
/// `Infeasible` where no cubic shortcut is admissible. Without the bound `BelowBound` where `v < 1` somewhere; a
/// `v_min` of 0 then means that the least work is only approached, at the border `v = 0`, where friction is negative.
/// `NegativeFriction` where `tau < 0` somewhere, `Unproven` as for the optimum.
pub fn solve(transition: &Transition, t_f: f64, bounded: bool, rtol: f64) -> Solved<BestCubic> {
    let optimum = optimal::solve(transition, t_f, bounded, rtol.min(1e-12));
    let mut stats = optimum.stats;
    let Some(optimum_value) = optimum.value else {
        return Solved { status: optimum.status, value: None, stats };
    };
    let law = transition.law;
    let landscape = Landscape::new(transition, t_f, rtol.min(1e-12));
    let rough = Landscape::new(transition, t_f, (1e-7 * law.a).clamp(1e-12, 1e-7));
    let least_velocity = if bounded { 1.0 } else { 0.0 };
    let [rough, plane] = [&rough, &landscape].map(|landscape| Plane::new(landscape, law, least_velocity));
    // Where friction is as low as that there may be no shortcut of least work, or one that costs less than the extremal.
    let steady = |v: f64| 1.0 + (law.a - law.b) * ln(v);
    let lowest = steady(transition.v_i).min(steady(transition.v_f));
    let doubtful =
        matches!(optimum.status, Status::Unproven | Status::NegativeFriction) || lowest <= (law.b - law.a).max(0.0);
    let unsolved = |status, stats| {
        let status = if doubtful && status == Status::NotConverged { Status::Unproven } else { status };
        Solved { status, value: None, stats }
    };
    let least = match least(&rough, &plane, law.a, &mut stats) {
        Ok(least) => least,
        Err(status) => return unsolved(status, stats),
    };
    let path = plane.path(least.place);
    let work = plane.work_derivatives(least.place, &mut stats).work;
    let v_min = if least.touches { least_velocity } else { path.least_velocity() };
    let difference = work - optimum_value.work;
    let excess = if difference > PLAIN_DIFFERENCE * optimum_value.work {
        difference
    } else {
        // Two routes to one number: they must agree as far as the coarser one goes, and as far as a rounding of t_f
        // leaves W* alone.
        let coarse = DIFFERENCE_ERROR * work + ROUNDINGS * f64::EPSILON * t_f * optimum_value.hamiltonian.abs();
        let excess = excess::over_optimum(transition, &path, work, bounded, &mut stats);
        match excess {
            Some(excess) if (excess - difference).abs() <= coarse => excess,
            // A path may be nowhere further than a rounding from the least time: there is no feedback then, and the difference
            // is as good as both works.
            None if difference.abs() <= coarse => difference.max(0.0),
            _ => return unsolved(Status::NotConverged, stats),
        }
    };
    let own = if v_min < 1.0 { Status::BelowBound } else { Status::Ok };
    let status = own.with_friction(path.friction_min(law)).compared_with(optimum.status);
    let [a_2, a_3] = plane.coefficients(least.place).map(|a| a.high);
    let gap = excess / optimum_value.work;
    let value = BestCubic { a_2, a_3, work, work_optimal: optimum_value.work, gap, v_min };
    Solved { status, value: Some(value), stats }
}

/// The place of least work, and whether the velocity touches its least value there.
struct Minimum {
    place: Coefficients,
    touches: bool,
}

/// Close in on the place of least work, coarsely and then, if it is not inside the set, to the end.
fn least(rough: &Plane, plane: &Plane, a: f64, stats: &mut SolverStats) -> Result<Minimum, Status> {
    let mut ellipse = Ellipse::around(rough).ok_or(Status::Infeasible)?;
    let start = match ellipse.close_in(rough, Until::Work(NEWTON_WORK_RANGE * a.min(1.0)), stats) {
        Outcome::Empty => return Err(Status::Infeasible),
        Outcome::Close(place) => place,
        Outcome::Exhausted => return Err(Status::NotConverged),
    };
    if let Some(place) = newton::descend(plane, a, start, stats) {
        return Ok(Minimum { place, touches: false });
    }
    let Outcome::Close(place) = ellipse.close_in(plane, Until::Rounding, stats) else {
        return Err(Status::NotConverged);
    };
    let mut least = Minimum { place, touches: false };
    for condition in plane.conditions(place) {
        if condition.value <= TOUCHING_SIZES * ellipse.span(condition.along).0 {
            match condition.of {
                // Cheaper and cheaper towards friction that no optimum has.
                Bound::Lifetime => return Err(Status::Unproven),
                Bound::Velocity => least.touches = true,
            }
        }
    }
    Ok(least)
}

/// Distance from a condition, in sizes of the ellipse, within which the condition counts as active.
const TOUCHING_SIZES: f64 = 16.0;
