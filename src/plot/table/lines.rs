//! Lines: columns over an axis, a panel for each column and a line for each group of the further axes.

use super::cells::AxisCells;
use super::groups::{self, Groups};
use super::survey::Survey;
use crate::plot::colour::{self, MOST_SERIES};
use crate::plot::figure::{Axis, Entry, Figure, Key, Layer, Marker, Panel};
use crate::plot::scale::Scale;
use crate::plot::{PlotError, label};

/// Most places along a line: more are not seen in print.
const MOST_PLACES: usize = 4096;

/// Lines of at most so many points have a mark at each.
const MARKED: usize = 12;

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
    further.sort_by_key(|name| Some(*name) != plan.series.as_deref());
    let names = further.clone();
    let mut groups = Groups::new(
        survey,
        &further,
        MOST_SERIES,
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
    let mut key = Vec::new();
    survey.each(&wanted, |row| {
        key.clear();
        key.extend_from_slice(&row[fixed..]);
        alike(&further, &mut key);
        let (Some(group), Some(place)) = (groups.place(&key), cells.place(row[0])) else { return };
        for (panel, &value) in row[1..fixed].iter().enumerate() {
            let range = &mut ranges[group][panel][place];
            *range = (range.0.min(value), range.1.max(value));
        }
    })?;
    let is_empty = |group: &Vec<Vec<(f64, f64)>>| group.iter().flatten().all(|(low, _)| low.is_nan());
    let mut keep = ranges.iter().map(|group| !is_empty(group)).collect::<Vec<bool>>().into_iter();
    let left_out = groups.retain(|| keep.next().unwrap_or(true));
    ranges.retain(|group| !is_empty(group));
    let x = span(&cells);
    let mut leaves_out = false;
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
        // What is zero throughout is never below zero.
        let scale = if scale.low == 0.0 && scale.high == 0.0 { Scale { high: 1.0, ..scale } } else { scale };
        let mut layers = Vec::new();
        for (place, group) in ranges.iter().enumerate() {
            let mut points = Vec::with_capacity(cells.len());
            for (&middle, &(low, high)) in cells.middles.iter().zip(&group[panel]) {
                points.push((middle, low));
                if high > low {
                    points.push((middle, high));
                }
            }
            if cells.len() <= MARKED {
                layers.push(Layer::Lines(vec![points.clone()], colour::series(place)));
                points.retain(|(_, value)| value.is_finite());
                layers.push(Layer::Points(points, Marker { series: place }));
            } else {
                layers.push(Layer::Lines(vec![points], colour::series(place)));
            }
        }
        figure.panels.push(Panel {
            title: String::new(),
            x: Axis { column: plan.x.clone(), unit: survey.unit(&plan.x), scale: x },
            y: Axis { column: column.clone(), unit: survey.unit(column), scale: scale.with_room(0.06) },
            layers,
        });
    }
    if figure.panels.is_empty() {
        return Err(PlotError::Nothing);
    }
    if groups.shown.len() > 1 {
        for (place, group) in groups.shown.iter().enumerate() {
            figure.legend.push(Entry { key: Key::Line(colour::series(place)), text: group.name.clone() });
        }
    }
    figure.notes.extend(groups.note("lines"));
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
    Ok(Lined { figure, groups, x, leaves_out })
}

/// The range of the values themselves, with a little room.
fn span(cells: &AxisCells) -> Scale {
    let (low, high) = (cells.middles[0], cells.middles[cells.len() - 1]);
    Scale { low, high, log: cells.scale.log }.with_room(if low < high { 0.02 } else { 0.0 })
}
