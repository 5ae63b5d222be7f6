//! A member over time, with the control that drives it.

use crate::protocol::profile::{Curve, Hermite, Resolution, Resolved};
use crate::protocol::{Jet, Moment, Motion, SpringBlock};

/// The shortcut in pieces that follow each other in time, in each of which it is smooth on the scale of the piece.
pub struct Path {
    /// The block and spring that it drives.
    pub slider: SpringBlock,
    resolution: Resolution<Hermite>,
    /// When each piece begins, and the end.
    times: Vec<f64>,
}

impl Path {
    pub(super) fn new(slider: SpringBlock, curve: Curve<Hermite>, panels: Vec<Resolved>) -> Path {
        let mut times: Vec<f64> = panels.iter().map(|panel| curve.t_f * panel.place(0.0).0).collect();
        times.push(curve.t_f);
        Path { slider, resolution: Resolution { law: slider.law, curve, panels }, times }
    }

    /// Number of pieces.
    pub fn pieces(&self) -> usize {
        self.resolution.panels.len()
    }

    /// Duration of a piece.
    pub fn span(&self, piece: usize) -> f64 {
        self.resolution.panels[piece].duration(&self.resolution.curve)
    }

    /// The moment at a share `u` of a piece, from 0 to 1.
    pub fn jet(&self, piece: usize, u: f64) -> Jet {
        self.resolution.panels[piece].jet(&self.resolution.curve, u)
    }

    /// The moment at a time, clamped to `[0, t_f]`.
    pub fn at_time(&self, t: f64) -> Jet {
        let piece = self.times.partition_point(|&start| start <= t).clamp(1, self.pieces()) - 1;
        let u = (t - self.times[piece]) / self.span(piece);
        self.jet(piece, u.clamp(0.0, 1.0))
    }
}

impl Motion for Path {
    fn duration(&self) -> f64 {
        self.resolution.duration()
    }

    fn landmarks(&self) -> Vec<f64> {
        self.resolution.landmarks()
    }

    fn at(&self, s: f64) -> Moment {
        let along = s.clamp(0.0, 1.0) * self.pieces() as f64;
        let piece = (along as usize).min(self.pieces() - 1);
        let v_c = self.slider.control(&self.jet(piece, along - piece as f64));
        Moment { v_c: Some(v_c), ..self.resolution.at(s) }
    }
}
