//! A view of consecutive rows of a table: values as runs.

use std::ops::Range;

use super::block::Digit;
use super::expression::Scratch;
use super::quantity::{Point, Quantity};
use super::row_index::{RowIndex, Tuples};
use super::sampler::Sampler;

/// Rows of a table that are contiguous in the product of a block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// The number of the block.
    pub block: usize,
    /// The number of its first row in the table.
    pub first: u64,
    /// The rows of the product.
    pub raw: Range<u64>,
}

impl Segment {
    fn end(&self) -> u64 {
        self.first + (self.raw.end - self.raw.start)
    }

    /// The intersection with `rows` of the table, which may be empty.
    fn cut(&self, rows: &Range<u64>) -> Segment {
        let (start, end) = (rows.start.max(self.first), rows.end.min(self.end()));
        let raw = |row: u64| self.raw.start + row.saturating_sub(self.first);
        Segment { block: self.block, first: start, raw: raw(start)..raw(end) }
    }
}

/// Consecutive rows of a table.
#[derive(Debug, Clone)]
pub struct View<'a> {
    row_index: &'a RowIndex,
    segments: Vec<Segment>,
}

impl<'a> View<'a> {
    pub(super) fn new(row_index: &'a RowIndex, segments: Vec<Segment>) -> View<'a> {
        View { row_index, segments }
    }

    fn segments(&self, rows: Range<u64>) -> impl Iterator<Item = Segment> + '_ {
        let first = self.segments.partition_point(|segment| segment.end() <= rows.start);
        self.segments[first..]
            .iter()
            .map(move |segment| segment.cut(&rows))
            .take_while(|segment| !segment.raw.is_empty())
    }

    /// The values at `row`, one of the rows.
    pub fn point(&self, row: u64) -> Point {
        let mut point = Point::default();
        for quantity in Quantity::ALL {
            let value = self.runs(quantity, row..row + 1).and_then(|runs| runs.values().first().copied());
            point[quantity] = value.unwrap_or(f64::NAN);
        }
        point
    }

    /// The values of `quantity` over `rows` as runs; `None` without such an axis.
    pub fn runs(&self, quantity: Quantity, rows: Range<u64>) -> Option<Runs> {
        let blocks = self.row_index.blocks();
        if !blocks.iter().all(|block_rows| block_rows.determines(quantity)) {
            return None;
        }
        let segments: Vec<Segment> = self.segments(rows.clone()).collect();
        if let [segment] = segments.as_slice()
            && let Some((digit, axis)) = blocks[segment.block].axis(quantity)
        {
            let first = segment.raw.start / digit.stride;
            let steps = ((segment.raw.end - 1) / digit.stride - first + 1).min(digit.len);
            let values = (first..first + steps).map(|turn| axis.values.at(turn % digit.len)).collect();
            return Some(Runs { values, order: Order::Cyclic { digit, segment: segment.clone() } });
        }
        let (mut values, mut starts, mut scratch) = (Vec::<f64>::new(), Vec::new(), Scratch::default());
        for group in segments.chunk_by(|one, next| one.block == next.block) {
            let block_rows = &blocks[group[0].block];
            let sampler = Sampler::new(&block_rows.block, &block_rows.digits, &[quantity], None);
            let stride = sampler.run();
            // Where the value may change: rows of the table and of the product.
            let (mut rows, mut raws) = (Vec::new(), Vec::new());
            for segment in group {
                let mut raw = segment.raw.start;
                while raw < segment.raw.end {
                    rows.push(segment.first + (raw - segment.raw.start));
                    raws.push(raw);
                    raw = (raw / stride + 1).saturating_mul(stride);
                }
            }
            sampler.pick(&raws, &mut scratch);
            for (row, &value) in rows.into_iter().zip(&scratch.quantities[quantity as usize]) {
                if values.last().is_none_or(|last| last.to_bits() != value.to_bits()) {
                    values.push(value);
                    starts.push(row);
                }
            }
        }
        Some(Runs { values, order: Order::Listed(starts) })
    }

    /// The words of the label `name` over `rows` as runs: word, or `None`, and number of rows.
    pub fn label(&self, name: &str, rows: Range<u64>) -> Vec<(Option<&'a str>, usize)> {
        let labels: Vec<_> = self.row_index.blocks().iter().map(|block_rows| block_rows.label(name)).collect();
        let runs = self.runs_of(rows, |block, raw| match labels[block] {
            Some((digit, label)) => (label.word(digit.step(raw)), digit.next(raw)),
            None => (None, u64::MAX),
        });
        runs.into_iter().map(|(word, rows)| (word, (rows.end - rows.start) as usize)).collect()
    }

    /// The tuples of `rows` as runs: tuple and rows.
    pub fn tuples(&self, tuples: &Tuples, rows: Range<u64>) -> Vec<(u64, Range<u64>)> {
        self.runs_of(rows, |block, raw| tuples.of(block, raw))
    }

    /// Runs of equal values over `rows`. `of` gives the value at a product row, and the first row after it that may have another value.
    fn runs_of<T: PartialEq>(&self, rows: Range<u64>, of: impl Fn(usize, u64) -> (T, u64)) -> Vec<(T, Range<u64>)> {
        let mut runs: Vec<(T, Range<u64>)> = Vec::new();
        for segment in self.segments(rows) {
            let mut raw = segment.raw.start;
            while raw < segment.raw.end {
                let (value, next) = of(segment.block, raw);
                let next = next.min(segment.raw.end);
                let [start, end] = [raw, next].map(|raw| segment.first + (raw - segment.raw.start));
                match runs.last_mut() {
                    Some((last, run)) if *last == value => run.end = end,
                    _ => runs.push((value, start..end)),
                }
                raw = next;
            }
        }
        runs
    }
}

/// The values of one quantity over a range of rows.
#[derive(Debug, Clone)]
pub struct Runs {
    values: Vec<f64>,
    order: Order,
}

#[derive(Debug, Clone)]
enum Order {
    /// The periodic steps of a factor axis.
    Cyclic { digit: Digit, segment: Segment },
    /// The first row of each run, in the order of the values.
    Listed(Vec<u64>),
}

impl Runs {
    /// The values in the order of their first row: one for each step of a factor axis over one segment, else one for each run.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// These runs with other values.
    pub fn map(mut self, value: impl Fn(f64) -> f64) -> Runs {
        self.values.iter_mut().for_each(|known| *known = value(*known));
        self
    }

    /// The value of each of `rows`, a part of the rows.
    pub fn cells(&self, rows: Range<u64>) -> Vec<f64> {
        let mut cells = Vec::with_capacity((rows.end - rows.start) as usize);
        for (step, length) in self.over(rows) {
            cells.resize(cells.len() + length, self.values[step]);
        }
        cells
    }

    /// The index into [`Runs::values`] of one row.
    pub fn step_of(&self, row: u64) -> usize {
        match &self.order {
            Order::Cyclic { digit, segment } => {
                let raw = segment.raw.start + (row - segment.first);
                ((raw / digit.stride - segment.raw.start / digit.stride) % digit.len) as usize
            }
            Order::Listed(starts) => starts.partition_point(|start| *start <= row).saturating_sub(1),
        }
    }

    /// The runs over `rows`, a part of the rows: index into [`Runs::values`], and number of rows.
    pub fn over(&self, rows: Range<u64>) -> impl Iterator<Item = (usize, usize)> + '_ {
        let mut row = rows.start;
        let mut step = if rows.is_empty() { 0 } else { self.step_of(row) };
        let after = |starts: &[u64], step: usize| starts.get(step + 1).copied().unwrap_or(u64::MAX);
        // The first row after the run.
        let mut end = match &self.order {
            Order::Cyclic { digit, segment } => {
                let raw = segment.raw.start + row.saturating_sub(segment.first);
                row.saturating_add(digit.next(raw) - raw)
            }
            Order::Listed(starts) => after(starts, step),
        };
        std::iter::from_fn(move || {
            if row >= rows.end {
                return None;
            }
            let run = (step, (end.min(rows.end) - row) as usize);
            row = end;
            step += 1;
            end = match &self.order {
                Order::Cyclic { digit, .. } => {
                    step = if step as u64 == digit.len { 0 } else { step };
                    end.saturating_add(digit.stride)
                }
                Order::Listed(starts) => after(starts, step),
            };
            Some(run)
        })
    }
}
