//! `[model] units`: whether a sweep is given in scaled units or in SI, and which values are legal in them.

use super::error::SpecError;
use super::spec::ModelSpec;
use crate::grid::{Quantity, Scale};
use crate::model::{Scales, Units};

/// The units that `model` asks for.
pub fn units(model: &ModelSpec) -> Result<Units, SpecError> {
    let scales = [
        ("mu_0", model.mu_0, "1"),
        ("l", model.l, "m"),
        ("v_0", model.v_0, "m/s"),
        ("normal_load", model.normal_load, "Pa"),
    ];
    match model.units.as_str() {
        "dimensionless" => match scales.into_iter().find(|(_, value, _)| value.is_some()) {
            None => Ok(Units::Scaled),
            Some((name, ..)) => Err(SpecError::new(
                format!("model.{name}"),
                "a scale of a dimensionless sweep",
                "units = \"si\" beside it",
                "add `units = \"si\"` and give SI values, or remove it",
            )),
        },
        "si" => {
            let mut values = [0.0; 4];
            for (place, (name, value, unit)) in scales.into_iter().enumerate() {
                let Some(value) = value else {
                    return Err(SpecError::new(
                        "model.units",
                        format!("\"si\" without `{name}`"),
                        "mu_0, l in m, v_0 in m/s and normal_load in Pa",
                        format!("add `{name} = ...` to [model]"),
                    ));
                };
                if !(value > 0.0 && value.is_finite()) {
                    let (key, expected) = (format!("model.{name}"), format!("{name} > 0, finite, in {unit}"));
                    return Err(SpecError::new(key, format!("{value:?} is out of range"), expected, "correct it"));
                }
                values[place] = value;
            }
            let [mu_0, l, v_0, normal_load] = values;
            Ok(Units::Si(Scales { mu_0, l, v_0, normal_load }))
        }
        other => Err(SpecError::new(
            "model.units",
            format!("unknown unit system {other:?}"),
            "\"dimensionless\" or \"si\"",
            "correct it",
        )),
    }
}

/// Whether `value`, in `units`, is one that `quantity` can have; if not, what is.
pub fn legal(units: &Units, quantity: Quantity, scale: Scale, value: f64) -> Result<(), String> {
    let (domain, unit) = (quantity.domain(), quantity.unit(scale));
    let scaled = units.scaled(unit, value);
    // A number that leaves the range of doubles on the way would mean something else.
    let survives = value.is_finite() == scaled.is_finite() && (value == 0.0) == (scaled == 0.0);
    if domain.contains(scaled) && survives {
        return Ok(());
    }
    Err(match units {
        Units::Scaled => domain.text.to_owned(),
        Units::Si(_) => format!("{}, in units of {unit} = {:?} {}", domain.text, units.size(unit), units.name(unit)),
    })
}

/// The units of the dataset that was made from the spec `text`.
pub fn units_of(text: &str) -> Result<Units, SpecError> {
    let spec = super::place::parse(text).map_err(|(error, _)| error)?;
    units(&spec.model)
}
