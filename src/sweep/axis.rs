//! One axis of a spec: numbers, words, a range, an expression or a sample, checked against its legal values.

use super::error::{SpecError, refuse, unknown};
use super::read::HELP_FOR_NUMBER;
use super::spec::{AxisForm, AxisSpec, AxisValue};
use super::units::{help, legal};
use crate::grid::{Axis, Design, Quantity, Scale, Values};
use crate::model::Units;

/// Greatest number of values of a range: from 2^53 on a double may differ from the integer in the spec.
pub const MAX_COUNT: u64 = (1 << 53) - 1;

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
    let axis = AxisDraft { quantity, units, scale: Scale::Model, key };
    let values = match spec {
        AxisSpec::One(one) => vec![axis.value(key, one)?],
        AxisSpec::List(values) if values.is_empty() => {
            return refuse(key, "an empty list", "at least one value", "add values, or remove the axis");
        }
        AxisSpec::List(values) => {
            let values = values.iter().enumerate();
            values.map(|(index, one)| axis.value(&format!("{key}[{index}]"), one)).collect::<Result<_, _>>()?
        }
        AxisSpec::Form(_) if !quantity.words().is_empty() => {
            return refuse(key, "found a table", quantity.words().join(", "), "write the words as a list");
        }
        AxisSpec::Form(form) => return AxisDraft { scale: axis.scale_of(form)?, ..axis }.form(form),
    };
    Ok(axis.written(Values::List(values)))
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
        None if words.is_empty() => refuse(key, format!("found {word:?}"), "a number", HELP_FOR_NUMBER),
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

    /// One value: a number in its range, or the index of a word.
    fn value(self, key: &str, value: &AxisValue) -> Result<f64, SpecError> {
        match value {
            AxisValue::Word(found) => word(key, self.quantity, found),
            AxisValue::Number(number) if !self.quantity.words().is_empty() => {
                refuse(key, format!("found {number:?}"), self.quantity.words().join(", "), "write the word in quotes")
            }
            AxisValue::Number(number) => self.legal(key, *number),
        }
    }

    /// A number in its range.
    fn legal(self, key: &str, value: f64) -> Result<f64, SpecError> {
        let legal = legal(self.units, self.quantity, self.scale, value).map(|()| value);
        legal.map_err(|legal| {
            SpecError::new(key, format!("{value:?} is out of range"), legal, help(self.units, self.quantity, value))
        })
    }

    /// The unit of the values of a table.
    fn scale_of(self, form: &AxisForm) -> Result<Scale, SpecError> {
        let Some(unit) = &form.unit else { return Ok(Scale::Model) };
        let known = self.quantity.scales();
        let name = |scale: Scale| unit_name(self.units, self.quantity, scale);
        known.iter().copied().find(|scale| name(*scale) == unit).ok_or_else(|| {
            let names: Vec<&str> = known.iter().map(|scale| name(*scale)).collect();
            unknown(format!("{}.unit", self.key), "unit", unit, &names)
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
        let expected = format!("one of {}", forms.map(|(name, _)| name).join(", "));
        let [_] = written.as_slice() else {
            let found = if written.is_empty() { "a table without a range".to_owned() } else { written.join(" and ") };
            return refuse(key, found, expected, "write { linspace = [first, last, count] }, a number or a list");
        };
        if form.seed.is_some() && form.sobol.is_none() && form.lhs.is_none() {
            return refuse(
                format!("{key}.seed"),
                "a seed without a sample",
                "sobol or lhs in the same axis",
                "remove it",
            );
        }
        match form {
            AxisForm { geomspace: Some(numbers), .. } => self.range("geomspace", numbers),
            AxisForm { expr: Some(text), .. } => Ok(Written::Computed { scale: self.scale, text: text.clone() }),
            AxisForm { sobol: Some(numbers), .. } => self.sample(form.seed, Design::Sobol, numbers),
            AxisForm { lhs: Some(numbers), .. } => self.sample(form.seed, Design::LatinHypercube, numbers),
            AxisForm { linspace, .. } => self.range("linspace", linspace.as_deref().unwrap_or_default()),
        }
    }

    /// The two ends of a range or sample at `key`, which are legal values, and its count, from `least` to `most`.
    fn ends(self, key: &str, numbers: &[f64], least: u64, most: u64) -> Result<(f64, f64, u64), SpecError> {
        let &[first, last, count] = numbers else {
            let found = format!("{} values", numbers.len());
            return refuse(key, found, "[first, last, count]", "give exactly three values");
        };
        for (index, end) in [first, last].into_iter().enumerate() {
            let key = format!("{key}[{index}]");
            if end.is_infinite() {
                return refuse(key, format!("{end:?} is out of range"), "finite ends", "choose values in the range");
            }
            self.legal(&key, end)?;
        }
        if !(least as f64..=most as f64).contains(&count) || count.fract() != 0.0 {
            let (found, expected) =
                (format!("{count} is not a count of values"), format!("a whole number from {least} to {most}"));
            let help = match count {
                1.0 => "for one value write the number itself",
                _ if count.fract() != 0.0 => "the third number is the count of values, not their distance",
                _ => "choose a count in this range",
            };
            return refuse(format!("{key}[2]"), found, expected, help);
        }
        Ok((first, last, count as u64))
    }

    fn range(self, form: &str, numbers: &[f64]) -> Result<Written, SpecError> {
        let key = &format!("{}.{form}", self.key);
        let (first, last, count) = self.ends(key, numbers, 2, MAX_COUNT)?;
        let geometric = form == "geomspace";
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
            return refuse(
                format!("{key}[2]"),
                found,
                "values that differ from each other",
                "take fewer values, or a list",
            );
        }
        // From the isolated legal value to the interval.
        for value in [1, count - 2].map(|index| values.at(index)) {
            self.legal(key, value)?;
        }
        Ok(self.written(values))
    }

    fn sample(self, seed: Option<i64>, design: Design, numbers: &[f64]) -> Result<Written, SpecError> {
        let key = &format!("{}.{}", self.key, design.name());
        let (least, greatest, count) = self.ends(key, numbers, 1, design.most())?;
        if least >= greatest {
            let found = format!("from {least:?} to {greatest:?}");
            return refuse(key.as_str(), found, "the least value first, below the greatest", "correct the values");
        }
        let seed = seed.map(u32::try_from).transpose().or_else(|_| {
            let key = format!("{}.seed", self.key);
            refuse(key, "the seed is out of range", "a whole number from 0 to 2^32 - 1", "choose another seed")
        })?;
        Ok(Written::Sampled(Sampled { scale: self.scale, design, least, greatest, count, seed }))
    }
}

/// The word of a spec for the unit of values in `scale`; relative to the duration it is the same in any units.
pub fn unit_name(units: &Units, quantity: Quantity, scale: Scale) -> &'static str {
    let unit = quantity.unit(scale);
    if scale == Scale::Duration { unit } else { units.name(unit) }
}
