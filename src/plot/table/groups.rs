//! The groups of a table: combinations of the axes that are not drawn in a panel. Each group makes a panel or a line.

use std::cmp::Ordering;
use std::collections::{BTreeSet, HashMap, HashSet};

use super::filtered::{FilteredTable, Values, bits};
use indexmap::IndexMap;

use crate::grid::Quantity;
use crate::plot::colour::MAX_SERIES;
use crate::plot::{Figure, PlotError, label};
use crate::protocol::shortcut::FAMILIES;

/// Greatest number of groups; with more, all rows are one group. Chosen: far more than a picture shows.
const MAX_GROUPS: usize = 4096;

/// Greatest number of panels of a figure. Chosen: three rows of three are readable on a page.
const MAX_PANELS: usize = 9;

/// Greatest number of panels in a row or column of a figure with two crossed axes. Chosen: narrower panels have no space for labels.
const MAX_CROSSED_PANELS: usize = 4;

/// The varying axes that are not drawn and that distinguish rows, and a note on axes that change only with them. A grid axis always
/// distinguishes rows.
pub fn further<'a>(filtered: &'a FilteredTable, drawn: &[&str]) -> Result<(Vec<&'a str>, Option<String>), PlotError> {
    let others =
        filtered.axes.iter().filter(|axis| (axis.varies() || axis.infinite) && !drawn.contains(&axis.name.as_str()));
    let others: Vec<&str> = others.map(|axis| axis.name.as_str()).collect();
    let mut determined = filtered.determined(&others, drawn)?.into_iter();
    let is_along = |name: &str, is_determined: bool| {
        let gridded = filtered.axis(name).is_some_and(|axis| axis.varies()) && filtered.gridded.is_free(name, drawn);
        is_determined && !gridded
    };
    let (along, further): (Vec<&str>, Vec<&str>) =
        others.into_iter().partition(|name| is_along(name, determined.next().unwrap_or(false)));
    let along: Vec<&str> = along.into_iter().filter(|name| filtered.axis(name).is_some_and(Values::varies)).collect();
    let list = |names: &[&str]| names.iter().map(|name| label::name(name)).collect::<Vec<_>>().join(" and ");
    let verb = if along.len() == 1 { "changes" } else { "change" };
    let note = (!along.is_empty()).then(|| format!("Along with {}, {} {verb}.", list(drawn), list(&along)));
    Ok((further, note))
}

/// Whether the rows are scattered points over `x`, such as materials: an axis that changes with `x` is not monotone in it.
pub fn is_scattered(filtered: &FilteredTable, x: &str, further: &[&str]) -> Result<bool, PlotError> {
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
    /// Axes that change together.
    tied: Vec<Vec<String>>,
}

impl Gridded {
    /// The grid axes of a spec; empty for a damaged spec.
    pub fn of(spec: &str) -> Gridded {
        let mut gridded = Gridded::default();
        let Ok(spec) = spec.parse::<toml::Table>() else { return gridded };
        let blocks = spec.get("block").and_then(toml::Value::as_array).into_iter().flatten();
        for part in [&spec].into_iter().chain(blocks.filter_map(toml::Value::as_table)) {
            let is_range = |value: &toml::Value| match value {
                toml::Value::Array(values) => values.len() > 1,
                toml::Value::Table(table) => table.contains_key("linspace") || table.contains_key("geomspace"),
                _ => false,
            };
            let axes = || part.get("axes").and_then(toml::Value::as_table).into_iter().flatten();
            gridded.axes.extend(axes().filter(|(_, value)| is_range(value)).map(|(name, _)| name.clone()));
            let zipped = part.get("zip").and_then(toml::Value::as_array).into_iter().flatten();
            let names = |zip: &toml::Value| {
                zip.as_array().into_iter().flatten().filter_map(|name| Some(name.as_str()?.to_owned())).collect()
            };
            gridded.tied.extend(zipped.map(names));
            gridded.tied.extend(axes().filter_map(|(name, value)| {
                let expression = value.get("expr")?.as_str()?;
                let words = expression.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned);
                Some(words.chain([name.clone()]).collect())
            }));
        }
        gridded
    }

    /// Whether an axis is a list or a range.
    pub fn has(&self, name: &str) -> bool {
        self.axes.iter().any(|axis| axis == name)
    }

    /// Whether an axis varies independently of the drawn ones.
    fn is_free(&self, name: &str, drawn: &[&str]) -> bool {
        let is_tied = |tied: &Vec<String>| {
            tied.iter().any(|axis| axis == name) && tied.iter().any(|axis| drawn.contains(&axis.as_str()))
        };
        self.has(name) && !self.tied.iter().any(is_tied)
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

/// The groups that are shown.
#[derive(Debug, Clone)]
pub struct Groups {
    /// The axes.
    pub axes: Vec<String>,
    /// The shown groups.
    pub shown: Vec<Group>,
    /// The total number.
    pub all: usize,
    /// The number of omitted ones.
    left_out: usize,
    makes: GroupRole,
    /// The titles of the rows and columns of panels, in markup, if two axes are crossed; the groups fill the rows.
    pub crossed: Option<[Vec<String>; 2]>,
    /// The values of further axes that are common to all shown groups, in markup.
    pub held: Vec<String>,
    places: HashMap<Vec<u64>, usize>,
}

/// The role of a group in a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroupRole {
    /// A panel.
    Panels,
    /// A line in each panel. Groups that differ only in the friction ceiling are one for a family that does not depend on it.
    Lines,
}

impl Groups {
    /// The groups of the rows of `filtered` as panels over the `drawn` axes, and a note on axes that change only with others.
    pub fn of_panels(filtered: &FilteredTable, drawn: &[&str]) -> Result<(Groups, Option<String>), PlotError> {
        let (further, along) = further(filtered, drawn)?;
        Ok((Groups::new(filtered, &further, GroupRole::Panels, None)?, along))
    }

    /// The groups of the rows of `filtered` over `axes`. If a figure cannot show all of them, all values of `series`, or of the last axis, at one or
    /// more values of the other axes; beyond `MAX_GROUPS`, one group of all rows. Two independent axes make rows and columns of panels, also for
    /// pairs without rows.
    pub fn new(
        filtered: &FilteredTable,
        axes: &[&str],
        makes: GroupRole,
        series: Option<&str>,
    ) -> Result<Groups, PlotError> {
        let found = keys(filtered, axes, makes)?;
        if found.len() > MAX_GROUPS {
            return Ok(Groups::of(Vec::new(), vec![Group { values: Vec::new(), name: String::new() }], 1, makes));
        }
        let most = if makes == GroupRole::Panels { MAX_PANELS } else { MAX_SERIES };
        let series = series.and_then(|series| axes.iter().position(|axis| *axis == series));
        let shown: Vec<Vec<f64>> =
            choice(&found, most, makes, series).into_iter().map(|place| found[place].clone()).collect();
        let in_words = |of: &[usize], values: &[f64]| in_words(filtered, axes, of, values);
        let (named, different) = (varying(&shown), varying(&found));
        let same: Vec<usize> = different.into_iter().filter(|axis| !named.contains(axis)).collect();
        let held = shown.first().map_or_else(Vec::new, |first| in_words(&same, first));
        let groups = shown.into_iter().map(|values| Group { name: in_words(&named, &values).join(", "), values });
        let axes = axes.iter().map(|&axis| axis.to_owned()).collect();
        let mut groups = Groups { held, ..Groups::of(axes, groups.collect(), found.len(), makes) };
        if makes == GroupRole::Panels {
            groups.cross(filtered, &found);
        }
        if groups.crossed.is_none() {
            groups.label(filtered)?;
        }
        Ok(groups)
    }

    /// The `shown` groups of `all`, without crossed axes.
    fn of(axes: Vec<String>, shown: Vec<Group>, all: usize, makes: GroupRole) -> Groups {
        let (places, left_out) = (places_of(&shown), all - shown.len());
        Groups { axes, shown, all, left_out, makes, crossed: None, held: Vec::new(), places }
    }

    /// Names the groups by their labels, if each has one, and by the axes that distinguish groups of one label. Groups are in the order of their
    /// first rows: that of the file of points. A label common to all groups is stated once.
    fn label(&mut self, filtered: &FilteredTable) -> Result<(), PlotError> {
        if filtered.labels.is_empty() || self.shown.len() < 2 {
            return Ok(());
        }
        let columns: Vec<&str> = self.axes.iter().map(String::as_str).chain(filtered.label_columns()).collect();
        let mut labels = vec![String::new(); self.shown.len()];
        let (mut is_one, mut order) = (true, Vec::new());
        filtered.each_while(&columns, |row| {
            let (group, cells) = row.split_at(self.axes.len());
            if let Some(place) = self.place(group) {
                let label = filtered.label(cells);
                if labels[place].is_empty() {
                    order.push(place);
                }
                is_one = !label.is_empty() && (labels[place].is_empty() || labels[place] == label);
                labels[place] = label;
            }
            is_one
        })?;
        let different: HashSet<&String> = labels.iter().filter(|label| !label.is_empty()).collect();
        if !is_one || order.len() < self.shown.len() {
            return Ok(());
        }
        if let [label] = different.into_iter().collect::<Vec<_>>()[..] {
            self.held.insert(0, label.clone());
            return Ok(());
        }
        let of_label = |label: &String| -> Vec<Vec<f64>> {
            let places = (0..labels.len()).filter(|&place| labels[place] == *label);
            places.map(|place| self.shown[place].values.clone()).collect()
        };
        let within: BTreeSet<usize> = labels.iter().flat_map(|label| varying(&of_label(label))).collect();
        let within: Vec<usize> = within.into_iter().collect();
        let group = |&place: &usize| {
            let values = self.shown[place].values.clone();
            let words = [labels[place].clone()].into_iter().chain(in_words(filtered, &self.axes, &within, &values));
            Group { name: words.collect::<Vec<_>>().join(", "), values }
        };
        self.shown = order.iter().map(group).collect();
        self.places = places_of(&self.shown);
        Ok(())
    }

    /// Crosses the last two varying axes, at the first values of the others.
    fn cross(&mut self, filtered: &FilteredTable, found: &[Vec<f64>]) {
        let varying = varying(found);
        let [.., first, second] = varying.as_slice() else { return };
        let crossed = [*first, *second];
        let axis = |place: usize| filtered.axis(&self.axes[place]);
        let [Some(first), Some(second)] = crossed.map(axis) else { return };
        let is_held = |axis: &usize| !crossed.contains(axis);
        let found_here: Vec<&Vec<f64>> = found
            .iter()
            .filter(|group| (0..group.len()).filter(is_held).all(|axis| group[axis] == found[0][axis]))
            .collect();
        let values = |axis: usize| {
            let mut values: Vec<f64> = found_here.iter().map(|group| group[axis]).collect();
            values.sort_by(f64::total_cmp);
            values.dedup();
            values
        };
        let [rows, columns] = crossed.map(values);
        // Axes that advance together have too few pairs for rows and columns.
        if rows.len() < 2 || columns.len() < 2 || found_here.len() < rows.len() + columns.len() {
            return;
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
            let mut values = found[0].clone();
            (values[crossed[0]], values[crossed[1]]) = (row, column);
            Group { name: format!("{}, {}", first.text_of(row), second.text_of(column)), values }
        };
        self.shown = rows.iter().flat_map(|&row| columns.iter().map(move |&column| (row, column))).map(group).collect();
        let titles = |axis: &Values, values: &[f64]| values.iter().map(|&value| axis.text_of(value)).collect();
        let held = varying.iter().filter(|axis| is_held(axis));
        self.held = held.filter_map(|&place| Some(axis(place)?.text_of(found[0][place]))).collect();
        self.crossed = Some([titles(first, &rows), titles(second, &columns)]);
        self.places = places_of(&self.shown);
        self.left_out = found.iter().filter(|group| self.place(group).is_none()).count();
    }

    /// The group with these values of the axes, if it is shown.
    pub fn place(&self, values: &[f64]) -> Option<usize> {
        let mut values = values.to_vec();
        self.makes.merge(&self.axes, &mut values);
        self.places.get(&bits(&values)).copied()
    }

    /// Drops groups whose items are not kept, and returns a note on them.
    pub fn retain<T>(&mut self, items: &mut Vec<T>, is_kept: impl Fn(&T) -> bool) -> Option<String> {
        let pairs = std::mem::take(&mut self.shown).into_iter().zip(std::mem::take(items));
        let (kept, dropped): (Vec<_>, Vec<_>) = pairs.partition(|(_, item)| is_kept(item));
        (self.shown, *items) = kept.into_iter().unzip();
        self.all -= dropped.len();
        self.places = places_of(&self.shown);
        let names: Vec<String> = dropped.into_iter().map(|(group, _)| group.name).collect();
        (!names.is_empty()).then(|| format!("No value for {}.", names.join("; ")))
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
            remarks: self.note().into_iter().collect(),
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

    /// A note about omitted panels.
    pub fn note(&self) -> Option<String> {
        (self.left_out > 0).then(|| {
            let what = if self.makes == GroupRole::Panels { "panels" } else { "lines" };
            let (shown, all) = (self.all - self.left_out, self.all);
            format!("{shown} of {all} {what} ({}); choose others with --where", self.axes.join(", "))
        })
    }
}

impl GroupRole {
    /// Sets the friction ceiling to NaN for a family that does not depend on it, so that its rows are one line.
    fn merge(self, axes: &[impl AsRef<str>], values: &mut [f64]) {
        let place =
            |axis: Quantity| axes.iter().position(|name| self == GroupRole::Lines && name.as_ref() == axis.name());
        let (Some(family), Some(bound)) = (place(Quantity::Family), place(Quantity::FrictionCeiling)) else { return };
        if !FAMILIES.get(values[family] as usize).is_some_and(|family| family.uses_tau_ceiling) {
            values[bound] = f64::NAN;
        }
    }
}

/// The distinct values of `axes` in ascending order; more than `MAX_GROUPS` if there are too many.
fn keys(filtered: &FilteredTable, axes: &[&str], makes: GroupRole) -> Result<Vec<Vec<f64>>, PlotError> {
    let mut found: HashMap<Vec<u64>, Vec<f64>> = HashMap::new();
    let mut last: Vec<f64> = Vec::new();
    filtered.each_while(axes, |cells| {
        if !last.is_empty() && last.iter().zip(cells).all(|(last, cell)| last.to_bits() == cell.to_bits()) {
            return true;
        }
        last.clear();
        last.extend_from_slice(cells);
        let mut cells = cells.to_vec();
        makes.merge(axes, &mut cells);
        found.entry(bits(&cells)).or_insert(cells);
        // Without axes there is one group.
        !axes.is_empty() && found.len() <= MAX_GROUPS
    })?;
    let mut found: Vec<Vec<f64>> = found.into_values().collect();
    let in_order = |(a, b): (&f64, &f64)| a.total_cmp(b);
    found.sort_by(|a, b| a.iter().zip(b).map(in_order).find(|order| order.is_ne()).unwrap_or(Ordering::Equal));
    Ok(found)
}

/// The values of the axes numbered `of` in markup, without missing ones.
fn in_words(filtered: &FilteredTable, axes: &[impl AsRef<str>], of: &[usize], values: &[f64]) -> Vec<String> {
    let named = of.iter().filter(|&&axis| !values[axis].is_nan());
    named.filter_map(|&axis| Some(filtered.axis(axes[axis].as_ref())?.text_of(values[axis]))).collect()
}

/// The axes that vary between groups.
fn varying(found: &[Vec<f64>]) -> Vec<usize> {
    let axes = found.first().map_or(0, Vec::len);
    (0..axes).filter(|&axis| found.iter().any(|group| group[axis] != found[0][axis])).collect()
}

/// The indices of the shown groups, at most `most`: merged lines with some of the others at the first values of further axes, or sets of groups that
/// differ in one axis alone, `series` or the last one, and so are comparable.
fn choice(found: &[Vec<f64>], most: usize, makes: GroupRole, series: Option<usize>) -> Vec<usize> {
    let varying = varying(found);
    let fast = series.filter(|axis| varying.contains(axis)).or(varying.last().copied());
    let is_merged = |group: &Vec<f64>| makes == GroupRole::Lines && group.iter().any(|value| value.is_nan());
    if found.iter().any(is_merged) {
        let is_further = |axis: &&usize| Some(**axis) != fast && !found.iter().any(|group| group[**axis].is_nan());
        let further: Vec<usize> = varying.iter().filter(is_further).copied().collect();
        let is_first = |place: &usize| further.iter().all(|&axis| found[*place][axis] == found[0][axis]);
        let (mut places, others): (Vec<usize>, Vec<usize>) =
            (0..found.len()).filter(is_first).partition(|&place| is_merged(&found[place]));
        places.truncate(most);
        places.extend(chosen(others.len(), most - places.len()).into_iter().map(|place| others[place]));
        places.sort_unstable();
        return places;
    }
    let rest = |place: usize| -> Vec<u64> {
        let axes = (0..found[place].len()).filter(|axis| Some(*axis) != fast);
        axes.map(|axis| found[place][axis].to_bits()).collect()
    };
    let mut sets: IndexMap<Vec<u64>, Vec<usize>> = IndexMap::new();
    (0..found.len()).for_each(|place| sets.entry(rest(place)).or_default().push(place));
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

fn places_of(groups: &[Group]) -> HashMap<Vec<u64>, usize> {
    groups.iter().enumerate().map(|(place, group)| (bits(&group.values), place)).collect()
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
        let gridded = Gridded::of(
            "zip = [[\"a\", \"b\"]]\n[axes]\na = [0.03, 0.05]\nb = [0.05, 0.03]\nt_f = { geomspace = [0.01, 1.0, 5] }\nv_i = 3.0\n\
             v_f = { expr = \"10 * v_i\" }\nk = { sobol = [1.0, 2.0, 8], seed = 1 }\n",
        );
        let free = |name, drawn: &[&str]| gridded.is_free(name, drawn);
        assert!(free("t_f", &["v_f"]) && free("a", &["t_f"]) && !free("a", &["b"]));
        assert!(!free("v_i", &[]) && !free("v_f", &[]) && !free("k", &[]));
        let blocks =
            Gridded::of("[[block]]\n[block.axes]\nt_f = [1.0, 2.0]\n[[block]]\n[block.axes]\nb = [1.0, 2.0]\n");
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
        let shown: Vec<&Vec<f64>> =
            choice(&found, 7, GroupRole::Lines, Some(0)).into_iter().map(|place| &found[place]).collect();
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
