//! `[model] units`: scaled or SI units, and the legal values in these units.

use super::error::{SpecError, refuse};
use super::spec::{ModelSpec, Spec};
use crate::grid::{Axis, Quantity, Scale, Values};
use crate::model::{Scales, Units};
use crate::names::number;

/// The keys of `[model]` that determine the units.
pub const UNIT_KEYS: [&str; 5] = ["units", "mu_0", "l", "v_0", "normal_stress"];

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
    match model.units.to_ascii_lowercase().as_str() {
        "dimensionless" => match scales.into_iter().find(|(_, value, _)| value.is_some()) {
            None => Ok(Units::Scaled),
            Some((name, ..)) => {
                let (key, help) = (format!("model.{name}"), "add `units = \"si\"` and give SI values, or remove it");
                refuse(
                    key,
                    "a scale without `units = \"si\"`",
                    "units = \"si\", which needs mu_0, l, v_0 and normal_stress",
                    help,
                )
            }
        },
        "si" => {
            let missing = scales.iter().filter(|(_, value, _)| value.is_none()).map(|(name, ..)| *name);
            let missing: Vec<&str> = missing.collect();
            if !missing.is_empty() {
                let expected = "mu_0, l in m, v_0 in m/s and normal_stress in Pa";
                let found = format!("\"si\" without `{}`", missing.join("`, `"));
                let help = format!("add `{} = ...` to [model]", missing.join(" = ...`, `"));
                return refuse("model.units", found, expected, help);
            }
            let mut values = [0.0; 4];
            for (place, (name, value, unit)) in scales.into_iter().enumerate() {
                let value = value.unwrap_or_default();
                if !(value > 0.0 && value.is_finite()) {
                    let unit = if unit == "1" { String::new() } else { format!(", in {unit}") };
                    let (key, expected) = (format!("model.{name}"), format!("{name} > 0, finite{unit}"));
                    return refuse(key, format!("{value:?} is out of range"), expected, "give a positive value");
                }
                values[place] = value;
            }
            let [mu_0, l, v_0, normal_stress] = values;
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
        return domain.text.to_owned();
    }
    let short = |value: f64| {
        let value: f64 = format!("{value:.8e}").parse().unwrap_or(value);
        if (1e-3..1e6).contains(&value) || value == 0.0 { format!("{value}") } else { format!("{value:e}") }
    };
    let name = if name == "1" { String::new() } else { format!(" {name}") };
    let below = if domain.least_excluded { "<" } else { "<=" };
    let apart = domain.apart.map_or(String::new(), |apart| format!(", or {apart}"));
    let interval = format!(
        "{} {below} {} <= {}{name}{apart}",
        short(domain.least * size),
        quantity.name(),
        short(domain.greatest * size)
    );
    format!("{interval} ({unit} = {}{name})", short(size))
}

/// The help for velocities that look scaled in a spec with SI units.
const PROBABLY_SCALED: &str =
    "if these are in units of v_0, multiply them by v_0, or remove `units` and the scales from [model]";

/// The help for an illegal value of `quantity`. Velocities out of range often have the wrong unit.
pub fn help(units: &Units, quantity: Quantity, value: f64) -> &'static str {
    let is_velocity = matches!(quantity, Quantity::InitialVelocity | Quantity::FinalVelocity);
    let scaled = units.scaled("v_0", value);
    match units {
        _ if !is_velocity || value <= 0.0 || !value.is_finite() => "choose values in the range",
        Units::Scaled if scaled == 1.0 => "1 is v_0, the velocity floor; choose a velocity above it, such as 1.001",
        Units::Scaled if scaled > 1.0 => "choose values in the range",
        Units::Si(_) if scaled > 1.0 => PROBABLY_SCALED,
        Units::Scaled => "velocities are in units of v_0; for m/s, add `units = \"si\"` and the scales to [model]",
        Units::Si(_) => "with `units = \"si\"`, velocities are in m/s; choose one above v_0, or lower v_0",
    }
}

/// Velocity in m/s above which SI values are probably scaled values. Chosen: brakes slide at up to 50 m/s, faults at some 10 m/s.
const MAX_PLAUSIBLE_VELOCITY: f64 = 50.0;

/// Normal stress in Pa below which the value is probably in MPa. Chosen: a book on a table presses with some 100 Pa, rock experiments with 1e5 to 1e9 Pa.
const MIN_PLAUSIBLE_STRESS: f64 = 100.0;

/// The warnings on scales of `model` that are probably in other units. Limits chosen: faults slip over centimetres to reach steady friction, and
/// friction coefficients are about 1.
pub fn doubtful_scales(model: &ModelSpec) -> Vec<SpecError> {
    let scales = [("l", model.l, 1.0, " m"), ("mu_0", model.mu_0, 10.0, "")];
    let large = scales.into_iter().filter_map(|(name, given, most, unit)| {
        let value = given.filter(|value| *value > most)?;
        let (found, expected) = (format!("{value}{unit} is unusually large"), format!("usually below {most}{unit}"));
        Some(SpecError::new(format!("model.{name}"), found, expected, "check the unit"))
    });
    let small = model.normal_stress.filter(|value| *value < MIN_PLAUSIBLE_STRESS).map(|value| {
        let expected = format!("usually above {MIN_PLAUSIBLE_STRESS} Pa");
        SpecError::new(
            "model.normal_stress",
            format!("{value} Pa is unusually small"),
            expected,
            "check the unit: 1 MPa is 1e6",
        )
    });
    large.chain(small).collect()
}

fn is_velocity(quantity: Quantity) -> bool {
    matches!(quantity, Quantity::InitialVelocity | Quantity::FinalVelocity | Quantity::VelocityCeiling)
}

/// The warnings on `axes`, whose keys begin with `prefix`: values that are probably in other units, or outside the physical domain.
pub fn doubtful_axes<'a>(prefix: &str, units: &Units, axes: impl Iterator<Item = &'a Axis>) -> Vec<SpecError> {
    let axes: Vec<&Axis> = axes.collect();
    let each = axes.iter().filter_map(|axis| doubt(prefix, units, axis).or_else(|| unphysical(prefix, units, axis)));
    each.chain(unphysical_slip(prefix, units, &axes)).collect()
}

/// The warning that an axis is probably not in SI units, if so.
fn doubt(prefix: &str, units: &Units, axis: &Axis) -> Option<SpecError> {
    if *units == Units::Scaled || !is_velocity(axis.quantity) {
        return None;
    }
    let [_, greatest] = ends(axis);
    (greatest > MAX_PLAUSIBLE_VELOCITY).then(|| {
        let (key, expected) =
            (format!("{prefix}axes.{}", axis.quantity.name()), "velocities in m/s, because of `units = \"si\"`");
        SpecError::new(key, format!("{greatest:?} m/s is unusually fast"), expected, PROBABLY_SCALED)
    })
}

/// The help for values outside the physical domain.
const UNPHYSICAL: &str = "check the unit; outside the physical domain rows may have no numbers";

/// The warning that an axis leaves the physical domain, if so.
fn unphysical(prefix: &str, units: &Units, axis: &Axis) -> Option<SpecError> {
    let (quantity, unit) = (axis.quantity, axis.quantity.unit(Scale::Model));
    let [least, most] = quantity.physical()?;
    // With room for the conversion of units.
    let is_inside = |value: f64| value * (1.0 + 1e-9) >= least && value * (1.0 - 1e-9) <= most;
    let outside = ends(axis).into_iter().find(|end| end.is_finite() && !is_inside(units.scaled(unit, *end)))?;
    let name = if *units == Units::Scaled { "" } else { units.name(unit) };
    let name = if name == "1" { "" } else { name };
    let [least, most] = [least, most].map(|end| number(end * units.size(unit)));
    let (found, expected) = (format!("{outside:?} {name}"), format!("{least} to {most} {name}"));
    let found = format!("{} is outside the physical domain", found.trim_end());
    Some(SpecError::new(format!("{prefix}axes.{}", quantity.name()), found, expected.trim_end(), UNPHYSICAL))
}

/// Slips `t_f max(v_i, v_f)` of the physical domain, in slip distances.
const PHYSICAL_SLIPS: [f64; 2] = [1e-3, 1e7];

/// The warning that the slip is outside the physical domain at all points, if so.
fn unphysical_slip(prefix: &str, units: &Units, axes: &[&Axis]) -> Option<SpecError> {
    let ends_of = |quantity: Quantity| {
        let axis = axes.iter().find(|axis| axis.quantity == quantity)?;
        Some(ends(axis).map(|end| units.scaled(quantity.unit(Scale::Model), end)))
    };
    let (t_f, v_i, v_f) =
        (ends_of(Quantity::Time)?, ends_of(Quantity::InitialVelocity)?, ends_of(Quantity::FinalVelocity)?);
    let [least, greatest] = [0, 1].map(|end| t_f[end] * v_i[end].max(v_f[end]));
    let [short, long] = PHYSICAL_SLIPS;
    let slip = if greatest < short {
        greatest
    } else if least > long {
        least
    } else {
        return None;
    };
    let found = format!("a slip of t_f max(v_i, v_f) = {} slip distances is outside the physical domain", number(slip));
    Some(SpecError::new(format!("{prefix}axes.t_f"), found, format!("{short:e} to {long:e}"), UNPHYSICAL))
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
