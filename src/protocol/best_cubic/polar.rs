//! The least work over a convex set where the work is not convex, as under the laws of Ruina and of Perrin, Rice and Zheng.
//!
//! A place is an angle about the centre of the set and a fraction of the distance to the border, in units in which the set is about as long
//! as wide. Samples of the whole set show where the work is locally least; each such place is refined. A border, and its corners, are
//! lines of constant fraction, so that the search follows them.

use super::ellipse::Ellipse;
use super::plane::{Bound, Coefficients, Constraint, Plane, moved};
use crate::protocol::SolverStats;

/// Angles of the samples. Chosen: three corners are the most seen, some tens of angles apart.
const ANGLES: usize = 96;
/// Fractions of the samples, from the border inwards. Chosen: every least work found lies on the border or near it.
const FRACTIONS: [f64; 5] = [1.0, 0.95, 0.8, 0.5, 0.2];
/// Vertices of the polygon whose moments make the set round. Chosen: its corners count little.
const VERTICES: usize = 32;
/// Repetitions of that. Chosen: the first one takes the centre away from the border.
const ROUNDS: usize = 3;
/// Last step of a refinement, in radians and fractions. Derived: the work at a corner is linear in the step, so the step is rounding.
const LAST_STEP: f64 = 1e-14;
/// Half the width of the differences that determine a smooth minimum on the border, in radians. Chosen: truncation and rounding are then alike.
const DIFFERENCE: f64 = 2e-3;
/// Relative difference of works within rounding. Chosen: twice the accuracy of the works.
const ROUNDING: f64 = 2e-13;
/// Greatest number of Newton steps to the border. Chosen: it halves the distance at first, then converges quadratically.
const MAX_STEPS: u32 = 100;
/// Relative distance from the border within which a condition is active. Chosen: far above rounding.
const ACTIVE: f64 = 1e-9;

/// The coordinates.
struct Polar<'a> {
    plane: &'a Plane<'a>,
    centre: Coefficients,
    axes: [[f64; 2]; 2],
}

/// An angle and a fraction with their work.
#[derive(Debug, Clone, Copy)]
struct Sample {
    angle: f64,
    fraction: f64,
    work: f64,
}

/// The least work, its place, and the conditions that are active there.
pub(super) struct Least {
    pub work: f64,
    pub place: Coefficients,
    pub active: Vec<Bound>,
}

/// The least work in the admissible set, from the centre of an ellipse that is inside; `None` if the set is as thin as rounding.
pub(super) fn least(plane: &Plane, ellipse: &Ellipse, stats: &mut SolverStats) -> Option<Least> {
    let polar = Polar::around(plane, ellipse)?;
    let starts = polar.starts(stats);
    let found = starts.into_iter().map(|start| polar.refine(start, stats)).min_by(|x, y| x.work.total_cmp(&y.work))?;
    let found = polar.polish(found, stats);
    let along = polar.direction(found.angle);
    let border = polar.border(along);
    let is_active = |condition: &&Constraint| reach(condition, along, border) <= (1.0 + ACTIVE) * border;
    let on_border = plane.conditions(moved(polar.centre, along.map(|step| border * step)));
    let active = on_border.iter().filter(is_active).map(|condition| condition.of).collect();
    let active = if found.fraction == 1.0 { active } else { Vec::new() };
    found.work.is_finite().then(|| Least { work: found.work, place: polar.place(found.angle, found.fraction), active })
}

/// Where a linear condition, known at `distance` along a ray from the centre, is violated.
fn reach(condition: &Constraint, along: [f64; 2], distance: f64) -> f64 {
    let slope = condition.along[0] * along[0] + condition.along[1] * along[1];
    if slope < 0.0 { distance - condition.value / slope } else { f64::INFINITY }
}

impl<'a> Polar<'a> {
    fn around(plane: &'a Plane<'a>, ellipse: &Ellipse) -> Option<Polar<'a>> {
        let mut polar = Polar { plane, centre: ellipse.centre, axes: ellipse.half };
        for _ in 0..ROUNDS {
            let vertices: [[f64; 2]; VERTICES] = std::array::from_fn(|i| {
                let angle = std::f64::consts::TAU * i as f64 / VERTICES as f64;
                let (distance, (sine, cosine)) = (polar.border(polar.direction(angle)), libm::sincos(angle));
                [distance * cosine, distance * sine]
            });
            let (centre, [[xx, xy], [_, yy]]) = moments(&vertices)?;
            polar.centre = moved(polar.centre, polar.image(centre));
            // Twice the root of the covariance: the half axes of an ellipse with these moments.
            let x = 2.0 * xx.sqrt();
            let skew = 4.0 * xy / x;
            let y = (4.0 * yy - skew * skew).sqrt();
            polar.axes = polar.axes.map(|[p, q]| [p * x + q * skew, q * y]);
        }
        Some(polar)
    }

    fn image(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.axes.map(|[p, q]| p * x + q * y)
    }

    fn direction(&self, angle: f64) -> [f64; 2] {
        let (sine, cosine) = libm::sincos(angle);
        self.image([cosine, sine])
    }

    /// The distance of the border along a ray. The conditions are concave, so Newton's method approaches it from outside.
    fn border(&self, along: [f64; 2]) -> f64 {
        let place = |distance: f64| moved(self.centre, along.map(|step| distance * step));
        let mut distance = 1.0;
        for _ in 0..MAX_STEPS {
            let conditions = self.plane.conditions(place(distance));
            let nearest = conditions.iter().map(|condition| reach(condition, along, distance));
            let next = nearest.fold(4.0 * distance, f64::min);
            let is_last = (next - distance).abs() <= 4.0 * f64::EPSILON * distance;
            distance = next;
            if is_last {
                break;
            }
        }
        let mut inwards = 4.0 * f64::EPSILON;
        while !self.plane.admits(place(distance)) && inwards < 1.0 {
            distance *= 1.0 - inwards;
            inwards *= 2.0;
        }
        distance
    }

    fn place(&self, angle: f64, fraction: f64) -> Coefficients {
        let along = self.direction(angle);
        let distance = fraction * self.border(along);
        moved(self.centre, along.map(|step| distance * step))
    }

    fn sample(&self, angle: f64, fraction: f64, stats: &mut SolverStats) -> Sample {
        let landscape = self.plane.landscape;
        let work = landscape.whole_work(&self.plane.path(self.place(angle, fraction)), stats);
        Sample { angle, fraction, work: if work.is_nan() { f64::INFINITY } else { work } }
    }

    /// Samples with no neighbour of less work.
    fn starts(&self, stats: &mut SolverStats) -> Vec<Sample> {
        let spacing = std::f64::consts::TAU / ANGLES as f64;
        let rings = FRACTIONS.map(|fraction| -> Vec<Sample> {
            (0..ANGLES).map(|i| self.sample(spacing * i as f64, fraction, stats)).collect()
        });
        let is_least = |&(ring, i): &(usize, usize)| {
            let near = ring.saturating_sub(1)..(ring + 2).min(FRACTIONS.len());
            let around = [i + ANGLES - 1, i, i + 1].map(|i| i % ANGLES);
            near.flat_map(|ring| around.map(|i| rings[ring][i].work)).all(|work| work >= rings[ring][i].work)
        };
        let all = (0..FRACTIONS.len()).flat_map(|ring| (0..ANGLES).map(move |i| (ring, i)));
        all.filter(is_least).map(|(ring, i)| rings[ring][i]).collect()
    }

    /// Moves to the neighbour of least work, with shorter and shorter steps.
    fn refine(&self, start: Sample, stats: &mut SolverStats) -> Sample {
        let mut least = start;
        let mut step = 0.5 * std::f64::consts::TAU / ANGLES as f64;
        while step > LAST_STEP {
            let mut best = least;
            for (turn, out) in NEIGHBOURS {
                let fraction = (least.fraction + out * step).min(1.0);
                if (turn, fraction) != (0.0, least.fraction) {
                    let near = self.sample(least.angle + turn * step, fraction, stats);
                    best = if near.work < best.work { near } else { best };
                }
            }
            if best.work >= least.work {
                step *= 0.5;
            }
            least = best;
        }
        least
    }

    /// A minimum on a smooth part of the border, where differences of fifth order find it to more digits than the work shows.
    fn polish(&self, found: Sample, stats: &mut SolverStats) -> Sample {
        if found.fraction < 1.0 {
            return found;
        }
        let [a, b, c, d] =
            [-2.0, -1.0, 1.0, 2.0].map(|k| self.sample(found.angle + k * DIFFERENCE, 1.0, stats).work - found.work);
        let slope = (a - 8.0 * b + 8.0 * c - d) / 12.0;
        let bend = (16.0 * (b + c) - a - d) / 12.0;
        let step = -slope / bend;
        let near = self.sample(found.angle + step * DIFFERENCE, 1.0, stats);
        let is_better = bend > 0.0 && step.abs() < 0.1 && near.work <= found.work + ROUNDING * found.work.abs();
        if is_better { near } else { found }
    }
}

/// Steps of angle and fraction to the neighbours.
const NEIGHBOURS: [(f64, f64); 8] =
    [(-1.0, 0.0), (1.0, 0.0), (-1.0, -1.0), (0.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (0.0, 1.0), (1.0, 1.0)];

/// Centre and covariance of the area of a polygon; `None` without an area.
fn moments(vertices: &[[f64; 2]]) -> Option<([f64; 2], [[f64; 2]; 2])> {
    let (mut area, mut first, mut second) = (0.0, [0.0; 2], [[0.0; 2]; 2]);
    for (i, p) in vertices.iter().enumerate() {
        let q = vertices[(i + 1) % vertices.len()];
        let cross = p[0] * q[1] - p[1] * q[0];
        area += 0.5 * cross;
        for j in 0..2 {
            first[j] += cross * (p[j] + q[j]) / 6.0;
            for k in 0..2 {
                second[j][k] += cross * (2.0 * (p[j] * p[k] + q[j] * q[k]) + p[j] * q[k] + q[j] * p[k]) / 24.0;
            }
        }
    }
    let centre = first.map(|sum| sum / area);
    let covariance = [0, 1].map(|j| [0, 1].map(|k| second[j][k] / area - centre[j] * centre[k]));
    (area > 0.0 && area.is_finite()).then_some((centre, covariance))
}
