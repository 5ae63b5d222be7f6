//! One axis of a spec: numbers, words, a range, an expression or a sample, checked against its legal values.

use super::error::{SpecError, refuse, unknown};
use super::read::help_for_word;
use super::spec::{AXIS, AxisForm, AxisSpec, AxisValue};
use super::units::{help, legal};
use crate::grid::{Axis, Design, Quantity, Scale, Values};
use crate::model::Units;

/// The definition of an axis.
pub enum Written {
    /// Its values.
    Values(Axis),
    /// A value at each point, computed from other axes.
    Computed {
        /// The unit of the values.
        scale: Scale,
        /// The expression.
        text: String,
    },
    /// Values drawn jointly with other axes.
    Sampled(Sampled),
}

/// An axis of a joint sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampled {
    /// The unit of the values.
    pub scale: Scale,
    /// The kind of sample.
    pub design: Design,
    /// The least value.
    pub least: f64,
    /// The greatest value.
    pub greatest: f64,
    /// Points of the sample.
    pub count: u64,
    /// The seed, if the axis has one.
    pub seed: Option<u32>,
}

/// Reads the axis of `quantity` at `key`.
///
/// # Errors
///
/// An axis with values that are not legal for `quantity`.
pub fn read(quantity: Quantity, units: &Units, key: &str, spec: &AxisSpec) -> Result<Written, SpecError> {
    let words = quantity.words();
    let axis = AxisDraft { quantity, units, scale: Scale::Model, key };
    let values = match spec {
        AxisSpec::One(AxisValue::Word(word)) if words.is_empty() => {
            return refuse(key, format!("found string {word:?}"), AXIS, help_for_word(word));
        }
        AxisSpec::One(one) => vec![axis.value(key, one)?],
        AxisSpec::List(values) if values.is_empty() => {
            return refuse(key, "an empty list", "at least one value", "add values, or remove the axis");
        }
        AxisSpec::List(values) => {
            let values = values.iter().enumerate();
            values.map(|(index, one)| axis.value(&format!("{key}[{index}]"), one)).collect::<Result<_, _>>()?
        }
        AxisSpec::Form(_) if !words.is_empty() => {
            let expected = format!("one or a list of {}", quoted(&words));
            return refuse(key, "found a table", expected, "write the words as a list");
        }
        AxisSpec::Form(form) => return AxisDraft { scale: axis.scale_of(form)?, ..axis }.form(form),
    };
    Ok(axis.written(Values::List(values)))
}

fn quoted(words: &[&str]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

/// The index of `word`, found at `key`, among those of `quantity`.
///
/// # Errors
///
/// The fault of an unknown word, or of a word for a number.
pub fn word(key: &str, quantity: Quantity, word: &str) -> Result<f64, SpecError> {
    let words = quantity.words();
    match words.iter().position(|known| *known == word) {
        Some(place) => Ok(place as f64),
        None if words.is_empty() => refuse(key, format!("found string {word:?}"), "a number", help_for_word(word)),
        None => Err(unknown(key.to_owned(), quantity.name(), word, &words)),
    }
}

/// An axis while it is read.
#[derive(Clone, Copy)]
struct AxisDraft<'a> {
    quantity: Quantity,
    units: &'a Units,
    scale: Scale,
    key: &'a str,
}

impl AxisDraft<'_> {
    fn written(self, values: Values) -> Written {
        Written::Values(Axis { quantity: self.quantity, scale: self.scale, values })
    }

    fn legal(self, value: f64) -> Result<(), String> {
        legal(self.units, self.quantity, self.scale, value)
    }

    /// One value: a number in its range, or the index of a word.
    fn value(self, key: &str, value: &AxisValue) -> Result<f64, SpecError> {
        let words = self.quantity.words();
        match value {
            AxisValue::Word(found) => word(key, self.quantity, found),
            AxisValue::Number(number) if !words.is_empty() => {
                let expected = format!("one of {}", quoted(&words));
                refuse(key, format!("found {number:?}"), expected, "write the word in quotes")
            }
            AxisValue::Number(number) => match self.legal(*number) {
                Ok(()) => Ok(*number),
                Err(legal) => self.out_of_range(key, *number, legal),
            },
        }
    }

    fn out_of_range<T>(self, key: &str, value: f64, legal: String) -> Result<T, SpecError> {
        refuse(key, format!("{value:?} is out of range"), legal, help(self.units, self.quantity, value))
    }

    /// The unit of the values of a table.
    fn scale_of(self, form: &AxisForm) -> Result<Scale, SpecError> {
        let Some(unit) = &form.unit else { return Ok(Scale::Model) };
        let known = self.quantity.scales();
        let name = |scale: Scale| unit_name(self.units, self.quantity, scale);
        known.iter().copied().find(|scale| name(*scale) == unit).ok_or_else(|| {
            let units: Vec<String> = known.iter().map(|scale| format!("\"{}\"", name(*scale))).collect();
            let (key, help) = (format!("{}.unit", self.key), "correct the unit, or remove it");
            SpecError::new(key, format!("unknown unit {unit:?}"), units.join(" or "), help)
        })
    }

    /// Reads an axis written as a table.
    fn form(self, form: &AxisForm) -> Result<Written, SpecError> {
        let key = self.key;
        let forms = [
            ("linspace", form.linspace.is_some()),
            ("geomspace", form.geomspace.is_some()),
            ("expr", form.expr.is_some()),
            ("sobol", form.sobol.is_some()),
            ("lhs", form.lhs.is_some()),
        ];
        let written: Vec<&str> = forms.into_iter().filter(|(_, is_there)| *is_there).map(|(name, _)| name).collect();
        if let [one, other, ..] = written.as_slice() {
            return refuse(key, format!("both {one} and {other}"), "one of them", "remove one of the two");
        }
        if form.seed.is_some() && form.sobol.is_none() && form.lhs.is_none() {
            return refuse(
                format!("{key}.seed"),
                "a seed without a sampled design",
                "sobol or lhs in the same axis",
                "remove it",
            );
        }
        match form {
            AxisForm { linspace: Some(numbers), .. } => self.range(false, numbers),
            AxisForm { geomspace: Some(numbers), .. } => self.range(true, numbers),
            AxisForm { expr: Some(text), .. } => Ok(Written::Computed { scale: self.scale, text: text.clone() }),
            AxisForm { sobol: Some(numbers), .. } => self.sample(form.seed, Design::Sobol, numbers),
            AxisForm { lhs: Some(numbers), .. } => self.sample(form.seed, Design::LatinHypercube, numbers),
            _ => {
                let expected = "{ linspace = [first, last, count] } or { geomspace = [first, last, count] }";
                refuse(key, "a table without a range", expected, "add a range, or write a number or a list")
            }
        }
    }

    /// The three numbers of a range or sample. The first two are legal values.
    fn ends(self, key: &str, names: &str, numbers: &[f64]) -> Result<[f64; 3], SpecError> {
        let &[first, last, count] = numbers else {
            return refuse(key, format!("{} values", numbers.len()), names, "give exactly three values");
        };
        for (index, end) in [first, last].into_iter().enumerate() {
            if key.ends_with("geomspace") && end <= 0.0 && self.legal(end).is_err() {
                let (found, help) = (
                    format!("{end:?} is out of range"),
                    "geomspace takes the first and the last value, not their exponents",
                );
                return refuse(format!("{key}[{index}]"), found, "a positive number", help);
            }
            let legal = if end.is_finite() { self.legal(end) } else { Err("finite ends".to_owned()) };
            if let Err(legal) = legal {
                return self.out_of_range(&format!("{key}[{index}]"), end, legal);
            }
        }
        Ok([first, last, count])
    }

    fn range(self, geometric: bool, numbers: &[f64]) -> Result<Written, SpecError> {
        let key = &format!("{}.{}", self.key, if geometric { "geomspace" } else { "linspace" });
        let [first, last, count] = self.ends(key, "[first, last, count]", numbers)?;
        // From 2^53 on a double may differ from the integer in the spec.
        if !(2.0..9_007_199_254_740_992.0).contains(&count) || count.fract() != 0.0 {
            let help = match count {
                1.0 => "for one value write the number itself",
                _ if count.fract() != 0.0 => "the third number is the count of values, not their distance",
                _ => "choose a count in the range",
            };
            let found = format!("{count} is not a count of values");
            return refuse(format!("{key}[2]"), found, "a whole number from 2 to 2^53 - 1", help);
        }
        if first == last {
            let help = "for one value write the number itself";
            return refuse(key.as_str(), "first and last are the same", "a range", help);
        }
        let count = count as u64;
        if geometric && (first == 0.0 || last == 0.0 || (first < 0.0) != (last < 0.0)) {
            let found = format!("from {first:?} to {last:?} passes through zero");
            let help = "use linspace, or a range on one side of zero";
            return refuse(key.as_str(), found, "ends of the same sign, neither 0", help);
        }
        // The spacing of doubles is greatest at the larger end.
        let largest = first.abs().max(last.abs());
        let steps = (count - 1) as f64;
        let (spacing, least, values) = match geometric {
            true => (largest * libm::log(last / first).abs() / steps, 4.0, Values::Geomspace { first, last, count }),
            false => ((last - first).abs() / steps, 1.0, Values::Linspace { first, last, count }),
        };
        if spacing < least * (largest.next_up() - largest) {
            let found = format!("{count} values from {first:?} to {last:?}, closer than adjacent doubles");
            let expected = "values that differ from each other";
            return refuse(format!("{key}[2]"), found, expected, "take fewer values, or a list");
        }
        // From the isolated legal value to the interval.
        for value in [1, count - 2].map(|index| values.at(index)) {
            if let Err(legal) = self.legal(value) {
                let found = format!("a value of the range, {value:?}, is out of range");
                let help = "begin with the least legal number above 0, or take fewer values";
                return refuse(key.as_str(), found, legal, help);
            }
        }
        Ok(self.written(values))
    }

    fn sample(self, seed: Option<i64>, design: Design, numbers: &[f64]) -> Result<Written, SpecError> {
        let key = &format!("{}.{}", self.key, design.name());
        let [least, greatest, count] = self.ends(key, "[least, greatest, count]", numbers)?;
        let most = design.most();
        if !(1.0..=most as f64).contains(&count) || count.fract() != 0.0 {
            let (found, expected) =
                (format!("{count} is not a count of points"), format!("a whole number from 1 to {most}"));
            return refuse(format!("{key}[2]"), found, expected, "choose a count in the range");
        }
        if least >= greatest {
            let (found, expected) =
                (format!("from {least:?} to {greatest:?}"), "the least value first, below the greatest");
            return refuse(key.as_str(), found, expected, "correct the values");
        }
        let seed = seed.map(|seed| {
            u32::try_from(seed).or_else(|_| {
                let (found, expected) = (format!("{seed} is out of range"), "a whole number from 0 to 2^32 - 1");
                refuse(format!("{}.seed", self.key), found, expected, "choose another seed")
            })
        });
        let (scale, seed) = (self.scale, seed.transpose()?);
        Ok(Written::Sampled(Sampled { scale, design, least, greatest, count: count as u64, seed }))
    }
}

/// The word of a spec for the unit of values in `scale`; relative to the duration it is the same in any units.
pub fn unit_name(units: &Units, quantity: Quantity, scale: Scale) -> &'static str {
    let unit = quantity.unit(scale);
    if scale == Scale::Duration { unit } else { units.name(unit) }
}
