//! Newton's method from a point near the minimum, inside the admissible set.

use super::plane::{Coefficients, Plane, moved};
use crate::numerics::{LONG_ROUNDING_RTOL, MAX_STEPS};
use crate::protocol::SolverStats;
use crate::protocol::cubic::WorkDerivatives;

/// Gain of the last step, relative to the work, times `a` where that is small: such a step changes velocities by a fraction of
/// 1e-11, and the next one would change them by the square of that. Derived: the gain is of second order.
const LAST_STEP_GAIN: f64 = 1e-22;

/// A step of Newton's method.
struct Newton {
    step: [f64; 2],
    /// Twice its gain.
    decrement: f64,
    /// Whether the Hessian is positive definite without a shift.
    sure: bool,
}

impl Newton {
    fn of(WorkDerivatives { gradient, hessian: [h_11, h_12, h_22], .. }: &WorkDerivatives) -> Newton {
        // In units in which both coordinates have the same curvature.
        let units = [h_11, h_22].map(|bend| 1.0 / bend.abs().max(f64::MIN_POSITIVE).sqrt());
        let [g_1, g_2] = [gradient[0] * units[0], gradient[1] * units[1]];
        let [h_11, h_12, h_22] = [h_11 * units[0] * units[0], h_12 * units[0] * units[1], h_22 * units[1] * units[1]];
        // The Hessian, shifted until it is positive definite.
        let trace = h_11 + h_22;
        let spread = ((h_11 - h_22) * (h_11 - h_22) + 4.0 * h_12 * h_12).sqrt();
        let (lowest, highest) = (0.5 * (trace - spread), 0.5 * (trace + spread));
        let shift = if lowest > 1e-9 * highest { 0.0 } else { 1e-3 * highest.abs() - lowest };
        let (h_11, h_22) = (h_11 + shift, h_22 + shift);
        let determinant = h_11 * h_22 - h_12 * h_12;
        let scaled = [-(h_22 * g_1 - h_12 * g_2) / determinant, -(h_11 * g_2 - h_12 * g_1) / determinant];
        let step = [scaled[0] * units[0], scaled[1] * units[1]];
        let decrement = -(g_1 * scaled[0] + g_2 * scaled[1]);
        Newton { step, decrement, sure: shift == 0.0 }
    }
}

/// Newton's method with halved steps. `None` where the descent runs into the border of the admissible set.
pub(super) fn descend(plane: &Plane, a: f64, start: Coefficients, stats: &mut SolverStats) -> Option<Coefficients> {
    let mut place = start;
    let mut here = plane.work_derivatives(place, stats);
    let mut before = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        let Newton { step, decrement, sure } = Newton::of(&here);
        if decrement.is_nan() {
            return None;
        }
        let work = here.work.abs();
        // The gain is within the rounding of the gradient.
        if sure && decrement <= LONG_ROUNDING_RTOL * a.min(1.0) * work && decrement >= 0.25 * before {
            return Some(place);
        }
        before = decrement;
        let last = sure && decrement <= LAST_STEP_GAIN * a.min(1.0) * work;
        let mut fraction = 1.0;
        (place, here) = loop {
            let trial = moved(place, step.map(|step| fraction * step));
            if plane.admits(trial) {
                if last {
                    return Some(trial);
                }
                let there = plane.work_derivatives(trial, stats);
                if there.work <= here.work - 1e-4 * fraction * decrement + 1e-14 * work {
                    break (trial, there);
                }
            }
            fraction *= 0.5;
            if fraction < 1e-6 {
                return None;
            }
        };
    }
    None
}
