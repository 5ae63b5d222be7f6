//! An expression as a program for a stack of columns.

use super::super::quantity::Quantity;

/// One step. Truth is 1, falsehood 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Op {
    /// Pushes the values of an axis.
    Axis(Quantity),
    /// Pushes the places of the words of a label, by its number among those of the factor that holds `axis`; -1 where a step has none.
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

/// An expression of axes. Its functions are this crate's or exact, so that it has the same value on every machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    pub(super) program: Vec<Op>,
}

/// Values of quantities, and places of the words of labels, at several points.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    values: [Vec<f64>; Quantity::ALL.len()],
    labels: Vec<Vec<f64>>,
}

impl Columns {
    /// The values of `quantity`.
    pub fn get(&self, quantity: Quantity) -> &[f64] {
        &self.values[quantity as usize]
    }

    /// The values of `quantity`, to be filled.
    pub fn get_mut(&mut self, quantity: Quantity) -> &mut Vec<f64> {
        &mut self.values[quantity as usize]
    }

    /// The places of a label, to be filled.
    pub fn label_mut(&mut self, label: usize) -> &mut Vec<f64> {
        if self.labels.len() <= label {
            self.labels.resize_with(label + 1, Vec::new);
        }
        &mut self.labels[label]
    }
}

/// The memory of an evaluation, which the next one takes over.
#[derive(Debug, Clone, Default)]
pub struct Stack(Vec<Vec<f64>>);

impl Expression {
    /// The quantities that it names, or that vary with labels that it names, each once.
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

    /// The labels that it names: an axis of the factor that has each, and its number there.
    pub fn labels(&self) -> impl Iterator<Item = (Quantity, usize)> {
        self.program.iter().filter_map(|op| match op {
            Op::Label { label, axis } => Some((*axis, *label)),
            _ => None,
        })
    }

    /// Its values at the `length` points of `columns`.
    pub fn evaluate<'s>(&self, columns: &Columns, length: usize, stack: &'s mut Stack) -> &'s [f64] {
        let stack = &mut stack.0;
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
                Op::Axis(quantity) => stack[top - 1].extend_from_slice(columns.get(quantity)),
                Op::Label { label, .. } => {
                    let column = columns.labels.get(label).map_or(&[][..], Vec::as_slice);
                    stack[top - 1].extend_from_slice(column);
                }
                Op::Number(number) => stack[top - 1].resize(length, number),
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
