//! `[model] units`: scaled or SI units, and the legal values in these units.

use super::error::{SpecError, refuse};
use super::spec::{ModelSpec, Spec};
use crate::grid::{Axis, Quantity, Scale, Values};
use crate::model::{Scales, Units};
use crate::names::number;

/// The units of `model`.
///
/// # Errors
///
/// An unknown unit system, or a scale that is missing, illegal or unphysical.
pub fn units(model: &ModelSpec) -> Result<Units, SpecError> {
    let scales = [
        ("mu_0", model.mu_0, "1"),
        ("l", model.l, "m"),
        ("v_0", model.v_0, "m/s"),
        ("normal_stress", model.normal_stress, "Pa"),
    ];
    let given = |is_given: bool| -> Vec<&str> {
        scales.iter().filter(|(_, value, _)| value.is_some() == is_given).map(|(name, ..)| *name).collect()
    };
    match model.units.to_ascii_lowercase().as_str() {
        "dimensionless" => match given(true).first() {
            None => Ok(Units::Scaled),
            Some(name) => {
                let (key, help) = (format!("model.{name}"), "add `units = \"si\"` and give SI values, or remove it");
                let expected = "units = \"si\", which needs mu_0, l, v_0 and normal_stress";
                refuse(key, "a scale without `units = \"si\"`", expected, help)
            }
        },
        "si" => {
            let missing = given(false);
            if !missing.is_empty() {
                let expected = "mu_0, l in m, v_0 in m/s and normal_stress in Pa";
                let found = format!("\"si\" without `{}`", missing.join("`, `"));
                let help = format!("add `{} = ...` to [model]", missing.join(" = ...`, `"));
                return refuse("model.units", found, expected, help);
            }
            if let Some((name, value, unit)) =
                scales.iter().find(|(_, value, _)| !value.is_some_and(|value| value > 0.0 && value.is_finite()))
            {
                let found = format!("{:?} is out of range", value.unwrap_or_default());
                let expected = format!("{name} > 0, finite, in {unit}");
                return refuse(format!("model.{name}"), found, expected, "give a positive value");
            }
            let [mu_0, l, v_0, normal_stress] = scales.map(|(_, value, _)| value.unwrap_or_default());
            Ok(Units::Si(Scales { mu_0, l, v_0, normal_stress }))
        }
        _ => {
            let (found, expected) = (format!("unknown unit system {:?}", model.units), "\"dimensionless\" or \"si\"");
            refuse("model.units", found, expected, "write units = \"si\" and give SI values, or remove the line")
        }
    }
}

/// Checks that `value`, in `units`, is legal for `quantity`; the error is the legal range.
///
/// # Errors
///
/// The legal range, in `units`.
pub fn legal(units: &Units, quantity: Quantity, scale: Scale, value: f64) -> Result<(), String> {
    let (domain, unit) = (quantity.domain(), quantity.unit(scale));
    let scaled = units.scaled(unit, value);
    // A number that overflows or underflows in the conversion would change its meaning.
    let survives = value.is_finite() == scaled.is_finite() && (value == 0.0) == (scaled == 0.0);
    if domain.contains(scaled) && survives {
        return Ok(());
    }
    Err(range(units, quantity, unit))
}

/// The legal range of `quantity`, whose scaled unit is `unit`, in `units`, as in `1e-8 < v_f <= 10000 m/s (v_0 = 1e-8 m/s)`.
fn range(units: &Units, quantity: Quantity, unit: &'static str) -> String {
    let (domain, size, name) = (quantity.domain(), units.size(unit), units.name(unit));
    if name == unit {
        return domain.to_string();
    }
    let name = if name == "1" { String::new() } else { format!(" {name}") };
    let words = domain.words(|end| number(end * size), &name);
    format!("{words} ({unit} = {}{name})", number(size))
}

/// The help for velocities that look scaled in a spec with SI units.
const PROBABLY_SCALED: &str =
    "if these are in units of v_0, multiply them by v_0, or remove `units` and the scales from [model]";

/// The help for an illegal value of `quantity`. Velocities out of range often have the wrong unit.
pub fn help(units: &Units, quantity: Quantity, value: f64) -> &'static str {
    let is_velocity = matches!(quantity, Quantity::InitialVelocity | Quantity::FinalVelocity);
    match units {
        Units::Si(_) if is_velocity && units.scaled("v_0", value) > 1.0 => PROBABLY_SCALED,
        Units::Si(_) if is_velocity => {
            "with `units = \"si\"`, velocities are in m/s; choose one above v_0, or lower v_0 and add (a - b) ln(new v_0/old v_0) to mu_0"
        }
        Units::Scaled if is_velocity && value <= 1.0 => {
            "velocities are in units of v_0, above 1; for m/s, add `units = \"si\"` and the scales to [model]"
        }
        _ => "choose values in the range",
    }
}

/// The warnings on scales of `model` that are probably in other units. Limits chosen: faults slip over centimetres to reach steady friction,
/// friction coefficients are about 1, and a book on a table presses with some 100 Pa, rock experiments with 1e5 to 1e9 Pa.
pub fn doubtful_scales(model: &ModelSpec) -> Vec<SpecError> {
    let scales = [
        ("l", model.l, [0.0, 1.0], "m"),
        ("mu_0", model.mu_0, [0.0, 10.0], "1"),
        ("normal_stress", model.normal_stress, [100.0, f64::INFINITY], "Pa"),
    ];
    let doubtful = scales.into_iter().filter_map(|(name, given, [least, most], unit)| {
        let value = given.filter(|value| !(least..=most).contains(value))?;
        let expected = match least {
            _ if most == f64::INFINITY => format!("usually at least {least:?} {unit}"),
            _ => format!("usually at most {most:?}{}", if unit == "1" { String::new() } else { format!(" {unit}") }),
        };
        Some(SpecError::new(format!("model.{name}"), format!("{value:?} is unusual"), expected, "check the unit"))
    });
    doubtful.collect()
}

/// Velocity in m/s above which SI values are probably scaled values. Chosen: brakes slide at up to 50 m/s, faults at some 10 m/s.
const MAX_PLAUSIBLE_VELOCITY: f64 = 50.0;

/// Friction ceiling, relative to `mu_0 sigma`, below which SI values are probably coefficients of friction. Chosen: friction is close to 1 in these units.
const MIN_PLAUSIBLE_CEILING: f64 = 0.01;

/// The warning on `axis` at `key` if values are probably in other units, or outside the physical domain.
pub fn doubtful_axis(key: String, units: &Units, axis: &Axis) -> Option<SpecError> {
    let (quantity, unit) = (axis.quantity, axis.quantity.unit(Scale::Model));
    let is_velocity =
        matches!(quantity, Quantity::InitialVelocity | Quantity::FinalVelocity | Quantity::VelocityCeiling);
    let [least, greatest] = ends(axis);
    if *units != Units::Scaled
        && quantity == Quantity::FrictionCeiling
        && units.scaled(unit, least) < MIN_PLAUSIBLE_CEILING
    {
        let expected = "a stress in Pa, because of `units = \"si\"`";
        let help = "multiply a coefficient of friction by normal_stress";
        return Some(SpecError::new(key, format!("{least:?} Pa is unusually low"), expected, help));
    }
    if *units != Units::Scaled && is_velocity && greatest > MAX_PLAUSIBLE_VELOCITY {
        let expected = "velocities in m/s, because of `units = \"si\"`";
        return Some(SpecError::new(key, format!("{greatest:?} m/s is unusually fast"), expected, PROBABLY_SCALED));
    }
    let [least, most] = quantity.physical()?;
    // With room for the conversion of units.
    let is_inside = |value: f64| value * (1.0 + 1e-9) >= least && value * (1.0 - 1e-9) <= most;
    let outside = ends(axis).into_iter().find(|end| end.is_finite() && !is_inside(units.scaled(unit, *end)))?;
    let [least, most] = [least, most].map(|end| number(end * units.size(unit)));
    let (found, expected) =
        (format!("{outside:?} is outside the physical domain"), format!("{least} to {most}, in {}", units.name(unit)));
    Some(SpecError::new(key, found, expected, "check the unit; outside the physical domain rows may have no numbers"))
}

/// The least and the greatest finite value of an axis; infinite for none.
fn ends(axis: &Axis) -> [f64; 2] {
    let of = |values: &[f64]| {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)]
    };
    match &axis.values {
        Values::List(values) => of(values),
        Values::Linspace { first, last, .. } | Values::Geomspace { first, last, .. } => of(&[*first, *last]),
    }
}

/// The units of a dataset with the spec `text`.
///
/// # Errors
///
/// A text that is not a spec, or illegal scales.
pub fn units_of(text: &str) -> Result<Units, SpecError> {
    units(&Spec::parse(text)?.model)
}
