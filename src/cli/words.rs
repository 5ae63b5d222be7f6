//! Numbers, amounts and tables as text.

use std::iter;

use indicatif::HumanCount;

pub use crate::names::number;
use crate::names::trimmed;
use crate::protocol::Status;

/// `count` with a comma between thousands.
pub fn count(count: u64) -> String {
    HumanCount(count).to_string()
}

/// `number` things, in the singular or with an s.
pub fn things(number: u64, thing: &str) -> String {
    format!("{} {thing}{}", count(number), if number == 1 { "" } else { "s" })
}

/// Numbers of rows by word: `3 ok, 1 infeasible`.
pub fn counts<'a>(counts: impl Iterator<Item = (&'a str, u64)>) -> String {
    counts.map(|(word, rows)| format!("{} {word}", count(rows))).collect::<Vec<_>>().join(", ")
}

/// Numbers of rows by status, without zeros.
pub fn statuses(rows: &[u64]) -> String {
    let all = Status::ALL.iter().map(|status| status.name()).zip(rows.iter().copied());
    counts(all.filter(|(_, rows)| *rows > 0))
}

/// `bytes` in a fitting unit.
pub fn bytes(bytes: f64) -> String {
    let mut value = bytes;
    for unit in ["B", "kB", "MB", "GB", "TB", "PB"] {
        if value < 999.5 {
            return format!("{} {unit}", short(value));
        }
        value /= 1000.0;
    }
    format!("{} EB", short(value))
}

/// `seconds` in a fitting unit.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1e-5 => "less than 0.01 ms".to_owned(),
        s if s < 0.9995 => format!("{} ms", short(s * 1e3)),
        s if s < 120.0 => format!("{} s", short(s)),
        s if s < 7200.0 => format!("{} min", short(s / 60.0)),
        s if s < 172_800.0 => format!("{} h", short(s / 3600.0)),
        s if s < 1e8 => format!("{} d", short(s / 86_400.0)),
        s => format!("{} years", short(s / 31_557_600.0)),
    }
}

/// Three significant digits of a number between 0 and 1000, or all digits before the point.
fn short(value: f64) -> String {
    let decimals = if value < 9.995 { 2 } else { usize::from(value < 99.95) };
    trimmed(&format!("{value:.decimals$}")).to_owned()
}

/// Ascending numbers, consecutive ones as first-last.
pub fn ranges(numbers: impl IntoIterator<Item = u64>) -> String {
    let mut ranges: Vec<[u64; 2]> = Vec::new();
    for number in numbers {
        match ranges.last_mut() {
            Some([_, last]) if *last + 1 == number => *last = number,
            _ => ranges.push([number, number]),
        }
    }
    ranges.into_iter().map(|[first, last]| range(first, last)).collect::<Vec<_>>().join(",")
}

/// The numbers from `first` to `last`.
pub fn range(first: u64, last: u64) -> String {
    if first == last { first.to_string() } else { format!("{first}-{last}") }
}

/// Rows under their names and, if any is known, their units.
pub fn headed(names: Vec<String>, units: Vec<String>, rows: Vec<Vec<String>>) -> Vec<Vec<String>> {
    let units = Some(units).filter(|units| units.iter().any(|unit| !unit.is_empty()));
    iter::once(names).chain(units).chain(rows).collect()
}

/// Lines with aligned columns, two spaces apart, each after `indent` spaces.
pub fn aligned(rows: &[Vec<String>], indent: usize) -> String {
    Columns::default().lines(rows, indent)
}

/// Columns that stay aligned while lines come block by block; a later block can only widen them.
#[derive(Debug, Default)]
pub struct Columns {
    widths: Vec<usize>,
}

impl Columns {
    /// The next lines, each after `indent` spaces.
    pub fn lines(&mut self, rows: &[Vec<String>], indent: usize) -> String {
        for row in rows {
            self.widths.resize(self.widths.len().max(row.len()), 0);
            for (cell, width) in row.iter().zip(&mut self.widths) {
                *width = cell.chars().count().max(*width);
            }
        }
        let mut text = String::new();
        for row in rows {
            let mut line = " ".repeat(indent);
            for (cell, width) in row.iter().zip(&self.widths) {
                line.push_str(cell);
                // Format widths are at most 65,535.
                line.push_str(&" ".repeat(width - cell.chars().count() + 2));
            }
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }
}

#[cfg(test)]
mod tests {
    //! Formatted numbers.

    use super::*;

    #[test]
    fn numbers_have_nine_digits() {
        let shown =
            [0.037, 100.0, 6.580308e-7, 3.80811141633, -2.59678653, 3392.17, 1e6, 1.5e12, f64::INFINITY, 1.0 / 3.0];
        let words = [
            "0.037",
            "100",
            "6.580308e-7",
            "3.80811142",
            "-2.59678653",
            "3392.17",
            "1000000",
            "1.5e12",
            "inf",
            "0.333333333",
        ];
        assert_eq!(shown.map(number), words);
    }

    #[test]
    fn amounts_are_readable() {
        assert_eq!(
            [0, 999, 1000, 482_403, 1_000_000_000].map(count),
            ["0", "999", "1,000", "482,403", "1,000,000,000"]
        );
        assert_eq!([things(1, "row"), things(1200, "part")], ["1 row", "1,200 parts"]);
        assert_eq!(
            [0.0, 999.0, 1500.0, 2.5e7, 3e13, 2e20].map(bytes),
            ["0 B", "999 B", "1.5 kB", "25 MB", "30 TB", "200 EB"]
        );
        assert_eq!(
            [0.0123, 1.0, 90.0, 600.0, 1e5, 1e6, 1e9].map(duration),
            ["12.3 ms", "1 s", "90 s", "10 min", "27.8 h", "11.6 d", "31.7 years"]
        );
    }

    #[test]
    fn consecutive_numbers_are_ranges() {
        assert_eq!(ranges([0, 1, 2, 5, 7, 8]), "0-2,5,7-8");
        assert_eq!(ranges([]), "");
    }
}
