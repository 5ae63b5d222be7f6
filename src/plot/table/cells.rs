//! The cells of an axis in a map: one for each value if these are few, else one for several consecutive values.

use super::filtered::Values;
use crate::plot::scale::{Scale, is_logarithmic};

/// The cells of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisCells {
    /// Their middle values, ascending: the values themselves if each has a cell.
    pub middles: Vec<f64>,
    /// The scale from the edge of the first cell to the edge of the last.
    pub scale: Scale,
    /// Whether the cells are equally wide.
    pub even: bool,
    /// Whether each value has a cell of its own.
    pub exact: bool,
    /// The least value of each cell.
    firsts: Vec<f64>,
}

impl AxisCells {
    /// At most `most` cells for the values of an axis, which has at least one.
    pub fn new(axis: &Values, most: usize) -> AxisCells {
        let values = &axis.values;
        let (low, high) = (values[0], values[values.len() - 1]);
        let span = Scale { low, high, log: is_logarithmic(values) };
        let last = values.len() - 1;
        if last == 0 {
            let scale = span.with_room(0.0);
            return AxisCells { middles: values.clone(), scale, even: true, exact: true, firsts: values.clone() };
        }
        // Cells with equal numbers of values, so that none is empty.
        let together = values.len().div_ceil(most);
        let firsts: Vec<f64> = values.chunks(together).map(|chunk| chunk[0]).collect();
        let middles: Vec<f64> = values.chunks(together).map(|chunk| chunk[chunk.len() / 2]).collect();
        let exact = together == 1;
        let even = values
            .iter()
            .enumerate()
            .all(|(place, &value)| (span.fraction(value) * last as f64 - place as f64).abs() < 0.02);
        let at = |place: f64| span.value(place / last as f64);
        let [low, high] = if even {
            // Half a step beyond the first value and the last cell, which may have fewer values.
            [at(-0.5), at((firsts.len() * together) as f64 - 0.5)]
        } else {
            // Half a cell beyond the first and the last centre.
            let fraction = |cell: usize| span.fraction(middles[cell]);
            let end = middles.len() - 1;
            [(0, 1), (end, end - 1)].map(|(edge, inner)| span.value(1.5 * fraction(edge) - 0.5 * fraction(inner)))
        };
        AxisCells { middles, scale: Scale { low, high, ..span }, even, exact, firsts }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.middles.len()
    }

    /// The scale from the first centre to the last.
    pub fn ends(&self) -> Scale {
        Scale { low: self.middles[0], high: self.middles[self.len() - 1], log: self.scale.log }
    }

    /// The cell of a value.
    pub fn place(&self, value: f64) -> Option<usize> {
        if !value.is_finite() {
            return None;
        }
        if self.exact {
            return self.middles.binary_search_by(|middle| middle.total_cmp(&(value + 0.0))).ok();
        }
        self.firsts.partition_point(|first| first.total_cmp(&(value + 0.0)).is_le()).checked_sub(1)
    }

    /// The value at a fraction between the centres of two cells, counted in cells.
    pub fn value_at(&self, place: f64) -> f64 {
        let before = (place as usize).min(self.len() - 2);
        let [low, high] = [before, before + 1].map(|cell| self.scale.fraction(self.middles[cell]));
        self.scale.value(low + (place - before as f64) * (high - low))
    }

    /// For each of `count` equal intervals of the scale, the cell with the nearest centre.
    pub fn nearest(&self, count: usize) -> Vec<usize> {
        let centres: Vec<f64> = self.middles.iter().map(|&middle| self.scale.fraction(middle)).collect();
        let borders: Vec<f64> = centres.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        let middle = |interval: usize| (interval as f64 + 0.5) / count as f64;
        (0..count).map(|interval| borders.partition_point(|&border| border < middle(interval))).collect()
    }
}

#[cfg(test)]
mod tests {
    //! Every value has its cell.

    use super::*;

    fn axis(values: Vec<f64>) -> Values {
        Values { name: "t_f".to_owned(), unit: String::new(), values, words: Vec::new(), many: false, infinite: false }
    }

    #[test]
    fn few_values_have_cells_of_their_own() {
        let cells = AxisCells::new(&axis(vec![1.0, 10.0, 100.0, 1000.0]), 8);
        assert!(cells.exact && cells.even && cells.scale.log);
        assert!((cells.scale.low - 0.1f64.sqrt()).abs() < 1e-12);
        assert_eq!([1.0, 100.0, 50.0].map(|value| cells.place(value)), [Some(0), Some(2), None]);
        assert_eq!(cells.nearest(8), [0, 0, 1, 1, 2, 2, 3, 3]);
    }

    #[test]
    fn several_values_fall_into_a_cell() {
        let cells = AxisCells::new(&axis((0..1000).map(f64::from).collect()), 10);
        assert!(!cells.exact && cells.len() == 10);
        let places: Vec<usize> = (0..1000).filter_map(|value| cells.place(f64::from(value))).collect();
        assert_eq!(places.len(), 1000);
        assert_eq!((places[0], places[999]), (0, 9));
    }

    #[test]
    fn no_cell_is_empty() {
        for count in [401, 799, 1000] {
            for axis in [
                axis((0..count).map(|i| -0.5 + f64::from(i) * 0.0025).collect()),
                axis((0..count).map(|i| f64::from(i).powi(2)).collect()),
            ] {
                let cells = AxisCells::new(&axis, 400);
                let mut places: Vec<usize> = axis.values.iter().filter_map(|&value| cells.place(value)).collect();
                assert_eq!(places.len(), axis.values.len());
                places.dedup();
                assert_eq!(places, (0..cells.len()).collect::<Vec<_>>());
                assert!(cells.middles.windows(2).all(|pair| pair[0] < pair[1]));
                assert!(cells.scale.low < axis.values[0] && cells.scale.high > axis.values[axis.values.len() - 1]);
            }
        }
    }
}
