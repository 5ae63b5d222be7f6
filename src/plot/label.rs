//! Text in pictures: a small markup for symbols, the symbols of columns and units, and the width of a text.
//!
//! `*…*` is italic, `_{…}` below and `^{…}` above the line, as in `*t*_{f} (*l*/*v*_{0})`; `∗` is an asterisk, and all other characters are
//! literal.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use ttf_parser::Face;

use crate::names::trimmed;

/// The fonts of every picture, upright and italic: Arimo has the widths of Arial, Helvetica and Liberation Sans, one of which every SVG viewer
/// has. Their licence is in the same folder.
pub const FONTS: [&[u8]; 2] = [include_bytes!("fonts/arimo-Regular.ttf"), include_bytes!("fonts/arimo-Italic.ttf")];

/// The families of a text, in the order of preference.
pub const FAMILIES: &str = "Arimo, Arial, 'Liberation Sans', Helvetica, sans-serif";

/// Size of subscripts and superscripts, relative to other letters. Chosen: as in TeX at this size.
pub const SCRIPT_SIZE: f64 = 0.72;

/// Rise of superscripts, relative to the size of letters. Chosen: their tops align with capitals.
pub const SUPERSCRIPT_RISE: f64 = 0.38;

/// Drop of subscripts, relative to the size of letters. Chosen: they stay clear of the next line.
pub const SUBSCRIPT_DROP: f64 = 0.2;

/// A run of letters in one style.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextRun {
    /// The letters.
    pub text: String,
    /// Whether they are italic.
    pub italic: bool,
    /// On the line (0), above it (1) or below it (-1).
    pub level: i8,
}

/// The spans of a text in markup.
pub fn spans(markup: &str) -> Vec<TextRun> {
    let mut spans: Vec<TextRun> = Vec::new();
    let (mut italic, mut level) = (false, 0);
    let mut letters = markup.chars().peekable();
    while let Some(letter) = letters.next() {
        let shown = if letter == '∗' { '*' } else { letter };
        match letter {
            '*' => italic = !italic,
            '_' | '^' if letters.peek() == Some(&'{') => {
                letters.next();
                level = if letter == '^' { 1 } else { -1 };
            }
            '}' if level != 0 => level = 0,
            _ => match spans.last_mut() {
                Some(span) if span.italic == italic && span.level == level => span.text.push(shown),
                _ => spans.push(TextRun { text: shown.to_string(), italic, level }),
            },
        }
    }
    spans
}

/// A user's text as markup that shows it: braces become parentheses.
pub fn literal(text: &str) -> String {
    let shown = |letter: char| match letter {
        '*' => '∗',
        '{' => '(',
        '}' => ')',
        _ if letter.is_control() => ' ',
        _ => letter,
    };
    text.chars().map(shown).collect()
}

/// A text in markup, shortened to a width of `most` (in units of the font size), with an ellipsis in place of the rest.
pub fn shortened(markup: &str, most: f64) -> String {
    if width(markup) <= most {
        return markup.to_owned();
    }
    let mut text = literal(&plain(markup));
    while text.pop().is_some() && width(&text) + 1.0 > most {}
    text + "…"
}

/// The width of a text in markup, at a font size of 1.
pub fn width(markup: &str) -> f64 {
    spans(markup).iter().map(span_width).sum()
}

/// The fonts, read once.
fn faces() -> &'static [Option<Face<'static>>; 2] {
    static FACES: OnceLock<[Option<Face<'static>>; 2]> = OnceLock::new();
    FACES.get_or_init(|| FONTS.map(|font| Face::parse(font, 0).ok()))
}

/// The letters of a text that the fonts lack.
pub fn missing_letters(text: &str) -> BTreeSet<char> {
    let is_missing = |letter: &char| faces()[0].as_ref().is_some_and(|face| face.glyph_index(*letter).is_none());
    text.chars().filter(|letter| !letter.is_ascii()).filter(is_missing).collect()
}

fn span_width(span: &TextRun) -> f64 {
    let size = if span.level == 0 { 1.0 } else { SCRIPT_SIZE };
    let Some(face) = &faces()[usize::from(span.italic)] else { return 0.6 * size * span.text.len() as f64 };
    let advance = |letter: char| face.glyph_index(letter).and_then(|glyph| face.glyph_hor_advance(glyph));
    let units: u32 =
        span.text.chars().map(|letter| u32::from(advance(letter).unwrap_or(face.units_per_em() / 2))).sum();
    size * f64::from(units) / f64::from(face.units_per_em())
}

/// The text without its markup.
pub fn plain(markup: &str) -> String {
    spans(markup).into_iter().map(|span| span.text).collect()
}

/// The symbol of a quantity, a column or a unit, in markup: an italic letter, with the text after the first `_` as subscript.
fn symbol(name: &str) -> Option<String> {
    let known = match name {
        "dt" => "d*t*",
        "delta_t" => "*δt*",
        "v, v_c" => "*v*, *v*_{c}",
        "work" => "*W*",
        "work_optimal" => "*W*∗",
        "v_start" => "*v*(0+)",
        "v_end" => "*v*(*t*_{f}−)",
        "friction_max" => "*τ*_{max}",
        "hamiltonian" => "d*W*∗/d*t*_{f}",
        "t_free_in" => "*t*_{free in}",
        "t_free_out" => "*t*_{free out}",
        "costate" => "∂*W*/∂*θ*",
        "gain" => "∂*v*/∂*θ*",
        "k_c_i" => "*k*_{c}(*v*_{i})",
        "k_c_f" => "*k*_{c}(*v*_{f})",
        "stiffness_ratio" => "*k t*_{f}^{2}/*m*",
        _ => "",
    };
    if !known.is_empty() {
        return Some(known.to_owned());
    }
    if let Some(time) = name.strip_prefix("work_at_") {
        return symbol(time).map(|time| format!("*W*∗({time})"));
    }
    if let Some(quantity) = name.strip_prefix("dwork_d") {
        return symbol(quantity).map(|quantity| format!("∂*W*∗/∂{quantity}"));
    }
    let (base, below) = name.split_once('_').map_or((name, None), |(base, below)| (base, Some(below)));
    let letter = match base {
        "alpha" => "α",
        "beta" => "β",
        "theta" => "θ",
        "mu" => "μ",
        "sigma" => "σ",
        "tau" => "τ",
        "t" | "a" | "b" | "k" | "m" | "l" | "v" => base,
        _ => return None,
    };
    Some(match below {
        Some(below) => format!("*{letter}*_{{{}}}", below.replace('_', ",")),
        None => format!("*{letter}*"),
    })
}

/// The name of a column in markup: its symbol, or its name in words.
pub fn name(column: &str) -> String {
    symbol(column).unwrap_or_else(|| column.replace('_', " "))
}

/// The symbols in scaled units. In SI units, letters are upright and `m` is a metre.
const SCALES: [&str; 5] = ["mu_0", "sigma", "l", "v_0", "t_f"];

fn scale(word: &str) -> String {
    symbol(word).filter(|_| SCALES.contains(&word)).unwrap_or_else(|| word.to_owned())
}

/// A value of a column, in markup, with its unit.
pub fn equation(column: &str, value: &str, of: &str) -> String {
    let unit = if value == "∞" { String::new() } else { unit(of) };
    match unit.strip_prefix("1/") {
        Some(rest) => format!("{} = {value}/{rest}", name(column)),
        None => format!("{} = {value} {unit}", name(column)).trim_end().to_owned(),
    }
}

/// A unit in markup; empty for a pure number.
pub fn unit(unit: &str) -> String {
    // The unit of a column may continue after a semicolon for special cases.
    let unit = unit.split(';').next().unwrap_or("").trim();
    if unit == "1" {
        return String::new();
    }
    let between = [' ', '/', '(', ')'];
    let typeset = |piece: &str| {
        let word = piece.trim_end_matches(between);
        let shown = match word.split_once('^') {
            Some((base, power)) => format!("{}^{{{power}}}", scale(base)),
            None => scale(word),
        };
        shown + &piece[word.len()..]
    };
    unit.split_inclusive(between).map(typeset).collect()
}

/// Up to three texts, else the first one and the number of the others.
pub fn few(texts: &[impl AsRef<str>]) -> String {
    match texts {
        [first, rest @ ..] if rest.len() > 2 => format!("{} and {} more", first.as_ref(), rest.len()),
        few => few.iter().map(AsRef::as_ref).collect::<Vec<_>>().join("; "),
    }
}

/// The label of an axis: name, unit and the common power of ten of its numbers.
pub fn axis(column: &str, of: &str, power: i32) -> String {
    let name = if column == "gap" { "gap (*W* − *W*∗)/*W*∗".to_owned() } else { name(column) };
    // A coefficient per duration is shown times the duration.
    let (name, of) = match of.find("/t_f") {
        Some(place) => (format!("{name} {}", unit(&of[place + 1..])), of[..place].trim_matches(['(', ')'])),
        None => (name, of),
    };
    let scale = if power == 0 { String::new() } else { format!("10^{{{}}}", signed(power)) };
    match format!("{scale} {}", unit(of)).trim() {
        "" => name,
        inside => format!("{name} ({inside})"),
    }
}

/// An integer with a true minus sign.
pub fn signed(value: i32) -> String {
    if value < 0 { format!("−{}", value.unsigned_abs()) } else { value.to_string() }
}

/// A number to five digits, in markup; as a decimal from 0.001 to 99999, like ticks.
pub fn number(value: f64) -> String {
    number_among(value, &[])
}

/// A number in the common format of `others`: with a power of ten if one of them needs it.
pub fn number_among(value: f64, others: &[f64]) -> String {
    let needs_power = |other: &f64| other.is_finite() && *other != 0.0 && !(1e-3..99_999.5).contains(&other.abs());
    let as_powers = others.iter().any(needs_power);
    match value {
        0.0 => return "0".to_owned(),
        f64::INFINITY => return "∞".to_owned(),
        f64::NEG_INFINITY => return "−∞".to_owned(),
        _ if value.is_nan() => return "–".to_owned(),
        _ => {}
    }
    let digits = digits(others);
    let scientific = format!("{:.*e}", digits - 1, value.abs());
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let minus = if value < 0.0 { "−" } else { "" };
    if exponent == 0 || !as_powers && (-3..5).contains(&exponent) {
        let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
        return format!("{minus}{}", trimmed(&format!("{:.decimals$}", value.abs())));
    }
    match trimmed(mantissa) {
        "1" => format!("{minus}10^{{{}}}", signed(exponent)),
        digits => format!("{minus}{digits}×10^{{{}}}", signed(exponent)),
    }
}

/// Digits that distinguish ascending numbers: five, or more for close ones.
fn digits(values: &[f64]) -> usize {
    let gap = |pair: &[f64]| (pair[1] - pair[0]).abs() / pair[1].abs().max(pair[0].abs());
    let least = values.windows(2).map(gap).filter(|gap| *gap > 0.0).fold(1.0, f64::min);
    (2.0 - least.log10().floor()).clamp(5.0, 17.0) as usize
}

/// Breaks a text in markup into lines of at most `most` (in units of the font size), at spaces, but not around an equality sign.
pub fn wrapped(markup: &str, most: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    // Spaces within equations are protected during line breaking.
    let markup = markup.split_inclusive([',', ';']).map(|part| match part.contains(" = ") && width(part) <= most {
        true => part.trim_start().replace(' ', "\u{a0}"),
        false => part.trim_start().to_owned(),
    });
    let markup = markup.collect::<Vec<_>>().join(" ").replace(" = ", "\u{a0}=\u{a0}");
    for word in markup.split(' ') {
        let word = &word.replace('\u{a0}', " ");
        match lines.last_mut() {
            Some(line) if width(&format!("{line} {word}")) <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.clone()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    //! Labels in their final form.

    use super::*;

    #[test]
    fn the_fonts_have_the_letters_of_european_languages() {
        let known = "Åland röd, São José, Grès, Øre ß ñ ç, 25 °C, 10 µm, Łódź, Çeşme, α–β";
        assert_eq!(missing_letters(known), BTreeSet::new());
        assert_eq!(missing_letters("a 花"), BTreeSet::from(['花']));
    }

    #[test]
    fn up_to_three_texts_are_named() {
        assert_eq!(few(&["a", "b", "c"]), "a; b; c");
        assert_eq!(few(&["a", "b", "c", "d"]), "a and 3 more");
    }

    #[test]
    fn symbols_and_units_are_typeset() {
        assert_eq!(axis("t_f", "l/v_0", 0), "*t*_{f} (*l*/*v*_{0})");
        assert_eq!(axis("t_f", "l/v_0", -6), "*t*_{f} (10^{−6} *l*/*v*_{0})");
        assert_eq!(axis("m", "mu_0 sigma l/v_0^2", 0), "*m* (*μ*_{0} *σ* *l*/*v*_{0}^{2})");
        assert_eq!(axis("alpha_2", "1/t_f", 0), "*α*_{2} *t*_{f}");
        assert_eq!(axis("alpha_2", "(l/v_0)/t_f", 0), "*α*_{2} *t*_{f} (*l*/*v*_{0})");
        assert_eq!(axis("alpha_3", "1/t_f^2", -4), "*α*_{3} *t*_{f}^{2} (10^{−4})");
        assert_eq!(axis("terminal_error", "1", 0), "terminal error");
        assert_eq!(axis("k", "Pa/m", 3), "*k* (10^{3} Pa/m)");
        assert_eq!(axis("m", "kg/m^2", 0), "*m* (kg/m^{2})");
        assert_eq!(equation("v_i", "3×10^{−9}", "m/s"), "*v*_{i} = 3×10^{−9} m/s");
        assert_eq!(equation("v_i", "3", "v_0"), "*v*_{i} = 3 *v*_{0}");
        assert_eq!(equation("alpha_2", "−0.12", "1/t_f"), "*α*_{2} = −0.12/*t*_{f}");
        assert_eq!(equation("alpha_2", "−0.12", "(l/v_0)/t_f"), "*α*_{2} = −0.12 (*l*/*v*_{0})/*t*_{f}");
        assert_eq!(equation("k", "∞", "Pa/m"), "*k* = ∞");
    }

    #[test]
    fn markup_is_cut_into_spans() {
        let styles: Vec<(String, bool, i8)> =
            spans("*t*_{f} 2").into_iter().map(|span| (span.text, span.italic, span.level)).collect();
        assert_eq!(styles, [("t".to_owned(), true, 0), ("f".to_owned(), false, -1), (" 2".to_owned(), false, 0)]);
        assert_eq!(plain("*W*∗(*t*_{f})"), "W*(tf)");
        assert_eq!(plain(&literal("dry_granite *2 {a}_{b}")), "dry_granite *2 (a)_(b)");
    }

    #[test]
    fn numbers_are_short() {
        let shown = [0.03, 3.2e6, 1e5, 2.5e-16, -0.12, 100.0, f64::INFINITY].map(number);
        assert_eq!(shown, ["0.03", "3.2×10^{6}", "10^{5}", "2.5×10^{−16}", "−0.12", "100", "∞"]);
    }

    #[test]
    fn numbers_of_an_axis_have_one_format() {
        let values = [1e-4, 1e-3, 0.02, 3.0];
        assert_eq!(values.map(|value| number_among(value, &values)), ["10^{−4}", "10^{−3}", "2×10^{−2}", "3"]);
        assert_eq!(values.map(|value| number_among(value, &values[1..])), ["10^{−4}", "0.001", "0.02", "3"]);
    }

    #[test]
    fn equations_are_not_cut() {
        assert_eq!(wrapped("a = 1, b = 2", 3.0), ["a = 1,", "b = 2"]);
    }

    #[test]
    fn every_symbol_has_its_glyphs() {
        let face = Face::parse(FONTS[0], 0).expect("the font can be read");
        for letter in "θτβαμσδΔ*−×·≤≥≈∞…–→′".chars() {
            assert!(face.glyph_index(letter).is_some(), "{letter} is not in the font");
        }
    }
}
