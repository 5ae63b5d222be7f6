//! The spec as it is written: its keys and their types, and nothing about what is legal.

use std::fmt;
use std::path::PathBuf;

use indexmap::IndexMap;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A sweep spec.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// Name of the dataset and of its folder.
    pub name: String,
    /// What the sweep is for.
    #[serde(default)]
    pub description: String,
    /// A file of points whose columns are axes that vary together, and labels; relative to the spec.
    pub points: Option<PathBuf>,
    /// Axes that advance together.
    #[serde(default)]
    pub zip: Vec<Vec<String>>,
    /// Condition of the points to keep.
    #[serde(rename = "where")]
    pub condition: Option<String>,
    /// Grids to unite, each with axes of its own.
    #[serde(default)]
    pub block: Vec<BlockSpec>,
    /// What is modelled.
    #[serde(default)]
    pub model: ModelSpec,
    /// How accurate the numbers are.
    #[serde(default)]
    pub accuracy: AccuracySpec,
    /// The axes, the last varies fastest.
    #[serde(default)]
    pub axes: IndexMap<String, AxisSpec>,
    /// The tables to write.
    #[serde(default)]
    pub tables: IndexMap<String, TableSpec>,
}

/// A key of `[[block]]`, or of the top level of a spec without blocks.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
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
    /// The top level as a block.
    pub fn top(&self) -> BlockSpec {
        BlockSpec {
            points: self.points.clone(),
            zip: self.zip.clone(),
            condition: self.condition.clone(),
            axes: self.axes.clone(),
        }
    }

    /// An axis as it is written where it is met first.
    pub fn axis(&self, name: &str) -> Option<&AxisSpec> {
        self.axes.get(name).or_else(|| self.block.iter().find_map(|block| block.axes.get(name)))
    }
}

/// `[model]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ModelSpec {
    /// Whether optimal protocols obey `v >= 1`.
    pub velocity_bound: bool,
    /// Units of the values.
    pub units: String,
    /// Friction coefficient, for SI units.
    pub mu_0: Option<f64>,
    /// Length in m, for SI units.
    pub l: Option<f64>,
    /// Velocity in m/s, for SI units.
    pub v_0: Option<f64>,
    /// Normal load in Pa, for SI units.
    pub normal_load: Option<f64>,
}

impl Default for ModelSpec {
    fn default() -> Self {
        ModelSpec {
            velocity_bound: true,
            units: "dimensionless".to_owned(),
            mu_0: None,
            l: None,
            v_0: None,
            normal_load: None,
        }
    }
}

/// `[accuracy]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
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
#[derive(Debug, Clone, PartialEq)]
pub enum AxisValue {
    /// A number.
    Number(f64),
    /// A word.
    Word(String),
}

/// An axis written as a table.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
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
#[serde(deny_unknown_fields, default)]
pub struct TableSpec {
    /// The columns to compute and write; all by default.
    pub columns: Option<Vec<String>>,
    /// Accuracy of this table.
    pub rtol: Option<f64>,
    /// What to write of each landscape instead of its rows; of `gap` alone.
    pub reduce: Option<String>,
}

impl<'de> Deserialize<'de> for AxisSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AxisVisitor)
    }
}

struct AxisVisitor;

impl<'de> Visitor<'de> for AxisVisitor {
    type Value = AxisSpec;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, a list of numbers or a range such as { linspace = [first, last, count] }")
    }

    fn visit_f64<E>(self, value: f64) -> Result<AxisSpec, E> {
        Ok(AxisSpec::One(AxisValue::Number(value)))
    }

    fn visit_i64<E>(self, value: i64) -> Result<AxisSpec, E> {
        Ok(AxisSpec::One(AxisValue::Number(value as f64)))
    }

    fn visit_str<E>(self, word: &str) -> Result<AxisSpec, E> {
        Ok(AxisSpec::One(AxisValue::Word(word.to_owned())))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, values: A) -> Result<AxisSpec, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(values)).map(AxisSpec::List)
    }

    fn visit_map<A: MapAccess<'de>>(self, form: A) -> Result<AxisSpec, A::Error> {
        AxisForm::deserialize(MapAccessDeserializer::new(form)).map(AxisSpec::Form)
    }
}

impl<'de> Deserialize<'de> for AxisValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ValueVisitor)
    }
}

struct ValueVisitor;

impl Visitor<'_> for ValueVisitor {
    type Value = AxisValue;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number")
    }

    fn visit_f64<E>(self, value: f64) -> Result<AxisValue, E> {
        Ok(AxisValue::Number(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<AxisValue, E> {
        Ok(AxisValue::Number(value as f64))
    }

    fn visit_str<E>(self, word: &str) -> Result<AxisValue, E> {
        Ok(AxisValue::Word(word.to_owned()))
    }
}
