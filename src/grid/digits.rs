//! Rows of a product as numbers in mixed radix: one digit a factor.

use super::block::Block;

/// One digit: the step of its factor is `row / stride % len`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digit {
    /// The number of the factor in its block.
    pub factor: usize,
    /// Steps of the factor.
    pub len: u64,
    /// Rows for which a step lasts.
    pub stride: u64,
}

impl Digit {
    /// The step of the factor at `row`.
    pub fn step(&self, row: u64) -> u64 {
        row / self.stride % self.len
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
