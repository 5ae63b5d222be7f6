//! Envelope following: the return map of the section `v = v_f`, its fixed points, and steps over many cycles.
//!
//! With `q = (ln z, y)` on the section, the return map is `q -> q + g(q)`. Its fixed points are the limit cycles. Newton's
//! method finds them; their Floquet multipliers, the eigenvalues of `1 + dg/dq`, decide whether they attract.
//!
//! An envelope step over `n` cycles (multirevolution collocation; Calvo, Jay, Montijano and Rández, Appl. Numer. Math. 51,
//! 2004) is a polynomial `p(j)` in the number of cycles with
//!
//! ```text
//! p(j_i + 1/2) - p(j_i - 1/2) = g(p(j_i - 1/2)),    j_i = c_i n,
//! ```
//!
//! `c_i` the nodes of Radau IIA. It is implicit, so relaxation of theta in a few cycles does not limit its length.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use super::integration::STAGES as S;
use super::long_term::{Follower, excess};
use super::orbit::{Orbit, StopReason};
use super::scaled_block::SectionPoint;
use super::simulation::ACCURACIES;
use crate::numerics::MAX_STEPS;
use crate::numerics::elementary::{exp, ln, ln_1p};
use crate::numerics::root::crossing;
use crate::numerics::stiff::radau_iia_9;

/// One step of the return map.
#[derive(Debug, Clone, Copy)]
pub(super) struct MapStep {
    pub from: SectionPoint,
    /// Change of the section point, `g`.
    pub change: SectionPoint,
    pub period: f64,
    /// Least and greatest `ln(v/v_f)`.
    pub range: [f64; 2],
    /// Error of the integration steps.
    pub tolerance: f64,
}

/// Fixed point of the return map.
#[derive(Debug, Clone, Copy)]
pub(super) struct FixedPoint {
    pub map_step: MapStep,
    /// Whether nearby points approach it from one side, without overshoot.
    pub monotone: bool,
    /// Distance of the response from it in the first iteration.
    pub first_distance: f64,
}

/// Result of envelope following.
pub(super) enum EnvelopeResult {
    /// The response converges to this limit cycle.
    Cycle(FixedPoint),
    /// Section point after some time, where cycles change fast, or enter the band of settled velocities.
    At { section_point: SectionPoint, time: f64 },
    /// Cycles do not change slowly.
    NotSlow,
}

/// Unknowns of an envelope step.
const SYSTEM: usize = 2 * S;

/// Width of a limit cycle, in `ln v`, at least. Chosen: ten times the motion by rounding of the force in the physical
/// domain.
const MIN_CYCLE: f64 = 1e-7;

/// Difference of section points for the derivative of the map. Derived: the power 1/3 of the error of a cycle at `rtol`
/// 1e-6.
pub(super) const DIFFERENCE_STEP: f64 = 1e-3;

/// Error of a step, at least. Derived: its rounding, 50 units in the last place.
pub(super) const MIN_STEP_ERROR: f64 = 1e-14;

/// Distance in `q` within which the map is nearly linear. Chosen: Newton's method gains a digit a step there.
const NEWTON_RADIUS: f64 = 0.1;

/// Cycles of an envelope step, at least. Chosen: it integrates about as many.
const MIN_SKIPPED: f64 = 20.0;

/// Newton iterations, at most. Chosen: four to eight are typical.
const MAX_ITERATIONS: u32 = 16;

/// Integration steps of a cycle, at most. Chosen: ten times those of a deep slip at the tightest tolerance.
const MAX_CYCLE_STEPS: u32 = 3000;

/// Factor of the least error of a step where steps resolve rounding only. Chosen: one increase suffices.
const COARSENING: f64 = 1e3;

/// Attempts of an envelope step, at most. Chosen: each is a quarter to a fifth as long as the last.
const MAX_TRIES: u32 = 3;

/// Change of `q` in an envelope step, at most. Chosen: its Jacobian is that at the start.
const MAX_ENVELOPE_CHANGE: f64 = 2.0;

struct EnvelopeStep {
    /// Changes of `w` and of `y` relative to `e^w` at the nodes.
    change: [[f64; S]; 2],
    map_steps: [MapStep; S],
}

/// Values at `u` of the polynomials that are 1 at one node and 0 at the others and at 0.
fn basis(u: f64) -> [f64; S] {
    let powers = &radau_iia_9().powers;
    std::array::from_fn(|j| (0..S).rev().fold(0.0, |sum, k| (sum + powers[k][j]) * u))
}

/// Section point with `y` relative to `e^w`, which small motions conserve, in units of `e^w` at the start.
fn relative([w, y]: SectionPoint, start: &MapStep) -> SectionPoint {
    [w, y * exp(start.from[0] - w)]
}

/// Section point of relative coordinates.
fn absolute([w, y]: SectionPoint, start: &MapStep) -> SectionPoint {
    [w, y * exp(w - start.from[0])]
}

fn sum([w, y]: SectionPoint, [by_w, by_y]: SectionPoint) -> SectionPoint {
    [w + by_w, y + by_y]
}

fn dot(weights: &[f64; S], values: &[f64; S]) -> f64 {
    weights.iter().zip(values).map(|(weight, value)| weight * value).sum()
}

/// Solution `x` of `matrix x = right`; `None` where the matrix is singular.
fn solve(matrix: Matrix2<f64>, right: SectionPoint) -> Option<SectionPoint> {
    matrix.lu().solve(&Vector2::from(right)).map(Into::into)
}

impl MapStep {
    /// Change relative to `e^w`.
    fn relative(&self, start: &MapStep) -> SectionPoint {
        let [from, to] = [self.from, sum(self.from, self.change)].map(|section_point| relative(section_point, start));
        [self.change[0], to[1] - from[1]]
    }

    /// Size of the motion, in `ln v`, at most 1.
    pub fn size(&self) -> f64 {
        size(self.range)
    }

    /// Size of a change of the section point, in `ln v` relative to the motion.
    pub fn distance(&self, change: SectionPoint) -> f64 {
        distance(change, self.size())
    }
}

/// Size of a motion between two velocities, in `ln v`, at most 1.
pub(super) fn size([low, high]: [f64; 2]) -> f64 {
    (high - low).min(1.0)
}

pub(super) fn distance([w, y]: SectionPoint, size: f64) -> f64 {
    w.abs().max(y.abs() / size)
}

impl Follower<'_> {
    /// Integrates the cycle from a section point.
    pub(super) fn map_step(&mut self, from: SectionPoint, tolerance: f64) -> Result<MapStep, StopReason> {
        let mut orbit = Orbit::new(self.slider, self.slider.state(from), tolerance, self.rtol);
        let mut budget = self.budget.min(MAX_CYCLE_STEPS);
        let before = budget;
        let cycle = orbit.cycle(false, &mut budget);
        self.budget -= before - budget;
        if cycle == Err(StopReason::StepLimit) && self.budget > 0 {
            // Steps at this tolerance resolve rounding only.
            self.min_step_error *= COARSENING;
            return Err(StopReason::BelowStepError);
        }
        // From a point that the response need not reach.
        let cycle =
            cycle.map_err(|stop| if stop == StopReason::Divergence { StopReason::BelowStepError } else { stop })?;
        let range = cycle.exact_range(&mut orbit);
        let end = self.slider.section_point(&cycle.end);
        let change = [end[0] - from[0], end[1] - from[1]];
        if change[0].is_nan() {
            return Err(StopReason::BelowStepError);
        }
        Ok(MapStep { from, change, period: cycle.period, range, tolerance })
    }

    /// Derivative of `g` at the start of a cycle, with `y` relative to `e^w`: changes of `w` are along small motions.
    fn derivative(&mut self, map_step: &MapStep) -> Result<Matrix2<f64>, StopReason> {
        let nudges = [[DIFFERENCE_STEP, 0.0], [0.0, DIFFERENCE_STEP * map_step.size()]];
        let change_here = map_step.relative(map_step);
        let mut slopes = Matrix2::zeros();
        for (c, nudge) in nudges.into_iter().enumerate() {
            let from = absolute(sum(map_step.from, nudge), map_step);
            let nudged = self.map_step(from, map_step.tolerance)?.relative(map_step);
            (0..2).for_each(|r| slopes[(r, c)] = (nudged[r] - change_here[r]) / nudge[c]);
        }
        Ok(slopes)
    }

    /// Takes envelope steps from a section point where a cycle between these velocities changes `q` by this distance.
    pub(super) fn follow_envelope(
        &mut self,
        section_point: SectionPoint,
        range: [f64; 2],
        change: f64,
    ) -> Result<EnvelopeResult, StopReason> {
        let tolerance = self.map_tolerance(range, change);
        let mut map_step = self.map_step(section_point, tolerance)?;
        let (mut time, mut cycles) = (0.0, 0.0);
        for _ in 0..MAX_STEPS {
            let speed = map_step.distance(map_step.change);
            let tolerance = self.map_tolerance(map_step.range, speed);
            if tolerance < 0.3 * map_step.tolerance {
                map_step = self.map_step(map_step.from, tolerance)?;
            }
            let jacobian = self.derivative(&map_step)?;
            if let Some(fixed_point) = self.fixed_point(&map_step, jacobian)? {
                let is_reached = fixed_point.monotone || fixed_point.first_distance < self.requested_rtol;
                return Ok(if is_reached {
                    EnvelopeResult::Cycle(fixed_point)
                } else {
                    EnvelopeResult::At { section_point: map_step.from, time }
                });
            }
            if self.decays(&map_step) {
                return Ok(EnvelopeResult::At { section_point: map_step.from, time });
            }
            cycles = if cycles > 0.0 { cycles } else { (3.0 * NEWTON_RADIUS / speed).max(1.5 * MIN_SKIPPED) };
            let next = self.envelope_step(&map_step, jacobian, &mut cycles)?;
            let Some((envelope_step, n)) = next else {
                return Ok(if time > 0.0 {
                    EnvelopeResult::At { section_point: map_step.from, time }
                } else {
                    EnvelopeResult::NotSlow
                });
            };
            let end = envelope_step.map_steps[S - 1];
            if self.linear.stable && map_step.ln_excess() > 0.0 && end.ln_excess() < 0.0 {
                let (section_point, elapsed) = envelope_step.before_last_excess(&map_step, n);
                return Ok(EnvelopeResult::At { section_point, time: time + elapsed });
            }
            time += envelope_step.time(n, n);
            self.note_range(end.range);
            let section_point = envelope_step.section_point(&map_step, 1.0);
            map_step = self.map_step(section_point, end.tolerance)?;
        }
        Ok(EnvelopeResult::NotSlow)
    }

    /// Error of the integration steps of a cycle between these velocities whose change has the relative accuracy `rtol`.
    fn map_tolerance(&self, range: [f64; 2], change: f64) -> f64 {
        // Rounding of the largest logarithm.
        let min_step_error = self.min_step_error * (range[1] - range[0]).max(1.0);
        size(range) * (0.01 * self.rtol * change).clamp(min_step_error, self.tolerance.max(min_step_error))
    }

    /// Attracting fixed point near a cycle.
    fn fixed_point(&mut self, map_step: &MapStep, jacobian: Matrix2<f64>) -> Result<Option<FixedPoint>, StopReason> {
        let (mut map_step, mut jacobian, mut first_distance) = (*map_step, jacobian, f64::NAN);
        let mut before = NEWTON_RADIUS;
        // Whether the tolerance is the tightest, since the least velocity magnifies errors.
        let mut is_exact = false;
        for _ in 0..MAX_ITERATIONS {
            let Some(step) = solve(jacobian, map_step.relative(&map_step).map(|change| -change)) else {
                return Ok(None);
            };
            let distance = map_step.distance(step);
            // Distance from errors of steps, and from rounding where it stops the method.
            let amplification = distance / map_step.distance(map_step.change);
            let noise = 10.0 * map_step.tolerance / map_step.size() * amplification;
            let tolerance = self.map_tolerance(map_step.range, if is_exact { 0.0 } else { 1.0 / amplification });
            let fine = map_step.tolerance <= 2.0 * tolerance;
            let ends = distance < 0.01 * self.rtol || (fine && distance < 3.0 * noise);
            let stops = fine && distance > before && distance < NEWTON_RADIUS * self.requested_rtol;
            // False for NaN.
            if !(distance < before || ends || stops) {
                return Ok(None);
            }
            first_distance = if first_distance.is_nan() { distance } else { first_distance };
            let trough = map_step.range[0];
            map_step = self.map_step(absolute(sum(map_step.from, step), &map_step), tolerance)?;
            if ends || stops {
                // Error from a fraction of the last change, and from errors of steps.
                let left = (map_step.range[0] - trough).abs() * (0.01 + 0.1 * noise / distance);
                // The error of the second run.
                if left > ACCURACIES[1] * self.requested_rtol {
                    if !is_exact {
                        is_exact = true;
                        map_step = self.map_step(map_step.from, self.map_tolerance(map_step.range, 0.0))?;
                        before = NEWTON_RADIUS;
                        continue;
                    }
                    map_step.range[0] = f64::NAN;
                }
                let is_certain = noise < NEWTON_RADIUS && map_step.size() > MIN_CYCLE && self.is_driven();
                let monotone = multiplier(jacobian, 10.0 * map_step.tolerance / (map_step.size() * DIFFERENCE_STEP));
                return Ok(monotone.filter(|_| is_certain).map(|monotone| FixedPoint {
                    map_step,
                    monotone,
                    first_distance,
                }));
            }
            before = if fine { 0.5 * distance } else { before };
            jacobian = self.derivative(&map_step)?;
        }
        Ok(None)
    }

    /// Envelope step of about `cycles` from the start of a cycle, and its number of cycles; `None` if it is too short. Sets
    /// `cycles` to the proposal for the next step.
    fn envelope_step(
        &mut self,
        map_step: &MapStep,
        jacobian: Matrix2<f64>,
        cycles: &mut f64,
    ) -> Result<Option<(EnvelopeStep, f64)>, StopReason> {
        // The estimate is of order S, the error of order 2 S - 1.
        let allowed = exp(0.6 * ln(self.tolerance.max(self.min_step_error)));
        for _ in 0..MAX_TRIES {
            if *cycles < MIN_SKIPPED {
                break;
            }
            let n = cycles.floor();
            let envelope_step = self.stages(map_step, jacobian, n)?;
            // Newton's method may converge for a third of the cycles.
            let error = envelope_step
                .as_ref()
                .and_then(|envelope_step| envelope_step.error(map_step, jacobian, n))
                .map_or(400.0, |error| error / allowed);
            *cycles = n * (0.9 * exp(-ln(error.max(1e-10)) / (S + 1) as f64)).clamp(0.2, 4.0);
            if let Some(envelope_step) = envelope_step.filter(|_| error < 1.0) {
                return Ok(Some((envelope_step, n)));
            }
        }
        Ok(None)
    }

    /// Solves for the changes at the nodes by Newton's method with the Jacobian at the start; `None` if it fails.
    fn stages(
        &mut self,
        map_step: &MapStep,
        jacobian: Matrix2<f64>,
        n: f64,
    ) -> Result<Option<EnvelopeStep>, StopReason> {
        let nodes = radau_iia_9().nodes;
        let before = nodes.map(|u| basis(u - 0.5 / n));
        let slopes = slopes(n);
        let mut matrix = SMatrix::<f64, SYSTEM, SYSTEM>::zeros();
        for (i, j) in (0..S).flat_map(|i| (0..S).map(move |j| (i, j))) {
            for (r, c) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let slope = if r == c { slopes[i][j] } else { 0.0 };
                matrix[(r * S + i, c * S + j)] = slope - if i == j { jacobian[(r, c)] } else { 0.0 };
            }
        }
        let matrix = matrix.lu();
        let mut envelope_step = EnvelopeStep { change: [[0.0; S]; 2], map_steps: [*map_step; S] };
        let tolerance = (0.1 * self.tolerance.max(self.min_step_error)).max(n * map_step.tolerance / map_step.size());
        let weights = SVector::<f64, SYSTEM>::from_fn(|i, _| if i < S { 1.0 } else { map_step.size().powi(-2) });
        let weighed = |p: &SVector<f64, SYSTEM>, q: &SVector<f64, SYSTEM>| weights.component_mul(p).dot(q);
        let mut steps: Vec<SVector<f64, SYSTEM>> = Vec::new();
        let mut last = f64::INFINITY;
        for _ in 0..MAX_ITERATIONS {
            let mut step = SVector::<f64, SYSTEM>::zeros();
            for i in 0..S {
                let section_point =
                    absolute(sum(map_step.from, [0, 1].map(|r| dot(&before[i], &envelope_step.change[r]))), map_step);
                // In the first iteration all cycles start at the start of the envelope step.
                if !steps.is_empty() {
                    envelope_step.map_steps[i] = self.map_step(section_point, map_step.tolerance)?;
                }
                let change = envelope_step.map_steps[i].relative(map_step);
                for r in 0..2 {
                    step[r * S + i] = change[r] - dot(&slopes[i], &envelope_step.change[r]);
                }
            }
            if !matrix.solve_mut(&mut step) {
                return Ok(None);
            }
            // Broyden's update (Kelley, Iterative Methods for Linear and Nonlinear Equations, section 7.3).
            for pair in steps.windows(2) {
                let factor = weighed(&pair[0], &step) / weighed(&pair[0], &pair[0]);
                step += factor * pair[1];
            }
            if let Some(last) = steps.last() {
                step /= 1.0 - weighed(last, &step) / weighed(last, last);
            }
            (0..SYSTEM).for_each(|i| envelope_step.change[i / S][i % S] += step[i]);
            let largest_step = (0..S).map(|i| map_step.distance([step[i], step[S + i]])).fold(0.0, f64::max);
            let rate = largest_step / last;
            if !steps.is_empty() && rate < 0.5 && largest_step * rate < tolerance {
                return Ok(Some(envelope_step));
            }
            if !(largest_step < 0.7 * last && largest_step < MAX_ENVELOPE_CHANGE) {
                return Ok(None);
            }
            last = largest_step;
            steps.push(step);
        }
        Ok(None)
    }
}

/// Matrix `slopes[i][j]`: change of the polynomial of node `j` over a cycle at node `i`.
fn slopes(n: f64) -> [[f64; S]; S] {
    let half = 0.5 / n;
    radau_iia_9().nodes.map(|u| {
        let [before, after] = [basis(u - half), basis(u + half)];
        std::array::from_fn(|j| after[j] - before[j])
    })
}

/// Whether nearby points approach a fixed point with this derivative of `g` from one side; `None` if it does not attract,
/// for an error of the derivative up to `error`.
fn multiplier(derivative: Matrix2<f64>, error: f64) -> Option<bool> {
    let [[ww, yw], [wy, yy]]: [[f64; 2]; 2] = derivative.into();
    // Half the trace and the determinant of 1 + dg/dq.
    let (half, product) = (1.0 + 0.5 * (ww + yy), (1.0 + ww) * (1.0 + yy) - wy * yw);
    let square = 0.25 * (ww - yy) * (ww - yy) + wy * yw;
    if square < 0.0 {
        return (product < 1.0 - error).then_some(false);
    }
    let root = square.sqrt();
    // 1 minus the greater multiplier, without cancellation.
    let left = -0.5 * (ww + yy) - root;
    (left > error && half - root > -1.0).then_some(half + root > 0.5 && half - root > -0.5)
}

impl MapStep {
    /// `ln` of the range of a cycle relative to the band of settled velocities; negative within.
    pub fn ln_excess(&self) -> f64 {
        ln_1p(excess(self.range))
    }
}

impl EnvelopeStep {
    /// Section point at the fraction `u` of the envelope step.
    fn section_point(&self, map_step: &MapStep, u: f64) -> SectionPoint {
        let basis = basis(u);
        absolute(sum(map_step.from, [0, 1].map(|r| dot(&basis, &self.change[r]))), map_step)
    }

    /// Time of the first `j` of its `n` cycles.
    fn time(&self, n: f64, j: f64) -> f64 {
        let matrix = SMatrix::<f64, S, S>::from(slopes(n)).transpose();
        let times = matrix.lu().solve(&SVector::from(self.map_steps.map(|map_step| map_step.period)));
        times.map_or(f64::NAN, |times| SVector::from(basis(j / n)).dot(&times))
    }

    /// Error estimate: the defect of the first cycle, which is not a node, as for a step of Radau IIA.
    fn error(&self, map_step: &MapStep, jacobian: Matrix2<f64>, n: f64) -> Option<f64> {
        let first = basis(1.0 / n);
        let change = map_step.relative(map_step);
        let defect = [0, 1].map(|r| change[r] - dot(&first, &self.change[r]));
        let rate = (S + 1) as f64 / n;
        solve(Matrix2::from_diagonal_element(rate) - jacobian, defect).map(|error| map_step.distance(error))
    }

    /// Section point shortly before the last cycle that leaves the band of settled velocities, and its time.
    fn before_last_excess(&self, map_step: &MapStep, n: f64) -> (SectionPoint, f64) {
        let ends = self.map_steps.map(|end| end.ln_excess() - map_step.ln_excess());
        // These cycles start half a cycle before their nodes.
        let ln_excess = |u: f64| map_step.ln_excess() + dot(&basis(u), &ends);
        let u = crossing(ln_excess, [0.0, 1.0], [map_step.ln_excess(), map_step.ln_excess() + ends[S - 1]], 1e-6);
        let j = ((u * n).floor() - 2.0).max(0.0);
        (self.section_point(map_step, j / n), self.time(n, j))
    }
}
