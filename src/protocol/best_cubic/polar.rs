//! The least work over a convex set where the work is not convex, as under the laws of Ruina and of Perrin, Rice and Zheng.
//!
//! A place is an angle about the centre of the set and a fraction of the distance to the border, in units in which the set is about as long
//! as wide. Samples of the whole set, in double precision and many at a time, show where the work is locally least; each such place is refined. A
//! border, and its corners, are lines of constant fraction, so that the search follows them.

use std::cell::Cell;

use super::ellipse::Ellipse;
use super::plane::{Bound, Coefficients, Constraint, Plane, moved};
use crate::numerics::{MAX_STEPS, ROOT_OF_ROUNDING, golden_section};
use crate::protocol::cubic::{Landscape, LandscapeBuffers};
use crate::protocol::{SolverStats, Status};

/// Angles of the samples. Chosen: three corners are the most seen, some tens of angles apart.
const ANGLES: usize = 96;
/// Fractions of the samples, from the border inwards. Chosen: every least work found lies on the border or near it; on the border itself, where `n` may
/// vanish, a work takes many nodes.
const FRACTIONS: [f64; 4] = [0.99, 0.9, 0.7, 0.4];
/// Vertices of the polygon whose moments make the set round. Chosen: its corners count little.
const VERTICES: usize = 32;
/// Repetitions of that. Chosen: the first one takes the centre away from the border.
const ROUNDS: usize = 3;
/// Relative distance from the border within which a condition is active. Chosen: far above rounding.
const ACTIVE: f64 = 1e-9;

/// Accuracy of the works of the first search. Chosen: works a [`DIFFERENCE`] from a minimum differ by more.
pub(super) const ROUGH_RTOL: f64 = 1e-8;
/// Distance from the border, relative to that from the centre, at which the first search takes the border. Chosen: far above rounding.
const INSET: f64 = 1e-10;
/// Relative range of the works in a set which [`ROUGH_RTOL`] resolves; works this close to the least one after the first search are refined. Chosen: a
/// thousand times that.
const MIN_RANGE: f64 = 1e3 * ROUGH_RTOL;

/// Last step of a refinement, in radians and fractions. Derived: the work at a corner is linear in the step, so the step is rounding.
const LAST_STEP: f64 = 1e-14;
/// Steps inwards from a minimum on the border at which no work may be less. Chosen: below the last step of the first search, down to rounding.
const INWARDS: [f64; 5] = [1e-4, 1e-6, 1e-8, 1e-10, 1e-12];
/// Half the width of the differences that determine a smooth minimum on the border, in radians. Chosen: rounding leaves fourth differences far below
/// [`MAX_FOURTH_DIFFERENCE`].
const DIFFERENCE: f64 = 1e-3;
/// Relative difference of works within rounding. Chosen: twice the accuracy of the works.
const ROUNDING: f64 = 2e-13;

/// The coordinates.
#[derive(Clone)]
struct Polar<'a> {
    plane: &'a Plane<'a>,
    /// The landscape of the first search; `None` for works and borders to rounding.
    rough: Option<&'a Landscape>,
    centre: Coefficients,
    axes: [[f64; 2]; 2],
    /// The last distance of the border, a guess of the next one.
    border: Cell<f64>,
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

/// The least work in the admissible set, from the centre of an ellipse that is inside; `None` if the set is as thin as rounding. `rough` is the
/// landscape to [`ROUGH_RTOL`].
pub(super) fn least(plane: &Plane, rough: &Landscape, ellipse: &Ellipse, stats: &mut SolverStats) -> Option<Least> {
    let first = Polar::around(plane, Some(rough), ellipse).or_else(|| Polar::around(plane, None, ellipse))?;
    let polar = Polar { rough: None, ..first.clone() };
    let all = first.grid(stats);
    let finite = || all.iter().map(|sample| sample.work).filter(|work| work.is_finite());
    let [least, most] = [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)];
    let is_resolved = most - least > MIN_RANGE * least.abs();
    let (first, all) = if is_resolved { (first, all) } else { (polar.clone(), polar.grid(stats)) };
    let starts = local_minima(&all).into_iter();
    let starts: Vec<Sample> = starts.map(|start| first.refine(start, FIRST_STEP, DIFFERENCE, stats)).collect();
    let close = starts.iter().map(|start| start.work).fold(f64::INFINITY, f64::min);
    let is_close = |start: &&Sample| start.work <= close + MIN_RANGE * close.abs();
    let found = starts.iter().filter(is_close).map(|&start| polar.settle(start, stats));
    let found = found.min_by(|x, y| x.work.total_cmp(&y.work))?;
    let along = polar.direction(found.angle);
    let border = polar.border(along);
    let is_active = |condition: &&Constraint| reach(condition, along, border) <= (1.0 + ACTIVE) * border;
    let on_border = plane.conditions(polar.place(along, border));
    let active = on_border.iter().filter(is_active).map(|condition| condition.of).collect();
    let active = if found.fraction == 1.0 { active } else { Vec::new() };
    let place = polar.place(along, found.fraction * border);
    found.work.is_finite().then_some(Least { work: found.work, place, active })
}

/// Samples of a grid with no neighbour of less work.
fn local_minima(grid: &[Sample]) -> Vec<Sample> {
    let at = |i: usize, ring: usize| grid[i % ANGLES * FRACTIONS.len() + ring];
    let is_least = |&(i, ring): &(usize, usize)| {
        let mut near = ring.saturating_sub(1)..(ring + 2).min(FRACTIONS.len());
        near.all(|other| [i + ANGLES - 1, i, i + 1].iter().all(|&i_near| at(i_near, other).work >= at(i, ring).work))
    };
    let all = (0..ANGLES).flat_map(|i| (0..FRACTIONS.len()).map(move |ring| (i, ring)));
    all.filter(is_least).map(|(i, ring)| at(i, ring)).collect()
}

/// First step of a refinement: half the angle between samples.
const FIRST_STEP: f64 = 0.5 * std::f64::consts::TAU / ANGLES as f64;

/// Where a linear condition, known at `distance` along a ray from the centre, is violated.
fn reach(condition: &Constraint, along: [f64; 2], distance: f64) -> f64 {
    let slope = condition.along[0] * along[0] + condition.along[1] * along[1];
    if slope < 0.0 { distance - condition.value / slope } else { f64::INFINITY }
}

impl<'a> Polar<'a> {
    /// The coordinates that make the set round, from an ellipse around it; `None` without an area.
    fn around(plane: &'a Plane<'a>, rough: Option<&'a Landscape>, ellipse: &Ellipse) -> Option<Polar<'a>> {
        let mut polar = Polar { plane, rough, centre: ellipse.centre, axes: ellipse.half, border: Cell::new(1.0) };
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
            let [[p, q], [r, s]] = polar.axes;
            let size = polar.centre[0].high.abs() + polar.centre[1].high.abs();
            let width = (p * s - q * r).abs() / (p.abs() + q.abs() + r.abs() + s.abs());
            polar.border.set(1.0);
            // In a wider set the first search knows the border to 1e-8.
            polar.rough = rough.filter(|_| width > ROOT_OF_ROUNDING * size);
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

    fn place(&self, along: [f64; 2], distance: f64) -> Coefficients {
        moved(self.centre, along.map(|step| distance * step))
    }

    /// The distance of the border along a ray. The conditions are concave, so Newton's method approaches it from outside.
    fn border(&self, along: [f64; 2]) -> f64 {
        let is_rough = self.rough.is_some();
        let resolution = if is_rough { 0.1 * INSET } else { 4.0 * f64::EPSILON };
        let mut distance = self.border.get();
        for _ in 0..MAX_STEPS {
            let place = self.place(along, distance);
            let conditions = if is_rough { self.plane.rough_conditions(place) } else { self.plane.conditions(place) };
            let nearest = conditions.iter().map(|condition| reach(condition, along, distance));
            let next = nearest.fold(4.0 * distance, f64::min);
            let is_last = (next - distance).abs() <= resolution * distance;
            distance = next;
            if is_last {
                break;
            }
        }
        self.border.set(distance);
        if is_rough {
            return distance * (1.0 - INSET);
        }
        let mut inwards = 4.0 * f64::EPSILON;
        while !self.plane.admits(self.place(along, distance)) && inwards < 1.0 {
            distance *= 1.0 - inwards;
            inwards *= 2.0;
        }
        distance
    }

    /// Works at angles and fractions; those at one angle are best together.
    fn samples(&self, places: impl IntoIterator<Item = (f64, f64)>, stats: &mut SolverStats) -> Vec<Sample> {
        let (mut last, mut along, mut border) = (f64::NAN, [0.0; 2], 0.0);
        let (mut samples, mut a_2, mut a_3) = (Vec::new(), Vec::new(), Vec::new());
        for (angle, fraction) in places {
            if angle != last {
                (last, along) = (angle, self.direction(angle));
                border = self.border(along);
            }
            let place = self.place(along, fraction * border);
            let mut work = f64::INFINITY;
            if self.rough.is_some() {
                let [of_x, of_x_2] = self.plane.coefficients(place);
                a_2.push(of_x.high);
                a_3.push(of_x_2.high);
            } else {
                let found = self.plane.landscape.whole_work(&self.plane.path(place), stats);
                work = if found.is_nan() { work } else { found };
            }
            samples.push(Sample { angle, fraction, work });
        }
        if let Some(rough) = self.rough {
            let (mut work, mut status) = (vec![0.0; a_2.len()], vec![Status::Infeasible; a_2.len()]);
            let out = LandscapeBuffers { work: &mut work, v_min: &mut [], status: &mut status };
            *stats += rough.evaluate(&a_2, &a_3, out);
            for ((sample, work), status) in samples.iter_mut().zip(work).zip(status) {
                sample.work = if status == Status::Infeasible { f64::INFINITY } else { work };
            }
        }
        samples
    }

    /// Samples of the whole set, angle by angle.
    fn grid(&self, stats: &mut SolverStats) -> Vec<Sample> {
        let spacing = std::f64::consts::TAU / ANGLES as f64;
        let angles = (0..ANGLES).map(|i| spacing * i as f64);
        self.samples(angles.flat_map(|angle| FRACTIONS.map(|fraction| (angle, fraction))), stats)
    }

    /// Moves to the neighbour of least work, with steps that are halved from the first to the last.
    fn refine(&self, start: Sample, first: f64, last: f64, stats: &mut SolverStats) -> Sample {
        let (mut least, mut step) = (start, first);
        while step > last {
            let Sample { angle, fraction, .. } = least;
            let inside = NEIGHBOURS.into_iter().filter(|&(_, out)| out <= 0.0 || fraction < 1.0);
            // What lies beyond the centre has starts of its own.
            let near = inside.map(|(turn, out)| (angle + turn * step, (fraction + out * step).clamp(0.0, 1.0)));
            let best = self.samples(near, stats).into_iter().min_by(|x, y| x.work.total_cmp(&y.work));
            match best.filter(|best| best.work < least.work) {
                Some(best) => least = best,
                None => step *= 0.5,
            }
        }
        least
    }

    /// The minimum to rounding, near the one of the first search.
    fn settle(&self, start: Sample, stats: &mut SolverStats) -> Sample {
        let mut sample = |angle: f64, fraction: f64| self.samples([(angle, fraction)], stats)[0];
        if start.fraction < 1.0 {
            let start = sample(start.angle, start.fraction);
            return self.refine(start, 2.0 * DIFFERENCE, LAST_STEP, stats);
        }
        let mut found = sample(start.angle, 1.0);
        let is_smooth = (0..MAX_POLISHES).any(|_| {
            let Polished { near, step, is_smooth } = self.polish(found, stats);
            found = near;
            is_smooth && step.abs() < LAST_POLISH
        });
        let is_settled = is_smooth || {
            let (least, is_enclosed) = self.on_border(start.angle, stats);
            found = least;
            is_enclosed
        };
        let inwards = self.samples(INWARDS.map(|step| (found.angle, 1.0 - step)), stats);
        if !is_settled || inwards.iter().any(|inner| inner.work < found.work) {
            found = self.refine(found, 2.0 * DIFFERENCE, LAST_STEP, stats);
        }
        if is_smooth || found.fraction < 1.0 {
            return found;
        }
        let Polished { near, .. } = self.polish(found, stats);
        if near.work <= found.work + ROUNDING * found.work.abs() { near } else { found }
    }

    /// The least work on the border near an angle, by golden sections, and whether it lies between the bounds of the search.
    fn on_border(&self, angle: f64, stats: &mut SolverStats) -> (Sample, bool) {
        let mut sample = |angle: f64| self.samples([(angle, 1.0)], stats)[0];
        let bounds @ (mut low, mut high) = (angle - 2.0 * DIFFERENCE, angle + 2.0 * DIFFERENCE);
        let inner = |low: f64, high: f64| low + golden_section::FRACTION * (high - low);
        let (mut near, mut far) = (sample(inner(high, low)), sample(inner(low, high)));
        let mut outer = [sample(low).work, sample(high).work];
        let is_flat = |works: [f64; 2], least: f64| works.iter().all(|work| work - least <= ROUNDING * least.abs());
        while high - low > LAST_STEP && !is_flat(outer, near.work.min(far.work)) {
            if near.work < far.work {
                (high, outer[1]) = (far.angle, far.work);
                (near, far) = (sample(inner(high, low)), near);
            } else {
                (low, outer[0]) = (near.angle, near.work);
                (near, far) = (far, sample(inner(low, high)));
            }
        }
        (if near.work < far.work { near } else { far }, low != bounds.0 && high != bounds.1)
    }

    /// A step to a minimum on the border, from differences of fifth order.
    fn polish(&self, found: Sample, stats: &mut SolverStats) -> Polished {
        let mut sample = |turn: f64| self.samples([(found.angle + turn * DIFFERENCE, 1.0)], stats)[0];
        let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|turn| sample(turn).work - found.work);
        let slope = (a - 8.0 * b + 8.0 * c - d) / 12.0;
        let bend = (16.0 * (b + c) - a - d) / 12.0;
        // A convex function has a minimum near; a corner would show in the fourth difference.
        let step = if bend > 0.0 { -slope / bend } else { f64::INFINITY };
        let is_smooth = (a + d - 4.0 * (b + c)).abs() <= MAX_FOURTH_DIFFERENCE * bend;
        let near = if step.abs() < 2.0 { sample(step) } else { found };
        Polished { near, step, is_smooth }
    }
}

/// A step along the border.
struct Polished {
    near: Sample,
    /// The step, in units of [`DIFFERENCE`].
    step: f64,
    /// Whether the work has as many derivatives there as the differences need.
    is_smooth: bool,
}

/// Most steps of differences before golden sections. Chosen: the first search ends one difference from a minimum, and each step leaves a hundredth.
const MAX_POLISHES: u32 = 3;
/// Last step, in units of [`DIFFERENCE`]. Chosen: the next one, its square times a difference, is rounding.
const LAST_POLISH: f64 = 1e-3;
/// Greatest fourth difference of smooth works, in units of the second. Derived: a corner that it hides moves the minimum by a hundred-thousandth of a
/// difference, and changes the work by less than rounding.
const MAX_FOURTH_DIFFERENCE: f64 = 1e-5;

/// Steps of angle and fraction to the neighbours; those of one angle are together.
const NEIGHBOURS: [(f64, f64); 8] =
    [(-1.0, -1.0), (-1.0, 0.0), (-1.0, 1.0), (0.0, -1.0), (0.0, 1.0), (1.0, -1.0), (1.0, 0.0), (1.0, 1.0)];

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
