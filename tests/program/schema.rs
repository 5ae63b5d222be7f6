//! The JSON Schema knows exactly the keys that the spec knows. Specs are validated against it in `tests/consumer/schema.py`.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;
use slipsweep::grid::Quantity;
use slipsweep::sweep::{Sweep, schema};
use slipsweep::table;

/// The keys that a spec may have where `text` has an unknown one, from its message.
fn known(text: &str) -> BTreeSet<String> {
    let error = Sweep::parse(text, Path::new(".")).err().expect("has an unknown key");
    assert!(error.found.starts_with("unknown "), "{error}");
    error.expected.split(", ").map(str::to_owned).collect()
}

/// The keys that the schema allows at a place.
fn allowed(schema: &Value, place: &str) -> BTreeSet<String> {
    let properties = schema.pointer(place).and_then(Value::as_object).unwrap_or_else(|| panic!("nothing at {place}"));
    properties.keys().cloned().collect()
}

#[test]
fn keys_are_those_of_the_spec() {
    let schema = schema();
    let axes = "/definitions/axes/properties";
    let form = "/definitions/axes/properties/a/anyOf/2/properties";
    for (place, text) in [
        ("/properties", "zzz = 1"),
        ("/properties/model/properties", "name = \"x\"\n[model]\nzzz = 1"),
        ("/properties/accuracy/properties", "name = \"x\"\n[accuracy]\nzzz = 1"),
        ("/properties/block/items/properties", "name = \"x\"\n[[block]]\nzzz = 1"),
        (axes, "name = \"x\"\n[axes]\nzzz = 1"),
        (form, "name = \"x\"\n[axes]\na = { zzz = 1 }"),
        ("/properties/tables/properties", "name = \"x\"\n[tables.zzz]"),
        ("/properties/tables/properties/gap/properties", "name = \"x\"\n[tables.gap]\nzzz = 1"),
    ] {
        assert_eq!(allowed(&schema, place), known(text), "{place}");
    }
}

#[test]
fn every_axis_and_column_is_described() {
    let text = schema().to_string();
    for quantity in Quantity::ALL {
        assert!(text.contains(quantity.doc()), "{}", quantity.name());
    }
    for table in table::ALL {
        for column in table.columns() {
            let meaning = Value::String(format!("{}: {}", column.name, column.doc)).to_string();
            assert!(text.contains(meaning.trim_matches('"')), "{} {}", table.name(), column.name);
        }
    }
}
