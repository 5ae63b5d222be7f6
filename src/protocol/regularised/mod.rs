//! The optimal protocol with its jumps replaced by smooth pieces, so that a spring of finite stiffness can drive it.
//!
//! The optimum jumps at both ends, and after a floor arc it leaves the bound with a corner. Each of these takes an infinite
//! control velocity. Smooth pieces of length `delta_t` replace the velocity at both ends and about the end of a floor arc. A
//! piece meets value, slope and curvature of the optimum (0 at the ends of the protocol) and brings theta to its value on
//! the optimum. The optimum between the pieces is unchanged (docs/derivations.md).

mod motion;
mod smooth_piece;

use super::control::{Tolerance, ValueRange};
use super::error::TIGHTEST_RTOL;
use super::optimal::{PathPoint, Route, route};
use super::{Motion, Solved, SolverStats, SpringBlock, Status};
use crate::model::Transition;
use crate::numerics::MAX_SQUARABLE;
use motion::RegularisedMotion;
use smooth_piece::{PieceEnd, SmoothPiece};

/// Regularised optimum. Every number has the requested relative accuracy; both extremes of `v_c` are relative to the
/// greater one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regularised {
    /// Work of friction, `int tau v dt`.
    pub work: f64,
    /// Least work of the optimum itself, `W*`.
    pub work_optimal: f64,
    /// `(work - W*)/W*`, from the pieces alone: it keeps its digits where they are short.
    pub gap: f64,
    /// Work of friction over the pieces alone.
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
/// `Infeasible` where there is no optimum, where the pieces overlap (`2 delta_t > t_f`), where an argument is outside its
/// domain (`delta_t > 0`, `k > 0`, `m >= 0`), or where the velocity falls below 1e-12 of that at the end or below 1e-100:
/// without the bound a deceleration jumps down by about `e^(1/a)`. `BelowBound` where a piece falls below `v = 1`; near a
/// floor arc each piece does, since theta there is as large as `v >= 1` allows. `NegativeFriction` where `tau < 0` somewhere;
/// `Unproven` where the optimum need not be unique.
pub fn solve(
    slider: &SpringBlock,
    (v_i, v_f): (f64, f64),
    t_f: f64,
    delta_t: f64,
    bounded: bool,
    rtol: f64,
) -> Solved<Regularised> {
    assemble(slider, (v_i, v_f), (t_f, delta_t), bounded, rtol).0
}

/// Regularises the optimum as [`solve`] does, and returns its motion as well wherever it has numbers.
pub fn motion(
    slider: &SpringBlock,
    (v_i, v_f): (f64, f64),
    t_f: f64,
    delta_t: f64,
    bounded: bool,
    rtol: f64,
) -> (Solved<Regularised>, Option<Box<dyn Motion>>) {
    let (solved, parts) = assemble(slider, (v_i, v_f), (t_f, delta_t), bounded, rtol);
    let smooth = parts.and_then(|(route, segments)| RegularisedMotion::new(*slider, route, segments, rtol));
    (solved, smooth.map(|smooth| Box::new(smooth) as Box<dyn Motion>))
}

/// Segment of the regularised optimum.
enum RegularisedSegment {
    /// The optimum between two points.
    Kept(PathPoint, PathPoint),
    /// A smooth piece.
    Replaced(SmoothPiece),
}

/// The numbers, and the optimum with the segments in the order of time.
fn assemble(
    slider: &SpringBlock,
    (v_i, v_f): (f64, f64),
    (t_f, delta_t): (f64, f64),
    bounded: bool,
    rtol: f64,
) -> (Solved<Regularised>, Option<(Route, Vec<RegularisedSegment>)>) {
    let none = |status, stats| (Solved { status, value: None, stats }, None);
    let sound = delta_t > 0.0 && 2.0 * delta_t <= t_f && slider.k > 0.0 && slider.m >= 0.0 && slider.m.is_finite();
    if !sound {
        return none(Status::Infeasible, SolverStats::default());
    }
    let (solved, route) = route(&Transition { law: slider.law, v_i, v_f }, t_f, bounded, rtol);
    let mut stats = solved.stats;
    let (Some(optimum), Some(route)) = (solved.value, route) else { return none(solved.status, stats) };
    let mut gather = |rtol| Assembly::new(slider, rtol).gather(&route, (v_i, v_f), (delta_t, t_f), &mut stats);
    let gathered = gather(rtol).and_then(|rough| {
        // A small excess is the difference of two works, and small control velocities are those of larger terms: both need more digits.
        let mut finer = |fraction: f64| match SPARE_ACCURACY * fraction {
            spare if spare < 1.0 => gather((spare * rtol).max(TIGHTEST_RTOL)).map(Some),
            _ => Ok(None),
        };
        let control = finer(rough.control.magnitude() / rough.v.high)?.map_or(rough.control, |fine| fine.control);
        let sum = finer(rough.excess.abs() / rough.replaced)?.unwrap_or(rough);
        Ok(Assembly { control, ..sum })
    });
    let mut sum = match gathered {
        Ok(sum) => sum,
        Err(status) => {
            // Where the optimum need not be unique, it need not be exact enough for pieces either.
            let doubtful = is_doubtful(solved.status) && status == Status::NotConverged;
            return none(if doubtful { Status::Unproven } else { status }, stats);
        }
    };
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
    (Solved { status, value: Some(value), stats }, Some((route, sum.segments)))
}

/// Whether the optimum need not be unique.
fn is_doubtful(status: Status) -> bool {
    matches!(status, Status::Unproven | Status::NegativeFriction)
}

/// Requested over greatest relative error of the work of the pieces. Measured: with it the gaps of the random sample are good to `rtol`
/// (`cargo test --release --test solver stress::regularised`).
const SPARE_ACCURACY: f64 = 30.0;

/// Sums and extremes along the protocol.
struct Assembly {
    slider: SpringBlock,
    rtol: f64,
    segments: Vec<RegularisedSegment>,
    /// Work beyond that of the optimum.
    excess: f64,
    /// Work of the pieces.
    replaced: f64,
    /// Least friction.
    friction_min: f64,
    v: ValueRange,
    control: ValueRange,
}

impl Assembly {
    fn new(slider: &SpringBlock, rtol: f64) -> Assembly {
        Assembly {
            slider: *slider,
            rtol,
            segments: Vec::new(),
            excess: 0.0,
            replaced: 0.0,
            friction_min: f64::INFINITY,
            v: ValueRange::NONE,
            control: ValueRange::NONE,
        }
    }

    /// Adds the pieces and the optimum between them in the order of time; `Err` with the status of a piece without
    /// numbers.
    fn gather(
        mut self,
        route: &Route,
        (v_i, v_f): (f64, f64),
        (delta_t, t_f): (f64, f64),
        stats: &mut SolverStats,
    ) -> Result<Assembly, Status> {
        let (leaving, arriving) = (route.after(delta_t), route.before(delta_t));
        let at = |site| PieceEnd::inner(&route.jet(site));
        self.replace(route, (route.first(), PieceEnd::outer(v_i)), (leaving, at(leaving)), stats)?;
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
        self.replace(route, (arriving, at(arriving)), (route.last(), PieceEnd::outer(v_f)), stats)?;
        Ok(self)
    }

    /// Adds the unchanged optimum between two points.
    fn keep(&mut self, route: &Route, from: PathPoint, to: PathPoint) {
        // Where two pieces meet, rounding alone may lie between them.
        if route.time(to) - route.time(from) <= 4.0 * f64::EPSILON * route.duration() {
            return;
        }
        let (slider, rtol, friction) = (self.slider, self.rtol, route.friction_min(from, to));
        self.friction_min = self.friction_min.min(friction);
        route.range(from, to, Tolerance::OfRange(rtol), &mut self.control, |jet| {
            [slider.control(jet), slider.control_rate(jet, -(jet.rate * jet.v[0] + jet.theta * jet.v[1]))]
        });
        // The velocity is stationary where friction passes b - a.
        if friction <= slider.law.b - slider.law.a {
            route.range(from, to, Tolerance::OfValue(rtol), &mut self.v, |jet| [jet.v[0], jet.v[1] / jet.v[0]]);
        }
        self.segments.push(RegularisedSegment::Kept(from, to));
    }

    /// Replaces the optimum between two points by a smooth piece.
    fn replace(
        &mut self,
        route: &Route,
        (from, start): (PathPoint, PieceEnd),
        (to, end): (PathPoint, PieceEnd),
        stats: &mut SolverStats,
    ) -> Result<(), Status> {
        let span = route.span(from, to);
        let piece = SmoothPiece::new(&self.slider, (&start, &end), &span, self.rtol, stats)?;
        // Far above the underflow of doubles.
        if piece.v.low < 1.0 / MAX_SQUARABLE {
            return Err(Status::Infeasible);
        }
        self.excess += piece.totals.work - span.work;
        self.replaced += piece.totals.work;
        self.friction_min = self.friction_min.min(piece.totals.friction.low);
        self.v.add(piece.v.low);
        self.v.add(piece.v.high);
        self.control.add(piece.control.low);
        self.control.add(piece.control.high);
        self.segments.push(RegularisedSegment::Replaced(piece));
        Ok(())
    }
}
