//! Reads a spec from TOML: values by type, faults with key and line; and finds the line of a key.

use std::path::PathBuf;

use indexmap::IndexMap;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{Faults, SpecError, unknown};
use super::spec::{AxisValue, Spec};
use crate::grid::Quantity;
use crate::names::nearest;

impl Spec {
    /// Reads a spec from TOML.
    ///
    /// # Errors
    ///
    /// The syntax error or the faults.
    pub fn parse(text: &str) -> Result<Spec, SpecError> {
        let mut faults = Faults::default();
        let spec = read(text, &mut faults)?;
        faults.finish(text).map(|()| spec)
    }
}

/// Reads a spec from TOML. An unknown key, or a value of the wrong type, is a fault and is left out, so that the other keys are still checked.
///
/// # Errors
///
/// The syntax error.
pub fn read(text: &str, faults: &mut Faults) -> Result<Spec, SpecError> {
    let document = DeTable::parse(text).map_err(|error| syntax(text, &error))?;
    let value = DeValue::Table(document.into_inner());
    let mut spec = Spec::read(Entry { key: "", start: 0, value: &value, text }, faults).unwrap_or_default();
    if value.get("name").is_none() && !faults.concern("name") {
        let missing = SpecError::new("", "`name` is missing", "a key `name`", "add `name = ...`");
        faults.push(SpecError { line: Some(1), ..missing });
    }
    if !value.get("name").is_some_and(|name| name.get_ref().is_str()) {
        // A wrong name is one fault.
        spec.name = "missing".to_owned();
    }
    Ok(spec)
}

/// A syntax error of the parser.
fn syntax(text: &str, error: &toml::de::Error) -> SpecError {
    let (message, span) = (error.message(), error.span());
    let fault = if message.starts_with("duplicate key") {
        let name = span.clone().and_then(|span| text.get(span)).unwrap_or_default();
        SpecError::new("", format!("the key `{name}` is a duplicate"), "each key once", "remove one of the two")
    } else {
        let expected = "key = value, [table] or # comment";
        let line = span.as_ref().map_or(0, |span| line_of(text, span.start));
        let line = text.lines().nth(line.saturating_sub(1)).unwrap_or_default();
        let help = if message.starts_with("missing comma") { MISSING_COMMA } else { help_for_line(line) };
        SpecError::new("", format!("not TOML: {message}"), expected, help)
    };
    SpecError { line: span.map(|span| line_of(text, span.start)), ..fault }
}

/// The help for two values of a list without a comma.
const MISSING_COMMA: &str = "write a comma between two values, or `]` after the last";

/// The help for a number with a unit.
const NUMBER_ALONE: &str =
    "write the number alone; it is in SI units, such as m/s, if [model] has `units = \"si\"` and the scales";

/// The help for a word that means no value.
const NO_BOUND: &str = "write inf for no bound, as in v_ceiling = inf; or leave the key out";

/// Whether a word means no value in other formats.
fn is_no_value(word: &str) -> bool {
    ["none", "null", "nil", "no", "off", "infinity", "unlimited"].contains(&word.to_lowercase().as_str())
}

/// The help for a line that is not TOML.
fn help_for_line(line: &str) -> &'static str {
    let value = line.split_once('=').map_or(line, |(_, value)| value).trim();
    let is_digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    let has_decimal_comma = value.match_indices(',').any(|(at, _)| {
        is_digit(value[..at].chars().next_back()) && is_digit(value[at + 1..].chars().next()) && !value.contains('[')
    });
    let words: Vec<&str> = value.split('#').next().unwrap_or_default().split_whitespace().collect();
    let lacks_comma =
        words.windows(2).any(|two| is_digit(two[0].chars().next_back()) && is_digit(two[1].chars().next()));
    if line.contains(['\u{201c}', '\u{201d}', '\u{2018}', '\u{2019}']) {
        "write straight quotes, \""
    } else if has_decimal_comma {
        "write a decimal point, not a comma"
    } else if is_no_value(value) {
        NO_BOUND
    } else if line.trim_start().starts_with("where") {
        "write the condition in quotes: where = \"t_f > 3\""
    } else if value.contains("space(") {
        "write a range as { linspace = [first, last, count] } or { geomspace = [first, last, count] }"
    } else if value.starts_with(['[', '{']) && lacks_comma {
        MISSING_COMMA
    } else if value.is_empty() && line.contains('=') {
        "write a value after `=`"
    } else if value.parse::<f64>().is_ok() {
        "correct the line, or the one before"
    } else if is_digit(value.chars().next()) && !value.contains(['*', '/']) {
        NUMBER_ALONE
    } else if value.starts_with(['[', '{', '"', '\'']) && !value.contains("expr") || !line.contains('=') {
        "correct the line"
    } else {
        "put words in \"quotes\"; write an expression as { expr = \"10 * v_i\" }"
    }
}

/// The help for text in place of a number.
pub fn help_for_word(word: &str) -> String {
    let word = word.trim();
    let unit = word.trim_start_matches(|c: char| c.is_ascii_digit() || ".eE+-".contains(c)).trim_start();
    let name = unit.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default();
    let is_unit =
        !name.is_empty() && unit.len() < word.len() && (name.len() == 1 || Quantity::from_name(name).is_none());
    if word.parse::<f64>().is_ok() {
        "remove the quotes".to_owned()
    } else if is_no_value(word) {
        NO_BOUND.to_owned()
    } else if is_unit {
        NUMBER_ALONE.to_owned()
    } else if word.contains(['*', '/', '+', '('])
        || word.split_whitespace().any(|part| Quantity::from_name(part).is_some())
    {
        format!("write an expression as {{ expr = {word:?} }}")
    } else {
        "write a number".to_owned()
    }
}

/// A value of a spec with its key and span.
#[derive(Clone, Copy)]
pub struct Entry<'a> {
    /// Its key, as in `axes.v_i[2]`.
    key: &'a str,
    /// Its byte offset in the text.
    start: usize,
    /// The value.
    pub value: &'a DeValue<'a>,
    text: &'a str,
}

/// A type that is read from a TOML value.
pub trait Read: Sized {
    /// The value of an entry; `None` after adding a fault.
    fn read(entry: Entry<'_>, faults: &mut Faults) -> Option<Self>;
}

impl Entry<'_> {
    /// Adds the fault of a wrong type.
    pub fn wrong<T>(self, expected: &str, faults: &mut Faults) -> Option<T> {
        let found = match self.value {
            DeValue::String(word) => format!("string {word:?}"),
            DeValue::Integer(number) => format!("integer `{number}`"),
            DeValue::Float(number) => format!("floating point `{number}`"),
            DeValue::Boolean(is) => format!("boolean `{is}`"),
            DeValue::Datetime(_) => "a date".to_owned(),
            DeValue::Array(_) => "a list".to_owned(),
            DeValue::Table(_) => "a table".to_owned(),
        };
        let help = match self.value {
            DeValue::String(word) if expected == "a number" => help_for_word(word),
            DeValue::String(_) if self.key.starts_with("zip[") => {
                "write a list of lists, as in [[\"a\", \"b\"]]".to_owned()
            }
            DeValue::String(word) if expected == "a list" => format!("write [{word:?}]"),
            _ if expected == "a table" && self.key.starts_with("tables.") => format!("write [{}]", self.key),
            _ => "change the value".to_owned(),
        };
        self.fault(SpecError::new(self.key, format!("found {found}"), expected, help), faults);
        None
    }

    fn fault(self, fault: SpecError, faults: &mut Faults) {
        faults.push(SpecError { line: Some(line_of(self.text, self.start)), ..fault });
    }

    fn integer(self) -> Option<i64> {
        let number = self.value.as_integer()?;
        i64::from_str_radix(number.as_str(), number.radix()).ok()
    }

    /// The value as a number; `None` beyond the range of doubles.
    fn number(self) -> Option<f64> {
        let Some(number) = self.value.as_float() else { return self.integer().map(|number| number as f64) };
        let value = number.as_str().parse::<f64>().ok()?;
        (value.is_finite() || !number.as_str().contains(|c: char| c.is_ascii_digit())).then_some(value)
    }

    /// The value as an axis value.
    pub fn one(self) -> Option<AxisValue> {
        let word = self.value.as_str().map(|word| AxisValue::Word(word.to_owned()));
        word.or_else(|| self.number().map(AxisValue::Number))
    }

    /// Passes each entry of a table to `take`; `known` are its legal keys, if any.
    pub fn each(
        self,
        known: &[&str],
        faults: &mut Faults,
        mut take: impl FnMut(&str, Entry<'_>, &mut Faults),
    ) -> Option<()> {
        let DeValue::Table(table) = self.value else { return self.wrong("a table", faults) };
        let prefix = if self.key.is_empty() { String::new() } else { format!("{}.", self.key) };
        let takes_axes = known.contains(&"axes");
        let mut has_stray_axes = false;
        for (name, value) in table {
            let (start, name) = (name.span().start, name.get_ref().as_ref());
            let key = format!("{prefix}{name}");
            let entry = Entry { key: &key, start, value: value.get_ref(), ..self };
            if known.is_empty() || known.contains(&name) {
                take(name, entry, faults);
            } else if takes_axes && Quantity::from_name(name).is_some() {
                // The header is missing: one fault for all axes.
                if !has_stray_axes {
                    has_stray_axes = true;
                    faults.suspect(format!("{prefix}axes"));
                    let header = if prefix.is_empty() { "[axes]" } else { "[block.axes]" };
                    let found = format!("the axis `{name}` is not below {header}");
                    let help = format!("write the line {header} above the first axis");
                    entry.fault(SpecError::new(key.clone(), found, format!("{header} before the axes"), help), faults);
                }
            } else {
                let meant = nearest(name, known.iter().copied());
                meant.into_iter().for_each(|meant| faults.suspect(format!("{prefix}{meant}")));
                entry.fault(unknown(key.clone(), "key", name, known), faults);
            }
            if faults.are_enough() {
                break;
            }
        }
        Some(())
    }
}

/// Reads a struct from a TOML table, each key into its field. Missing keys keep their defaults.
macro_rules! keys {
    ($($table:ty { $($key:literal: $($field:ident).+),+ })+) => { $(
        impl Read for $table {
            fn read(entry: Entry<'_>, faults: &mut Faults) -> Option<Self> {
                let mut read = Self::default();
                entry.each(&[$($key),+], faults, |name, entry, faults| match name {
                    $($key => if let Some(value) = Read::read(entry, faults) {
                        read.$($field).+ = value;
                    })+
                    _ => {}
                })?;
                Some(read)
            }
        }
    )+ };
}
pub(super) use keys;

/// Reads values of one type, with what a message expects.
macro_rules! values {
    ($($type:ty, $expected:literal: $read:expr;)+) => { $(
        impl Read for $type {
            fn read(entry: Entry<'_>, faults: &mut Faults) -> Option<$type> {
                let read: fn(Entry<'_>) -> Option<$type> = $read;
                read(entry).or_else(|| entry.wrong($expected, faults))
            }
        }
    )+ };
}

values! {
    String, "a string": |entry| entry.value.as_str().map(str::to_owned);
    PathBuf, "a string": |entry| entry.value.as_str().map(PathBuf::from);
    bool, "true or false": |entry| entry.value.as_bool();
    i64, "a whole number": |entry| entry.integer();
    f64, "a number": |entry| entry.number();
    AxisValue, "a number": |entry| entry.one();
}

impl<T: Read> Read for Option<T> {
    fn read(entry: Entry<'_>, faults: &mut Faults) -> Option<Option<T>> {
        T::read(entry, faults).map(Some)
    }
}

impl<T: Read> Read for Vec<T> {
    fn read(entry: Entry<'_>, faults: &mut Faults) -> Option<Vec<T>> {
        let items = match entry.value {
            DeValue::Array(items) => items.iter().enumerate(),
            DeValue::Table(_) if entry.key == "block" => {
                let (expected, help) = ("[[block]], one for each block", "write two brackets: [[block]]");
                entry.fault(SpecError::new("block", "`[block]` in single brackets", expected, help), faults);
                return None;
            }
            _ => return entry.wrong("a list", faults),
        };
        let mut read = |(index, item): (usize, &Spanned<DeValue<'_>>)| {
            let key = format!("{}[{index}]", entry.key);
            T::read(Entry { key: &key, start: item.span().start, value: item.get_ref(), text: entry.text }, faults)
        };
        items.map(&mut read).collect()
    }
}

impl<T: Read> Read for IndexMap<String, T> {
    fn read(entry: Entry<'_>, faults: &mut Faults) -> Option<IndexMap<String, T>> {
        let mut read = IndexMap::new();
        entry.each(&[], faults, |name, entry, faults| {
            read.extend(T::read(entry, faults).map(|value| (name.to_owned(), value)));
        })?;
        Some(read)
    }
}

/// Sets the line of each fault without one: that of its key (as in `axes.v_i[2]`), or of the longest existing prefix of the key.
pub fn find_lines(text: &str, faults: &mut [SpecError]) {
    let Ok(document) = DeTable::parse(text) else { return };
    for fault in faults.iter_mut().filter(|fault| fault.line.is_none()) {
        fault.line = find(document.get_ref(), &fault.key).map(|found| line_of(text, found.start));
    }
}

/// The line of `key` (as in `axes.v_i[2]`), or of its longest existing prefix.
pub fn line(text: &str, key: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    Some(line_of(text, find(document.get_ref(), key)?.start))
}

/// The text of the value of `key`; `None` if it is missing or a table.
pub fn value(text: &str, key: &str) -> Option<String> {
    let document = DeTable::parse(text).ok()?;
    let found = find(document.get_ref(), key).filter(|found| found.is_whole)?;
    let written = text.get(found.value.span())?;
    // The span of a `[table]` is that of its header.
    let is_value = !found.value.get_ref().is_table() || written.starts_with('{');
    is_value.then(|| written.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// The entry of a key, or of its longest existing prefix.
struct KeyEntry<'a, 'i> {
    start: usize,
    value: &'a Spanned<DeValue<'i>>,
    /// Whether it is all of the key.
    is_whole: bool,
}

fn find<'a, 'i>(document: &'a DeTable<'i>, key: &str) -> Option<KeyEntry<'a, 'i>> {
    let entry = |table: &'a DeTable<'i>, name: &str| {
        let (key, value) = table.get_key_value(name)?;
        Some(KeyEntry { start: key.span().start, value, is_whole: true })
    };
    let mut steps = key.split(['.', '[', ']']).filter(|step| !step.is_empty());
    let mut found = entry(document, steps.next()?)?;
    for step in steps {
        let next = match found.value.get_ref() {
            DeValue::Table(table) => entry(table, step),
            DeValue::Array(items) => step.parse().ok().and_then(|index: usize| {
                items.get(index).map(|value| KeyEntry { start: value.span().start, value, is_whole: true })
            }),
            _ => None,
        };
        match next {
            Some(next) => found = next,
            None => return Some(KeyEntry { is_whole: false, ..found }),
        }
    }
    Some(found)
}

fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}
