//! The grid, and the index of the rows of a table over it.
//!
//! A table depends on some axes. Its rows over a block are the combinations of the factors on which these axes depend, in product order, the
//! last factor fastest. A combination is kept if the condition of the block holds at any of its points. Blocks follow one another. Memory and
//! time do not grow with the number of rows.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use super::axis::Axis;
use super::block::{Block, Digit, Digits, Label};
use super::quantity::{Point, Quantity, Scale};
use super::row_filter::RowFilter;
use super::view::{Segment, View};
use crate::model::Units;

/// A grid of points: blocks, one after another.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Grid {
    /// The blocks.
    pub blocks: Vec<Arc<Block>>,
    /// The units of all values.
    pub units: Units,
}

/// The error of rows that cannot be enumerated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TooMany {
    /// Their number exceeds 64 bits.
    Rows,
    /// The condition of this block reads too many combinations.
    Combinations(usize),
}

impl Grid {
    /// The unit of `quantity` in the grid; `None` if no block has it.
    pub fn scale(&self, quantity: Quantity) -> Option<Scale> {
        self.blocks.iter().find_map(|block| block.scale(quantity))
    }

    /// Converts `value` of `quantity` from the units of the grid to those of the model. Coefficients relative to the duration stay so; -0 is 0.
    pub fn scaled_value(&self, quantity: Quantity, value: f64) -> f64 {
        self.units.scaled(quantity.unit(self.scale(quantity).unwrap_or(Scale::Model)), value) + 0.0
    }

    /// A point in the units of the model.
    pub fn scaled(&self, point: &Point) -> Point {
        let mut scaled = *point;
        for quantity in Quantity::ALL {
            scaled[quantity] = self.scaled_value(quantity, point[quantity]);
        }
        scaled
    }

    /// The row index of a table over `quantities`.
    ///
    /// # Errors
    ///
    /// More rows than a table can have.
    pub fn project(&self, quantities: &[Quantity]) -> Result<RowIndex, TooMany> {
        let mut blocks = Vec::new();
        let (mut rows, mut raw): (u64, u64) = (0, 0);
        for (number, block) in self.blocks.iter().enumerate() {
            let digits = Digits::new(block, &block.factors_of(quantities)).ok_or(TooMany::Rows)?;
            raw = raw.checked_add(digits.rows).ok_or(TooMany::Rows)?;
            let row_filter = match &block.condition {
                Some(condition) => {
                    Some(RowFilter::new(block, &digits, condition).ok_or(TooMany::Combinations(number))?)
                }
                None => None,
            };
            let row_filter = row_filter.map(Arc::new);
            let kept = row_filter.as_ref().map_or(digits.rows, |row_filter| row_filter.rows());
            blocks.push(BlockRows { block: block.clone(), digits, row_filter, first: rows, rows: kept });
            rows += kept;
        }
        Ok(RowIndex { blocks, rows, dropped: raw - rows })
    }
}

/// The row index of a table.
#[derive(Debug, Clone)]
pub struct RowIndex {
    blocks: Vec<BlockRows>,
    rows: u64,
    dropped: u64,
}

/// The rows of one block.
#[derive(Debug, Clone)]
pub struct BlockRows {
    /// The block.
    pub block: Arc<Block>,
    /// The digits of its rows, kept or not.
    pub digits: Digits,
    row_filter: Option<Arc<RowFilter>>,
    first: u64,
    rows: u64,
}

impl BlockRows {
    /// Number of rows that are kept.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// The digit and axis of `quantity`, if a factor contains it.
    pub fn axis(&self, quantity: Quantity) -> Option<(Digit, &Axis)> {
        self.digits.digits.iter().find_map(|digit| {
            let axes = &self.block.factors[digit.factor].axes;
            Some((*digit, axes.iter().find(|axis| axis.quantity == quantity)?))
        })
    }

    /// Whether a row determines `quantity`: an axis of the rows, or computed from such axes.
    pub fn determines(&self, quantity: Quantity) -> bool {
        let is_there = |root: &Quantity| self.axis(*root).is_some();
        self.block.scale(quantity).is_some() && self.block.roots(&[quantity]).iter().all(is_there)
    }

    /// The digit with the label `name`, and the label, if any.
    pub fn label(&self, name: &str) -> Option<(Digit, &Label)> {
        self.digits.digits.iter().find_map(|digit| {
            let labels = &self.block.factors[digit.factor].labels;
            Some((*digit, labels.iter().find(|label| label.name == name)?))
        })
    }
}

impl RowIndex {
    /// Number of rows.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// The number of rows that conditions drop.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// The rows of each block.
    pub fn blocks(&self) -> &[BlockRows] {
        &self.blocks
    }

    /// The values at `row`.
    pub fn point(&self, row: u64) -> Point {
        self.view(row..row + 1).point(row)
    }

    /// A view of consecutive rows.
    pub fn view(&self, rows: Range<u64>) -> View<'_> {
        let mut segments = Vec::new();
        for (number, block_rows) in self.blocks.iter().enumerate() {
            let start = rows.start.clamp(block_rows.first, block_rows.first + block_rows.rows) - block_rows.first;
            let end = rows.end.clamp(block_rows.first, block_rows.first + block_rows.rows) - block_rows.first;
            if start >= end {
                continue;
            }
            let ranges = match &block_rows.row_filter {
                Some(row_filter) => row_filter.ranges(start..end),
                None => std::iter::once(start..end).collect(),
            };
            let mut first = block_rows.first + start;
            for raw in ranges {
                let length = raw.end - raw.start;
                segments.push(Segment { block: number, first, raw });
                first += length;
            }
        }
        View::new(self, segments)
    }

    /// Numbers the different tuples of `quantities` among the rows.
    pub fn tuples(&self, quantities: &[Quantity]) -> Tuples {
        let (mut parts, mut span) = (Vec::new(), 0);
        for block_rows in &self.blocks {
            let roots = block_rows.block.roots(quantities);
            let (mut digits, mut count) = (Vec::new(), 1);
            for digit in block_rows.digits.digits.iter().rev() {
                let factor = &block_rows.block.factors[digit.factor];
                if factor.holds_any(&roots) {
                    let (distinct, class_of) = factor.classes(&roots);
                    digits.push(TupleDigit { digit: *digit, class_of, weight: count });
                    // At most the number of rows, which fits.
                    count *= distinct;
                }
            }
            parts.push(BlockTuples { digits, first: span });
            span += count;
        }
        Tuples { parts, span }
    }

    /// The number of different tuples of `quantities` among the rows, which depend on nothing else.
    ///
    /// Equal tuples of different blocks, and tuples that expressions make equal, count each time; so do repeated values of a list if a condition
    /// keeps more than `most` rows.
    pub fn distinct(&self, quantities: &[Quantity], most: u64) -> u64 {
        let tuples = self.tuples(quantities);
        // Several rows can have one tuple if a list repeats a value.
        let repeats = tuples.parts.iter().flat_map(|part| &part.digits).any(|digit| digit.class_of.is_some());
        if self.blocks.iter().all(|block_rows| block_rows.row_filter.is_none()) {
            tuples.span
        } else if repeats && self.rows <= most {
            let seen: HashSet<u64> =
                self.view(0..self.rows).tuples(&tuples, 0..self.rows).into_iter().map(|(tuple, _)| tuple).collect();
            seen.len() as u64
        } else {
            self.rows
        }
    }
}

#[derive(Debug, Clone)]
struct TupleDigit {
    digit: Digit,
    class_of: Option<Vec<u32>>,
    weight: u64,
}

/// The tuples of one block.
#[derive(Debug, Clone)]
struct BlockTuples {
    /// Fastest first.
    digits: Vec<TupleDigit>,
    /// Tuples of the blocks before.
    first: u64,
}

/// A numbering of the different tuples of some quantities among the rows of a table. A tuple of a block has one number in every row index of the
/// grid that contains all the quantities.
#[derive(Debug, Clone)]
pub struct Tuples {
    parts: Vec<BlockTuples>,
    span: u64,
}

impl Tuples {
    /// One more than the greatest number.
    pub fn span(&self) -> u64 {
        self.span
    }

    /// The tuple of product row `raw` of block `block`, and the first row after it that may have another tuple.
    pub(super) fn of(&self, block: usize, raw: u64) -> (u64, u64) {
        let part = &self.parts[block];
        let number = part.digits.iter().map(|TupleDigit { digit, class_of, weight }| {
            let step = digit.step(raw);
            weight * class_of.as_ref().map_or(step, |class_of| u64::from(class_of[step as usize]))
        });
        let next = part.digits.first().map_or(u64::MAX, |fastest| fastest.digit.next(raw));
        (part.first + number.sum::<u64>(), next)
    }
}
