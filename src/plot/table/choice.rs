//! Which axes and columns a picture shows: what varies in the table, unless the user says otherwise.

use super::Request;
use super::lines;
use super::map;
use super::survey::{Survey, Values};
use crate::plot::PlotError;

/// What a picture of a table shows by itself.
#[derive(Debug, Clone, Copy)]
pub struct Defaults {
    /// Horizontal axes, the one that is preferred first.
    pub x: &'static [&'static str],
    /// Vertical axes of a map.
    pub y: &'static [&'static str],
    /// Columns of words that colour a map where they vary.
    pub classes: &'static [&'static str],
    /// Columns of the colours of a map otherwise: the first that has a value.
    pub value: &'static [&'static str],
    /// Columns of lines, a panel each.
    pub lines: &'static [&'static str],
    /// Axes whose values are told apart by lines.
    pub series: &'static [&'static str],
    /// Values of both axes from which on a map is drawn.
    pub least_map: usize,
    /// Whether single points of a plane, such as materials, make a map however few they are: lines between them mean nothing.
    pub scatters: bool,
}

/// A map or lines.
#[derive(Debug, Clone)]
pub enum Shape {
    /// Colours over two axes.
    Map(map::Plan),
    /// Columns over an axis.
    Lines(lines::Plan),
}

/// The shape of a picture.
pub fn choose(survey: &Survey, defaults: &Defaults, request: &Request) -> Result<Shape, PlotError> {
    let (x, y, colour) = (request.x.as_deref(), request.y.as_deref(), request.colour.as_deref());
    if let Some(x) = x {
        axis(survey, "--x", x)?;
    }
    for (argument, column) in [("--y", y), ("--color", colour)] {
        if let Some(column) = column {
            survey.check(argument, column)?;
        }
    }
    let is_axis = |name: &str| survey.axis(name).is_some();
    let varying: Vec<&Values> = survey.axes.iter().filter(|axis| axis.varies()).collect();
    let find = |names: &[&str], not: Option<&str>, least: usize| -> Option<String> {
        let fits = |axis: &&&Values| Some(axis.name.as_str()) != not && (axis.values.len() >= least || axis.many);
        let named = names.iter().find_map(|name| varying.iter().filter(fits).find(|axis| axis.name == *name));
        Some(named?.name.clone())
    };
    let longest = || {
        let long = varying.iter().filter(|axis| axis.words.is_empty());
        long.max_by_key(|axis| axis.values.len()).map(|axis| axis.name.clone())
    };
    let value = || {
        for class in defaults.classes.iter().filter(|class| survey.has(class)) {
            let mut seen = None;
            let mut varies = false;
            survey.each_while(&[class], |row| {
                varies |= row[0].is_finite() && seen.is_some_and(|seen| seen != row[0]);
                seen = seen.or(Some(row[0]).filter(|place| place.is_finite()));
                !varies
            })?;
            if varies {
                return Ok((*class).to_owned());
            }
        }
        let there = defaults.value.iter().filter(|column| survey.has(column));
        let mut columns: Vec<String> = there.map(|&column| column.to_owned()).collect();
        // The first in which any row has a value.
        let mut found = vec![false; columns.len()];
        let names: Vec<&str> = columns.iter().map(String::as_str).collect();
        survey.each_while(&names, |row| {
            found.iter_mut().zip(row).for_each(|(found, cell)| *found |= cell.is_finite());
            !found.first().is_some_and(|first| *first)
        })?;
        let place = found.iter().position(|&found| found).ok_or(PlotError::Nothing)?;
        Ok::<String, PlotError>(columns.swap_remove(place))
    };
    let as_map = |x: String, y: String| -> Result<Shape, PlotError> {
        let value = match colour {
            Some(column) => column.to_owned(),
            None => value()?,
        };
        Ok(Shape::Map(map::Plan { x, y, value }))
    };
    // Two axes, or a column of colours, ask for a map; another column for lines.
    if let Some(y) = y.filter(|y| is_axis(y)) {
        let x = x.map(str::to_owned).or_else(|| find(defaults.x, Some(y), 2)).or_else(longest);
        let x = x.filter(|x| x != y).ok_or_else(|| PlotError::OneRow { table: survey.table.clone() })?;
        return as_map(x, y.to_owned());
    }
    let wants_map = colour.is_some_and(|colour| !is_axis(colour));
    let wants_lines = y.is_some() || colour.is_some_and(is_axis);
    let longest_axis = varying.iter().map(|axis| axis.values.len()).max().unwrap_or(0);
    let is_scattered = defaults.scatters && varying.len() > 1 && survey.rows <= 2 * longest_axis as u64;
    let least = if wants_map || is_scattered { 2 } else { defaults.least_map };
    let first = x.map(str::to_owned).or_else(|| find(defaults.x, None, least));
    if let Some(first) = first.filter(|_| !wants_lines && least < usize::MAX) {
        // An axis that only changes along with the first would make a map of a single line.
        // One of the grid comes before one that is computed from others.
        let others = [defaults.y, defaults.x].concat();
        let (gridded, computed): (Vec<&str>, Vec<&str>) = others.into_iter().partition(|name| survey.gridded.has(name));
        for second in [gridded, computed].concat() {
            if let Some(second) = find(&[second], Some(&first), least)
                && !survey.follows(&second, &first)?
            {
                return as_map(first, second);
            }
        }
    }
    if wants_map {
        return Err(PlotError::NoMap { table: survey.table.clone(), column: colour.unwrap_or_default().to_owned() });
    }
    let preferred = || find(defaults.x, colour, 3).or_else(longest).or_else(|| find(defaults.x, colour, 2));
    let x = x.map(str::to_owned).or_else(preferred).ok_or_else(|| PlotError::OneRow { table: survey.table.clone() })?;
    let columns = match y {
        Some(y) => vec![y.to_owned()],
        None => defaults.lines.iter().filter(|column| survey.has(column)).map(|&column| column.to_owned()).collect(),
    };
    let series = colour.map(str::to_owned).or_else(|| find(defaults.series, Some(&x), 2));
    Ok(Shape::Lines(lines::Plan { x, log: Vec::new(), y: columns, series }))
}

fn axis(survey: &Survey, argument: &str, name: &str) -> Result<(), PlotError> {
    let found: Vec<String> = survey.axes.iter().map(|axis| axis.name.clone()).collect();
    if found.iter().any(|axis| axis == name) {
        return Ok(());
    }
    let (argument, table) = (argument.to_owned(), survey.table.clone());
    Err(PlotError::NoColumn { argument, table, what: "axis", name: name.to_owned(), found })
}
