//! One block of a spec as a checked block of the grid: points, axes, zips, samples, computed axes and the condition.

use std::path::Path;

use super::axis::{Sampled, Written, read};
use super::error::{SpecError, unknown};
use super::points;
use super::spec::BlockSpec;
use super::units::legal;
use crate::grid::{Axis, Block, Derived, Design, Expression, Factor, Fault, Quantity, Scale, Values, first_wrong};
use crate::model::Units;

/// Checks `spec`, whose keys begin with `prefix`; files are relative to `folder`.
pub fn block(spec: &BlockSpec, prefix: &str, units: &Units, folder: &Path) -> Result<Block, SpecError> {
    let mut factors = Vec::new();
    if let Some(path) = &spec.points {
        let points = points::read(&folder.join(path), units);
        factors.push(points.map_err(|error| SpecError { key: format!("{prefix}{}", error.key).into(), ..error })?);
    }
    let mut written = Vec::new();
    for (name, axis) in &spec.axes {
        let key = format!("{prefix}axes.{name}");
        let Some(quantity) = Quantity::from_name(name) else {
            return Err(unknown(key, "axis", name, &Quantity::ALL.map(Quantity::name)));
        };
        let axis = read(quantity, units, &key, axis)?;
        if factors.iter().any(|factor: &Factor| factor.holds_any(&[quantity])) {
            return Err(SpecError::new(
                key,
                format!("`{name}` is also a column of `points`"),
                "each axis once",
                "remove the axis here or the column there",
            ));
        }
        written.push((quantity, axis));
    }
    let zips = zips(spec, prefix, &factors, &written)?;
    let samples = samples(prefix, units, &written)?;
    let mut computed = Vec::new();
    let mut placed: Vec<Quantity> = Vec::new();
    for (quantity, axis) in &written {
        if placed.contains(quantity) {
            continue;
        }
        let factor = match axis {
            Written::Computed { scale, text } => {
                computed.push((*quantity, *scale, text.as_str()));
                continue;
            }
            Written::Values(axis) => match zips.iter().find(|axes| axes[0].quantity == *quantity) {
                Some(axes) => axes.clone(),
                None => vec![axis.clone()],
            },
            Written::Sampled(sampled) => samples
                .iter()
                .find(|(design, _)| *design == sampled.design)
                .map_or_else(Vec::new, |(_, axes)| axes.clone()),
        };
        placed.extend(factor.iter().map(|axis| axis.quantity));
        factors.push(Factor { axes: factor });
    }
    for quantity in Quantity::ALL {
        let held = factors.iter().any(|factor| factor.holds_any(&[quantity]))
            || computed.iter().any(|(other, ..)| *other == quantity);
        let values = quantity.default();
        if !held && !values.is_empty() {
            factors.push(Factor { axes: vec![Axis { quantity, scale: Scale::Model, values: Values::List(values) }] });
        }
    }
    let held = factors.iter().flat_map(|factor| &factor.axes).map(|axis| axis.quantity);
    let held: Vec<Quantity> = held.chain(computed.iter().map(|(quantity, ..)| *quantity)).collect();
    let derived = derived(prefix, &computed, &held)?;
    let condition = spec.condition.as_ref().map(|text| {
        Expression::condition(text, &held).map_err(|fault| explain(format!("{prefix}where"), "axis", fault))
    });
    let block = Block { factors, derived, condition: condition.transpose()? };
    for (quantity, _, text) in computed {
        check_values(&block, prefix, units, quantity, text)?;
    }
    Ok(block)
}

/// The axes of each zip, all of equal length, in the order of the axes.
fn zips(
    spec: &BlockSpec,
    prefix: &str,
    factors: &[Factor],
    written: &[(Quantity, Written)],
) -> Result<Vec<Vec<Axis>>, SpecError> {
    let mut zips: Vec<Vec<Axis>> = Vec::new();
    for (number, names) in spec.zip.iter().enumerate() {
        let key = format!("{prefix}zip[{number}]");
        if names.len() < 2 {
            let found = format!("a zip of {}", if names.is_empty() { "no axis" } else { "one axis" });
            return Err(SpecError::new(key, found, "two axes or more", "add axes, or remove the zip"));
        }
        let mut zip: Vec<Axis> = Vec::new();
        for (place, name) in names.iter().enumerate() {
            let key = format!("{key}[{place}]");
            let axis = written.iter().find(|(quantity, _)| quantity.name() == name).map(|(_, axis)| axis);
            let axis = match axis {
                Some(Written::Values(axis)) => axis,
                Some(Written::Computed { .. }) => {
                    let found = format!("`{name}` is computed from other axes at every point");
                    return Err(SpecError::new(key, found, "axes with values of their own", "remove it here"));
                }
                Some(Written::Sampled(sampled)) => {
                    let found = format!("`{name}` varies together with all axes of `{}`", sampled.design.name());
                    return Err(SpecError::new(key, found, "axes with values of their own", "remove it here"));
                }
                None if factors.iter().flat_map(|factor| &factor.axes).any(|axis| axis.quantity.name() == name) => {
                    let found = format!("`{name}` is a column of `points`, which vary together anyway");
                    return Err(SpecError::new(key, found, "names of [axes]", "remove it here"));
                }
                None => {
                    let known: Vec<&str> = written.iter().map(|(quantity, _)| quantity.name()).collect();
                    return Err(unknown(key, "axis", name, &known));
                }
            };
            if zips.iter().chain([&zip]).flatten().any(|other| other.quantity == axis.quantity) {
                let found = format!("`{name}` is there twice");
                return Err(SpecError::new(key, found, "each axis in one zip", "remove one of the two"));
            }
            if let Some(first) = zip.first()
                && first.values.len() != axis.values.len()
            {
                let found = format!(
                    "`{}` has {}, `{name}` has {}",
                    first.quantity.name(),
                    values(first.values.len()),
                    values(axis.values.len())
                );
                let help = "give both the same number; nothing is repeated or left out";
                return Err(SpecError::new(key, found, "axes of equal length", help));
            }
            zip.push(axis.clone());
        }
        let place = |axis: &Axis| written.iter().position(|(quantity, _)| *quantity == axis.quantity);
        zip.sort_by_key(place);
        zips.push(zip);
    }
    Ok(zips)
}

fn values(count: u64) -> String {
    if count == 1 { "1 value".to_owned() } else { format!("{count} values") }
}

/// The joint samples, one a kind.
fn samples(
    prefix: &str,
    units: &Units,
    written: &[(Quantity, Written)],
) -> Result<Vec<(Design, Vec<Axis>)>, SpecError> {
    let mut samples = Vec::new();
    for design in [Design::Sobol, Design::LatinHypercube] {
        let axes: Vec<(Quantity, Sampled)> = written
            .iter()
            .filter_map(|(quantity, axis)| match axis {
                Written::Sampled(sampled) if sampled.design == design => Some((*quantity, *sampled)),
                _ => None,
            })
            .collect();
        let Some((first, sample)) = axes.first() else { continue };
        let seeded = axes.iter().find_map(|(quantity, axis)| Some((quantity, axis.seed?)));
        for (quantity, axis) in &axes {
            let key = format!("{prefix}axes.{}", quantity.name());
            if axis.count != sample.count {
                let found = format!("{} points, but `{}` has {}", axis.count, first.name(), sample.count);
                let expected = format!("the same count for all axes of `{}`, which are sampled jointly", design.name());
                return Err(SpecError::new(format!("{key}.{}[2]", design.name()), found, expected, "make them equal"));
            }
            if let (Some(seed), Some((other, first_seed))) = (axis.seed, seeded)
                && seed != first_seed
            {
                let found = format!("seed {seed}, but `{}` has {first_seed}", other.name());
                let expected = format!("one seed for all axes of `{}`, which are sampled jointly", design.name());
                return Err(SpecError::new(format!("{key}.seed"), found, expected, "remove one of the two"));
            }
        }
        let seed = seeded.map_or(0, |(_, seed)| seed);
        let draw = |(number, (quantity, axis)): (usize, &(Quantity, Sampled))| {
            let (least, greatest) = (axis.least, axis.greatest);
            let inside = design.values(number as u32, axis.count, seed);
            // Either end counts with a weight, so that no difference overflows; rounding must not leave the box.
            let values: Vec<f64> =
                inside.into_iter().map(|u| (least * (1.0 - u) + greatest * u).clamp(least, greatest)).collect();
            // Both ends are legal; between 0, where that lies apart, and the others are numbers that are not.
            if let Some((value, Err(legal))) = values
                .iter()
                .map(|&value| (value, legal(units, *quantity, axis.scale, value)))
                .find(|(_, legal)| legal.is_err())
            {
                let key = format!("{prefix}axes.{}.{}", quantity.name(), design.name());
                let found = format!("a value of the sample, {value:?}, is out of range");
                return Err(SpecError::new(key, found, legal, "begin with the least number but 0"));
            }
            Ok(Axis { quantity: *quantity, scale: axis.scale, values: Values::List(values) })
        };
        samples.push((design, axes.iter().enumerate().map(draw).collect::<Result<_, _>>()?));
    }
    Ok(samples)
}

/// Computed axes, each after those that it is made of.
fn derived(prefix: &str, computed: &[(Quantity, Scale, &str)], held: &[Quantity]) -> Result<Vec<Derived>, SpecError> {
    let key = |quantity: Quantity| format!("{prefix}axes.{}.expr", quantity.name());
    let mut waiting = Vec::new();
    for &(quantity, scale, text) in computed {
        let expression = Expression::number(text, held).map_err(|fault| explain(key(quantity), "axis", fault))?;
        waiting.push(Derived { quantity, scale, expression });
    }
    let mut derived = Vec::new();
    while !waiting.is_empty() {
        let is_waiting = |quantity: &Quantity| waiting.iter().any(|other: &Derived| other.quantity == *quantity);
        let next = |one: &Derived| one.expression.reads().into_iter().find(|read| is_waiting(read));
        if let Some(ready) = waiting.iter().position(|one| next(one).is_none()) {
            derived.push(waiting.remove(ready));
            continue;
        }
        // From axis to axis until one is met again.
        let mut path: Vec<Quantity> = vec![waiting[0].quantity];
        while let Some(read) = waiting.iter().find(|one| path.last() == Some(&one.quantity)).and_then(next) {
            if let Some(start) = path.iter().position(|met| *met == read) {
                path.push(read);
                path.drain(..start);
                break;
            }
            path.push(read);
        }
        let names: Vec<String> = path.iter().map(|quantity| format!("`{}`", quantity.name())).collect();
        return Err(SpecError::new(
            key(path[0]),
            format!("depends on itself: {}", names.join(", which is computed from ").replacen(", which", "", 1)),
            "axes that are computed from others",
            "give one of them values of its own",
        ));
    }
    Ok(derived)
}

/// Every kept value of a computed axis has to be legal.
fn check_values(block: &Block, prefix: &str, units: &Units, quantity: Quantity, text: &str) -> Result<(), SpecError> {
    let key = format!("{prefix}axes.{}.expr", quantity.name());
    let scale = block.scale(quantity).unwrap_or(Scale::Model);
    match first_wrong(block, quantity, |value| legal(units, quantity, scale, value).is_err()) {
        Some(None) => Ok(()),
        Some(Some((value, place))) => {
            let place: Vec<String> = place.iter().map(|(axis, value)| format!("{} = {value:?}", axis.name())).collect();
            let place = if place.is_empty() { String::new() } else { format!(" at {}", place.join(", ")) };
            Err(SpecError::new(
                key,
                format!("`{text}` is {value:?}{place}"),
                legal(units, quantity, scale, value).err().unwrap_or_default(),
                "correct the expression, or leave such points out with `where`",
            ))
        }
        None => Err(too_many(key)),
    }
}

/// An expression or condition that would take too long to evaluate.
pub fn too_many(key: String) -> SpecError {
    SpecError::new(
        key,
        "more than 2^36 combinations of the axes that it reads",
        "at most 2^36, which take minutes",
        "take fewer values on these axes, or share them out over several [[block]]s",
    )
}

/// A fault of an expression at `key`.
fn explain(key: String, what: &str, fault: Fault) -> SpecError {
    let place = fault.position.map_or_else(String::new, |position| format!("position {position}: "));
    let found = format!("{place}{}", fault.found);
    match fault.unknown.map(|unknown| *unknown) {
        Some((name, known)) => SpecError { found: found.into(), ..unknown(key, what, &name, &known) },
        None => SpecError::new(key, found, fault.expected, fault.help),
    }
}
