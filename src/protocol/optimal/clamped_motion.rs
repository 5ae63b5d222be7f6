//! The optimal protocol with arcs on the ceilings over time.

use super::ArcKind;
use super::ceiling::{CeilingArc, Ceilings};
use super::clamp::{Depth, Gap, Path, Piece};
use super::extremal::Problem;
use super::motion::{Floor, Timed};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::protocol::{Moment, Motion};

/// The motion of one path: segments, each along its own coordinate.
pub(super) struct Clamped {
    law: Law,
    ceilings: Ceilings,
    t_f: f64,
    segments: Vec<Segment>,
    /// The coordinate at which each segment begins, and the end.
    edges: Vec<f64>,
}

enum Segment {
    Floor(Floor),
    Free(Timed),
    Ceiling(TimedCeiling),
    /// Steady sliding at the end, from this time.
    Sitting {
        since: f64,
        theta: f64,
    },
}

/// An arc on a ceiling with its time.
struct TimedCeiling {
    arc: CeilingArc,
    gap: Gap,
    start: f64,
    end: f64,
}

impl Clamped {
    /// The motion along `path`, then `sitting` at the end, in time `t_f`.
    pub fn new(problem: &Problem, ceilings: &Ceilings, t_f: f64, path: Option<&Path>, sitting: f64) -> Clamped {
        let mut segments = Vec::new();
        let mut now = 0.0;
        if let Some(path) = path {
            now = path.extremal.time_at_floor;
            if now > 0.0 {
                segments.push(Segment::Floor(Floor::new(problem, path.extremal.theta_s, now)));
            }
            let count = path.pieces().count();
            for (i, piece) in path.pieces().enumerate() {
                let is_last = i + 1 == count && sitting == 0.0;
                let start = now;
                now = match piece {
                    _ if is_last => t_f,
                    Piece::Free { arc, .. } => start + Timed::between(arc, 0.0, 1.0).left[0],
                    Piece::Ceiling { arc, .. } => start + arc.time(),
                };
                segments.push(match piece {
                    Piece::Free { arc, .. } => Segment::Free(Timed::between(arc, start, now)),
                    &Piece::Ceiling { arc, gap } => Segment::Ceiling(TimedCeiling { arc, gap, start, end: now }),
                });
            }
        }
        if sitting > 0.0 {
            segments.push(Segment::Sitting { since: now, theta: problem.to.theta });
        }
        let mut edges = vec![0.0];
        for segment in &segments {
            edges.push(edges[edges.len() - 1] + segment.length());
        }
        Clamped { law: problem.law, ceilings: *ceilings, t_f, segments, edges }
    }

    fn moment(&self, segment: &Segment, place: f64) -> Moment {
        let Law { a, b } = self.law;
        match segment {
            Segment::Floor(floor) => floor.at(place),
            Segment::Free(arc) => {
                let here = arc.pieces.at(place);
                let friction = 1.0 + a * here.ln_u + (b - a) * here.ln_theta;
                Moment {
                    t: arc.time(place),
                    v: exp(here.ln_u - here.ln_theta),
                    theta: here.theta,
                    friction,
                    v_c: None,
                    beta: Some(-(friction + a) / here.theta),
                }
            }
            Segment::Ceiling(timed) => timed.moment(&self.ceilings, place),
            &Segment::Sitting { since, theta } => {
                let t = since + (self.t_f - since) * place;
                let v = 1.0 / theta;
                let friction = 1.0 + (b - a) * ln(theta);
                // beta' = v (b/theta + beta), from the free arc before.
                let beta = -v * (b + (friction + a - b) * exp(v * (t - since)));
                Moment { t, v, theta, friction, v_c: None, beta: Some(beta).filter(|beta| beta.is_finite()) }
            }
        }
    }
}

impl Segment {
    /// Length of the coordinate.
    fn length(&self) -> f64 {
        match self {
            Segment::Floor(floor) => floor.length(),
            Segment::Free(arc) => arc.pieces.length.abs(),
            Segment::Ceiling(timed) => timed.arc.coordinates().1.abs() + timed.arc.length,
            Segment::Sitting { .. } => 1.0,
        }
    }

    /// In how many parts the motion is smooth.
    fn parts(&self) -> u32 {
        match self {
            Segment::Floor(_) | Segment::Ceiling(_) => (2.0 * self.length()).ceil().clamp(2.0, MOST_PARTS) as u32,
            Segment::Free(arc) => arc.pieces.count,
            Segment::Sitting { .. } => 2,
        }
    }
}

/// Most parts of a segment; beyond, nothing changes any more.
const MOST_PARTS: f64 = 500.0;

impl TimedCeiling {
    fn moment(&self, ceilings: &Ceilings, place: f64) -> Moment {
        let Law { a, b } = ceilings.law;
        let arc = &self.arc;
        let [before, after] = arc.cut(ceilings, place);
        let (gone, left) = (before.time(), after.time());
        let all = self.end - self.start;
        let t = if gone <= left {
            (self.start + gone).min(self.start + 0.5 * all)
        } else {
            (self.end - left).max(self.start + 0.5 * all)
        };
        let (high, low) = if arc.falls() { (before, after) } else { (after, before) };
        let (depth, z) = (Depth { below: high.length, above: low.length }, high.z_lo);
        let theta = arc.theta_hi * exp(-depth.below);
        let of_v = arc.kind == ArcKind::VCeiling;
        let friction = if of_v { 1.0 + a * ln(ceilings.v) + b * ln(theta) } else { ceilings.tau };
        let pressed = if z == 0.0 { 0.0 } else { self.gap.value(depth) / exp_m1(z) };
        Moment {
            t,
            v: if of_v { ceilings.v } else { exp(z) / theta },
            theta,
            friction,
            v_c: None,
            beta: Some(-(friction + a - pressed) / theta),
        }
    }
}

impl CeilingArc {
    /// `ln |u - 1|` at the end of greater theta, and its change to the other: the coordinate of a motion.
    pub(super) fn coordinates(&self) -> (f64, f64) {
        let of = |z: f64| if z.abs() == self.z_hi.abs().min(self.z_lo.abs()) { self.ln_z } else { ln(z.abs()) };
        // ln(e^z - 1) = ln z for small z.
        let beyond = |z: f64| if z.abs() > SMALL { ln(exp_m1(z).abs() / z.abs()) } else { 0.0 };
        let (high, low) = (of(self.z_hi) + beyond(self.z_hi), of(self.z_lo) + beyond(self.z_lo));
        (high, low - high)
    }

    /// The parts before and after a place, from 0 at the start to 1 at the end.
    pub(super) fn cut(&self, ceilings: &Ceilings, place: f64) -> [CeilingArc; 2] {
        let from_high = if self.falls() { place } else { 1.0 - place };
        let (high, change) = self.coordinates();
        let rise = self.rise();
        let at = high + from_high * change;
        let z = ln_1p(exp(at).copysign(self.z_hi + self.z_lo));
        // Where u hardly changes, theta is the coordinate.
        let even = change.abs() < self.length * LEAST_CHANGE;
        let depth = if even { from_high * self.length } else { ((self.z_hi - z) / rise).clamp(0.0, self.length) };
        let depth = if from_high <= 0.0 {
            0.0
        } else if from_high >= 1.0 {
            self.length
        } else {
            depth
        };
        let z = match depth {
            0.0 if from_high <= 0.0 => self.z_hi,
            _ if from_high >= 1.0 => self.z_lo,
            _ if even => self.z_hi - rise * depth,
            _ => z,
        };
        let ln_z = if at < ln(SMALL) && !even { at } else { ln(z.abs()) };
        let mut parts = [
            ceilings.arc(self.kind, self.theta_hi, depth, self.z_hi, z),
            ceilings.arc(self.kind, self.theta_hi * exp(-depth), self.length - depth, z, self.z_lo),
        ];
        // The end nearer to u = 1 keeps its logarithm.
        let high_first = self.z_hi.abs() <= self.z_lo.abs();
        (parts[0].ln_z, parts[1].ln_z) = if high_first { (self.ln_z, ln_z) } else { (ln_z, self.ln_z) };
        if self.falls() { parts } else { [parts[1], parts[0]] }
    }
}

/// `|ln u|` below which it is `|u - 1|`.
const SMALL: f64 = 1e-17;

/// Change of `ln |u - 1|` for one of `ln theta` below which theta is the coordinate.
const LEAST_CHANGE: f64 = 0.1;

impl Motion for Clamped {
    fn duration(&self) -> f64 {
        self.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        let all = self.edges[self.edges.len() - 1];
        let mut landmarks = vec![0.0];
        for (segment, edge) in self.segments.iter().zip(self.edges.windows(2)) {
            let count = segment.parts();
            let place = |i: u32| (edge[0] + (edge[1] - edge[0]) * f64::from(i) / f64::from(count)) / all;
            landmarks.extend((1..=count).map(place));
        }
        if let Some(last) = landmarks.last_mut() {
            *last = 1.0;
        }
        landmarks
    }

    fn at(&self, s: f64) -> Moment {
        let along = s.clamp(0.0, 1.0) * self.edges[self.edges.len() - 1];
        let i = self.edges.partition_point(|&edge| edge <= along).clamp(1, self.segments.len()) - 1;
        let (from, to) = (self.edges[i], self.edges[i + 1]);
        let place = if s >= 1.0 { 1.0 } else { ((along - from) / (to - from)).min(1.0) };
        self.moment(&self.segments[i], place)
    }
}
