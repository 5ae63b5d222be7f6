//! The regularised optimum over time.

use std::sync::Arc;

use super::RegularisedSegment;
use crate::protocol::optimal::{PathPoint, Route};
use crate::protocol::profile::{Hermite, ResolvedProfile};
use crate::protocol::{Jet, Moment, Motion, SpringBlock, equal_landmarks, interval_at};

/// Regularised optimum as a motion: intervals of equal length in the parameter.
pub(super) struct RegularisedMotion {
    slider: SpringBlock,
    route: Route,
    intervals: Vec<MotionInterval>,
}

/// Interval on which the motion is smooth.
enum MotionInterval {
    /// The optimum between two points of the floor arc or of the free arc.
    Kept(PathPoint, PathPoint),
    /// A range of the parameter of a smooth piece that begins at this time.
    Replaced { piece: Arc<ResolvedProfile<Hermite>>, begin: f64, from: f64, to: f64 },
}

impl RegularisedMotion {
    /// The motion of these segments; `None` where numbers leave the range of a double.
    pub fn new(
        slider: SpringBlock,
        route: Route,
        segments: Vec<RegularisedSegment>,
        rtol: f64,
    ) -> Option<RegularisedMotion> {
        let mut intervals = Vec::new();
        let mut time = 0.0;
        for segment in segments {
            match segment {
                RegularisedSegment::Kept(from, to) => {
                    let sites = route.landmarks(from, to);
                    intervals.extend(sites.windows(2).map(|pair| MotionInterval::Kept(pair[0], pair[1])));
                    time = route.time(to);
                }
                RegularisedSegment::Replaced(piece) => {
                    let piece = Arc::new(piece.resolve(slider.law, rtol)?);
                    let marks = piece.landmarks();
                    intervals.extend(marks.windows(2).map(|pair| MotionInterval::Replaced {
                        piece: piece.clone(),
                        begin: time,
                        from: pair[0],
                        to: pair[1],
                    }));
                    time += piece.duration();
                }
            }
        }
        Some(RegularisedMotion { slider, route, intervals })
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

impl Motion for RegularisedMotion {
    fn duration(&self) -> f64 {
        self.route.duration()
    }

    fn landmarks(&self) -> Vec<f64> {
        equal_landmarks(self.intervals.len())
    }

    fn at(&self, s: f64) -> Moment {
        let (k, u) = interval_at(s, self.intervals.len());
        let mix = |from: f64, to: f64| from * (1.0 - u) + to * u;
        match &self.intervals[k] {
            MotionInterval::Kept(from, to) => {
                let site = match (*from, *to) {
                    (PathPoint::Held(from), PathPoint::Held(to)) => PathPoint::Held(mix(from, to)),
                    (PathPoint::Moving(from), PathPoint::Moving(to)) => PathPoint::Moving(mix(from, to)),
                    (_, to) => to,
                };
                self.moment(self.route.time(site), &self.route.jet(site))
            }
            MotionInterval::Replaced { piece, begin, from, to } => {
                let s = mix(*from, *to);
                let (panel, u) = piece.panel_at(s);
                self.moment(begin + piece.at(s).t, &panel.jet(&piece.curve, u))
            }
        }
    }
}
