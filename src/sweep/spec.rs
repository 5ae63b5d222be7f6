//! The spec: keys and types, without checks of values.

use std::fmt;
use std::path::PathBuf;

use indexmap::IndexMap;
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};

use crate::model::Friction;
use crate::table;

/// A sweep spec.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(from = "Written")]
pub struct Spec {
    /// Name of the dataset and of its folder; empty if the spec has none.
    pub name: String,
    /// Description of the sweep.
    pub description: String,
    /// The grid, if it is not in blocks.
    pub top: BlockSpec,
    /// Blocks of a union of grids, each with its own axes.
    pub block: Vec<BlockSpec>,
    /// Model and units.
    pub model: ModelSpec,
    /// Requested accuracy.
    pub accuracy: AccuracySpec,
    /// The tables to write.
    pub tables: IndexMap<String, TableSpec>,
}

/// The keys of a spec, with those of its block at the top level.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Written {
    name: String,
    description: String,
    points: Option<PathBuf>,
    zip: Vec<Vec<String>>,
    r#where: Option<String>,
    block: Vec<BlockSpec>,
    model: ModelSpec,
    accuracy: AccuracySpec,
    axes: IndexMap<String, AxisSpec>,
    tables: IndexMap<String, TableSpec>,
}

impl From<Written> for Spec {
    fn from(written: Written) -> Spec {
        let Written { name, description, points, zip, r#where: condition, block, model, accuracy, axes, tables } =
            written;
        Spec { name, description, top: BlockSpec { points, zip, condition, axes }, block, model, accuracy, tables }
    }
}

/// A key of `[[block]]`, or of the top level of a spec without blocks.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BlockSpec {
    /// A file of points whose columns are axes that vary together, and labels; relative to the spec.
    pub points: Option<PathBuf>,
    /// Axes that advance together.
    pub zip: Vec<Vec<String>>,
    /// Condition of the points to keep.
    #[serde(rename = "where")]
    pub condition: Option<String>,
    /// The axes, the last varies fastest.
    pub axes: IndexMap<String, AxisSpec>,
}

impl Spec {
    /// The blocks of the grid, and the prefix of the keys of each: those of the spec, or its top level.
    pub fn blocks(&self) -> impl Iterator<Item = (String, &BlockSpec)> {
        let top = self.block.is_empty().then(|| (String::new(), &self.top));
        let blocks = self.block.iter().enumerate().map(|(number, block)| (format!("block[{number}]."), block));
        top.into_iter().chain(blocks)
    }

    /// The accuracy of the table `name`, which may be a reduction of `gap`.
    pub fn rtol_of(&self, name: &str) -> f64 {
        let own = self.tables.get(if table::is_reduced(name) { "gap" } else { name }).and_then(|table| table.rtol);
        own.or_else(|| table::find(name)?.default_rtol()).unwrap_or(self.accuracy.rtol)
    }
}

/// `[model]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ModelSpec {
    /// Whether optimal protocols obey `v >= 1`.
    pub velocity_bound: bool,
    /// Form of the direct effect of friction.
    pub friction: String,
    /// Units of the values.
    pub units: String,
    /// Friction coefficient, for SI units.
    pub mu_0: Option<f64>,
    /// Length in m, for SI units.
    pub l: Option<f64>,
    /// Velocity in m/s, for SI units.
    pub v_0: Option<f64>,
    /// Normal stress in Pa, for SI units.
    pub normal_stress: Option<f64>,
}

impl Default for ModelSpec {
    fn default() -> Self {
        ModelSpec {
            velocity_bound: true,
            friction: Friction::default().name().to_owned(),
            units: "dimensionless".to_owned(),
            mu_0: None,
            l: None,
            v_0: None,
            normal_stress: None,
        }
    }
}

/// `[accuracy]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AccuracySpec {
    /// Relative accuracy of the numbers.
    pub rtol: f64,
}

impl Default for AccuracySpec {
    fn default() -> Self {
        AccuracySpec { rtol: 1e-10 }
    }
}

/// The value of a key of `[axes]`.
#[derive(Debug, Clone, PartialEq)]
pub enum AxisSpec {
    /// One value.
    One(AxisValue),
    /// Values one by one.
    List(Vec<AxisValue>),
    /// A range, or values with a unit.
    Form(AxisForm),
}

/// A value of an axis.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged, expecting = "a number or a word")]
pub enum AxisValue {
    /// A number.
    Number(f64),
    /// A word.
    Word(String),
}

/// An axis written as a table.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AxisForm {
    /// `[first, last, count]`, evenly spaced.
    pub linspace: Option<Vec<f64>>,
    /// `[first, last, count]`, evenly spaced in the logarithm.
    pub geomspace: Option<Vec<f64>>,
    /// Unit of the values.
    pub unit: Option<String>,
    /// An expression of other axes.
    pub expr: Option<String>,
    /// `[least, greatest, count]`, from a Sobol sequence.
    pub sobol: Option<Vec<f64>>,
    /// `[least, greatest, count]`, from a Latin hypercube.
    pub lhs: Option<Vec<f64>>,
    /// Seed of a sampled axis.
    pub seed: Option<i64>,
}

/// The value of a key of `[tables]`.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TableSpec {
    /// The columns to compute and write; all by default.
    pub columns: Option<Vec<String>>,
    /// Accuracy of this table.
    pub rtol: Option<f64>,
    /// Reduction of each landscape of `gap` to one row.
    pub reduce: Option<String>,
}

impl<'de> Deserialize<'de> for AxisSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<AxisSpec, D::Error> {
        struct Forms;

        impl<'de> Visitor<'de> for Forms {
            type Value = AxisSpec;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, a list of numbers or a range such as { linspace = [first, last, count] }")
            }

            fn visit_i64<E>(self, number: i64) -> Result<AxisSpec, E> {
                Ok(AxisSpec::One(AxisValue::Number(number as f64)))
            }

            fn visit_f64<E>(self, number: f64) -> Result<AxisSpec, E> {
                Ok(AxisSpec::One(AxisValue::Number(number)))
            }

            fn visit_str<E>(self, word: &str) -> Result<AxisSpec, E> {
                Ok(AxisSpec::One(AxisValue::Word(word.to_owned())))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, values: A) -> Result<AxisSpec, A::Error> {
                Deserialize::deserialize(SeqAccessDeserializer::new(values)).map(AxisSpec::List)
            }

            fn visit_map<A: MapAccess<'de>>(self, keys: A) -> Result<AxisSpec, A::Error> {
                Deserialize::deserialize(MapAccessDeserializer::new(keys)).map(AxisSpec::Form)
            }
        }

        deserializer.deserialize_any(Forms)
    }
}
