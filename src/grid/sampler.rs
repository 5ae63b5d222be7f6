//! Vectorised evaluation of axes and expressions over many rows.

use std::ops::Range;

use super::axis::{Axis, Values};
use super::block::{Block, Derived, Digit, Digits, Label};
use super::expression::{Expression, Scratch};
use super::quantity::Quantity;

/// Points that are evaluated at a time, and greatest number of tabulated values of a range. Chosen: they fit the cache of a core.
pub const BATCH_POINTS: u64 = 1 << 10;

/// An evaluator of some quantities of a block over product rows.
pub struct Sampler<'a> {
    sources: Vec<Source<'a>>,
    derived: Vec<&'a Derived>,
}

struct Source<'a> {
    digit: Digit,
    content: Content<'a>,
}

enum Content<'a> {
    /// The values of an axis, tabulated or not.
    Axis(&'a Axis, Option<Vec<f64>>),
    /// A label, and its number among those of its factor.
    Label(usize, &'a Label),
}

impl Source<'_> {
    fn at(&self, step: u64) -> f64 {
        match &self.content {
            Content::Axis(_, Some(table)) => table[step as usize],
            Content::Axis(axis, None) => axis.values.at(step),
            Content::Label(_, label) => label.places[step as usize].map_or(-1.0, f64::from),
        }
    }

    /// The column that it fills.
    fn column<'s>(&self, scratch: &'s mut Scratch) -> &'s mut Vec<f64> {
        match &self.content {
            Content::Axis(axis, _) => &mut scratch.quantities[axis.quantity as usize],
            Content::Label(number, _) => scratch.labels.entry(*number).or_default(),
        }
    }
}

impl<'a> Sampler<'a> {
    /// An evaluator of `quantities`, of the axes and labels in `condition`, and of the axes in their expressions, for rows over `digits`.
    pub fn new(
        block: &'a Block,
        digits: &Digits,
        quantities: &[Quantity],
        condition: Option<&Expression>,
    ) -> Sampler<'a> {
        let wanted: Vec<Quantity> =
            quantities.iter().copied().chain(condition.iter().flat_map(|it| it.reads())).collect();
        let wanted = block.with_reads(&wanted);
        let labels: Vec<(Quantity, usize)> = condition.iter().flat_map(|condition| condition.labels()).collect();
        let mut sources = Vec::new();
        for digit in &digits.digits {
            let factor = &block.factors[digit.factor];
            for axis in factor.axes.iter().filter(|axis| wanted.contains(&axis.quantity)) {
                let is_range = !matches!(axis.values, Values::List(_));
                let table = (is_range && digit.len <= BATCH_POINTS)
                    .then(|| (0..digit.len).map(|step| axis.values.at(step)).collect());
                sources.push(Source { digit: *digit, content: Content::Axis(axis, table) });
            }
            for &(_, number) in labels.iter().filter(|(axis, _)| factor.holds_any(&[*axis])) {
                sources.push(Source { digit: *digit, content: Content::Label(number, &factor.labels[number]) });
            }
        }
        let derived = block.derived.iter().filter(|one| wanted.contains(&one.quantity)).collect();
        Sampler { sources, derived }
    }

    /// The length of runs with constant quantities, in rows, from a multiple of this number.
    pub fn run(&self) -> u64 {
        self.sources.iter().map(|source| source.digit.stride).min().unwrap_or(u64::MAX)
    }

    /// Evaluates consecutive rows.
    pub fn load(&self, rows: Range<u64>, scratch: &mut Scratch) {
        scratch.length = (rows.end - rows.start) as usize;
        for source in &self.sources {
            let column = source.column(scratch);
            column.clear();
            let Digit { len, stride, .. } = source.digit;
            let (mut row, mut step) = (rows.start, source.digit.step(rows.start));
            let mut end = source.digit.next(row);
            while row < rows.end {
                let until = end.min(rows.end);
                column.resize(column.len() + (until - row) as usize, source.at(step));
                row = until;
                end = end.saturating_add(stride);
                step = if step + 1 == len { 0 } else { step + 1 };
            }
        }
        self.derive(scratch);
    }

    /// Evaluates any rows.
    pub fn pick(&self, rows: &[u64], scratch: &mut Scratch) {
        scratch.length = rows.len();
        for source in &self.sources {
            let column = source.column(scratch);
            column.clear();
            column.extend(rows.iter().map(|&row| source.at(source.digit.step(row))));
        }
        self.derive(scratch);
    }

    fn derive(&self, scratch: &mut Scratch) {
        for one in &self.derived {
            let values = one.expression.evaluate(scratch).to_vec();
            scratch.quantities[one.quantity as usize] = values;
        }
    }
}
