//! What is in a table: its columns, the values of its axes, and its rows, one after the other under conditions.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::PathBuf;

use super::condition::Condition;
use super::groups::Gridded;
use crate::dataset::frame::{self, Cells, Heading};
use crate::dataset::{Folder, Manifest, ReadError};
use crate::grid::Quantity;
use crate::names;
use crate::plot::{PlotError, label};
use crate::protocol::Status;
use crate::table::{self, Kind, STATUS};

/// Most different values of an axis that are told apart; beyond, an axis is a range.
const MOST_VALUES: usize = 100_000;

/// Most labels of a column: more are not read in a picture.
const MOST_LABELS: usize = 1000;

/// Most values of an axis that a message lists.
const FEW: usize = 12;

/// The values of an axis in the rows that are left.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// In ascending order; of words, their places.
    pub values: Vec<f64>,
    /// The words, if it has words.
    pub words: Vec<String>,
    /// Whether there are more values than are kept: these are the least and the greatest.
    pub many: bool,
    /// Whether some rows have an infinite value, which no axis shows.
    pub infinite: bool,
}

impl Values {
    /// Whether there is more than one.
    pub fn varies(&self) -> bool {
        self.values.len() > 1
    }

    /// A value as a reader sees it, in markup.
    pub fn shown(&self, value: f64) -> String {
        match self.words.get(value as usize) {
            Some(word) if value >= 0.0 => word.replace('_', " "),
            _ => label::number_among(value, &self.values),
        }
    }

    /// Name and value, in markup, with a unit of SI; a word speaks for itself.
    pub fn told(&self, value: f64) -> String {
        let shown = self.shown(value);
        if self.words.is_empty() { label::equation(&self.name, &shown, &self.unit) } else { shown }
    }
}

/// A table under conditions.
#[derive(Debug)]
pub struct Survey {
    /// The name of the table.
    pub table: String,
    /// Its columns.
    pub headings: Vec<Heading>,
    /// Its axes.
    pub axes: Vec<Values>,
    /// Rows that are left.
    pub rows: u64,
    /// Parts that are missing.
    pub missing: u64,
    /// Its labels: text columns that came with the points, and their words.
    pub labels: Vec<(String, Vec<String>)>,
    /// Which of the axes make up the grid.
    pub gridded: Gridded,
    parts: Vec<PathBuf>,
    conditions: Vec<Condition>,
}

impl Survey {
    /// Looks through the table `name` of the dataset in `folder`, as far as its parts are there.
    pub fn new(
        folder: &Folder,
        manifest: &Manifest,
        name: &str,
        conditions: &[Condition],
    ) -> Result<Survey, PlotError> {
        let found = || manifest.tables.iter().map(|table| table.name.clone()).collect();
        let table = manifest
            .tables
            .iter()
            .find(|table| table.name == name)
            .ok_or_else(|| PlotError::NoTable { name: name.to_owned(), found: found() })?;
        let (parts, missing) = folder.verified(manifest, table).map_err(ReadError::from)?;
        let first = parts.first().ok_or_else(|| PlotError::Empty { table: name.to_owned() })?;
        let (headings, _) = frame::headings(first).map_err(ReadError::from)?;
        let mut survey = Survey {
            table: name.to_owned(),
            headings,
            axes: Vec::new(),
            rows: 0,
            missing,
            labels: Vec::new(),
            gridded: Gridded::of(&manifest.spec),
            parts,
            conditions: conditions.to_vec(),
        };
        for condition in conditions {
            survey.check("--where", &condition.column)?;
        }
        survey.look()?;
        survey.look_for_labels()?;
        Ok(survey)
    }

    /// Finds the labels and their words, unless those are too many to be told apart in a picture.
    fn look_for_labels(&mut self) -> Result<(), PlotError> {
        let known = table::find(&self.table);
        let is_column =
            |name: &str| known.is_some_and(|table| table.columns().iter().any(|column| column.name == name));
        let is_label = |heading: &&Heading| {
            let name = heading.name.as_str();
            !heading.is_number && Quantity::from_name(name).is_none() && !is_column(name) && name != STATUS
        };
        let names: Vec<String> = self.headings.iter().filter(is_label).map(|heading| heading.name.clone()).collect();
        let mut labels: Vec<(String, Vec<String>)> = names.into_iter().map(|name| (name, Vec::new())).collect();
        let parts = if labels.is_empty() { &[] } else { self.parts.as_slice() };
        for part in parts {
            let names: Vec<&str> = labels.iter().map(|(name, _)| name.as_str()).collect();
            let frame = frame::read(part, &names).map_err(ReadError::from)?;
            for ((_, all), (_, cells)) in labels.iter_mut().zip(&frame.columns) {
                let Cells::Words(_, words) = cells else { continue };
                for word in words {
                    if all.len() <= MOST_LABELS && !all.contains(word) {
                        all.push(word.clone());
                    }
                }
            }
        }
        labels.retain(|(_, words)| !words.is_empty() && words.len() <= MOST_LABELS);
        self.labels = labels;
        Ok(())
    }

    /// The label of a row in markup, from the cells of the columns of labels.
    pub fn label(&self, cells: &[f64]) -> String {
        let word = |((_, words), cell): (&(String, Vec<String>), &f64)| {
            let word = words.get(*cell as usize).filter(|_| !cell.is_nan())?;
            Some(label::literal(word))
        };
        self.labels.iter().zip(cells).filter_map(word).collect::<Vec<_>>().join(", ")
    }

    /// The names of the columns of labels.
    pub fn label_columns(&self) -> Vec<&str> {
        self.labels.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// That a column is there.
    pub fn check(&self, argument: &str, column: &str) -> Result<&Heading, PlotError> {
        self.heading(column).ok_or_else(|| PlotError::NoColumn {
            argument: argument.to_owned(),
            table: self.table.clone(),
            what: "column",
            name: column.to_owned(),
            found: self.headings.iter().map(|heading| heading.name.clone()).collect(),
        })
    }

    /// The column of this name, if it was written.
    pub fn heading(&self, column: &str) -> Option<&Heading> {
        self.headings.iter().find(|heading| heading.name == column)
    }

    /// Whether a column was written.
    pub fn has(&self, column: &str) -> bool {
        self.heading(column).is_some()
    }

    /// The unit of a column.
    pub fn unit(&self, column: &str) -> String {
        self.heading(column).map_or_else(String::new, |heading| heading.unit.clone())
    }

    /// The axis of this name.
    pub fn axis(&self, name: &str) -> Option<&Values> {
        self.axes.iter().find(|axis| axis.name == name)
    }

    /// The words that a column may hold, in the order of their places.
    pub fn words(&self, column: &str) -> Vec<String> {
        let owned = |words: &[&str]| words.iter().map(|&word| word.to_owned()).collect();
        if let Some((_, words)) = self.labels.iter().find(|(name, _)| name == column) {
            return words.clone();
        }
        if column == STATUS {
            return Status::ALL.iter().map(|status| status.name().to_owned()).collect();
        }
        if let Some(quantity) = Quantity::from_name(column) {
            return owned(&quantity.words());
        }
        let columns = table::find(&self.table).map_or(&[][..], |table| table.columns());
        match columns.iter().find(|known| known.name == column).map(|known| known.kind) {
            Some(Kind::Label(words)) => owned(words),
            Some(Kind::Flag) => owned(&["no", "yes"]),
            _ => Vec::new(),
        }
    }

    /// Calls `visit` with the cells of `columns` for each row that fulfils the conditions: numbers, and the places of words in
    /// [`Survey::words`]; NaN where there is none.
    pub fn each(&self, columns: &[&str], mut visit: impl FnMut(&[f64])) -> Result<(), PlotError> {
        self.each_while(columns, |row| {
            visit(row);
            true
        })
    }

    /// The same until `visit` has seen enough, which it says by `false`.
    pub fn each_while(&self, columns: &[&str], visit: impl FnMut(&[f64]) -> bool) -> Result<(), PlotError> {
        self.each_of(&self.parts, columns, visit)
    }

    /// The same in some of the parts: of those that are skipped by the statistics of their columns nothing is read.
    fn each_of(
        &self,
        parts: &[PathBuf],
        columns: &[&str],
        mut visit: impl FnMut(&[f64]) -> bool,
    ) -> Result<(), PlotError> {
        let mut names: Vec<&str> = Vec::new();
        let mut place = |name| {
            names.iter().position(|known| *known == name).unwrap_or_else(|| {
                names.push(name);
                names.len() - 1
            })
        };
        let wanted: Vec<usize> = columns.iter().map(|&column| place(column)).collect();
        let tests: Vec<(usize, &Condition)> =
            self.conditions.iter().map(|condition| (place(condition.column.as_str()), condition)).collect();
        let mut cells = vec![f64::NAN; columns.len()];
        let may_hold = |range: &dyn Fn(&str) -> Option<(f64, f64)>| {
            let holds = |condition: &Condition| {
                range(&condition.column).is_none_or(|(low, high)| condition.may_hold(low, high))
            };
            self.conditions.iter().all(holds)
        };
        for part in parts {
            let frame = frame::read_where(part, &names, &may_hold).map_err(ReadError::from)?;
            // The places of the words of this part among all.
            let codes: Vec<Vec<f64>> = names
                .iter()
                .zip(&frame.columns)
                .map(|(name, (_, column))| match column {
                    Cells::Numbers(_) => Vec::new(),
                    Cells::Words(_, words) => {
                        let all = self.words(name);
                        let place = |word: &String| all.iter().position(|known| known == word);
                        words.iter().map(|word| place(word).map_or(f64::NAN, |place| place as f64)).collect()
                    }
                })
                .collect();
            let cell = |column: usize, row: usize| match &frame.columns[column].1 {
                Cells::Numbers(numbers) => numbers[row],
                Cells::Words(places, _) => {
                    places[row].and_then(|place| codes[column].get(place as usize)).copied().unwrap_or(f64::NAN)
                }
            };
            let holds = |(column, condition): &(usize, &Condition), row: usize| match &frame.columns[*column].1 {
                Cells::Numbers(numbers) => condition.holds(numbers[row]),
                Cells::Words(places, words) => {
                    condition.holds_word(places[row].and_then(|place| words.get(place as usize)).map(String::as_str))
                }
            };
            for row in 0..frame.height {
                if !tests.iter().all(|test| holds(test, row)) {
                    continue;
                }
                for (cell_out, &column) in cells.iter_mut().zip(&wanted) {
                    *cell_out = cell(column, row);
                }
                if !visit(&cells) {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// Which of `axes` have but one value wherever those of `given` are the same: such an axis tells no rows apart. None has, as far as
    /// is known, if `given` have too many values.
    pub fn determined(&self, axes: &[&str], given: &[&str]) -> Result<Vec<bool>, PlotError> {
        let mut determined = vec![true; axes.len()];
        let mut known: HashMap<Vec<u64>, Vec<u64>> = HashMap::new();
        let columns: Vec<&str> = given.iter().chain(axes).copied().collect();
        self.each_while(&columns, |row| {
            let bits: Vec<u64> = row.iter().map(|value| (value + 0.0).to_bits()).collect();
            let (key, values) = bits.split_at(given.len());
            if let Some(before) = known.get(key) {
                for ((determined, before), value) in determined.iter_mut().zip(before).zip(values) {
                    *determined &= before == value;
                }
            } else if known.len() < MOST_VALUES {
                known.insert(key.to_vec(), values.to_vec());
            } else {
                determined.fill(false);
            }
            determined.contains(&true)
        })?;
        Ok(determined)
    }

    /// Whether two axes rise or fall together: each value of `x` comes with one of `y`, in order.
    pub fn follows(&self, y: &str, x: &str) -> Result<bool, PlotError> {
        let mut known: BTreeMap<u64, f64> = BTreeMap::new();
        let mut follows = true;
        self.each_while(&[x, y], |row| {
            let found = *known.entry(ordered(row[0])).or_insert(row[1]);
            follows = found == row[1] && known.len() <= MOST_VALUES;
            follows
        })?;
        let values: Vec<f64> = known.into_values().collect();
        let in_order = |order: Ordering| values.windows(2).all(|pair| pair[0].total_cmp(&pair[1]) != order);
        Ok(follows && (in_order(Ordering::Greater) || in_order(Ordering::Less)))
    }

    /// Finds the axes and their values.
    fn look(&mut self) -> Result<(), PlotError> {
        let known = table::find(&self.table).map_or(&[][..], |table| table.axes());
        let is_axis = |heading: &&Heading| known.iter().any(|axis| axis.name() == heading.name);
        let names: Vec<String> = self.headings.iter().filter(is_axis).map(|heading| heading.name.clone()).collect();
        let columns: Vec<&str> = names.iter().map(String::as_str).collect();
        let mut found: Vec<(BTreeSet<u64>, f64)> = vec![(BTreeSet::new(), f64::NAN); columns.len()];
        let mut infinite = vec![false; columns.len()];
        let mut ranges = vec![(f64::INFINITY, f64::NEG_INFINITY); columns.len()];
        let mut rows = 0;
        let mut look = |cells: &[f64]| {
            rows += 1;
            for (place, &value) in cells.iter().enumerate() {
                let (values, last) = &mut found[place];
                if value.to_bits() == last.to_bits() {
                    continue;
                }
                *last = value;
                if value.is_finite() {
                    let range = &mut ranges[place];
                    *range = (range.0.min(value), range.1.max(value));
                    if values.len() <= MOST_VALUES {
                        values.insert(ordered(value));
                    }
                } else {
                    infinite[place] = true;
                }
            }
            true
        };
        // Parts without such a row are not read again.
        let mut parts = Vec::new();
        for part in &self.parts {
            let mut is_used = false;
            self.each_of(std::slice::from_ref(part), &columns, |cells| {
                is_used = true;
                look(cells)
            })?;
            parts.extend(is_used.then(|| part.clone()));
        }
        self.rows = rows;
        let mut axes = Vec::new();
        for (place, name) in names.iter().enumerate() {
            let many = found[place].0.len() > MOST_VALUES;
            let values = match ranges[place] {
                (low, high) if many => vec![low, high],
                _ => found[place].0.iter().map(|&bits| disordered(bits)).collect(),
            };
            let (unit, words) = (self.unit(name), self.words(name));
            axes.push(Values { name: name.clone(), unit, values, words, many, infinite: infinite[place] });
        }
        self.axes = axes;
        if rows == 0 && self.conditions.is_empty() {
            return Err(PlotError::Empty { table: self.table.clone() });
        }
        if rows == 0 {
            return Err(self.without_rows()?);
        }
        self.parts = parts;
        Ok(())
    }

    /// What to say where the conditions leave no row: the values that there are, and the nearest ones.
    fn without_rows(&mut self) -> Result<PlotError, PlotError> {
        self.look_for_labels()?;
        let conditions = std::mem::take(&mut self.conditions);
        let texts: Vec<String> = conditions.iter().map(Condition::shown).collect();
        let mut names: Vec<&str> = conditions.iter().map(|condition| condition.column.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        let mut values: Vec<(BTreeSet<u64>, f64, f64)> =
            vec![(BTreeSet::new(), f64::INFINITY, f64::NEG_INFINITY); names.len()];
        let wanted: Vec<Option<f64>> = conditions.iter().map(Condition::wanted).collect();
        let mut nearest = vec![f64::NAN; conditions.len()];
        let places: Vec<Option<usize>> =
            conditions.iter().map(|condition| names.iter().position(|name| *name == condition.column)).collect();
        self.each(&names, |cells| {
            for ((values, low, high), &cell) in values.iter_mut().zip(cells).filter(|(_, cell)| !cell.is_nan()) {
                (*low, *high) = (low.min(cell), high.max(cell));
                if values.len() <= FEW {
                    values.insert(ordered(cell));
                }
            }
            for ((nearest, wanted), place) in nearest.iter_mut().zip(&wanted).zip(&places) {
                let (Some(wanted), Some(place)) = (wanted, place) else { continue };
                if nearest.is_nan() || (cells[*place] - wanted).abs() < (*nearest - wanted).abs() {
                    *nearest = cells[*place];
                }
            }
        })?;
        let told = names.iter().zip(&values).map(|(name, (values, low, high))| {
            let words = self.words(name);
            if values.len() > FEW {
                return format!("{name} from {} to {}", plainly(&words, *low), plainly(&words, *high));
            }
            let values: Vec<String> = values.iter().map(|bits| plainly(&words, disordered(*bits))).collect();
            format!("{name} = {}", values.join(", "))
        });
        let found = told.collect::<Vec<_>>().join("; ");
        // A number that is only nearly that of a row may be meant.
        let offer = |(condition, nearest): (&Condition, &f64)| {
            let is_axis = self.axis(&condition.column).is_some_and(|axis| axis.words.is_empty());
            let other = (is_axis && nearest.is_finite() && !condition.holds(*nearest)).then_some(*nearest);
            (condition.typed(other), other.is_some())
        };
        let offers: Vec<(String, bool)> = conditions.iter().zip(&nearest).map(offer).collect();
        let is_offered = offers.iter().any(|(_, is_other)| *is_other);
        let typed: Vec<String> = offers.into_iter().map(|(text, _)| text).collect();
        let meant = conditions.iter().find_map(|condition| {
            let (word, words) = (condition.word()?, self.words(&condition.column));
            let known = words.iter().any(|known| known == word);
            let meant = names::nearest(word, words.iter().map(String::as_str)).filter(|_| !known)?;
            Some(meant.to_owned())
        });
        let help = if let Some(meant) = meant {
            format!("did you mean `{meant}`?")
        } else if is_offered {
            format!("the nearest rows have --where \"{}\"", typed.join(", "))
        } else {
            "change the condition".to_owned()
        };
        Ok(PlotError::NoRows { table: self.table.clone(), text: texts.join(", "), found, help })
    }
}

/// A value as it is typed: one of the words, if the column has words.
fn plainly(words: &[String], value: f64) -> String {
    match words.get(value as usize) {
        Some(word) if value >= 0.0 => word.clone(),
        _ => format!("{value:?}").trim_end_matches(".0").to_owned(),
    }
}

/// The bits of a number such that they are ordered as numbers are.
fn ordered(value: f64) -> u64 {
    // There is one zero.
    let bits = (value + 0.0).to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

fn disordered(bits: u64) -> f64 {
    f64::from_bits(if bits >> 63 == 1 { bits & !(1 << 63) } else { !bits })
}

#[cfg(test)]
mod tests {
    //! Bits in the order of numbers.

    use super::*;

    #[test]
    fn numbers_keep_their_order() {
        let numbers = [-1e300, -2.0, -1e-300, 0.0, 1e-300, 1.0, 2.0, 1e300];
        assert!(numbers.windows(2).all(|pair| ordered(pair[0]) < ordered(pair[1])));
        assert!(numbers.iter().all(|&number| disordered(ordered(number)) == number));
        assert_eq!(ordered(-0.0), ordered(0.0));
    }
}
