//! Where in the text of a spec a key is, and what the parser's complaints mean.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{SpecError, unknown};
use super::spec::Spec;

/// Reads a spec from TOML.
pub fn parse(text: &str) -> Result<Spec, (SpecError, Option<usize>)> {
    toml::from_str::<Spec>(text).map_err(|error| {
        let line = error.span().map(|span| line_of(text, span.start));
        (explain(text, error.message(), error.span()), line)
    })
}

/// The line of `key` (as in `axes.v_i[2]`), or of the closest part of it that exists.
pub fn line(text: &str, key: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut found = None;
    let mut here = Here::Table(document.get_ref());
    for step in steps(key) {
        let (span, value) = match (here, step) {
            (Here::Table(table), Step::Key(name)) => match table.iter().find(|(key, _)| key.get_ref() == name) {
                Some((key, value)) => (key.span(), value),
                None => break,
            },
            (Here::Value(DeValue::Array(items)), Step::Index(index)) => match items.get(index) {
                Some(value) => (value.span(), value),
                None => break,
            },
            _ => break,
        };
        found = Some(span.start);
        here = below(value);
    }
    found.map(|offset| line_of(text, offset))
}

enum Here<'a, 'i> {
    Table(&'a DeTable<'i>),
    Value(&'a DeValue<'i>),
}

fn below<'a, 'i>(value: &'a Spanned<DeValue<'i>>) -> Here<'a, 'i> {
    match value.get_ref() {
        DeValue::Table(table) => Here::Table(table),
        other => Here::Value(other),
    }
}

enum Step<'a> {
    Key(&'a str),
    Index(usize),
}

fn steps(key: &str) -> impl Iterator<Item = Step<'_>> {
    key.split('.').filter(|name| !name.is_empty()).flat_map(|name| {
        let (name, rest) = name.split_at(name.find('[').unwrap_or(name.len()));
        let indices = rest.split(['[', ']']).filter_map(|index| index.parse().ok().map(Step::Index));
        std::iter::once(Step::Key(name)).chain(indices)
    })
}

fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}

/// The key that `span` lies in: of a table its entries, of a list its elements.
fn key_at(text: &str, span: &Range<usize>) -> String {
    let mut path = String::new();
    let Ok(document) = DeTable::parse(text) else { return path };
    let mut here = Here::Table(document.get_ref());
    let inside = |outer: Range<usize>| outer.start <= span.start && span.end <= outer.end;
    loop {
        let next = match here {
            Here::Table(table) => table.iter().find(|(key, value)| covers(key, value, &inside)).map(|(key, value)| {
                if !path.is_empty() {
                    path.push('.');
                }
                path.push_str(key.get_ref());
                value
            }),
            Here::Value(DeValue::Array(items)) => {
                items.iter().enumerate().find(|(_, value)| holds(value, &inside)).map(|(index, value)| {
                    path.push_str(&format!("[{index}]"));
                    value
                })
            }
            Here::Value(_) => None,
        };
        match next {
            Some(value) => here = below(value),
            None => return path,
        }
    }
}

/// Whether an entry of a table holds what `inside` tells: its key, its value, or one of the entries below.
///
/// The span of a `[table]` is that of its header alone, so its entries are asked one by one.
fn covers(
    key: &Spanned<toml::de::DeString<'_>>,
    value: &Spanned<DeValue<'_>>,
    inside: &impl Fn(Range<usize>) -> bool,
) -> bool {
    inside(key.span()) || holds(value, inside)
}

/// The same for a value.
fn holds(value: &Spanned<DeValue<'_>>, inside: &impl Fn(Range<usize>) -> bool) -> bool {
    inside(value.span())
        || match value.get_ref() {
            DeValue::Table(table) => table.iter().any(|(key, value)| covers(key, value, inside)),
            DeValue::Array(items) => items.iter().any(|item| holds(item, inside)),
            _ => false,
        }
}

/// The field that the parser makes of a date.
const DATE: &str = "$__toml_private_datetime";

/// Turns a complaint of the parser, whose wording is serde's, into what was found, expected and to be done.
fn explain(text: &str, message: &str, span: Option<Range<usize>>) -> SpecError {
    let key = span.as_ref().map_or_else(String::new, |span| key_at(text, span));
    let quoted = |text: &str| -> Vec<String> { text.split('`').skip(1).step_by(2).map(str::to_owned).collect() };
    if let Some(rest) = message.strip_prefix("unknown field ") {
        let names = quoted(rest);
        if names.first().is_some_and(|name| name == DATE) {
            let found = "found a date".to_owned();
            return SpecError::new(key, found, "a number, a word, a list or a table", "change the value");
        }
        if let Some((name, known)) = names.split_first() {
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            return unknown(key, "key", name, &known);
        }
    }
    if let Some(rest) = message.strip_prefix("missing field ") {
        let name = quoted(rest).concat();
        let (expected, help) = (format!("a key `{name}`"), format!("add `{name} = ...`"));
        return SpecError::new("", format!("`{name}` is missing"), expected, help);
    }
    let types = message.strip_prefix("invalid type: ").and_then(|rest| rest.rsplit_once(", expected "));
    if let Some((found, expected)) = types {
        if key == "block" && expected == "a sequence" {
            return SpecError::new(key, "one [block]", "[[block]], as often as there are blocks", "write two brackets");
        }
        let expected = match expected {
            "f64" => "a number",
            "a sequence" => "a list",
            "a boolean" => "true or false",
            "a map" => "a table",
            other => other.strip_prefix("struct ").map_or(other, |_| "a table"),
        };
        return SpecError::new(key, format!("found {found}"), expected, "change the value");
    }
    if message.starts_with("duplicate key") {
        let name = span.and_then(|span| text.get(span)).unwrap_or_default();
        let found = format!("the key `{name}` is there twice");
        return SpecError::new(key, found, "each key once", "remove one of the two");
    }
    SpecError::new(key, format!("not TOML: {message}"), "key = value, [table] or # comment", "correct the line")
}
