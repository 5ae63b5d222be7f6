//! The integrator: steps, error estimates and step-size control.

#![expect(clippy::needless_range_loop, reason = "matrices are written with the indices of their formulas")]

use super::blocks::{Factors, Square, inverse};
use super::collocation::Collocation;
use super::dense_output::DenseOutput;
use super::{Points, System};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::{exp, ln};

/// Accuracy of an integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy<const N: usize> {
    /// Greatest error of a step, in units of `scale`: `1e-13` to `1e-2`.
    pub tolerance: f64,
    /// The change of each variable that is an error of 1; positive.
    pub scale: [f64; N],
}

/// An integration in progress: Radau IIA with `S` stages, order `2 S - 1`, over `N` variables.
#[derive(Debug, Clone)]
pub struct Integrator<'a, Y, const N: usize, const S: usize> {
    system: &'a Y,
    rule: &'static Collocation<S>,
    accuracy: Accuracy<N>,
    /// Greatest error estimate of a step, in units of `scale`.
    allowed: f64,
    /// The time with 32 digits, so that short steps add up after a long rest.
    t: DoubleDouble,
    /// Remaining time below the last digit of `t`.
    rest: f64,
    /// Shortest step, as a fraction of the time before it.
    shortest: f64,
    y: [f64; N],
    /// Length proposed for the next step.
    h: f64,
    last: Option<LastStep<N, S>>,
}

/// The last step, with its error estimate relative to the allowed error.
#[derive(Debug, Clone, Copy)]
struct LastStep<const N: usize, const S: usize> {
    dense_output: DenseOutput<N, S>,
    error: f64,
}

/// Least tolerated error, relative to the variables: 32 units in the last place. Chosen: the roundings of a step.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Shortest step, as a fraction of the time before it, unless it [may be shorter](Integrator::may_step). Derived: `2^-107`, the
/// rounding of a double-double number.
const MIN_STEP_FRACTION: f64 = 6e-33;

/// Newton iterations before a step is rejected. Chosen: at the rate of 0.1 they give twelve digits.
const MAX_ITERATIONS: u32 = 12;

/// Fraction of the tolerance that is allowed as residual of Newton's method. Chosen: its effect on the error estimate is negligible; the default of
/// Radau5 is of this order (Hairer and Wanner 1996, IV.8).
const NEWTON_TOLERANCE_FRACTION: f64 = 0.01;

/// Convergence rate of Newton's method above which the matrix is recomputed. Chosen: one digit for each iteration.
const MAX_CONVERGENCE_RATE: f64 = 0.1;

impl<'a, Y: System<N>, const N: usize, const S: usize> Integrator<'a, Y, N, S> {
    /// An integrator that starts at `y(t)`, which satisfies the constraints, with a first step of about `h > 0`.
    pub fn new(
        system: &'a Y,
        rule: &'static Collocation<S>,
        accuracy: Accuracy<N>,
        t: f64,
        y: [f64; N],
        h: f64,
    ) -> Self {
        // The estimate is of order S, the error of order 2 S - 1.
        let fraction = (S + 1) as f64 / (2 * S) as f64;
        let allowed = exp(fraction * ln(accuracy.tolerance));
        let (t, shortest) = (DoubleDouble::new(t), MIN_STEP_FRACTION);
        Integrator { system, rule, accuracy, allowed, t, rest: 0.0, shortest, y, h, last: None }
    }

    /// Allows steps down to this fraction of the time before them. A solution that becomes infinite then takes more steps to detect.
    pub fn may_step(&mut self, fraction: f64) {
        self.shortest = fraction;
    }

    /// Time reached.
    pub fn t(&self) -> f64 {
        self.t.high
    }

    /// Variables there.
    pub fn y(&self) -> &[f64; N] {
        &self.y
    }

    /// Length proposed for the next step, also for a new integration that continues from here.
    pub fn proposal(&self) -> f64 {
        self.h
    }

    /// Continues from other variables at the same time, which satisfy the constraints, with a first step of about `h > 0`.
    pub fn jump(&mut self, y: [f64; N], h: f64) {
        (self.y, self.h, self.last) = (y, h, None);
    }

    /// Time left until `limit`.
    pub fn left(&self, limit: f64) -> f64 {
        (DoubleDouble::new(limit) - self.t).high
    }

    /// Continues from the variables `y` at a time later by `h`, found by other means, with a first step of about `next > 0`. Returns whether `h`
    /// is long enough to be represented.
    pub fn leap(&mut self, h: f64, y: [f64; N], next: f64) -> bool {
        let advances = h > self.shortest * self.t.high;
        if advances {
            self.pass(h);
            (self.y, self.h, self.last) = (y, next, None);
        }
        advances
    }

    /// Advances the time.
    #[inline(always)]
    fn pass(&mut self, h: f64) {
        let t = self.t + DoubleDouble::new(self.rest + h);
        self.rest = if t == self.t { self.rest + h } else { 0.0 };
        self.t = t;
    }

    /// Takes one step, which ends at `limit` at the latest, and then exactly there. `None` if no step is short enough: the solution ends here,
    /// usually because it becomes infinite.
    #[inline(always)]
    pub fn step(&mut self, limit: f64) -> Option<DenseOutput<N, S>> {
        loop {
            let left = self.left(limit);
            let cut = self.h >= left;
            let h = if cut { left } else { self.h };
            let advances = h > self.shortest * self.t.high;
            if !advances {
                return None;
            }
            let guess = self.guess(h);
            let start = self.y;
            let solved = self.stages(self.t.high, &start, h, guess);
            let tried = solved.and_then(|solved| Some((solved, self.error(h, &solved.change)? / self.allowed)));
            let Some((NodeChanges { change, iterations }, error)) = tried else {
                self.h = 0.3 * h;
                continue;
            };
            let factor = self.factor(h, error, iterations);
            if error > 1.0 {
                self.h = h * if self.last.is_none() { 0.1 } else { factor.clamp(0.1, 0.8) };
                continue;
            }
            let next = h * factor.clamp(0.2, 8.0);
            self.h = if cut { next.max(self.h) } else { next };
            let dense_output = DenseOutput::new(self.rule, self.t.high, h, self.y, &change);
            if cut {
                (self.t, self.rest) = (DoubleDouble::new(limit), 0.0);
            } else {
                self.pass(h);
            }
            self.y = dense_output.end;
            self.last = Some(LastStep { dense_output, error });
            return Some(dense_output);
        }
    }

    /// Integrates the part of an accepted step between the fractions `from` and `to` again: its end has the order of the method, and its polynomial
    /// is closer to the solution. `None` if Newton's method fails.
    #[inline(always)]
    pub fn between<const P: usize>(
        &mut self,
        dense_output: &DenseOutput<N, P>,
        from: f64,
        to: f64,
    ) -> Option<DenseOutput<N, S>> {
        let DenseOutput { t, start, .. } = *dense_output;
        let start = if from > 0.0 { self.substep(dense_output, (t, start), 0.0, from)?.end } else { start };
        self.substep(dense_output, (t + from * dense_output.h, start), from, to)
    }

    /// A step from `(t, y)`, at the fraction `from` of a step, to the fraction `to`.
    #[inline(always)]
    fn substep<const P: usize>(
        &mut self,
        dense_output: &DenseOutput<N, P>,
        (t, y): (f64, [f64; N]),
        from: f64,
        to: f64,
    ) -> Option<DenseOutput<N, S>> {
        let guess = std::array::from_fn(|r| {
            let before = dense_output.change(r, from);
            self.rule.nodes.map(|node| dense_output.change(r, from + (to - from) * node) - before)
        });
        let h = (to - from) * dense_output.h;
        let solved = self.stages(t, &y, h, guess)?;
        Some(DenseOutput::new(self.rule, t, h, y, &solved.change))
    }

    /// Factor of the next step's length: the predictive controller (Gustafsson, ACM TOMS 20, 496, 1994).
    #[inline(always)]
    fn factor(&self, h: f64, error: f64, iterations: u32) -> f64 {
        let order = (S + 1) as f64;
        let safety = 0.9 * f64::from(2 * MAX_ITERATIONS + 1) / f64::from(2 * MAX_ITERATIONS + iterations);
        let level = ln(error.max(1e-10));
        let factor = safety * exp(-level / order);
        match &self.last {
            Some(last) if error <= 1.0 => {
                let before = ln(last.error.max(1e-2));
                factor.min(safety * (h / last.dense_output.h) * exp((before - 2.0 * level) / order))
            }
            _ => factor,
        }
    }

    /// Changes at the nodes, extrapolated from the polynomial of the last step.
    #[inline(always)]
    fn guess(&self, h: f64) -> [[f64; S]; N] {
        let Some(LastStep { dense_output, .. }) = &self.last else { return [[0.0; S]; N] };
        let fraction = h / dense_output.h;
        std::array::from_fn(|r| {
            let end = dense_output.end[r] - dense_output.start[r];
            std::array::from_fn(|i| dense_output.change(r, 1.0 + fraction * self.rule.nodes[i]) - end)
        })
    }

    /// The change that is an error of 1: `scale`, or more if the tolerance is below the rounding of the variable.
    #[inline(always)]
    fn units(&self, y: &[f64; N]) -> [f64; N] {
        let rounding = ROUNDING / self.accuracy.tolerance;
        std::array::from_fn(|r| self.accuracy.scale[r] + rounding * y[r].abs())
    }

    /// Newton's method for the changes at the nodes; `None` if it fails.
    #[inline(always)]
    fn stages(&mut self, t: f64, y: &[f64; N], h: f64, mut change: [[f64; S]; N]) -> Option<NodeChanges<N, S>> {
        let unit = self.units(y);
        let enough = NEWTON_TOLERANCE_FRACTION * self.accuracy.tolerance;
        let mut factors: Option<Factors<N, S>> = None;
        let mut before = f64::NAN;
        for iterations in 1..=MAX_ITERATIONS {
            let at = self.system.linearise(&self.points(t, y, h, &change));
            let matrix = match factors {
                Some(factors) => factors,
                None => Factors::new(self.rule, h, &at)?,
            };
            let mut delta = at.residual;
            matrix.solve(&mut delta);
            let mut size = 0.0_f64;
            for r in 0..N {
                for i in 0..S {
                    change[r][i] += delta[r][i];
                    let part = (delta[r][i] / unit[r]).abs();
                    // Keeps NaN.
                    size = if part <= size { size } else { part };
                }
            }
            if !size.is_finite() {
                return None;
            }
            // NaN at first.
            let rate = size / before;
            let converged = rate < 1.0 && size * rate / (1.0 - rate) <= enough;
            let rounded = rate >= 0.5 && size <= self.accuracy.tolerance;
            if converged || rounded || size <= 0.01 * enough {
                return Some(NodeChanges { change, iterations });
            }
            if rate >= 2.0 {
                return None;
            }
            // The rate is at most of order 1 for variables in their scales; otherwise the second iteration detects it.
            let foreseen = if iterations == 1 { size } else { rate };
            factors = (foreseen <= MAX_CONVERGENCE_RATE).then_some(matrix);
            before = size;
        }
        None
    }

    /// The stages at `change` from `y`.
    #[inline(always)]
    fn points(&self, t: f64, y: &[f64; N], h: f64, change: &[[f64; S]; N]) -> Points<N, S> {
        let mut points = Points { t: [0.0; S], y: [[0.0; S]; N], slope: [[0.0; S]; N] };
        for i in 0..S {
            points.t[i] = t + h * self.rule.nodes[i];
        }
        for r in 0..N {
            for i in 0..S {
                points.y[r][i] = y[r] + change[r][i];
                let mut sum = 0.0;
                for j in 0..S {
                    sum += self.rule.differentiation[i][j] * change[r][j];
                }
                points.slope[r][i] = sum / h;
            }
        }
        points
    }

    /// Error estimate of a step: the polynomial meets the equations at the nodes, but not at the start. Its defect there is multiplied by
    /// `(mass/(gamma h) - J)^-1`, which damps stiff components (Hairer and Wanner, section IV.8).
    #[inline(always)]
    fn error(&mut self, h: f64, change: &[[f64; S]; N]) -> Option<f64> {
        // Approximately the inverse of the real eigenvalue of the inverse of the method's matrix.
        let gamma = 1.0 / (S + 1) as f64;
        let mut points = Points { t: [self.t.high], y: [[0.0]; N], slope: [[0.0]; N] };
        for r in 0..N {
            let mut sum = 0.0;
            for j in 0..S {
                sum += self.rule.powers[0][j] * change[r][j];
            }
            points.y[r][0] = self.y[r];
            points.slope[r][0] = sum / h;
        }
        let at = self.system.linearise(&points);
        let matrix: Square<N> = std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                let inertia = if r == c { at.mass[r][0] / (gamma * h) } else { 0.0 };
                inertia - at.jacobian[r][c][0]
            })
        });
        let inverse = inverse(matrix)?;
        let unit = self.units(&self.y);
        let mut size = 0.0_f64;
        for r in 0..N {
            let mut sum = 0.0;
            for c in 0..N {
                sum += inverse[r][c] * at.residual[c][0];
            }
            let part = (sum / unit[r]).abs();
            size = if part <= size { size } else { part };
        }
        size.is_finite().then_some(size)
    }
}

/// Changes at the nodes, and the number of iterations.
#[derive(Debug, Clone, Copy)]
struct NodeChanges<const N: usize, const S: usize> {
    change: [[f64; S]; N],
    iterations: u32,
}
