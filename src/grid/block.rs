//! A block: independent factors, computed axes, and a condition on its points. Rows of its product are numbers in mixed radix.

use std::collections::HashMap;

use super::axis::{Axis, Values};
use super::expression::Expression;
use super::quantity::{Quantity, Scale};

/// Axes that advance together.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Factor {
    /// The axes, all of the same length, at least one.
    pub axes: Vec<Axis>,
    /// The labels of its steps, of that length too.
    pub labels: Vec<Label>,
}

/// A label: a column of words for the steps of a factor. No number depends on it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// Its name.
    pub name: String,
    /// The distinct words, in the order of their first step.
    pub words: Vec<String>,
    /// The index in `words` for each step; `None` for a step without a word.
    pub places: Vec<Option<u32>>,
}

impl Label {
    /// The word of `step`, if it has one.
    pub fn word(&self, step: u64) -> Option<&str> {
        let place = (*self.places.get(step as usize)?)?;
        self.words.get(place as usize).map(String::as_str)
    }
}

impl Factor {
    /// The axis of `quantity` with its default values.
    pub fn usual(quantity: Quantity) -> Factor {
        let axis = Axis { quantity, scale: Scale::Model, values: Values::List(quantity.default()) };
        Factor { axes: vec![axis], ..Factor::default() }
    }

    /// Number of steps.
    pub fn len(&self) -> u64 {
        self.axes.first().map_or(0, |axis| axis.values.len())
    }

    /// Whether the factor has no steps.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether it contains an axis of `quantities`.
    pub fn holds_any(&self, quantities: &[Quantity]) -> bool {
        self.axes.iter().any(|axis| quantities.contains(&axis.quantity))
    }

    /// The number of different tuples of `quantities`, and the tuple of each step unless every step has its own.
    ///
    /// Ranges are distinct by construction, so only what is stored value by value is compared.
    pub fn classes(&self, quantities: &[Quantity]) -> (u64, Option<Vec<u32>>) {
        let used: Vec<&Axis> = self.axes.iter().filter(|axis| quantities.contains(&axis.quantity)).collect();
        if used.is_empty() || used.iter().any(|axis| is_monotone(&axis.values)) {
            return (self.len(), None);
        }
        let mut class_of = vec![0_u32; self.len() as usize];
        let mut distinct = 0;
        for axis in used {
            let mut seen = HashMap::new();
            for (step, class) in class_of.iter_mut().enumerate() {
                let next = seen.len() as u32;
                // -0 is another way to write 0.
                let bits = (axis.values.at(step as u64) + 0.0).to_bits();
                *class = *seen.entry((*class, bits)).or_insert(next);
            }
            distinct = seen.len() as u64;
            if distinct == self.len() {
                return (distinct, None);
            }
        }
        (distinct, Some(class_of))
    }
}

/// Whether each value is greater than the one before, or each is less.
fn is_monotone(values: &Values) -> bool {
    let Values::List(list) = values else { return true };
    list.windows(2).all(|pair| pair[0] < pair[1]) || list.windows(2).all(|pair| pair[0] > pair[1])
}

/// Increment of the counter of SplitMix64: 2^64 over the golden ratio.
pub(crate) const SPLIT_MIX_INCREMENT: u64 = 0x9e37_79b9_7f4a_7c15;

/// A hash of `bits`: the finaliser of SplitMix64 (Steele, Lea and Flood 2014, doi:10.1145/2714064.2660195).
pub(crate) fn mixed(bits: u64) -> u64 {
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// An axis whose value at a point is computed from other axes of its block.
#[derive(Debug, Clone, PartialEq)]
pub struct Derived {
    /// The computed quantity.
    pub quantity: Quantity,
    /// The unit of the values.
    pub scale: Scale,
    /// The expression.
    pub expression: Expression,
}

/// A product of factors, its computed axes and its condition.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Block {
    /// The factors, slowest first.
    pub factors: Vec<Factor>,
    /// Computed axes, each after the axes in its expression.
    pub derived: Vec<Derived>,
    /// The condition of kept points; `None` keeps all.
    pub condition: Option<Expression>,
}

impl Block {
    /// The axis of `quantity`, if a factor contains it.
    pub fn axis(&self, quantity: Quantity) -> Option<&Axis> {
        self.factors.iter().flat_map(|factor| &factor.axes).find(|axis| axis.quantity == quantity)
    }

    /// Whether a value of `quantity` may satisfy `condition`; always true for an axis that is computed from others.
    pub fn may_be(&self, quantity: Quantity, condition: impl Fn(f64) -> bool) -> bool {
        match self.axis(quantity).map(|axis| &axis.values) {
            Some(Values::List(values)) => values.iter().any(|&value| condition(value)),
            Some(range) => !range.is_empty() && (condition(range.at(0)) || condition(range.at(range.len() - 1))),
            None if self.derived.iter().any(|derived| derived.quantity == quantity) => true,
            None => quantity.default().into_iter().any(condition),
        }
    }

    /// The names of the labels of rows over `quantities`: those of the factors with these axes.
    pub fn labels(&self, quantities: &[Quantity]) -> impl Iterator<Item = &str> {
        let factors = self.factors_of(quantities).into_iter();
        factors.flat_map(|factor| &self.factors[factor].labels).map(|label| label.name.as_str())
    }

    /// The unit of `quantity` in the block; `None` without such an axis.
    pub fn scale(&self, quantity: Quantity) -> Option<Scale> {
        let derived = self.derived.iter().find(|derived| derived.quantity == quantity).map(|derived| derived.scale);
        derived.or_else(|| self.axis(quantity).map(|axis| axis.scale))
    }

    /// `quantities`, and all axes in the expressions of those that are computed.
    pub fn with_reads(&self, quantities: &[Quantity]) -> Vec<Quantity> {
        let mut all = quantities.to_vec();
        for derived in self.derived.iter().rev() {
            if all.contains(&derived.quantity) {
                all.extend(derived.expression.reads());
            }
        }
        all
    }

    /// The factor axes on which `quantities` depend.
    pub fn roots(&self, quantities: &[Quantity]) -> Vec<Quantity> {
        let mut roots = self.with_reads(quantities);
        roots.retain(|quantity| self.axis(*quantity).is_some());
        roots
    }

    /// The numbers of the factors on which `quantities` depend, slowest first.
    pub fn factors_of(&self, quantities: &[Quantity]) -> Vec<usize> {
        let roots = self.roots(quantities);
        (0..self.factors.len()).filter(|&factor| self.factors[factor].holds_any(&roots)).collect()
    }
}

/// One digit: the step of its factor is `row / stride % len`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digit {
    /// The number of the factor in its block.
    pub factor: usize,
    /// Steps of the factor.
    pub len: u64,
    /// Rows of one step.
    pub stride: u64,
}

impl Digit {
    /// The step of the factor at `row`.
    pub fn step(&self, row: u64) -> u64 {
        row / self.stride % self.len
    }

    /// The first row after `row` with another step.
    pub fn next(&self, row: u64) -> u64 {
        (row / self.stride + 1).saturating_mul(self.stride)
    }
}

/// The digits of the rows of a product, slowest first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Digits {
    /// The digits.
    pub digits: Vec<Digit>,
    /// Number of rows.
    pub rows: u64,
}

impl Digits {
    /// Rows over these factors of `block`, the last fastest; `None` if 64 bits cannot count them.
    pub fn new(block: &Block, factors: &[usize]) -> Option<Digits> {
        let mut rows: u64 = 1;
        let mut digits = Vec::with_capacity(factors.len());
        for &factor in factors.iter().rev() {
            let len = block.factors[factor].len();
            digits.push(Digit { factor, len, stride: rows });
            rows = rows.checked_mul(len)?;
        }
        digits.reverse();
        Some(Digits { digits, rows })
    }
}
