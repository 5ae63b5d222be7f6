//! A cell of a table, for display and for footers.

use std::borrow::Cow;

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, RecordBatch};
use serde::{Deserialize, Serialize};

/// A cell. In JSON it is `null`, a number as text (which preserves every bit and infinity), or a list of one word.
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
    /// Whether two cells are equal; zeros of different sign differ.
    pub fn is_same(&self, other: &Cell) -> bool {
        match (self, other) {
            (Cell::Number(one), Cell::Number(other)) => one.to_bits() == other.to_bits(),
            _ => self == other,
        }
    }

    /// The number of the cell, if it is one.
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

/// A number as text: the shortest text that determines the double.
pub mod exact {
    use super::{Cow, Deserialize};
    use serde::{Deserializer, Serializer, de::Error};

    /// Serialises a number.
    pub fn serialize<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{number:?}"))
    }

    /// Deserialises a number.
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
