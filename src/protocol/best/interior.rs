//! Inside the admissible set: the ellipsoid method to come close, and Newton's method from there.

use super::Place;
use crate::protocol::Effort;
use crate::protocol::cubic::Landscape;

/// Cuts of the ellipse, each by about a quarter of its area: from the largest set to rounding.
const MOST_CUTS: u32 = 500;
/// The ellipse is small enough where the work can change by no more than this share in it: Newton's method converges
/// from there.
const CLOSE: f64 = 1e-5;
/// Newton steps; each is halved as often as needed.
const MOST_STEPS: u32 = 100;

/// A place close to that of least work, by the ellipsoid method; `None` if nothing is admissible.
///
/// A cut through the centre of an ellipse that holds the place sought leaves half of it: where the centre is not
/// admissible, the half in which the violated polynomial rises, else the half in which the work falls. Since `theta' <=
/// 1`, theta differs from the straight line between its ends by at most `D = t_f - (theta_1 - theta_0)`, and the
/// coefficients of a cubic between `-D` and `D` on `[0, 1]` are bounded by Chebyshev's: 18 and 48 times `D`.
pub(super) fn approach(landscape: &Landscape, least_velocity: f64, effort: &mut Effort) -> Option<Place> {
    let [_, _, rise, t_f] = landscape.ends();
    let most = t_f - rise;
    let mut centre = [rise, 0.0];
    // The ellipse (y - centre)^T shape^-1 (y - centre) <= 1.
    let mut shape = [[2.0 * (18.0 * most) * (18.0 * most), 0.0], [0.0, 2.0 * (48.0 * most) * (48.0 * most)]];
    let mut best: Option<(f64, Place)> = None;
    for _ in 0..MOST_CUTS {
        let (keep, work) = match violated(landscape, least_velocity, centre) {
            Some((x, true)) => (rising(x, None), None),
            Some((x, false)) => (rising(x, Some(least_velocity * t_f)), None),
            None => {
                let moments = landscape.moments(centre[0], centre[1], effort);
                if best.is_none_or(|(least, _)| moments.work < least) {
                    best = Some((moments.work, Place { a_2: centre[0], a_3: centre[1] }));
                }
                ([-moments.gradient[0], -moments.gradient[1]], Some(moments.work))
            }
        };
        let along = [shape[0][0] * keep[0] + shape[0][1] * keep[1], shape[1][0] * keep[0] + shape[1][1] * keep[1]];
        let length = (keep[0] * along[0] + keep[1] * along[1]).sqrt();
        if length.is_nan() || length <= 1e-300 || work.is_some_and(|work| length < CLOSE * work.abs()) {
            break;
        }
        let step = [along[0] / length, along[1] / length];
        for i in 0..2 {
            centre[i] += step[i] / 3.0;
            for j in 0..2 {
                shape[i][j] = 4.0 / 3.0 * (shape[i][j] - 2.0 / 3.0 * step[i] * step[j]);
            }
        }
    }
    best.map(|(_, place)| place)
}

/// The direction in the plane in which theta(x) rises, or `n - scale theta` at `x`.
fn rising(x: f64, scale: Option<f64>) -> [f64; 2] {
    let d_theta = [x * (1.0 - x) * (1.0 + x), x * x * (1.0 - x)];
    let d_n = [3.0 * x * x - 1.0, x * (3.0 * x - 2.0)];
    match scale {
        None => d_theta,
        Some(scale) => [d_n[0] - scale * d_theta[0], d_n[1] - scale * d_theta[1]],
    }
}

/// The direction from a place on the border into the admissible set: that in which the velocity rises where it is
/// least.
pub(super) fn inwards(landscape: &Landscape, least_velocity: f64, place: Place) -> [f64; 2] {
    let scale = least_velocity * landscape.ends()[3];
    let surplus = landscape.path(place.a_2, place.a_3).surplus(scale);
    let places = [0.0, 1.0, surplus.minimum()];
    let x = places.into_iter().fold(0.0, |least, x| if surplus.at(x) < surplus.at(least) { x } else { least });
    rising(x, Some(scale))
}

/// Where an inadmissible shortcut fails worst: the place `x`, and whether it is theta that is not positive. `None` if
/// it is admissible.
fn violated(landscape: &Landscape, least_velocity: f64, [a_2, a_3]: [f64; 2]) -> Option<(f64, bool)> {
    let t_f = landscape.ends()[3];
    let path = landscape.path(a_2, a_3);
    for (polynomial, is_theta) in [(*path.theta(), true), (path.surplus(least_velocity * t_f), false)] {
        let places = [0.0, 1.0, polynomial.minimum()];
        let worst = places.into_iter().min_by(|&x, &y| polynomial.at(x).total_cmp(&polynomial.at(y)))?;
        let value = polynomial.at(worst);
        if value.is_nan() || value <= 0.0 {
            return Some((worst, is_theta));
        }
    }
    None
}

/// Newton's method with halved steps. `None` where the descent runs into the border of the admissible set.
pub(super) fn descend(landscape: &Landscape, least_velocity: f64, start: Place, effort: &mut Effort) -> Option<Place> {
    let mut place = start;
    let mut here = landscape.moments(place.a_2, place.a_3, effort);
    for _ in 0..MOST_STEPS {
        let [g_2, g_3] = here.gradient;
        let [h_22, h_23, h_33] = here.hessian;
        // The Hessian, shifted until it is positive definite.
        let trace = h_22 + h_33;
        let spread = ((h_22 - h_33) * (h_22 - h_33) + 4.0 * h_23 * h_23).sqrt();
        let lowest = 0.5 * (trace - spread);
        let highest = 0.5 * (trace + spread);
        let shift = if lowest > 1e-9 * highest { 0.0 } else { 1e-3 * highest.abs() - lowest };
        let (h_22, h_33) = (h_22 + shift, h_33 + shift);
        let determinant = h_22 * h_33 - h_23 * h_23;
        let step = [-(h_33 * g_2 - h_23 * g_3) / determinant, -(h_22 * g_3 - h_23 * g_2) / determinant];
        let decrement = -(g_2 * step[0] + g_3 * step[1]);
        if decrement.is_nan() {
            return None;
        }
        // Twice the work still to be gained: beyond rounding there is nothing more to find.
        let last = shift == 0.0 && decrement <= 1e-20 * here.work.abs();
        let mut share = 1.0;
        let next = loop {
            let trial = Place { a_2: place.a_2 + share * step[0], a_3: place.a_3 + share * step[1] };
            if violated(landscape, least_velocity, [trial.a_2, trial.a_3]).is_none() {
                let there = landscape.moments(trial.a_2, trial.a_3, effort);
                if last || there.work <= here.work - 1e-4 * share * decrement + 1e-14 * here.work.abs() {
                    break Some((trial, there));
                }
            }
            share *= 0.5;
            if share < 1e-6 {
                break None;
            }
        };
        let (trial, there) = next?;
        (place, here) = (trial, there);
        if last {
            return Some(place);
        }
    }
    None
}
