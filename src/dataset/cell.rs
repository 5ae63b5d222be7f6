//! Cells of a table, for display and for footers.

use std::borrow::Cow;

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::DataType;
use serde::{Deserialize, Serialize};

use super::layout::label;

/// A cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Cell {
    /// Null.
    Missing,
    /// A number.
    Number(#[serde(with = "exact")] f64),
    /// A word.
    Word(String),
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

/// The cells of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// Numbers; NaN for null.
    Numbers(Vec<f64>),
    /// Indices into a list of words; `None` for null.
    Words(Vec<Option<u32>>, Vec<String>),
}

impl Cells {
    /// An empty column of this type; `None` for a type that no table has.
    pub(super) fn none(kind: &DataType) -> Option<Cells> {
        match kind {
            DataType::Float64 => Some(Cells::Numbers(Vec::new())),
            DataType::Boolean => Some(Cells::Words(Vec::new(), ["false", "true"].map(str::to_owned).into())),
            kind if *kind == label() => Some(Cells::Words(Vec::new(), Vec::new())),
            _ => None,
        }
    }

    /// Appends an array of the same type.
    pub(super) fn extend(&mut self, array: &dyn Array) {
        match self {
            Cells::Numbers(numbers) => {
                let Some(array) = array.as_primitive_opt::<Float64Type>() else { return };
                match array.null_count() {
                    0 => numbers.extend_from_slice(array.values()),
                    _ => numbers.extend(array.iter().map(|cell| cell.unwrap_or(f64::NAN))),
                }
            }
            Cells::Words(places, words) => {
                if let Some(flags) = array.as_boolean_opt() {
                    places.extend(flags.iter().map(|flag| flag.map(u32::from)));
                } else if let Some(array) = array.as_dictionary_opt::<Int32Type>()
                    && let Some(values) = array.values().as_string_opt::<i32>()
                {
                    // The indices of the words of the array among the words of the column.
                    let here: Vec<u32> = values.iter().map(|word| place(words, word.unwrap_or_default())).collect();
                    let cell = |key: i32| here.get(usize::try_from(key).ok()?).copied();
                    places.extend(array.keys().iter().map(|key| cell(key?)));
                }
            }
        }
    }

    /// The cell of a row.
    pub(super) fn cell(&self, row: usize) -> Cell {
        match self {
            Cells::Numbers(numbers) => {
                numbers.get(row).filter(|number| !number.is_nan()).map_or(Cell::Missing, |number| Cell::Number(*number))
            }
            Cells::Words(places, words) => {
                let word = places.get(row).copied().flatten().and_then(|place| words.get(place as usize));
                word.map_or(Cell::Missing, |word| Cell::Word(word.clone()))
            }
        }
    }
}

/// The index of a word, which is added if it is new.
fn place(words: &mut Vec<String>, word: &str) -> u32 {
    let found = words.iter().position(|known| known == word);
    found.unwrap_or_else(|| {
        words.push(word.to_owned());
        words.len() - 1
    }) as u32
}

/// The cells of the first row of `batch`.
pub fn first_row(batch: &RecordBatch) -> Vec<Cell> {
    let first = |array: &ArrayRef| {
        let mut cells = Cells::none(array.data_type())?;
        cells.extend(array);
        Some(cells.cell(0))
    };
    batch.columns().iter().map(|array| first(array).unwrap_or(Cell::Missing)).collect()
}

/// A number as text in JSON: the shortest text that determines the double, which preserves infinity, too.
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
