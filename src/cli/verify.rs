//! `slipsweep verify DATASET`: a sample of rows, solved by an independent method.

use std::path::PathBuf;

use super::watch::waiting;
use super::{EXIT_NOT_CONVERGED, Failure, dataset, say, whole, words};
use crate::dataset::Cell;
use crate::verify::{Audit, MAX_DIFFERENCE_RTOLS, verify as audit};

/// Arguments of `verify`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  slipsweep verify results/granite --sample 1000")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME
    dataset: PathBuf,
    /// Number of rows to check in each table
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole::<u64>(1, u64::MAX))]
    sample: u64,
    /// Seed of the sample
    #[arg(long, value_name = "S", default_value_t = 0, value_parser = whole::<u64>(0, u64::MAX))]
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
    let text: Vec<String> = audits.iter().map(summary).collect();
    say(&text.join("\n"))?;
    let errors: usize = audits.iter().map(Audit::errors).sum();
    if errors > 0 {
        let message = format!(
            "error: {} beyond {MAX_DIFFERENCE_RTOLS} rtol\n  help: the rows are listed above; a part that was changed is made again if its file is \
             deleted and the sweep run",
            words::things(errors as u64, "number")
        );
        return Err(Failure { code: EXIT_NOT_CONVERGED, message });
    }
    Ok(())
}

/// Number of columns whose worst row is shown if none fails. Chosen: the answer fits a screen.
const MIN_SHOWN_COLUMNS: usize = 2;

/// A difference in units of rtol.
fn units(value: f64) -> String {
    if value < 1e5 { format!("{value:.3}") } else { format!("{value:.1e}") }
}

/// The audit of one table in a few lines.
pub fn summary(audit: &Audit) -> String {
    let mut text =
        format!("{}: {} sampled, rtol {:e}\n", audit.table, words::things(audit.rows as u64, "row"), audit.rtol);
    let mut lines = Vec::new();
    for (column, all) in &audit.columns {
        let at =
            |fraction: f64| all.get(((all.len() - 1) as f64 * fraction).ceil() as usize).copied().unwrap_or(f64::NAN);
        let cells = [at(0.5), at(0.99), at(1.0)].map(units);
        lines.push([(*column).to_owned(), words::count(all.len() as u64)].into_iter().chain(cells).collect());
    }
    if !lines.is_empty() {
        lines.insert(0, ["difference/rtol", "rows", "median", "99 %", "greatest"].map(str::to_owned).to_vec());
        text.push_str(&words::aligned(&lines, 2));
    }
    // Every failing column, or else the columns with the greatest differences.
    let failing = audit.worst.iter().filter(|worst| worst.difference > MAX_DIFFERENCE_RTOLS).count();
    let shown = audit.worst.iter().filter(|worst| worst.difference > 0.0);
    for worst in shown.take(failing.max(MIN_SHOWN_COLUMNS)) {
        let cells: Vec<String> = worst
            .row
            .iter()
            .map(|(name, cell)| match cell {
                Cell::Number(value) => format!("{name} = {value:?}"),
                Cell::Word(word) => format!("{name} = {word}"),
                Cell::Missing => format!("{name} = -"),
            })
            .collect();
        let (column, difference, expected) = (worst.column, units(worst.difference), &worst.expected);
        let note = if audit.is_converted { " (dimensionless)" } else { "" };
        let (row, cells) = (worst.number, cells.join(", "));
        text.push_str(&match worst.difference > MAX_DIFFERENCE_RTOLS {
            true => format!("  row {row}: {column} differs by {difference} rtol, the check has {expected}{note}\n"),
            false => {
                format!("  greatest difference of {column}: {difference} rtol in row {row}, the check has {expected}{note}\n")
            }
        });
        text.push_str(&format!("    {cells}\n"));
    }
    for (reason, rows) in &audit.unchecked {
        text.push_str(&format!("  not checked in {}: {reason}\n", words::things(*rows, "row")));
    }
    text
}
