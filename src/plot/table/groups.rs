//! The groups of a table: combinations of the axes that are not drawn in a panel. Each group makes a panel or a line.

use std::cmp::Ordering;
use std::collections::HashMap;

use super::filtered::{FilteredTable, Values, bits};
use indexmap::{IndexMap, IndexSet};

use crate::grid::Quantity;
use crate::plot::colour::MAX_SERIES;
use crate::plot::{Figure, PlotError, label};
use crate::protocol::shortcut::FAMILIES;
use crate::sweep::{AxisForm, AxisSpec, BlockSpec, Spec};

/// Greatest number of groups; with more, all rows are one group. Chosen: far more than a picture shows.
const MAX_GROUPS: usize = 4096;

/// Greatest number of panels of a figure. Chosen: three rows of three are readable on a page.
const MAX_PANELS: usize = 9;

/// Greatest number of panels in a row or column of a figure with two crossed axes. Chosen: narrower panels have no space for labels.
const MAX_CROSSED_PANELS: usize = 4;

/// The varying axes that are not drawn and that distinguish rows, and a note on axes that change only with them. A grid axis always
/// distinguishes rows. Over an axis of labelled points, the label distinguishes rows, not the other axes of these points; nor do these distinguish symbols.
pub fn further<'a>(
    filtered: &'a FilteredTable,
    drawn: &[&str],
    makes: GroupRole,
) -> Result<(Vec<&'a str>, Option<String>), PlotError> {
    let others =
        filtered.axes.iter().filter(|axis| (axis.varies() || axis.infinite) && !drawn.contains(&axis.name.as_str()));
    let others: Vec<&str> = others.map(|axis| axis.name.as_str()).collect();
    let is_over_points = !drawn.is_empty() && drawn.iter().all(|name| filtered.is_of_point(name));
    let labels = if is_over_points { filtered.label_columns() } else { Vec::new() };
    let mut determined = filtered.determined(&others, &[drawn, &labels].concat())?.into_iter();
    let is_along = |name: &str, is_determined: bool| {
        let gridded = filtered.axis(name).is_some_and(|axis| axis.varies()) && filtered.gridded.is_free(name, drawn);
        is_determined && !gridded || makes == GroupRole::Symbols && filtered.gridded.is_from_file(name)
    };
    let (along, further): (Vec<&str>, Vec<&str>) =
        others.into_iter().partition(|name| is_along(name, determined.next().unwrap_or(false)));
    let along: Vec<&str> = along.into_iter().filter(|name| filtered.axis(name).is_some_and(Values::varies)).collect();
    let list = |names: &[&str]| names.iter().map(|name| label::name(name)).collect::<Vec<_>>().join(" and ");
    let verb = if along.len() == 1 { "changes" } else { "change" };
    let note = (!along.is_empty()).then(|| format!("Along with {}, {} {verb}.", list(drawn), list(&along)));
    Ok((further, note))
}

/// Whether the rows are scattered points over `x`, such as materials: it is an axis of labelled points, or an axis that changes with it is not monotone
/// in it.
pub fn is_scattered(filtered: &FilteredTable, x: &str, further: &[&str]) -> Result<bool, PlotError> {
    if filtered.is_of_point(x) {
        return Ok(true);
    }
    for axis in filtered.axes.iter().filter(|axis| axis.varies() && axis.name != x && axis.words.is_empty()) {
        if !further.contains(&axis.name.as_str()) && !filtered.follows(&axis.name, x)? {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The grid axes of a spec: lists and ranges. Zipped and computed axes count as one.
#[derive(Debug, Clone, Default)]
pub struct Gridded {
    axes: Vec<String>,
    /// Axes that differ between the blocks of a spec.
    of_blocks: Vec<String>,
    /// Axes that change together.
    tied: Vec<Vec<String>>,
    /// All axes of a spec with a file of points.
    outside_file: Option<Vec<String>>,
}

impl Gridded {
    /// The grid axes of a spec.
    pub fn of(spec: &Spec) -> Gridded {
        let mut gridded = Gridded::default();
        let mut previous: HashMap<&str, &AxisSpec> = HashMap::new();
        for (_, BlockSpec { axes, zip, points, .. }) in spec.blocks() {
            if points.is_some() {
                gridded.outside_file.get_or_insert_default().extend(axes.keys().cloned());
            }
            gridded.tied.extend(zip.iter().cloned());
            for (name, axis) in axes {
                let is_range = match axis {
                    AxisSpec::One(_) => false,
                    AxisSpec::List(values) => values.len() > 1,
                    AxisSpec::Form(form) => form.linspace.is_some() || form.geomspace.is_some(),
                };
                gridded.axes.extend(is_range.then(|| name.clone()));
                let differs = previous.insert(name, axis).is_some_and(|before| before != axis);
                gridded.of_blocks.extend(differs.then(|| name.clone()));
                if let AxisSpec::Form(AxisForm { expr: Some(expression), .. }) = axis {
                    let words = expression.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned);
                    gridded.tied.push(words.chain([name.clone()]).collect());
                }
            }
        }
        gridded
    }

    /// Whether an axis is a list or a range.
    pub fn has(&self, name: &str) -> bool {
        self.axes.iter().any(|axis| axis == name)
    }

    /// Whether an axis that varies is a column of the file of points.
    pub fn is_from_file(&self, name: &str) -> bool {
        // An axis of words has all of them by default.
        let has_words = Quantity::from_name(name).is_some_and(|quantity| !quantity.words().is_empty());
        !has_words && self.outside_file.as_ref().is_some_and(|outside| !outside.iter().any(|axis| axis == name))
    }

    /// Whether an axis varies independently of the drawn ones.
    fn is_free(&self, name: &str, drawn: &[&str]) -> bool {
        let is_tied = |tied: &Vec<String>| {
            tied.iter().any(|axis| axis == name) && tied.iter().any(|axis| drawn.contains(&axis.as_str()))
        };
        // Along a grid axis, blocks are different lines.
        let has_line = self.of_blocks.iter().any(|axis| axis == name) && drawn.iter().any(|axis| self.has(axis));
        (self.has(name) || has_line) && !self.tied.iter().any(is_tied)
    }
}

/// The rows with equal values of some axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// The values, in the order of the axes.
    pub values: Vec<f64>,
    /// The values of varying axes, in markup.
    pub name: String,
}

/// A group of the rows of a table.
struct FoundGroup {
    values: Vec<f64>,
    /// The label of all its rows, in markup; else empty.
    label: String,
    /// Whether a row has a value in the drawn columns.
    has_value: bool,
}

/// The groups that are shown.
#[derive(Debug, Clone)]
pub struct Groups {
    /// The axes.
    pub axes: Vec<String>,
    /// The shown groups.
    pub shown: Vec<Group>,
    /// The total number.
    pub all: usize,
    /// The number of those with a value.
    with_value: usize,
    /// The number of omitted ones with a value.
    left_out: usize,
    /// The names of those without a value, in markup, which are not shown.
    empty: Vec<String>,
    /// The axes and labels that distinguish groups.
    distinguishing: Vec<String>,
    makes: GroupRole,
    /// The titles of the rows and columns of panels, in markup, if two axes are crossed; the groups fill the rows.
    pub crossed: Option<[Vec<String>; 2]>,
    /// The values of further axes that are common to all shown groups, in markup.
    pub held: Vec<String>,
    /// A note on axes that change only with the drawn ones.
    pub along: Option<String>,
}

/// The role of a group in a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroupRole {
    /// A panel.
    Panels,
    /// A line in each panel. Groups that differ only in the friction ceiling are one for a family that does not depend on it.
    Lines,
    /// A symbol for dots, whatever the other labels and axes of their points.
    Symbols,
}

impl Groups {
    /// The groups of the rows of `filtered` as panels of `columns` over the `drawn` axes.
    pub fn of_panels(filtered: &FilteredTable, drawn: &[&str], columns: &[&str]) -> Result<Groups, PlotError> {
        let (further, along) = further(filtered, drawn, GroupRole::Panels)?;
        Ok(Groups { along, ..Groups::new(filtered, &further, GroupRole::Panels, None, [drawn, columns])? })
    }

    /// The groups of the rows of `filtered` over `axes`, without those that have no value in the columns over the axes `drawn`. If a figure cannot
    /// show all of them, all values of `series`, or of the last axis, at one or more values of the other axes; beyond `MAX_GROUPS`, one group of all
    /// rows. Groups have the names of their labels, if each has one, and the order of the file of points; else, two independent axes make rows and
    /// columns of panels, also for pairs without rows.
    pub fn new(
        filtered: &FilteredTable,
        axes: &[&str],
        makes: GroupRole,
        series: Option<&str>,
        drawn: [&[&str]; 2],
    ) -> Result<Groups, PlotError> {
        let found = find(filtered, axes, makes, drawn)?;
        if found.len() > MAX_GROUPS {
            return Groups::new(filtered, &[], makes, None, drawn);
        }
        let all = found.len();
        let is_labelled = found.iter().any(|group| !group.label.is_empty());
        // The axes that labels stand for, and the labels themselves.
        let is_of_point =
            |axis: &usize| is_labelled && (filtered.is_of_point(axes[*axis]) || filtered.is_label(axes[*axis]));
        let of_points: Vec<usize> = (0..axes.len()).filter(is_of_point).collect();
        let different = varying(found.iter().map(|group| &group.values));
        let words = |group: &FoundGroup, of: &[usize], has_label: bool| -> Vec<String> {
            let label = Some(group.label.clone()).filter(|label| has_label && !label.is_empty());
            let of: Vec<usize> = of.iter().copied().filter(|axis| !is_of_point(axis)).collect();
            label.into_iter().chain(in_words(filtered, axes, &of, &group.values)).collect()
        };
        let (found, empty): (Vec<_>, Vec<_>) = found.into_iter().partition(|group| group.has_value);
        let (found, empty) = if found.is_empty() { (empty, found) } else { (found, empty) };
        let most = if makes == GroupRole::Panels { MAX_PANELS } else { MAX_SERIES };
        let series = series.and_then(|series| axes.iter().position(|axis| *axis == series));
        let shown = choice(&joined(&found, &of_points), most, series);
        let shown: Vec<&FoundGroup> = shown.into_iter().map(|place| &found[place]).collect();
        let named = varying(shown.iter().map(|group| &group.values));
        let same: Vec<usize> = different.iter().copied().filter(|axis| !named.contains(axis)).collect();
        let has_names = shown.iter().any(|group| group.label != shown[0].label);
        let name = |group: &FoundGroup, of: &[usize], has_label: bool| words(group, of, has_label).join(", ");
        let group = |group: &&FoundGroup| Group { name: name(group, &named, has_names), values: group.values.clone() };
        let labels = if is_labelled { filtered.label_columns() } else { Vec::new() };
        let unlabelled = (0..axes.len()).filter(|axis| !is_of_point(axis)).map(|axis| axes[axis]);
        let mut groups = Groups {
            axes: axes.iter().map(|&axis| axis.to_owned()).collect(),
            shown: shown.iter().map(group).collect(),
            all,
            with_value: found.len(),
            left_out: found.len() - shown.len(),
            empty: Vec::new(),
            distinguishing: labels.into_iter().chain(unlabelled).map(str::to_owned).collect(),
            makes,
            crossed: None,
            held: shown.first().map_or_else(Vec::new, |first| words(first, &same, !has_names)),
            along: None,
        };
        if makes == GroupRole::Panels && !has_names {
            let free = varying(found.iter().map(|group| &group.values));
            let free: Vec<usize> = free.into_iter().filter(|axis| !is_of_point(axis)).collect();
            if groups.cross(filtered, &found, &free) {
                groups.held = words(&found[0], &free[..free.len() - 2], true);
            }
        }
        let is_empty = |group: &&FoundGroup| groups.place(&group.values).is_none();
        groups.empty = empty.iter().filter(is_empty).map(|group| name(group, &different, true)).collect();
        Ok(groups)
    }

    /// Crosses the last two of the axes numbered `varying`, at the first values of the others; whether they are independent.
    fn cross(&mut self, filtered: &FilteredTable, found: &[FoundGroup], varying: &[usize]) -> bool {
        let [.., first, second] = varying else { return false };
        let crossed = [*first, *second];
        let axis = |place: usize| filtered.axis(&self.axes[place]);
        let [Some(first), Some(second)] = crossed.map(axis) else { return false };
        let is_held = |axis: &usize| !crossed.contains(axis);
        let held: Vec<usize> = (0..self.axes.len()).filter(is_held).collect();
        let is_here = |group: &&FoundGroup| held.iter().all(|&axis| group.values[axis] == found[0].values[axis]);
        let found_here: Vec<&FoundGroup> = found.iter().filter(is_here).collect();
        let values = |axis: usize| {
            let mut values: Vec<f64> = found_here.iter().map(|group| group.values[axis]).collect();
            values.sort_by(f64::total_cmp);
            values.dedup();
            values
        };
        let [rows, columns] = crossed.map(values);
        // Axes that advance together have too few pairs for rows and columns.
        if rows.len() < 2 || columns.len() < 2 || found_here.len() < rows.len() + columns.len() {
            return false;
        }
        let some = |values: &[f64], most: usize| -> Vec<f64> {
            chosen(values.len(), most).into_iter().map(|place| values[place]).collect()
        };
        // A square of panels, or more along one axis if the other is short.
        let side = |mine: usize, other: usize| {
            let square = MAX_PANELS.isqrt();
            mine.min(if other < square { (MAX_PANELS / other).min(MAX_CROSSED_PANELS) } else { square })
        };
        let (rows, columns) =
            (some(&rows, side(rows.len(), columns.len())), some(&columns, side(columns.len(), rows.len())));
        let group = |(row, column): (f64, f64)| {
            let mut values = found[0].values.clone();
            (values[crossed[0]], values[crossed[1]]) = (row, column);
            Group { name: format!("{}, {}", first.text_of(row), second.text_of(column)), values }
        };
        self.shown = rows.iter().flat_map(|&row| columns.iter().map(move |&column| (row, column))).map(group).collect();
        let titles = |axis: &Values, values: &[f64]| values.iter().map(|&value| axis.text_of(value)).collect();
        self.crossed = Some([titles(first, &rows), titles(second, &columns)]);
        self.left_out = found.iter().filter(|group| self.place(&group.values).is_none()).count();
        true
    }

    /// The group with these values of the axes, if it is shown.
    fn place(&self, values: &[f64]) -> Option<usize> {
        let mut values = values.to_vec();
        self.makes.merge(&self.axes, &mut values);
        let is_same = |(own, value): (&f64, &f64)| own == value || own.is_nan() && value.is_nan();
        self.shown.iter().position(|group| group.values.iter().zip(&values).all(is_same))
    }

    /// Calls `visit` with the group and the cells of `columns` for each row of a shown group, as [`FilteredTable::each`].
    pub fn each(
        &self,
        filtered: &FilteredTable,
        columns: &[&str],
        mut visit: impl FnMut(usize, &[f64]),
    ) -> Result<(), PlotError> {
        let all: Vec<&str> = self.axes.iter().map(String::as_str).chain(columns.iter().copied()).collect();
        filtered.each(&all, |row| {
            let (key, cells) = row.split_at(self.axes.len());
            if let Some(group) = self.place(key) {
                visit(group, cells);
            }
        })
    }

    /// A figure without panels, to which each group adds one; `aspect` applies to a single panel.
    pub fn figure(&self, aspect: f64) -> Figure {
        let [rows, columns] = self.crossed.clone().unwrap_or_default();
        Figure {
            columns: match (columns.len(), self.shown.len()) {
                (0, 0 | 1) => 1,
                (0, 2 | 4) => 2,
                (0, _) => 3,
                (columns, _) => columns,
            },
            rows,
            aspect: if self.shown.len() > 1 { 0.9 } else { aspect },
            subtitle: self.held.join(", "),
            remarks: self
                .omitted(str::to_owned)
                .map(|omitted| format!("{omitted}; choose others with --where"))
                .into_iter()
                .collect(),
            notes: self.notes(),
            ..Figure::default()
        }
    }

    /// The title of a panel; the title of its column if axes are crossed.
    pub fn title(&self, place: usize) -> String {
        match &self.crossed {
            Some([_, columns]) => columns.get(place).cloned().unwrap_or_default(),
            None => self.shown[place].name.clone(),
        }
    }

    /// The number of shown panels or lines, if some are omitted.
    fn omitted(&self, name: impl Fn(&str) -> String) -> Option<String> {
        (self.left_out > 0).then(|| {
            let what = match self.makes {
                GroupRole::Panels => "panels",
                GroupRole::Lines => "lines",
                GroupRole::Symbols => "groups",
            };
            let names: Vec<String> = self.distinguishing.iter().map(|column| name(column)).collect();
            format!("{} of {} {what} ({})", self.with_value - self.left_out, self.with_value, names.join(", "))
        })
    }

    /// Notes about omitted groups and axes, in markup.
    fn notes(&self) -> Vec<String> {
        let omitted = self.omitted(label::name).map(|omitted| format!("{omitted} are shown."));
        let empty = (!self.empty.is_empty()).then(|| format!("No value for {}.", label::few(&self.empty)));
        omitted.into_iter().chain(empty).chain(self.along.clone()).collect()
    }
}

impl GroupRole {
    /// Sets the friction ceiling to NaN for a family that does not depend on it, so that its rows are one line.
    fn merge(self, axes: &[impl AsRef<str>], values: &mut [f64]) {
        let place =
            |axis: Quantity| axes.iter().position(|name| self != GroupRole::Panels && name.as_ref() == axis.name());
        let (Some(family), Some(bound)) = (place(Quantity::Family), place(Quantity::FrictionCeiling)) else { return };
        if !FAMILIES.get(values[family] as usize).is_some_and(|family| family.uses_tau_ceiling) {
            values[bound] = f64::NAN;
        }
    }
}

/// The groups of the rows over `axes`: if each has a label, by the first rows of the labels; then by ascending values. More than `MAX_GROUPS` if there are too
/// many. Their values are those of the second columns `drawn` over the first ones, which are axes; without columns, each group has a value.
fn find(
    filtered: &FilteredTable,
    axes: &[&str],
    makes: GroupRole,
    drawn: [&[&str]; 2],
) -> Result<Vec<FoundGroup>, PlotError> {
    if axes.is_empty() {
        return Ok(vec![FoundGroup { values: Vec::new(), label: String::new(), has_value: true }]);
    }
    let labels = if makes == GroupRole::Symbols { Vec::new() } else { filtered.label_columns() };
    let columns = [axes, &labels, drawn[0], drawn[1]].concat();
    let mut found: IndexMap<Vec<u64>, (FoundGroup, Vec<u64>)> = IndexMap::new();
    // The axes and labels of the last row, if its group has a value.
    let mut last: Vec<f64> = Vec::new();
    filtered.each_while(&columns, |row| {
        let (key, cells) = row.split_at(axes.len() + labels.len());
        if !last.is_empty() && last.iter().zip(key).all(|(last, cell)| last.to_bits() == cell.to_bits()) {
            return true;
        }
        let (values, label) = key.split_at(axes.len());
        let (at, cells) = cells.split_at(drawn[0].len());
        let mut values = values.to_vec();
        makes.merge(axes, &mut values);
        let place = bits(&values);
        let new = || FoundGroup { values, label: filtered.label_of_group(&labels, label), has_value: false };
        let (group, known) = found.entry(place).or_insert_with(|| (new(), bits(label)));
        if *known != bits(label) {
            group.label.clear();
        }
        let is_value = at.iter().all(|at| at.is_finite()) && cells.iter().any(|cell| !cell.is_nan());
        group.has_value |= drawn[1].is_empty() || is_value;
        last.clear();
        last.extend(key.iter().filter(|_| group.has_value));
        found.len() <= MAX_GROUPS
    })?;
    let mut found: Vec<FoundGroup> = found.into_values().map(|(group, _)| group).collect();
    let is_labelled = found.iter().all(|group| !group.label.is_empty());
    if !is_labelled {
        found.iter_mut().for_each(|group| group.label.clear());
    }
    let labels: IndexSet<String> = found.iter().map(|group| group.label.clone()).collect();
    let free: Vec<usize> = (0..axes.len()).filter(|&axis| !(is_labelled && filtered.is_of_point(axes[axis]))).collect();
    found.sort_by(|a, b| {
        let [first, second] = [a, b].map(|group| labels.get_index_of(&group.label));
        let values = free.iter().map(|&axis| a.values[axis].total_cmp(&b.values[axis]));
        first.cmp(&second).then(values.into_iter().find(|order| order.is_ne()).unwrap_or(Ordering::Equal))
    });
    Ok(found)
}

/// The values of labelled groups with the axes numbered `of_points`, which advance together, as one: the first of them has the number of the label.
fn joined(found: &[FoundGroup], of_points: &[usize]) -> Vec<Vec<f64>> {
    let mut labels: IndexSet<&str> = IndexSet::new();
    let mut joined: Vec<Vec<f64>> = found.iter().map(|group| group.values.clone()).collect();
    for (group, values) in found.iter().zip(&mut joined) {
        let number = labels.insert_full(&group.label).0;
        for (place, &axis) in of_points.iter().enumerate() {
            values[axis] = if place == 0 { number as f64 } else { 0.0 };
        }
    }
    joined
}

/// The values of the axes and labels numbered `of` in markup, without missing ones.
fn in_words(filtered: &FilteredTable, axes: &[&str], of: &[usize], values: &[f64]) -> Vec<String> {
    let text = |&axis: &usize| {
        let (name, value) = (axes[axis], values[axis]);
        match filtered.axis(name) {
            Some(axis) => (!value.is_nan()).then(|| axis.text_of(value)),
            None => Some(filtered.label_of_group(&[name], &[value])),
        }
    };
    of.iter().filter_map(text).collect()
}

/// The axes that vary between groups.
fn varying<'a>(groups: impl Iterator<Item = &'a Vec<f64>> + Clone) -> Vec<usize> {
    let Some(first) = groups.clone().next() else { return Vec::new() };
    (0..first.len()).filter(|&axis| groups.clone().any(|group| group[axis] != first[axis])).collect()
}

/// The indices of the shown groups, at most `most`: sets of groups that differ in one axis alone, `series` or the last one, and so are comparable. An
/// axis that merged lines do not have separates no sets.
fn choice(found: &[Vec<f64>], most: usize, series: Option<usize>) -> Vec<usize> {
    let varying = varying(found.iter());
    let fast = series.filter(|axis| varying.contains(axis)).or(varying.last().copied());
    let is_common = |axis: &usize| Some(*axis) != fast && found.iter().all(|group| !group[*axis].is_nan());
    let common: Vec<usize> = varying.into_iter().filter(is_common).collect();
    let mut sets: IndexMap<Vec<u64>, Vec<usize>> = IndexMap::new();
    for (place, group) in found.iter().enumerate() {
        sets.entry(common.iter().map(|&axis| group[axis].to_bits()).collect()).or_default().push(place);
    }
    if sets.values().all(|set| set.len() == 1) {
        // Axes that advance together.
        sets = IndexMap::from([(Vec::new(), (0..found.len()).collect())]);
    }
    let mut places = Vec::new();
    for set in sets.into_values() {
        let room = most - places.len();
        if !places.is_empty() && set.len() > room {
            break;
        }
        places.extend(chosen(set.len(), room).into_iter().map(|place| set[place]));
    }
    places.sort_unstable();
    places
}

/// `most` of `all` indices, evenly spread, including the first and the last.
fn chosen(all: usize, most: usize) -> Vec<usize> {
    if all <= most {
        return (0..all).collect();
    }
    (0..most).map(|i| if most < 2 { 0 } else { (i * (all - 1) + (most - 1) / 2) / (most - 1) }).collect()
}

#[cfg(test)]
mod tests {
    //! An even selection.

    use super::*;

    #[test]
    fn axes_of_the_grid_are_free_unless_one_they_are_zipped_with_is_drawn() {
        let gridded = |axes: &str| Gridded::of(&Spec::parse(&format!("name = \"grid\"\n{axes}")).expect("a spec"));
        let zipped = gridded(
            "zip = [[\"a\", \"b\"]]\n[axes]\na = [0.03, 0.05]\nb = [0.05, 0.03]\nt_f = { geomspace = [0.01, 1.0, 5] }\nv_i = 3.0\n\
             v_f = { expr = \"10 * v_i\" }\nk = { sobol = [1.0, 2.0, 8], seed = 1 }\n",
        );
        let free = |name, drawn: &[&str]| zipped.is_free(name, drawn);
        assert!(free("t_f", &["v_f"]) && free("a", &["t_f"]) && !free("a", &["b"]));
        assert!(!free("v_i", &[]) && !free("v_f", &[]) && !free("k", &[]));
        let blocks = gridded("[[block]]\n[block.axes]\nt_f = [1.0, 2.0]\n[[block]]\n[block.axes]\nb = [1.0, 2.0]\n");
        assert!(blocks.is_free("t_f", &["b"]) && blocks.is_free("b", &["t_f"]));
    }

    /// Family, final velocity and friction ceiling, which two families do not have.
    #[test]
    fn lines_of_families_are_at_the_first_velocity() {
        let mut found = Vec::new();
        for family in [0.0, 1.0] {
            found.extend([10.0, 20.0, 30.0].map(|v_f| vec![family, v_f, f64::NAN]));
        }
        let friction = [10.0, 20.0, 30.0].map(|v_f| [1.1, 1.2].map(|tau| vec![3.0, v_f, tau]));
        found.extend(friction.into_iter().flatten());
        let shown: Vec<&Vec<f64>> = choice(&found, 7, Some(0)).into_iter().map(|place| &found[place]).collect();
        assert!(shown.len() == 4 && shown.iter().all(|group| group[1] == 10.0), "{shown:?}");
        assert_eq!(shown.iter().filter(|group| group[0] == 3.0).count(), 2);
    }

    #[test]
    fn the_choice_is_even_and_keeps_the_ends() {
        assert_eq!(chosen(3, 7), [0, 1, 2]);
        assert_eq!(chosen(9, 3), [0, 4, 8]);
        assert_eq!(chosen(31, 4), [0, 10, 20, 30]);
        assert_eq!(chosen(5, 1), [0]);
    }
}
