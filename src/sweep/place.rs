//! Where in the text of a spec a key is, and what the parser's complaints mean.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{Faults, SpecError, unknown};
use super::spec::Spec;
use crate::names::nearest;

/// Reads a spec from TOML, as far as it can be read.
///
/// A key whose value has the wrong type, or that no spec has, is a fault, and left out: what is right is checked all the same.
pub fn read(text: &str, faults: &mut Faults) -> Option<Spec> {
    let fault = |error: toml::de::Error| {
        let line = error.span().map(|span| line_of(text, span.start));
        SpecError { line, ..explain(text, error.message(), error.span()) }
    };
    let mut document = faults.take(DeTable::parse(text).map_err(fault))?;
    while !faults.are_enough() {
        let error = match Spec::deserialize(toml::de::Deserializer::from(document.clone())) {
            Ok(spec) => return Some(spec),
            Err(error) => error,
        };
        let (span, missing) = (error.span(), quoted(error.message(), "missing field ").pop());
        if let Some((name, known)) = quoted(error.message(), "unknown field ").split_first()
            && let Some(meant) = nearest(name, known.iter().map(String::as_str))
        {
            let key = span.as_ref().map_or_else(String::new, |span| key_at(text, span));
            faults.suspect(format!("{}{meant}", key.strip_suffix(name.as_str()).unwrap_or_default()));
        }
        match missing {
            Some(name) => {
                if !faults.concern(&name) {
                    faults.push(fault(error));
                }
                let value = Spanned::new(0..0, DeValue::String("missing".into()));
                document.get_mut().insert(Spanned::new(0..0, name.into()), value);
            }
            None => {
                faults.push(fault(error));
                if !span.is_some_and(|span| remove(document.get_mut(), &span)) {
                    return None;
                }
            }
        }
    }
    None
}

/// Reads a spec from TOML.
///
/// # Errors
///
/// What keeps it from being read.
pub fn parse(text: &str) -> Result<Spec, SpecError> {
    let mut faults = Faults::default();
    let spec = read(text, &mut faults).unwrap_or_default();
    faults.finish(text).map(|()| spec)
}

/// Removes the entry of `table`, or of one below it, that holds `span`; the innermost of them. Whether there was one.
fn remove(table: &mut DeTable<'_>, span: &Range<usize>) -> bool {
    let inside = |outer: Range<usize>| outer.start <= span.start && span.end <= outer.end;
    let Some(name) = table.iter().find(|(key, value)| covers(key, value, &inside)).map(|(key, _)| key.clone()) else {
        return false;
    };
    let below = match table.get_mut(&name).map(Spanned::get_mut) {
        Some(DeValue::Table(inner)) => remove(inner, span),
        Some(DeValue::Array(items)) => items.iter_mut().any(|item| match item.get_mut() {
            DeValue::Table(inner) => remove(inner, span),
            _ => false,
        }),
        _ => false,
    };
    below || table.remove(&name).is_some()
}

/// Gives faults without a line that of their key (as in `axes.v_i[2]`) in `text`, or of the closest part of it that exists.
pub fn find_lines(text: &str, faults: &mut [SpecError]) {
    let Ok(document) = DeTable::parse(text) else { return };
    for fault in faults.iter_mut().filter(|fault| fault.line.is_none()) {
        fault.line = find(document.get_ref(), &fault.key).map(|(entry, ..)| line_of(text, entry.start));
    }
}

/// The line of `key` (as in `axes.v_i[2]`), or of the closest part of it that exists.
pub fn line(text: &str, key: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let (entry, ..) = find(document.get_ref(), key)?;
    Some(line_of(text, entry.start))
}

/// The value of `key` as it is written; `None` if it is not there, or a table of its own.
pub fn value(text: &str, key: &str) -> Option<String> {
    let document = DeTable::parse(text).ok()?;
    let (_, value, whole) = find(document.get_ref(), key)?;
    let written = text.get(value.span())?;
    // The span of a `[table]` is that of its header.
    let is_value = !matches!(value.get_ref(), DeValue::Table(_)) || written.starts_with('{');
    (whole && is_value).then(|| written.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// The place of `key`, or of the closest part of it that exists, its value, and whether it is all of the key.
fn find<'a, 'i>(document: &'a DeTable<'i>, key: &str) -> Option<(Range<usize>, &'a Spanned<DeValue<'i>>, bool)> {
    let mut found = None;
    let mut here = Here::Table(document);
    for step in steps(key) {
        let next = match (here, step) {
            (Here::Table(table), Step::Key(name)) => {
                table.iter().find(|(key, _)| key.get_ref() == name).map(|(key, value)| (key.span(), value))
            }
            (Here::Value(DeValue::Array(items)), Step::Index(index)) => {
                items.get(index).map(|value| (value.span(), value))
            }
            _ => None,
        };
        let Some((span, value)) = next else { return found.map(|(span, value)| (span, value, false)) };
        found = Some((span, value));
        here = below(value);
    }
    found.map(|(span, value)| (span, value, true))
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

/// The words in backquotes of a message that begins with `opening`; none of another one.
fn quoted(message: &str, opening: &str) -> Vec<String> {
    let rest = message.strip_prefix(opening).unwrap_or_default();
    rest.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Turns a complaint of the parser, whose wording is serde's, into what was found, expected and to be done.
fn explain(text: &str, message: &str, span: Option<Range<usize>>) -> SpecError {
    let key = span.as_ref().map_or_else(String::new, |span| key_at(text, span));
    let names = quoted(message, "unknown field ");
    if !names.is_empty() {
        if names.first().is_some_and(|name| name == DATE) {
            let found = "found a date".to_owned();
            return SpecError::new(key, found, "a number, a word, a list or a table", "change the value");
        }
        if let Some((name, known)) = names.split_first() {
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            return unknown(key, "key", name, &known);
        }
    }
    if let Some(name) = quoted(message, "missing field ").pop() {
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
