//! A grid: the product of independent factors, whose rows are decoded from one 64-bit number.
//!
//! A factor holds one axis, or several that advance together (the columns of `points`). The last factor varies fastest. Nothing here grows
//! with the number of rows.

use std::collections::HashMap;
use std::ops::Range;

use super::axis::{Axis, Values};
use super::quantity::{Point, Quantity, Scale};

/// Axes that advance together.
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    /// The axes, all of the same length, at least one.
    pub axes: Vec<Axis>,
}

impl Factor {
    /// Number of steps.
    pub fn len(&self) -> u64 {
        self.axes.first().map_or(0, |axis| axis.values.len())
    }

    /// Whether the factor has no step at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many different tuples of `quantities` the factor takes, and which one each step has, if not one a step.
    ///
    /// Ranges are distinct by construction, so only what is stored value by value is compared.
    fn classes(&self, quantities: &[Quantity]) -> (u64, Option<Vec<u32>>) {
        let used: Vec<&Axis> = self.axes.iter().filter(|axis| quantities.contains(&axis.quantity)).collect();
        if used.is_empty() || !used.iter().all(|axis| matches!(axis.values, Values::List(_))) {
            return (self.len(), None);
        }
        let mut seen: HashMap<Vec<u64>, u32> = HashMap::new();
        let mut class_of = Vec::with_capacity(self.len() as usize);
        for step in 0..self.len() {
            let tuple: Vec<u64> = used.iter().map(|axis| axis.values.at(step).to_bits()).collect();
            let next = seen.len() as u32;
            class_of.push(*seen.entry(tuple).or_insert(next));
        }
        let distinct = seen.len() as u64;
        if distinct == self.len() { (distinct, None) } else { (distinct, Some(class_of)) }
    }
}

/// A grid of points: the Cartesian product of its factors.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// The factors, slowest first.
    pub factors: Vec<Factor>,
}

impl Grid {
    /// The axis of `quantity`, if the grid holds it.
    pub fn axis(&self, quantity: Quantity) -> Option<&Axis> {
        self.factors.iter().flat_map(|factor| &factor.axes).find(|axis| axis.quantity == quantity)
    }

    /// The unit in which the grid gives `quantity`.
    pub fn scale(&self, quantity: Quantity) -> Option<Scale> {
        self.axis(quantity).map(|axis| axis.scale)
    }

    /// The grid of those factors alone that hold one of `quantities`; `None` if its rows cannot be counted in 64 bits.
    pub fn project(&self, quantities: &[Quantity]) -> Option<Projection<'_>> {
        let mut digits = Vec::new();
        let mut rows: u64 = 1;
        for factor in self.factors.iter().rev() {
            if factor.axes.iter().any(|axis| quantities.contains(&axis.quantity)) {
                digits.push(Digit { factor, len: factor.len(), stride: rows });
                rows = rows.checked_mul(factor.len())?;
            }
        }
        digits.reverse();
        Some(Projection { digits, rows })
    }
}

/// One factor of a projection: step = `row / stride % len`.
#[derive(Debug, Clone)]
struct Digit<'a> {
    factor: &'a Factor,
    len: u64,
    stride: u64,
}

/// The rows of a table: a grid without the factors that the table does not depend on.
#[derive(Debug, Clone)]
pub struct Projection<'a> {
    digits: Vec<Digit<'a>>,
    rows: u64,
}

impl<'a> Projection<'a> {
    /// Number of rows.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// The values at `row`.
    pub fn point(&self, row: u64) -> Point {
        let mut point = Point::default();
        for digit in &self.digits {
            let step = row / digit.stride % digit.len;
            for axis in &digit.factor.axes {
                point[axis.quantity] = axis.values.at(step);
            }
        }
        point
    }

    /// The values of `quantity` over `rows`, as runs of equal values; `None` if no factor holds it.
    pub fn runs(&self, quantity: Quantity, rows: Range<u64>) -> Option<Runs<'a>> {
        self.digits.iter().find_map(|digit| {
            let axis = digit.factor.axes.iter().find(|axis| axis.quantity == quantity)?;
            Some(Runs { axis, len: digit.len, stride: digit.stride, rows: rows.clone() })
        })
    }

    /// Numbers the different tuples of `quantities` among the rows, from 0.
    pub fn tuples(&self, quantities: &[Quantity]) -> Tuples {
        let mut parts = Vec::new();
        let mut count: u64 = 1;
        for digit in self.digits.iter().rev() {
            if digit.factor.axes.iter().any(|axis| quantities.contains(&axis.quantity)) {
                let (distinct, class_of) = digit.factor.classes(quantities);
                parts.push(TupleDigit { len: digit.len, stride: digit.stride, class_of, weight: count });
                // Never more than the rows, which fit.
                count *= distinct;
            }
        }
        let run = parts.first().map_or(self.rows, |fastest| fastest.stride);
        Tuples { parts, count, run }
    }
}

/// The values of one quantity over a range of rows.
#[derive(Debug, Clone)]
pub struct Runs<'a> {
    axis: &'a Axis,
    len: u64,
    stride: u64,
    rows: Range<u64>,
}

impl<'a> Runs<'a> {
    /// The axis they come from.
    pub fn axis(&self) -> &'a Axis {
        self.axis
    }

    /// The values that occur, one a step, in the order of their first row.
    pub fn values(&self) -> Vec<f64> {
        if self.rows.is_empty() {
            return Vec::new();
        }
        let first = self.rows.start / self.stride;
        let steps = ((self.rows.end - 1) / self.stride - first + 1).min(self.len);
        (first..first + steps).map(|turn| self.axis.values.at(turn % self.len)).collect()
    }

    /// The index into [`Runs::values`] of one row.
    pub fn step_of(&self, row: u64) -> usize {
        ((row / self.stride - self.rows.start / self.stride) % self.len) as usize
    }

    /// The runs of equal values over `rows`, part of the rows of `self`: an index into [`Runs::values`], and for how many rows.
    pub fn over(&self, rows: Range<u64>) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (stride, len) = (self.stride, self.len);
        let turn = rows.start / stride;
        let mut step = (turn - self.rows.start / stride) % len;
        let mut row = rows.start;
        let mut end = (turn + 1).saturating_mul(stride);
        std::iter::from_fn(move || {
            if row >= rows.end {
                return None;
            }
            let run = (step as usize, (end.min(rows.end) - row) as usize);
            row = end;
            end = end.saturating_add(stride);
            step = if step + 1 == len { 0 } else { step + 1 };
            Some(run)
        })
    }
}

#[derive(Debug, Clone)]
struct TupleDigit {
    len: u64,
    stride: u64,
    class_of: Option<Vec<u32>>,
    weight: u64,
}

/// A numbering of the different tuples of some quantities among the rows of a projection.
#[derive(Debug, Clone)]
pub struct Tuples {
    parts: Vec<TupleDigit>,
    count: u64,
    run: u64,
}

impl Tuples {
    /// How many different tuples there are.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// For how many rows in a row a tuple lasts, counted from a multiple of this number.
    pub fn run(&self) -> u64 {
        self.run
    }

    /// The tuple of `row`, below `count()`. The same tuple has the same number in every projection of the same grid.
    pub fn of(&self, row: u64) -> u64 {
        self.parts
            .iter()
            .map(|digit| {
                let step = row / digit.stride % digit.len;
                digit.weight * digit.class_of.as_ref().map_or(step, |class_of| u64::from(class_of[step as usize]))
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    //! Rows decode to the same points as nested loops, and shared tuples are counted exactly.

    use super::*;

    fn list(quantity: Quantity, values: &[f64]) -> Axis {
        Axis { quantity, scale: Scale::Model, values: Values::List(values.to_vec()) }
    }

    /// Points (v_i, b) advancing together, times t_f, times alpha_2.
    fn grid() -> Grid {
        let pairs = Factor {
            axes: vec![list(Quantity::InitialVelocity, &[3.0, 4.0, 3.0]), list(Quantity::B, &[0.1, 0.2, 0.1])],
        };
        let times = Factor { axes: vec![list(Quantity::Time, &[1.0, 2.0])] };
        let alpha = Factor { axes: vec![list(Quantity::Alpha2, &[-1.0, 0.0, 1.0, 2.0])] };
        Grid { factors: vec![pairs, times, alpha] }
    }

    #[test]
    fn rows_are_nested_loops() {
        let grid = grid();
        let all = grid.project(&Quantity::ALL).expect("small");
        assert_eq!(all.rows(), 24);
        let mut row = 0;
        for (v_i, b) in [(3.0, 0.1), (4.0, 0.2), (3.0, 0.1)] {
            for t_f in [1.0, 2.0] {
                for alpha_2 in [-1.0, 0.0, 1.0, 2.0] {
                    let point = all.point(row);
                    assert_eq!(
                        [v_i, b, t_f, alpha_2],
                        [Quantity::InitialVelocity, Quantity::B, Quantity::Time, Quantity::Alpha2].map(|q| point[q])
                    );
                    row += 1;
                }
            }
        }
    }

    #[test]
    fn projection_drops_factors_that_are_not_needed() {
        let grid = grid();
        assert_eq!(grid.project(&[Quantity::Time]).expect("small").rows(), 2);
        assert_eq!(grid.project(&[Quantity::B, Quantity::Alpha2]).expect("small").rows(), 12);
        assert_eq!(grid.project(&[Quantity::Mass]).expect("small").rows(), 1);
    }

    #[test]
    fn runs_expand_to_the_points() {
        let grid = grid();
        let all = grid.project(&Quantity::ALL).expect("small");
        for quantity in [Quantity::InitialVelocity, Quantity::Time, Quantity::Alpha2] {
            for range in [0..24, 5..6, 3..21, 8..16, 23..24, 7..7] {
                let runs = all.runs(quantity, range.clone()).expect("held");
                let values = runs.values();
                let start = range.start + (range.end - range.start) / 3;
                let expanded: Vec<f64> =
                    runs.over(start..range.end).flat_map(|(i, n)| std::iter::repeat_n(values[i], n)).collect();
                let points: Vec<f64> = (start..range.end).map(|row| all.point(row)[quantity]).collect();
                assert_eq!(expanded, points, "{quantity:?} {range:?}");
            }
        }
        assert!(all.runs(Quantity::Mass, 0..24).is_none());
    }

    #[test]
    fn tuples_count_what_differs() {
        let grid = grid();
        let wanted = [Quantity::InitialVelocity, Quantity::B, Quantity::Time];
        let all = grid.project(&Quantity::ALL).expect("small");
        let tuples = all.tuples(&wanted);
        // The first and the third pair are the same.
        assert_eq!((tuples.count(), tuples.run()), (4, 4));
        assert_eq!(tuples.of(0), tuples.of(16));
        assert_ne!(tuples.of(0), tuples.of(8));
        // The numbering does not depend on the projection.
        let few = grid.project(&wanted).expect("small");
        let narrow = few.tuples(&wanted);
        assert_eq!(narrow.count(), 4);
        for row in 0..24 {
            assert_eq!(tuples.of(row), narrow.of(row / 4));
        }
    }

    #[test]
    fn rows_beyond_64_bits_are_refused() {
        let long = |quantity| Factor {
            axes: vec![Axis {
                quantity,
                scale: Scale::Model,
                values: Values::Linspace { first: 1.0, last: 2.0, count: 1 << 32 },
            }],
        };
        let two = Grid { factors: vec![long(Quantity::Time), long(Quantity::A)] };
        assert!(two.project(&[Quantity::Time, Quantity::A]).is_none());
        assert_eq!(two.project(&[Quantity::Time]).map(|p| p.rows()), Some(1 << 32));
    }
}
