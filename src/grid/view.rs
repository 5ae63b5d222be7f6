//! A view of consecutive rows of a table: values as runs.

use std::collections::HashMap;
use std::ops::Range;

use super::axis::Axis;
use super::block::Digit;
use super::expression::Scratch;
use super::quantity::{Point, Quantity};
use super::row_index::{RowIndex, Tuples};
use super::sampler::Sampler;

/// Points of an evaluation batch. Chosen: their columns fit the cache of a core.
const BATCH_POINTS: usize = 1 << 10;

/// Greatest number of axis steps in a code table. Chosen: it takes half a MiB.
const MAX_TABLE_STEPS: u64 = 1 << 16;

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

    /// The intersection with `rows` of the table.
    fn cut(&self, rows: &Range<u64>) -> Segment {
        let (start, end) = (rows.start.max(self.first), rows.end.min(self.end()));
        let raw = self.raw.start + (start - self.first)..self.raw.start + (end - self.first);
        Segment { block: self.block, first: start, raw }
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
        let inside = self.segments[first..].iter().take_while({
            let end = rows.end;
            move |segment| segment.first < end
        });
        inside.map(move |segment| segment.cut(&rows)).filter(|segment| !segment.raw.is_empty())
    }

    /// The values at `row`, one of the rows.
    pub fn point(&self, row: u64) -> Point {
        let mut point = Point::default();
        if let Some(segment) = self.segments(row..row + 1).next() {
            let block_rows = &self.row_index.blocks()[segment.block];
            let block = &block_rows.block;
            for digit in &block_rows.digits.digits {
                for axis in &block.factors[digit.factor].axes {
                    point[axis.quantity] = axis.values.at(digit.step(segment.raw.start));
                }
            }
            let made = block.derived.iter().map(|derived| derived.quantity);
            let made: Vec<Quantity> = made.filter(|quantity| block_rows.determines(*quantity)).collect();
            if made.is_empty() {
                return point;
            }
            let mut scratch = Scratch::default();
            Sampler::new(block, &block_rows.digits, &made, None).pick(&[segment.raw.start], &mut scratch);
            for quantity in made {
                point[quantity] = scratch.column(quantity)[0];
            }
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
        let mut runs = Listed::default();
        let (mut scratch, mut starts) = (Scratch::default(), Vec::new());
        for group in segments.chunk_by(|one, next| one.block == next.block) {
            let block_rows = &blocks[group[0].block];
            if let Some((digit, axis)) = block_rows.axis(quantity) {
                runs.take_steps(digit, axis, group);
                continue;
            }
            let sampler = Sampler::new(&block_rows.block, &block_rows.digits, &[quantity], None);
            for segment in group {
                let stride = sampler.run().unwrap_or(u64::MAX);
                let mut raw = segment.raw.start;
                while raw < segment.raw.end {
                    starts.push((segment.first + (raw - segment.raw.start), raw));
                    raw = (raw / stride + 1).saturating_mul(stride);
                }
                if starts.len() >= BATCH_POINTS {
                    runs.take_values(&sampler, quantity, &mut starts, &mut scratch);
                }
            }
            runs.take_values(&sampler, quantity, &mut starts, &mut scratch);
        }
        Some(Runs { values: runs.values, order: Order::Listed { starts: runs.starts, codes: runs.codes } })
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

/// A builder of runs: the first row of each, and the index of its value.
#[derive(Default)]
struct Listed {
    starts: Vec<u64>,
    codes: Vec<u32>,
    values: Vec<f64>,
}

impl Listed {
    fn push(&mut self, row: u64, code: u32) {
        if self.codes.last() != Some(&code) {
            self.starts.push(row);
            self.codes.push(code);
        }
    }

    /// Adds the steps of a factor axis over `segments`.
    fn take_steps(&mut self, digit: Digit, axis: &Axis, segments: &[Segment]) {
        // The code of each step, in a table if it is small: there may be as many runs as rows.
        let mut table = vec![None; if digit.len <= MAX_TABLE_STEPS { digit.len as usize } else { 0 }];
        let mut map = HashMap::new();
        for segment in segments {
            let mut raw = segment.raw.start;
            let mut step = digit.step(raw);
            let mut next = digit.next(raw);
            while raw < segment.raw.end {
                let slot = match table.get_mut(step as usize) {
                    Some(slot) => slot,
                    None => map.entry(step).or_insert(None),
                };
                let code = *slot.get_or_insert_with(|| {
                    self.values.push(axis.values.at(step));
                    self.values.len() as u32 - 1
                });
                self.push(segment.first + (raw - segment.raw.start), code);
                raw = next;
                next = next.saturating_add(digit.stride);
                step = if step + 1 == digit.len { 0 } else { step + 1 };
            }
        }
    }

    /// Adds the values of a computed axis at `starts`, rows of the table with their rows of the product.
    fn take_values(
        &mut self,
        sampler: &Sampler<'_>,
        quantity: Quantity,
        starts: &mut Vec<(u64, u64)>,
        scratch: &mut Scratch,
    ) {
        let raw: Vec<u64> = starts.iter().map(|(_, raw)| *raw).collect();
        sampler.pick(&raw, scratch);
        for ((row, _), &value) in starts.drain(..).zip(scratch.column(quantity)) {
            if self.values.last().is_none_or(|last| last.to_bits() != value.to_bits()) {
                self.values.push(value);
            }
            self.push(row, self.values.len() as u32 - 1);
        }
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
    /// The first row of each run, and the index of its value.
    Listed { starts: Vec<u64>, codes: Vec<u32> },
}

impl Runs {
    /// The values, one for each step, in the order of their first row.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The index into [`Runs::values`] of one row.
    pub fn step_of(&self, row: u64) -> usize {
        match &self.order {
            Order::Cyclic { digit, segment } => {
                let raw = segment.raw.start + (row - segment.first);
                ((raw / digit.stride - segment.raw.start / digit.stride) % digit.len) as usize
            }
            Order::Listed { starts, codes } => codes[Runs::run_at(starts, row)] as usize,
        }
    }

    fn run_at(starts: &[u64], row: u64) -> usize {
        starts.partition_point(|start| *start <= row).saturating_sub(1)
    }

    /// The runs over `rows`, a part of the rows: index into [`Runs::values`], and number of rows.
    pub fn over(&self, rows: Range<u64>) -> impl Iterator<Item = (usize, usize)> + '_ {
        let mut row = rows.start;
        // The step of a factor axis and the first row of the next step, or the current run.
        let (mut place, mut next) = match &self.order {
            _ if rows.is_empty() => (0, 0),
            Order::Cyclic { digit, segment } => {
                let raw = segment.raw.start + (row - segment.first);
                (self.step_of(row), row.saturating_add(digit.next(raw) - raw))
            }
            Order::Listed { starts, .. } => (Runs::run_at(starts, row), 0),
        };
        std::iter::from_fn(move || {
            if row >= rows.end {
                return None;
            }
            let (step, end) = match &self.order {
                Order::Cyclic { digit, .. } => {
                    let run = (place, next);
                    next = next.saturating_add(digit.stride);
                    place = if place as u64 + 1 == digit.len { 0 } else { place + 1 };
                    run
                }
                Order::Listed { starts, codes } => {
                    place += 1;
                    (codes[place - 1] as usize, starts.get(place).copied().unwrap_or(u64::MAX))
                }
            };
            let end = end.min(rows.end);
            let length = (end - row) as usize;
            row = end;
            Some((step, length))
        })
    }
}
