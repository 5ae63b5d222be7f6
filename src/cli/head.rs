//! `slipsweep head DATASET [TABLE]`: the first rows of a table, with units.

use std::path::PathBuf;

use console::Term;

#[cfg(feature = "query")]
use super::query::unreadable;
use super::{Failure, kind, no_table, note, note_rebuilt, say, summary, whole, words};
use crate::protocol::Status;
#[cfg(feature = "query")]
use crate::query::{Source, Tables};
use crate::table;

/// Arguments of `head`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep head results/granite
  slipsweep head results/granite gap -n 20")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME; or a Parquet or CSV file
    dataset: PathBuf,
    /// Table; all by default
    table: Option<String>,
    /// Number of rows
    #[arg(short = 'n', long, allow_negative_numbers = true, value_name = "N", default_value_t = 10, value_parser = whole::<u32>(0, u32::MAX.into()))]
    rows: u32,
}

/// The first rows of a table.
struct Head {
    name: String,
    /// Names, units if there are any, and rows.
    lines: Vec<Vec<String>>,
    /// All rows, where they are counted.
    rows: Option<u64>,
    /// Missing parts.
    missing: u64,
}

/// Prints the first rows of one table or of all tables.
///
/// # Errors
///
/// A path without tables, or a part that cannot be read.
pub fn head(arguments: &Arguments) -> Result<(), Failure> {
    kind::expect_rows(&arguments.dataset)?;
    note_rebuilt(&arguments.dataset);
    let width = Term::stdout().size_checked().map(|(_, columns)| columns.into());
    let (mut texts, mut failure) = (Vec::new(), None);
    for head in heads(arguments)? {
        match head {
            Ok(head) => texts.push(head.text(arguments, width)),
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    if !texts.is_empty() {
        say(&texts.join("\n"))?;
    }
    failure.map_or(Ok(()), Err)
}

/// The first rows of tables of a dataset or of a file.
#[cfg(feature = "query")]
fn heads(arguments: &Arguments) -> Result<Vec<Result<Head, Failure>>, Failure> {
    let tables = Tables::open(&arguments.dataset)?;
    let Tables { sources, absent } = &tables;
    let names = sources.iter().map(|source| &source.name).chain(absent.iter().map(|table| &table.name));
    let wanted = chosen(arguments, &names.map(String::as_str).collect::<Vec<_>>())?;
    let first = |source: &Source| {
        let answer = tables.query(&format!("SELECT * FROM \"{}\" LIMIT {}", source.name, arguments.rows))?;
        let mut lines = words::headed(answer.columns.clone(), answer.units.clone(), Vec::new());
        let first = answer.rows(|rows| {
            lines.extend(rows.iter().map(|row| row.iter().map(summary::shown).collect()));
            Ok(())
        });
        first.map_err(|error| unreadable(&arguments.dataset, &error))?;
        Ok(Head { name: source.name.clone(), lines, rows: source.rows, missing: source.missing })
    };
    Ok(wanted
        .into_iter()
        .filter_map(|place| match sources.get(place) {
            Some(source) => Some(first(source)),
            None => {
                let table = &absent[place - sources.len()];
                if arguments.table.is_none() && table.fault.is_none() {
                    note(format!("`{}` has no parts yet; `slipsweep run` computes them", table.name));
                    return None;
                }
                Some(Err(table.error().into()))
            }
        })
        .collect())
}

/// The first rows of the tables of a dataset, each from its first part.
#[cfg(not(feature = "query"))]
fn heads(arguments: &Arguments) -> Result<Vec<Result<Head, Failure>>, Failure> {
    use crate::dataset::frame;

    let (folder, manifest) = super::dataset(&arguments.dataset)?;
    let names: Vec<&str> = manifest.tables.iter().map(|table| table.name.as_str()).collect();
    let first = |place: usize| {
        let table = &manifest.tables[place];
        let (paths, missing) = folder.verified(&manifest, table).map_err(Failure::failed)?;
        let Some(first) = paths.first() else {
            note(format!("`{}` has no parts yet; `slipsweep run` computes them", table.name));
            return Ok(None);
        };
        let headings = frame::headings(first).map_err(Failure::failed)?.0;
        let frame = frame::read_all(first).map_err(Failure::failed)?;
        let cells = |row: usize| frame.row(row).iter().map(|(_, cell)| summary::shown(cell)).collect();
        let (names, units) = headings.into_iter().map(|heading| (heading.name, heading.unit)).unzip();
        let lines = words::headed(names, units, (0..frame.height).take(arguments.rows as usize).map(cells).collect());
        Ok(Some(Head { name: table.name.clone(), lines, rows: Some(table.rows), missing }))
    };
    Ok(chosen(arguments, &names)?.into_iter().filter_map(|place| first(place).transpose()).collect())
}

/// The places of the requested tables among `names`.
fn chosen(arguments: &Arguments, names: &[&str]) -> Result<Vec<usize>, Failure> {
    let Some(name) = &arguments.table else { return Ok((0..names.len()).collect()) };
    let place = names.iter().position(|known| known == name);
    place.map(|place| vec![place]).ok_or_else(|| no_table(&format!("{}: ", arguments.dataset.display()), name, names))
}

/// Replaces the middle columns of `lines` by `…` if they are wider than `width` characters, and returns their number.
fn hide_middle(lines: &mut [Vec<String>], width: usize) -> usize {
    let count = lines.first().map_or(0, Vec::len);
    let cell = |line: &Vec<String>, place: usize| line.get(place).map_or(0, |cell| cell.chars().count());
    let widths: Vec<usize> =
        (0..count).map(|place| 2 + lines.iter().map(|line| cell(line, place)).max().unwrap_or(0)).collect();
    if widths.iter().sum::<usize>() <= width + 2 {
        return 0;
    }
    // From both ends in turn, since the axes are first and the status is last. The mark takes one character.
    let (mut room, mut first, mut last) = (width.saturating_sub(1), 0, count);
    while first < last {
        let is_first = first <= count - last;
        let place = if is_first { first } else { last - 1 };
        if widths[place] > room {
            break;
        }
        room -= widths[place];
        if is_first { first += 1 } else { last -= 1 }
    }
    lines.iter_mut().for_each(|line| _ = line.splice(first..last, ["…".to_owned()]));
    last - first
}

impl Head {
    /// Whether all rows that are shown are infeasible. The status is the last column.
    fn is_infeasible(&self) -> bool {
        let mut words = self.lines.iter().skip(2).filter_map(|line| line.last()).peekable();
        words.peek().is_some() && words.all(|word| word == Status::Infeasible.name())
    }

    /// A line on the table, then names, units and rows, which a terminal shows in `width` characters.
    fn text(mut self, arguments: &Arguments, width: Option<usize>) -> String {
        let mut text = self.name.clone();
        if let Some(rows) = self.rows {
            let meaning = table::find(&self.name).map(|table| format!("{}; ", table.doc())).unwrap_or_default();
            text.push_str(&format!(": {meaning}{}", words::things(rows, "row")));
            if self.missing > 0 {
                text.push_str(&format!("; {} missing", words::things(self.missing, "part")));
            }
        }
        text.push('\n');
        let is_infeasible = self.is_infeasible();
        let hidden = width.map_or(0, |width| hide_middle(&mut self.lines, width.saturating_sub(2)));
        text.push_str(&words::aligned(&self.lines, 2));
        let (path, name) = (arguments.dataset.display(), &self.name);
        if hidden > 0 {
            let columns = words::things(hidden as u64, "more column");
            text.push_str(&format!("  {columns}: slipsweep head {path} {name} | less -S\n"));
        }
        if is_infeasible {
            let (sql, rows) = (format!("SELECT * FROM {name} WHERE status = 'ok'"), arguments.rows);
            text.push_str(&format!("  rows with numbers, if any: slipsweep query {path} \"{sql} LIMIT {rows}\"\n"));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    //! Wide tables on a terminal.

    use super::*;

    #[test]
    fn the_middle_columns_are_hidden() {
        let line = || ["t_f", "work", "gap", "v_min", "status"].map(str::to_owned).to_vec();
        let shown = |width| {
            let mut lines = vec![line()];
            let hidden = hide_middle(&mut lines, width);
            (hidden, words::aligned(&lines, 0))
        };
        assert_eq!(shown(29), (0, "t_f  work  gap  v_min  status\n".to_owned()));
        assert_eq!(shown(28), (1, "t_f  work  …  v_min  status\n".to_owned()));
        assert_eq!(shown(26), (2, "t_f  work  …  status\n".to_owned()));
        assert_eq!(shown(1), (5, "…\n".to_owned()));
    }
}
