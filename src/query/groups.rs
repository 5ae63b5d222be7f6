//! Groups of rows with counts, sums, least and greatest numbers, computed from the columns of a file directly.
//!
//! Most queries over many rows are of this kind. polars, which is not optimised in the release build, would be several times slower than Python
//! polars (`benches/query/run`). The test `an_answer_in_pieces_is_the_answer_at_once` compares both implementations.

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, RecordBatch};
use indexmap::IndexSet;
use polars::prelude::{
    BooleanChunked, Column, DataFrame, DataType, Float64Chunked, Int64Chunked, IntoColumn, NewChunkedArray,
    PolarsResult, Schema, StringChunked,
};

/// An aggregate of a group.
#[derive(Debug, Clone, PartialEq)]
pub struct Aggregate {
    pub measure: Measure,
    /// The argument in SQL; `*` counts rows.
    pub argument: String,
    /// The column of the argument, if it is one.
    pub column: Option<String>,
}

/// What an aggregate measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    Count,
    Sum,
    Least,
    Greatest,
}

impl Measure {
    /// The function that merges the values of parts.
    pub fn merged_by(self) -> &'static str {
        match self {
            Measure::Count | Measure::Sum => "sum",
            Measure::Least => "min",
            Measure::Greatest => "max",
        }
    }
}

impl Aggregate {
    /// The aggregate in SQL.
    pub fn sql(&self) -> String {
        let argument = &self.argument;
        match self.measure {
            Measure::Count => format!("CAST(count({argument}) AS BIGINT)"),
            other => format!("{}({argument})", other.merged_by()),
        }
    }
}

/// The type of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Doubles.
    Number,
    /// True and false.
    Flag,
    /// Words that repeat.
    Word,
}

impl Kind {
    /// The type of the column `name`.
    pub fn of(name: &str, schema: &Schema) -> Option<Kind> {
        match schema.get(name)? {
            DataType::Float64 => Some(Kind::Number),
            DataType::Boolean => Some(Kind::Flag),
            kind => kind.is_categorical().then_some(Kind::Word),
        }
    }
}

/// A query for groups, which needs columns alone.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupQuery {
    /// The key columns of the groups.
    keys: Vec<(String, Kind)>,
    /// The aggregates of each group.
    aggregates: Vec<Aggregate>,
}

impl GroupQuery {
    /// The query for `aggregates` of the groups of `keys`; `None` if it needs more than columns of supported types.
    pub fn new(keys: Vec<String>, aggregates: Vec<Aggregate>, schema: &Schema) -> Option<GroupQuery> {
        let is_supported = |aggregate: &Aggregate| match (&aggregate.column, aggregate.measure) {
            (None, _) => aggregate.argument == "*",
            (Some(name), Measure::Count) => schema.contains(name),
            (Some(name), _) => Kind::of(name, schema) == Some(Kind::Number),
        };
        let keys = keys.into_iter().map(|key| Kind::of(&key, schema).map(|kind| (key, kind))).collect::<Option<_>>()?;
        aggregates.iter().all(is_supported).then_some(GroupQuery { keys, aggregates })
    }

    /// The columns to read.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        let measured = self.aggregates.iter().filter_map(|aggregate| aggregate.column.as_deref());
        self.keys.iter().map(|(name, _)| name.as_str()).chain(measured)
    }
}

/// The code of a missing value: the bits of a NaN that no number has after [`bits`].
const MISSING: u64 = u64::MAX;

/// The bits of a number as the code of its value; zero has one sign and NaN one pattern.
fn bits(number: f64) -> u64 {
    if number.is_nan() { f64::NAN.to_bits() } else { (number + 0.0).to_bits() }
}

/// The codes of the values of `rows`: the bits of a number, 0 or 1 of a flag, the place of a word among `words`.
fn codes(array: &dyn Array, rows: &[u32], words: &mut IndexSet<String>) -> Vec<u64> {
    let rows = rows.iter().map(|&row| row as usize);
    if let Some(numbers) = array.as_primitive_opt::<Float64Type>() {
        return rows.map(|row| if numbers.is_null(row) { MISSING } else { bits(numbers.value(row)) }).collect();
    }
    if let Some(flags) = array.as_boolean_opt() {
        return rows.map(|row| if flags.is_null(row) { MISSING } else { u64::from(flags.value(row)) }).collect();
    }
    let keys = array.as_dictionary::<Int32Type>();
    let words = keys.values().as_string::<i32>().iter().map(|word| Some(words.insert_full(word?.to_owned()).0 as u64));
    let known: Vec<u64> = words.map(|place| place.unwrap_or(MISSING)).collect();
    rows.map(|row| keys.key(row).and_then(|key| known.get(key)).copied().unwrap_or(MISSING)).collect()
}

/// Groups during aggregation.
pub struct GroupAggregation<'a> {
    groups: &'a GroupQuery,
    /// The words of each key.
    words: Vec<IndexSet<String>>,
    /// The groups of the first keys, by those of one key less and the code of the value of the next.
    pairs: Vec<IndexSet<(u32, u64)>>,
    states: Vec<Vec<AggregateState>>,
}

#[derive(Debug, Clone, Copy)]
struct AggregateState {
    count: i64,
    number: f64,
}

impl<'a> GroupAggregation<'a> {
    /// An aggregation without rows.
    pub fn new(groups: &'a GroupQuery) -> GroupAggregation<'a> {
        let keys = groups.keys.len();
        let mut aggregation = GroupAggregation {
            groups,
            words: vec![IndexSet::new(); keys],
            pairs: vec![IndexSet::new(); keys],
            states: vec![Vec::new(); groups.aggregates.len()],
        };
        aggregation.grow();
        aggregation
    }

    /// The number of groups; without keys, all rows are one.
    fn count(&self) -> usize {
        self.pairs.last().map_or(1, IndexSet::len)
    }

    fn grow(&mut self) {
        let count = self.count();
        for (aggregate, states) in self.groups.aggregates.iter().zip(&mut self.states) {
            let number = if aggregate.measure == Measure::Sum { 0.0 } else { f64::NAN };
            states.resize(count, AggregateState { count: 0, number });
        }
    }

    /// Adds the `kept` rows of a batch.
    pub fn add(&mut self, batch: &RecordBatch, kept: &[bool]) {
        let rows: Vec<u32> = (0..).zip(kept).filter(|(_, kept)| **kept).map(|(row, _)| row).collect();
        let ids = self.ids(batch, &rows);
        self.grow();
        for (aggregate, states) in self.groups.aggregates.iter().zip(&mut self.states) {
            let array = aggregate.column.as_ref().and_then(|name| batch.column_by_name(name));
            let Some(array) = array else {
                ids.iter().for_each(|&id| states[id as usize].count += 1);
                continue;
            };
            let cells = ids.iter().zip(&rows).filter(|(_, row)| array.is_valid(**row as usize));
            if aggregate.measure == Measure::Count {
                cells.for_each(|(&id, _)| states[id as usize].count += 1);
                continue;
            }
            let numbers = array.as_primitive::<Float64Type>().values();
            let cells = cells.map(|(&id, &row)| (id as usize, numbers[row as usize]));
            match aggregate.measure {
                Measure::Sum => cells.for_each(|(id, number)| {
                    states[id].count += 1;
                    states[id].number += number;
                }),
                Measure::Least => tally(cells, states, |number, least| number < least),
                _ => tally(cells, states, |number, greatest| number > greatest),
            }
        }
    }

    /// The groups of `rows`.
    fn ids(&mut self, batch: &RecordBatch, rows: &[u32]) -> Vec<u32> {
        let mut ids: Vec<u32> = vec![0; rows.len()];
        for (index, (name, _)) in self.groups.keys.iter().enumerate() {
            let Some(array) = batch.column_by_name(name) else { continue };
            let codes = codes(array.as_ref(), rows, &mut self.words[index]);
            let pairs = &mut self.pairs[index];
            // Axes change rarely from row to row.
            let mut last: Option<((u32, u64), u32)> = None;
            for (id, code) in ids.iter_mut().zip(codes) {
                let pair = (*id, code);
                *id = match last {
                    Some((known, group)) if known == pair => group,
                    _ => {
                        let group = pairs.insert_full(pair).0 as u32;
                        last = Some((pair, group));
                        group
                    }
                };
            }
        }
        ids
    }

    /// The groups as a table: columns `__g0`, `__g1`, ... of keys, and `__a0`, `__a1`, ... of aggregates.
    pub fn frame(self) -> PolarsResult<DataFrame> {
        let mut columns: Vec<Column> = Vec::new();
        for ((index, (_, kind)), codes) in self.groups.keys.iter().enumerate().zip(self.codes()) {
            let name = format!("__g{index}").into();
            let values = codes.into_iter().map(|code| (code != MISSING).then_some(code));
            columns.push(match kind {
                Kind::Word => {
                    let word = |code: u64| self.words[index].get_index(code as usize);
                    StringChunked::from_iter_options(name, values.map(|code| word(code?))).into_column()
                }
                Kind::Number => {
                    Float64Chunked::from_iter_options(name, values.map(|code| code.map(f64::from_bits))).into_column()
                }
                Kind::Flag => {
                    BooleanChunked::from_iter_options(name, values.map(|code| code.map(|code| code != 0))).into_column()
                }
            });
        }
        for (index, (aggregate, states)) in self.groups.aggregates.iter().zip(&self.states).enumerate() {
            let name = format!("__a{index}").into();
            columns.push(match aggregate.measure {
                Measure::Count => {
                    Int64Chunked::from_iter_values(name, states.iter().map(|tally| tally.count)).into_column()
                }
                _ => {
                    let number = |tally: &AggregateState| (tally.count > 0).then_some(tally.number);
                    Float64Chunked::from_iter_options(name, states.iter().map(number)).into_column()
                }
            });
        }
        DataFrame::new(self.count(), columns)
    }

    /// The codes of the values of each key, group by group.
    fn codes(&self) -> Vec<Vec<u64>> {
        let mut codes = vec![vec![0; self.count()]; self.pairs.len()];
        for group in 0..self.count() {
            let mut id = group as u32;
            for (pairs, codes) in self.pairs.iter().zip(&mut codes).rev() {
                if let Some(&(rest, code)) = pairs.get_index(id as usize) {
                    (codes[group], id) = (code, rest);
                }
            }
        }
        codes
    }
}

/// Keeps the number that is `better` in each group; NaN is better than no number.
fn tally(cells: impl Iterator<Item = (usize, f64)>, states: &mut [AggregateState], better: impl Fn(f64, f64) -> bool) {
    for (id, number) in cells {
        let tally = &mut states[id];
        if tally.number.is_nan() || better(number, tally.number) {
            tally.number = number;
        }
        tally.count += 1;
    }
}
