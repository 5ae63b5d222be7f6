//! The optimal protocol with its jumps replaced by smooth pieces, so that a spring of finite stiffness can drive it.
//!
//! The optimum jumps at both ends, and after a hold it leaves the bound with a corner. Each of these would take an
//! infinite control velocity. In pieces of length `delta_t` at both ends, and in one about the end of a hold, the
//! velocity is replaced by one that meets value, slope and curvature of the optimum (0 at the ends of the protocol) and
//! brings theta to where the optimum has it. So the optimum between the pieces is untouched (docs/theory.md,
//! "Smooth pieces").

mod motion;
mod piece;

use super::control::Extent;
use super::optimal::{PathPoint, Route, route};
use super::{Motion, Solved, SolverStats, SpringBlock, Status};
use crate::model::Transition;
use motion::Smooth;
use piece::{End, Piece};

/// The regularised optimum, every number to the requested relative accuracy; those of `v_c` to that of the greater of
/// the two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regularised {
    /// Work of friction, `int tau v dt`.
    pub work: f64,
    /// Least work of the optimum itself, `W*`.
    pub work_optimal: f64,
    /// `(work - W*)/W*`, from the pieces alone: it keeps its digits where they are short.
    pub gap: f64,
    /// Work of friction over the pieces alone: the gap is what it differs by from the optimum's over the same time.
    pub replaced: f64,
    /// Least velocity.
    pub v_min: f64,
    /// Greatest velocity.
    pub v_max: f64,
    /// Least control velocity.
    pub control_min: f64,
    /// Greatest control velocity.
    pub control_max: f64,
}

/// Regularises the optimum of a transition from `v_i` to `v_f` under `slider.law` within `t_f`, with `v >= 1` where
/// `bounded`, by pieces of length `delta_t`.
///
/// `Infeasible` where there is no optimum, where the pieces overlap (`2 delta_t > t_f`), or where an argument is
/// outside its domain (`delta_t > 0`, `k > 0`, `m >= 0`), or where the protocol all but stands still: without the bound
/// a deceleration jumps down by about `e^(1/a)`; pieces are drawn down to 1e-12 of the velocity at the end, and down to
/// 1e-100. `BelowBound` where a piece dips below `v = 1`: next to a hold
/// each must, since theta there is as large as `v >= 1` allows. `NegativeFriction` where `tau < 0` on the way;
/// `Unproven` where the optimum need not be the only one.
pub fn solve(
    slider: &SpringBlock,
    (v_i, v_f): (f64, f64),
    t_f: f64,
    delta_t: f64,
    bounded: bool,
    rtol: f64,
) -> Solved<Regularised> {
    assemble(slider, (v_i, v_f), t_f, delta_t, bounded, rtol, |_| ()).0
}

/// The same, and its motion wherever it has numbers.
pub fn motion(
    slider: &SpringBlock,
    (v_i, v_f): (f64, f64),
    t_f: f64,
    delta_t: f64,
    bounded: bool,
    rtol: f64,
) -> (Solved<Regularised>, Option<Box<dyn Motion>>) {
    let mut parts = Vec::new();
    let (solved, route) = assemble(slider, (v_i, v_f), t_f, delta_t, bounded, rtol, |part| parts.push(part));
    let smooth = route.filter(|_| solved.value.is_some()).and_then(|route| Smooth::new(*slider, route, parts, rtol));
    (solved, smooth.map(|smooth| Box::new(smooth) as Box<dyn Motion>))
}

/// A part of the regularised optimum.
enum Part {
    /// The optimum between two places.
    Kept(PathPoint, PathPoint),
    /// A smooth piece.
    Replaced(Piece),
}

/// Solves, and hands over the parts in the order of time.
fn assemble(
    slider: &SpringBlock,
    (v_i, v_f): (f64, f64),
    t_f: f64,
    delta_t: f64,
    bounded: bool,
    rtol: f64,
    visit: impl FnMut(Part),
) -> (Solved<Regularised>, Option<Route>) {
    let none = |status, stats| (Solved { status, value: None, stats }, None);
    let sound = delta_t > 0.0 && 2.0 * delta_t <= t_f && slider.k > 0.0 && slider.m >= 0.0 && slider.m.is_finite();
    if !sound {
        return none(Status::Infeasible, SolverStats::default());
    }
    let (solved, route) = route(&Transition { law: slider.law, v_i, v_f }, t_f, bounded, rtol);
    let mut stats = solved.stats;
    let (Some(optimum), Some(route)) = (solved.value, route) else { return none(solved.status, stats) };
    let mut sum = Sum {
        slider: *slider,
        rtol,
        visit,
        excess: 0.0,
        replaced: 0.0,
        friction_min: f64::INFINITY,
        v: Extent::NONE,
        control: Extent::NONE,
    };
    if let Err(status) = sum.gather(&route, (v_i, v_f), (delta_t, t_f), &mut stats) {
        // Where the optimum need not be unique, it need not be exact enough for pieces either.
        let doubtful = is_doubtful(solved.status) && status == Status::NotConverged;
        return none(if doubtful { Status::Unproven } else { status }, stats);
    }
    if slider.k == f64::INFINITY {
        sum.control = sum.v;
    }
    let value = Regularised {
        work: optimum.work + sum.excess,
        work_optimal: optimum.work,
        gap: sum.excess / optimum.work,
        replaced: sum.replaced,
        v_min: sum.v.low,
        v_max: sum.v.high,
        control_min: sum.control.low,
        control_max: sum.control.high,
    };
    let numbers = [value.work, value.v_max, value.control_min, value.control_max];
    if !numbers.iter().all(|number| number.is_finite()) {
        let doubtful = is_doubtful(solved.status);
        return none(if doubtful { Status::Unproven } else { Status::NotConverged }, stats);
    }
    let own = if value.v_min < 1.0 { Status::BelowBound } else { Status::Ok };
    let status = own.with_friction(sum.friction_min).compared_with(solved.status);
    (Solved { status, value: Some(value), stats }, Some(route))
}

/// Whether the optimum need not be unique.
fn is_doubtful(status: Status) -> bool {
    matches!(status, Status::Unproven | Status::NegativeFriction)
}

/// Velocities below this one count as none.
const STANDSTILL: f64 = 1e-100;

/// What is gathered along the way.
struct Sum<F> {
    slider: SpringBlock,
    rtol: f64,
    /// Takes the parts.
    visit: F,
    /// Work beyond that of the optimum.
    excess: f64,
    /// Work of the pieces.
    replaced: f64,
    /// Least friction.
    friction_min: f64,
    v: Extent,
    control: Extent,
}

impl<F: FnMut(Part)> Sum<F> {
    /// The pieces and what lies between them, in the order of time; `Err` with the status where a piece has no
    /// numbers.
    fn gather(
        &mut self,
        route: &Route,
        (v_i, v_f): (f64, f64),
        (delta_t, t_f): (f64, f64),
        stats: &mut SolverStats,
    ) -> Result<(), Status> {
        let (leaving, arriving) = (route.after(delta_t), route.before(delta_t));
        let at = |site| End::inner(&route.jet(site));
        self.replace(route, (route.first(), End::outer(v_i)), (leaving, at(leaving)), stats)?;
        let mut from = leaving;
        if let Some(corner) = route.corner().filter(|&corner| corner > delta_t && corner < t_f - delta_t) {
            let start = PathPoint::Held((corner - 0.5 * delta_t).max(delta_t));
            let end =
                if corner + 0.5 * delta_t < t_f - delta_t { route.after(corner + 0.5 * delta_t) } else { arriving };
            self.keep(route, from, start);
            self.replace(route, (start, at(start)), (end, at(end)), stats)?;
            from = end;
        }
        self.keep(route, from, arriving);
        self.replace(route, (arriving, at(arriving)), (route.last(), End::outer(v_f)), stats)
    }

    /// Leaves the optimum as it is between two places.
    fn keep(&mut self, route: &Route, from: PathPoint, to: PathPoint) {
        // Where two pieces meet, rounding alone may lie between them.
        if route.time(to) - route.time(from) <= 4.0 * f64::EPSILON * route.duration() {
            return;
        }
        self.friction_min = self.friction_min.min(route.friction_min(from, to));
        route.control(&self.slider, from, to, self.rtol, &mut self.control);
        (self.visit)(Part::Kept(from, to));
    }

    /// Replaces the optimum between two places by a smooth piece.
    fn replace(
        &mut self,
        route: &Route,
        (from, start): (PathPoint, End),
        (to, end): (PathPoint, End),
        stats: &mut SolverStats,
    ) -> Result<(), Status> {
        let span = route.span(from, to);
        let piece = Piece::new(&self.slider, (&start, &end), &span, self.rtol, stats)?;
        if piece.v.low < STANDSTILL {
            return Err(Status::Infeasible);
        }
        self.excess += piece.work - span.work;
        self.replaced += piece.work;
        self.friction_min = self.friction_min.min(piece.friction_min);
        self.v.add(piece.v.low);
        self.v.add(piece.v.high);
        self.control.add(piece.control.low);
        self.control.add(piece.control.high);
        (self.visit)(Part::Replaced(piece));
        Ok(())
    }
}
