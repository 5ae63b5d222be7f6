//! Lines: columns over an axis, a panel for each column and a line for each group of the further axes.

use super::cells::AxisCells;
use super::filtered::FilteredTable;
use super::groups::{self, GroupRole, Groups};
use indexmap::IndexSet;

use crate::plot::colour;
use crate::plot::figure::{Axis, Entry, Figure, Key, Layer, MAX_MARKED_POINTS, Panel};
use crate::plot::scale::{CONSTANT_RTOL, Scale, range};
use crate::plot::symbol::Symbol;
use crate::plot::{PlotError, coincide, label};

/// Greatest number of positions along a line; with more rows, several fall on one position. Chosen: more are invisible in print.
pub const MAX_POSITIONS: usize = 4096;

/// Ratio of height to width of a single panel, and of several above each other. Chosen: curves rise by about 45 degrees, and all panels fit on a
/// page.
pub const ASPECTS: [f64; 2] = [0.7, 0.45];

/// Space beyond the first and the last point, as a fraction of the axes. Chosen: no mark touches the frame.
pub const MARK_ROOM: [f64; 2] = [0.02, 0.06];

/// The plan of lines.
#[derive(Debug, Clone)]
pub struct LineColumns {
    /// Column of the horizontal axis.
    pub x: String,
    /// Columns of the panels, from the top.
    pub y: Vec<String>,
    /// The axis or label that distinguishes lines first, or dots.
    pub series: Option<String>,
    /// Whether rows are dots with a symbol for each value of `series`.
    pub has_symbols: bool,
}

/// Lines before they are drawn.
#[derive(Debug)]
pub struct LineFigure {
    /// The figure.
    pub figure: Figure,
    /// The group of each line.
    pub groups: Groups,
    /// For each line, the first line with which it coincides; only that one is drawn.
    pub leaders: Vec<usize>,
}

/// The rows of a table along the horizontal axis, by group.
struct Rows {
    groups: Groups,
    cells: AxisCells,
    lines: Vec<Line>,
    /// For each panel, whether a row has no value.
    has_nulls: Vec<bool>,
    /// Whether rows are scattered points, such as materials, without lines between them.
    are_scattered: bool,
}

/// The rows of a group: a position for each cell of the axis or, if rows are scattered, for each row.
struct Line {
    positions: Vec<f64>,
    /// For each panel, the least and the greatest value of each position.
    ranges: Vec<Vec<(f64, f64)>>,
    /// The name of each position; empty if rows have no names.
    names: Vec<String>,
}

/// A panel with its curves, one for each line.
struct Graph {
    panel: Panel,
    curves: Vec<Vec<(f64, f64)>>,
    /// The column as an equation, if it is constant.
    constant: Option<String>,
    /// Whether values are below the logarithmic axis.
    is_cut: bool,
}

/// Draws the lines.
///
/// # Errors
///
/// No row with a value, or a part that cannot be read.
pub fn lines(filtered: &FilteredTable, plan: &LineColumns) -> Result<LineFigure, PlotError> {
    let rows = Rows::read(filtered, plan)?;
    let x = rows.cells.ends().with_room(MARK_ROOM[0]);
    let graphs = (0..plan.y.len()).filter_map(|panel| rows.graph(filtered, plan, panel, x));
    // A constant column is stated instead of drawn, unless all columns are constant.
    let (mut stated, mut drawn): (Vec<Graph>, Vec<Graph>) = graphs.partition(|graph| graph.constant.is_some());
    if drawn.is_empty() {
        drawn = std::mem::take(&mut stated);
    }
    if drawn.is_empty() {
        return Err(PlotError::Nothing);
    }
    let leaders = rows.leaders(&drawn);
    let mut notes = Vec::new();
    if drawn.iter().any(|graph| graph.is_cut) {
        notes.push("Zeros, and rounding errors in their place, are below the logarithmic axes.".to_owned());
    }
    if rows.has_ranges() {
        let (count, name) = (rows.cells.len(), label::name(&plan.x));
        notes.push(match rows.cells.exact {
            true => format!("Values of {name} have several rows each: the least and the greatest are drawn."),
            false => {
                format!("{count} values of {name} have several rows each: their least and greatest values are drawn.")
            }
        });
    }
    let leaves_out = |panel| is_gap_of_families(filtered, plan, panel) && rows.values(panel).any(|value| value <= 0.0);
    if (0..plan.y.len()).any(leaves_out) {
        notes.push("Gaps below zero are not drawn.".to_owned());
    }
    let mut figure = Figure { columns: 1, ..rows.groups.figure(0.0) };
    figure.aspect = ASPECTS[usize::from(plan.y.len() > 1)];
    let words = rows.groups.held.iter().cloned().chain(stated.into_iter().filter_map(|graph| graph.constant));
    figure.subtitle = words.collect::<Vec<_>>().join(", ");
    figure.legend = rows.legend(&drawn, &leaders);
    figure.notes.extend(notes);
    figure.panels = drawn.into_iter().map(|graph| rows.draw(graph, &leaders)).collect();
    Ok(LineFigure { figure, groups: rows.groups, leaders })
}

/// Whether a panel shows the gaps of families, which have a logarithmic scale: gaps of steps that do not reach the final state are negative, the
/// others span decades.
fn is_gap_of_families(filtered: &FilteredTable, plan: &LineColumns, panel: usize) -> bool {
    filtered.table == "shortcut" && plan.y[panel] == "gap"
}

impl Rows {
    /// Reads the rows of a table.
    fn read(filtered: &FilteredTable, plan: &LineColumns) -> Result<Rows, PlotError> {
        let axis = filtered.axis(&plan.x).filter(|axis| !axis.values.is_empty()).ok_or(PlotError::Nothing)?;
        let series = plan.series.as_deref();
        let of_symbols = series.filter(|_| plan.has_symbols);
        let of_axis = of_symbols.filter(|name| !filtered.is_label(name));
        let over: Vec<&str> = [plan.x.as_str()].into_iter().chain(of_axis).collect();
        let makes = if plan.has_symbols { GroupRole::Symbols } else { GroupRole::Lines };
        let (mut further, along) = groups::further(filtered, &over, makes)?;
        let are_scattered = plan.has_symbols || groups::is_scattered(filtered, &plan.x, &further)?;
        // A label distinguishes lines also where the axes of its points do not. Scattered points have names instead.
        further.extend(
            series.filter(|name| plan.has_symbols || !are_scattered && filtered.label_columns().contains(name)),
        );
        further.sort_by_key(|name| Some(*name) != series);
        let first = further.first().copied().filter(|name| Some(*name) == series);
        let drawn: Vec<&str> = plan.y.iter().map(String::as_str).collect();
        let mut groups = Groups::new(filtered, &further, makes, first, [&[&plan.x], &drawn])?;
        groups.along = along;
        let labels = if are_scattered { filtered.names_of_dots(of_symbols)? } else { Vec::new() };
        let cells = AxisCells::new(axis, MAX_POSITIONS);
        let has_row_each = are_scattered && filtered.rows <= MAX_POSITIONS as u64;
        let positions = if has_row_each { Vec::new() } else { cells.middles.clone() };
        let ranges = vec![vec![(f64::NAN, f64::NAN); positions.len()]; plan.y.len()];
        let line = |_| Line { positions: positions.clone(), ranges: ranges.clone(), names: Vec::new() };
        let mut lines: Vec<Line> = groups.shown.iter().map(line).collect();
        let mut has_nulls = vec![false; plan.y.len()];
        groups.each(filtered, &[&[plan.x.as_str()], &drawn[..], &labels].concat(), |group, row| {
            let (values, named) = row[1..].split_at(plan.y.len());
            let Some(mut place) = cells.place(row[0]) else { return };
            let line = &mut lines[group];
            if has_row_each {
                place = line.positions.len();
                line.positions.push(row[0]);
                line.ranges.iter_mut().for_each(|ranges| ranges.push((f64::NAN, f64::NAN)));
                line.names.extend((!labels.is_empty()).then(|| filtered.label(&labels, named)));
            }
            for ((ranges, has_nulls), &value) in line.ranges.iter_mut().zip(&mut has_nulls).zip(values) {
                *has_nulls |= value.is_nan();
                let (low, high) = ranges[place];
                ranges[place] = (low.min(value), high.max(value));
            }
        })?;
        Ok(Rows { groups, cells, lines, has_nulls, are_scattered })
    }

    /// The finite values of a panel.
    fn values(&self, panel: usize) -> impl Iterator<Item = f64> {
        let all = self.lines.iter().flat_map(move |line| &line.ranges[panel]).flat_map(|(low, high)| [*low, *high]);
        all.filter(|value| value.is_finite())
    }

    /// A panel without layers and its curves, if anything in it has a value.
    fn graph(&self, filtered: &FilteredTable, plan: &LineColumns, panel: usize, x: Scale) -> Option<Graph> {
        let is_log = is_gap_of_families(filtered, plan, panel);
        let scale = match is_log {
            true => Scale { log: true, ..Scale::of(self.values(panel).filter(|value| *value > 0.0))? },
            false => Scale::of(self.values(panel))?,
        };
        // A column of zeros needs no negative range.
        let scale = if scale.low == 0.0 && scale.high == 0.0 { Scale { high: 1.0, ..scale } } else { scale };
        let axis = |column: &str, scale| Axis::new(column, &filtered.unit(column), scale);
        let (x, y) = (axis(&plan.x, x), axis(&plan.y[panel], scale.with_room(MARK_ROOM[1])));
        let (low, high) = range(self.values(panel));
        let is_constant = !self.has_nulls[panel] && high - low <= CONSTANT_RTOL * low.abs().max(high.abs());
        Some(Graph {
            constant: is_constant.then(|| label::equation(&y.column, &label::number(low), &y.unit)),
            panel: Panel { title: String::new(), x, y, layers: Vec::new() },
            curves: self.lines.iter().map(|line| line.curve(panel)).collect(),
            is_cut: !is_log && scale.log && self.values(panel).any(|value| value < scale.low),
        })
    }

    /// Whether some position has several values.
    fn has_ranges(&self) -> bool {
        self.lines.iter().flat_map(|line| &line.ranges).flatten().any(|(low, high)| high > low)
    }

    /// For each line, the number of its name: lines of one label share a colour.
    fn series(&self) -> Vec<usize> {
        let mut names: IndexSet<&str> = IndexSet::new();
        self.groups.shown.iter().map(|group| names.insert_full(&group.name).0).collect()
    }

    /// For each line, the first line with which it coincides in all panels.
    fn leaders(&self, graphs: &[Graph]) -> Vec<usize> {
        let fraction = |graph: &Graph, line: usize| -> Vec<(f64, f64)> {
            graph.curves[line].iter().map(|&(x, y)| (x, graph.panel.y.scale.fraction(y))).collect()
        };
        let fractions: Vec<Vec<_>> =
            (0..self.lines.len()).map(|line| graphs.iter().map(|graph| fraction(graph, line)).collect()).collect();
        coincide::leaders(self.lines.len(), |one, other| {
            let mut panels = fractions[one].iter().zip(&fractions[other]);
            !self.are_scattered && panels.all(|(one, other)| coincide::at_places(one, other))
        })
    }

    /// Whether the points of a curve are marked.
    fn is_marked(&self, curve: &[(f64, f64)]) -> bool {
        self.are_scattered
            || self.cells.exact && curve.iter().filter(|(_, y)| y.is_finite()).count() < MAX_MARKED_POINTS
    }

    /// The panel with the curves that are drawn.
    fn draw(&self, Graph { mut panel, curves, .. }: Graph, leaders: &[usize]) -> Panel {
        let all = self.series();
        for (line, points) in curves.into_iter().enumerate().filter(|(line, _)| leaders[*line] == *line) {
            let series = all[line];
            if !self.are_scattered {
                panel.layers.push(Layer::Line(points.clone(), colour::series(series)));
            }
            let named = points.iter().copied().zip(self.lines[line].names.iter().cloned());
            let named = named.filter(|((_, y), name)| y.is_finite() && !name.is_empty());
            panel.layers.push(Layer::Names(named.collect()));
            if self.is_marked(&points) {
                panel.layers.push(Layer::marks(points, series));
            }
        }
        panel
    }

    fn legend(&self, graphs: &[Graph], leaders: &[usize]) -> Vec<Entry> {
        let series = self.series();
        // Each name once, at its first line that is drawn, if there is one.
        let mut lines: Vec<usize> = (0..series.len()).collect();
        lines.sort_by_key(|&line| (series[line], leaders[line] != line));
        lines.dedup_by_key(|line| series[*line]);
        let names: Vec<&str> = lines.iter().map(|&line| self.groups.shown[line].name.as_str()).collect();
        let leaders: Vec<usize> = lines.iter().map(|&line| series[leaders[line]]).collect();
        Entry::of_series(&names, &leaders, |place| match self.are_scattered {
            true => Key::Mark(Symbol::of_series(place)),
            false => Key::series(place, graphs.iter().any(|graph| self.is_marked(&graph.curves[lines[place]]))),
        })
    }
}

impl Line {
    /// The points of a curve; where positions have several values, the least ones and then, after a gap, the greatest.
    fn curve(&self, panel: usize) -> Vec<(f64, f64)> {
        let ranges = &self.ranges[panel];
        let places = || self.positions.iter().copied().zip(ranges);
        let mut points: Vec<(f64, f64)> = places().map(|(position, (low, _))| (position, *low)).collect();
        if ranges.iter().any(|(low, high)| high > low) {
            points.push((f64::NAN, f64::NAN));
            points.extend(places().map(|(position, (_, high))| (position, *high)));
        }
        points
    }
}
