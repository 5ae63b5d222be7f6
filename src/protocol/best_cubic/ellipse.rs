//! The ellipsoid method in the plane of the coefficients.
//!
//! A cut through an ellipse that holds the place sought leaves less of it: where the centre is not admissible, the part
//! where the violated condition may hold, else the half in which the work falls. The smallest ellipse about what is left
//! is the next. All that counts is on which side of a cut the place is, so the method finds a minimum inside the set, on
//! its border and in its corners alike, to as many digits as the gradient has.

use super::plane::{Coefficients, Plane, moved};
use crate::protocol::SolverStats;

/// An ellipse: the images of the unit circle under `half`, about `centre`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ellipse {
    pub centre: Coefficients,
    half: [[f64; 2]; 2],
}

/// The result of a round of cuts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Outcome {
    /// Nothing is admissible.
    Empty,
    /// Close enough to the least work: an admissible place.
    Close(Coefficients),
    /// Not close after as many cuts as are allowed.
    Exhausted,
}

/// The tolerance.
#[derive(Debug, Clone, Copy)]
pub(super) enum Until {
    /// The work changes by no more than this fraction in the ellipse.
    Work(f64),
    /// The ellipse is smaller than what is left of its coefficients after rounding.
    Rounding,
}

/// Cuts, most of which leave less than three quarters of the area.
const MOST_CUTS: u32 = 1500;
/// Relative rounding error of a coefficient.
const ROUNDING: f64 = 1e-16;
/// Relative error of a linear function of the place by rounding of the place.
const PLACE_ROUNDING: f64 = 1e-30;
/// Least ratio of the smaller coefficient, which may vanish, to the larger one.
const MIN_COEFFICIENT_RATIO: f64 = 1e-8;

impl Ellipse {
    /// An ellipse that holds every admissible place. The coefficients of a cubic between -1 and 1 on `[0, 1]` are bounded by
    /// Chebyshev's: 18 and 48.
    pub fn around(plane: &Plane) -> Option<Ellipse> {
        let reach = std::f64::consts::SQRT_2 * plane.reach();
        (reach > 0.0).then(|| Ellipse { centre: plane.line(), half: [[18.0 * reach, 0.0], [0.0, 48.0 * reach]] })
    }

    /// How much a linear function with the gradient `along` varies from the centre to the border, and the direction, on the
    /// unit circle, in which it rises most.
    pub fn span(&self, along: [f64; 2]) -> (f64, [f64; 2]) {
        let [[h_11, h_12], [h_21, h_22]] = self.half;
        let pulled = [h_11 * along[0] + h_21 * along[1], h_12 * along[0] + h_22 * along[1]];
        let length = libm::hypot(pulled[0], pulled[1]);
        (length, [pulled[0] / length, pulled[1] / length])
    }

    /// Keeps what lies beyond `depth` (of the distance from the centre to the border, less than 1) in a direction on the
    /// unit circle.
    fn cut(&mut self, direction: [f64; 2], depth: f64) {
        let step = (1.0 + 2.0 * depth) / 3.0;
        let wide = (4.0 / 3.0 * (1.0 - depth * depth)).sqrt();
        let narrow = 1.0 - ((1.0 - depth) / (3.0 * (1.0 + depth))).sqrt();
        let image = self.half.map(|row| row[0] * direction[0] + row[1] * direction[1]);
        self.centre = moved(self.centre, image.map(|image| step * image));
        for (row, image) in self.half.iter_mut().zip(image) {
            for (h, direction) in row.iter_mut().zip(direction) {
                *h = wide * (*h - narrow * image * direction);
            }
        }
    }

    /// Whether it is no more than rounding.
    fn is_rounding(&self) -> bool {
        let [y_1, y_2] = self.centre.map(|y| y.high.abs());
        let sizes = [y_1 + MIN_COEFFICIENT_RATIO * y_2, y_2 + MIN_COEFFICIENT_RATIO * y_1];
        self.half.iter().zip(sizes).all(|(row, size)| libm::hypot(row[0], row[1]) <= ROUNDING * size)
    }

    /// Whether a linear function varies by no more in the ellipse than by rounding of the place: a cut along it determines
    /// nothing any more. Where the work rises straight into the set, the ellipse gets so thin across before it is short
    /// along the border: as short as the root of that.
    fn is_spent(&self, along: [f64; 2], span: f64) -> bool {
        let [y_1, y_2] = self.centre.map(|y| y.high.abs());
        span <= PLACE_ROUNDING * (along[0].abs() * y_1 + along[1].abs() * y_2)
    }

    /// Cuts until the place of least work is close.
    pub fn close_in(&mut self, plane: &Plane, until: Until, stats: &mut SolverStats) -> Outcome {
        let mut found = None;
        for _ in 0..MOST_CUTS {
            // The condition that takes most of the ellipse away.
            let mut worst: Option<(f64, [f64; 2])> = None;
            let mut spent = false;
            for condition in plane.conditions(self.centre).iter().filter(|condition| !condition.holds()) {
                let (length, direction) = self.span(condition.along);
                let depth = -condition.value / length;
                spent |= self.is_spent(condition.along, length);
                if worst.is_none_or(|(deepest, _)| depth > deepest) {
                    worst = Some((depth, direction));
                }
            }
            if let Some((depth, direction)) = worst {
                if depth.is_nan() || depth >= 1.0 || (found.is_some() && (spent || self.is_rounding())) {
                    return found.map_or(Outcome::Empty, Outcome::Close);
                }
                self.cut(direction, depth);
                continue;
            }
            found = Some(self.centre);
            let work_derivatives = plane.work_derivatives(self.centre, stats);
            let (length, direction) = self.span(work_derivatives.gradient.map(|g| -g));
            let close = match until {
                Until::Work(fraction) => length <= fraction * work_derivatives.work.abs(),
                Until::Rounding => self.is_rounding(),
            };
            if close || length == 0.0 || self.is_spent(work_derivatives.gradient, length) {
                return Outcome::Close(self.centre);
            }
            if length.is_nan() {
                return Outcome::Exhausted;
            }
            self.cut(direction, 0.0);
        }
        if found.is_none() { Outcome::Empty } else { Outcome::Exhausted }
    }
}
