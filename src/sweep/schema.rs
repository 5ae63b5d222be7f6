//! The JSON Schema of a spec, for editors and validators: axes, units, ranges, tables and columns from their definitions.
//!
//! It detects faults of single keys. The check finds faults of several keys or of a file.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use super::axis::{MAX_COUNT, unit_name};
use super::check::MAX_NAME_BYTES;
use super::spec::AccuracySpec;
use crate::grid::{Design, Domain, Quantity, RTOL, Scale};
use crate::model::{Friction, Scales, Units};
use crate::table::{self, STATUS, Table};

/// The schema, in draft 7, which editors support.
pub fn schema() -> Value {
    // The values of the scales do not matter here.
    let si = Units::Si(Scales { mu_0: 1.0, l: 1.0, v_0: 1.0, normal_stress: 1.0 });
    let grid = grid();
    let mut properties = own();
    properties["block"] = json!({
        "type": "array",
        "minItems": 1,
        "items": { "type": "object", "additionalProperties": false, "properties": grid },
        "description": "Grids to unite, in order, each with axes of its own",
    });
    properties.as_object_mut().into_iter().for_each(|properties| properties.extend(grid.clone()));
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": format!("Sweep spec of slipsweep {}", env!("CARGO_PKG_VERSION")),
        "type": "object",
        "additionalProperties": false,
        "required": ["name", "tables"],
        "properties": properties,
        "allOf": [units()],
        "definitions": { "axes": axes("The axes", &Units::Scaled), "axes_si": axes("The axes in SI units", &si) },
    })
}

/// An object with the keys of `properties` and no others.
fn keys(description: &str, properties: Value) -> Value {
    json!({ "type": "object", "additionalProperties": false, "description": description, "properties": properties })
}

/// The keys that are also legal in a block.
fn grid() -> Map<String, Value> {
    let points = "A CSV or Parquet file, relative to the spec: one row per point; its columns are axes that vary together, and labels of text";
    let names = json!({ "enum": Quantity::ALL.map(Quantity::name) });
    let zip = json!({ "type": "array", "minItems": 2, "uniqueItems": true, "items": names });
    let zips = "Axes of equal length that advance together, such as [[\"a\", \"b\"]]";
    let condition = "Condition of the points to keep, such as v_f > v_i";
    let ending = "\\.([cC][sS][vV]|[pP][aA][rR][qQ][uU][eE][tT])$";
    let keys = [
        ("zip", json!({ "type": "array", "items": zip, "description": zips })),
        ("where", json!({ "type": "string", "minLength": 1, "description": condition })),
        ("points", json!({ "type": "string", "pattern": ending, "description": points })),
        ("axes", json!({ "type": "object", "description": "The axes, the last varies fastest" })),
    ];
    keys.map(|(key, value)| (key.to_owned(), value)).into_iter().collect()
}

/// The keys that concern the whole spec.
fn own() -> Value {
    let scale = |description: &str| json!({ "type": "number", "exclusiveMinimum": 0.0, "description": description });
    let model = json!({
        "velocity_bound": { "type": "boolean", "default": true, "description": "Whether optimal protocols obey v >= 1" },
        "friction": {
            "enum": Friction::ALL.map(Friction::name),
            "default": Friction::default().name(),
            "description": "Form of the direct effect: a logarithm, or an inverse hyperbolic sine, which holds down to rest",
        },
        "units": {
            "enum": UNIT_SYSTEMS,
            "default": "dimensionless",
            "description": "Units of the values",
        },
        "mu_0": scale("Friction coefficient at v_0, for SI units"),
        "l": scale("Critical slip distance in m, for SI units"),
        "v_0": scale("Reference velocity in m/s, above which the friction law holds, for SI units"),
        "normal_stress": scale("Normal stress in Pa, for SI units"),
    });
    let named: Map<String, Value> =
        table::ALL.map(|table| (table.name().to_owned(), table_of(table))).into_iter().collect();
    let mut tables = keys("The tables to compute; only those that are named are written", Value::Object(named));
    tables["minProperties"] = json!(1);
    json!({
        "name": {
            "type": "string",
            "pattern": "^[A-Za-z0-9_-][A-Za-z0-9._-]*$",
            "maxLength": MAX_NAME_BYTES,
            "description": "Name of the dataset, which goes to results/NAME",
        },
        "description": { "type": "string", "description": "Purpose of the sweep" },
        "model": keys("The model", model),
        "accuracy": keys("Accuracy of the numbers", json!({ "rtol": rtol(Some(AccuracySpec::default().rtol)) })),
        "tables": tables,
    })
}

/// The axes in these units.
fn axes(what: &str, units: &Units) -> Value {
    let names = Quantity::ALL.map(Quantity::name).join(", ");
    let description = format!("{what}, {names}: a Cartesian product, the last varies fastest");
    let axes = Quantity::ALL.map(|quantity| (quantity.name().to_owned(), axis(quantity, units)));
    keys(&description, Value::Object(axes.into_iter().collect()))
}

/// The words for systems of units; the check ignores the case of letters.
const UNIT_SYSTEMS: [&str; 3] = ["dimensionless", "si", "SI"];

/// The condition of the units: SI units need the four scales.
fn units() -> Value {
    let is_si = json!({ "required": ["units"], "properties": { "units": { "enum": UNIT_SYSTEMS[1..] } } });
    let both = |axes: &str, model: Value| {
        let axes = json!({ "$ref": axes });
        let block = json!({ "items": { "properties": { "axes": axes } } });
        json!({ "properties": { "model": model, "axes": axes, "block": block } })
    };
    json!({
        "if": { "required": ["model"], "properties": { "model": is_si } },
        "then": both("#/definitions/axes_si", json!({ "required": ["mu_0", "l", "v_0", "normal_stress"] })),
        "else": both("#/definitions/axes", json!({})),
    })
}

/// The schema of a value of `[axes]`.
fn axis(quantity: Quantity, units: &Units) -> Value {
    let words = quantity.words();
    let list = |one: &Value| json!({ "type": "array", "minItems": 1, "items": one });
    if !words.is_empty() {
        let one = json!({ "enum": words });
        return json!({ "description": quantity.doc(), "anyOf": [one, list(&one)] });
    }
    let mut one = legal(quantity, units);
    if quantity.domain().contains(f64::INFINITY) {
        // JSON has no infinity: readers of TOML make null of `inf`, which nothing else in TOML becomes.
        one["type"] = json!(["number", "null"]);
    }
    let unit = quantity.unit(Scale::Model);
    let scaled = if *units == Units::Scaled { String::new() } else { format!(" in units of {unit}") };
    let description = format!("{}; in {}; {}{scaled}", quantity.doc(), units.name(unit), quantity.domain());
    json!({ "description": description, "anyOf": [one, list(&one), form(quantity, units)] })
}

/// The schema of a number of `quantity`; without its range in SI units, since the schema does not know the scales.
fn legal(quantity: Quantity, units: &Units) -> Value {
    if *units == Units::Scaled { number(&quantity.domain()) } else { json!({ "type": "number" }) }
}

/// The schema of a number in this range; from 0 on if 0 is an isolated value, which would need two ranges.
fn number(domain: &Domain) -> Value {
    let least = if domain.apart == Some(0.0) { 0.0 } else { domain.least };
    let lower = if domain.least_excluded { "exclusiveMinimum" } else { "minimum" };
    json!({ "type": "number", lower: least, "maximum": domain.greatest })
}

/// A range, with its unit.
fn form(quantity: Quantity, units: &Units) -> Value {
    let end = legal(quantity, units);
    let triple = |least: u64, most: u64, description: &str| {
        let count = json!({ "type": "integer", "minimum": least, "maximum": most });
        json!({
            "type": "array",
            "items": [end, end, count],
            "minItems": 3,
            "maxItems": 3,
            "description": description,
        })
    };
    let range =
        |how: &str| triple(2, MAX_COUNT, &format!("[first, last, count], evenly spaced{how}, both ends included"));
    let sample = |design: Design, kind: &str| {
        triple(1, design.most(), &format!("[least, greatest, count], a {kind}, joint over all such axes"))
    };
    let names: Vec<&str> = quantity.scales().iter().map(|scale| unit_name(units, quantity, *scale)).collect();
    let expression = "Computed from other axes at every point, such as 10 * v_i";
    let forms = ["linspace", "geomspace", "expr", "sobol", "lhs"];
    let seed = "Seed of sobol or lhs, one for all axes of a sample";
    json!({
        "type": "object",
        "additionalProperties": false,
        "properties": {
            "linspace": range(""),
            "geomspace": range(" in the logarithm"),
            "expr": { "type": "string", "minLength": 1, "description": expression },
            "sobol": sample(Design::Sobol, "Sobol sequence"),
            "lhs": sample(Design::LatinHypercube, "Latin hypercube"),
            "seed": { "type": "integer", "minimum": 0, "maximum": u32::MAX, "description": seed },
            "unit": { "enum": names, "description": "Unit of the values" },
        },
        "oneOf": forms.map(|form| json!({ "required": [form] })),
    })
}

/// The schema of a value of `[tables]`.
fn table_of(table: &Table) -> Value {
    let reductions = if table.name() == "gap" { &table::REDUCED[..] } else { &[] };
    let reduced = reductions.iter().flat_map(|(_, table)| table.columns());
    let columns: BTreeSet<&str> =
        table.columns().iter().chain(reduced).map(|column| column.name).chain([STATUS]).collect();
    let meanings: Vec<String> =
        table.columns().iter().map(|column| format!("{}: {}", column.name, column.doc)).collect();
    let description = format!("Only these columns are computed and written\n{}", meanings.join("\n"));
    let items = json!({ "enum": columns });
    let chosen =
        json!({ "type": "array", "minItems": 1, "uniqueItems": true, "items": items, "description": description });
    let mut known = keys(table.doc(), json!({ "columns": chosen, "rtol": rtol(table.default_rtol()) }));
    if !reductions.is_empty() {
        let words: Vec<&str> = reductions.iter().map(|(word, _)| *word).collect();
        let description =
            "Write one row for each transition and duration; `columns` are then those of the reduced table";
        known["properties"]["reduce"] = json!({ "enum": words, "description": description });
    }
    known
}

/// An accuracy, with its default if it has one of its own.
fn rtol(default: Option<f64>) -> Value {
    let mut rtol = number(&RTOL);
    rtol["description"] = json!(format!("Relative accuracy of the numbers, {RTOL}"));
    if let Some(default) = default {
        rtol["default"] = json!(default);
    }
    rtol
}
