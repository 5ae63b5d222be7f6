//! A smooth piece between two moments, with theta brought from the one to the other.
//!
//! `v = floor + exp g(x)`, `x` the share of the time gone: `g` meets value, slope and curvature at both ends, and has a
//! term `-c x^3 (1 - x)^3`. Theta at the end rises strictly with `c`, from 0 to its value for `v = floor`, so there is
//! one member wherever the optimum itself stays above the floor. The floor is 0; where that piece dips below `v = 1`
//! without need it is 1.
//!
//! Where an end of the protocol lies `rho > 1` times as far above the floor as the mean that brings theta on, `int
//! theta v dt/(t sqrt(theta_0 theta_1))` over a piece of length `t`, the way down has to be short: there the rise of
//! `g` runs over a stretched place, `xi = (1 + p) x/(1 + p x)` from that end, with `p = 4 (rho (1 + 10 ln rho)^(-1/3) -
//! 1)` if that is positive. About a quarter of the mean is then left to the way down, whatever `rho`. An end of the
//! protocol where theta has the time to follow `1/v` asks for none of this.

use crate::model::Law;
use crate::numerics::elementary::{ln, ln_1p};
use crate::protocol::control::{Extent, Tolerance};
use crate::protocol::optimal::{PathSegment, lag_at_bound};
use crate::protocol::profile::{Curve, Hermite, Problem, Resolution, Start, pass, reach};
use crate::protocol::{Jet, SolverStats, SpringBlock, Status};

use super::STANDSTILL;

/// An end of a piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    /// `v`, `v'`, `v''` in time.
    v: [f64; 3],
    theta: f64,
    rate: f64,
    /// Whether it is an end of the protocol, where the optimum jumps.
    outer: bool,
}

/// What a piece amounts to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    /// Work of friction.
    pub work: f64,
    /// Least friction, as [`Resolved::sum`](crate::protocol::profile::Resolved::sum) has it.
    pub friction_min: f64,
    /// Range of the velocity.
    pub v: Extent,
    /// Range of the control velocity.
    pub control: Extent,
    curve: Curve<Hermite>,
    from: Start,
}

/// Theta and its rate are interpolated, which takes more nodes than a quadrature.
const INTERPOLATION: f64 = 0.45;

/// What rounding may cost of theta at the end.
const ROUNDING: f64 = 1e-12;

impl End {
    /// A moment of the optimum.
    pub fn inner(jet: &Jet) -> End {
        End { v: [jet.v[0], jet.v[1], jet.v[2]], theta: jet.theta, rate: jet.rate, outer: false }
    }

    /// Steady sliding at an end of the protocol.
    pub fn outer(v: f64) -> End {
        End { v: [v, 0.0, 0.0], theta: 1.0 / v, rate: 0.0, outer: true }
    }

    /// The first two derivatives of `ln(v - floor)`, in a time `t`.
    fn slopes(&self, floor: f64, t: f64) -> [f64; 2] {
        let [v, v1, v2] = self.v;
        let slope = v1 / (v - floor);
        [t * slope, t * t * (v2 / (v - floor) - slope * slope)]
    }
}

impl Piece {
    /// The piece from `start` to `end` in place of a part of the optimum; `Err` with the status where there is none.
    pub fn new(
        slider: &SpringBlock,
        (start, end): (&End, &End),
        optimum: &PathSegment,
        rtol: f64,
        stats: &mut SolverStats,
    ) -> Result<Piece, Status> {
        let piece = Piece::above(0.0, slider, (start, end), optimum, rtol, stats)?;
        if piece.v.low < 1.0 && start.v[0] > 1.0 && end.v[0] > 1.0 {
            let inside = Piece::above(1.0, slider, (start, end), optimum, rtol, stats);
            return Ok(inside.unwrap_or(piece));
        }
        Ok(piece)
    }

    /// The piece that stays above `floor`.
    fn above(
        floor: f64,
        slider: &SpringBlock,
        (start, end): (&End, &End),
        &PathSegment { time, lag, .. }: &PathSegment,
        rtol: f64,
        stats: &mut SolverStats,
    ) -> Result<Piece, Status> {
        if start.v[0].min(end.v[0]) < STANDSTILL {
            return Err(Status::Infeasible);
        }
        let (w_0, w_1) = (start.v[0] - floor, end.v[0] - floor);
        let ratio = (w_1 - w_0) / w_0;
        let rise = if ratio > -0.5 { ln_1p(ratio) } else { ln(w_1 / w_0) };
        // About the mean that brings theta there.
        let mean = lag / (time * (start.theta * end.theta).sqrt()) - floor;
        let rho = [start, end].map(|at| if at.outer { (at.v[0] - floor) / mean } else { 1.0 });
        if rho.iter().any(|&rho| rho > MOST_RHO) {
            return Err(Status::Infeasible);
        }
        let mut stretch = rho.map(stretch);
        if end.v[0] * time > FOLLOWING * (1.0 + stretch[1]) {
            stretch[1] = 0.0;
        }
        let (at_start, at_end) = (start.slopes(floor, time), end.slopes(floor, time));
        let exponent = Hermite { rise, start: at_start, end: at_end, stretch, c: 0.0 };
        let curve = Curve::new(floor, w_1, time, exponent);
        let growth = time - lag;
        // How much larger theta is for v = floor: what it then loses less.
        let spare = if floor > 0.0 { lag - lag_at_bound(start.theta, time) } else { lag };
        if spare.is_nan() || spare <= 0.0 {
            return Err(Status::NotConverged);
        }
        let ends = [start.theta, end.theta];
        let problem = Problem::between(ends, -growth / end.theta, end.rate / end.theta, spare, curve);
        let curve = curve.with(problem.solve(0.0, rtol, reach(rtol), stats).ok_or(Status::NotConverged)?);
        let from = Start { v: start.v[0], theta: start.theta, rate: start.rate, slow: false };
        let mut piece =
            Piece { work: 0.0, friction_min: f64::INFINITY, v: Extent::NONE, control: Extent::NONE, curve, from };
        let theta = pass(&curve, from, rtol, INTERPOLATION * reach(rtol), stats, |panel| {
            let (work, friction_min) = panel.sum(&slider.law, &curve);
            piece.work += work;
            piece.friction_min = piece.friction_min.min(friction_min);
            panel.range(&curve, Tolerance::OfValue(rtol), &mut piece.v, |jet, _| [jet.v[0], jet.v[1] / jet.v[0]]);
            panel.range(&curve, Tolerance::OfRange(rtol), &mut piece.control, |jet, bend| {
                [slider.control(jet), slider.control_rate(jet, bend)]
            });
        });
        let arrives = theta.is_some_and(|theta| (theta / end.theta - 1.0).abs() <= 10.0 * rtol + ROUNDING);
        if arrives { Ok(piece) } else { Err(Status::NotConverged) }
    }

    /// The piece over time; `None` where numbers leave the range of a double.
    pub fn resolve(&self, law: Law, rtol: f64) -> Option<Resolution<Hermite>> {
        let mut panels = Vec::new();
        let reach = INTERPOLATION * reach(rtol);
        pass(&self.curve, self.from, rtol, reach, &mut SolverStats::default(), |panel| panels.push(*panel))?;
        Some(Resolution { law, curve: self.curve, panels })
    }
}

/// How much an end is stretched that lies `rho` times as high as the mean.
fn stretch(rho: f64) -> f64 {
    let rho = rho.max(1.0);
    (4.0 * (rho / libm::cbrt(1.0 + 10.0 * ln(rho)) - 1.0)).max(0.0)
}

/// Slip on the way to the end of the protocol after which theta follows `1/v`, and arrives whatever was before.
const FOLLOWING: f64 = 5.0;

/// An end that lies higher above the mean would need a way down too short for doubles.
const MOST_RHO: f64 = 1e12;
