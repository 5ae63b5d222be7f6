//! `slipsweep verify DATASET`: a sample of rows, solved by an independent method.

use std::path::PathBuf;

use indexmap::IndexMap;

use super::watch::waiting;
use super::{EXIT_NOT_CONVERGED, Failure, dataset, say, whole, words};
use crate::dataset::{Cell, Row};
use crate::verify::{Audit, Extent, MAX_DIFFERENCE_RTOLS, Worst, verify as audit};

/// Arguments of `verify`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  slipsweep verify results/granite --sample 1000")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME
    dataset: PathBuf,
    /// Number of rows to check in each table
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 100, value_parser = whole::<u64>(1, u64::MAX))]
    sample: u64,
    /// Seed of the sample
    #[arg(long, allow_negative_numbers = true, value_name = "S", default_value_t = 0, value_parser = whole::<u64>(0, u64::MAX))]
    seed: u64,
}

/// Verifies a dataset.
///
/// # Errors
///
/// A path that is not a dataset, a dataset that cannot be read, or rows that are wrong.
pub fn verify(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.dataset;
    let (_, manifest) = dataset(path)?;
    let again = || audit(path, &manifest, arguments.sample, arguments.seed);
    let audits = waiting("solving the sample again", again).map_err(Failure::failed)?;
    say(&report(&audits))?;
    let errors: usize = audits.iter().map(|audit| audit.errors).sum();
    if errors > 0 {
        let message = format!(
            "error: {} beyond {MAX_DIFFERENCE_RTOLS} rtol\n  help: if a part was changed, delete its file and run the sweep again",
            words::things(errors as u64, "number")
        );
        return Err(Failure { code: EXIT_NOT_CONVERGED, message });
    }
    audits.iter().find_map(|audit| audit.fault.as_ref()).map_or(Ok(()), |fault| Err(Failure::failed(fault)))
}

/// Number of columns that are named if none fails. Chosen: a table of the answer fits a line.
const MIN_NAMED_COLUMNS: usize = 2;

/// A difference in units of rtol.
fn units(value: f64) -> String {
    if value < 1e5 { format!("{value:.3}") } else { format!("{value:.1e}") }
}

/// Whether a number differs by too much.
fn is_failing(worst: &&Worst) -> bool {
    worst.difference > MAX_DIFFERENCE_RTOLS
}

/// The audits: a line for each table, the rows with numbers that differ by too much, the unchecked rows, and the verdict if it is good.
pub fn report(audits: &[Audit]) -> String {
    let mut lines = vec![["table", "rows", "rtol", "greatest differences in rtol"].map(str::to_owned).to_vec()];
    for audit in audits {
        let failing = audit.worst.iter().filter(is_failing).count();
        let named = audit.worst.iter().take(failing.max(MIN_NAMED_COLUMNS));
        let named = named.map(|worst| (worst.column, units(worst.difference))).filter(|(_, units)| units != "0.000");
        let named: Vec<String> = named.map(|(column, units)| format!("{column} {units}")).collect();
        let named = match named.is_empty() {
            _ if audit.worst.is_empty() => "none".to_owned(),
            true => "below 0.001".to_owned(),
            false => named.join(", "),
        };
        lines.push(vec![audit.table.clone(), words::count(audit.rows as u64), format!("{:e}", audit.rtol), named]);
    }
    let mut text = words::aligned(&lines, 0);
    audits.iter().for_each(|audit| text.push_str(&failures(audit)));
    for Audit { table, unchecked, .. } in audits {
        for ((reason, extent), rows) in unchecked {
            let extent = if *extent == Extent::Part { " in full" } else { "" };
            text.push_str(&format!("{table}: {} not checked{extent}: {reason}\n", words::things(*rows, "row")));
        }
    }
    if audits.iter().all(|audit| audit.worst.is_empty()) {
        text.push_str("no number was compared\n");
    } else if audits.iter().all(|audit| audit.errors == 0 && audit.fault.is_none()) {
        text.push_str(&format!("no number differs by more than {MAX_DIFFERENCE_RTOLS} rtol\n"));
    }
    text
}

/// The worst row of each failing column, with the columns for which it is the worst.
fn failures(audit: &Audit) -> String {
    let failing: Vec<&Worst> = audit.worst.iter().filter(is_failing).collect();
    let rows: IndexMap<u64, &Row> = failing.iter().map(|worst| (worst.number, &worst.row)).collect();
    let mut text = String::new();
    for (number, row) in rows {
        let cells = row.iter().filter_map(|(name, cell)| match cell {
            Cell::Number(value) => Some(format!("{name} = {value:?}")),
            Cell::Word(word) => Some(format!("{name} = {word}")),
            Cell::Missing => None,
        });
        let (table, note) = (&audit.table, if audit.is_converted { " (dimensionless)" } else { "" });
        text.push_str(&format!("{table}, row {number}{note}: {}\n", cells.collect::<Vec<_>>().join(", ")));
        for Worst { column, difference, expected, .. } in failing.iter().filter(|worst| worst.number == number) {
            text.push_str(&format!("  {column} differs by {} rtol, the check has {expected}\n", units(*difference)));
        }
    }
    text
}
