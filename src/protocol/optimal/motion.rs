//! The optimal protocol over time: the floor, free arcs and arcs on ceilings, each along its own coordinate.

use super::ArcKind;
use super::arc::{Arc, EqualSteps};
use super::ceiling::{CeilingArc, Ceilings};
use super::clamp::{ClampedPiece, Depth, Gap};
use super::constrained::{Constrained, Sitting};
use super::extremal::Problem;
use super::lifetime::Lifetime;
use super::search::ROUNDING;
use super::slopes::costate_off_bounds;
use crate::model::Law;
use crate::numerics::NEGLIGIBLE_LN;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::protocol::motion::PieceTimes;
use crate::protocol::{Moment, Motion};

/// The motion along one path.
pub(super) struct OptimalMotion {
    problem: Problem,
    t_f: f64,
    segments: Vec<Segment>,
    /// The coordinate at which each segment begins, and the end.
    edges: Vec<f64>,
}

enum Segment {
    Floor(Floor),
    Free(Timed),
    Ceiling(TimedCeiling),
    /// Steady sliding at the end.
    Sitting(Sitting),
}

/// An arc on a ceiling with its time.
struct TimedCeiling {
    arc: CeilingArc,
    gap: Gap,
    start: f64,
    end: f64,
}

impl OptimalMotion {
    /// The motion of a solution in time `t_f`.
    pub fn new(problem: &Problem, t_f: f64, found: &Constrained) -> OptimalMotion {
        let Constrained { path, sitting, .. } = found;
        let mut segments: Vec<Segment> = path.iter().flat_map(|path| path.pieces()).map(Segment::of).collect();
        segments.extend(sitting.map(Segment::Sitting));
        // Rounding of the search goes to the floor arc, if there is one.
        let total: f64 = segments.iter().map(Segment::duration).sum();
        let (theta_s, waits) = path.map_or((problem.to.theta, sitting.is_none()), |path| {
            (path.extremal.theta_s, path.extremal.time_at_floor > 0.0)
        });
        let held = if waits { (t_f - total).max(0.0) } else { 0.0 };
        let (mut start, mut left) = (held, segments.len());
        for segment in &mut segments {
            left -= 1;
            let end = if left == 0 { t_f } else { start + segment.duration() };
            segment.set_times(start, end);
            start = end;
        }
        if held > 0.0 {
            segments.insert(0, Segment::Floor(Floor::new(problem, theta_s, held)));
        }
        let mut edges = vec![0.0];
        for segment in &segments {
            edges.push(edges[edges.len() - 1] + segment.length());
        }
        OptimalMotion { problem: *problem, t_f, segments, edges }
    }

    fn moment(&self, segment: &Segment, place: f64) -> Moment {
        let law = &self.problem.law;
        match segment {
            Segment::Floor(floor) => floor.at(place),
            Segment::Free(arc) => {
                let here = arc.pieces.at(place);
                let v = exp(here.ln_u - here.ln_theta);
                let on_bound = self.problem.bounded && v < 1.0 && v > 1.0 - ROUNDING;
                Moment {
                    t: arc.time(place),
                    v: if on_bound { 1.0 } else { v },
                    theta: here.theta,
                    friction: here.friction(law),
                    v_c: None,
                    beta: Some(-costate_off_bounds(law, arc.c, &here)),
                }
            }
            Segment::Ceiling(timed) => timed.moment(place),
            Segment::Sitting(sitting) => {
                let (theta, friction) = (self.problem.to.theta, self.problem.friction_end());
                let pressed = sitting.multiplier(&self.problem, sitting.time * place).0;
                let t = self.t_f - sitting.time * (1.0 - place);
                let beta = Some(-(friction + law.a + pressed) / theta).filter(|beta| beta.is_finite());
                Moment { t, v: 1.0 / theta, theta, friction, v_c: None, beta }
            }
        }
    }
}

impl Segment {
    /// A piece whose times are not set yet.
    fn of(piece: &ClampedPiece) -> Segment {
        match piece {
            ClampedPiece::Free { arc, .. } => Segment::Free(Timed::new(arc)),
            &ClampedPiece::Ceiling { arc, gap } => Segment::Ceiling(TimedCeiling { arc, gap, start: 0.0, end: 0.0 }),
        }
    }

    fn duration(&self) -> f64 {
        match self {
            Segment::Floor(floor) => floor.time,
            Segment::Free(arc) => arc.times.left[0],
            Segment::Ceiling(timed) => timed.arc.time(),
            Segment::Sitting(sitting) => sitting.time,
        }
    }

    fn set_times(&mut self, start: f64, end: f64) {
        match self {
            Segment::Free(arc) => arc.times.set(start, end),
            Segment::Ceiling(timed) => (timed.start, timed.end) = (start, end),
            Segment::Floor(_) | Segment::Sitting(_) => {}
        }
    }

    /// Length of the coordinate.
    fn length(&self) -> f64 {
        match self {
            Segment::Floor(floor) => floor.length(),
            Segment::Free(arc) => arc.pieces.length.abs(),
            Segment::Ceiling(timed) => timed.arc.coordinates().1.abs() + timed.arc.length,
            Segment::Sitting(_) => 1.0,
        }
    }

    /// Lengths of parts in which the motion is smooth, and into how many each is cut.
    fn parts(&self) -> Vec<(f64, u32)> {
        let count = |length: f64| length.ceil().clamp(1.0, MOST_PARTS) as u32;
        let length = self.length();
        match self {
            Segment::Floor(floor) => {
                let first = floor.first();
                vec![(first, count(first)), (length - first, count(length - first))]
            }
            Segment::Free(arc) => vec![(length, arc.pieces.count)],
            Segment::Ceiling(_) if 2.0 * length > MOST_PARTS => {
                // Steady sliding on the ceiling, between layers.
                let layer = 0.1 * MOST_PARTS;
                vec![(layer, count(2.0 * layer)), (length - 2.0 * layer, 1), (layer, count(2.0 * layer))]
            }
            Segment::Ceiling(_) => vec![(length, count(2.0 * length).max(2))],
            Segment::Sitting(_) => vec![(length, 2)],
        }
    }
}

/// Most parts of a segment. Chosen: what is left after this length, `e^-500`, is below every rounding.
const MOST_PARTS: f64 = 500.0;

impl TimedCeiling {
    fn moment(&self, place: f64) -> Moment {
        let arc = &self.arc;
        let Ceilings { law: Law { a, b }, v: v_ceiling, tau, .. } = arc.ceilings;
        let [before, after] = arc.cut(place);
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
        let friction = if of_v { 1.0 + a * ln(v_ceiling) + b * ln(theta) } else { tau };
        let pressed = if high.ln_z[1] < -NEGLIGIBLE_LN {
            // Both vanish with z, and their ratio grows from 0 where they begin.
            self.gap.limit(arc, depth) * -exp_m1((arc.least_ln_z() - high.ln_z[1]).min(0.0))
        } else {
            self.gap.value(arc, depth) / exp_m1(z)
        };
        Moment {
            t,
            v: if of_v { v_ceiling } else { exp(z) / theta },
            theta,
            friction,
            v_c: None,
            beta: Some(-(friction + a - pressed) / theta),
        }
    }
}

impl Motion for OptimalMotion {
    fn duration(&self) -> f64 {
        self.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        let all = self.edges[self.edges.len() - 1];
        let (mut landmarks, mut from) = (vec![0.0], 0.0);
        for (length, count) in self.segments.iter().flat_map(Segment::parts) {
            landmarks.extend((1..=count).map(|i| (from + length * f64::from(i) / f64::from(count)) / all));
            from += length;
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

/// The floor arc: `v = 1` until the state variable is `theta_s`.
pub(super) struct Floor {
    pub law: Law,
    pub from: Lifetime,
    theta_s: f64,
    pub time: f64,
    /// Costate where the arc begins, `C - a`.
    beta_s: f64,
}

impl Floor {
    /// The floor arc of `problem` that takes `time`, until the state variable is `theta_s`.
    pub fn new(problem: &Problem, theta_s: f64, time: f64) -> Floor {
        let beta_s = -(1.0 + problem.law.a + problem.law.b * ln(theta_s)) / theta_s;
        Floor { law: problem.law, from: problem.from, theta_s, time, beta_s }
    }

    /// The costate at the start.
    pub fn costate_at_start(&self) -> f64 {
        self.costate(self.from.ln, self.from.rest, self.time)
    }

    /// Length of its coordinate: the logarithm of the time from either end, in the units of each, opens both.
    pub fn length(&self) -> f64 {
        self.first() + ln_1p(0.5 * self.time / self.units()[1])
    }

    /// Its coordinate in the middle of the floor arc.
    fn first(&self) -> f64 {
        ln_1p(0.5 * self.time / self.units()[0])
    }

    /// Times over which the motion changes at the start and at the end: `ln theta` changes over its first value, theta and the
    /// costate over 1. Beyond the floor arc they would take the digits of the coordinate.
    fn units(&self) -> [f64; 2] {
        [self.from.theta, 1.0].map(|unit| unit.min(self.time))
    }

    /// The moment at `place`, from 0 at the start to 1 at the end.
    pub fn at(&self, place: f64) -> Moment {
        let along = self.length() * place;
        // The time gone and the time left.
        let (gone, left) = if along < self.first() {
            let gone = (self.units()[0] * exp_m1(along)).min(0.5 * self.time);
            (gone, self.time - gone)
        } else {
            let left = (self.units()[1] * exp_m1(self.length() - along)).clamp(0.0, 0.5 * self.time);
            (self.time - left, left)
        };
        let now = self.from.aged(gone);
        Moment {
            t: gone,
            v: 1.0,
            theta: now.theta,
            friction: 1.0 + self.law.b * now.ln,
            v_c: None,
            beta: Some(self.costate(now.ln, now.rest, left)),
        }
    }

    /// `beta = (C + tau)/(1 - theta)` with `C + tau = beta_s (1 - theta_s) + b ln(theta/theta_s)`, in terms that do not
    /// cancel; `rest` is `1 - theta`.
    fn costate(&self, ln_theta: f64, rest: f64, left: f64) -> f64 {
        // 1 - theta_s = rest e^(-left), and theta_s - theta = rest gain.
        let gain = -exp_m1(-left);
        let way = rest * gain / self.theta_s;
        let ratio = if way == 0.0 {
            1.0
        } else if way < 0.5 {
            -ln_1p(-way) / way
        } else {
            (ln(self.theta_s) - ln_theta) / way
        };
        self.beta_s * exp(-left) - self.law.b * gain / self.theta_s * ratio
    }
}

/// A free arc with its time.
pub(super) struct Timed {
    pub pieces: EqualSteps,
    /// The conserved `C`.
    pub c: f64,
    pub times: PieceTimes,
}

impl Timed {
    /// The arc from the time 0.
    pub fn new(arc: &Arc) -> Timed {
        let pieces = arc.pieces();
        let times: Vec<f64> = pieces.edges().map(|[from, to]| pieces.time(from, to)).collect();
        Timed { pieces, c: arc.c(), times: PieceTimes::new(&times) }
    }

    /// Time since the start of the protocol.
    pub fn time(&self, place: f64) -> f64 {
        if place >= 1.0 {
            return self.times.end;
        }
        let (piece, [from, to]) = self.times.part_at(place);
        self.times.at(piece, self.pieces.time(from, to))
    }
}
