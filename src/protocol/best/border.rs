//! The border of the admissible set: shortcuts whose velocity touches its least value `m`.
//!
//! The border consists of a curve, on which `g = n - m t_f theta` has a double zero at some `x_c` in `[0, 1]` (two
//! linear equations for the two coefficients), and of two segments, on which `v = m` at an end. Along each piece the
//! work is a function of one number.

use super::Place;
use crate::protocol::Effort;
use crate::protocol::cubic::Landscape;

/// Samples of a piece before its least work is refined.
const SAMPLES: u32 = 48;
/// Halvings that find the ends of a segment.
const HALVINGS: u32 = 200;

/// One piece of the border, parametrised by one number.
#[derive(Debug, Clone, Copy)]
enum Piece {
    /// Double zero at the parameter.
    Touch,
    /// `v(0+) = m`; the parameter is `a_3`.
    Start,
    /// `v(t_f-) = m`; the parameter is `a_2`.
    End,
}

/// The border of one landscape.
struct Border<'a> {
    landscape: &'a Landscape,
    /// `m t_f`.
    scale: f64,
    /// `theta_0`, `theta_1`, `theta_1 - theta_0`, `t_f`.
    ends: [f64; 4],
}

/// The place of least work on the border.
pub(super) fn least(landscape: &Landscape, least_velocity: f64, effort: &mut Effort) -> Option<Place> {
    let ends = landscape.ends();
    let border = Border { landscape, scale: least_velocity * ends[3], ends };
    let mut best: Option<(f64, Place)> = None;
    for piece in [Piece::Touch, Piece::Start, Piece::End] {
        if let Some((low, high)) = border.range(piece)
            && let Some((work, place)) = border.least_on(piece, low, high, effort)
            && best.is_none_or(|(least, _)| work < least)
        {
            best = Some((work, place));
        }
    }
    best.map(|(_, place)| place)
}

impl Border<'_> {
    /// The place at a parameter, and the direction in which it moves with it.
    fn place(&self, piece: Piece, parameter: f64) -> (Place, [f64; 2]) {
        let [theta_0, theta_1, rise, t_f] = self.ends;
        let scale = self.scale;
        match piece {
            Piece::Touch => {
                let x = parameter;
                // g = fixed + g_2 a_2 + g_3 a_3 and its derivatives in x.
                let base = |x: f64| {
                    [
                        t_f - 3.0 * rise * x * x - scale * (theta_0 + rise * x * x * x),
                        -6.0 * rise * x - 3.0 * scale * rise * x * x,
                        -6.0 * rise - 6.0 * scale * rise * x,
                    ]
                };
                let by_a_2 = [
                    3.0 * x * x - 1.0 - scale * (x - x * x * x),
                    6.0 * x - scale * (1.0 - 3.0 * x * x),
                    6.0 + 6.0 * scale * x,
                ];
                let by_a_3 = [
                    3.0 * x * x - 2.0 * x - scale * (x * x - x * x * x),
                    6.0 * x - 2.0 - scale * (2.0 * x - 3.0 * x * x),
                    6.0 - scale * (2.0 - 6.0 * x),
                ];
                let fixed = base(x);
                let solve = |r: [f64; 2]| {
                    let determinant = by_a_2[0] * by_a_3[1] - by_a_3[0] * by_a_2[1];
                    [
                        (r[0] * by_a_3[1] - by_a_3[0] * r[1]) / determinant,
                        (by_a_2[0] * r[1] - r[0] * by_a_2[1]) / determinant,
                    ]
                };
                let [a_2, a_3] = solve([-fixed[0], -fixed[1]]);
                let curvature = fixed[2] + by_a_2[2] * a_2 + by_a_3[2] * a_3;
                (Place { a_2, a_3 }, solve([0.0, -curvature]))
            }
            Piece::Start => (Place { a_2: t_f - scale * theta_0, a_3: parameter }, [0.0, 1.0]),
            Piece::End => {
                let a_3 = 3.0 * rise - t_f + scale * theta_1 - 2.0 * parameter;
                (Place { a_2: parameter, a_3 }, [1.0, -2.0])
            }
        }
    }

    /// Whether a place is admissible: `g` at least 0 within rounding, theta positive, and friction too (else the work
    /// falls without limit as theta does).
    fn admissible(&self, place: Place) -> bool {
        let path = self.landscape.path(place.a_2, place.a_3);
        let (g, g_doubt) = path.surplus(self.scale).least();
        let (theta, theta_doubt) = path.theta().least();
        g >= -4.0 * g_doubt && theta > theta_doubt && self.landscape.pulls(theta)
    }

    /// The range of the parameter that is searched; on a segment the admissible part, which begins at the double zero
    /// in its end.
    fn range(&self, piece: Piece) -> Option<(f64, f64)> {
        let [_, _, rise, t_f] = self.ends;
        let (corner, inwards) = match piece {
            Piece::Touch => return Some((0.0, 1.0)),
            // g_x(0) >= 0 for a_3 below the corner; g_x(1) <= 0 for a_2 above it.
            Piece::Start => {
                let (place, _) = self.place(Piece::Touch, 0.0);
                (place.a_3, -1.0)
            }
            Piece::End => {
                let (place, _) = self.place(Piece::Touch, 1.0);
                (place.a_2, 1.0)
            }
        };
        let inside = |s: f64| self.admissible(self.place(piece, corner + inwards * s).0);
        // The admissible part is an interval in s >= 0 (the set is convex): look for a point of it, then for its ends.
        let unit = t_f.max(rise.abs());
        let found = (0..200).map(|i| 1e-12 * unit * libm::pow(1.3, f64::from(i))).find(|&s| inside(s))?;
        let edge = |mut within: f64, mut without: f64| {
            for _ in 0..HALVINGS {
                let middle = 0.5 * (within + without);
                if middle == within || middle == without {
                    break;
                }
                if inside(middle) {
                    within = middle;
                } else {
                    without = middle;
                }
            }
            within
        };
        let far = edge(found, 100.0 * unit);
        let near = if inside(0.0) { 0.0 } else { edge(found, 0.0) };
        let (one, other) = (corner + inwards * near, corner + inwards * far);
        Some((one.min(other), one.max(other)))
    }

    /// Least work on a piece: the best of many samples, refined where the derivative changes sign beside it.
    fn least_on(&self, piece: Piece, low: f64, high: f64, effort: &mut Effort) -> Option<(f64, Place)> {
        let at = |i: u32| low + (high - low) * f64::from(i) / f64::from(SAMPLES);
        let mut best: Option<(f64, u32)> = None;
        for i in 0..=SAMPLES {
            if let Some((work, _)) = self.work(piece, at(i), effort)
                && best.is_none_or(|(least, _)| work < least)
            {
                best = Some((work, i));
            }
        }
        let (work, i) = best?;
        let (mut from, mut to) = (at(i.saturating_sub(1)), at((i + 1).min(SAMPLES)));
        let mut least = (work, self.place(piece, at(i)).0);
        // Bisection with secants on the derivative; inadmissible places count as uphill.
        let middle = at(i);
        let slope = |parameter: f64, effort: &mut Effort| self.work(piece, parameter, effort);
        match slope(middle, effort) {
            Some((_, slope)) if slope > 0.0 => to = middle,
            _ => from = middle,
        }
        for _ in 0..100 {
            let parameter = 0.5 * (from + to);
            if parameter <= from || parameter >= to {
                break;
            }
            match slope(parameter, effort) {
                Some((work, slope)) => {
                    if work < least.0 {
                        least = (work, self.place(piece, parameter).0);
                    }
                    if slope > 0.0 {
                        to = parameter;
                    } else {
                        from = parameter;
                    }
                    if slope == 0.0 {
                        break;
                    }
                }
                None if to > middle => to = parameter,
                None => from = parameter,
            }
        }
        // The last parameter has the smallest slope; its work differs from the least seen by rounding only.
        let last = self.place(piece, 0.5 * (from + to)).0;
        if self.admissible(last) {
            let work = self.landscape.moments(last.a_2, last.a_3, effort).work;
            if work <= least.0 + 1e-13 * least.0.abs() {
                least = (work, last);
            }
        }
        Some(least)
    }

    /// Work and its derivative along a piece; `None` where it is not admissible.
    fn work(&self, piece: Piece, parameter: f64, effort: &mut Effort) -> Option<(f64, f64)> {
        let (place, direction) = self.place(piece, parameter);
        if !self.admissible(place) {
            return None;
        }
        let moments = self.landscape.moments(place.a_2, place.a_3, effort);
        let slope = moments.gradient[0] * direction[0] + moments.gradient[1] * direction[1];
        (moments.work.is_finite() && slope.is_finite()).then_some((moments.work, slope))
    }
}
