//! Expressions as programs of a stack machine over columns.

use std::collections::BTreeMap;

use super::super::quantity::Quantity;

/// An instruction. Truth is 1, falsehood 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Op {
    /// Pushes the values of an axis.
    Axis(Quantity),
    /// Pushes the word indices of a label of the factor with `axis`; -1 for a step without a word.
    Label {
        /// The number of the label.
        label: usize,
        /// An axis of the factor.
        axis: Quantity,
    },
    /// Pushes a constant.
    Number(f64),
    /// Replaces the last value.
    Unary(Unary),
    /// Replaces the last two values.
    Binary(Binary),
}

/// Functions of one value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unary {
    Negate,
    Not,
    Abs,
    Sqrt,
    Exp,
    Ln,
    Log10,
    Floor,
    Ceil,
}

/// Functions of two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    And,
    Or,
    Min,
    Max,
}

/// An expression of axes. Its functions are those of this crate or exact, so its value is equal on every machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    pub(super) program: Vec<Op>,
}

/// The scratch memory of one thread: the values of quantities and labels at some points, and the stack of an evaluation.
#[derive(Default)]
pub struct Scratch {
    /// Number of points.
    pub length: usize,
    /// The values of each quantity.
    pub quantities: [Vec<f64>; Quantity::ALL.len()],
    /// The word indices of labels.
    pub labels: BTreeMap<usize, Vec<f64>>,
    stack: Vec<Vec<f64>>,
}

impl Expression {
    /// The distinct quantities that it names, or that vary with its labels.
    pub fn reads(&self) -> Vec<Quantity> {
        let mut reads = Vec::new();
        for op in &self.program {
            if let Op::Axis(quantity) | Op::Label { axis: quantity, .. } = op
                && !reads.contains(quantity)
            {
                reads.push(*quantity);
            }
        }
        reads
    }

    /// The labels that it names: an axis of the factor, and the number of the label.
    pub fn labels(&self) -> impl Iterator<Item = (Quantity, usize)> {
        self.program.iter().filter_map(|op| match op {
            Op::Label { label, axis } => Some((*axis, *label)),
            _ => None,
        })
    }

    /// Its values at the points of `scratch`.
    pub fn evaluate<'s>(&self, scratch: &'s mut Scratch) -> &'s [f64] {
        let Scratch { length, quantities, labels, stack } = scratch;
        let mut top = 0;
        for op in &self.program {
            if matches!(op, Op::Axis(_) | Op::Label { .. } | Op::Number(_)) {
                if stack.len() == top {
                    stack.push(Vec::new());
                }
                stack[top].clear();
                top += 1;
            }
            match *op {
                Op::Axis(quantity) => stack[top - 1].extend_from_slice(&quantities[quantity as usize]),
                Op::Label { label, .. } => {
                    let column = labels.get(&label).map_or(&[][..], Vec::as_slice);
                    stack[top - 1].extend_from_slice(column);
                }
                Op::Number(number) => stack[top - 1].resize(*length, number),
                Op::Unary(function) => unary(function, &mut stack[top - 1]),
                Op::Binary(function) => {
                    let (left, right) = stack.split_at_mut(top - 1);
                    binary(function, &mut left[top - 2], &right[0]);
                    top -= 1;
                }
            }
        }
        stack.first().map_or(&[], Vec::as_slice)
    }
}

fn unary(function: Unary, values: &mut [f64]) {
    let mut each = |f: fn(f64) -> f64| values.iter_mut().for_each(|value| *value = f(*value));
    match function {
        Unary::Negate => each(|x| -x),
        Unary::Not => each(|x| 1.0 - x),
        Unary::Abs => each(f64::abs),
        Unary::Sqrt => each(f64::sqrt),
        Unary::Exp => each(libm::exp),
        Unary::Ln => each(libm::log),
        Unary::Log10 => each(libm::log10),
        Unary::Floor => each(f64::floor),
        Unary::Ceil => each(f64::ceil),
    }
}

fn binary(function: Binary, left: &mut [f64], right: &[f64]) {
    #[inline(always)]
    fn each(left: &mut [f64], right: &[f64], f: impl Fn(f64, f64) -> f64) {
        for (x, &y) in left.iter_mut().zip(right) {
            *x = f(*x, y);
        }
    }
    let truth = |is: bool| f64::from(u8::from(is));
    match function {
        Binary::Add => each(left, right, |x, y| x + y),
        Binary::Subtract => each(left, right, |x, y| x - y),
        Binary::Multiply | Binary::And => each(left, right, |x, y| x * y),
        Binary::Divide => each(left, right, |x, y| x / y),
        Binary::Power => each(left, right, libm::pow),
        Binary::Less => each(left, right, |x, y| truth(x < y)),
        Binary::LessEqual => each(left, right, |x, y| truth(x <= y)),
        Binary::Greater => each(left, right, |x, y| truth(x > y)),
        Binary::GreaterEqual => each(left, right, |x, y| truth(x >= y)),
        Binary::Equal => each(left, right, |x, y| truth(x == y)),
        Binary::Or | Binary::Max => each(left, right, |x, y| if y > x { y } else { x }),
        Binary::Min => each(left, right, |x, y| if y < x { y } else { x }),
    }
}
