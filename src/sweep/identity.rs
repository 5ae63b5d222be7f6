//! The identity of a table: the hash of its inputs, and the first key in which two specs differ. Both depend on the meaning of a spec, not on its
//! text.

use std::fmt::{self, Write};

use sha2::{Digest, Sha256};

use super::check::{Request, Sweep};
use super::read;
use crate::dataset::DatasetError;
use crate::grid::{Block, Quantity};
use crate::model::Units;
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
        fact("model.friction", format_args!("{}", self.friction.name()));
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
        let gap = table::find("gap").filter(|_| table::is_reduced(name));
        let written = gap.map_or(request.table, |gap| table::over(gap, false));
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
        // The spec of the dataset may name files that do not exist here.
        let difference = Sweep::parse(&spec, &self.folder).map(|other| self.difference(&other, &table));
        let [expected, found] = difference.unwrap_or([expected, found]);
        DatasetError::OtherSpec { folder, table, expected, found, spec }
    }

    /// The first key in which two specs differ for a table, with both values and its line in this spec.
    fn difference(&self, other: &Sweep, table: &str) -> [String; 2] {
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
        let line = |key: &str| read::line(&self.text, key).map_or(String::new(), |line| format!(" (line {line})"));
        // An axis is more specific than the order of all axes.
        let keys = new.chain(lost).map(|(key, _)| key.as_str());
        let Some(key) = keys.min_by_key(|key| key.ends_with("axes")) else {
            return [format!("the file of points{}", line("points")), "other contents of this file".to_owned()];
        };
        // The accuracy of a table is usually that of the sweep.
        let has = |key: &str| read::value(&self.text, key).is_some();
        let of_table = key;
        let key = if key.ends_with(".rtol") && !has(key) && has(RTOL) { RTOL } else { key };
        let value = |sweep: &Sweep, facts: &[(String, String)]| {
            let fact = facts.iter().find(|(known, _)| known == of_table && !key.contains("axes."));
            let fact = fact.map(|(_, value)| value.clone());
            let value = read::value(&sweep.text, key).or(fact);
            value.map_or_else(|| format!("no {key}"), |value| format!("{key} = {}", shown(&value, MAX_SHOWN_CHARS)))
        };
        let [here, there] = [value(self, &here), value(other, &there)];
        let line = if here.starts_with("no ") { String::new() } else { line(key) };
        if here == there {
            return [format!("the values of {key}{line}"), format!("other values of {key}")];
        }
        [here + &line, there]
    }
}

/// The key of the accuracy of a sweep.
const RTOL: &str = "accuracy.rtol";

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
