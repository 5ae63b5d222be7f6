//! The choice of axes and columns: from the request, else from the varying axes.

use super::filtered::{FilteredTable, MAX_VALUES, Values};
use super::lines;
use super::map;
use super::{PROTOCOL_DEFAULTS, Request, TablePicture};
use crate::plot::PlotError;
use crate::plot::colour::MAX_SERIES;

/// A map or lines.
#[derive(Debug, Clone)]
pub enum Shape {
    /// Colours over two axes.
    Map(map::MapColumns),
    /// Columns over an axis.
    Lines(lines::LineColumns),
}

/// The shape of a picture.
///
/// # Errors
///
/// A column that the table does not have, or a combination of options without a picture.
pub fn choose(filtered: &FilteredTable, defaults: &TablePicture, request: &Request) -> Result<Shape, PlotError> {
    let choice = Choice::new(filtered, defaults, request)?;
    let (x, y, colour) = (request.x.as_deref(), request.y.as_deref(), request.colour.as_deref());
    let is_axis = |name: &&str| filtered.axis(name).is_some();
    // Two axes, or a column of colours, select a map; another column selects lines.
    if let (Some(x), Some(y)) = (x, y)
        && x == y
    {
        return Err(PlotError::same_axes(x));
    }
    if let Some(x) = x.filter(|x| filtered.axis(x).is_some_and(|axis| !axis.varies() && !axis.infinite))
        && !choice.varying.is_empty()
    {
        let varying = choice.varying.iter().map(|axis| axis.name.as_str()).collect::<Vec<_>>().join(", ");
        return Err(PlotError::Refused(format!(
            "--x {x}: all rows have the same value\n  expected: one of {varying}\n  help: choose an axis that varies"
        )));
    }
    if let Some(y) = y.filter(is_axis) {
        let x = x.map(str::to_owned).or_else(|| choice.find(defaults.x, Some(y), 2)).or_else(|| choice.longest());
        let x = x.filter(|x| x != y).ok_or_else(|| choice.one_row())?;
        return choice.map(x, y.to_owned());
    }
    // Lines are named by their labels, with or without a request.
    let colour = colour.filter(|colour| y.is_none() || !filtered.is_label(colour));
    let wants_map = colour.filter(|colour| !is_axis(colour));
    let wants_lines = y.is_some() || colour.is_some_and(|colour| is_axis(&colour));
    // A label colours a map of points, not one of a grid.
    let is_of_label = colour.is_some_and(|colour| filtered.is_label(colour));
    let shows_label = |x: &str, y: &str| !is_of_label || [x, y].iter().all(|axis| filtered.is_of_dot(axis));
    if !wants_lines && let Some((x, y)) = choice.two_axes(wants_map.is_some())?.filter(|(x, y)| shows_label(x, y)) {
        return choice.map(x, y);
    }
    if let Some(column) = wants_map.filter(|column| !filtered.is_label(column)) {
        if y.is_some() {
            let axes = choice.varying.iter().map(|axis| axis.name.as_str());
            let among: Vec<&str> = axes.filter(|axis| Some(*axis) != x).chain(filtered.label_columns()).collect();
            return Err(PlotError::Refused(format!(
                "--color {column} is a result, which colours maps\n  expected: an axis or a label, since --y draws lines: {}\n  \
                 help: remove --color",
                among.join(", ")
            )));
        }
        return Err(choice.no_map(column));
    }
    let colour = colour.filter(|colour| !filtered.is_label(colour));
    if let Some(y) = y.filter(|y| !filtered.words(y).is_empty()) {
        return Err(PlotError::Refused(format!(
            "--y {y}: words make no line\n  expected: a column of numbers\n  help: in a map over two axes, --color {y} shows them; \
             `slipsweep query` lists them"
        )));
    }
    let of_at_least = |values: usize| choice.find(defaults.x, colour, values);
    // Tables without a map prefer as many values as most maps have.
    let preferred = || of_at_least(defaults.least_map.min(PROTOCOL_DEFAULTS.least_map)).or_else(|| of_at_least(3));
    let any = || choice.varying.first().map(|axis| axis.name.clone());
    let preferred = || preferred().or_else(|| choice.longest()).or_else(any);
    let x = x.map(str::to_owned).or_else(preferred).ok_or_else(|| choice.one_row())?;
    let written = || defaults.lines.iter().copied().filter(|column| filtered.has(column));
    let y = y.map_or_else(|| written().map(str::to_owned).collect(), |y| vec![y.to_owned()]);
    if let Some(colour) = request.colour.as_deref().filter(|_| filtered.is_of_dot(&x))
        && choice.has_symbols(&x, colour)?
    {
        return Ok(Shape::Lines(lines::LineColumns { x, y, series: Some(colour.to_owned()), has_symbols: true }));
    }
    let series = request.colour.clone().or_else(|| choice.find(defaults.series, Some(&x), 2));
    Ok(Shape::Lines(lines::LineColumns { x, y, series, has_symbols: false }))
}

/// The inputs of a choice.
struct Choice<'a> {
    filtered: &'a FilteredTable,
    defaults: &'a TablePicture,
    request: &'a Request,
    varying: Vec<&'a Values>,
}

impl<'a> Choice<'a> {
    /// A choice for a request whose columns all exist.
    fn new(
        filtered: &'a FilteredTable,
        defaults: &'a TablePicture,
        request: &'a Request,
    ) -> Result<Choice<'a>, PlotError> {
        for (argument, axis) in [("--x", &request.x), ("--y", &request.y)] {
            if let Some(label) = axis.clone().filter(|axis| filtered.is_label(axis)) {
                let requested = request.y.clone().filter(|y| filtered.has(y) && !filtered.is_label(y));
                let line = requested.unwrap_or_else(|| defaults.line(filtered));
                return Err(PlotError::Refused(format!(
                    "{argument} {label}: a label is no axis\n  expected: a column of numbers\n  help: --y {line} draws a line for each {label}; \
                     --where \"{label}=…\" selects one"
                )));
            }
        }
        if let Some(x) = &request.x {
            filtered.check("--x", "axis", x)?;
        }
        for (argument, column) in [("--y", &request.y), ("--color", &request.colour)] {
            if let Some(column) = column {
                filtered.check(argument, "column", column)?;
            }
        }
        Ok(Choice { filtered, defaults, request, varying: filtered.axes.iter().filter(|axis| axis.varies()).collect() })
    }

    /// The first of `names`, except `not`, with at least `least` values. Grid axes are preferred to computed ones.
    fn find(&self, names: &[&str], not: Option<&str>, least: usize) -> Option<String> {
        let fits = |axis: &&&Values| Some(axis.name.as_str()) != not && axis.values.len() >= least;
        let named = |name: &&str| self.varying.iter().filter(fits).find(|axis| axis.name == *name);
        let (gridded, computed): (Vec<&str>, Vec<&str>) =
            names.iter().partition(|name| self.filtered.gridded.has(name));
        Some(gridded.iter().chain(&computed).find_map(named)?.name.clone())
    }

    /// The axis of numbers with the most values.
    fn longest(&self) -> Option<String> {
        let long = self.varying.iter().filter(|axis| axis.words.is_empty());
        Some(long.max_by_key(|axis| axis.values.len())?.name.clone())
    }

    /// Whether dots over `x` have symbols for the values of `colour`: a label of few words, else each dot has its name, or another axis of the points.
    fn has_symbols(&self, x: &str, colour: &str) -> Result<bool, PlotError> {
        let filtered = self.filtered;
        if filtered.is_label(colour) {
            return Ok((2..=MAX_SERIES).contains(&filtered.words(colour).len()));
        }
        let Some(axis) =
            filtered.axis(colour).filter(|axis| axis.varies() && filtered.is_of_dot(colour) && colour != x)
        else {
            return Ok(false);
        };
        if axis.values.len() <= MAX_SERIES {
            return Ok(true);
        }
        let count = if axis.many { format!("over {MAX_VALUES}") } else { axis.values.len().to_string() };
        // A map without a requested column shows one with numbers.
        let of_column = self.request.y.as_ref().map_or(String::new(), |y| format!(" --color {y}"));
        Err(PlotError::Refused(format!(
            "--color {colour}: an axis of {count} values\n  expected: at most {MAX_SERIES}, each with a symbol\n  help: --x {x} \
             --y {colour}{of_column} draws a map"
        )))
    }

    fn one_row(&self) -> PlotError {
        let table = &self.filtered.table;
        let found = match self.filtered.rows {
            0 | 1 => format!("the table `{table}` has a single matching row, which makes no picture"),
            rows => format!("no other axis varies among the {rows} matching rows of the table `{table}`"),
        };
        PlotError::Refused(format!("{found}\n  help: `slipsweep head` shows the rows"))
    }

    /// The error if no two axes make a map.
    fn no_map(&self, column: &str) -> PlotError {
        let Choice { filtered, varying, .. } = self;
        let varying = varying.iter().map(|axis| axis.name.as_str());
        let (of_points, free): (Vec<&str>, Vec<&str>) = varying.partition(|axis| filtered.is_of_point(axis));
        let mut found = if free.is_empty() { "none".to_owned() } else { free.join(", ") };
        if !of_points.is_empty() {
            let label = filtered.label_columns().join(", ");
            found.push_str(&format!("; the label {label} determines {}", of_points.join(", ")));
        }
        let words = if filtered.words(column).is_empty() { "" } else { "; `slipsweep query` lists the words" };
        PlotError::Refused(format!(
            "--color {column}: a map needs two axes of several values, which the table `{}` does not have\n  found: {found}\n  \
             help: --y {} draws lines{words}",
            filtered.table,
            self.defaults.line(filtered)
        ))
    }

    /// The axes of a map, if two are long enough.
    fn two_axes(&self, wants_map: bool) -> Result<Option<(String, String)>, PlotError> {
        let Choice { filtered, defaults, varying, .. } = self;
        let longest = varying.iter().map(|axis| axis.values.len()).max().unwrap_or(0);
        let is_scattered =
            defaults.scatters && varying.len() > 1 && filtered.rows <= (map::MAX_SCATTERED_RATIO * longest) as u64;
        let least = if wants_map || is_scattered { 2 } else { defaults.least_map };
        // The axes of labelled points are points, not a grid: they make no map with another axis.
        let is_of_point = |axis: &str| filtered.is_of_point(axis);
        let has_points = match &self.request.x {
            Some(x) => is_of_point(x),
            None => varying.iter().all(|axis| is_of_point(&axis.name)),
        };
        let alike = varying.iter().copied().filter(|axis| is_of_point(&axis.name) == has_points).collect();
        let alike = Choice { varying: alike, ..*self };
        let first = self.request.x.clone().or_else(|| alike.find(defaults.x, None, least));
        let Some(first) = first.filter(|_| least < usize::MAX) else { return Ok(None) };
        // An axis that changes only with the first one would make a map of a single line.
        let mut others = Vec::new();
        for name in [defaults.y, defaults.x].concat() {
            if filtered.axis(name).is_some_and(Values::varies) && !filtered.follows(name, &first)? {
                others.push(name);
            }
        }
        Ok(alike.find(&others, Some(&first), least).map(|second| (first, second)))
    }

    fn map(&self, x: String, y: String) -> Result<Shape, PlotError> {
        let value = self.request.colour.clone().map_or_else(|| self.value(), Ok)?;
        Ok(Shape::Map(map::MapColumns { x, y, value }))
    }

    /// The colour column: varying words, or the first column with a value.
    fn value(&self) -> Result<String, PlotError> {
        let Choice { filtered, defaults, .. } = self;
        for class in defaults.classes.iter().filter(|class| filtered.has(class)) {
            if filtered.values(&[class])?.0.iter().any(Values::varies) {
                return Ok((*class).to_owned());
            }
        }
        let columns: Vec<&str> = defaults.value.iter().copied().filter(|column| filtered.has(column)).collect();
        let mut found = vec![false; columns.len()];
        filtered.each_while(&columns, |row| {
            found.iter_mut().zip(row).for_each(|(found, cell)| *found |= cell.is_finite());
            !found.first().is_some_and(|first| *first)
        })?;
        let place = found.iter().position(|&found| found).ok_or(PlotError::Nothing)?;
        Ok(columns[place].to_owned())
    }
}
