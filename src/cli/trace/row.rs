//! The protocol of a row of a dataset.

use std::path::Path;

use super::description::{Named, si_name};
use super::{Arguments, Failure, Origin, TraceRequest, dataset, no_table, refused, wrong};
use crate::dataset::frame;
use crate::dataset::{Cell, Folder, Manifest, ManifestTable, Row};
use crate::grid::{Quantity, Scale};
use crate::model::{StateLaw, Units};
use crate::plot::table::{Condition, FilteredTable};
use crate::protocol::Status;
use crate::sweep::{Spec, friction, units};
use crate::table::{self, Table};
use crate::trace::{self, Pathless};
use crate::verify::{relative, scale};

impl Arguments {
    /// The protocol of a row of a table.
    pub(super) fn row_of(&self, name: &str) -> Result<TraceRequest, Failure> {
        let is_own =
            |flag: &&String| !matches!((flag.as_str(), name), ("--t-f", "step_response") | ("--disturb", "optimal"));
        if let Some(flag) = self.flags().iter().find(is_own) {
            let why = "not for a row of a dataset, which has its own parameters";
            return Err(wrong(format!("{flag}: {why}\n  help: remove {flag}")));
        }
        let path = Path::new(&self.subject);
        let (folder, manifest) = dataset(path)?;
        let Some(table) = manifest.table(name) else {
            let names: Vec<&str> = manifest.tables.iter().map(|table| table.name.as_str()).collect();
            return Err(no_table(&format!("{}: ", path.display()), name, &names));
        };
        if !trace::TABLES.contains(&name) {
            return Err(wrong(Pathless::Table(name.to_owned())));
        }
        let source = RowSource { path, folder: &folder, manifest: &manifest, table };
        let number = match self.row {
            Some(row) => row,
            None => source.only_row(&self.conditions)?,
        };
        let written = source.row(number)?;
        let spec = Spec::parse(&manifest.spec).map_err(Failure::failed)?;
        let units = units(&spec.model)?;
        let friction = friction(&spec.model)?;
        let relative = relative(&folder, table);
        let definition = table::find(name);
        let mut scaled = written.clone();
        if let Some(definition) = definition {
            scale(&mut scaled, definition, &units, relative);
        }
        let bounded = spec.model.velocity_bound;
        let t_f = self.t_f.map(|t_f| units.scaled(Quantity::Time.unit(Scale::Model), t_f));
        let (protocol_name, protocol, case) = trace::protocol_of(name, &scaled, (friction, bounded, relative), t_f)
            .map_err(|reason| wrong(format!("{}: row {number} of `{name}`: {reason}", path.display())))?;
        let mut numbers = axes_of(&written, &units);
        numbers.extend(self.t_f.map(|t_f| Named::new("t_f", t_f, units.name("l/v_0"))));
        let word = |key: &str| {
            let cell = written.iter().find(|(name, _)| name == key).map(|(_, cell)| cell);
            cell.and_then(|cell| if let Cell::Word(word) = cell { Some(word.as_str()) } else { None })
        };
        let law = word(Quantity::Law.name()).and_then(StateLaw::find);
        let status = Status::ALL.into_iter().find(|status| word(table::STATUS) == Some(status.name()));
        Ok(TraceRequest {
            bounded: trace::has_floor(name, friction).then_some(bounded),
            name: protocol_name,
            protocol,
            case,
            numbers,
            law,
            friction,
            rtol: self.rtol.unwrap_or_else(|| spec.rtol_of(name)),
            units,
            origin: Some(Origin {
                dataset: manifest.name.clone(),
                table: name.to_owned(),
                row: number,
                label: label_of(&written, definition),
                status,
            }),
        })
    }
}

/// The axes of a row that are finite numbers, with SI units if any. The coefficients of a cubic are parameters instead.
fn axes_of(row: &Row, units: &Units) -> Vec<Named> {
    let axis = |(name, cell): &(String, Cell)| {
        let quantity = Quantity::from_name(name).filter(|quantity| !quantity.has_scale())?;
        let Cell::Number(value) = cell else { return None };
        value.is_finite().then(|| Named::new(name, *value, si_name(units, quantity.unit(Scale::Model))))
    };
    row.iter().filter_map(axis).collect()
}

/// The labels of a row: its words that are neither an axis nor a column of the table.
fn label_of(row: &Row, table: Option<&Table>) -> String {
    let is_known = |name: &str| {
        let has = |table: &Table| table.columns().iter().any(|column| column.name == name);
        name == table::STATUS || Quantity::from_name(name).is_some() || table.is_some_and(has)
    };
    let word = |(name, cell): &(String, Cell)| match cell {
        Cell::Word(word) if !is_known(name) => Some(word.clone()),
        _ => None,
    };
    row.iter().filter_map(word).collect::<Vec<_>>().join(", ")
}

/// Greatest number of rows that a message names. Chosen: they fit on a line.
const MAX_NAMED_ROWS: usize = 5;

/// A table of the dataset in `path`.
struct RowSource<'a> {
    path: &'a Path,
    folder: &'a Folder,
    manifest: &'a Manifest,
    table: &'a ManifestTable,
}

impl RowSource<'_> {
    /// Reads a row from its part.
    fn row(&self, row: u64) -> Result<Row, Failure> {
        let RowSource { path, folder, manifest, table } = self;
        if row >= table.rows {
            let (path, last) = (path.display(), table.rows.saturating_sub(1));
            return Err(wrong(format!("{path}: no row {row} in `{}`\n  expected: a row from 0 to {last}", table.name)));
        }
        let part = row / table.rows_per_part.max(1);
        let verified = folder.verified_part(manifest, table, part).map_err(Failure::failed)?;
        let file = verified.ok_or_else(|| {
            let (file, help) = (folder.part(&table.name, part), "run the sweep again; it computes only missing parts");
            wrong(format!("{}: row {row} is in a part that is missing\n  help: {help}", file.display()))
        })?;
        let place = usize::try_from(row - table.rows_of(part).start).map_err(Failure::failed)?;
        frame::row(&file, place).map_err(Failure::failed)
    }

    /// The only row that meets all conditions.
    fn only_row(&self, conditions: &[String]) -> Result<u64, Failure> {
        let (at, name) = (self.path.display(), &self.table.name);
        if conditions.is_empty() {
            let expected = format!("--row N, from 0 to {}, or --where CONDITION", self.table.rows.saturating_sub(1));
            return Err(refused(format!("{at}: which row of `{name}`?"), expected, "add --row 0"));
        }
        let all = conditions.iter().map(|text| Condition::all(text)).collect::<Result<Vec<_>, _>>()?.concat();
        match self.rows(&all).as_slice() {
            [row] => Ok(*row),
            [] => Err(match FilteredTable::new(self.folder, self.manifest, name, &all) {
                Err(error) => error.into(),
                Ok(_) => Failure::failed(format!("{at}: the dataset has changed\n  help: repeat the command")),
            }),
            several => {
                let shown: Vec<String> = several.iter().take(MAX_NAMED_ROWS).map(u64::to_string).collect();
                let more = if several.len() > MAX_NAMED_ROWS { " and more" } else { "" };
                let what = format!("{at}: several rows of `{name}` meet --where {:?}", conditions.join(", "));
                let found = format!("{what}\n  found: rows {}{more}", shown.join(", "));
                Err(refused(found, "one row", format!("--row {}, or a further condition", several[0])))
            }
        }
    }

    /// The first rows that meet all conditions, more than [`MAX_NAMED_ROWS`] if there are more; none if a column of a condition cannot be read.
    fn rows(&self, conditions: &[Condition]) -> Vec<u64> {
        let names: Vec<&str> = conditions.iter().map(|condition| condition.column.as_str()).collect();
        let mut found = Vec::new();
        for part in self.folder.parts_there(self.table) {
            let Ok(frame) = frame::read(&self.folder.part(&self.table.name, part), &names) else { return Vec::new() };
            let meets = |row: &usize| {
                frame.columns.iter().zip(conditions).all(|((_, cells), condition)| condition.holds_in(cells, *row))
            };
            let first = self.table.rows_of(part).start;
            found.extend((0..frame.height).filter(meets).take(MAX_NAMED_ROWS + 1).map(|row| first + row as u64));
            if found.len() > MAX_NAMED_ROWS {
                break;
            }
        }
        found
    }
}
