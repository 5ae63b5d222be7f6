//! Detection of coinciding curves, which are drawn once.

/// Distance up to which two curves coincide, as a fraction of the panel. Chosen: the width of a line, 1.1 points in a panel 100 points high.
const MAX_DISTANCE: f64 = 0.01;

/// Greatest number of points of a curve that are compared. Chosen: closer points are not distinguishable in print.
const MAX_POINTS: usize = 400;

/// Whether two curves with values at equal positions coincide, in fractions of the panel.
pub fn at_places(first: &[(f64, f64)], second: &[(f64, f64)]) -> bool {
    let near = |(a, b): (&(f64, f64), &(f64, f64))| a.1.is_nan() && b.1.is_nan() || (a.1 - b.1).abs() <= MAX_DISTANCE;
    first.len() == second.len() && first.iter().zip(second).all(near)
}

/// Whether two curves with any points coincide, in fractions of the panel: each point of one is near the other.
pub fn anywhere(first: &[(f64, f64)], second: &[(f64, f64)]) -> bool {
    is_near(first, second) && is_near(second, first)
}

fn is_near(points: &[(f64, f64)], line: &[(f64, f64)]) -> bool {
    let every = points.len().div_ceil(MAX_POINTS).max(1);
    let mut some = points.iter().step_by(every).chain(points.last());
    some.all(|point| line.windows(2).any(|pair| distance(*point, pair[0], pair[1]) <= MAX_DISTANCE))
}

/// The distance of a point from the segment between two others; NaN if a coordinate is NaN.
fn distance((x, y): (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (along, up) = (to.0 - from.0, to.1 - from.1);
    let length = along * along + up * up;
    let fraction =
        if length > 0.0 { (((x - from.0) * along + (y - from.1) * up) / length).clamp(0.0, 1.0) } else { 0.0 };
    (x - from.0 - fraction * along).hypot(y - from.1 - fraction * up)
}

/// For each of `count` curves, the first curve with which it coincides; itself if there is none before.
pub fn leaders(count: usize, mut coincide: impl FnMut(usize, usize) -> bool) -> Vec<usize> {
    let mut leaders: Vec<usize> = Vec::with_capacity(count);
    for curve in 0..count {
        let before = (0..curve).find(|&before| leaders[before] == before && coincide(before, curve));
        leaders.push(before.unwrap_or(curve));
    }
    leaders
}

#[cfg(test)]
mod tests {
    //! Curves with the same and with other points.

    use super::*;

    #[test]
    fn curves_coincide_whatever_their_points_are() {
        let jump = [(0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (1.0, 1.0)];
        let finer: Vec<(f64, f64)> = (0..=100).map(|i| f64::from(i) / 100.0).map(|x| (x, 0.0)).collect();
        let finer: Vec<(f64, f64)> = finer.into_iter().map(|(x, _)| (x, if x <= 0.5 { 0.0 } else { 1.0 })).collect();
        let steep = [(0.0, 0.001), (0.499, 0.0), (0.501, 1.0), (1.0, 0.999)];
        assert!(anywhere(&jump, &steep));
        assert!(!anywhere(&jump, &[(0.0, 0.0), (1.0, 1.0)]));
        // A part of a curve is not the curve.
        assert!(!anywhere(&jump, &jump[..2]));
        assert!(at_places(&finer, &finer) && !at_places(&finer, &finer[1..]));
        assert!(at_places(&[(0.0, f64::NAN)], &[(0.0, f64::NAN)]) && !at_places(&[(0.0, f64::NAN)], &[(0.0, 0.0)]));
    }

    #[test]
    fn a_curve_follows_the_first_that_it_coincides_with() {
        assert_eq!(leaders(4, |a, b| a % 2 == b % 2), [0, 1, 0, 1]);
    }
}
