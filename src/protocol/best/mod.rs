//! The least-work cubic shortcut, and its gap to the optimum without cancellation.
//!
//! The admissible shortcuts form a convex set in the plane of `(a_2, a_3)`: `v >= m` means that the cubic `n - m t_f
//! theta`, linear in the coefficients, is not negative on `[0, 1]`, with `m = 1` under the bound and `m = 0` without.
//! The least work lies inside, where the gradient vanishes (`interior`), or on the border, where some shortcut touches
//! `v = m` (`border`). A small gap is an integral of positive terms (`excess`).

mod border;
mod excess;
mod interior;

use super::cubic::Landscape;
use super::{Effort, Solved, Status, optimal};
use crate::model::Transition;

/// The best cubic shortcut of one transition in one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Best {
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

/// A place in the plane of the coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    a_2: f64,
    a_3: f64,
}

/// The shortcut of least work over the whole plane where `v >= 1` (`bounded`) or `v > 0`.
///
/// `Infeasible` where no cubic shortcut is admissible. Without the bound `BelowBound` where `v < 1` somewhere; a
/// `v_min` of 0 then means that the least work is only approached, at the border `v = 0`. `Nonphysical` as for the
/// optimum.
pub fn solve(transition: &Transition, t_f: f64, bounded: bool, rtol: f64) -> Solved<Best> {
    let optimum = optimal::solve(transition, t_f, bounded, rtol.min(1e-12));
    let mut effort = optimum.effort;
    let Some(optimum_value) = optimum.value else {
        return Solved { status: optimum.status, value: None, effort };
    };
    let landscape = Landscape::new(transition, t_f, rtol.min(1e-12));
    let least_velocity = if bounded { 1.0 } else { 0.0 };
    let rough = Landscape::new(transition, t_f, 1e-7);
    let Some(start) = interior::approach(&rough, least_velocity, &mut effort) else {
        return Solved { status: Status::Infeasible, value: None, effort };
    };
    let Some((place, touches)) = least(&landscape, least_velocity, start, &mut effort) else {
        return Solved { status: unsolved(optimum.status), value: None, effort };
    };
    let work = landscape.moments(place.a_2, place.a_3, &mut effort).work;
    let v_min = if touches { least_velocity } else { landscape.path(place.a_2, place.a_3).judge().1 };
    let difference = work - optimum_value.work;
    let excess = if difference > PLAIN_DIFFERENCE * optimum_value.work {
        difference
    } else {
        // Two routes to one number: they must agree as far as the coarser one goes.
        let excess = excess::over_optimum(transition, &landscape, place, work, bounded, &mut effort);
        match excess.filter(|excess| (excess - difference).abs() <= DIFFERENCE_ERROR * work) {
            Some(excess) => excess,
            None => return Solved { status: unsolved(optimum.status), value: None, effort },
        }
    };
    let status = match optimum.status {
        Status::Ok | Status::BelowBound if v_min < 1.0 => Status::BelowBound,
        Status::BelowBound => Status::Ok,
        status => status,
    };
    let value = Best {
        a_2: place.a_2,
        a_3: place.a_3,
        work,
        work_optimal: optimum_value.work,
        gap: excess / optimum_value.work,
        v_min,
    };
    Solved { status, value: Some(value), effort }
}

/// The place of least work, and whether it lies on the border. A place on the border counts only if work rises from
/// there into the admissible set.
fn least(landscape: &Landscape, least_velocity: f64, start: Place, effort: &mut Effort) -> Option<(Place, bool)> {
    if let Some(place) = interior::descend(landscape, least_velocity, start, effort) {
        return Some((place, false));
    }
    let place = border::least(landscape, least_velocity, effort)?;
    let inwards = interior::inwards(landscape, least_velocity, place);
    let gradient = landscape.moments(place.a_2, place.a_3, effort).gradient;
    let slope = gradient[0] * inwards[0] + gradient[1] * inwards[1];
    (slope >= 0.0).then_some((place, true))
}

/// The status where no best shortcut was found: where friction is too low there need not be one.
fn unsolved(optimum: Status) -> Status {
    if optimum == Status::Nonphysical { Status::Nonphysical } else { Status::NotConverged }
}
