//! One axis of a spec: numbers, words, a range, an expression or a sample, each checked against what is legal.

use super::error::{SpecError, unknown};
use super::spec::{AxisForm, AxisSpec, AxisValue};
use super::units::{help, legal};
use crate::grid::{Axis, Design, Quantity, Scale, Values};
use crate::model::Units;

/// A quantity, and the units of its values.
type What<'a> = (Quantity, &'a Units, Scale);

/// What an axis of a spec says.
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
    /// Values drawn jointly with those of other axes.
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
    /// The seed, if the axis tells it.
    pub seed: Option<u32>,
}

/// What an axis of numbers may be.
const AXIS: &str = "a number, a list of numbers or a range such as { linspace = [first, last, count] }";

/// Reads the axis of `quantity` at `key`.
pub fn read(quantity: Quantity, units: &Units, key: &str, spec: &AxisSpec) -> Result<Written, SpecError> {
    let words = quantity.words();
    let (scale, values) = match spec {
        AxisSpec::One(AxisValue::Word(word)) if words.is_empty() => {
            return Err(SpecError::new(key, format!("found string {word:?}"), AXIS, "change the value"));
        }
        AxisSpec::One(one) => (Scale::Model, Values::List(vec![value(quantity, units, &words, key, one)?])),
        AxisSpec::List(values) => {
            if values.is_empty() {
                return Err(SpecError::new(
                    key,
                    "an empty list",
                    "at least one value",
                    "add values, or remove the axis",
                ));
            }
            let values = values.iter().enumerate();
            let values = values.map(|(index, one)| value(quantity, units, &words, &format!("{key}[{index}]"), one));
            (Scale::Model, Values::List(values.collect::<Result<_, _>>()?))
        }
        AxisSpec::Form(_) if !words.is_empty() => {
            let expected = format!("one or a list of {}", quoted(&words));
            return Err(SpecError::new(key, "a range", expected, "write the words as a list"));
        }
        AxisSpec::Form(form) => return read_form(quantity, units, key, form),
    };
    Ok(Written::Values(Axis { quantity, scale, values }))
}

fn quoted(words: &[&str]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

/// One value: a number in its range, or the place of a word among `words`.
fn value(quantity: Quantity, units: &Units, words: &[&str], key: &str, value: &AxisValue) -> Result<f64, SpecError> {
    match value {
        AxisValue::Word(word) if !words.is_empty() => match words.iter().position(|known| known == word) {
            Some(place) => Ok(place as f64),
            None => Err(unknown(key.to_owned(), quantity.name(), word, words)),
        },
        AxisValue::Word(word) => {
            Err(SpecError::new(key, format!("found string {word:?}"), "a number", "change the value"))
        }
        AxisValue::Number(number) if !words.is_empty() => Err(SpecError::new(
            key,
            format!("found {number:?}"),
            format!("one of {}", quoted(words)),
            "write the word in quotes",
        )),
        AxisValue::Number(number) => match legal(units, quantity, Scale::Model, *number) {
            Ok(()) => Ok(*number),
            Err(range) => {
                let help = help(units, quantity, *number);
                Err(SpecError::new(key, format!("{number:?} is out of range"), range, help))
            }
        },
    }
}

fn scale(quantity: Quantity, units: &Units, key: &str, form: &AxisForm) -> Result<Scale, SpecError> {
    let Some(unit) = &form.unit else { return Ok(Scale::Model) };
    let known: &[Scale] = if quantity.has_scale() { &[Scale::Duration, Scale::Model] } else { &[Scale::Model] };
    known.iter().copied().find(|scale| written(quantity, units, *scale) == unit).ok_or_else(|| {
        let units: Vec<String> =
            known.iter().map(|scale| format!("\"{}\"", written(quantity, units, *scale))).collect();
        SpecError::new(
            format!("{key}.unit"),
            format!("unknown unit {unit:?}"),
            units.join(" or "),
            "correct the unit, or remove it",
        )
    })
}

/// What a spec calls the unit of values in `scale`.
fn written(quantity: Quantity, units: &Units, scale: Scale) -> &'static str {
    match scale {
        Scale::Model => units.name(quantity.unit(scale)),
        Scale::Duration => quantity.unit(scale),
    }
}

/// Reads an axis written as a table.
fn read_form(quantity: Quantity, units: &Units, key: &str, form: &AxisForm) -> Result<Written, SpecError> {
    let scale = scale(quantity, units, key, form)?;
    let forms = [
        ("linspace", form.linspace.is_some()),
        ("geomspace", form.geomspace.is_some()),
        ("expr", form.expr.is_some()),
        ("sobol", form.sobol.is_some()),
        ("lhs", form.lhs.is_some()),
    ];
    let written: Vec<&str> = forms.into_iter().filter(|(_, is_there)| *is_there).map(|(name, _)| name).collect();
    if let [one, other, ..] = written.as_slice() {
        return Err(SpecError::new(key, format!("both {one} and {other}"), "one of them", "remove one of the two"));
    }
    if form.seed.is_some() && form.sobol.is_none() && form.lhs.is_none() {
        let key = format!("{key}.seed");
        return Err(SpecError::new(key, "a seed of nothing", "sobol or lhs beside it", "remove it"));
    }
    let sampled = |design, numbers: &[f64]| sample((quantity, units, scale), key, form.seed, design, numbers);
    Ok(match form {
        AxisForm { linspace: Some(numbers), .. } => Written::Values(Axis {
            quantity,
            scale,
            values: range((quantity, units, scale), &format!("{key}.linspace"), false, numbers)?,
        }),
        AxisForm { geomspace: Some(numbers), .. } => Written::Values(Axis {
            quantity,
            scale,
            values: range((quantity, units, scale), &format!("{key}.geomspace"), true, numbers)?,
        }),
        AxisForm { expr: Some(text), .. } => Written::Computed { scale, text: text.clone() },
        AxisForm { sobol: Some(numbers), .. } => Written::Sampled(sampled(Design::Sobol, numbers)?),
        AxisForm { lhs: Some(numbers), .. } => Written::Sampled(sampled(Design::LatinHypercube, numbers)?),
        _ => {
            return Err(SpecError::new(
                key,
                "a table without a range",
                "{ linspace = [first, last, count] } or { geomspace = [first, last, count] }",
                "add a range, or write a number or a list",
            ));
        }
    })
}

/// The three numbers of a range or sample, the first two of which are legal.
fn ends((quantity, units, scale): What<'_>, key: &str, names: &str, numbers: &[f64]) -> Result<[f64; 3], SpecError> {
    let &[first, last, count] = numbers else {
        let found = format!("{} values", numbers.len());
        return Err(SpecError::new(key, found, names, "give exactly three values"));
    };
    for (index, end) in [first, last].into_iter().enumerate() {
        let legal = if end.is_finite() { legal(units, quantity, scale, end) } else { Err("finite ends".to_owned()) };
        if let Err(legal) = legal {
            return Err(SpecError::new(
                format!("{key}[{index}]"),
                format!("{end:?} is out of range"),
                legal,
                help(units, quantity, end),
            ));
        }
    }
    Ok([first, last, count])
}

fn range(what: What<'_>, key: &str, geometric: bool, numbers: &[f64]) -> Result<Values, SpecError> {
    let [first, last, count] = ends(what, key, "[first, last, count]", numbers)?;
    // From 2^53 on a double may stand for another whole number than the one that was written.
    if !(2.0..9_007_199_254_740_992.0).contains(&count) || count.fract() != 0.0 {
        return Err(SpecError::new(
            format!("{key}[2]"),
            format!("{count} is not a count of values"),
            "a whole number from 2 to 2^53 - 1",
            match count {
                1.0 => "for one value write the number itself",
                _ if count.fract() != 0.0 => "the third number is how many values there are, not their distance",
                _ => "choose a count in the range",
            },
        ));
    }
    if first == last {
        return Err(SpecError::new(
            key,
            "first and last are the same",
            "a range",
            "for one value write the number itself",
        ));
    }
    let count = count as u64;
    if geometric && (first == 0.0 || last == 0.0 || (first < 0.0) != (last < 0.0)) {
        return Err(SpecError::new(
            key,
            format!("from {first:?} to {last:?} passes through zero"),
            "ends of the same sign, neither 0",
            "use linspace, or a range on one side of zero",
        ));
    }
    let values = match geometric {
        true => Values::Geomspace { first, last, count },
        false => Values::Linspace { first, last, count },
    };
    // Doubles lie farthest apart at the larger end.
    let largest = first.abs().max(last.abs());
    let steps = (count - 1) as f64;
    let (spacing, least) = if geometric {
        (largest * libm::log(last / first).abs() / steps, 4.0)
    } else {
        ((last - first).abs() / steps, 1.0)
    };
    if spacing < least * (largest.next_up() - largest) {
        return Err(SpecError::new(
            format!("{key}[2]"),
            format!("{count} values from {first:?} to {last:?}, closer to each other than numbers are"),
            "values that differ from each other",
            "take fewer values, or a list",
        ));
    }
    // From a value that is legal on its own to the others.
    let inside = [1, count - 2].map(|index| values.at(index));
    if let Some((value, Err(legal))) =
        inside.into_iter().map(|value| (value, legal(what.1, what.0, what.2, value))).find(|(_, legal)| legal.is_err())
    {
        let found = format!("a value of the range, {value:?}, is out of range");
        return Err(SpecError::new(key, found, legal, "begin with the least number but 0, or take fewer values"));
    }
    Ok(values)
}

fn sample(what: What<'_>, key: &str, seed: Option<i64>, design: Design, numbers: &[f64]) -> Result<Sampled, SpecError> {
    let place = format!("{key}.{}", design.name());
    let [least, greatest, count] = ends(what, &place, "[least, greatest, count]", numbers)?;
    let most = design.most();
    if !(1.0..=most as f64).contains(&count) || count.fract() != 0.0 {
        return Err(SpecError::new(
            format!("{place}[2]"),
            format!("{count} is not a count of points"),
            format!("a whole number from 1 to {most}"),
            "choose a count in the range",
        ));
    }
    if least >= greatest {
        let found = format!("from {least:?} to {greatest:?}");
        return Err(SpecError::new(place, found, "the least value first, below the greatest", "correct the values"));
    }
    let seed = seed.map(|seed| {
        u32::try_from(seed).map_err(|_| {
            let found = format!("{seed} is out of range");
            SpecError::new(format!("{key}.seed"), found, "a whole number from 0 to 2^32 - 1", "choose another seed")
        })
    });
    let (.., scale) = what;
    Ok(Sampled { scale, design, least, greatest, count: count as u64, seed: seed.transpose()? })
}
