//! One block of a spec as a checked block of the grid: points, axes, zips, samples, computed axes and the condition.

use std::path::Path;

use super::axis::{Sampled, Written, read};
use super::error::{SpecError, all, refuse, unknown};
use super::points;
use super::read::{HELP_FOR_GRID_KEY, is_grid_key};
use super::spec::BlockSpec;
use super::units::legal;
use crate::grid::{Axis, Block, Derived, Design, Expression, Factor, Fault, Quantity, Scale, Values, first_wrong};
use crate::model::Units;
use crate::table;

/// Checks `spec`, whose keys begin with `prefix`; files are relative to `folder`.
///
/// # Errors
///
/// The faults.
pub fn check(spec: &BlockSpec, prefix: &str, units: &Units, folder: &Path) -> Result<Block, SpecError> {
    let mut factors = Vec::new();
    if let Some(path) = &spec.points {
        let points = points::read(&folder.join(path), units);
        factors.push(points.map_err(|error| error.each(|fault| fault.key = format!("{prefix}{}", fault.key).into()))?);
    }
    let mut held: Vec<Quantity> = factors.iter().flat_map(|factor| &factor.axes).map(|axis| axis.quantity).collect();
    let axes = spec.axes.iter().map(|(name, axis)| {
        let key = format!("{prefix}axes.{name}");
        let Some(quantity) = Quantity::from_name(name) else {
            let is_grid_key = is_grid_key(&key);
            let fault = unknown(key, "axis", name, &Quantity::ALL.map(Quantity::name));
            return Err(if is_grid_key { SpecError { help: HELP_FOR_GRID_KEY.into(), ..fault } } else { fault });
        };
        if held.contains(&quantity) {
            let found = format!("`{name}` is also a column of `points`");
            return refuse(key, found, "each axis once", "remove the axis here or the column there");
        }
        Ok((quantity, read(quantity, units, &key, axis)?))
    });
    let axes = all(axes)?;
    held.extend(axes.iter().map(|(quantity, _)| *quantity));
    let has_default = |quantity: &Quantity| !quantity.default().is_empty() && !quantity.is_tacit();
    let defaults: Vec<Quantity> =
        Quantity::ALL.into_iter().filter(|quantity| has_default(quantity) && !held.contains(quantity)).collect();
    held.extend(&defaults);
    let draft = BlockDraft { spec, prefix, units, axes: &axes, held: &held };

    let (zips, samples) = (draft.zips()?, draft.samples()?);
    let mut placed: Vec<Quantity> = Vec::new();
    for (quantity, axis) in axes.iter().filter(|(_, axis)| !matches!(axis, Written::Computed { .. })) {
        if placed.contains(quantity) {
            continue;
        }
        let together = zips.iter().chain(&samples).find(|axes| axes.iter().any(|axis| axis.quantity == *quantity));
        let axes = match (together, axis) {
            (Some(axes), _) => axes.clone(),
            (None, Written::Values(axis)) => vec![axis.clone()],
            (None, _) => continue,
        };
        placed.extend(axes.iter().map(|axis| axis.quantity));
        factors.push(Factor { axes, ..Factor::default() });
    }
    factors.extend(defaults.into_iter().map(Factor::usual));
    let derived = draft.derived()?;
    let condition = spec.condition.as_ref().map(|text| {
        let points = factors.first().filter(|_| spec.points.is_some());
        Expression::condition(text, &held, points).map_err(|fault| explain(format!("{prefix}where"), fault))
    });
    let block = Block { condition: condition.transpose()?, factors, derived };
    for (quantity, axis) in &axes {
        if let Written::Computed { text, .. } = axis {
            draft.check_values(&block, *quantity, text)?;
        }
    }
    Ok(block)
}

/// A block while its axes are read.
#[derive(Clone, Copy)]
struct BlockDraft<'a> {
    spec: &'a BlockSpec,
    prefix: &'a str,
    units: &'a Units,
    axes: &'a [(Quantity, Written)],
    held: &'a [Quantity],
}

impl BlockDraft<'_> {
    /// The axes of each zip, all of equal length, in the order of the axes.
    fn zips(self) -> Result<Vec<Vec<Axis>>, SpecError> {
        let mut zips: Vec<Vec<Axis>> = Vec::new();
        for (number, names) in self.spec.zip.iter().enumerate() {
            let key = format!("{}zip[{number}]", self.prefix);
            if names.len() < 2 {
                return refuse(key, "too few axes", "two axes or more", "add axes, or remove the zip");
            }
            let mut zip: Vec<Axis> = Vec::new();
            for (place, name) in names.iter().enumerate() {
                let key = format!("{key}[{place}]");
                let axis = self.zipped(name, key.clone())?;
                if zips.iter().flatten().chain(&zip).any(|other| other.quantity == axis.quantity) {
                    return refuse(
                        key,
                        format!("`{name}` is a duplicate"),
                        "each axis in one zip",
                        "remove one of the two",
                    );
                }
                if let Some(first) = zip.first().filter(|first| first.values.len() != axis.values.len()) {
                    let (one, other) = (first.values.len(), axis.values.len());
                    let found = format!("`{}` has length {one}, `{name}` has length {other}", first.quantity.name());
                    return refuse(key, found, "axes of equal length", "give both the same number of values");
                }
                zip.push(axis);
            }
            zip.sort_by_key(|axis| self.axes.iter().position(|(quantity, _)| *quantity == axis.quantity));
            zips.push(zip);
        }
        Ok(zips)
    }

    /// The axis `name` of a zip, named at `key`.
    fn zipped(self, name: &str, key: String) -> Result<Axis, SpecError> {
        match self.axes.iter().find(|(quantity, _)| quantity.name() == name) {
            Some((_, Written::Values(axis))) => Ok(axis.clone()),
            Some(_) => {
                let found = format!("`{name}` is computed or sampled at every point");
                refuse(key, found, "axes with values of their own", "remove it here")
            }
            None => {
                let known: Vec<&str> = self.axes.iter().map(|(quantity, _)| quantity.name()).collect();
                Err(unknown(key, "axis", name, &known))
            }
        }
    }

    /// The joint samples, one for each kind.
    fn samples(self) -> Result<Vec<Vec<Axis>>, SpecError> {
        let BlockDraft { prefix, units, axes, .. } = self;
        let mut samples = Vec::new();
        for design in [Design::Sobol, Design::LatinHypercube] {
            let sampled = |(quantity, axis): &(Quantity, Written)| match axis {
                Written::Sampled(sampled) if sampled.design == design => Some((*quantity, *sampled)),
                _ => None,
            };
            let axes: Vec<(Quantity, Sampled)> = axes.iter().filter_map(sampled).collect();
            let Some((_, first)) = axes.first() else { continue };
            let seed = axes.iter().find_map(|(_, axis)| axis.seed);
            let mut sample = Vec::new();
            for (number, (quantity, axis)) in axes.iter().enumerate() {
                let key = format!("{prefix}axes.{}", quantity.name());
                if axis.count != first.count || axis.seed.is_some() && axis.seed != seed {
                    let expected = format!("one count and one seed for all axes of `{}`", design.name());
                    return refuse(key, "another count or seed than other axes", expected, "make them equal");
                }
                let (least, greatest) = (axis.least, axis.greatest);
                // A weighted mean of both ends cannot overflow; rounding must not leave the interval.
                let value = |u: f64| (least * (1.0 - u) + greatest * u).clamp(least, greatest);
                let inside = design.values(number as u32, axis.count, seed.unwrap_or(0));
                let values: Vec<f64> = inside.into_iter().map(value).collect();
                // Both ends are legal, but numbers between an isolated 0 and the interval are not.
                for &value in &values {
                    if let Err(legal) = legal(units, *quantity, axis.scale, value) {
                        let found = format!("a value of the sample, {value:?}, is out of range");
                        return refuse(key, found, legal, "begin with the least legal number above 0");
                    }
                }
                sample.push(Axis { quantity: *quantity, scale: axis.scale, values: Values::List(values) });
            }
            samples.push(sample);
        }
        Ok(samples)
    }

    /// Computed axes, each after the axes in its expression.
    fn derived(self) -> Result<Vec<Derived>, SpecError> {
        let mut waiting = Vec::new();
        for (quantity, axis) in self.axes {
            if let Written::Computed { scale, text } = axis {
                let expression = Expression::number(text, self.held);
                let expression = expression.map_err(|fault| explain(self.key_of_expression(*quantity), fault))?;
                waiting.push(Derived { quantity: *quantity, scale: *scale, expression });
            }
        }
        let mut derived = Vec::new();
        while !waiting.is_empty() {
            let is_waiting = |quantity: &Quantity| waiting.iter().any(|other: &Derived| other.quantity == *quantity);
            let Some(ready) = waiting.iter().position(|one| !one.expression.reads().iter().any(is_waiting)) else {
                let names: Vec<&str> = waiting.iter().map(|one| one.quantity.name()).collect();
                let (key, found) = (self.key_of_expression(waiting[0].quantity), names.join(", "));
                let found = format!("depends on itself; computed from each other: {found}");
                return refuse(key, found, "axes that are computed from others", "give one of them values of its own");
            };
            derived.push(waiting.remove(ready));
        }
        Ok(derived)
    }

    /// Checks every value of a computed axis at the kept points.
    fn check_values(self, block: &Block, quantity: Quantity, text: &str) -> Result<(), SpecError> {
        let (units, key) = (self.units, self.key_of_expression(quantity));
        let scale = block.scale(quantity).unwrap_or(Scale::Model);
        match first_wrong(block, quantity, |value| legal(units, quantity, scale, value).is_err()) {
            Some(None) => Ok(()),
            Some(Some((value, point))) => {
                let point: Vec<String> = point.iter().map(|(axis, at)| format!("{} = {at:?}", axis.name())).collect();
                let at = if point.is_empty() { String::new() } else { format!(" at {}", point.join(", ")) };
                let legal = legal(units, quantity, scale, value).err().unwrap_or_default();
                let help = "correct the expression, or drop such points with `where`";
                refuse(key, format!("`{text}` is {value:?}{at}"), legal, help)
            }
            None => Err(too_many(key)),
        }
    }

    /// The key of the expression of an axis.
    fn key_of_expression(self, quantity: Quantity) -> String {
        format!("{}axes.{}.expr", self.prefix, quantity.name())
    }
}

/// The fault of an expression or condition that takes too long to evaluate.
pub fn too_many(key: String) -> SpecError {
    let help = "take fewer values on these axes, or split them over several [[block]]s or specs";
    let found = "more than 2^30 combinations of the axes in the condition";
    SpecError::new(key, found, "at most 2^30 combinations", help)
}

/// A fault of an expression at `key`.
fn explain(key: String, fault: Fault) -> SpecError {
    let place = fault.position.map_or_else(String::new, |position| format!("position {position}: "));
    let is_result =
        |name: &str| table::ALL.iter().any(|table| table.columns().iter().any(|column| column.name == name));
    let help = match fault.found.strip_prefix("unknown axis `").and_then(|rest| rest.strip_suffix('`')) {
        Some(name) if is_result(name) => {
            "this is a result; filter results with `query`, or with `plot --where`".to_owned()
        }
        _ => fault.help,
    };
    SpecError::new(key, format!("{place}{}", fault.found), fault.expected, help)
}
