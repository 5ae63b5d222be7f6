//! Statistics of a table: rows by status, ranges of columns, and rows of least gap.
//!
//! The statistics of a part are computed when it is encoded, and stored in its footer. Merged in any order, they give the statistics of the
//! table, so that a summary reads no rows.

use std::collections::BTreeMap;
use std::ops;

use arrow_schema::ArrowError;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use super::batch::batch;
use super::cell::{Cell, exact, first_row};
use super::footer::StatusCounts;
use super::layout::Layout;
use super::numbers;
use crate::grid::{Quantity, RowIndex, Scale, View};
use crate::protocol::Status;
use crate::protocol::shortcut::FAMILIES;
use crate::table::{ColumnBuffer, Kind, OPTIMUM_AXES};

/// Greatest number of rows of a table whose rows are all kept, and of transitions with separate least gaps. Chosen: they fit a screen.
pub const MAX_KEPT_ROWS: usize = 12;

/// The column whose least values are recorded.
const GAP: &str = "gap";

/// The statistics of some rows of a table.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TableStatistics {
    /// Rows by status, in the order of [`Status::ALL`].
    pub status: StatusCounts,
    /// All columns of the table: name and unit, empty for words.
    pub columns: Vec<(String, String)>,
    /// The columns of numbers after the axes.
    pub ranges: Vec<Range>,
    /// The columns of words after the axes: each word and its number of rows.
    pub words: Vec<(String, Counts)>,
    /// The labels: each word and its number of rows; `None` for more than [`MAX_KEPT_ROWS`] words.
    pub labels: Vec<(String, Option<Counts>)>,
    /// For a column with a prediction, the words found for each predicted word.
    pub predicted: BTreeMap<String, Counts>,
    /// All rows in their order, if the table has few.
    pub rows: Option<Vec<Row>>,
    /// The rows of least gap.
    least: LeastGaps,
}

/// Words and their numbers of rows.
pub type Counts = BTreeMap<String, u64>;

/// The values of a column.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Its name.
    pub column: String,
    /// Number of rows with a value.
    pub count: u64,
    /// The least value.
    #[serde(with = "exact")]
    pub least: f64,
    /// The greatest value.
    #[serde(with = "exact")]
    pub greatest: f64,
}

/// A row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Its number in the table.
    pub number: u64,
    /// Its cells, one for each column.
    pub cells: Vec<Cell>,
}

/// The rows of least gap with status `ok`, of protocols that reach the final state.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct LeastGaps {
    /// Whether there are too many transitions for separate least gaps: then only the least of all is recorded.
    many: bool,
    /// One for each transition and duration, in the order of their first rows.
    each: Vec<LeastGapRow>,
}

/// A row of least gap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct LeastGapRow {
    /// The first row of its transition and duration with status `ok`.
    first: u64,
    row: Row,
}

impl TableStatistics {
    /// The statistics of `rows`, whose cells are in `buffer`.
    ///
    /// # Errors
    ///
    /// If the buffer does not fit the layout.
    pub fn of(
        layout: &Layout,
        row_index: &RowIndex,
        rows: ops::Range<u64>,
        buffer: &ColumnBuffer,
    ) -> Result<TableStatistics, ArrowError> {
        let unit = |field: &arrow_schema::FieldRef| field.metadata().get("unit").cloned().unwrap_or_default();
        let fields = layout.schema.fields().iter();
        let mut statistics = TableStatistics {
            columns: fields.map(|field| (field.name().clone(), unit(field))).collect(),
            ..TableStatistics::default()
        };
        buffer.status.iter().for_each(|status| statistics.status[*status as usize] += 1);
        for (column, cells) in layout.columns.iter().zip(&buffer.columns) {
            match column.kind {
                Kind::Number(_) | Kind::Quantity(_) => statistics.ranges.push(Range::of(column.name, cells)),
                Kind::Label(words) => statistics.words.push((column.name.to_owned(), counts(words, cells))),
                Kind::Flag => statistics.words.push((column.name.to_owned(), counts(&["false", "true"], cells))),
            }
        }
        let view = row_index.view(rows.clone());
        let labels = layout.labels.iter().map(|name| (name.clone(), labelled(&view.label(name, rows.clone()))));
        statistics.labels = labels.collect();
        statistics.predicted = predicted(layout, &view, &rows, buffer);
        let row_at = |place: usize| row(layout, row_index, rows.start + place as u64, buffer, place);
        if row_index.rows() <= MAX_KEPT_ROWS as u64 {
            statistics.rows = Some((0..buffer.status.len()).map(row_at).collect::<Result<_, _>>()?);
        }
        let (many, found) = least(layout, &view, &rows, buffer);
        let least_row = |(first, place)| Ok(LeastGapRow { first: rows.start + first as u64, row: row_at(place)? });
        let each = found.into_iter().map(least_row).collect::<Result<_, ArrowError>>()?;
        statistics.least = LeastGaps { many, each };
        Ok(statistics)
    }

    /// The statistics of both sets of rows. The order and grouping of merges do not matter.
    pub fn merge(mut self, other: TableStatistics) -> TableStatistics {
        if self.columns.is_empty() {
            return other;
        }
        if other.columns.is_empty() {
            return self;
        }
        self.status.iter_mut().zip(other.status).for_each(|(sum, count)| *sum += count);
        for (range, other) in self.ranges.iter_mut().zip(&other.ranges) {
            range.count += other.count;
            range.least = range.least.min(other.least);
            range.greatest = range.greatest.max(other.greatest);
        }
        for ((_, counts), (_, others)) in self.words.iter_mut().zip(other.words) {
            add(counts, others);
        }
        for ((_, counts), (_, others)) in self.labels.iter_mut().zip(other.labels) {
            *counts = counts.take().zip(others).and_then(|(mut counts, others)| {
                add(&mut counts, others);
                (counts.len() <= MAX_KEPT_ROWS).then_some(counts)
            });
        }
        for (predicted, found) in other.predicted {
            add(self.predicted.entry(predicted).or_default(), found);
        }
        if let (Some(rows), Some(others)) = (&mut self.rows, other.rows) {
            rows.extend(others);
            rows.sort_by_key(|row| row.number);
        }
        self.least = self.least.merge(other.least, &self.columns);
        self
    }

    /// The row of least gap of each transition and duration, with status `ok` and of a protocol that reaches the final state; only the least of
    /// all if there are many.
    pub fn least(&self) -> impl Iterator<Item = &Row> {
        self.least.each.iter().map(|candidate| &candidate.row)
    }

    /// The unit of a column; empty for words.
    pub fn unit(&self, column: &str) -> &str {
        self.columns.iter().find(|(name, _)| name == column).map_or("", |(_, unit)| unit)
    }
}

impl Row {
    /// The cell of a column.
    pub fn cell(&self, place: usize) -> &Cell {
        self.cells.get(place).unwrap_or(&Cell::Missing)
    }
}

impl Range {
    fn of(column: &str, cells: &[f64]) -> Range {
        let count = cells.iter().filter(|cell| !cell.is_nan()).count() as u64;
        let (least, greatest) = numbers::range(cells);
        // Of two zeros, the sign would depend on the order.
        Range { column: column.to_owned(), count, least: least + 0.0, greatest: greatest + 0.0 }
    }
}

/// Adds the rows of other words.
fn add(counts: &mut Counts, others: Counts) {
    others.into_iter().for_each(|(word, rows)| *counts.entry(word).or_default() += rows);
}

/// The words of a label in these runs and their numbers of rows; `None` if there are more than [`MAX_KEPT_ROWS`].
fn labelled(runs: &[(Option<&str>, usize)]) -> Option<Counts> {
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for (word, rows) in runs.iter().filter_map(|(word, rows)| Some(((*word)?, *rows))) {
        *counts.entry(word).or_default() += rows as u64;
        if counts.len() > MAX_KEPT_ROWS {
            return None;
        }
    }
    Some(counts.into_iter().map(|(word, rows)| (word.to_owned(), rows)).collect())
}

/// The counts of words among `cells`, which are indices into `words`.
fn counts(words: &[&str], cells: &[f64]) -> Counts {
    let mut counts = vec![0_u64; words.len()];
    for cell in cells.iter().filter(|cell| !cell.is_nan()) {
        if let Some(count) = counts.get_mut(*cell as usize) {
            *count += 1;
        }
    }
    let words = words.iter().map(|word| (*word).to_owned());
    words.zip(counts).filter(|(_, count)| *count > 0).collect()
}

fn predicted(
    layout: &Layout,
    view: &View<'_>,
    rows: &ops::Range<u64>,
    buffer: &ColumnBuffer,
) -> BTreeMap<String, Counts> {
    let mut counted: BTreeMap<String, Counts> = BTreeMap::new();
    let Some(prediction) = &layout.prediction else { return counted };
    let column = layout.columns.iter().zip(&buffer.columns).find(|(column, _)| column.name == prediction.column);
    let Some((Kind::Label(words), cells)) = column.map(|(column, cells)| (column.kind, cells)) else { return counted };
    for (row, cell) in rows.clone().zip(cells).filter(|(_, cell)| !cell.is_nan()) {
        let Some(found) = words.get(*cell as usize) else { continue };
        let mut point = view.point(row);
        for axis in prediction.axes {
            point[*axis] = layout.units.scaled(axis.unit(Scale::Model), point[*axis]);
        }
        let of_predicted = counted.entry((prediction.word)(&point).to_owned()).or_default();
        *of_predicted.entry((*found).to_owned()).or_default() += 1;
    }
    counted
}

/// The key of a least gap: the optimal problem, or the transition and the family.
fn is_key(name: &str, has_family: bool) -> bool {
    let axis = if has_family { Quantity::Time } else { Quantity::Family };
    name != axis.name() && (name == Quantity::Family.name() || OPTIMUM_AXES.iter().any(|axis| axis.name() == name))
}

/// The first row of `stretch` with status `ok`, and the row of least gap.
fn least_in(stretch: ops::Range<usize>, gaps: &[f64], status: &[Status]) -> Option<(usize, usize)> {
    let mut rows = stretch.filter(|&row| status[row] == Status::Ok && !gaps[row].is_nan());
    let first = rows.next()?;
    Some((first, rows.fold(first, |least, row| if gaps[row] < gaps[least] { row } else { least })))
}

/// Whether there are many transitions; and for each, or for all if there are many, the first row with status `ok` and the row of least gap, as
/// indices in `buffer`.
fn least(
    layout: &Layout,
    view: &View<'_>,
    rows: &ops::Range<u64>,
    buffer: &ColumnBuffer,
) -> (bool, Vec<(usize, usize)>) {
    let gaps = layout.columns.iter().zip(&buffer.columns).find(|(column, _)| column.name == GAP);
    let Some((_, gaps)) = gaps else { return (false, Vec::new()) };
    let has_family = layout.axes.contains(&Quantity::Family);
    let keys = layout.axes.iter().filter(|axis| is_key(axis.name(), has_family));
    let keys: Vec<_> = keys.filter_map(|axis| Some((*axis, view.runs(*axis, rows.clone())?))).collect();
    // The current run of every key: its value and its end.
    let mut runs: Vec<_> = keys.iter().map(|(_, runs)| (runs.over(rows.clone()), f64::NAN, 0)).collect();
    let family = keys.iter().position(|(axis, _)| *axis == Quantity::Family);
    // The first row and the row of least gap by the values of the keys.
    let (mut many, mut found) = (false, IndexMap::<Vec<u64>, (usize, usize)>::new());
    let mut place = 0;
    while place < buffer.status.len() {
        let mut end = buffer.status.len();
        for ((_, values), (run, value, stop)) in keys.iter().zip(&mut runs) {
            if *stop <= place
                && let Some((step, length)) = run.next()
            {
                (*value, *stop) = (values.values()[step], place + length);
            }
            end = end.min((*stop).max(place + 1));
        }
        let stretch = place..end;
        place = end;
        let member = family.and_then(|family| FAMILIES.get(runs[family].1 as usize));
        if member.is_some_and(|member| !member.arrives) {
            continue;
        }
        let Some((first, least)) = least_in(stretch, gaps, &buffer.status) else { continue };
        let key = if many { Vec::new() } else { runs.iter().map(|(_, value, _)| value.to_bits()).collect() };
        let (_, known) = found.entry(key).or_insert((first, least));
        if gaps[least] < gaps[*known] {
            *known = least;
        }
        if found.len() > MAX_KEPT_ROWS {
            many = true;
            let rank = |row: usize| (gaps[row], row);
            let best = found.drain(..).map(|(_, (_, least))| least);
            let best = best.reduce(|one, other| if rank(other) < rank(one) { other } else { one });
            found.extend(best.map(|best| (Vec::new(), (best, best))));
        }
    }
    // Without distinction, the first row is the row of least gap.
    let rows = found.into_values().map(|(first, least)| if many { (least, least) } else { (first, least) });
    (many, rows.collect())
}

/// Row number `number` of the table, whose cells are at index `place` of `buffer`.
fn row(
    layout: &Layout,
    row_index: &RowIndex,
    number: u64,
    buffer: &ColumnBuffer,
    place: usize,
) -> Result<Row, ArrowError> {
    let columns = buffer.columns.iter().map(|column| vec![column[place]]).collect();
    let single = ColumnBuffer { columns, status: vec![buffer.status[place]] };
    Ok(Row { number, cells: first_row(&batch(layout, row_index, number..number + 1, single)?) })
}

impl LeastGaps {
    fn merge(mut self, other: LeastGaps, columns: &[(String, String)]) -> LeastGaps {
        let place = |name: &str| columns.iter().position(|(column, _)| column == name);
        let Some(gap) = place(GAP) else { return self };
        let value = |row: &Row| row.cell(gap).number().unwrap_or(f64::INFINITY);
        // Of equal gaps, the first row counts.
        let is_less = |one: &Row, other: &Row| {
            value(one) < value(other) || (value(one) == value(other) && one.number < other.number)
        };
        let has_family = place(Quantity::Family.name()).is_some();
        let keys = (0..columns.len()).filter(|&place| is_key(&columns[place].0, has_family));
        let keys: Vec<usize> = keys.collect();
        let is_same = |one: &Row, other: &Row| keys.iter().all(|&key| one.cell(key).is_same(other.cell(key)));
        self.many |= other.many;
        for candidate in other.each {
            match self.each.iter_mut().find(|known| is_same(&known.row, &candidate.row)) {
                Some(known) => {
                    known.first = known.first.min(candidate.first);
                    if is_less(&candidate.row, &known.row) {
                        known.row = candidate.row;
                    }
                }
                None => self.each.push(candidate),
            }
        }
        self.many |= self.each.len() > MAX_KEPT_ROWS;
        if self.many {
            let least =
                self.each.into_iter().reduce(|one, other| if is_less(&other.row, &one.row) { other } else { one });
            self.each = least.map(|least| LeastGapRow { first: least.row.number, ..least }).into_iter().collect();
        }
        self.each.sort_by_key(|candidate| candidate.first);
        self
    }
}
