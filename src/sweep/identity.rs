//! The identity of a table: the hash of its inputs, and the first key in which two specs differ. Both depend on the meaning of a spec, not on its
//! text.

use std::fmt::{self, Write};

use sha2::{Digest, Sha256};

use super::check::{Request, Sweep};
use super::read;
use crate::dataset::DatasetError;
use crate::grid::{Block, Quantity};
use crate::model::{Friction, Units};
use crate::names::shown;
use crate::table;

/// Greatest length of a value in a message, in characters. Chosen: a line.
const MAX_SHOWN_CHARS: usize = 100;

impl Sweep {
    /// SHA-256 of all inputs of a table.
    pub fn hash(&self, request: &Request) -> String {
        let hash = || {
            let mut hash = Hashed(Sha256::new());
            self.facts(request, &mut |key, value| {
                // Never fails.
                let _ = writeln!(hash, "{key} {value}");
            });
            hash.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
        };
        request.hash.get_or_init(hash).clone()
    }

    /// Passes each input of a table to `fact`: key and canonical value. These are the axes of the table, and the axes in their expressions and in
    /// the condition.
    fn facts(&self, request: &Request, fact: &mut dyn FnMut(&str, fmt::Arguments<'_>)) {
        fact("model.velocity_bound", format_args!("{}", self.bounded));
        // Datasets of earlier versions have the logarithm.
        if self.friction != Friction::Log {
            fact("model.friction", format_args!("{}", self.friction.name()));
        }
        match &self.grid.units {
            Units::Scaled => fact("model.units", format_args!("dimensionless")),
            Units::Si(scales) => {
                fact("model.units", format_args!("si"));
                fact("model.mu_0", format_args!("{:?}", scales.mu_0));
                fact("model.l", format_args!("{:?}", scales.l));
                fact("model.v_0", format_args!("{:?}", scales.v_0));
                fact("model.normal_stress", format_args!("{:?}", scales.normal_stress));
            }
        }
        let name = request.table.name();
        let reduced = table::REDUCED.iter().any(|(_, table)| table.name() == name);
        let written =
            if reduced { table::find("gap").map(|gap| table::over(gap, false)) } else { None }.unwrap_or(request.table);
        let blocks = &self.grid.blocks;
        fact("block", format_args!("{}", blocks.len()));
        for (number, block) in blocks.iter().enumerate() {
            let prefix = if blocks.len() > 1 { format!("block[{number}].") } else { String::new() };
            block_facts(block, written.axes(), &mut |key, value| fact(&format!("{prefix}{key}"), value));
        }
        let key = written.name();
        fact(&format!("tables.{key}.reduce"), format_args!("{name}"));
        fact(&format!("tables.{key}.rtol"), format_args!("{:?}", request.rtol));
        let columns = request.projection.indices().iter().map(|&column| request.table.columns()[column].name);
        fact(&format!("tables.{key}.columns"), format_args!("{}", columns.collect::<Vec<_>>().join(", ")));
    }

    /// The error with the first key in which this spec differs from that of the dataset.
    pub(super) fn explain(&self, error: DatasetError) -> DatasetError {
        let DatasetError::OtherSpec { folder, table, expected, found, spec } = error else { return error };
        let [mut here, mut there] = [expected, found];
        match Sweep::parse(&spec, &self.folder) {
            Ok(other) => match self.difference(&other, &table) {
                Some(difference) => [here, there] = difference,
                None => {
                    here = match read::value(&self.text, "points") {
                        Some(file) => format!("points = {file}{}", self.at("points")),
                        None => "the points that it refers to".to_owned(),
                    };
                    there = "other contents of the same file".to_owned();
                }
            },
            // The spec of the dataset names files that do not exist here.
            Err(_) if spec.is_empty() => {}
            Err(error) => there = format!("a spec that cannot be read from here: {}", error.found),
        }
        DatasetError::OtherSpec { folder, table, expected: here, found: there, spec }
    }

    /// The first key in which two specs differ for a table, with both values and its line in this spec.
    fn difference(&self, other: &Sweep, table: &str) -> Option<[String; 2]> {
        let facts = |sweep: &Sweep| {
            let mut facts = Vec::new();
            if let Some(request) = sweep.requests.iter().find(|request| request.table.name() == table) {
                sweep.facts(request, &mut |key, value| facts.push((key.to_owned(), value.to_string())));
            }
            facts
        };
        let [here, there] = [facts(self), facts(other)];
        let new = here.iter().filter(|fact| !there.contains(fact));
        let lost = there.iter().filter(|fact| !here.contains(fact));
        // An axis is more specific than the order of all axes.
        let mut keys: Vec<&str> = new.chain(lost).map(|(key, _)| key.as_str()).collect();
        keys.sort_by_key(|key| is_order(key));
        keys.into_iter().find_map(|key| {
            let is_written = |key: &str| [self, other].iter().any(|sweep| read::value(&sweep.text, key).is_some());
            let name = if key.ends_with(".rtol") && !is_written(key) { "accuracy.rtol" } else { key };
            let value = |sweep: &Sweep, facts: &[(String, String)]| {
                let default = || facts.iter().find(|(known, _)| known == key).map(|(_, value)| value.clone());
                read::value(&sweep.text, name).or_else(|| default().filter(|_| is_order(key) || !key.contains("axes.")))
            };
            let missing = || format!("no {name}");
            match [value(self, &here), value(other, &there)] {
                [Some(here), Some(there)] => {
                    let [here, there] = differing([here, there]);
                    Some([format!("{name} = {here}{}", self.at(name)), format!("{name} = {there}")])
                }
                [Some(here), None] => {
                    Some([format!("{name} = {}{}", shown(&here, MAX_SHOWN_CHARS), self.at(name)), missing()])
                }
                [None, Some(there)] => Some([missing(), format!("{name} = {}", shown(&there, MAX_SHOWN_CHARS))]),
                [None, None] => None,
            }
        })
    }

    /// The line of a key in the spec, for a message.
    fn at(&self, key: &str) -> String {
        let is_written = is_order(key) || read::value(&self.text, key).is_some();
        let line = read::line(&self.text, key).filter(|_| is_written);
        line.map_or_else(String::new, |line| format!(" (line {line})"))
    }
}

/// Whether a key is the order of the axes.
fn is_order(key: &str) -> bool {
    key == "axes" || key.ends_with("].axes")
}

/// Two values in a message, long ones from shortly before their difference on.
fn differing(values: [String; 2]) -> [String; 2] {
    let same = values[0].chars().zip(values[1].chars()).take_while(|(here, there)| here == there).count();
    let longest = values.each_ref().map(|value| value.chars().count()).into_iter().fold(0, usize::max);
    let start = same.saturating_sub(MAX_SHOWN_CHARS / 2).min(longest.saturating_sub(MAX_SHOWN_CHARS));
    values.map(|value| {
        let rest: String = value.chars().skip(start).collect();
        format!("{}{}", if start > 0 { "..." } else { "" }, shown(&rest, MAX_SHOWN_CHARS))
    })
}

/// The inputs of a block for the `needed` axes, and for the axes in their expressions and in the condition.
fn block_facts(block: &Block, needed: &[Quantity], fact: &mut dyn FnMut(&str, fmt::Arguments<'_>)) {
    let mut needed = needed.to_vec();
    needed.extend(block.condition.iter().flat_map(|condition| condition.reads()));
    let needed = block.with_reads(&needed);
    let mut order = Vec::new();
    let (mut axes, mut single) = (Vec::new(), Vec::new());
    for factor in &block.factors {
        let used: Vec<_> = factor.axes.iter().filter(|axis| needed.contains(&axis.quantity)).collect();
        for label in factor.labels.iter().filter(|_| !used.is_empty()) {
            fact("points", format_args!("{label:?}"));
        }
        if factor.len() > 1 {
            let names: Vec<&str> = used.iter().map(|axis| axis.quantity.name()).collect();
            order.extend((!names.is_empty()).then(|| names.join(" with ")));
            axes.extend(used);
        } else {
            single.extend(used);
        }
    }
    // The order of axes with one value has no meaning.
    single.sort_by_key(|axis| axis.quantity);
    for axis in axes.into_iter().chain(single) {
        let (name, unit) = (axis.quantity.name(), axis.quantity.unit(axis.scale));
        fact(&format!("axes.{name}"), format_args!("{:?} {unit}", axis.values));
    }
    fact("axes", format_args!("{}", order.join(", ")));
    for derived in block.derived.iter().filter(|derived| needed.contains(&derived.quantity)) {
        let (name, unit) = (derived.quantity.name(), derived.quantity.unit(derived.scale));
        fact(&format!("axes.{name}"), format_args!("{:?} {unit}", derived.expression));
    }
    match &block.condition {
        Some(condition) => fact("where", format_args!("{condition:?}")),
        None => fact("where", format_args!("none")),
    }
}

/// The hash of a text that is not kept in memory, since points files may hold millions of values.
struct Hashed(Sha256);

impl Write for Hashed {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text);
        Ok(())
    }
}
