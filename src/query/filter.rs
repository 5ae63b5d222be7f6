//! Predicates on one column: row groups without matching rows are not read, and other rows are dropped before polars receives them.

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, RecordBatch};
use arrow_schema::DataType as ArrowType;
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::statistics::Statistics;
use polars::lazy::dsl::{Expr, Operator};
use polars::prelude::{AnyValue, LiteralValue, Schema};
use polars::sql::sql_expr;

use super::groups::Kind;
use super::streaming::Key;
use crate::dataset::label;

/// A predicate: the comparison of a column with a constant. Null never matches.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// The column.
    pub column: String,
    comparison: Operator,
    constant: Constant,
}

#[derive(Debug, Clone, PartialEq)]
enum Constant {
    Number(f64),
    Word(String),
}

/// Conditions that hold for every row kept by `predicate`: its comparisons joined by AND; and whether these are the whole predicate.
pub fn of_predicate(predicate: &Expr) -> (Vec<Condition>, bool) {
    let Expr::BinaryExpr { left, op, right } = predicate else { return (Vec::new(), false) };
    if matches!(op, Operator::And | Operator::LogicalAnd) {
        let ((mut both, is_left_whole), (more, is_right_whole)) = (of_predicate(left), of_predicate(right));
        both.extend(more);
        return (both, is_left_whole && is_right_whole);
    }
    let condition = match (left.as_ref(), right.as_ref()) {
        (Expr::Column(column), constant) => Condition::new(column, *op, constant),
        (constant, Expr::Column(column)) => Condition::new(column, mirrored(*op), constant),
        _ => None,
    };
    let is_whole = condition.is_some();
    (condition.into_iter().collect(), is_whole)
}

/// The conditions that are equivalent to a `WHERE` on a table with these columns; `None` if it contains more.
pub fn of_where(condition: Option<&sqlparser::ast::Expr>, schema: &Schema) -> Option<Vec<Condition>> {
    let Some(condition) = condition else { return Some(Vec::new()) };
    let (conditions, is_whole) = of_predicate(&sql_expr(condition.to_string()).ok()?);
    let fits = |condition: &Condition| match (&condition.constant, Kind::of(&condition.column, schema)) {
        (Constant::Number(_), Some(Kind::Number)) => true,
        (Constant::Word(_), Some(Kind::Word)) => matches!(condition.comparison, Operator::Eq | Operator::NotEq),
        _ => false,
    };
    (is_whole && conditions.iter().all(fits)).then_some(conditions)
}

fn mirrored(comparison: Operator) -> Operator {
    match comparison {
        Operator::Lt => Operator::Gt,
        Operator::LtEq => Operator::GtEq,
        Operator::Gt => Operator::Lt,
        Operator::GtEq => Operator::LtEq,
        same => same,
    }
}

fn constant_of(expression: &Expr) -> Option<Constant> {
    match expression {
        Expr::Cast { expr, .. } => constant_of(expr),
        Expr::Literal(literal @ (LiteralValue::Scalar(_) | LiteralValue::Dyn(_))) => {
            let value: AnyValue = literal.to_any_value()?;
            match value.get_str() {
                Some(word) => Some(Constant::Word(word.to_owned())),
                None => value.extract::<f64>().filter(|number| !number.is_nan()).map(Constant::Number),
            }
        }
        _ => None,
    }
}

/// Whether a comparison with `bound` may hold for some value between `least` and `most`.
fn may_hold<T: PartialOrd + ?Sized>(comparison: Operator, (least, most): (&T, &T), bound: &T) -> bool {
    match comparison {
        Operator::Lt => least < bound,
        Operator::LtEq => least <= bound,
        Operator::Gt => most > bound,
        Operator::GtEq => most >= bound,
        Operator::Eq => least <= bound && bound <= most,
        _ => true,
    }
}

impl Condition {
    fn new(column: &str, comparison: Operator, constant: &Expr) -> Option<Condition> {
        use Operator::{Eq, Gt, GtEq, Lt, LtEq, NotEq};
        let constant = constant_of(constant).filter(|_| matches!(comparison, Lt | LtEq | Gt | GtEq | Eq | NotEq))?;
        Some(Condition { column: column.to_owned(), comparison, constant })
    }

    /// Whether a row group may contain a matching row, according to its statistics.
    pub fn allows(&self, group: &RowGroupMetaData) -> bool {
        let chunk = group.columns().iter().find(|chunk| chunk.column_path().string() == self.column);
        let Some(statistics) = chunk.and_then(|chunk| chunk.statistics()) else { return true };
        match (&self.constant, statistics) {
            (Constant::Number(bound), Statistics::Double(range)) => {
                let range = range.min_opt().zip(range.max_opt());
                range.is_none_or(|range| may_hold(self.comparison, range, bound))
            }
            (Constant::Word(bound), Statistics::ByteArray(range)) => {
                let range = range.min_opt().zip(range.max_opt());
                range.is_none_or(|(least, most)| {
                    may_hold(self.comparison, (least.data(), most.data()), bound.as_bytes())
                })
            }
            _ => true,
        }
    }

    /// Removes the rows of a batch that do not match from `kept`. A column of another type removes none.
    pub fn mark(&self, batch: &RecordBatch, kept: &mut [bool]) {
        let Some(array) = batch.column_by_name(&self.column) else { return };
        match (&self.constant, array.data_type()) {
            (&Constant::Number(bound), ArrowType::Float64) => {
                let numbers = array.as_primitive::<Float64Type>().values();
                // Without branches, and as in polars: NaN is the greatest number.
                match self.comparison {
                    Operator::Lt => each(kept, numbers, |number| number < bound),
                    Operator::LtEq => each(kept, numbers, |number| number <= bound),
                    Operator::Gt => each(kept, numbers, |number| number > bound || number.is_nan()),
                    Operator::GtEq => each(kept, numbers, |number| number >= bound || number.is_nan()),
                    Operator::Eq => each(kept, numbers, |number| number == bound),
                    _ => each(kept, numbers, |number| number != bound),
                }
            }
            (Constant::Word(bound), kind)
                if *kind == label() && matches!(self.comparison, Operator::Eq | Operator::NotEq) =>
            {
                let codes = array.as_dictionary::<Int32Type>();
                let is_equal = |word: Option<&str>| (word == Some(bound)) == (self.comparison == Operator::Eq);
                let obeys: Vec<bool> = codes.values().as_string::<i32>().iter().map(is_equal).collect();
                let obeys = |key: i32| usize::try_from(key).ok().and_then(|key| obeys.get(key)).is_some_and(|x| *x);
                each(kept, codes.keys().values(), obeys);
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

/// The first rows in the order of a numeric column.
#[derive(Debug, Clone, PartialEq)]
pub struct Top {
    /// The column.
    pub column: String,
    /// Its direction.
    pub key: Key,
    /// The number of rows.
    pub most: usize,
    /// Whether rows that are equal in this column stay in the order of the table.
    pub is_only_key: bool,
}

impl Top {
    /// Removes rows that cannot be among the first from `kept`.
    pub fn mark(&self, batch: &RecordBatch, kept: &mut [bool]) {
        let Some(array) = batch.column_by_name(&self.column) else { return };
        let Some(array) = array.as_primitive_opt::<Float64Type>() else { return };
        // Keys in the order of the rows. NaN is the greatest number.
        let key = |row: usize| match (array.is_null(row), self.key.nulls_last) {
            (true, true) => i64::MAX,
            (true, false) => i64::MIN,
            (false, _) if self.key.descending => -in_order(array.value(row)),
            (false, _) => in_order(array.value(row)),
        };
        let Some(last) = self.most.checked_sub(1) else { return kept.fill(false) };
        let mut keys: Vec<i64> = (0..kept.len()).filter(|&row| kept[row]).map(key).collect();
        if last >= keys.len() {
            return;
        }
        let last = *keys.select_nth_unstable(last).1;
        let before = keys.iter().filter(|key| **key < last).count();
        let mut ties = if self.is_only_key { self.most - before } else { usize::MAX };
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
    //! First rows.

    use std::sync::Arc;

    use arrow_array::{ArrayRef, Float64Array, RecordBatch};

    use super::{Key, Top};

    #[test]
    fn the_first_rows_are_kept() {
        let numbers = [Some(3.0), None, Some(1.0), Some(2.0), Some(1.0), Some(f64::NAN)];
        let array: ArrayRef = Arc::new(Float64Array::from(numbers.to_vec()));
        let batch = RecordBatch::try_from_iter([("x", array)]).expect("is a table");
        let first = |descending, nulls_last, most, alone| {
            let mut kept = vec![true; 6];
            let key = Key { descending, nulls_last };
            Top { column: "x".to_owned(), key, most, is_only_key: alone }.mark(&batch, &mut kept);
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
