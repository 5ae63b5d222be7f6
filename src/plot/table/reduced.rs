//! Pictures of reduced landscapes: quantiles of the gap over an axis, and histograms.

use super::PROTOCOL_DEFAULTS;
use super::cells::AxisCells;
use super::filtered::FilteredTable;
use super::groups::Groups;
use super::lines::{ASPECTS, MARK_ROOM, MAX_POSITIONS};
use super::map::DOT_ROOM;
use crate::plot::canvas::Stroke;
use crate::plot::figure::{Axis, Entry, Figure, Key, Layer, MAX_MARKED_POINTS, Panel};
use crate::plot::scale::Scale;
use crate::plot::{PlotError, colour, label};
use crate::table::{self, HISTOGRAM_EDGES, Table};

/// Shades of the outer and of the inner quantiles. Chosen: a light and a medium blue, the first as in maps of words.
const OUTER: [u8; 3] = colour::CLASSES[0];
const INNER: [u8; 3] = [0x9e, 0xc4, 0xe4];

/// The columns of quantiles, each with its fraction of shortcuts.
const QUANTILES: [(&str, f64); 7] = [
    ("gap_min", 0.0),
    ("gap_q05", 0.05),
    ("gap_q25", 0.25),
    ("gap_q50", 0.5),
    ("gap_q75", 0.75),
    ("gap_q95", 0.95),
    ("gap_max", 1.0),
];

/// The bands from back to front: lower and upper column, shade and name.
const BANDS: [(&str, &str, [u8; 3], &str); 2] =
    [("gap_q05", "gap_q95", OUTER, "5 % to 95 % of the shortcuts"), ("gap_q25", "gap_q75", INNER, "25 % to 75 %")];

/// The curves: column, name and series.
const CURVES: [(&str, &str, usize); 3] =
    [("gap_q50", "median", 0), ("gap_min", "least", 2), ("gap_max", "greatest", 1)];

/// Histogram: numbers of shortcuts by decade of the gap.
pub fn histogram(filtered: &FilteredTable) -> Result<Figure, PlotError> {
    // The classes, without the number of shortcuts.
    let names = table::find(&filtered.table).into_iter().flat_map(Table::columns).skip(1).map(|column| column.name);
    let columns: Vec<&str> = names.filter(|name| filtered.has(name)).collect();
    let groups = Groups::of_panels(filtered, &[], &[])?;
    let mut counts = vec![vec![0.0; columns.len()]; groups.shown.len()];
    groups.each(filtered, &columns, |group, row| {
        // Rows of one group are added.
        counts[group].iter_mut().zip(row).for_each(|(all, count)| *all += if count.is_nan() { 0.0 } else { *count });
    })?;
    let edges = edges();
    if columns.len() < edges.len() {
        return Err(PlotError::Nothing);
    }
    // Empty classes at both ends are not drawn.
    let is_used = |class: &usize| counts.iter().any(|counts| counts[*class] > 0.0);
    let Some(first) = (0..edges.len()).find(is_used) else { return Err(PlotError::Nothing) };
    let last = (0..edges.len()).rev().find(is_used).unwrap_or(first);
    let x = Scale { low: edges[first].0, high: edges[last].1, log: true };
    let most = counts.iter().flatten().fold(0.0_f64, |most, count| most.max(*count));
    let y = Scale { low: 0.0, high: (1.0 + MARK_ROOM[1]) * most, log: false };
    let mut figure = groups.figure(ASPECTS[0]);
    for (place, counts) in counts.iter().enumerate() {
        let bars = edges.iter().zip(counts).map(|(&(from, to), &count)| (from, to, count));
        figure.panels.push(Panel {
            title: groups.title(place),
            x: Axis::new("gap", "1", x),
            y: Axis::new("shortcuts", "1", y),
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
    Ok(figure)
}

/// The edges of the classes: one decade each, also for the open first and last classes.
fn edges() -> Vec<(f64, f64)> {
    let inner = HISTOGRAM_EDGES;
    let starts = [inner[0] / 10.0].into_iter().chain(inner);
    starts.zip(inner.into_iter().chain([10.0 * inner[inner.len() - 1]])).collect()
}

/// Bands of the quantiles of the gap over an axis; for a single landscape, the fraction of its shortcuts over the gap.
pub fn quantiles(filtered: &FilteredTable) -> Result<Figure, PlotError> {
    let has = |name: &str, least: usize| filtered.axis(name).is_some_and(|axis| axis.values.len() >= least);
    let across = [3, 2].into_iter().find_map(|least| PROTOCOL_DEFAULTS.x.iter().find(|name| has(name, least)));
    let columns: Vec<(&str, f64)> = QUANTILES.into_iter().filter(|(name, _)| filtered.has(name)).collect();
    match across {
        Some(across) => bands(filtered, across, &columns),
        None => distribution(filtered, &columns),
    }
}

/// The quantiles over an axis; bands and curves of columns that were not written are left out.
fn bands(filtered: &FilteredTable, across: &str, columns: &[(&str, f64)]) -> Result<Figure, PlotError> {
    let groups = Groups::of_panels(filtered, &[across], &[])?;
    let cells = AxisCells::new(filtered.axis(across).ok_or(PlotError::Nothing)?, MAX_POSITIONS);
    // For each group and column, the value at each position.
    let mut quantiles = vec![vec![vec![f64::NAN; cells.len()]; columns.len()]; groups.shown.len()];
    let names = columns.iter().map(|(name, _)| *name);
    let wanted: Vec<&str> = [across].into_iter().chain(names).collect();
    groups.each(filtered, &wanted, |group, row| {
        let Some(place) = cells.place(row[0]) else { return };
        quantiles[group].iter_mut().zip(&row[1..]).for_each(|(column, value)| column[place] = *value);
    })?;
    let all = quantiles.iter().flatten().flatten().copied();
    let y = Scale::of(all).ok_or(PlotError::Nothing)?.with_room(DOT_ROOM);
    let is_marked = cells.exact && cells.len() < MAX_MARKED_POINTS;
    let place = |name: &str| columns.iter().position(|(column, _)| *column == name);
    let mut figure = groups.figure(ASPECTS[0]);
    for (group, values) in quantiles.iter().enumerate() {
        let points = |column: usize| cells.middles.iter().copied().zip(values[column].iter().copied());
        let mut layers = Vec::new();
        for (low, high, shade, _) in BANDS {
            let (Some(low), Some(high)) = (place(low), place(high)) else { continue };
            let points = points(low).zip(&values[high]).map(|((x, low), high)| (x, low, *high));
            layers.push(Layer::Band(points.collect(), shade));
        }
        for (name, _, series) in CURVES {
            let Some(column) = place(name) else { continue };
            layers.push(Layer::Line(points(column).collect(), colour::series(series)));
            layers.extend(is_marked.then(|| Layer::marks(points(column).collect(), series)));
        }
        figure.panels.push(Panel {
            title: groups.title(group),
            x: Axis::new(across, &filtered.unit(across), cells.ends().with_room(MARK_ROOM[0])),
            y: Axis::new("gap", "1", y),
            layers,
        });
    }
    let entry = |key, text: &str| Entry { key, text: text.to_owned() };
    for (_, text, series) in CURVES.into_iter().filter(|(name, ..)| place(name).is_some()) {
        figure.legend.push(entry(Key::series(series, is_marked), text));
    }
    let is_drawn = |(low, high, ..): &(&str, &str, _, _)| place(low).and(place(high)).is_some();
    for (.., shade, text) in BANDS.into_iter().rev().filter(is_drawn) {
        figure.legend.push(entry(Key::Fill(shade), text));
    }
    Ok(figure)
}

fn distribution(filtered: &FilteredTable, columns: &[(&str, f64)]) -> Result<Figure, PlotError> {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut points = Vec::new();
    filtered.each(&names, |row| {
        points = row.iter().copied().zip(columns.iter().map(|(_, fraction)| 100.0 * fraction)).collect();
    })?;
    points.retain(|(gap, _): &(f64, f64)| gap.is_finite());
    let x = Scale::of(points.iter().map(|(gap, _)| *gap)).ok_or(PlotError::Nothing)?.with_room(DOT_ROOM);
    let y = Scale { low: 0.0, high: 100.0, log: false }.with_room(DOT_ROOM);
    let panel = Panel {
        title: String::new(),
        x: Axis::new("gap", "1", x),
        y: Axis::new("shortcuts of at most this gap", "%", y),
        layers: vec![Layer::Line(points.clone(), Stroke::solid("#000", 1.1)), Layer::marks(points, 0)],
    };
    Ok(Figure { columns: 1, aspect: ASPECTS[0], panels: vec![panel], ..Figure::default() })
}
