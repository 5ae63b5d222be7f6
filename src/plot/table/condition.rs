//! Conditions on rows: `--where "a=0.03"`.

use crate::plot::PlotError;

/// How a cell relates to a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Relation {
    Equal,
    Unequal,
    Less,
    AtMost,
    Greater,
    AtLeast,
}

/// The signs of relations; those of two characters first, since they start like others.
const SIGNS: [(&str, Relation); 7] = [
    ("<=", Relation::AtMost),
    (">=", Relation::AtLeast),
    ("!=", Relation::Unequal),
    ("==", Relation::Equal),
    ("=", Relation::Equal),
    ("<", Relation::Less),
    (">", Relation::Greater),
];

/// Numbers this close, relative to the greater, are equal: what nine digits show.
const CLOSE: f64 = 1e-9;

/// A condition on a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// The column.
    pub column: String,
    relation: Relation,
    value: String,
}

impl Condition {
    /// The conditions in `text`, with commas or `and` between them.
    pub fn all(text: &str) -> Result<Vec<Condition>, PlotError> {
        text.split(',').flat_map(|part| part.split(" and ")).map(Condition::one).collect()
    }

    fn one(text: &str) -> Result<Condition, PlotError> {
        let wrong = || PlotError::Condition { text: text.trim().to_owned() };
        // The sign that comes first, and of those at the same place the longest.
        let found = SIGNS.iter().filter_map(|(sign, relation)| Some((text.find(sign)?, sign.len(), *relation)));
        let (place, length, relation) =
            found.min_by_key(|(place, length, _)| (*place, 2 - *length)).ok_or_else(wrong)?;
        let (column, value) = (text[..place].trim(), text[place + length..].trim().trim_matches(['"', '\'']));
        if column.is_empty() || value.is_empty() {
            return Err(wrong());
        }
        Ok(Condition { column: column.to_owned(), relation, value: value.to_owned() })
    }

    /// It as it may be typed.
    pub fn shown(&self) -> String {
        let sign = SIGNS.iter().rev().find(|(_, relation)| *relation == self.relation).map_or("=", |(sign, _)| sign);
        format!("{} {sign} {}", self.column, self.value)
    }

    /// Whether a number fulfils it; where there is none, it never does.
    pub fn holds(&self, cell: f64) -> bool {
        let Ok(value) = self.value.parse::<f64>() else { return false };
        let equal = cell == value || (cell - value).abs() <= CLOSE * cell.abs().max(value.abs());
        match self.relation {
            Relation::Equal => equal,
            Relation::Unequal => !equal && !cell.is_nan(),
            Relation::Less => cell < value && !equal,
            Relation::AtMost => cell < value || equal,
            Relation::Greater => cell > value && !equal,
            Relation::AtLeast => cell > value || equal,
        }
    }

    /// Whether a word fulfils it.
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
    //! Conditions as they are typed.

    use super::*;

    #[test]
    fn conditions_are_read_and_kept() {
        let conditions = Condition::all("a=0.03, v_f>=10 and family != cubic").expect("three conditions");
        assert_eq!(conditions.iter().map(|c| c.column.as_str()).collect::<Vec<_>>(), ["a", "v_f", "family"]);
        assert!(conditions[0].holds(0.03) && !conditions[0].holds(0.031) && !conditions[0].holds(f64::NAN));
        assert!(conditions[1].holds(10.0) && conditions[1].holds(11.0) && !conditions[1].holds(9.0));
        assert!(conditions[2].holds_word(Some("step")) && !conditions[2].holds_word(Some("cubic")));
    }

    #[test]
    fn what_is_no_condition_is_refused() {
        for text in ["a", "=3", "a=", "a=1,", ""] {
            assert!(matches!(Condition::all(text), Err(PlotError::Condition { .. })), "{text}");
        }
    }
}
