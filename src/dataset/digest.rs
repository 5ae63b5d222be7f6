//! A table read back from disk and told in a few numbers: how many rows of which status, ranges, and where a quantity is least.
//!
//! Parts are read one at a time, so the memory does not grow with the table.

use std::borrow::Cow;
use std::path::Path;

use super::folder::{Folder, ManifestTable};
use super::frame::{self, Cells, Frame, FrameError, Row};
use crate::grid::{Point, Quantity, Scale};
use crate::model::Units;
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
    /// Parts that are not there.
    pub missing: u64,
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

/// Why a table cannot be read back.
#[derive(Debug, thiserror::Error)]
#[error("{0}\n  help: delete the file and run the sweep again, which makes only what is missing")]
pub struct ReadError(#[from] FrameError);

impl Digest {
    /// Reads the parts of `table` that are there; its values are in `units`.
    pub fn read(folder: &Folder, table: &ManifestTable, units: &Units) -> Result<Digest, ReadError> {
        let there = folder.parts_there(table);
        let missing = table.parts - there.len() as u64;
        let mut digest = Digest::read_parts(folder, table, units, there)?;
        digest.missing += missing;
        Ok(digest)
    }

    /// Reads some parts of `table`.
    pub fn read_parts(
        folder: &Folder,
        table: &ManifestTable,
        units: &Units,
        parts: impl IntoIterator<Item = u64>,
    ) -> Result<Digest, ReadError> {
        let mut digest = Digest { rows: (table.rows <= FEW as u64).then(Vec::new), ..Digest::default() };
        let mut least = Least::default();
        for part in parts {
            let path = folder.part(&table.name, part);
            if !folder.has_part(&table.name, part) {
                digest.missing += 1;
                continue;
            }
            digest.add(&table.name, &path, units, &mut least)?;
        }
        digest.least = least.rows();
        Ok(digest)
    }

    fn add(&mut self, table: &str, path: &Path, units: &Units, least: &mut Least) -> Result<(), FrameError> {
        let prediction = table::find(table).and_then(|table| table.prediction());
        let columns = table::find(table).map_or(&[][..], |table| table.columns());
        let (headings, _) = frame::headings(path)?;
        let written = |name: &str| headings.iter().any(|heading| heading.name == name);
        let columns: Vec<&Column> = columns.iter().filter(|column| written(column.name)).collect();
        let with_gap = columns.iter().any(|column| column.name == GAP);
        // The axes are only needed to tell transitions apart: reading them all would take as long as reading the results.
        let keys = keys(table);
        let prediction = prediction.filter(|prediction| written(prediction.column));
        let axes = keys.iter().filter(|_| with_gap).chain(prediction.map_or(&[][..], |prediction| prediction.axes));
        let axes = axes.map(|axis| axis.name());
        let names: Vec<&str> = axes.chain(columns.iter().map(|column| column.name)).chain([STATUS]).collect();
        let frame = &frame::read(path, &names)?;
        for (word, rows) in count_words(frame, STATUS) {
            if let Some(status) = Status::ALL.iter().position(|status| status.name() == word) {
                self.status[status] += rows;
            }
        }
        for column in columns {
            match column.kind {
                Kind::Number(_) | Kind::Quantity(_) => self.add_numbers(frame, column.name),
                Kind::Label(_) | Kind::Flag => self.add_words(column.name, count_words(frame, column.name)),
            }
        }
        if let Some(prediction) = prediction {
            self.add_predictions(frame, &prediction, units);
        }
        if let Some(rows) = &mut self.rows {
            let whole = frame::read_all(path)?;
            rows.extend((0..whole.height).map(|row| whole.row(row)));
        }
        if with_gap {
            least.add(frame, path, &keys)?;
        }
        Ok(())
    }

    fn add_numbers(&mut self, frame: &Frame, name: &str) {
        let Some(Cells::Numbers(values)) = frame.column(name) else { return };
        let mut range = Range { column: name.to_owned(), count: 0, least: f64::INFINITY, greatest: f64::NEG_INFINITY };
        for &value in values.iter().filter(|value| !value.is_nan()) {
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
    }

    fn add_predictions(&mut self, frame: &Frame, prediction: &Prediction, units: &Units) {
        let axes: Vec<Cow<'_, [f64]>> = prediction.axes.iter().map(|axis| numbers(frame, *axis)).collect();
        let Some(Cells::Words(found, words)) = frame.column(prediction.column) else { return };
        let mut point = Point::default();
        for (row, place) in found.iter().enumerate() {
            let Some(word) = place.and_then(|place| words.get(place as usize)) else { continue };
            for (quantity, values) in prediction.axes.iter().zip(&axes) {
                let value = values.get(row).copied().unwrap_or(f64::NAN);
                point[*quantity] = units.scaled(quantity.unit(Scale::Model), value);
            }
            let predicted = (prediction.word)(&point);
            match self.predicted.iter_mut().find(|(p, f, _)| (*p, f) == (predicted, word)) {
                Some((.., rows)) => *rows += 1,
                None => self.predicted.push((predicted, word.clone(), 1)),
            }
        }
        self.predicted.sort();
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

/// The words of a column that occur, and how many rows have each.
fn count_words(frame: &Frame, name: &str) -> Vec<(String, u64)> {
    let Some(Cells::Words(places, words)) = frame.column(name) else { return Vec::new() };
    let mut counts = vec![0_u64; words.len()];
    for place in places.iter().flatten() {
        if let Some(count) = counts.get_mut(*place as usize) {
            *count += 1;
        }
    }
    words.iter().cloned().zip(counts).filter(|(_, count)| *count > 0).collect()
}

/// What tells rows apart for which a least gap each is of interest: the optimal problem, or the transition and the family.
fn keys(table: &str) -> Vec<Quantity> {
    let has_family = table::find(table).is_some_and(|table| table.axes().contains(&Quantity::Family));
    let (added, dropped) = (has_family.then_some(Quantity::Family), has_family.then_some(Quantity::Time));
    OPTIMUM_AXES.iter().copied().filter(|axis| Some(*axis) != dropped).chain(added).collect()
}

/// The column of an axis as numbers; of words, their places.
fn numbers(frame: &Frame, axis: Quantity) -> Cow<'_, [f64]> {
    match frame.column(axis.name()) {
        Some(Cells::Numbers(numbers)) => numbers.into(),
        Some(Cells::Words(places, words)) => {
            let known = |word: &String| axis.words().iter().position(|known| known == word);
            let codes: Vec<f64> = words.iter().map(|word| known(word).map_or(f64::NAN, |place| place as f64)).collect();
            let code = |place: &Option<u32>| place.and_then(|place| codes.get(place as usize).copied());
            places.iter().map(|place| code(place).unwrap_or(f64::NAN)).collect()
        }
        None => vec![f64::NAN; frame.height].into(),
    }
}

/// The least gap of each transition and time so far, while those are few, and of all.
#[derive(Default)]
struct Least {
    each: Vec<(Vec<u64>, f64, Row)>,
    many: bool,
    all: Option<(f64, Row)>,
}

impl Least {
    fn add(&mut self, frame: &Frame, path: &Path, keys: &[Quantity]) -> Result<(), FrameError> {
        let (Some(Cells::Numbers(gaps)), Some(Cells::Words(status, words))) = (frame.column(GAP), frame.column(STATUS))
        else {
            return Ok(());
        };
        let ok = words.iter().position(|word| word == Status::Ok.name()).map(|place| place as u32);
        let axes: Vec<Cow<'_, [f64]>> = keys.iter().map(|axis| numbers(frame, *axis)).collect();
        let family = keys.iter().position(|key| *key == Quantity::Family);
        let arrives = |index: usize| {
            family.is_none_or(|key| FAMILIES.get(axes[key][index] as usize).is_none_or(|family| family.arrives()))
        };
        // Within a part: the row of the least gap of each tuple, tuples in the order in which they come.
        let mut found: Vec<(usize, f64)> = Vec::new();
        let mut current = 0;
        let same = |a: usize, b: usize| axes.iter().all(|axis| axis[a].to_bits() == axis[b].to_bits());
        for (index, (&gap, &status)) in gaps.iter().zip(status).enumerate() {
            if gap.is_nan() || ok.is_none() || status != ok || !arrives(index) {
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
                self.all = Some((gap, frame::row(path, index)?));
            }
            match self.each.iter().position(|(known, ..)| *known == tuple) {
                Some(place) if gap < self.each[place].1 => self.each[place] = (tuple, gap, frame::row(path, index)?),
                Some(_) => {}
                None if self.each.len() < FEW => self.each.push((tuple, gap, frame::row(path, index)?)),
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
