//! One block of a spec as a checked block of the grid: points, axes, zips, samples, computed axes and the condition.

use std::path::Path;

use super::axis::{Sampled, Written, read};
use super::error::{Faults, SpecError, refuse, unknown};
use super::points;
use super::spec::BlockSpec;
use super::units::legal;
use crate::grid::{Axis, Block, Derived, Design, Expression, Factor, Fault, Quantity, Scale, Values, first_wrong};
use crate::model::Units;
use crate::names::nearest;

/// The checked part of a block.
pub struct Checked {
    /// The prefix of its keys.
    pub prefix: String,
    /// Every axis that it may have, including that of a misspelt name, and all axes if a points file cannot be read.
    pub held: Vec<Quantity>,
    /// The block of the grid; `None` if the block has a fault.
    pub block: Option<Block>,
}

/// Checks `spec`, whose keys begin with `prefix`; files are relative to `folder`. Values are not checked without `units`.
pub fn check(spec: &BlockSpec, prefix: String, units: Option<&Units>, folder: &Path, faults: &mut Faults) -> Checked {
    let mut factors = Vec::new();
    let mut are_known = !(faults.concern(&format!("{prefix}points")) || prefix.is_empty() && faults.concern("block"));
    if let Some(path) = &spec.points {
        let points = units.map(|units| points::read(&folder.join(path), units));
        let points = points
            .map(|read| read.map_err(|error| SpecError { key: format!("{prefix}{}", error.key).into(), ..error }));
        match points.and_then(|read| faults.take(read)) {
            Some(points) => factors.push(points),
            None => are_known = false,
        }
    }
    // Axes in the spec, with their definition if it is legal.
    let mut axes: Vec<(Quantity, Option<Written>)> = Vec::new();
    for (name, axis) in &spec.axes {
        let key = format!("{prefix}axes.{name}");
        let known = Quantity::ALL.map(Quantity::name);
        let Some(quantity) = Quantity::from_name(name) else {
            axes.extend(nearest(name, known).and_then(Quantity::from_name).map(|meant| (meant, None)));
            let mut fault = unknown(key, "axis", name, &known);
            match name.as_str() {
                "tables" => fault.help = "write a header for each table, such as [tables.gap]".into(),
                "name" | "description" | "points" | "zip" | "where" => fault.help = "move it above [axes]".into(),
                _ => {}
            }
            faults.push(fault);
            continue;
        };
        let is_sound = !faults.concern(&key);
        if factors.iter().any(|factor: &Factor| factor.holds_any(&[quantity])) {
            let found = format!("`{name}` is also a column of `points`");
            faults.push(SpecError::new(&*key, found, "each axis once", "remove the axis here or the column there"));
        }
        let written = units.filter(|_| is_sound).and_then(|units| faults.take(read(quantity, units, &key, axis)));
        axes.push((quantity, written));
    }
    let mut held: Vec<Quantity> = factors.iter().flat_map(|factor| &factor.axes).map(|axis| axis.quantity).collect();
    held.extend(axes.iter().map(|(quantity, _)| *quantity));
    for quantity in Quantity::ALL {
        let is_there = !are_known || faults.concern(&format!("{prefix}axes.{}", quantity.name()));
        let has_default = !quantity.default().is_empty() && !quantity.is_tacit();
        if !held.contains(&quantity) && (is_there || has_default) {
            held.push(quantity);
        }
    }
    let draft = |units| BlockDraft { spec, prefix: &prefix, units, axes: &axes, held: &held };
    let block = units.and_then(|units| draft(units).block(factors, faults));
    Checked { prefix, held, block }
}

/// A block while its axes are read.
#[derive(Clone, Copy)]
struct BlockDraft<'a> {
    spec: &'a BlockSpec,
    prefix: &'a str,
    units: &'a Units,
    axes: &'a [(Quantity, Option<Written>)],
    held: &'a [Quantity],
}

impl BlockDraft<'_> {
    /// The block with these points.
    fn block(self, mut factors: Vec<Factor>, faults: &mut Faults) -> Option<Block> {
        let BlockDraft { spec, prefix, axes, held, .. } = self;
        let has_points = !factors.is_empty();
        let zips = self.zips(&factors, faults);
        let samples = faults.take(self.samples())?;
        let mut computed = Vec::new();
        let mut placed: Vec<Quantity> = Vec::new();
        for (quantity, axis) in axes {
            if placed.contains(quantity) {
                continue;
            }
            let factor = match axis {
                None => continue,
                Some(Written::Computed { scale, text }) => {
                    computed.push((*quantity, *scale, text.as_str()));
                    continue;
                }
                Some(Written::Values(axis)) => match zips.iter().find(|axes| axes[0].quantity == *quantity) {
                    Some(axes) => axes.clone(),
                    None => vec![axis.clone()],
                },
                Some(Written::Sampled(sampled)) => samples
                    .iter()
                    .find(|(design, _)| *design == sampled.design)
                    .map_or_else(Vec::new, |(_, axes)| axes.clone()),
            };
            placed.extend(factor.iter().map(|axis| axis.quantity));
            factors.push(Factor { axes: factor, ..Factor::default() });
        }
        for quantity in Quantity::ALL {
            let held = factors.iter().any(|factor| factor.holds_any(&[quantity]))
                || computed.iter().any(|(other, ..)| *other == quantity);
            let values = quantity.default();
            if !held && !values.is_empty() && !quantity.is_tacit() {
                let axis = Axis { quantity, scale: Scale::Model, values: Values::List(values) };
                factors.push(Factor { axes: vec![axis], ..Factor::default() });
            }
        }
        let derived = self.derived(&computed, faults);
        let points = factors.first().filter(|_| has_points);
        // Labels are unknown without the points.
        let are_known = has_points || spec.points.is_none();
        let condition = spec.condition.as_ref().filter(|_| are_known && !faults.concern(&format!("{prefix}where")));
        let condition = condition.map(|text| {
            let condition = Expression::condition(text, held, points);
            faults.take(condition.map_err(|fault| explain(format!("{prefix}where"), fault)))
        });
        let block = Block { factors, derived, condition: condition.flatten() };
        // Only for legal blocks, since this takes time.
        for (quantity, _, text) in computed {
            if faults.are_none() {
                faults.take(self.check_values(&block, quantity, text));
            }
        }
        Some(block)
    }

    /// The axes of each zip, all of equal length, in the order of the axes.
    fn zips(self, factors: &[Factor], faults: &mut Faults) -> Vec<Vec<Axis>> {
        let BlockDraft { spec, prefix, axes, .. } = self;
        let mut zips: Vec<Vec<Axis>> = Vec::new();
        for (number, names) in spec.zip.iter().enumerate() {
            let key = format!("{prefix}zip[{number}]");
            if names.len() < 2 {
                let found = format!("a zip of {}", if names.is_empty() { "no axis" } else { "one axis" });
                faults.push(SpecError::new(key, found, "two axes or more", "add axes, or remove the zip"));
                continue;
            }
            let mut zip: Vec<Axis> = Vec::new();
            for (place, name) in names.iter().enumerate() {
                let zipped = self.zipped(name, format!("{key}[{place}]"), factors, (&zips, &zip));
                zip.extend(faults.take(zipped).flatten());
            }
            zip.sort_by_key(|axis| axes.iter().position(|(quantity, _)| *quantity == axis.quantity));
            zips.extend((!zip.is_empty()).then_some(zip));
        }
        zips
    }

    /// The axis `name` of a zip at `key`, checked against other zips; `None` if the axis has a fault of its own.
    fn zipped(
        self,
        name: &str,
        key: String,
        factors: &[Factor],
        (zips, zip): (&[Vec<Axis>], &[Axis]),
    ) -> Result<Option<Axis>, SpecError> {
        let BlockDraft { axes, held, .. } = self;
        let axis = match axes.iter().find(|(quantity, _)| quantity.name() == name).map(|(_, axis)| axis.as_ref()) {
            Some(Some(Written::Values(axis))) => axis,
            Some(Some(Written::Computed { .. })) => {
                let found = format!("`{name}` is computed from other axes at every point");
                return refuse(key, found, "axes with values of their own", "remove it here");
            }
            Some(Some(Written::Sampled(sampled))) => {
                let found = format!("`{name}` varies together with all axes of `{}`", sampled.design.name());
                return refuse(key, found, "axes with values of their own", "remove it here");
            }
            Some(None) => return Ok(None),
            None if factors.iter().flat_map(|factor| &factor.axes).any(|axis| axis.quantity.name() == name) => {
                let found = format!("`{name}` is a column of `points`, which vary together anyway");
                return refuse(key, found, "names of [axes]", "remove it here");
            }
            // A default axis has one value, or one of each word.
            None if held.iter().any(|quantity| quantity.name() == name && quantity.default().is_empty()) => {
                return Ok(None);
            }
            None => {
                let known: Vec<&str> = axes.iter().map(|(quantity, _)| quantity.name()).collect();
                return Err(unknown(key, "axis", name, &known));
            }
        };
        if zips.iter().flatten().chain(zip).any(|other| other.quantity == axis.quantity) {
            return refuse(key, format!("`{name}` is a duplicate"), "each axis in one zip", "remove one of the two");
        }
        if let Some(first) = zip.first()
            && first.values.len() != axis.values.len()
        {
            let (one, other) = (values(first.values.len()), values(axis.values.len()));
            let found = format!("`{}` has {one}, `{name}` has {other}", first.quantity.name());
            let help = "give both the same number; nothing is repeated or left out";
            return refuse(key, found, "axes of equal length", help);
        }
        Ok(Some(axis.clone()))
    }

    /// The joint samples, one for each kind.
    fn samples(self) -> Result<Vec<(Design, Vec<Axis>)>, SpecError> {
        let BlockDraft { prefix, units, axes, .. } = self;
        let mut samples = Vec::new();
        for design in [Design::Sobol, Design::LatinHypercube] {
            let axes: Vec<(Quantity, Sampled)> = axes
                .iter()
                .filter_map(|(quantity, axis)| match axis {
                    Some(Written::Sampled(sampled)) if sampled.design == design => Some((*quantity, *sampled)),
                    _ => None,
                })
                .collect();
            let Some((first, sample)) = axes.first() else { continue };
            let seeded = axes.iter().find_map(|(quantity, axis)| Some((quantity, axis.seed?)));
            for (quantity, axis) in &axes {
                let (key, kind) = (format!("{prefix}axes.{}", quantity.name()), design.name());
                if axis.count != sample.count {
                    let found = format!("{} points, but `{}` has {}", axis.count, first.name(), sample.count);
                    let expected = format!("the same count for all axes of `{kind}`, which are sampled jointly");
                    return refuse(format!("{key}.{kind}[2]"), found, expected, "make them equal");
                }
                if let (Some(seed), Some((other, first_seed))) = (axis.seed, seeded)
                    && seed != first_seed
                {
                    let found = format!("seed {seed}, but `{}` has {first_seed}", other.name());
                    let expected = format!("one seed for all axes of `{kind}`, which are sampled jointly");
                    return refuse(format!("{key}.seed"), found, expected, "remove one of the two");
                }
            }
            let seed = seeded.map_or(0, |(_, seed)| seed);
            let draw = |(number, (quantity, axis)): (usize, &(Quantity, Sampled))| {
                let (least, greatest) = (axis.least, axis.greatest);
                let inside = design.values(number as u32, axis.count, seed);
                // A weighted mean of both ends cannot overflow; rounding must not leave the interval.
                let values: Vec<f64> =
                    inside.into_iter().map(|u| (least * (1.0 - u) + greatest * u).clamp(least, greatest)).collect();
                // Both ends are legal, but numbers between an isolated 0 and the interval are not.
                for &value in &values {
                    if let Err(legal) = legal(units, *quantity, axis.scale, value) {
                        let key = format!("{prefix}axes.{}.{}", quantity.name(), design.name());
                        let found = format!("a value of the sample, {value:?}, is out of range");
                        return refuse(key, found, legal, "begin with the least legal number above 0");
                    }
                }
                Ok(Axis { quantity: *quantity, scale: axis.scale, values: Values::List(values) })
            };
            samples.push((design, axes.iter().enumerate().map(draw).collect::<Result<_, _>>()?));
        }
        Ok(samples)
    }

    /// Computed axes, each after the axes in its expression.
    fn derived(self, computed: &[(Quantity, Scale, &str)], faults: &mut Faults) -> Vec<Derived> {
        let key = |quantity| self.key_of_expression(quantity);
        let mut waiting = Vec::new();
        for &(quantity, scale, text) in computed {
            let expression = Expression::number(text, self.held).map_err(|fault| explain(key(quantity), fault));
            waiting.extend(faults.take(expression).map(|expression| Derived { quantity, scale, expression }));
        }
        let mut derived = Vec::new();
        while !waiting.is_empty() {
            let is_waiting = |quantity: &Quantity| waiting.iter().any(|other: &Derived| other.quantity == *quantity);
            let next = |one: &Derived| one.expression.reads().into_iter().find(|read| is_waiting(read));
            if let Some(ready) = waiting.iter().position(|one| next(one).is_none()) {
                derived.push(waiting.remove(ready));
                continue;
            }
            // Follows the cycle until an axis repeats.
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
            let names = names.join(", which is computed from ").replacen(", which", "", 1);
            let (expected, help) = ("axes that are computed from others", "give one of them values of its own");
            faults.push(SpecError::new(key(path[0]), format!("depends on itself: {names}"), expected, help));
            break;
        }
        derived
    }

    /// Checks every value of a computed axis at the kept points.
    fn check_values(self, block: &Block, quantity: Quantity, text: &str) -> Result<(), SpecError> {
        let (units, key) = (self.units, self.key_of_expression(quantity));
        let scale = block.scale(quantity).unwrap_or(Scale::Model);
        match first_wrong(block, quantity, |value| legal(units, quantity, scale, value).is_err()) {
            Some(None) => Ok(()),
            Some(Some((value, place))) => {
                let place = at(&place);
                let legal = legal(units, quantity, scale, value).err().unwrap_or_default();
                let help = "correct the expression, or drop such points with `where`";
                refuse(key, format!("`{text}` is {value:?}{place}"), legal, help)
            }
            None => Err(too_many(key)),
        }
    }

    /// The key of the expression of an axis.
    fn key_of_expression(self, quantity: Quantity) -> String {
        format!("{}axes.{}.expr", self.prefix, quantity.name())
    }
}

/// A point, in words.
fn at(point: &[(Quantity, f64)]) -> String {
    let values: Vec<String> = point.iter().map(|(axis, value)| format!("{} = {value:?}", axis.name())).collect();
    if values.is_empty() { String::new() } else { format!(" at {}", values.join(", ")) }
}

/// The first computed axis of `block` that is NaN at a point, whether the condition keeps it or not, in words.
pub fn nan(block: &Block) -> Option<String> {
    let all = Block { condition: None, ..block.clone() };
    let first = |axis: Quantity| Some((axis, first_wrong(&all, axis, f64::is_nan)??.1));
    let (axis, point) = block.derived.iter().find_map(|derived| first(derived.quantity))?;
    Some(format!("`{}`, NaN{}", axis.name(), at(&point)))
}

fn values(count: u64) -> String {
    if count == 1 { "1 value".to_owned() } else { format!("{count} values") }
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
    SpecError::new(key, format!("{place}{}", fault.found), fault.expected, fault.help)
}
