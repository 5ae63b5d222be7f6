//! The content of a table: columns, axis values and selected rows.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use indexmap::IndexSet;

use super::condition::Condition;
use super::groups::Gridded;
use crate::dataset::frame::{self, Cells, Frame, Heading};
use crate::dataset::{Folder, Manifest};
use crate::grid::{Quantity, mixed};
use crate::names;
use crate::plot::{PlotError, label};
use crate::sweep::Spec;
use crate::table::{self, Kind, STATUS};

/// Greatest number of kept values of an axis; of more, the ends and a random sample of at least half as many. Chosen: 25 times the positions of
/// the finest picture, and a few megabytes.
pub const MAX_VALUES: usize = 100_000;

/// Greatest number of distinct labels of a column; columns with more are ignored. Chosen: more are not readable in a picture.
const MAX_LABELS: usize = 1000;

/// Greatest number of values that a message lists; of more, it states the least and the greatest. Chosen: two lines of a terminal.
const MAX_LISTED_VALUES: usize = 12;

/// Tables whose gap is the difference of two works.
const DIFFERENCES: [&str; 3] = ["gap", "shortcut", "compliant"];

/// The values of an axis in the selected rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The values in ascending order; for words, their indices.
    pub values: Vec<f64>,
    /// The words, if it has words.
    pub words: Vec<String>,
    /// Whether there are too many values to keep: these are the ends and a sample.
    pub many: bool,
    /// Whether some rows have an infinite value, which an axis cannot show.
    pub infinite: bool,
}

impl Values {
    /// Whether there is more than one.
    pub fn varies(&self) -> bool {
        self.values.len() > 1
    }

    /// The word of a value, if the axis has words.
    fn word(&self, value: f64) -> Option<&String> {
        self.words.get(value as usize).filter(|_| value >= 0.0)
    }

    /// Name and value in markup, with a unit; a word has no name.
    pub fn text_of(&self, value: f64) -> String {
        match self.word(value) {
            Some(word) => word.replace('_', " "),
            None => label::equation(&self.name, &label::number_among(value, &self.values), &self.unit),
        }
    }

    /// The values as typed by a user: all if they are few, else the least and the greatest.
    fn listed(&self) -> String {
        let infinite = self.infinite.then_some(f64::INFINITY);
        let typed: Vec<String> = self.values.iter().copied().chain(infinite).map(|value| self.typed(value)).collect();
        match typed.as_slice() {
            [first, .., last] if typed.len() > MAX_LISTED_VALUES => {
                format!("{} from {first} to {last}", self.name)
            }
            all => format!("{} = {}", self.name, all.join(", ")),
        }
    }

    /// A value as typed by a user: a word, if the column has words.
    fn typed(&self, value: f64) -> String {
        self.word(value).cloned().unwrap_or_else(|| format!("{value:?}").trim_end_matches(".0").to_owned())
    }
}

/// A table under conditions.
#[derive(Debug)]
pub struct FilteredTable {
    /// The name of the table.
    pub table: String,
    /// Its columns.
    pub headings: Vec<Heading>,
    /// Its axes.
    pub axes: Vec<Values>,
    /// Number of selected rows.
    pub rows: u64,
    /// Number of missing parts.
    pub missing: u64,
    /// Its labels that vary: text columns from the file of points, and their words.
    labels: Vec<(String, Vec<String>)>,
    /// The labels with one word in all selected rows, and this word.
    pub common_labels: Vec<(String, String)>,
    /// The varying axes with one value for each label.
    of_points: Vec<String>,
    /// The axes of the grid.
    pub gridded: Gridded,
    /// The gap below which rounding dominates: `rtol` where it is the difference of two works; 0 where it is computed without cancellation.
    pub least_gap: f64,
    parts: Vec<PathBuf>,
    conditions: Vec<Condition>,
}

impl FilteredTable {
    /// Surveys the present parts of the table `name` of the dataset in `folder`.
    ///
    /// # Errors
    ///
    /// A table, column or value that the dataset does not have, or a part that cannot be read.
    pub fn new(
        folder: &Folder,
        manifest: &Manifest,
        name: &str,
        conditions: &[Condition],
    ) -> Result<FilteredTable, PlotError> {
        let table = manifest.table(name).ok_or_else(|| {
            let known: Vec<String> = manifest.tables.iter().map(|table| table.name.clone()).collect();
            PlotError::unknown("the dataset has no table", name, &known)
        })?;
        let (parts, missing) = folder.verified(manifest, table)?;
        let first = parts.first().ok_or_else(|| PlotError::Empty { table: name.to_owned() })?;
        let (headings, _) = frame::headings(first)?;
        // The default for a damaged spec.
        let spec = Spec::parse(&manifest.spec).unwrap_or_default();
        let mut filtered = FilteredTable {
            table: name.to_owned(),
            headings,
            axes: Vec::new(),
            rows: 0,
            missing,
            labels: Vec::new(),
            common_labels: Vec::new(),
            of_points: Vec::new(),
            gridded: Gridded::of(&spec),
            least_gap: if DIFFERENCES.contains(&name) { spec.rtol_of(name) } else { 0.0 },
            parts,
            conditions: conditions.to_vec(),
        };
        for condition in conditions {
            filtered.check("--where", "column", &condition.column)?;
            let is_number = filtered.heading(&condition.column).is_some_and(|heading| heading.is_number);
            if is_number && !condition.is_of_number() {
                return Err(PlotError::Refused(format!(
                    "--where {}: the column `{}` has numbers\n  expected: a number without a unit, such as 0.03, 1e-6 or inf\n  help: correct \
                     the value",
                    condition.shown(),
                    condition.column
                )));
            }
            if let Some(Kind::Label(words)) = filtered.kind(&condition.column)
                && let Some(word) = condition.values.iter().find(|word| !words.contains(&word.as_str()))
            {
                let found = format!("--where {}: `{}` is never `{word}`", condition.shown(), condition.column);
                let (expected, help) = (words.join(", "), names::hint(word, words.iter().copied()));
                return Err(PlotError::Refused(format!("{found}\n  expected: {expected}\n  help: {help}")));
            }
        }
        let known = table::find(name).map_or(&[][..], |table| table.axes());
        let names = filtered.headings.iter().map(|heading| heading.name.as_str());
        let axes: Vec<&str> = names.filter(|name| known.iter().any(|axis| axis.name() == *name)).collect();
        (filtered.axes, filtered.rows) = filtered.values(&axes)?;
        match filtered.rows {
            0 if conditions.is_empty() => Err(PlotError::Empty { table: filtered.table }),
            0 => Err(filtered.without_rows()?),
            _ => {
                filtered.labels = filtered.read_labels()?;
                filtered.split_labels()?;
                Ok(filtered)
            }
        }
    }

    /// The labels and their words, except labels with too many words for a picture.
    fn read_labels(&self) -> Result<Vec<(String, Vec<String>)>, PlotError> {
        let is_label = |heading: &&Heading| {
            let name = heading.name.as_str();
            !heading.is_number && Quantity::from_name(name).is_none() && self.kind(name).is_none() && name != STATUS
        };
        let names: Vec<String> = self.headings.iter().filter(is_label).map(|heading| heading.name.clone()).collect();
        let mut labels: Vec<(String, Vec<String>)> = names.into_iter().map(|name| (name, Vec::new())).collect();
        let parts = if labels.is_empty() { &[] } else { self.parts.as_slice() };
        for part in parts {
            let names: Vec<&str> = labels.iter().map(|(name, _)| name.as_str()).collect();
            let frame = self.frame(part, &names)?;
            for ((_, all), (_, cells)) in labels.iter_mut().zip(&frame.columns) {
                let Cells::Words(_, words) = cells else { continue };
                for word in words {
                    if all.len() <= MAX_LABELS && !all.contains(word) {
                        all.push(word.clone());
                    }
                }
            }
        }
        labels.retain(|(_, words)| !words.is_empty() && words.len() <= MAX_LABELS);
        Ok(labels)
    }

    /// Sets the labels that all selected rows have in common apart, and finds the axes that depend on the others.
    fn split_labels(&mut self) -> Result<(), PlotError> {
        if self.labels.is_empty() {
            return Ok(());
        }
        let is_common = self.determined(&self.label_columns(), &[])?;
        let (found, _) = self.values(&self.label_columns())?;
        for ((label, found), is_common) in std::mem::take(&mut self.labels).into_iter().zip(found).zip(is_common) {
            match found.values.as_slice() {
                [word] if is_common => self.common_labels.push((label.0, label.1[*word as usize].clone())),
                [] => {}
                _ => self.labels.push(label),
            }
        }
        let varying = self.axes.iter().filter(|axis| axis.varies() && !self.labels.is_empty());
        let varying: Vec<&str> = varying.map(|axis| axis.name.as_str()).collect();
        let determined = self.determined(&varying, &self.label_columns())?;
        self.of_points =
            varying.into_iter().zip(determined).filter(|(_, is)| *is).map(|(name, _)| name.to_owned()).collect();
        Ok(())
    }

    /// Whether an axis varies, with one value for each label: it is one of the axes of labelled points.
    pub fn is_of_point(&self, axis: &str) -> bool {
        self.of_points.iter().any(|name| name == axis)
    }

    /// Whether rows are dots over an axis: it is one of labelled points, or of a file of points.
    pub fn is_of_dot(&self, axis: &str) -> bool {
        self.is_of_point(axis) || self.gridded.is_from_file(axis)
    }

    /// Whether a column is a label.
    pub fn is_label(&self, column: &str) -> bool {
        let common = self.common_labels.iter().map(|(name, _)| name);
        self.labels.iter().map(|(name, _)| name).chain(common).any(|name| name == column)
    }

    /// Columns of a part, without row groups whose statistics exclude the conditions.
    fn frame(&self, part: &Path, names: &[&str]) -> Result<Frame, PlotError> {
        let may_hold = |range: &dyn Fn(&str) -> Option<(f64, f64)>| {
            let holds = |condition: &Condition| {
                range(&condition.column).is_none_or(|(low, high)| condition.may_hold(low, high))
            };
            self.conditions.iter().all(holds)
        };
        Ok(frame::read_where(part, names, &may_hold)?)
    }

    /// The label of a group of rows, as [`FilteredTable::label`]; for empty cells, as in `no material`.
    pub fn label_of_group(&self, names: &[&str], cells: &[f64]) -> String {
        match (self.label(names, cells), names.first()) {
            (label, Some(name)) if label.is_empty() => format!("no {}", label::literal(name)),
            (label, _) => label,
        }
    }

    /// The words of the labels `names` in markup, from the cells of a row; empty for empty cells.
    pub fn label(&self, names: &[&str], cells: &[f64]) -> String {
        let word = |(label, cell): (&&str, &f64)| {
            let (_, words) = self.labels.iter().find(|(name, _)| name == label)?;
            Some(label::literal(words.get(*cell as usize).filter(|_| !cell.is_nan())?))
        };
        names.iter().zip(cells).filter_map(word).collect::<Vec<_>>().join(", ")
    }

    /// The labels that name a dot: one that determines all others, if there is one; without the label in the legend.
    pub fn names_of_dots(&self, legend: Option<&str>) -> Result<Vec<&str>, PlotError> {
        let mut names = self.label_columns();
        for label in self.label_columns() {
            if self.determined(&names, &[label])?.iter().all(|is| *is) {
                names = vec![label];
                break;
            }
        }
        names.retain(|name| Some(*name) != legend);
        Ok(names)
    }

    /// Drops all labels but `name`, if it is one that varies.
    pub fn keep_label(&mut self, name: &str) {
        if self.labels.iter().any(|(label, _)| label == name) {
            self.labels.retain(|(label, _)| label == name);
        }
    }

    /// The names of the labels that vary.
    pub fn label_columns(&self) -> Vec<&str> {
        self.labels.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// # Errors
    /// If there is no axis, or no column (`what`), of this name.
    pub fn check(&self, argument: &str, what: &str, name: &str) -> Result<(), PlotError> {
        let known: Vec<String> = match what {
            "axis" => self.axes.iter().map(|axis| axis.name.clone()).collect(),
            _ => self.headings.iter().map(|heading| heading.name.clone()).collect(),
        };
        if known.iter().any(|known| known == name) {
            return Ok(());
        }
        Err(PlotError::unknown(&format!("{argument}: the table `{}` has no {what}", self.table), name, &known))
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

    /// The kind of a column of the definition of the table.
    fn kind(&self, column: &str) -> Option<Kind> {
        let columns = table::find(&self.table)?.columns();
        columns.iter().find(|known| known.name == column).map(|known| known.kind)
    }

    /// The possible words of a column, in the order of their indices.
    pub fn words(&self, column: &str) -> Vec<String> {
        if let Some((_, words)) = self.labels.iter().find(|(name, _)| name == column) {
            return words.clone();
        }
        if let Some((_, word)) = self.common_labels.iter().find(|(name, _)| name == column) {
            return vec![word.clone()];
        }
        let words = match self.kind(column) {
            Some(Kind::Flag) => vec!["false", "true"],
            _ => table::vocabulary(&self.table, column),
        };
        words.into_iter().map(str::to_owned).collect()
    }

    /// Calls `visit` with the cells of `columns` for each row that meets the conditions: numbers, and indices of words in [`FilteredTable::words`]; NaN
    /// for null.
    pub fn each(&self, columns: &[&str], mut visit: impl FnMut(&[f64])) -> Result<(), PlotError> {
        self.each_while(columns, |row| {
            visit(row);
            true
        })
    }

    /// Calls `visit` for rows as [`FilteredTable::each`] does, until it returns `false`.
    pub fn each_while(&self, columns: &[&str], mut visit: impl FnMut(&[f64]) -> bool) -> Result<(), PlotError> {
        let tested = self.conditions.iter().map(|condition| condition.column.as_str());
        let names: IndexSet<&str> = columns.iter().copied().chain(tested).collect();
        let names: Vec<&str> = names.into_iter().collect();
        let mut row = Vec::with_capacity(columns.len());
        for part in &self.parts {
            let frame = self.frame(part, &names)?;
            let numbers = columns.iter().filter_map(|name| Some(self.numbers(name, frame.column(name)?)));
            let numbers: Vec<Cow<'_, [f64]>> = numbers.collect();
            let tests = self.conditions.iter().filter_map(|test| Some((test, frame.column(&test.column)?)));
            let tests: Vec<(&Condition, &Cells)> = tests.collect();
            for place in (0..frame.height).filter(|&row| tests.iter().all(|(test, cells)| test.holds_in(cells, row))) {
                row.clear();
                row.extend(numbers.iter().map(|column| column[place]));
                if !visit(&row) {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// Cells as numbers; for words, their indices in [`FilteredTable::words`].
    fn numbers<'a>(&self, column: &str, cells: &'a Cells) -> Cow<'a, [f64]> {
        match cells {
            Cells::Numbers(numbers) => Cow::Borrowed(numbers),
            Cells::Words(places, words) => {
                let all = self.words(column);
                let code = |word| all.iter().position(|known| known == word).map_or(f64::NAN, |place| place as f64);
                let codes: Vec<f64> = words.iter().map(code).collect();
                places.iter().map(|place| place.map_or(f64::NAN, |place| codes[place as usize])).collect()
            }
        }
    }

    /// The `axes` with a single value for each combination of `given`, which distinguish no rows. Empty if `given` have too many values.
    pub fn determined(&self, axes: &[&str], given: &[&str]) -> Result<Vec<bool>, PlotError> {
        let mut determined = vec![true; axes.len()];
        let mut known: HashMap<Vec<u64>, Vec<u64>> = HashMap::new();
        let columns: Vec<&str> = given.iter().chain(axes).copied().collect();
        self.each_while(&columns, |row| {
            let bits = bits(row);
            let (key, values) = bits.split_at(given.len());
            if let Some(before) = known.get(key) {
                for ((determined, before), value) in determined.iter_mut().zip(before).zip(values) {
                    *determined &= before == value;
                }
            } else if known.len() < MAX_VALUES {
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
        let mut known: HashMap<u64, [f64; 2]> = HashMap::new();
        let mut follows = true;
        self.each_while(&[x, y], |row| {
            let found = known.entry((row[0] + 0.0).to_bits()).or_insert([row[0], row[1]]);
            follows = found[1] == row[1] && known.len() <= MAX_VALUES;
            follows
        })?;
        let mut pairs: Vec<[f64; 2]> = known.into_values().collect();
        pairs.sort_by(|left, right| left[0].total_cmp(&right[0]));
        let in_order = |order: Ordering| pairs.windows(2).all(|pair| pair[0][1].total_cmp(&pair[1][1]) != order);
        Ok(follows && (in_order(Ordering::Greater) || in_order(Ordering::Less)))
    }

    /// The values of columns in the selected rows, and the number of these rows.
    pub fn values(&self, names: &[&str]) -> Result<(Vec<Values>, u64), PlotError> {
        let axis = |name: &&str| Values {
            name: (*name).to_owned(),
            unit: self.unit(name),
            values: Vec::new(),
            words: self.words(name),
            many: false,
            infinite: false,
        };
        let mut axes: Vec<Values> = names.iter().map(axis).collect();
        let mut distinct = vec![DistinctValues::default(); names.len()];
        let mut last = vec![f64::NAN; names.len()];
        let mut rows = 0;
        self.each(names, |row| {
            rows += 1;
            for (((&value, last), axis), distinct) in row.iter().zip(&mut last).zip(&mut axes).zip(&mut distinct) {
                if value.to_bits() == last.to_bits() {
                    continue;
                }
                *last = value;
                axis.infinite |= value.is_infinite();
                if value.is_finite() {
                    distinct.insert(value);
                }
            }
        })?;
        for (axis, DistinctValues { mut kept, ends, mask }) in axes.iter_mut().zip(distinct) {
            kept.extend(ends.into_iter().flatten().map(f64::to_bits));
            axis.many = mask > 0;
            axis.values = kept.into_iter().map(f64::from_bits).collect();
            axis.values.sort_by(f64::total_cmp);
        }
        Ok((axes, rows))
    }

    /// The error if no row meets the conditions: the values of their columns, and the nearest values.
    fn without_rows(mut self) -> Result<PlotError, PlotError> {
        let conditions = std::mem::take(&mut self.conditions);
        self.labels = self.read_labels()?;
        let mut names: Vec<&str> = conditions.iter().map(|condition| condition.column.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        let (columns, _) = self.values(&names)?;
        // A slightly different number may be intended.
        let near = |condition: &Condition| {
            let (wanted, axis) = (condition.wanted()?, self.axis(&condition.column)?);
            let column = columns.iter().find(|column| column.name == axis.name && !column.many)?;
            let off = |value: &f64| (value - wanted).abs();
            let nearest = column.values.iter().copied().min_by(|left, right| off(left).total_cmp(&off(right)))?;
            (axis.words.is_empty() && !condition.holds(nearest)).then_some(nearest)
        };
        let near: Vec<Option<f64>> = conditions.iter().map(near).collect();
        let meant = conditions.iter().find_map(|condition| {
            let (word, words) = (condition.word()?, self.words(&condition.column));
            let known = words.iter().any(|known| known == word);
            let meant = names::nearest(word, words.iter().map(String::as_str)).filter(|_| !known)?;
            Some(meant.to_owned())
        });
        let help = if let Some(meant) = meant {
            format!("did you mean `{meant}`?")
        } else if near.iter().any(Option::is_some) {
            let typed = conditions.iter().zip(near).map(|(condition, near)| condition.typed(near));
            format!("the nearest rows have --where \"{}\"", typed.collect::<Vec<_>>().join(", "))
        } else {
            "change the condition".to_owned()
        };
        let text = conditions.iter().map(Condition::shown).collect::<Vec<_>>().join(", ");
        let found = columns.iter().map(Values::listed).collect::<Vec<_>>().join("; ");
        Ok(PlotError::Refused(format!(
            "--where {text}: no row of the table `{}` meets this\n  found: {found}\n  help: {help}",
            self.table
        )))
    }
}

/// Distinct numbers: all, or the ends and those whose hashes are 0 where `mask` is 1, an even sample.
#[derive(Debug, Clone, Default)]
struct DistinctValues {
    kept: HashSet<u64>,
    ends: Option<[f64; 2]>,
    mask: u64,
}

impl DistinctValues {
    fn insert(&mut self, value: f64) {
        // -0 counts as 0.
        let value = value + 0.0;
        let [low, high] = self.ends.unwrap_or([value; 2]);
        self.ends = Some([low.min(value), high.max(value)]);
        if mixed(value.to_bits()) & self.mask == 0 {
            self.kept.insert(value.to_bits());
        }
        while self.kept.len() > MAX_VALUES {
            self.mask = 2 * self.mask + 1;
            self.kept.retain(|bits| mixed(*bits) & self.mask == 0);
        }
    }
}

/// The bits of numbers as a key, with one zero.
pub fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| (value + 0.0).to_bits()).collect()
}
