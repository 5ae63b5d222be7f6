//! The least-work cubic shortcut, and its gap to the optimum without cancellation.
//!
//! The admissible shortcuts form a convex set in the plane of two coefficients (`plane`): `v >= m` means that the cubic
//! `n - m t_f theta`, linear in the coefficients, is not negative on `[0, 1]`, with `m = 1` under the bound and `m = 0`
//! without. The ellipsoid method (`ellipse`) approaches the minimum. If it is inside the set, Newton's method finishes
//! (`newton`); on the border, where the best shortcut touches `v = m`, the ellipsoid method continues down to rounding. A small
//! gap is an integral of positive terms (`excess`).
//!
//! Under the other laws the set is convex too, but the work is not: samples of the whole set lead to its least value (`polar`).

mod ellipse;
mod excess;
mod newton;
mod plane;
mod polar;

use super::cubic::Landscape;
use super::optimal::Bounds as OptimumBounds;
use super::{Solved, SolverStats, Status, optimal, relaxed};
use crate::model::{StateLaw, Transition};
use crate::numerics::LONG_ROUNDING_RTOL;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::ln;
use ellipse::{CutResult, Ellipse, Until};
use plane::{Bound, Coefficients, Plane};

/// The best cubic shortcut of a transition and a duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BestCubic {
    /// `alpha_2 t_f`.
    pub a_2: f64,
    /// `alpha_3 t_f^2`.
    pub a_3: f64,
    /// Both with 32 digits: on the border of the admissible set, rounded ones may lie outside.
    pub coefficients: [DoubleDouble; 2],
    /// Its work `W_s`.
    pub work: f64,
    /// The optimal work `W*`.
    pub work_optimal: f64,
    /// `(W_s - W*)/W*`, with a relative error up to 1e-7 or an absolute error up to 1e-20.
    pub gap: f64,
    /// Its least velocity; 1 where it touches the bound.
    pub v_min: f64,
    /// Its greatest velocity.
    pub v_max: f64,
}

/// Gap from which the difference of two works, each good to 1e-12, is good to 1e-8 of itself. Derived from these errors.
const PLAIN_DIFFERENCE: f64 = 1e-4;

/// Roundings of the time beyond the least one. Chosen: more than the few operations of the least time lose.
const ROUNDINGS: f64 = 8.0;

/// Range of the work in the ellipse, relative to the work, at which the ellipse is small enough; times `a` where that is small,
/// since the work differs only by the velocities, multiplied by `a`. Chosen: Newton's method converges from there.
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
    // At such low friction there may be no shortcut of least work, or one that costs less than the extremal.
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
        // Two routes to one number must agree within the errors of the coarser one, and of W* by the rounding of t_f.
        let coarse =
            10.0 * LONG_ROUNDING_RTOL * work + ROUNDINGS * f64::EPSILON * t_f * optimum_value.hamiltonian.abs();
        let excess = excess::over_optimum(transition, &path, work, bounded, &mut stats);
        match excess {
            Some(excess) if (excess - difference).abs() <= coarse => excess,
            // A path within a rounding of the least time has no feedback; the difference then has the errors of both works.
            None if difference.abs() <= coarse => difference.max(0.0),
            _ => return unsolved(Status::NotConverged, stats),
        }
    };
    let own = if v_min < 1.0 { Status::BelowBound } else { Status::Ok };
    let status = own.with_friction(path.friction_min(law)).compared_with(optimum.status);
    let coefficients = plane.coefficients(least.place);
    let [a_2, a_3] = coefficients.map(|a| a.high);
    let (gap, v_max) = (excess / optimum_value.work, landscape.greatest_velocity(&path));
    let value = BestCubic { a_2, a_3, coefficients, work, work_optimal: optimum_value.work, gap, v_min, v_max };
    Solved { status, value: Some(value), stats }
}

/// The shortcut of least work under an evolution law of the state where `v >= 1` (`bounded`), compared with the optimum under a velocity ceiling.
///
/// The ceiling bounds the optimum alone. Statuses are those of [`solve`]; `Infeasible` also where the ceiling leaves no protocol. Other laws
/// than ageing always have the bound. Their `gap` is the difference of two works; that no lesser work hides between samples is numerical
/// evidence (docs/derivations.md, "Best cubic shortcuts of other laws").
pub fn solve_under(
    state: StateLaw,
    transition: &Transition,
    t_f: f64,
    bounds: OptimumBounds,
    rtol: f64,
) -> Solved<BestCubic> {
    if state != StateLaw::Ageing {
        return solve_nonconvex(state, transition, t_f, bounds.v_ceiling, rtol);
    }
    let solved = solve(transition, t_f, bounds.floor, rtol);
    if !bounds.v_ceiling.is_finite() {
        return solved;
    }
    let optimum = optimal::solve(transition, t_f, bounds, rtol.min(1e-12));
    let stats = SolverStats { nodes: solved.stats.nodes + optimum.stats.nodes, ..solved.stats };
    match (solved.value, optimum.value) {
        (Some(best), Some(least)) if least.time_at_v_ceiling > 0.0 => {
            let gap = (best.work - least.work) / least.work;
            let value = Some(BestCubic { work_optimal: least.work, gap, ..best });
            Solved { status: solved.status.compared_with(optimum.status), value, stats }
        }
        (_, None) => Solved { status: optimum.status, value: None, stats },
        _ => Solved { stats, ..solved },
    }
}

/// [`solve_under`] for the laws whose work is not convex.
fn solve_nonconvex(state: StateLaw, transition: &Transition, t_f: f64, v_ceiling: f64, rtol: f64) -> Solved<BestCubic> {
    let optimum = relaxed::solve(state, transition, t_f, v_ceiling);
    let mut stats = optimum.stats;
    let without = |status, stats| Solved { status, value: None, stats };
    let Some(work_optimal) = optimum.value.map(|found| found.optimum.work) else {
        return without(optimum.status, stats);
    };
    let landscape = Landscape::under(state, transition, t_f, rtol.min(1e-12));
    let plane = Plane::new(&landscape, transition.law, 1.0);
    let Some(mut ellipse) = Ellipse::around(&plane) else { return without(Status::Infeasible, stats) };
    match ellipse.close_in(&plane, Until::Admissible, &mut stats) {
        CutResult::Close(_) => {}
        CutResult::Empty => return without(Status::Infeasible, stats),
        CutResult::Exhausted => return without(Status::NotConverged, stats),
    }
    let rough = Landscape::under(state, transition, t_f, polar::ROUGH_RTOL);
    let Some(least) = polar::least(&plane, &rough, &ellipse, &mut stats) else {
        return without(Status::NotConverged, stats);
    };
    // The work decreases towards friction that no optimum has.
    if least.active.contains(&Bound::Lifetime) {
        return without(Status::Unproven, stats);
    }
    let path = plane.path(least.place);
    let [mut v_min, friction_min] = landscape.least(&path);
    // A dip of the velocity that the border does not know.
    if v_min < 1.0 - TOUCHING_VELOCITY {
        return without(Status::NotConverged, stats);
    }
    let coefficients = plane.coefficients(least.place);
    let [a_2, a_3] = coefficients.map(|a| a.high);
    let gap = (least.work - work_optimal) / work_optimal;
    if least.active.contains(&Bound::Velocity) {
        // On the border the velocity is 1, or that of the fastest rise of the slip law; it depends on the root of the rounding of the coefficients.
        let fastest_rise = state.product(0.0) / path.at(landscape.slowest(&path)).0;
        v_min = v_min.min(fastest_rise.max(1.0)).max(1.0);
    }
    let status = Status::Ok.with_friction(friction_min).compared_with(optimum.status);
    let (work, v_max) = (least.work, landscape.greatest_velocity(&path));
    Solved { status, value: Some(BestCubic { a_2, a_3, coefficients, work, work_optimal, gap, v_min, v_max }), stats }
}

/// Distance of the least velocity from 1 that is rounding where the bound is active. Chosen: far above rounding.
const TOUCHING_VELOCITY: f64 = 1e-6;

/// The point of least work, and whether the velocity touches its least value there.
struct Minimum {
    place: Coefficients,
    touches: bool,
}

/// Approaches the point of least work coarsely, and then, if it is not inside the set, down to rounding.
fn least(rough: &Plane, plane: &Plane, a: f64, stats: &mut SolverStats) -> Result<Minimum, Status> {
    let mut ellipse = Ellipse::around(rough).ok_or(Status::Infeasible)?;
    let start = match ellipse.close_in(rough, Until::Work(NEWTON_WORK_RANGE * a.min(1.0)), stats) {
        CutResult::Empty => return Err(Status::Infeasible),
        CutResult::Close(place) => place,
        CutResult::Exhausted => return Err(Status::NotConverged),
    };
    if let Some(place) = newton::descend(plane, a, start, stats) {
        return Ok(Minimum { place, touches: false });
    }
    let CutResult::Close(place) = ellipse.close_in(plane, Until::Rounding, stats) else {
        return Err(Status::NotConverged);
    };
    let mut least = Minimum { place, touches: false };
    for condition in plane.conditions(place) {
        if condition.value <= TOUCHING_SIZES * ellipse.span(condition.along).0 {
            match condition.of {
                // The work decreases towards friction that no optimum has.
                Bound::Lifetime => return Err(Status::Unproven),
                Bound::Velocity => least.touches = true,
            }
        }
    }
    Ok(least)
}

/// Distance from a condition, in sizes of the ellipse, within which the condition counts as active. Chosen; the budgets of `best_cubic` judge it.
const TOUCHING_SIZES: f64 = 16.0;
