//! A cell of a table, as a reader sees it and as a footer keeps it.

use std::borrow::Cow;

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, RecordBatch};
use serde::{Deserialize, Serialize};

/// A cell. In JSON it is `null`, a number as text (so that every bit of it stays, and infinity can be written), or a list of one word.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    /// Null.
    Missing,
    /// A number.
    Number(#[serde(with = "exact")] f64),
    /// A word.
    Word(#[serde(with = "single")] String),
}

impl Cell {
    /// Whether two cells hold the same, zeros of different sign apart.
    pub fn is_same(&self, other: &Cell) -> bool {
        match (self, other) {
            (Cell::Number(one), Cell::Number(other)) => one.to_bits() == other.to_bits(),
            _ => self == other,
        }
    }

    /// The number in it.
    pub fn number(&self) -> Option<f64> {
        if let Cell::Number(number) = self { Some(*number) } else { None }
    }
}

/// The cells of the first row of `batch`.
pub fn first_row(batch: &RecordBatch) -> Vec<Cell> {
    let cell = |array: &dyn Array| {
        if array.is_empty() || array.is_null(0) {
            None
        } else if let Some(numbers) = array.as_primitive_opt::<Float64Type>() {
            Some(Cell::Number(numbers.value(0)))
        } else if let Some(flags) = array.as_boolean_opt() {
            Some(Cell::Word(if flags.value(0) { "yes" } else { "no" }.to_owned()))
        } else {
            let words = array.as_dictionary_opt::<Int32Type>()?;
            let word = words.values().as_string_opt::<i32>()?.value(words.key(0)?);
            Some(Cell::Word(word.to_owned()))
        }
    };
    batch.columns().iter().map(|array| cell(array).unwrap_or(Cell::Missing)).collect()
}

/// A number as text: the shortest one that is read as the same double.
pub mod exact {
    use super::{Cow, Deserialize};
    use serde::{Deserializer, Serializer, de::Error};

    /// Writes it.
    pub fn serialize<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{number:?}"))
    }

    /// Reads it.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Cow::<str>::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

/// A word as a list of one, which distinguishes it from a number.
mod single {
    use super::Deserialize;
    use serde::{Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(word: &str, serializer: S) -> Result<S::Ok, S::Error> {
        [word].serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
        <[String; 1]>::deserialize(deserializer).map(|[word]| word)
    }
}
