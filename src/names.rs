//! Names that somebody misspelt.

use std::borrow::Cow;

/// Longest name for which a suggestion is looked for, in bytes.
const LONGEST: usize = 64;

/// A text that somebody else wrote, for a message: its first `most` characters, and none that a terminal would obey.
pub fn shown(text: &str, most: usize) -> Cow<'_, str> {
    let is_plain = |text: &str| !text.contains(|c: char| c.is_control() && c != '\n');
    let start = text.char_indices().nth(most).map_or(text, |(end, _)| &text[..end]);
    if start.len() == text.len() && is_plain(text) {
        return text.into();
    }
    let escaped = |c: char| if c.is_control() && c != '\n' { c.escape_default().to_string() } else { c.to_string() };
    let mut shown: String = start.chars().map(escaped).collect();
    if start.len() < text.len() {
        shown.push_str("...");
    }
    shown.into()
}

/// The name among `known`, all in lower case, that `name` was most likely meant to be.
///
/// None of a name of more than [`LONGEST`] bytes: comparing two takes memory in proportion to the product of their lengths.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if name.len() > LONGEST {
        return None;
    }
    known
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(&name.to_lowercase(), candidate), candidate))
        .filter(|(distance, candidate)| *distance <= candidate.len().max(name.len()).div_ceil(3))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    //! Suggestions are near or not made.

    use super::{nearest, shown};

    #[test]
    fn nearest_name_or_none() {
        let known = ["linspace", "geomspace", "unit", "expr"];
        assert_eq!(nearest("lnspace", known), Some("linspace"));
        assert_eq!(nearest("geospace", known), Some("geomspace"));
        assert_eq!(nearest("unti", known), Some("unit"));
        assert_eq!(nearest("UNIT", known), Some("unit"));
        assert_eq!(nearest("temperature", known), None);
        assert_eq!(nearest("", known), None);
    }

    #[test]
    fn regress_a_name_of_megabytes_is_neither_compared_nor_told() {
        let name = "é".repeat(1 << 20);
        assert_eq!(nearest(&name, ["linspace"]), None);
        assert_eq!(shown(&name, 64), format!("{}...", "é".repeat(64)));
        assert_eq!(shown("linspace", 8), "linspace");
        assert_eq!(shown("\u{1b}[2J\n", 8), "\\u{1b}[2J\n");
    }
}
