//! Conditions on rows: `--where "a=0.03"`.

use std::cmp::Ordering;

use crate::dataset::frame::Cells;
use crate::plot::PlotError;

const EQUAL: &[Ordering] = &[Ordering::Equal];
const UNEQUAL: &[Ordering] = &[Ordering::Less, Ordering::Greater];

/// The signs and the orders of a cell and a value that each allows; signs of two characters come first, since they begin like others.
const SIGNS: [(&str, &[Ordering]); 7] = [
    ("<=", &[Ordering::Less, Ordering::Equal]),
    (">=", &[Ordering::Greater, Ordering::Equal]),
    ("!=", UNEQUAL),
    ("==", EQUAL),
    ("=", EQUAL),
    ("<", &[Ordering::Less]),
    (">", &[Ordering::Greater]),
];

/// Number of digits by which numbers are equal. Chosen: tables on the terminal show nine.
const EQUAL_DIGITS: i32 = 9;

/// A condition on a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// The column.
    pub column: String,
    /// The orders of a cell and a value that it allows.
    orders: &'static [Ordering],
    /// The number or word, or several for `in`.
    pub values: Vec<String>,
}

/// The error of a text that is not a condition.
fn no_condition(text: &str) -> PlotError {
    PlotError::Refused(format!(
        "--where {}: not a condition\n  expected: COLUMN=VALUE, or <, >, <=, >= or != between them, or COLUMN in (VALUE, VALUE); several of \
         them separated by commas\n  help: such as --where \"a=0.03, v_f>=10\"",
        text.trim()
    ))
}

impl Condition {
    /// The conditions in `text`, separated by commas or `and` in any case.
    ///
    /// # Errors
    ///
    /// A condition without a column, a comparison and a value.
    pub fn all(text: &str) -> Result<Vec<Condition>, PlotError> {
        let pieces = split(text, &[",", " and "]).ok_or_else(|| no_condition(text))?;
        pieces.into_iter().map(Condition::one).collect()
    }

    fn one(text: &str) -> Result<Condition, PlotError> {
        let wrong = || no_condition(text);
        // The first sign; of several at one position, the longest, which comes first in `SIGNS`.
        let found = SIGNS.iter().filter_map(|(sign, orders)| Some((text.find(sign)?, sign.len(), *orders)));
        // In ASCII alone, places are those of the text.
        let lower = text.to_ascii_lowercase();
        let list = lower.find(" in ").or_else(|| lower.find(" in("));
        let found = found.chain(list.map(|place| (place, " in".len(), EQUAL)));
        let (place, length, orders) = found.min_by_key(|(place, ..)| *place).ok_or_else(wrong)?;
        let (column, typed) = (text[..place].trim(), text[place + length..].trim());
        let values = if list == Some(place) {
            let inside = typed.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')).ok_or_else(wrong)?;
            split(inside, &[","]).ok_or_else(wrong)?.into_iter().map(|item| unquoted(item.trim())).collect()
        } else {
            unquoted(typed).map(|value| vec![value])
        };
        let values: Vec<String> = values.ok_or_else(wrong)?;
        if column.is_empty() {
            return Err(wrong());
        }
        Ok(Condition { column: column.to_owned(), orders, values })
    }

    /// The text of the condition.
    pub fn shown(&self) -> String {
        match self.values.as_slice() {
            [value] => format!("{} {} {value}", self.column, self.sign()),
            several => format!("{} in ({})", self.column, several.join(", ")),
        }
    }

    fn sign(&self) -> &'static str {
        SIGNS.iter().rev().find(|(_, orders)| *orders == self.orders).map_or("=", |(sign, _)| sign)
    }

    /// Whether a number meets the condition; NaN never does.
    pub fn holds(&self, cell: f64) -> bool {
        let order = |value| if is_equal(cell, value) { Ordering::Equal } else { cell.total_cmp(&value) };
        !cell.is_nan() && self.numbers().any(|value| self.orders.contains(&order(value)))
    }

    /// Whether a number from `low` to `high` may meet the condition.
    pub fn may_hold(&self, low: f64, high: f64) -> bool {
        self.holds(low) || self.holds(high) || self.numbers().any(|value| low < value && value < high)
    }

    fn numbers(&self) -> impl Iterator<Item = f64> {
        self.values.iter().filter_map(|value| value.parse().ok())
    }

    /// The number in an equality.
    pub fn wanted(&self) -> Option<f64> {
        self.word()?.parse().ok()
    }

    /// Whether the values are numbers.
    pub fn is_of_number(&self) -> bool {
        self.numbers().count() == self.values.len()
    }

    /// The word in an equality.
    pub fn word(&self) -> Option<&str> {
        match self.values.as_slice() {
            [value] if self.orders == EQUAL => Some(value),
            _ => None,
        }
    }

    /// The text of the condition as typed, with `value` instead of its number.
    pub fn typed(&self, value: Option<f64>) -> String {
        let quoted = |value: &String| {
            if value.contains([' ', ',', '(', ')']) { format!("'{value}'") } else { value.clone() }
        };
        let values: Vec<String> = self.values.iter().map(quoted).collect();
        match (value, values.as_slice()) {
            (Some(value), _) => format!("{}={}", self.column, format!("{value:?}").trim_end_matches(".0")),
            (None, [value]) => format!("{}{}{value}", self.column, self.sign()),
            (None, several) => format!("{} in ({})", self.column, several.join(", ")),
        }
    }

    /// Whether the cell of a row meets the condition.
    pub fn holds_in(&self, cells: &Cells, row: usize) -> bool {
        match cells {
            Cells::Numbers(numbers) => self.holds(numbers[row]),
            Cells::Words(places, words) => self.holds_word(places[row].map(|place| words[place as usize].as_str())),
        }
    }

    /// Whether a word meets the condition.
    pub fn holds_word(&self, word: Option<&str>) -> bool {
        let is_in = |word: &str| self.values.iter().any(|value| value == word);
        word.is_some_and(|word| match self.orders {
            EQUAL => is_in(word),
            UNEQUAL => !is_in(word),
            _ => false,
        })
    }
}

/// Whether a number has the first [`EQUAL_DIGITS`] digits of `value`, rounded. A finite number does not equal an infinite one.
fn is_equal(number: f64, value: f64) -> bool {
    // With room for the rounding of the difference.
    let last_digit = 10f64.powf(value.abs().log10().floor() - f64::from(EQUAL_DIGITS - 1));
    number == value || value != 0.0 && value.is_finite() && (number - value).abs() <= (0.5 + 1e-6) * last_digit
}

/// The pieces of a text between `separators` in any case, outside quotes and parentheses; `None` for an open quote.
fn split<'a>(text: &'a str, separators: &[&str]) -> Option<Vec<&'a str>> {
    let (mut pieces, mut from, mut quote, mut depth) = (Vec::new(), 0, None, 0);
    for (place, letter) in text.char_indices() {
        // A quote begins a value; elsewhere it is an apostrophe.
        let begins = |before: &str| before.is_empty() || before.ends_with(['=', '<', '>', '(', ',']);
        let starts = |separator: &&&str| {
            text[place..].get(..separator.len()).is_some_and(|start| start.eq_ignore_ascii_case(separator))
        };
        match (letter, quote) {
            (_, Some(opening)) => quote = quote.filter(|_| letter != opening),
            ('"' | '\'', None) if begins(text[..place].trim_end()) => quote = Some(letter),
            ('(', None) => depth += 1,
            (')', None) => depth -= 1,
            _ if depth > 0 || place < from => {}
            _ => {
                if let Some(separator) = separators.iter().find(starts) {
                    pieces.push(&text[from..place]);
                    from = place + separator.len();
                }
            }
        }
    }
    pieces.push(&text[from..]);
    quote.is_none().then_some(pieces)
}

/// A typed value without its quotes; `None` for no value, or a sign outside quotes, which belongs to a second condition.
fn unquoted(typed: &str) -> Option<String> {
    let is_quoted = |quote: &char| typed.len() > 1 && typed.starts_with(*quote) && typed.ends_with(*quote);
    if let Some(quote) = ['"', '\''].iter().find(|quote| is_quoted(quote)) {
        return Some(typed.trim_matches(*quote).to_owned()).filter(|value| !value.is_empty());
    }
    let is_other = typed.contains(['<', '>', '=', '!', '&', '|', '"', '\'', '(', ')']);
    let is_or = typed.to_lowercase().contains(" or ");
    (!typed.is_empty() && !is_other && !is_or).then(|| typed.to_owned())
}

#[cfg(test)]
mod tests {
    //! Conditions as typed by a user.

    use super::*;

    #[test]
    fn conditions_are_read_and_kept() {
        for and in ["and", "AND", "And"] {
            let text = format!("a=0.03, v_f>=10 {and} family != cubic");
            let conditions = Condition::all(&text).expect("three conditions");
            assert_eq!(
                conditions.iter().map(Condition::shown).collect::<Vec<_>>(),
                ["a = 0.03", "v_f >= 10", "family != cubic"]
            );
        }
        let conditions = Condition::all("a=0.03, v_f>=10 and family != cubic").expect("three conditions");
        assert_eq!(conditions.iter().map(|c| c.column.as_str()).collect::<Vec<_>>(), ["a", "v_f", "family"]);
        assert!(conditions[0].holds(0.03) && !conditions[0].holds(0.031) && !conditions[0].holds(f64::NAN));
        assert!(conditions[1].holds(10.0) && conditions[1].holds(11.0) && !conditions[1].holds(9.0));
        let ceiling = &Condition::all("v_ceiling=inf").expect("one condition")[0];
        assert!(ceiling.holds(f64::INFINITY) && !ceiling.holds(300.0));
        assert!(conditions[2].holds_word(Some("step")) && !conditions[2].holds_word(Some("cubic")));
    }

    #[test]
    fn ranges_that_cannot_hold_are_known() {
        let may_hold = |text: &str, low, high| {
            let conditions = Condition::all(text).expect("a condition");
            conditions[0].may_hold(low, high)
        };
        assert!(may_hold("a=0.03", 0.01, 0.05) && may_hold("a=0.03", 0.03 * (1.0 + 1e-12), 0.05));
        assert!(!may_hold("a=0.03", 0.04, 0.05) && !may_hold("a=word", 0.01, 0.05));
        assert!(may_hold("a!=0.03", 0.03, 0.04) && !may_hold("a!=0.03", 0.03, 0.03));
        assert!(may_hold("a<0.03", 0.01, 0.05) && !may_hold("a<0.03", 0.03, 0.05) && may_hold("a<=0.03", 0.03, 0.05));
        assert!(may_hold("a>0.03", 0.01, 0.05) && !may_hold("a>0.03", 0.01, 0.03) && may_hold("a>=0.03", 0.01, 0.03));
    }

    #[test]
    fn conditions_are_typed_as_they_are_read() {
        let conditions = Condition::all("v_f = 100, a >= 0.03").expect("two conditions");
        assert_eq!(conditions[0].typed(Some(100.0000001)), "v_f=100.0000001");
        assert_eq!((conditions[0].typed(Some(50.0)), conditions[1].typed(None)), ("v_f=50".into(), "a>=0.03".into()));
    }

    #[test]
    fn words_may_stand_in_quotes_of_any_kind() {
        for text in ["status=ok", "status = 'ok'", "status = \"ok\"", "status == ok"] {
            let conditions = Condition::all(text).expect("a condition");
            assert!(conditions[0].holds_word(Some("ok")) && !conditions[0].holds_word(Some("infeasible")), "{text}");
        }
        for text in ["material='gabbro, wet', b=0.04", "b=0.04 and material = \"gabbro, wet\""] {
            let conditions = Condition::all(text).expect("two conditions");
            assert!(conditions.len() == 2 && conditions.iter().any(|c| c.holds_word(Some("gabbro, wet"))), "{text}");
        }
    }

    /// All nine digits that a table shows.
    #[test]
    fn numbers_are_equal_to_nine_digits() {
        let holds = |text: &str, number: f64| Condition::all(text).expect("a condition")[0].holds(number);
        for number in [0.2365756294807403, 1.2139244620058342e-5, 9.8765432149e9, -1.2345678904e-300, 1e300] {
            let (nine, seven) = (format!("x={number:.8e}"), format!("x={number:.6e}"));
            assert!(holds(&nine, number) && !holds(&format!("x={:e}", number * (1.0 + 2e-8)), number), "{nine}");
            assert!(holds(&seven, number) == (number == 1e300), "{seven}");
        }
        assert!(holds("x=0", 0.0) && !holds("x=0", 1e-300) && !holds("x=inf", 1e300));
    }

    #[test]
    fn lists_hold_for_any_of_their_values() {
        let conditions = Condition::all("sample in (G1, 'wet, and cold', T2), t_f IN(0.02,0.3) and b>0.01");
        let conditions = conditions.expect("three conditions");
        let shown: Vec<String> = conditions.iter().map(Condition::shown).collect();
        assert_eq!(shown, ["sample in (G1, wet, and cold, T2)", "t_f in (0.02, 0.3)", "b > 0.01"]);
        assert_eq!(conditions[0].typed(None), "sample in (G1, 'wet, and cold', T2)");
        for (word, is_in) in [("G1", true), ("wet, and cold", true), ("G2", false)] {
            assert_eq!(conditions[0].holds_word(Some(word)), is_in);
        }
        assert!(conditions[1].holds(0.3) && !conditions[1].holds(0.1));
        assert!(conditions[1].may_hold(0.2, 0.4) && !conditions[1].may_hold(0.04, 0.2));
        // A letter with a longer lower case.
        assert_eq!(Condition::all("İ in (a)").expect("a condition")[0].column, "İ");
        assert_eq!(Condition::all("sample=weakening G1").expect("a condition")[0].typed(None), "sample='weakening G1'");
    }

    #[test]
    fn what_is_no_condition_is_refused() {
        for text in [
            "a",
            "=3",
            "a=",
            "a=1,",
            "",
            "material='gabbro, wet",
            "a=1 && b=2",
            "a=1 or b=2",
            "a=1 OR b=2",
            "a=1 or 2",
            "a in 1",
            "a in ()",
            "a in (1",
            "a in (1,)",
            "a='x",
        ] {
            assert!(matches!(Condition::all(text), Err(PlotError::Refused(_))), "{text}");
        }
    }
}
