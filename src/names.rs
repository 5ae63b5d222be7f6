//! Text for messages: numbers, foreign text, and suggestions for misspelt names.

use std::borrow::Cow;

/// Greatest length of a name with a suggestion, in bytes. Chosen: three times the longest valid name.
const MAX_NAME_BYTES: usize = 64;

/// `value` to nine significant digits.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let scientific = format!("{value:.8e}");
    let (digits, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-4..9).contains(&exponent) {
        let decimals = usize::try_from(8 - exponent).unwrap_or(0);
        trimmed(&format!("{value:.decimals$}")).to_owned()
    } else {
        format!("{}e{exponent}", trimmed(digits))
    }
}

/// Removes trailing zeros of the decimals.
pub fn trimmed(digits: &str) -> &str {
    if digits.contains('.') { digits.trim_end_matches('0').trim_end_matches('.') } else { digits }
}

/// The first `most` characters of a foreign text, without control characters, for a message.
pub fn shown(text: &str, most: usize) -> Cow<'_, str> {
    let start = text.char_indices().nth(most).map_or(text, |(end, _)| &text[..end]);
    let rest = if start.len() < text.len() { "..." } else { "" };
    if rest.is_empty() && !start.contains(is_control) {
        return text.into();
    }
    let escaped = |c: char| if is_control(c) { c.escape_default().to_string() } else { c.to_string() };
    (start.chars().map(escaped).collect::<String>() + rest).into()
}

fn is_control(c: char) -> bool {
    c.is_control() && c != '\n'
}

/// Names of our quantities and columns in other tools, in lower case.
const SYNONYMS: [(&str, &[&str]); 11] = [
    ("threads", &["jobs", "j", "cores"]),
    ("where", &["filter", "condition"]),
    ("rtol", &["tol", "tolerance", "accuracy", "precision"]),
    ("l", &["d_c", "dc", "d_rs", "length"]),
    ("normal_stress", &["sigma", "sigma_n", "normal_stress", "pressure"]),
    ("mu_0", &["f_0", "f0", "mu"]),
    ("v_0", &["v_ref", "v_star"]),
    ("t_f", &["t", "time", "duration"]),
    ("k", &["stiffness"]),
    ("geomspace", &["logspace"]),
    ("m", &["mass"]),
];

/// Greatest length of a name whose first letter must be correct, in characters. Chosen: `min` and `bin` are one letter away from `sin`.
const MAX_SHORT_CHARS: usize = 4;

/// The most likely intended name among `known`, all in lower case: a synonym of `name`, or a similar name.
///
/// `None` for names of more than [`MAX_NAME_BYTES`] bytes, since a comparison takes memory and time in proportion to the product of both lengths.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if name.len() > MAX_NAME_BYTES {
        return None;
    }
    let name = name.to_lowercase();
    let ours = SYNONYMS.iter().find(|(_, theirs)| theirs.contains(&name.as_str())).map(|(ours, _)| *ours);
    let distance = |candidate: &str| {
        let (distance, longer) = (strsim::damerau_levenshtein(&name, candidate), candidate.len().max(name.len()));
        let is_far = longer <= MAX_SHORT_CHARS && name.chars().next() != candidate.chars().next();
        (ours == Some(candidate)).then_some(0).or((!is_far && distance <= longer.div_ceil(3)).then_some(distance))
    };
    let near = known.into_iter().filter_map(|candidate| Some((distance(candidate)?, candidate)));
    near.min_by_key(|(distance, _)| *distance).map(|(_, candidate)| candidate)
}

/// The help for `name`, which is not in `known`; `other` if nothing similar is.
pub fn hint_or<'a>(name: &str, known: impl IntoIterator<Item = &'a str>, other: &str) -> String {
    nearest(name, known).map_or_else(|| other.to_owned(), |meant| format!("did you mean `{meant}`?"))
}

/// The help for `name`, which is not in `known`.
#[cfg(any(feature = "plot", feature = "query"))]
pub fn hint<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    hint_or(name, known, "choose one of these")
}

#[cfg(test)]
mod tests {
    //! A suggestion is close to the misspelt name, or absent.

    use super::{nearest, shown};

    #[test]
    fn nearest_name_or_none() {
        let known = ["linspace", "geomspace", "unit", "expr"];
        assert_eq!(nearest("lnspace", known), Some("linspace"));
        assert_eq!(nearest("geospace", known), Some("geomspace"));
        assert_eq!(nearest("logspace", known), Some("geomspace"));
        assert_eq!(nearest("unti", known), Some("unit"));
        assert_eq!(nearest("UNIT", known), Some("unit"));
        assert_eq!(nearest("temperature", known), None);
        assert_eq!(nearest("", known), None);
        assert_eq!(nearest("mni", ["min", "max"]), Some("min"));
        assert_eq!(nearest("sin", ["abs", "min"]), None);
        assert_eq!(nearest("x", ["a", "b", "k"]), None);
    }

    #[test]
    fn words_of_others_lead_to_ours() {
        assert_eq!(nearest("D_c", ["mu_0", "l", "v_0", "normal_stress"]), Some("l"));
        assert_eq!(nearest("sigma", ["mu_0", "l", "v_0", "normal_stress"]), Some("normal_stress"));
    }

    #[test]
    fn regress_a_name_of_megabytes_is_neither_compared_nor_shown() {
        let name = "é".repeat(1 << 20);
        assert_eq!(nearest(&name, ["linspace"]), None);
        assert_eq!(shown(&name, 64), format!("{}...", "é".repeat(64)));
        assert_eq!(shown("linspace", 8), "linspace");
        assert_eq!(shown("\u{1b}[2J\n", 8), "\\u{1b}[2J\n");
    }
}
