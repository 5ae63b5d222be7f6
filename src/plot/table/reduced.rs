//! Landscapes that were reduced while they were computed: quantiles of the gap over an axis, and bars of a histogram.

use super::cells::AxisCells;
use super::groups::{self, Groups};
use super::map::columns_of;
use super::survey::Survey;
use crate::plot::canvas::Stroke;
use crate::plot::figure::{Axis, Entry, Figure, Key, Layer, Marker, Panel};
use crate::plot::scale::Scale;
use crate::plot::{PlotError, colour, label};
use crate::table::{HISTOGRAM_EDGES, REDUCED, Table};

/// Most panels of a figure.
const MOST_PANELS: usize = 9;

/// The horizontal axes, the one that is preferred first.
const ACROSS: [&str; 5] = ["t_f", "v_f", "v_i", "b", "a"];

/// Shades of the outer and of the inner quantiles.
const OUTER: [u8; 3] = [0xd7, 0xe8, 0xf5];
const INNER: [u8; 3] = [0x9e, 0xc4, 0xe4];

/// The columns of quantiles, and the share of the shortcuts that does not exceed each.
const QUANTILES: [(&str, f64); 7] = [
    ("gap_min", 0.0),
    ("gap_q05", 0.05),
    ("gap_q25", 0.25),
    ("gap_q50", 0.5),
    ("gap_q75", 0.75),
    ("gap_q95", 0.95),
    ("gap_max", 1.0),
];

/// Curves through fewer points show them.
const MARKED: usize = 50;

/// The columns of a reduced table, without the number of shortcuts.
fn columns(survey: &Survey) -> Vec<&'static str> {
    let table = REDUCED.iter().map(|(_, table)| *table).find(|table| table.name() == survey.table);
    let names = table.into_iter().flat_map(Table::columns).skip(1).map(|column| column.name);
    names.filter(|name| survey.has(name)).collect()
}

/// A figure of panels that all have the same axes, one for each group.
fn panels(groups: &Groups) -> Figure {
    let columns = groups.crossed.as_ref().map_or_else(|| columns_of(groups.shown.len()), |[_, columns]| columns.len());
    Figure {
        columns,
        rows: groups.crossed.clone().map_or_else(Vec::new, |[rows, _]| rows),
        aspect: if groups.shown.len() > 1 { 0.9 } else { 0.7 },
        shared: true,
        subtitle: groups.held.join(", "),
        remarks: groups.note("panels").into_iter().collect(),
        ..Figure::default()
    }
}

/// The title of a panel.
fn title(groups: &Groups, place: usize) -> String {
    match &groups.crossed {
        Some([_, columns]) => columns.get(place).cloned().unwrap_or_default(),
        None => groups.shown[place].name.clone(),
    }
}

/// Bars: how many shortcuts have which gap.
pub fn histogram(survey: &Survey) -> Result<(Figure, Vec<String>), PlotError> {
    let columns = columns(survey);
    let (further, along) = groups::further(survey, &[])?;
    let groups = Groups::new(survey, &further, (MOST_PANELS, true), |_| {}, |_| false)?;
    let wanted: Vec<&str> = columns.iter().copied().chain(groups.axes.iter().map(String::as_str)).collect();
    let mut counts = vec![vec![0.0; columns.len()]; groups.shown.len()];
    survey.each(&wanted, |row| {
        let (classes, key) = row.split_at(columns.len());
        let Some(group) = groups.place(key) else { return };
        // Rows that no axis tells apart are counted together.
        counts[group]
            .iter_mut()
            .zip(classes)
            .for_each(|(all, count)| *all += if count.is_nan() { 0.0 } else { *count });
    })?;
    let edges = edges();
    if columns.len() < edges.len() {
        return Err(PlotError::Nothing);
    }
    // Classes that are empty everywhere at both ends are not drawn.
    let is_used = |class: &usize| counts.iter().any(|counts| counts[*class] > 0.0);
    let Some(first) = (0..edges.len()).find(is_used) else { return Err(PlotError::Nothing) };
    let last = (0..edges.len()).rev().find(is_used).unwrap_or(first);
    let x = Scale { low: edges[first].0, high: edges[last].1, log: true };
    let most = counts.iter().flatten().fold(0.0_f64, |most, count| most.max(*count));
    let y = Scale { low: 0.0, high: 1.06 * most, log: false };
    let mut figure = panels(&groups);
    for (place, counts) in counts.iter().enumerate() {
        let bars = edges.iter().zip(counts).map(|(&(from, to), &count)| (from, to, count));
        figure.panels.push(Panel {
            title: title(&groups, place),
            x: Axis { column: "gap".to_owned(), unit: "1".to_owned(), scale: x },
            y: Axis { column: "shortcuts".to_owned(), unit: "1".to_owned(), scale: y },
            layers: vec![Layer::Bars(bars.collect(), INNER)],
        });
    }
    let (least, greatest) = (label::number(edges[0].1), label::number(edges[edges.len() - 1].0));
    if first == 0 {
        figure.notes.push(format!("The first bar holds all gaps below {least}."));
    }
    if last + 1 == edges.len() {
        figure.notes.push(format!("The last bar holds all gaps from {greatest} on."));
    }
    figure.notes.extend(along);
    Ok((figure, Vec::new()))
}

/// Where the classes begin and end: a decade each, also the first and the last, which are open.
fn edges() -> Vec<(f64, f64)> {
    let inner = HISTOGRAM_EDGES;
    let starts = [inner[0] / 10.0].into_iter().chain(inner);
    starts.zip(inner.into_iter().chain([10.0 * inner[inner.len() - 1]])).collect()
}

/// Bands: the quantiles of the gap over an axis; of a single landscape, the share of its shortcuts over the gap.
pub fn quantiles(survey: &Survey) -> Result<(Figure, Vec<String>), PlotError> {
    let varies = |name: &&&str| survey.axis(name).is_some_and(|axis| axis.values.len() > 2 || axis.many);
    let across = ACROSS
        .iter()
        .find(varies)
        .or_else(|| ACROSS.iter().find(|name| survey.axis(name).is_some_and(|axis| axis.varies())));
    let columns: Vec<(&str, f64)> = QUANTILES.into_iter().filter(|(name, _)| survey.has(name)).collect();
    match across {
        Some(across) => bands(survey, across, &columns),
        None => distribution(survey, &columns),
    }
}

fn bands(survey: &Survey, across: &str, columns: &[(&str, f64)]) -> Result<(Figure, Vec<String>), PlotError> {
    let (further, along) = groups::further(survey, &[across])?;
    let groups = Groups::new(survey, &further, (MOST_PANELS, true), |_| {}, |_| false)?;
    let axis = survey.axis(across).ok_or(PlotError::Nothing)?;
    let cells = AxisCells::new(axis, 1024);
    let mut values = vec![vec![vec![f64::NAN; cells.len()]; columns.len()]; groups.shown.len()];
    let wanted: Vec<&str> = [across]
        .into_iter()
        .chain(columns.iter().map(|(name, _)| *name))
        .chain(groups.axes.iter().map(String::as_str))
        .collect();
    survey.each(&wanted, |row| {
        let (found, key) = row[1..].split_at(columns.len());
        let (Some(group), Some(place)) = (groups.place(key), cells.place(row[0])) else { return };
        values[group].iter_mut().zip(found).for_each(|(column, value)| column[place] = *value);
    })?;
    let y = Scale::of(values.iter().flatten().flatten().copied()).ok_or(PlotError::Nothing)?.with_room(0.04);
    let (low, high) = (cells.middles[0], cells.middles[cells.len() - 1]);
    let x = Scale { low, high, log: cells.scale.log }.with_room(0.02);
    let place = |name: &str| columns.iter().position(|(column, _)| *column == name);
    let styles = [
        ("gap_q50", "median", colour::series(0)),
        ("gap_min", "least", colour::series(2)),
        ("gap_max", "greatest", colour::series(1)),
    ];
    let is_marked = cells.exact && cells.len() < MARKED;
    let mut figure = panels(&groups);
    for (group, values) in values.iter().enumerate() {
        let mut layers = Vec::new();
        for (low, high, shade) in [("gap_q05", "gap_q95", OUTER), ("gap_q25", "gap_q75", INNER)] {
            let (Some(low), Some(high)) = (place(low), place(high)) else { continue };
            let points = cells.middles.iter().zip(values[low].iter().zip(&values[high]));
            layers.push(Layer::Band(points.map(|(x, (low, high))| (*x, *low, *high)).collect(), shade));
        }
        for (series, (name, _, stroke)) in styles.iter().enumerate() {
            let Some(column) = place(name) else { continue };
            let points: Vec<(f64, f64)> = cells.middles.iter().copied().zip(values[column].iter().copied()).collect();
            layers.push(Layer::Lines(vec![points.clone()], stroke.clone()));
            if is_marked {
                let points = points.into_iter().filter(|(_, value)| value.is_finite()).collect();
                layers.push(Layer::Points(points, Marker { series: SERIES[series] }));
            }
        }
        figure.panels.push(Panel {
            title: title(&groups, group),
            x: Axis { column: across.to_owned(), unit: survey.unit(across), scale: x },
            y: Axis { column: "gap".to_owned(), unit: "1".to_owned(), scale: y },
            layers,
        });
    }
    for (series, (name, text, stroke)) in styles.into_iter().enumerate() {
        if place(name).is_some() {
            let marker = Marker { series: SERIES[series] };
            let key = if is_marked { Key::Marked(stroke, marker) } else { Key::Line(stroke) };
            figure.legend.push(Entry { key, text: text.to_owned() });
        }
    }
    for (low, high, shade, text) in
        [("gap_q25", "gap_q75", INNER, "25 % to 75 %"), ("gap_q05", "gap_q95", OUTER, "5 % to 95 % of the shortcuts")]
    {
        if place(low).is_some() && place(high).is_some() {
            figure.legend.push(Entry { key: Key::Fill(shade), text: text.to_owned() });
        }
    }
    figure.notes.extend(along);
    Ok((figure, vec![across.to_owned()]))
}

/// The series of the median, the least and the greatest gap.
const SERIES: [usize; 3] = [0, 2, 1];

fn distribution(survey: &Survey, columns: &[(&str, f64)]) -> Result<(Figure, Vec<String>), PlotError> {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut points = Vec::new();
    survey.each(&names, |row| {
        points = row.iter().copied().zip(columns.iter().map(|(_, share)| 100.0 * share)).collect();
    })?;
    points.retain(|(gap, _): &(f64, f64)| gap.is_finite());
    let x = Scale::of(points.iter().map(|(gap, _)| *gap)).ok_or(PlotError::Nothing)?.with_room(0.04);
    let panel = Panel {
        title: String::new(),
        x: Axis { column: "gap".to_owned(), unit: "1".to_owned(), scale: x },
        y: Axis {
            column: "shortcuts of at most this gap".to_owned(),
            unit: "%".to_owned(),
            scale: Scale { low: 0.0, high: 100.0, log: false }.with_room(0.04),
        },
        layers: vec![
            Layer::Lines(vec![points.clone()], Stroke::solid("#000", 1.1)),
            Layer::Points(points, Marker { series: 0 }),
        ],
    };
    Ok((Figure { columns: 1, aspect: 0.7, panels: vec![panel], ..Figure::default() }, Vec::new()))
}
