//! A table read back from disk and told in a few numbers: how many rows of which status, ranges, and where a quantity is least.
//!
//! Parts are read one at a time, so the memory does not grow with the table.

use std::fs::File;
use std::path::Path;

use polars::prelude::{DataFrame, Float64Chunked, NewChunkedArray, ParquetReader, PolarsError, SerReader};

use super::folder::{Folder, ManifestTable};
use crate::grid::{Point, Quantity};
use crate::protocol::Status;
use crate::protocol::swift::FAMILIES;
use crate::table::{self, Column, Kind, OPTIMUM_AXES, Prediction, STATUS};

/// Tables of at most this many rows are kept whole, and least values are told apart for at most this many transitions.
pub const FEW: usize = 12;

/// The column whose least values are looked for.
const GAP: &str = "gap";

/// What a table contains.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Digest {
    /// Rows by status, in the order of [`Status::ALL`].
    pub status: [u64; Status::ALL.len()],
    /// The columns of numbers after the axes.
    pub ranges: Vec<Range>,
    /// The columns of words: each word and its rows.
    pub words: Vec<(String, Vec<(String, u64)>)>,
    /// Where a simpler theory predicts a column of words: what it predicts, what was found, and in how many rows.
    pub predicted: Vec<(&'static str, String, u64)>,
    /// All rows, if they are few.
    pub rows: Option<Vec<Row>>,
    /// The row of least `gap` with status `ok`, of a protocol that arrives, of each transition and time, or the least of all if those are many.
    pub least: Vec<Row>,
}

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Range {
    /// Its name.
    pub column: String,
    /// Rows that have a value.
    pub count: u64,
    /// The least.
    pub least: f64,
    /// The greatest.
    pub greatest: f64,
}

/// One row: the names of its cells and what is in them.
pub type Row = Vec<(String, Cell)>;

/// A cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Null.
    Missing,
    /// A number.
    Number(f64),
    /// A word.
    Word(String),
}

/// Why a table cannot be read back.
#[derive(Debug, thiserror::Error)]
#[error(
    "{path}: cannot read back: {source}\n  help: delete the file and run the sweep again, which makes only what is missing"
)]
pub struct ReadError {
    path: String,
    source: PolarsError,
}

impl Digest {
    /// Reads all parts of `table`.
    pub fn read(folder: &Folder, table: &ManifestTable) -> Result<Digest, ReadError> {
        let mut digest = Digest { rows: (table.rows <= FEW as u64).then(Vec::new), ..Digest::default() };
        let mut least = Least::default();
        for part in 0..table.parts {
            let path = folder.part(&table.name, part);
            digest
                .add(&table.name, &path, &mut least)
                .map_err(|source| ReadError { path: path.display().to_string(), source })?;
        }
        digest.least = least.rows();
        Ok(digest)
    }

    fn add(&mut self, table: &str, path: &Path, least: &mut Least) -> Result<(), PolarsError> {
        let prediction = table::find(table).and_then(|table| table.prediction());
        let columns = table::find(table).map_or(&[][..], |table| table.columns());
        let mut reader = ParquetReader::new(File::open(path)?);
        let written = reader.schema()?;
        let columns: Vec<&Column> = columns.iter().filter(|column| written.contains(column.name)).collect();
        let with_gap = columns.iter().any(|column| column.name == GAP);
        // The axes are only needed to tell transitions apart: reading them all would take as long as reading the results.
        let keys = keys(table);
        let prediction = prediction.filter(|prediction| written.contains(prediction.column));
        let axes = keys.iter().filter(|_| with_gap).chain(prediction.map_or(&[][..], |prediction| prediction.axes));
        let axes = axes.map(|axis| axis.name());
        let names = axes.chain(columns.iter().map(|column| column.name)).chain([STATUS]).map(str::to_owned);
        let frame = &mut reader.with_columns(Some(names.collect())).finish()?;
        frame.rechunk_mut();
        for (word, rows) in count_words(frame, STATUS)? {
            if let Some(status) = Status::ALL.iter().position(|status| status.name() == word) {
                self.status[status] += rows;
            }
        }
        for column in columns {
            match column.kind {
                Kind::Number(_) | Kind::Quantity(_) => self.add_numbers(frame, column.name)?,
                Kind::Label(_) => {
                    let counts = count_words(frame, column.name)?;
                    self.add_words(column.name, counts);
                }
                Kind::Flag => {
                    let flags = frame.column(column.name)?.bool()?;
                    let count = |flag| flags.iter().flatten().filter(|&found| found == flag).count() as u64;
                    let counts = [(true, "yes"), (false, "no")].map(|(flag, word)| (word.to_owned(), count(flag)));
                    self.add_words(column.name, counts.into_iter().filter(|(_, rows)| *rows > 0).collect());
                }
            }
        }
        if let Some(prediction) = prediction {
            self.add_predictions(frame, &prediction)?;
        }
        if let Some(rows) = &mut self.rows {
            for index in 0..frame.height() {
                rows.push(row(path, index)?);
            }
        }
        if with_gap {
            least.add(frame, path, &keys)?;
        }
        Ok(())
    }

    fn add_numbers(&mut self, frame: &DataFrame, name: &str) -> Result<(), PolarsError> {
        let values = frame.column(name)?.f64()?;
        let mut range = Range { column: name.to_owned(), count: 0, least: f64::INFINITY, greatest: f64::NEG_INFINITY };
        for value in values.iter().flatten() {
            range.count += 1;
            range.least = range.least.min(value);
            range.greatest = range.greatest.max(value);
        }
        match self.ranges.iter_mut().find(|range| range.column == name) {
            Some(all) => {
                all.count += range.count;
                all.least = all.least.min(range.least);
                all.greatest = all.greatest.max(range.greatest);
            }
            None => self.ranges.push(range),
        }
        Ok(())
    }

    fn add_predictions(&mut self, frame: &DataFrame, prediction: &Prediction) -> Result<(), PolarsError> {
        let axes = prediction.axes.iter().map(|axis| numbers(frame, *axis)).collect::<Result<Vec<_>, _>>()?;
        let found = frame.column(prediction.column)?.cat32()?;
        let mut point = Point::default();
        for (row, code) in found.physical().iter().enumerate() {
            let Some(word) = code.and_then(|code| found.get_mapping().cat_to_str(code)) else { continue };
            for (quantity, values) in prediction.axes.iter().zip(&axes) {
                point[*quantity] = values.get(row).unwrap_or(f64::NAN);
            }
            let predicted = (prediction.word)(&point);
            match self.predicted.iter_mut().find(|(p, f, _)| (*p, f.as_str()) == (predicted, word)) {
                Some((.., rows)) => *rows += 1,
                None => self.predicted.push((predicted, word.to_owned(), 1)),
            }
        }
        self.predicted.sort();
        Ok(())
    }

    fn add_words(&mut self, name: &str, found: Vec<(String, u64)>) {
        let place = match self.words.iter().position(|(column, _)| column == name) {
            Some(place) => place,
            None => {
                self.words.push((name.to_owned(), Vec::new()));
                self.words.len() - 1
            }
        };
        let counts = &mut self.words[place].1;
        for (word, rows) in found {
            match counts.iter_mut().find(|(known, _)| *known == word) {
                Some((_, count)) => *count += rows,
                None => counts.push((word, rows)),
            }
        }
        counts.sort();
    }
}

/// The words of a column and how many rows have each.
fn count_words(frame: &DataFrame, name: &str) -> Result<Vec<(String, u64)>, PolarsError> {
    let words = frame.column(name)?.cat32()?;
    let mut counts: Vec<(u32, u64)> = Vec::new();
    let mut last = 0;
    for code in words.physical().iter().flatten() {
        if counts.get(last).is_none_or(|(known, _)| *known != code) {
            last = counts.iter().position(|(known, _)| *known == code).unwrap_or_else(|| {
                counts.push((code, 0));
                counts.len() - 1
            });
        }
        counts[last].1 += 1;
    }
    let word = |code| words.get_mapping().cat_to_str(code).unwrap_or_default().to_owned();
    Ok(counts.into_iter().map(|(code, rows)| (word(code), rows)).collect())
}

/// One row of a part, with all its columns.
fn row(path: &Path, index: usize) -> Result<Row, PolarsError> {
    let frame = ParquetReader::new(File::open(path)?).with_slice(Some((index, 1))).finish()?;
    frame
        .columns()
        .iter()
        .map(|column| {
            let cell = if let Some(numbers) = column.try_f64() {
                numbers.get(0).map(Cell::Number)
            } else if let Some(flags) = column.try_bool() {
                flags.get(0).map(|flag| Cell::Word(if flag { "yes" } else { "no" }.to_owned()))
            } else {
                let words = column.cat32()?;
                let word = words.physical().get(0).and_then(|code| words.get_mapping().cat_to_str(code));
                word.map(|word| Cell::Word(word.to_owned()))
            };
            Ok((column.name().to_string(), cell.unwrap_or(Cell::Missing)))
        })
        .collect()
}

/// What tells rows apart for which a least gap each is of interest: the optimal problem, or the transition and the family.
fn keys(table: &str) -> Vec<Quantity> {
    let has_family = table::find(table).is_some_and(|table| table.axes().contains(&Quantity::Family));
    let (added, dropped) = (has_family.then_some(Quantity::Family), has_family.then_some(Quantity::Time));
    OPTIMUM_AXES.iter().copied().filter(|axis| Some(*axis) != dropped).chain(added).collect()
}

/// The column of an axis as numbers; of words, their places.
fn numbers(frame: &DataFrame, axis: Quantity) -> Result<Float64Chunked, PolarsError> {
    let column = frame.column(axis.name())?;
    let words = axis.words();
    if words.is_empty() {
        return Ok(column.f64()?.clone());
    }
    let column = column.cat32()?;
    let place =
        |code| column.get_mapping().cat_to_str(code).and_then(|word| words.iter().position(|known| *known == word));
    let places = column.physical().iter().map(|code| code.and_then(place).map(|place| place as f64));
    Ok(Float64Chunked::from_iter_options(axis.name().into(), places))
}

/// The least gap of each transition and time so far, while those are few, and of all.
#[derive(Default)]
struct Least {
    each: Vec<(Vec<u64>, f64, Row)>,
    many: bool,
    all: Option<(f64, Row)>,
}

impl Least {
    fn add(&mut self, frame: &DataFrame, path: &Path, keys: &[Quantity]) -> Result<(), PolarsError> {
        let gaps = frame.column(GAP)?.f64()?;
        let status = frame.column(STATUS)?.cat32()?;
        let codes = status.physical();
        let ok = |code| status.get_mapping().cat_to_str(code) == Some(Status::Ok.name());
        let axes = keys.iter().map(|axis| numbers(frame, *axis)).collect::<Result<Vec<_>, _>>()?;
        let axes = axes.iter().map(|axis| axis.cont_slice()).collect::<Result<Vec<_>, _>>()?;
        let family = keys.iter().position(|key| *key == Quantity::Family);
        let arrives = |index: usize| {
            family.is_none_or(|key| FAMILIES.get(axes[key][index] as usize).is_none_or(|family| family.arrives()))
        };
        // Within a part: the row of the least gap of each tuple, tuples in the order in which they come.
        let mut found: Vec<(usize, f64)> = Vec::new();
        let mut current = 0;
        let same = |a: usize, b: usize| axes.iter().all(|axis| axis[a].to_bits() == axis[b].to_bits());
        for (index, (gap, code)) in gaps.iter().zip(codes.iter()).enumerate() {
            let (Some(gap), Some(code)) = (gap, code) else { continue };
            if !ok(code) || !arrives(index) {
                continue;
            }
            if found.get(current).is_none_or(|(other, _)| !same(*other, index)) {
                current = match found.iter().position(|(other, _)| same(*other, index)) {
                    Some(place) => place,
                    None if found.len() <= FEW => {
                        found.push((index, gap));
                        found.len() - 1
                    }
                    // Too many to tell apart: only the least of all counts from here on.
                    None => FEW,
                };
            }
            if gap < found[current].1 {
                found[current] = (index, gap);
            }
        }
        self.many |= found.len() > FEW;
        for (index, gap) in found {
            let tuple: Vec<u64> = axes.iter().map(|axis| axis[index].to_bits()).collect();
            if self.all.as_ref().is_none_or(|(least, _)| gap < *least) {
                self.all = Some((gap, row(path, index)?));
            }
            match self.each.iter().position(|(known, ..)| *known == tuple) {
                Some(place) if gap < self.each[place].1 => self.each[place] = (tuple, gap, row(path, index)?),
                Some(_) => {}
                None if self.each.len() < FEW => self.each.push((tuple, gap, row(path, index)?)),
                None => self.many = true,
            }
        }
        Ok(())
    }

    fn rows(self) -> Vec<Row> {
        if self.many {
            self.all.into_iter().map(|(_, row)| row).collect()
        } else {
            self.each.into_iter().map(|(_, _, row)| row).collect()
        }
    }
}
