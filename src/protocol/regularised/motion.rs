//! The regularised optimum over time: its parts one after the other.

use std::sync::Arc;

use super::Part;
use crate::protocol::optimal::{PathPoint, Route};
use crate::protocol::profile::{Hermite, Resolution};
use crate::protocol::{Jet, Moment, Motion, SpringBlock};

/// The motion: every stretch takes as much of the parameter as the next.
pub(super) struct Smooth {
    slider: SpringBlock,
    route: Route,
    stretches: Vec<Stretch>,
}

/// A part of the motion that is smooth.
enum Stretch {
    /// The optimum between two places on the hold or on the arc.
    Kept(PathPoint, PathPoint),
    /// A panel of a piece, from one value of the piece's parameter to another; the piece begins at this time.
    Replaced { piece: Arc<Resolution<Hermite>>, begin: f64, from: f64, to: f64 },
}

impl Smooth {
    /// The motion of these parts; `None` where numbers leave the range of a double.
    pub fn new(slider: SpringBlock, route: Route, parts: Vec<Part>, rtol: f64) -> Option<Smooth> {
        let mut stretches = Vec::new();
        let mut time = 0.0;
        for part in parts {
            match part {
                Part::Kept(from, to) => {
                    let sites = route.landmarks(from, to);
                    stretches.extend(sites.windows(2).map(|pair| Stretch::Kept(pair[0], pair[1])));
                    time = route.time(to);
                }
                Part::Replaced(piece) => {
                    let piece = Arc::new(piece.resolve(slider.law, rtol)?);
                    let marks = piece.landmarks();
                    stretches.extend(marks.windows(2).map(|pair| Stretch::Replaced {
                        piece: piece.clone(),
                        begin: time,
                        from: pair[0],
                        to: pair[1],
                    }));
                    time += piece.duration();
                }
            }
        }
        Some(Smooth { slider, route, stretches })
    }

    fn moment(&self, t: f64, jet: &Jet) -> Moment {
        Moment {
            t: t.min(self.route.duration()),
            v: jet.v[0],
            theta: jet.theta,
            friction: self.slider.friction(jet),
            v_c: Some(self.slider.control(jet)),
            beta: None,
        }
    }
}

impl Motion for Smooth {
    fn duration(&self) -> f64 {
        self.route.duration()
    }

    fn landmarks(&self) -> Vec<f64> {
        let count = self.stretches.len();
        (0..=count).map(|k| k as f64 / count as f64).collect()
    }

    fn at(&self, s: f64) -> Moment {
        let count = self.stretches.len();
        let along = s.clamp(0.0, 1.0) * count as f64;
        let k = (along as usize).min(count - 1);
        let (u, mix) = (along - k as f64, |from: f64, to: f64, u: f64| from * (1.0 - u) + to * u);
        match &self.stretches[k] {
            Stretch::Kept(from, to) => {
                let site = match (*from, *to) {
                    (PathPoint::Held(from), PathPoint::Held(to)) => PathPoint::Held(mix(from, to, u)),
                    (PathPoint::Moving(from), PathPoint::Moving(to)) => PathPoint::Moving(mix(from, to, u)),
                    (_, to) => to,
                };
                self.moment(self.route.time(site), &self.route.jet(site))
            }
            Stretch::Replaced { piece, begin, from, to } => {
                let s = mix(*from, *to, u);
                let (panel, share) = piece.place(s);
                self.moment(begin + piece.at(s).t, &panel.jet(&piece.curve, share))
            }
        }
    }
}
