//! Contour lines of a field over a grid (marching squares).

use std::collections::BTreeMap;

/// An edge of the grid: its first corner, and whether it leads to the next row.
type Edge = (usize, bool);

/// The edges to which line segments lead from each edge.
type Segments = BTreeMap<Edge, Vec<Edge>>;

/// The lines where a field is 0, in units of columns and rows. The field has at least two rows of `columns` values; NaN stands for a missing value.
/// Cells with a missing corner have no lines.
pub fn contour(values: &[f64], columns: usize) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = Segments::new();
    for corner in (0..values.len() - columns).filter(|corner| corner % columns < columns - 1) {
        for (from, to) in crossings(corner, columns, values) {
            pieces.entry(from).or_default().push(to);
            pieces.entry(to).or_default().push(from);
        }
    }
    let place = |(corner, upwards): Edge| {
        let other = if upwards { corner + columns } else { corner + 1 };
        let fraction = values[corner] / (values[corner] - values[other]);
        let (x, y) = ((corner % columns) as f64, (corner / columns) as f64);
        if upwards { (x, y + fraction) } else { (x + fraction, y) }
    };
    joined(pieces).into_iter().map(|line| line.into_iter().map(place).collect()).collect()
}

/// The line segments through the cell whose first corner is `corner`, from edge to edge.
fn crossings(corner: usize, columns: usize, values: &[f64]) -> Vec<(Edge, Edge)> {
    let heights = [corner, corner + 1, corner + columns + 1, corner + columns].map(|corner| values[corner]);
    if heights.iter().any(|height| height.is_nan()) {
        return Vec::new();
    }
    let above = heights.map(|height| height >= 0.0);
    // Edges of the cell, in the order of its corners.
    let edges: [Edge; 4] = [(corner, false), (corner + 1, true), (corner + columns, false), (corner, true)];
    let crossed: Vec<Edge> =
        (0..4).filter(|&side| above[side] != above[(side + 1) % 4]).map(|side| edges[side]).collect();
    match crossed[..] {
        [a, b] => vec![(a, b)],
        // A saddle: the mean determines which corners belong together.
        [a, b, c, d] if (heights.iter().sum::<f64>() >= 0.0) == above[0] => vec![(a, b), (c, d)],
        [a, b, c, d] => vec![(d, a), (b, c)],
        _ => Vec::new(),
    }
}

/// Joins segments to lines: first open lines, from edges with one segment, then closed lines.
fn joined(mut pieces: Segments) -> Vec<Vec<Edge>> {
    let starts: Vec<Edge> = pieces.iter().filter(|(_, to)| to.len() == 1).map(|(edge, _)| *edge).collect();
    let all: Vec<Edge> = pieces.keys().copied().collect();
    let mut lines = Vec::new();
    for start in starts.into_iter().chain(all) {
        let (mut line, mut here) = (vec![start], start);
        while let Some(to) = pieces.get_mut(&here).and_then(Vec::pop) {
            if let Some(back) = pieces.get_mut(&to)
                && let Some(entry) = back.iter().position(|edge| *edge == here)
            {
                back.swap_remove(entry);
            }
            line.push(to);
            here = to;
        }
        if line.len() > 1 {
            lines.push(line);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    //! Contours of known shape.

    use super::*;

    fn field(size: usize, value: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        (0..size * size).map(|i| value((i % size) as f64, (i / size) as f64)).collect()
    }

    #[test]
    fn a_plane_has_one_straight_contour() {
        let lines = contour(&field(11, |x, y| x + y - 7.5), 11);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].iter().all(|(x, y)| (x + y - 7.5).abs() < 1e-12));
    }

    #[test]
    fn a_hill_has_a_ring() {
        let lines = contour(&field(21, |x, y| (x - 10.0).powi(2) + (y - 10.0).powi(2) - 30.0), 21);
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].first(), lines[0].last());
        assert!(lines[0].iter().all(|(x, y)| ((x - 10.0).hypot(y - 10.0) - 30f64.sqrt()).abs() < 0.05));
    }

    #[test]
    fn a_gap_in_the_data_cuts_the_line() {
        let lines = contour(&field(11, |x, y| if x == 5.0 { f64::NAN } else { y - 4.5 }), 11);
        assert_eq!(lines.len(), 2);
    }
}
