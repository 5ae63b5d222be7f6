//! Conditions on rows: `--where "a=0.03"`.

use crate::dataset::frame::Cells;
use crate::plot::PlotError;

/// The relation of a cell to a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Relation {
    Equal,
    Unequal,
    Less,
    AtMost,
    Greater,
    AtLeast,
}

/// The signs of relations; signs of two characters come first, since they begin like others.
const SIGNS: [(&str, Relation); 7] = [
    ("<=", Relation::AtMost),
    (">=", Relation::AtLeast),
    ("!=", Relation::Unequal),
    ("==", Relation::Equal),
    ("=", Relation::Equal),
    ("<", Relation::Less),
    (">", Relation::Greater),
];

/// Relative difference below which numbers are equal. Chosen: nine typed digits identify a number.
const EQUAL_RTOL: f64 = 1e-9;

/// A condition on a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// The column.
    pub column: String,
    relation: Relation,
    /// The number or word.
    pub value: String,
}

impl Condition {
    /// The conditions in `text`, separated by commas or `and` in any case.
    ///
    /// # Errors
    ///
    /// A condition without a column, a comparison and a value.
    pub fn all(text: &str) -> Result<Vec<Condition>, PlotError> {
        const AND: &str = " and ";
        let is_and = |rest: &str| rest.get(..AND.len()).is_some_and(|start| start.eq_ignore_ascii_case(AND));
        let (mut all, mut from, mut quote) = (Vec::new(), 0, None);
        for (place, letter) in text.char_indices() {
            // A separator in quotes belongs to a word.
            let separator = match (letter, quote) {
                ('"' | '\'', None) if text[..place].trim_end().ends_with(['=', '<', '>']) => {
                    quote = Some(letter);
                    continue;
                }
                (_, Some(opening)) => {
                    quote = quote.filter(|_| letter != opening);
                    continue;
                }
                (',', _) => ",",
                (' ', _) if is_and(&text[place..]) => AND,
                _ => continue,
            };
            if place >= from {
                all.push(Condition::one(&text[from..place])?);
                from = place + separator.len();
            }
        }
        if quote.is_some() {
            return Err(PlotError::Condition { text: text.trim().to_owned() });
        }
        all.push(Condition::one(&text[from..])?);
        Ok(all)
    }

    fn one(text: &str) -> Result<Condition, PlotError> {
        let wrong = || PlotError::Condition { text: text.trim().to_owned() };
        if [" or ", " in "].iter().any(|word| text.to_lowercase().contains(word)) {
            return Err(wrong());
        }
        // The first sign; of several at one position, the longest, which comes first in `SIGNS`.
        let found = SIGNS.iter().filter_map(|(sign, relation)| Some((text.find(sign)?, sign.len(), *relation)));
        let (place, length, relation) = found.min_by_key(|(place, ..)| *place).ok_or_else(wrong)?;
        let (column, typed) = (text[..place].trim(), text[place + length..].trim());
        let is_quoted = |quote: char| typed.len() > 1 && typed.starts_with(quote) && typed.ends_with(quote);
        let quoted = ['"', '\''].into_iter().find(|quote| is_quoted(*quote));
        let value = quoted.map_or(typed, |quote| typed.trim_matches(quote));
        // A sign in a value without quotes belongs to a second condition.
        let is_other = quoted.is_none() && value.contains(['<', '>', '=', '!', '&', '|', '"', '\'']);
        if column.is_empty() || value.is_empty() || is_other {
            return Err(wrong());
        }
        Ok(Condition { column: column.to_owned(), relation, value: value.to_owned() })
    }

    /// The text of the condition.
    pub fn shown(&self) -> String {
        self.shown_with(&self.value)
    }

    /// Whether a number meets the condition; NaN never does.
    pub fn holds(&self, cell: f64) -> bool {
        let Ok(value) = self.value.parse::<f64>() else { return false };
        // A finite number does not equal an infinite one.
        let difference = (cell - value).abs();
        let equal = cell == value || difference.is_finite() && difference <= EQUAL_RTOL * cell.abs().max(value.abs());
        match self.relation {
            Relation::Equal => equal,
            Relation::Unequal => !equal && !cell.is_nan(),
            Relation::Less => cell < value && !equal,
            Relation::AtMost => cell < value || equal,
            Relation::Greater => cell > value && !equal,
            Relation::AtLeast => cell > value || equal,
        }
    }

    /// Whether a number from `low` to `high` may meet the condition.
    pub fn may_hold(&self, low: f64, high: f64) -> bool {
        let Ok(value) = self.value.parse::<f64>() else { return false };
        match self.relation {
            Relation::Equal => low <= value && value <= high || self.holds(low) || self.holds(high),
            Relation::Unequal => low != high || self.holds(low),
            Relation::Less | Relation::AtMost => self.holds(low),
            Relation::Greater | Relation::AtLeast => self.holds(high),
        }
    }

    /// The number in an equality.
    pub fn wanted(&self) -> Option<f64> {
        (self.relation == Relation::Equal).then(|| self.value.parse().ok()).flatten()
    }

    /// Whether the value is a number.
    pub fn is_of_number(&self) -> bool {
        self.value.parse::<f64>().is_ok()
    }

    /// The word in an equality.
    pub fn word(&self) -> Option<&str> {
        (self.relation == Relation::Equal).then_some(self.value.as_str())
    }

    /// The text of the condition with another number.
    pub fn typed(&self, value: Option<f64>) -> String {
        let value = value.map_or_else(|| self.value.clone(), |value| format!("{value:?}"));
        self.shown_with(value.strip_suffix(".0").unwrap_or(&value)).replace(' ', "")
    }

    fn shown_with(&self, value: &str) -> String {
        let sign = SIGNS.iter().rev().find(|(_, relation)| *relation == self.relation).map_or("=", |(sign, _)| sign);
        format!("{} {sign} {value}", self.column)
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
        match self.relation {
            Relation::Equal => word == Some(self.value.as_str()),
            Relation::Unequal => word.is_some_and(|word| word != self.value),
            _ => false,
        }
    }
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
            "a IN (1)",
            "a='x",
        ] {
            assert!(matches!(Condition::all(text), Err(PlotError::Condition { .. })), "{text}");
        }
    }
}
