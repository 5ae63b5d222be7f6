//! Reads a spec from TOML, with the key and line of a fault; and finds the line of a key.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{SpecError, unknown};
use super::spec::Spec;
use crate::grid::Quantity;

impl Spec {
    /// Reads a spec from TOML.
    ///
    /// # Errors
    ///
    /// The syntax error, or unknown keys and values of the wrong type.
    pub fn parse(text: &str) -> Result<Spec, SpecError> {
        Spec::recovered(text).map_err(|faulty| faulty.0)
    }

    /// Reads a spec from TOML; with the faults of keys and types, the spec without these keys if it is complete.
    pub(super) fn recovered(text: &str) -> Result<Spec, Box<(SpecError, Option<Spec>)>> {
        let document = DeTable::parse(text).map_err(|error| {
            let help = "put text and expressions in \"quotes\", close brackets, write decimals with a point, commas between values, and each key once";
            let fault =
                SpecError::new("", format!("not TOML: {}", error.message()), "key = value, [table] or # comment", help);
            Box::new((SpecError { line: error.span().map(|span| line_of(text, span.start)), ..fault }, None))
        })?;
        let entries = entries(document.get_ref(), "");
        let (mut rest, mut known) = (text.to_owned(), None);
        loop {
            let error: toml::de::Error = match (toml::from_str(&rest), known) {
                (Ok(spec), None) => return Ok(spec),
                (Ok(spec), Some(faults)) => return Err(Box::new((faults, Some(spec)))),
                (Err(error), faults) => {
                    known = faults;
                    error
                }
            };
            let span = error.span().unwrap_or_default();
            let has =
                |entry: &&Entry| [&entry.name, &entry.value.span()].iter().any(|written| written.contains(&span.start));
            let entry = entries.iter().rfind(has);
            let key = entry.map(|entry| entry.key.clone()).unwrap_or_default();
            let entry = entry.map(|entry| entry.name.start..entry.value.span().end);
            let fault = SpecError { line: Some(line_of(text, span.start)), ..fault(text, span, key, error.message()) };
            let faults = SpecError::and(known, fault);
            // Without the entry other faults show, at the same places.
            if !entry.is_some_and(|entry| blank(&mut rest, entry)) || faults.is_full() {
                return Err(Box::new((faults, None)));
            }
            known = Some(faults);
        }
    }
}

/// Replaces the characters of `entry` by blanks, except for ends of lines. Returns whether `text` is TOML then.
fn blank(text: &mut String, entry: Range<usize>) -> bool {
    let Some(written) = text.get(entry.clone()) else { return false };
    let blanks: String = written.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }).collect();
    text.replace_range(entry, &blanks);
    DeTable::parse(text).is_ok()
}

/// The help for text in place of a number.
pub const HELP_FOR_NUMBER: &str =
    "write numbers without quotes or units, inf for no bound, an expression as { expr = \"10 * v_i\" }";

/// The help for an unknown key of an axis.
const HELP_FOR_FORM: &str = "a range is { linspace = [first, last, count] } or { geomspace = [first, last, count] }";

/// The keys of other sections than the top one.
const SECTIONS: [(&str, &[&str]); 3] = [
    ("[accuracy]", &["rtol"]),
    ("[model]", &["velocity_bound", "friction", "units", "mu_0", "l", "v_0", "normal_stress"]),
    ("[tables.NAME]", &["columns", "reduce"]),
];

/// The help for a key of the grid in the section of its axes.
pub const HELP_FOR_GRID_KEY: &str = "write this key above the line [axes]; it is no axis";

/// Whether a key below `axes` is one of the grid.
pub fn is_grid_key(key: &str) -> bool {
    let name = key.split_once("axes.").map(|(_, name)| name.split(['.', '[']).next().unwrap_or_default());
    name.is_some_and(|name| ["where", "points", "zip"].contains(&name))
}

/// The fault that the parser reports with `message` for the value at `key`, written in `span` of `text`.
fn fault(text: &str, span: Range<usize>, key: String, message: &str) -> SpecError {
    if message.starts_with("unknown field ") {
        let names: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
        let fault = unknown(key, "key", names[0], &names[1..]);
        let home = SECTIONS.iter().find(|(_, keys)| keys.contains(&names[0])).map(|(section, _)| *section);
        return match home {
            _ if Quantity::from_name(names[0]).is_some() => {
                SpecError { help: "axes go below the line [axes], or [block.axes] in a block".into(), ..fault }
            }
            _ if fault.key.contains("axes.") && !fault.help.starts_with("did you mean") => {
                SpecError { help: HELP_FOR_FORM.into(), ..fault }
            }
            Some(home) => SpecError { help: format!("`{}` goes below {home}", names[0]).into(), ..fault },
            None => fault,
        };
    }
    let expected = match message.split_once(", expected ").map_or(message, |(_, expected)| expected) {
        "f64" => "a number",
        "floating-point number overflowed" => "a number below 1e308",
        "i64" => "a whole number",
        "a boolean" => "true or false",
        "a sequence" => "a list",
        expected if expected == "a map" || expected.starts_with("struct ") => "a table",
        expected => expected,
    };
    let help = match expected {
        _ if is_grid_key(&key) => HELP_FOR_GRID_KEY,
        "a list" if key == "block" => "write [[block]], with two brackets, above each block",
        "a list" if key.starts_with("zip") => "write a list of lists, such as zip = [[\"a\", \"b\"]]",
        "a table" if key == "tables" => "write [tables.NAME], such as [tables.optimal], for each table",
        "a table" if key == "axes" => "write the line [axes], and the axes below it",
        "a list" => "write values in [brackets], and a block as [[block]]",
        expected if expected.starts_with("a number") => HELP_FOR_NUMBER,
        _ => "change the value",
    };
    let found = text.get(span).and_then(|value| value.lines().next()).unwrap_or_default();
    SpecError::new(key, format!("found {found}"), expected, help)
}

/// A value of a spec.
struct Entry<'a, 'i> {
    /// Its key, as in `axes.v_i[2]`.
    key: String,
    /// Where its name is written; that of an item is its value.
    name: Range<usize>,
    value: &'a Spanned<DeValue<'i>>,
}

/// The values below `table`, at `key`, each before those inside it.
fn entries<'a, 'i>(table: &'a DeTable<'i>, key: &str) -> Vec<Entry<'a, 'i>> {
    let dot = if key.is_empty() { "" } else { "." };
    let values = table.iter().map(|(name, value)| (format!("{key}{dot}{}", name.get_ref()), name.span(), value));
    values.flat_map(with_inner).collect()
}

/// The value at a key whose name is written there, and the values inside it.
fn with_inner<'a, 'i>((key, name, value): (String, Range<usize>, &'a Spanned<DeValue<'i>>)) -> Vec<Entry<'a, 'i>> {
    let mut inner = match value.get_ref() {
        DeValue::Table(table) => entries(table, &key),
        DeValue::Array(items) => {
            let items = items.iter().enumerate().map(|(index, item)| (format!("{key}[{index}]"), item.span(), item));
            items.flat_map(with_inner).collect()
        }
        _ => Vec::new(),
    };
    inner.insert(0, Entry { key, name, value });
    inner
}

/// The line of `key`, or of its longest existing prefix.
pub fn line(text: &str, key: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let is_prefix = |entry: &Entry| {
        key.strip_prefix(&entry.key).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    };
    let entry = entries(document.get_ref(), "").into_iter().rfind(is_prefix)?;
    Some(line_of(text, entry.name.start))
}

/// The text of the value of `key`; `None` if it is missing or a table.
pub fn value(text: &str, key: &str) -> Option<String> {
    let document = DeTable::parse(text).ok()?;
    let found = entries(document.get_ref(), "").into_iter().find(|entry| entry.key == key)?;
    let written = text.get(found.value.span())?;
    // The span of a `[table]` is that of its header.
    let is_value = !found.value.get_ref().is_table() || written.starts_with('{');
    is_value.then(|| written.split_whitespace().collect::<Vec<_>>().join(" "))
}

fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}
