//! A smooth piece between two states, which brings theta from one to the other.
//!
//! `v = floor + exp g(x)`, `x` the fraction of the elapsed time. `g` meets value, slope and curvature at both ends, and
//! has a term `-c x^3 (1 - x)^3`. Theta at the end rises strictly with `c`, from 0 to its value for `v = floor`, so there
//! is one piece wherever the optimum itself stays above the floor. The floor is 0, or 1 where that piece falls below
//! `v = 1`, both ends are more than 1e-12 above it, and a piece above 1 exists.
//!
//! An end of the protocol may lie `rho > 1` times as far above the floor as the mean `int theta v dt/(t sqrt(theta_0
//! theta_1))` over a piece of length `t`. Then the fall from that end is short: the rise of `g` runs over the stretched
//! variable `xi = (1 + p) x/(1 + p x)`, with `p = 4 (rho (1 + 10 ln rho)^(-1/3) - 1)` if that is positive. The fall then
//! takes about a quarter of the mean for every `rho`. An end where theta has the time to follow `1/v` is not stretched.

use crate::model::Law;
use crate::numerics::elementary::{ln, ln_near_1};
use crate::numerics::{LONG_ROUNDING_RTOL, MAX_SQUARABLE};
use crate::protocol::control::{Tolerance, ValueRange};
use crate::protocol::optimal::{PathSegment, lag_at_bound};
use crate::protocol::profile::{
    ArrivalProblem, Hermite, InitialState, ResolvedProfile, VelocityCurve, WorkAndFriction, integrate_theta,
};
use crate::protocol::{Jet, SolverStats, SpringBlock, Status};

/// State at an end of a piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct PieceEnd {
    /// `v`, `v'`, `v''` in time.
    v: [f64; 3],
    theta: f64,
    rate: f64,
    /// Whether the protocol ends there, where the optimum jumps.
    outer: bool,
}

/// Smooth piece: its work, its extremes, and its velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct SmoothPiece {
    /// Work and range of friction.
    pub totals: WorkAndFriction,
    /// Range of the velocity.
    pub v: ValueRange,
    /// Range of the control velocity.
    pub control: ValueRange,
    curve: VelocityCurve<Hermite>,
    /// State at its start, and theta at its end.
    ends: (InitialState, f64),
}

impl PieceEnd {
    /// State of the optimum.
    pub fn inner(jet: &Jet) -> PieceEnd {
        PieceEnd { v: [jet.v[0], jet.v[1], jet.v[2]], theta: jet.theta, rate: jet.rate, outer: false }
    }

    /// Steady sliding at an end of the protocol.
    pub fn outer(v: f64) -> PieceEnd {
        PieceEnd { v: [v, 0.0, 0.0], theta: 1.0 / v, rate: 0.0, outer: true }
    }

    /// First two derivatives of `ln(v - floor)`, in units of a time `t`.
    fn slopes(&self, floor: f64, t: f64) -> [f64; 2] {
        let [v, v1, v2] = self.v;
        let slope = v1 / (v - floor);
        [t * slope, t * t * (v2 / (v - floor) - slope * slope)]
    }
}

impl SmoothPiece {
    /// Piece from `start` to `end` that replaces a segment of the optimum; `Err` with the status where there is none.
    ///
    /// # Errors
    ///
    /// The status of a segment without such a piece.
    pub fn new(
        slider: &SpringBlock,
        (start, end): (&PieceEnd, &PieceEnd),
        optimum: &PathSegment,
        rtol: f64,
        stats: &mut SolverStats,
    ) -> Result<SmoothPiece, Status> {
        let piece = SmoothPiece::above(0.0, slider, (start, end), optimum, rtol, stats)?;
        // With ends nearer to the bound, rounding alone would decide whether the piece falls below it.
        let margin = start.v[0].min(end.v[0]) - 1.0;
        if piece.v.low < 1.0 && margin > LONG_ROUNDING_RTOL {
            let inside = SmoothPiece::above(1.0, slider, (start, end), optimum, rtol, stats);
            return Ok(inside.unwrap_or(piece));
        }
        Ok(piece)
    }

    /// Piece that stays above `floor`.
    fn above(
        floor: f64,
        slider: &SpringBlock,
        (start, end): (&PieceEnd, &PieceEnd),
        &PathSegment { time, lag, .. }: &PathSegment,
        rtol: f64,
        stats: &mut SolverStats,
    ) -> Result<SmoothPiece, Status> {
        if start.v[0].min(end.v[0]) < 1.0 / MAX_SQUARABLE {
            return Err(Status::Infeasible);
        }
        let (w_0, w_1) = (start.v[0] - floor, end.v[0] - floor);
        let rise = ln_near_1((w_1 - w_0) / w_0, w_1 / w_0);
        // About the mean of v that brings theta to its target.
        let mean = lag / (time * (start.theta * end.theta).sqrt()) - floor;
        let rho = [start, end].map(|at| if at.outer { (at.v[0] - floor) / mean } else { 1.0 });
        if rho.iter().any(|&rho| rho > 1.0 / LONG_ROUNDING_RTOL) {
            return Err(Status::Infeasible);
        }
        let mut stretch = rho.map(stretch);
        if end.v[0] * time > RELAXATION_SLIP * (1.0 + stretch[1]) {
            stretch[1] = 0.0;
        }
        let (at_start, at_end) = (start.slopes(floor, time), end.slopes(floor, time));
        let exponent = Hermite { rise, start: at_start, end: at_end, stretch, c: 0.0 };
        let curve = VelocityCurve::new(floor, w_1, time, exponent);
        let growth = time - lag;
        // Theta at the end for v = floor, less its target.
        let spare = if floor > 0.0 { lag - lag_at_bound(start.theta, time) } else { lag };
        if spare.is_nan() || spare <= 0.0 {
            return Err(Status::NotConverged);
        }
        let (fall, pull) = (-growth / end.theta, end.rate / end.theta);
        let problem = ArrivalProblem::between([start.theta, end.theta], fall, pull, spare, curve);
        let curve = curve.with(problem.solve(0.0, rtol, stats).ok_or(Status::NotConverged)?);
        let from = InitialState { v: start.v[0], theta: start.theta, rate: start.rate };
        let ends = (from, end.theta);
        let mut piece =
            SmoothPiece { totals: WorkAndFriction::NONE, v: ValueRange::NONE, control: ValueRange::NONE, curve, ends };
        let followed = integrate_theta(&curve, ends, rtol, stats, |panel| {
            panel.add_to(&slider.law, &curve, rtol, &mut piece.totals);
            panel.range(&curve, Tolerance::OfValue(rtol), &mut piece.v, |jet, _| [jet.v[0], jet.v[1] / jet.v[0]]);
            panel.range(&curve, Tolerance::OfRange(rtol), &mut piece.control, |jet, bend| {
                [slider.control(jet), slider.control_rate(jet, bend)]
            });
        });
        followed.map(|()| piece).ok_or(Status::NotConverged)
    }

    /// The piece over time; `None` where numbers leave the range of a double.
    pub fn resolve(&self, law: Law, rtol: f64) -> Option<ResolvedProfile<Hermite>> {
        let mut panels = Vec::new();
        let mut stats = SolverStats::default();
        integrate_theta(&self.curve, self.ends, rtol, &mut stats, |panel| panels.push(*panel))?;
        Some(ResolvedProfile { law, curve: self.curve, panels })
    }
}

/// Stretch `p` of an end that lies `rho` times as high as the mean.
fn stretch(rho: f64) -> f64 {
    let rho = rho.max(1.0);
    (4.0 * (rho / libm::cbrt(1.0 + 10.0 * ln(rho)) - 1.0)).max(0.0)
}

/// Slip before the end of the protocol after which theta follows `1/v`, in `l`, at least. Chosen: `e^-5` is 0.7 %, what is left of an initial deviation.
const RELAXATION_SLIP: f64 = 5.0;
