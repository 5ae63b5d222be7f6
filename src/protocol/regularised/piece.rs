//! A smooth piece between two moments, with theta brought from the one to the other.
//!
//! `v = floor + exp g(x)`, `x` the share of the time gone: `g` is the quintic that meets value, slope and curvature at
//! both ends, less `c x^3 (1 - x)^3`. Theta at the end rises strictly with `c`, from 0 to its value for `v = floor`, so
//! there is one member wherever the optimum itself stays above the floor. The floor is 0; where that piece dips below
//! `v = 1` without need it is 1.

use crate::numerics::elementary::{exp_m1, ln, ln_1p};
use crate::protocol::control::Extent;
use crate::protocol::optimal::Span;
use crate::protocol::profile::{Curve, Hermite, Problem, Side, Start, pass, reach};
use crate::protocol::{Effort, Jet, Slider};

/// An end of a piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    /// `v`, `v'`, `v''` in time.
    v: [f64; 3],
    theta: f64,
    rate: f64,
}

/// A piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    curve: Curve<Hermite>,
    start: Start,
    theta_end: f64,
    /// Range of the velocity.
    pub v: Extent,
}

/// Theta and its rate are interpolated, which takes more nodes than a quadrature.
const INTERPOLATION: f64 = 0.5;

/// What rounding may cost of theta at the end.
const ROUNDING: f64 = 1e-12;

impl End {
    /// That of a protocol which is there.
    pub fn of(jet: &Jet) -> End {
        End { v: [jet.v[0], jet.v[1], jet.v[2]], theta: jet.theta, rate: jet.rate }
    }

    /// The first two derivatives of `ln(v - floor)`, in a time `t`.
    fn slopes(&self, floor: f64, t: f64) -> [f64; 2] {
        let [v, v1, v2] = self.v;
        let slope = v1 / (v - floor);
        [t * slope, t * t * (v2 / (v - floor) - slope * slope)]
    }
}

impl Piece {
    /// The piece from `start` to `end` in place of a part of the optimum.
    pub fn new(start: &End, end: &End, optimum: &Span, rtol: f64, effort: &mut Effort) -> Option<Piece> {
        let piece = Piece::above(0.0, start, end, optimum, rtol, effort)?;
        if piece.v.low < 1.0 && start.v[0] > 1.0 && end.v[0] > 1.0 {
            let inside = Piece::above(1.0, start, end, optimum, rtol, effort);
            return Some(inside.unwrap_or(piece));
        }
        Some(piece)
    }

    /// The piece that stays above `floor`.
    fn above(
        floor: f64,
        start: &End,
        end: &End,
        &Span { time, lag, .. }: &Span,
        rtol: f64,
        effort: &mut Effort,
    ) -> Option<Piece> {
        let (w_0, w_1) = (start.v[0] - floor, end.v[0] - floor);
        let ratio = (w_1 - w_0) / w_0;
        let exponent = Hermite {
            rise: if ratio > -0.5 { ln_1p(ratio) } else { ln(w_1 / w_0) },
            start: start.slopes(floor, time),
            end: end.slopes(floor, time),
            c: 0.0,
        };
        let curve = Curve::new(floor, w_1, time, exponent);
        let growth = time - lag;
        // How much larger theta is for v = floor.
        let spare = if floor > 0.0 { -(1.0 - start.theta) * exp_m1(-time) - growth } else { lag };
        if spare.is_nan() || spare <= 0.0 {
            return None;
        }
        let room = ln_1p(spare / end.theta);
        let problem = Problem::between(end.theta, -growth / end.theta, end.rate / end.theta, room, curve);
        let curve = curve.with(problem.solve(0.0, rtol, reach(rtol), effort)?);
        let mut v = Extent::NONE;
        v.add(start.v[0]);
        v.add(end.v[0]);
        for x in curve.exponent.turns() {
            let (side, d) = if x < 0.5 { (Side::Start, x) } else { (Side::End, 1.0 - x) };
            v.add(floor + curve.surplus(side, d));
        }
        let start = Start { v: start.v[0], theta: start.theta, rate: start.rate };
        Some(Piece { curve, start, theta_end: end.theta, v })
    }

    /// Passes along the piece: its work, and the range of `v_c` into `control`. `None` where theta does not arrive.
    pub fn pass(&self, slider: &Slider, rtol: f64, control: &mut Extent, effort: &mut Effort) -> Option<f64> {
        let mut work = 0.0;
        let reach = INTERPOLATION * reach(rtol);
        let theta = pass(&self.curve, self.start, rtol, reach, effort, |panel| {
            work += panel.work(&slider.law, &self.curve);
            panel.control(slider, &self.curve, rtol, control);
        })?;
        ((theta / self.theta_end - 1.0).abs() <= 10.0 * rtol + ROUNDING).then_some(work)
    }
}
