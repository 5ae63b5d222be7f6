//! Predicates on one column: row groups without matching rows are not read, and other rows are dropped before polars receives them.

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, RecordBatch};
use arrow_schema::DataType as ArrowType;
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::statistics::Statistics;
use polars::lazy::dsl::Expr as PolarsExpr;
use polars::lazy::dsl::Operator;
use polars::prelude::{AnyValue, DataType, LiteralValue, Schema};
use sqlparser::ast::{BinaryOperator, Expr, UnaryOperator, Value, ValueWithSpan};

use crate::dataset::label;

/// A predicate: the comparison of a column with a constant. Null never matches.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// The column.
    pub column: String,
    test: Test,
}

#[derive(Debug, Clone, PartialEq)]
enum Test {
    Number(Comparison, f64),
    Word(Comparison, String),
    /// Whether a word matches a pattern of `LIKE`, or of `NOT LIKE`.
    Like(String, bool),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Comparison {
    Less,
    AtMost,
    More,
    AtLeast,
    Equal,
    Unequal,
}

impl Comparison {
    fn mirrored(self) -> Comparison {
        match self {
            Comparison::Less => Comparison::More,
            Comparison::AtMost => Comparison::AtLeast,
            Comparison::More => Comparison::Less,
            Comparison::AtLeast => Comparison::AtMost,
            same => same,
        }
    }

    /// Whether the comparison with `bound` may hold for some value between `least` and `most`.
    fn allows<T: PartialOrd + ?Sized>(self, least: &T, most: &T, bound: &T) -> bool {
        match self {
            Comparison::Less => least < bound,
            Comparison::AtMost => least <= bound,
            Comparison::More => most > bound,
            Comparison::AtLeast => most >= bound,
            Comparison::Equal => least <= bound && bound <= most,
            Comparison::Unequal => true,
        }
    }
}

/// Conditions that hold for every row kept by `predicate`: its comparisons joined by AND.
pub fn of_predicate(predicate: &PolarsExpr) -> Vec<Condition> {
    let PolarsExpr::BinaryExpr { left, op, right } = predicate else { return Vec::new() };
    let comparison = match op {
        Operator::And | Operator::LogicalAnd => {
            let mut both = of_predicate(left);
            both.extend(of_predicate(right));
            return both;
        }
        Operator::Lt => Comparison::Less,
        Operator::LtEq => Comparison::AtMost,
        Operator::Gt => Comparison::More,
        Operator::GtEq => Comparison::AtLeast,
        Operator::Eq => Comparison::Equal,
        _ => return Vec::new(),
    };
    let (column, comparison, constant) = match (left.as_ref(), right.as_ref()) {
        (PolarsExpr::Column(name), constant) => (name, comparison, constant),
        (constant, PolarsExpr::Column(name)) => (name, comparison.mirrored(), constant),
        _ => return Vec::new(),
    };
    let test = constant_of(constant).map(|constant| constant.compared(comparison));
    test.into_iter().map(|test| Condition { column: column.to_string(), test }).collect()
}

enum Constant {
    Number(f64),
    Word(String),
}

impl Constant {
    fn compared(self, comparison: Comparison) -> Test {
        match self {
            Constant::Number(number) => Test::Number(comparison, number),
            Constant::Word(word) => Test::Word(comparison, word),
        }
    }
}

fn constant_of(expression: &PolarsExpr) -> Option<Constant> {
    match expression {
        PolarsExpr::Cast { expr, .. } => constant_of(expr),
        PolarsExpr::Literal(literal @ (LiteralValue::Scalar(_) | LiteralValue::Dyn(_))) => {
            let value: AnyValue = literal.to_any_value()?;
            match value.get_str() {
                Some(word) => Some(Constant::Word(word.to_owned())),
                None => value.extract::<f64>().filter(|number| !number.is_nan()).map(Constant::Number),
            }
        }
        _ => None,
    }
}

/// The conditions that are equivalent to a `WHERE` on a table with these columns; `None` if it contains more.
pub fn of_where(condition: Option<&Expr>, schema: &Schema) -> Option<Vec<Condition>> {
    let mut conditions = Vec::new();
    if let Some(condition) = condition {
        collect(condition, &mut conditions)?;
    }
    let fits = |condition: &Condition| {
        let kind = schema.get(&condition.column);
        match (&condition.test, kind) {
            (Test::Number(..), Some(DataType::Float64)) => true,
            (Test::Word(Comparison::Equal | Comparison::Unequal, _) | Test::Like(..), Some(kind)) => {
                kind.is_categorical()
            }
            _ => false,
        }
    };
    conditions.iter().all(fits).then_some(conditions)
}

fn collect(condition: &Expr, conditions: &mut Vec<Condition>) -> Option<()> {
    let mut add = |column: &Expr, comparison: Comparison, constant: &Expr| {
        let test = literal(constant)?.compared(comparison);
        conditions.push(Condition { column: column_of(column)?, test });
        Some(())
    };
    match condition {
        Expr::Nested(inner) => collect(inner, conditions),
        Expr::BinaryOp { left, op: BinaryOperator::And, right } => {
            collect(left, conditions)?;
            collect(right, conditions)
        }
        Expr::BinaryOp { left, op, right } => {
            let comparison = match op {
                BinaryOperator::Lt => Comparison::Less,
                BinaryOperator::LtEq => Comparison::AtMost,
                BinaryOperator::Gt => Comparison::More,
                BinaryOperator::GtEq => Comparison::AtLeast,
                BinaryOperator::Eq => Comparison::Equal,
                BinaryOperator::NotEq => Comparison::Unequal,
                _ => return None,
            };
            match column_of(left) {
                Some(_) => add(left, comparison, right),
                None => add(right, comparison.mirrored(), left),
            }
        }
        Expr::Between { expr, negated: false, low, high } => {
            add(expr, Comparison::AtLeast, low)?;
            add(expr, Comparison::AtMost, high)
        }
        Expr::Like { negated, any: false, expr, pattern, escape_char: None } => {
            let Expr::Cast { expr, .. } = expr.as_ref() else { return None };
            let Constant::Word(pattern) = literal(pattern)? else { return None };
            let test = Test::Like(pattern.clone(), *negated);
            conditions.push(Condition { column: column_of(expr)?, test });
            (!pattern.contains('\\')).then_some(())
        }
        _ => None,
    }
}

fn column_of(expression: &Expr) -> Option<String> {
    match expression {
        Expr::Identifier(name) => Some(name.value.clone()),
        Expr::Nested(inner) => column_of(inner),
        _ => None,
    }
}

fn literal(expression: &Expr) -> Option<Constant> {
    match expression {
        Expr::Nested(inner) => literal(inner),
        Expr::UnaryOp { op: UnaryOperator::Minus, expr } => match literal(expr)? {
            Constant::Number(number) => Some(Constant::Number(-number)),
            Constant::Word(_) => None,
        },
        Expr::Value(ValueWithSpan { value: Value::Number(digits, _), .. }) => digits.parse().ok().map(Constant::Number),
        Expr::Value(ValueWithSpan { value: Value::SingleQuotedString(word), .. }) => Some(Constant::Word(word.clone())),
        _ => None,
    }
}

impl Condition {
    /// Whether a row group may contain a matching row, according to its statistics.
    pub fn allows(&self, group: &RowGroupMetaData) -> bool {
        let chunk = group.columns().iter().find(|chunk| chunk.column_path().string() == self.column);
        let Some(statistics) = chunk.and_then(|chunk| chunk.statistics()) else { return true };
        match (&self.test, statistics) {
            (Test::Number(comparison, bound), Statistics::Double(range)) => {
                let range = range.min_opt().zip(range.max_opt());
                range.is_none_or(|(least, most)| comparison.allows(least, most, bound))
            }
            (Test::Word(comparison, bound), Statistics::ByteArray(range)) => {
                let range = range.min_opt().zip(range.max_opt());
                range.is_none_or(|(least, most)| comparison.allows(least.data(), most.data(), bound.as_bytes()))
            }
            _ => true,
        }
    }

    /// Removes the rows of a batch that do not match from `kept`. A column of another type removes none.
    pub fn mark(&self, batch: &RecordBatch, kept: &mut [bool]) {
        let Some(array) = batch.column_by_name(&self.column) else { return };
        match (&self.test, array.data_type()) {
            (Test::Number(comparison, bound), ArrowType::Float64) => {
                let numbers = array.as_primitive::<Float64Type>().values();
                let bound = *bound;
                // Without branches, and as in polars: NaN is the greatest number.
                match comparison {
                    Comparison::Less => each(kept, numbers, |number| number < bound),
                    Comparison::AtMost => each(kept, numbers, |number| number <= bound),
                    Comparison::More => each(kept, numbers, |number| number > bound || number.is_nan()),
                    Comparison::AtLeast => each(kept, numbers, |number| number >= bound || number.is_nan()),
                    Comparison::Equal => each(kept, numbers, |number| number == bound),
                    Comparison::Unequal => each(kept, numbers, |number| number != bound),
                }
            }
            (test, kind) if *kind == label() => {
                let codes = array.as_dictionary::<Int32Type>();
                let words = codes.values().as_string::<i32>();
                let obeys: Vec<bool> = match test {
                    Test::Word(Comparison::Equal, bound) => words.iter().map(|word| word == Some(bound)).collect(),
                    Test::Word(Comparison::Unequal, bound) => words.iter().map(|word| word != Some(bound)).collect(),
                    Test::Like(pattern, negated) => {
                        words.iter().map(|word| word.is_some_and(|word| like(word, pattern) != *negated)).collect()
                    }
                    _ => return,
                };
                let obeys = |key: &i32| usize::try_from(*key).ok().and_then(|key| obeys.get(key)).is_some_and(|x| *x);
                each(kept, codes.keys().values(), |key| obeys(&key));
            }
            _ => return,
        }
        if let Some(nulls) = array.nulls() {
            kept.iter_mut().zip(nulls.iter()).for_each(|(kept, is_there)| *kept &= is_there);
        }
    }
}

fn each<T: Copy>(kept: &mut [bool], values: &[T], obeys: impl Fn(T) -> bool) {
    kept.iter_mut().zip(values).for_each(|(kept, &value)| *kept &= obeys(value));
}

/// Whether a word matches a pattern of `LIKE`: % is any text, _ any character.
fn like(word: &str, pattern: &str) -> bool {
    let (word, pattern): (Vec<char>, Vec<char>) = (word.chars().collect(), pattern.chars().collect());
    let (mut letter, mut sign) = (0, 0);
    // The last %, and the end of the text that it matches: a % matches as little as possible.
    let mut last: Option<(usize, usize)> = None;
    while letter < word.len() {
        match pattern.get(sign) {
            Some('%') => {
                last = Some((sign, letter));
                sign += 1;
            }
            Some(&other) if other == '_' || other == word[letter] => {
                letter += 1;
                sign += 1;
            }
            _ => {
                let Some((place, from)) = last else { return false };
                last = Some((place, from + 1));
                (sign, letter) = (place + 1, from + 1);
            }
        }
    }
    pattern[sign..].iter().all(|sign| *sign == '%')
}

/// The rows of a batch that match all conditions.
pub fn kept(conditions: &[Condition], batch: &RecordBatch) -> Vec<bool> {
    let mut kept = vec![true; batch.num_rows()];
    conditions.iter().for_each(|condition| condition.mark(batch, &mut kept));
    kept
}

/// The first rows in the order of a numeric column.
#[derive(Debug, Clone, PartialEq)]
pub struct Top {
    /// The column.
    pub column: String,
    /// Whether the order is descending.
    pub descending: bool,
    /// Whether nulls come last.
    pub nulls_last: bool,
    /// The number of rows.
    pub most: usize,
    /// Whether rows that are equal in this column stay in the order of the table.
    pub alone: bool,
}

impl Top {
    /// Removes rows that cannot be among the first from `kept`.
    pub fn mark(&self, batch: &RecordBatch, kept: &mut [bool]) {
        let Some(array) = batch.column_by_name(&self.column) else { return };
        let Some(array) = array.as_primitive_opt::<Float64Type>() else { return };
        // Keys in the order of the rows. NaN is the greatest number.
        let key = |row: usize| match (array.is_null(row), self.nulls_last) {
            (true, true) => i64::MAX,
            (true, false) => i64::MIN,
            (false, _) if self.descending => -in_order(array.value(row)),
            (false, _) => in_order(array.value(row)),
        };
        let Some(last) = self.most.checked_sub(1) else { return kept.fill(false) };
        let mut keys: Vec<i64> = (0..kept.len()).filter(|&row| kept[row]).map(key).collect();
        if last >= keys.len() {
            return;
        }
        let last = *keys.select_nth_unstable(last).1;
        let before = keys.iter().filter(|key| **key < last).count();
        let mut ties = if self.alone { self.most - before } else { usize::MAX };
        for (row, kept) in kept.iter_mut().enumerate().filter(|(_, kept)| **kept) {
            let key = key(row);
            *kept = key < last || key == last && ties > 0;
            ties -= usize::from(key == last && ties > 0);
        }
    }
}

/// An integer in the order of numbers, of which zero has one sign and NaN is the greatest.
fn in_order(number: f64) -> i64 {
    if number.is_nan() {
        return i64::MAX - 1;
    }
    let bits = (number + 0.0).to_bits().cast_signed();
    // Those of negative numbers fall.
    if bits < 0 { -(bits & i64::MAX) } else { bits }
}

#[cfg(test)]
mod tests {
    //! Rows that match a condition.

    use std::sync::Arc;

    use arrow_array::{ArrayRef, Float64Array, RecordBatch};

    use super::{Top, like};

    #[test]
    fn words_are_like_patterns() {
        for (word, pattern, expected) in [
            ("infeasible", "inf%", true),
            ("ok", "inf%", false),
            ("ok", "o_", true),
            ("ok", "_", false),
            ("a%b", "%b", true),
            ("", "%", true),
            ("µm", "_m", true),
            ("aab", "%ab", true),
            ("abab", "a%b", true),
            ("abc", "a%b", false),
            ("", "", true),
            ("a", "", false),
            (&"a".repeat(200), "%a%a%a%a%a%a%a%b", false),
        ] {
            assert_eq!(like(word, pattern), expected, "{word} {pattern}");
        }
    }

    #[test]
    fn the_first_rows_are_kept() {
        let numbers = [Some(3.0), None, Some(1.0), Some(2.0), Some(1.0), Some(f64::NAN)];
        let array: ArrayRef = Arc::new(Float64Array::from(numbers.to_vec()));
        let batch = RecordBatch::try_from_iter([("x", array)]).expect("is a table");
        let first = |descending, nulls_last, most, alone| {
            let mut kept = vec![true; 6];
            Top { column: "x".to_owned(), descending, nulls_last, most, alone }.mark(&batch, &mut kept);
            (0..6).filter(|&row| kept[row]).collect::<Vec<_>>()
        };
        assert_eq!(first(false, true, 1, true), [2]);
        assert_eq!(first(false, true, 1, false), [2, 4]);
        assert_eq!(first(false, true, 4, true), [0, 2, 3, 4]);
        assert_eq!(first(false, true, 6, true), [0, 1, 2, 3, 4, 5]);
        assert_eq!(first(true, false, 2, true), [1, 5]);
        assert_eq!(first(true, true, 2, true), [0, 5]);
        assert_eq!(first(false, true, 0, true), Vec::<usize>::new());
    }
}
