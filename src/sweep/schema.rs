//! The JSON Schema of a spec, for editors and validators: axes, units, ranges, tables and columns from their definitions.
//!
//! It refuses what can be told key by key; what takes two keys or a file to see is left to the check.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use super::check::LONGEST_NAME;
use crate::grid::{Design, Domain, Quantity, RTOL, Scale};
use crate::model::{Scales, Units};
use crate::table::{self, STATUS, Table};

/// The schema, in draft 7, which editors know.
pub fn schema() -> Value {
    let grid = grid();
    let grid_keys = grid.each_ref().map(|(key, _)| *key);
    let block = json!({
        "type": "array",
        "minItems": 1,
        "items": { "type": "object", "additionalProperties": false, "properties": object(grid.clone()) },
        "description": "Grids to unite, in order, each with axes of its own",
    });
    // What the scales are does not matter to a schema.
    let si = Units::Si(Scales { mu_0: 1.0, l: 1.0, v_0: 1.0, normal_load: 1.0 });
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": format!("Sweep spec of slipsweep {}", env!("CARGO_PKG_VERSION")),
        "type": "object",
        "additionalProperties": false,
        "required": ["name", "tables"],
        "properties": object(own().into_iter().chain(grid).chain([("block", block)])),
        "allOf": table::ALL.map(needs).into_iter().chain([units()]).collect::<Vec<Value>>(),
        // Everything about the grid is in the blocks, if there are any.
        "dependencies": { "block": { "not": { "anyOf": grid_keys.map(|key| json!({ "required": [key] })) } } },
        "definitions": { "axes": axes("The axes", &Units::Scaled), "axes_si": axes("The axes in SI units", &si) },
    })
}

/// A table of TOML with these keys and no others.
fn keys<'a>(description: &str, properties: impl IntoIterator<Item = (&'a str, Value)>) -> Value {
    json!({
        "type": "object",
        "additionalProperties": false,
        "description": description,
        "properties": object(properties),
    })
}

/// The keys that may also stand in a block.
fn grid() -> [(&'static str, Value); 4] {
    let points = "A CSV or Parquet file, relative to the spec: one row a point; its columns are axes that vary together, and labels of text";
    let condition = "Condition of the points to keep, such as v_f > v_i";
    let zip = json!({
        "type": "array",
        "items": { "type": "array", "minItems": 2, "uniqueItems": true, "items": { "enum": Quantity::ALL.map(Quantity::name) } },
        "description": "Axes of equal length that advance together, such as [[\"a\", \"b\"]]",
    });
    let ending = "\\.([cC][sS][vV]|[pP][aA][rR][qQ][uU][eE][tT])$";
    [
        ("zip", zip),
        ("where", json!({ "type": "string", "minLength": 1, "description": condition })),
        ("points", json!({ "type": "string", "pattern": ending, "description": points })),
        ("axes", json!({ "type": "object", "description": "The axes, the last varies fastest" })),
    ]
}

/// The keys that concern the whole spec.
fn own() -> [(&'static str, Value); 5] {
    let name = json!({
        "type": "string",
        "pattern": "^[A-Za-z0-9_-][A-Za-z0-9._-]*$",
        "maxLength": LONGEST_NAME,
        "description": "Name of the dataset, which goes to results/NAME",
    });
    let bound = json!({ "type": "boolean", "default": true, "description": "Whether optimal protocols obey v >= 1" });
    let units = json!({
        "anyOf": [{ "enum": ["dimensionless", "si"] }, { "pattern": any_case("dimensionless") }, { "pattern": any_case("si") }],
        "type": "string",
        "default": "dimensionless",
        "description": "Units of the values",
    });
    let scale = |description: &str| json!({ "type": "number", "exclusiveMinimum": 0.0, "description": description });
    let model = [
        ("velocity_bound", bound),
        ("units", units),
        ("mu_0", scale("Friction coefficient at v_0, for SI units")),
        ("l", scale("Length over which contacts are renewed in m, for SI units")),
        ("v_0", scale("Velocity from which on the friction law holds in m/s, for SI units")),
        ("normal_load", scale("Normal load in Pa, for SI units")),
    ];
    let named = table::ALL.map(|table| (table.name(), table_of(table)));
    let mut tables = keys("The tables to compute; only those that are named are written", named);
    tables["minProperties"] = json!(1);
    [
        ("name", name),
        ("description", json!({ "type": "string", "description": "What the sweep is for" })),
        ("model", keys("What is modelled", model)),
        ("accuracy", keys("How accurate the numbers are", [("rtol", rtol(json!(1e-10)))])),
        ("tables", tables),
    ]
}

/// The axes in these units.
fn axes(what: &str, units: &Units) -> Value {
    let names = Quantity::ALL.map(Quantity::name).join(", ");
    let description = format!("{what}, {names}: a Cartesian product, the last varies fastest");
    keys(&description, Quantity::ALL.map(|quantity| (quantity.name(), axis(quantity, units))))
}

/// Which axes are meant: those in SI units go with the four scales, the others without.
fn units() -> Value {
    let scales = ["mu_0", "l", "v_0", "normal_load"];
    let both = |axes: Value, model: Value| {
        json!({
            "properties": { "model": model, "axes": axes, "block": { "items": { "properties": { "axes": axes } } } },
        })
    };
    json!({
        "if": { "required": ["model"], "properties": { "model": { "required": ["units"], "properties": { "units": { "type": "string", "pattern": any_case("si") } } } } },
        "then": both(json!({ "$ref": "#/definitions/axes_si" }), json!({ "required": scales })),
        "else": both(
            json!({ "$ref": "#/definitions/axes" }),
            json!({ "not": { "anyOf": scales.map(|scale| json!({ "required": [scale] })) } }),
        ),
    })
}

/// A pattern of `word` in letters of any case.
fn any_case(word: &str) -> String {
    let letters = word.chars().map(|letter| format!("[{letter}{}]", letter.to_ascii_uppercase()));
    format!("^{}$", letters.collect::<String>())
}

fn object<'a>(entries: impl IntoIterator<Item = (&'a str, Value)>) -> Value {
    Value::Object(entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
}

/// A table lacks no axis, unless the axes may come from elsewhere.
fn needs(table: &dyn Table) -> Value {
    let axes = table.axes().iter().filter(|axis| axis.default().is_empty());
    let axes: Vec<&str> = axes.map(|axis| axis.name()).collect();
    let there = json!([
        { "required": ["axes"], "properties": { "axes": { "required": axes } } },
        { "required": ["points"] },
    ]);
    json!({
        "if": { "required": ["tables"], "properties": { "tables": { "required": [table.name()] } } },
        "then": {
            "if": { "required": ["block"] },
            "then": { "properties": { "block": { "items": { "anyOf": there } } } },
            "else": { "anyOf": there },
        },
    })
}

/// What a key of `[axes]` may hold.
fn axis(quantity: Quantity, units: &Units) -> Value {
    let words = quantity.words();
    let one = value(quantity, units);
    let list = json!({ "type": "array", "minItems": 1, "items": one });
    let unit = quantity.unit(Scale::Model);
    let mut description = quantity.doc().to_owned();
    if words.is_empty() {
        let scaled = if *units == Units::Scaled { String::new() } else { format!(" in units of {unit}") };
        description.push_str(&format!("; in {}; {}{scaled}", units.name(unit), quantity.domain()));
    }
    let forms = if words.is_empty() { vec![one, list, form(quantity, units)] } else { vec![one, list] };
    json!({ "description": description, "anyOf": forms })
}

/// One value of an axis.
fn value(quantity: Quantity, units: &Units) -> Value {
    let words = quantity.words();
    if !words.is_empty() {
        return json!({ "enum": words });
    }
    let mut value = legal(quantity, units);
    if quantity.domain().contains(f64::INFINITY) {
        // JSON has no infinity: readers of TOML make null of `inf`, which nothing else in TOML becomes.
        value.insert("type".to_owned(), json!(["number", "null"]));
    }
    Value::Object(value)
}

/// A number that is legal for `quantity`. How large a scale is the schema does not know: of a range it keeps the sign.
fn legal(quantity: Quantity, units: &Units) -> Map<String, Value> {
    let domain = quantity.domain();
    let mut value = number(&domain);
    if *units != Units::Scaled && quantity.words().is_empty() {
        value.retain(|key, _| !["minimum", "exclusiveMinimum", "maximum"].contains(&key.as_str()));
        if domain.contains(0.0) && domain.least().0 >= 0.0 || domain.apart() == Some(0.0) {
            value.insert("minimum".to_owned(), json!(0.0));
        } else if domain.least().0 > 0.0 {
            value.insert("exclusiveMinimum".to_owned(), json!(0.0));
        }
    }
    value
}

/// A number of this range; one from 0 on where 0 lies apart, since a hole would take two ranges.
fn number(domain: &Domain) -> Map<String, Value> {
    let mut value = Map::new();
    value.insert("type".to_owned(), json!("number"));
    let (least, is_excluded) = domain.least();
    let least = if domain.apart() == Some(0.0) { 0.0 } else { least };
    value.insert(if is_excluded { "exclusiveMinimum" } else { "minimum" }.to_owned(), json!(least));
    value.insert("maximum".to_owned(), json!(domain.greatest()));
    value
}

/// A range, with its unit.
fn form(quantity: Quantity, units: &Units) -> Value {
    let end = legal(quantity, units);
    let triple = |end: &Map<String, Value>, count: Value| {
        json!({
            "type": "array",
            "items": [end, end, count],
            "minItems": 3,
            "maxItems": 3,
        })
    };
    let count = json!({ "type": "integer", "minimum": 2, "maximum": (1_u64 << 53) - 1 });
    let range = |end: &Map<String, Value>| triple(end, count.clone());
    let sample = |design: Design, description: &str| {
        json!({
            "allOf": [triple(&end, json!({ "type": "integer", "minimum": 1, "maximum": design.most() }))],
            "description": description,
        })
    };
    // Both ends of a geometric range are on one side of zero.
    let (least, _) = quantity.domain().least();
    let mut above = end.clone();
    if above.get("minimum").and_then(Value::as_f64).is_none_or(|least| least <= 0.0) {
        above.remove("minimum");
        above.entry("exclusiveMinimum").or_insert(json!(0.0));
    }
    let mut below = end.clone();
    below.insert("exclusiveMaximum".to_owned(), json!(0.0));
    let sides = if least < 0.0 { vec![range(&above), range(&below)] } else { vec![range(&above)] };
    let scales: &[Scale] = if quantity.has_scale() { &[Scale::Duration, Scale::Model] } else { &[Scale::Model] };
    let named = |scale: &Scale| match scale {
        Scale::Model => units.name(quantity.unit(*scale)),
        Scale::Duration => quantity.unit(*scale),
    };
    let units: Vec<&str> = scales.iter().map(named).collect();
    let forms = ["linspace", "geomspace", "expr", "sobol", "lhs"];
    json!({
        "type": "object",
        "additionalProperties": false,
        "properties": {
            "linspace": {
                "allOf": [range(&end)],
                "description": "[first, last, count], evenly spaced, both ends included",
            },
            "geomspace": {
                "anyOf": sides,
                "description": "[first, last, count], evenly spaced in the logarithm, both ends included",
            },
            "expr": { "type": "string", "minLength": 1, "description": "Computed from other axes at every point, such as 10 * v_i" },
            "sobol": sample(Design::Sobol, "[least, greatest, count], a Sobol sequence, joint over all such axes"),
            "lhs": sample(Design::LatinHypercube, "[least, greatest, count], a Latin hypercube, joint over all such axes"),
            "seed": {
                "type": "integer",
                "minimum": 0,
                "maximum": u32::MAX,
                "description": "Seed of sobol or lhs, one for all axes of a sample",
            },
            "unit": { "enum": units, "description": "Unit of the values" },
        },
        "oneOf": forms.map(|form| json!({ "required": [form] })),
        "dependencies": { "seed": { "anyOf": [{ "required": ["sobol"] }, { "required": ["lhs"] }] } },
    })
}

/// What a key of `[tables]` may hold.
fn table_of(table: &dyn Table) -> Value {
    let reductions = if table.name() == "gap" { &table::REDUCED[..] } else { &[] };
    let reduced = || reductions.iter().flat_map(|(_, table)| table.columns());
    let columns: BTreeSet<&str> =
        table.columns().iter().chain(reduced()).map(|column| column.name).chain([STATUS]).collect();
    let meanings: Vec<String> =
        table.columns().iter().map(|column| format!("{}: {}", column.name, column.doc)).collect();
    let chosen = json!({
        "type": "array",
        "minItems": 1,
        "uniqueItems": true,
        "items": { "enum": columns },
        "description": format!("Only these columns are computed and written\n{}", meanings.join("\n")),
    });
    let accuracy = rtol(table.default_rtol().map_or(Value::Null, |rtol| json!(rtol)));
    let mut known = keys(table.doc(), [("columns", chosen), ("rtol", accuracy)]);
    if !reductions.is_empty() {
        let words: Vec<&str> = reductions.iter().map(|(word, _)| *word).collect();
        let description =
            "Write this of each transition and time, not its rows; `columns` are then those of the reduced table";
        known["properties"]["reduce"] = json!({ "enum": words, "description": description });
    }
    known
}

/// An accuracy, with its default if it has one of its own.
fn rtol(default: Value) -> Value {
    let mut rtol = number(&RTOL);
    rtol.insert("description".to_owned(), json!(format!("Relative accuracy of the numbers, {RTOL}")));
    if !default.is_null() {
        rtol.insert("default".to_owned(), default);
    }
    Value::Object(rtol)
}
