//! Lines: columns over an axis, a panel for each column and a line for each group of the further axes.

use super::cells::AxisCells;
use super::groups::{self, Groups};
use super::survey::Survey;
use crate::plot::colour::{self, MOST_SERIES};
use crate::plot::figure::{Axis, Entry, Figure, Key, Layer, Marker, Panel};
use crate::plot::scale::Scale;
use crate::plot::{PlotError, coincide, label};

/// Most places along a line: more are not seen in print.
const MOST_PLACES: usize = 4096;

/// Curves through fewer computed points show them.
const MARKED: usize = 50;

/// Most rows whose names stand beside their points.
const MOST_NAMED: u64 = 60;

/// Values of a column that differ less, relative to the greatest, are one value: what a picture shows of them is rounding.
const CONSTANT: f64 = 1e-9;

/// What lines show.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Column of the horizontal axis.
    pub x: String,
    /// Columns of the panels, from the top.
    pub y: Vec<String>,
    /// Where only logarithms or only values are of use, for each panel; else what the values ask for.
    pub log: Vec<Option<bool>>,
    /// The axis whose values are told apart first.
    pub series: Option<String>,
}

/// Lines before they are drawn.
#[derive(Debug)]
pub struct Lined {
    /// The figure.
    pub figure: Figure,
    /// The group of each line.
    pub groups: Groups,
    /// For each line the first one that it coincides with, which is drawn.
    pub leaders: Vec<usize>,
    /// The range of the horizontal axis.
    pub x: Scale,
    /// Whether a logarithm that was asked for leaves out values, which are not above zero.
    pub leaves_out: bool,
}

/// Draws the lines; `alike` makes values of the further axes NaN that mean nothing, and lines with such a value are shown before others.
pub fn lines(survey: &Survey, plan: &Plan, alike: impl Fn(&[&str], &mut [f64])) -> Result<Lined, PlotError> {
    let axis = survey.axis(&plan.x).ok_or(PlotError::Nothing)?;
    if axis.values.is_empty() {
        return Err(PlotError::Nothing);
    }
    let (mut further, along) = groups::further(survey, &[&plan.x])?;
    // Rows such as those of several materials, between which there is nothing.
    let is_scattered = groups::is_scattered(survey, &plan.x, &further)?;
    further.sort_by_key(|name| Some(*name) != plan.series.as_deref());
    let names = further.clone();
    let mut groups = Groups::new(
        survey,
        &further,
        (MOST_SERIES, false),
        |cells| alike(&names, cells),
        |cells| cells.iter().any(|cell| cell.is_nan()),
    )?;
    let axes = groups.axes.clone();
    let further: Vec<&str> = axes.iter().map(String::as_str).collect();
    let cells = AxisCells::new(axis, MOST_PLACES);
    // Least and greatest value of each place, panel and line.
    let mut ranges = vec![vec![vec![(f64::NAN, f64::NAN); cells.len()]; plan.y.len()]; groups.shown.len()];
    let mut wanted = vec![plan.x.as_str()];
    wanted.extend(plan.y.iter().map(String::as_str));
    let fixed = wanted.len();
    wanted.extend(&further);
    let labels = wanted.len();
    let is_named = is_scattered && survey.rows <= MOST_NAMED;
    wanted.extend(survey.label_columns().into_iter().filter(|_| is_named));
    let mut key = Vec::new();
    let mut names = vec![vec![String::new(); if is_named { cells.len() } else { 0 }]; groups.shown.len()];
    survey.each(&wanted, |row| {
        key.clear();
        key.extend_from_slice(&row[fixed..labels]);
        alike(&further, &mut key);
        let (Some(group), Some(place)) = (groups.place(&key), cells.place(row[0])) else { return };
        if is_named {
            names[group][place] = survey.label(&row[labels..]);
        }
        for (panel, &value) in row[1..fixed].iter().enumerate() {
            let range = &mut ranges[group][panel][place];
            *range = (range.0.min(value), range.1.max(value));
        }
    })?;
    let is_empty = |group: &Vec<Vec<(f64, f64)>>| group.iter().flatten().all(|(low, _)| low.is_nan());
    let mut keep = ranges.iter().map(|group| !is_empty(group)).collect::<Vec<bool>>().into_iter();
    let left_out = groups.retain(|| keep.next().unwrap_or(true));
    let mut keep = ranges.iter().map(|group| !is_empty(group)).collect::<Vec<bool>>().into_iter();
    names.retain(|_| keep.next().unwrap_or(true));
    ranges.retain(|group| !is_empty(group));
    let x = span(&cells);
    let (mut leaves_out, mut is_cut) = (false, false);
    let (mut curves, mut constants) = (Vec::new(), Vec::new());
    let mut figure =
        Figure { columns: 1, aspect: if plan.y.len() > 1 { 0.45 } else { 0.7 }, shared: true, ..Figure::default() };
    for (panel, column) in plan.y.iter().enumerate() {
        let all = ranges.iter().flat_map(|group| &group[panel]).flat_map(|(low, high)| [*low, *high]);
        let finite = all.filter(|value| value.is_finite());
        let wish = plan.log.get(panel).copied().flatten();
        let scale = match wish {
            Some(true) => {
                leaves_out |= finite.clone().any(|value| value <= 0.0);
                Scale::of(finite.clone().filter(|value| *value > 0.0)).map(|scale| Scale { log: true, ..scale })
            }
            Some(false) => Scale::of(finite.clone()).map(|scale| Scale { log: false, ..scale }),
            None => Scale::of(finite.clone()),
        };
        let Some(scale) = scale else { continue };
        if let Some(value) = constant(finite.clone()) {
            constants.push((column, value));
        }
        // What is zero throughout is never below zero.
        let scale = if scale.low == 0.0 && scale.high == 0.0 { Scale { high: 1.0, ..scale } } else { scale };
        is_cut |= wish.is_none() && scale.log && finite.clone().any(|value| value < scale.low);
        let curve = |group: &Vec<Vec<(f64, f64)>>| {
            let mut points = Vec::with_capacity(cells.len());
            for (&middle, &(low, high)) in cells.middles.iter().zip(&group[panel]) {
                points.push((middle, low));
                if high > low {
                    points.push((middle, high));
                }
            }
            points
        };
        curves.push(ranges.iter().map(curve).collect::<Vec<_>>());
        figure.panels.push(Panel {
            title: String::new(),
            x: Axis { column: plan.x.clone(), unit: survey.unit(&plan.x), scale: x },
            y: Axis { column: column.clone(), unit: survey.unit(column), scale: scale.with_room(0.06) },
            layers: Vec::new(),
        });
    }
    if figure.panels.is_empty() {
        return Err(PlotError::Nothing);
    }
    // A column that is the same everywhere is said, not drawn, unless there is nothing else.
    if constants.len() < figure.panels.len() {
        for (column, _) in &constants {
            let place = figure.panels.iter().position(|panel| panel.y.column == **column);
            place.map(|place| (figure.panels.remove(place), curves.remove(place)));
        }
        let said =
            |(column, value): &(&String, f64)| label::equation(column, &label::number(*value), &survey.unit(column));
        figure.subtitle = constants.iter().map(said).collect::<Vec<_>>().join(", ");
    }
    let count = groups.shown.len();
    let is_marked = |curve: &[(f64, f64)]| {
        is_scattered || cells.exact && curve.iter().filter(|(_, y)| y.is_finite()).count() < MARKED
    };
    let has_marks: Vec<bool> = (0..count).map(|group| curves.iter().any(|panel| is_marked(&panel[group]))).collect();
    let shares: Vec<Vec<Vec<(f64, f64)>>> = figure
        .panels
        .iter()
        .zip(&curves)
        .map(|(panel, curves)| {
            let share = |curve: &Vec<(f64, f64)>| curve.iter().map(|&(x, y)| (x, panel.y.scale.share(y))).collect();
            curves.iter().map(share).collect()
        })
        .collect();
    let leaders = coincide::leaders(count, |one, other| {
        !is_scattered && shares.iter().all(|panel| coincide::at_places(&panel[one], &panel[other]))
    });
    for (panel, curves) in figure.panels.iter_mut().zip(curves) {
        for (place, mut points) in curves.into_iter().enumerate().filter(|(place, _)| leaders[*place] == *place) {
            if !is_scattered {
                panel.layers.push(Layer::Lines(vec![points.clone()], colour::series(place)));
            }
            if is_named {
                let named = points.iter().filter_map(|&(x, y)| {
                    let name = names[place].get(cells.place(x)?)?.clone();
                    (y.is_finite() && !name.is_empty()).then_some(((x, y), name))
                });
                panel.layers.push(Layer::Names(named.collect()));
            }
            if is_marked(&points) {
                points.retain(|(_, value)| value.is_finite());
                panel.layers.push(Layer::Points(points, Marker { series: place }));
            }
        }
    }
    if count > 1 {
        for place in (0..count).filter(|&place| leaders[place] == place) {
            let (stroke, marker) = (colour::series(place), Marker { series: place });
            let key = match (is_scattered, has_marks[place]) {
                (true, _) => Key::Point(marker),
                (false, true) => Key::Marked(stroke, marker),
                (false, false) => Key::Line(stroke),
            };
            let names = groups.shown.iter().zip(&leaders).filter(|(_, leader)| **leader == place);
            let names: Vec<&str> = names.map(|(group, _)| group.name.as_str()).collect();
            figure.legend.push(Entry { key, text: names.join("; ") });
        }
    }
    figure.remarks.extend(groups.note("lines"));
    if is_cut {
        figure.notes.push("Zeros, and rounding errors in their place, are below the logarithmic axes.".to_owned());
    }
    figure.notes.extend(along);
    if !left_out.is_empty() {
        figure.notes.push(format!("No value for {}.", left_out.join("; ")));
    }
    if !cells.exact {
        figure.notes.push(format!(
            "Rows share {} places of {}: the least and the greatest of each are drawn.",
            cells.len(),
            label::name(&plan.x)
        ));
    }
    Ok(Lined { figure, groups, leaders, x, leaves_out })
}

/// The value that all of these are, if they are one.
fn constant(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    (high - low <= CONSTANT * low.abs().max(high.abs())).then_some(low)
}

/// The range of the values themselves, with a little room.
fn span(cells: &AxisCells) -> Scale {
    let (low, high) = (cells.middles[0], cells.middles[cells.len() - 1]);
    Scale { low, high, log: cells.scale.log }.with_room(if low < high { 0.02 } else { 0.0 })
}
