//! The ellipsoid method in the plane of the coefficients.
//!
//! Each ellipse contains the minimum, and each cut removes a part without it. If the centre is not admissible, the cut follows a violated
//! condition; otherwise it removes the half in which the work rises. The next ellipse is the smallest around the remaining part. A cut
//! depends on signs alone, so the method finds minima inside the set, on its border and at its corners, to all digits of the gradient.

use super::plane::{Coefficients, Plane, moved};
use crate::numerics::{MAX_PANELS, ROOT_OF_ROUNDING};
use crate::protocol::SolverStats;

/// An ellipse: the images of the unit circle under `half`, about `centre`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ellipse {
    pub centre: Coefficients,
    pub half: [[f64; 2]; 2],
}

/// The result of a round of cuts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum CutResult {
    /// Nothing is admissible.
    Empty,
    /// An admissible point close enough to the least work.
    Close(Coefficients),
    /// Not close after the greatest number of cuts.
    Exhausted,
}

/// The tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Until {
    /// The work changes by no more than this fraction in the ellipse.
    Work(f64),
    /// The ellipse is smaller than the rounding of its coefficients.
    Rounding,
    /// The centre is admissible.
    Admissible,
}

/// Relative error of a linear function of the place by rounding of the place. Chosen: a hundred roundings of a double-double number.
const PLACE_ROUNDING: f64 = 1e-30;

impl Ellipse {
    /// An ellipse that contains every admissible point. The coefficients of a cubic between -1 and 1 on `[0, 1]` are bounded by
    /// Chebyshev's: 18 and 48.
    pub fn around(plane: &Plane) -> Option<Ellipse> {
        let reach = std::f64::consts::SQRT_2 * plane.reach();
        (reach > 0.0).then(|| Ellipse { centre: plane.line(), half: [[18.0 * reach, 0.0], [0.0, 48.0 * reach]] })
    }

    /// The change of a linear function with the gradient `along` from the centre to the border, and the direction, on the unit circle, of its
    /// steepest rise.
    pub fn span(&self, along: [f64; 2]) -> (f64, [f64; 2]) {
        let [[h_11, h_12], [h_21, h_22]] = self.half;
        let pulled = [h_11 * along[0] + h_21 * along[1], h_12 * along[0] + h_22 * along[1]];
        let length = libm::hypot(pulled[0], pulled[1]);
        (length, [pulled[0] / length, pulled[1] / length])
    }

    /// Keeps the part beyond `depth`, a fraction of the distance from the centre to the border, in a direction on the unit circle.
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

    /// Whether the ellipse is within rounding.
    fn is_rounding(&self) -> bool {
        let [y_1, y_2] = self.centre.map(|y| y.high.abs());
        // The smaller coefficient may vanish.
        let sizes = [y_1 + ROOT_OF_ROUNDING * y_2, y_2 + ROOT_OF_ROUNDING * y_1];
        self.half.iter().zip(sizes).all(|(row, size)| libm::hypot(row[0], row[1]) <= 0.5 * f64::EPSILON * size)
    }

    /// Whether a linear function varies in the ellipse by no more than the rounding of a point, so that a cut along it has no effect. Where
    /// the work rises straight into the set, the ellipse becomes this thin while its length along the border is the square root of that.
    fn is_spent(&self, along: [f64; 2], span: f64) -> bool {
        let [y_1, y_2] = self.centre.map(|y| y.high.abs());
        span <= PLACE_ROUNDING * (along[0].abs() * y_1 + along[1].abs() * y_2)
    }

    /// Cuts until the centre is close to the minimum.
    pub fn close_in(&mut self, plane: &Plane, until: Until, stats: &mut SolverStats) -> CutResult {
        let mut found = None;
        for _ in 0..MAX_PANELS {
            // The condition that removes most of the ellipse.
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
                    return found.map_or(CutResult::Empty, CutResult::Close);
                }
                self.cut(direction, depth);
                continue;
            }
            found = Some(self.centre);
            if until == Until::Admissible {
                break;
            }
            let work_derivatives = plane.work_derivatives(self.centre, stats);
            let (length, direction) = self.span(work_derivatives.gradient.map(|g| -g));
            let close = match until {
                Until::Work(fraction) => length <= fraction * work_derivatives.work.abs(),
                Until::Rounding | Until::Admissible => self.is_rounding(),
            };
            if close || length == 0.0 || self.is_spent(work_derivatives.gradient, length) {
                return CutResult::Close(self.centre);
            }
            if length.is_nan() {
                return CutResult::Exhausted;
            }
            self.cut(direction, 0.0);
        }
        match found {
            Some(place) if until == Until::Admissible => CutResult::Close(place),
            Some(_) => CutResult::Exhausted,
            None => CutResult::Empty,
        }
    }
}
