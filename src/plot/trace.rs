//! Pictures of traces: velocity, state variable and friction over time, or one column over another, for several traces together.

use std::collections::BTreeSet;
use std::path::Path;

use super::canvas::Stroke;
use super::colour::{self, MAX_SERIES};
use super::error::PlotError;
use super::figure::{Axis, Entry, Figure, Key, Layer, MAX_MARKED_POINTS, Panel};
use super::scale::Scale;
use super::{coincide, label};
use crate::dataset::frame::{self, Cells, Facts};
use crate::file;
use crate::grid::{self, Quantity};
use crate::model::{Scales, Units};
use crate::trace::{self, COLUMNS, Trace};

/// Greatest number of points of a line; longer lines are thinned. Chosen: four points per dot of a wide picture in print.
const MAX_POINTS: usize = 8000;

/// Ratio of height to width of one of several panels. Chosen: three of them make a square.
const ASPECT: f64 = 0.42;

/// Ratio of height to width of a single panel. Chosen: that of a slide.
const ASPECT_OF_ONE: f64 = 0.75;

/// The columns of each panel. The velocity of the block and the control velocity are in one panel.
const PANEL_COLUMNS: [&[&str]; 3] = [&["v", "v_c"], &["theta"], &["tau"]];

/// Unit of velocity axes in which the velocity floor is 1.
const UNIT_OF_BOUND: &str = "v_0";

/// A trace read from a file.
#[derive(Debug, Clone)]
pub struct TraceFile {
    /// Its name in a legend, in markup.
    pub name: String,
    /// Its parameters, by name.
    pub parameters: Vec<(String, f64)>,
    /// Its columns.
    pub columns: Vec<Column>,
    /// The requested number of equally spaced points, if any.
    pub points: Option<usize>,
}

/// A column of a trace.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its cells; NaN for null.
    pub cells: Vec<f64>,
}

/// Reads a trace that `slipsweep trace` wrote as CSV or Parquet.
///
/// # Errors
///
/// A file that cannot be read.
pub fn read(path: &Path) -> Result<TraceFile, PlotError> {
    let shown = path.display().to_string();
    let stem = path.file_stem().map_or_else(|| shown.clone(), |stem| stem.to_string_lossy().into_owned());
    let is_csv = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
    let (columns, facts) = if is_csv { csv(path, &shown)? } else { parquet(path)? };
    Ok(TraceFile::new(columns, &facts, stem))
}

impl TraceFile {
    /// A trace in memory, with its `facts`.
    pub fn of(trace: &Trace, units: &Units, facts: &[(String, String)]) -> TraceFile {
        let column = |place: usize| Column {
            name: COLUMNS[place].name.to_owned(),
            unit: units.name(trace::unit(place)).to_owned(),
            cells: trace.moments.iter().map(|moment| Trace::value(moment, place).unwrap_or(f64::NAN)).collect(),
        };
        TraceFile::new(trace.columns().into_iter().map(column).collect(), facts, "trace".to_owned())
    }

    /// The trace of these columns and facts, named `stem` if no fact names it.
    fn new(columns: Vec<Column>, facts: &[(String, String)], stem: String) -> TraceFile {
        let fact = |name: &str| facts.iter().find(|(key, _)| key == name).map(|(_, value)| value);
        let number = |name: &str| Some((name.to_owned(), fact(name)?.parse().ok()?));
        let parameters = Quantity::ALL.into_iter().filter(|quantity| *quantity != Quantity::Sampling);
        let parameters = parameters.filter_map(|quantity| number(quantity.name()));
        let after = |key: &str| fact(key).map_or(String::new(), |word| format!(", {word} {key}"));
        let is_unbounded = fact("velocity_bound").is_some_and(|bound| bound == "false");
        let floor = if is_unbounded { ", no velocity floor" } else { "" };
        let protocol = fact("protocol").map_or(stem, Clone::clone);
        let pulses = fact("chatter_pulses")
            .and_then(|count| count.parse::<f64>().ok())
            .map_or(String::new(), |count| format!(", chattering shown as {count} pulses"));
        let label = fact("label").map_or(String::new(), |label| format!(", {label}"));
        let name = format!("{protocol}{label}{}{}{}{floor}{pulses}", after("law"), after("friction"), after("loop"));
        let name = label::literal(&name.replace('_', " "));
        let points = fact("points").and_then(|points| points.parse().ok());
        TraceFile { name, parameters: parameters.collect(), columns, points }
    }

    fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Its points in a panel: the column `name` over `x`.
    fn points(&self, x: &str, name: &str) -> Option<Vec<(f64, f64)>> {
        let (x, values) = (self.column(x)?, self.column(name)?);
        Some(x.cells.iter().copied().zip(values.cells.iter().copied()).collect())
    }

    /// # Errors
    /// If `argument` requests a column that it does not have.
    fn check(&self, argument: &'static str, column: Option<&str>) -> Result<(), PlotError> {
        match column.filter(|name| self.column(name).is_none()) {
            None => Ok(()),
            Some(name) => {
                let known: Vec<String> = self.columns.iter().map(|column| column.name.clone()).collect();
                Err(PlotError::unknown(&format!("{argument}: the trace has no column"), name, &known))
            }
        }
    }

    fn is_marked(&self) -> bool {
        self.points.is_some_and(|points| points < MAX_MARKED_POINTS)
    }
}

fn parquet(path: &Path) -> Result<(Vec<Column>, Facts), PlotError> {
    let (mut headings, facts) = frame::headings(path).map_err(PlotError::Trace)?;
    headings.retain(|heading| heading.is_number);
    let names: Vec<&str> = headings.iter().map(|heading| heading.name.as_str()).collect();
    let frame = frame::read(path, &names).map_err(PlotError::Trace)?;
    let column = |(heading, (name, cells)): (&frame::Heading, (String, Cells))| match cells {
        Cells::Numbers(cells) => Some(Column { name, unit: heading.unit.clone(), cells }),
        Cells::Words(..) => None,
    };
    let fact = |(key, value): (String, String)| Some((key.strip_prefix("slipsweep.")?.to_owned(), value));
    Ok((headings.iter().zip(frame.columns).filter_map(column).collect(), facts.into_iter().filter_map(fact).collect()))
}

/// The columns of a CSV, and its comments `# key = value`.
fn csv(path: &Path, shown: &str) -> Result<(Vec<Column>, Facts), PlotError> {
    let text = file::open(path)
        .and_then(std::io::read_to_string)
        .map_err(|error| PlotError::Refused(format!("{shown}: cannot be read: {error}")))?;
    let comments = text.lines().take_while(|line| line.starts_with('#'));
    let facts: Facts = comments
        .filter_map(|line| line.trim_start_matches('#').split_once('='))
        .map(|(key, value)| (key.trim().to_owned(), value.trim().to_owned()))
        .collect();
    let units = facts.iter().find(|(key, _)| key == "units").map_or("", |(_, value)| value);
    let units: Vec<&str> = units.split(", ").collect();
    let mut lines = text.lines().enumerate().skip_while(|(_, line)| line.starts_with('#'));
    let names = lines.next().map_or("", |(_, line)| line);
    let column = |(place, name): (usize, &str)| {
        let unit = units.get(place).copied().unwrap_or_default();
        Column { name: name.to_owned(), unit: unit.to_owned(), cells: Vec::new() }
    };
    let mut columns: Vec<Column> = names.split(',').map(str::trim).enumerate().map(column).collect();
    for (number, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let cells: Vec<&str> = line.split(',').collect();
        let wrong = |found: String, expected: String| {
            let (line, help) = (number + 1, "`slipsweep trace … --out FILE.csv` writes traces");
            PlotError::Refused(format!("{shown}, line {line}: found {found}\n  expected: {expected}\n  help: {help}"))
        };
        if cells.len() != columns.len() {
            return Err(wrong(format!("{} cells", cells.len()), format!("{} as in the first line", columns.len())));
        }
        for (column, cell) in columns.iter_mut().zip(cells) {
            let cell = cell.trim();
            column.cells.push(match cell.parse() {
                _ if cell.is_empty() => f64::NAN,
                Ok(value) => value,
                Err(_) => return Err(wrong(format!("`{cell}`"), "a number or nothing".to_owned())),
            });
        }
    }
    Ok((columns, facts))
}

/// The curves of a trace in a panel: that of the block, then that of the control.
type Curves = Vec<Vec<(f64, f64)>>;

/// The figure of traces, with a panel for each group of columns with values, or for the column `y`, over the column `x`, or over time.
///
/// # Errors
///
/// Too many traces, a column that one does not have, or traces without values.
pub fn figure(traces: &[TraceFile], [x, y]: [Option<&str>; 2]) -> Result<Figure, PlotError> {
    if traces.len() > MAX_SERIES {
        let found = format!("{} traces are too many for one picture", traces.len());
        return Err(PlotError::Refused(format!("{found}\n  expected: at most {MAX_SERIES}")));
    }
    traces.iter().try_for_each(|trace| trace.check("--x", x).and_then(|()| trace.check("--y", y)))?;
    let x = x.unwrap_or("t");
    if Some(x) == y {
        return Err(PlotError::same_axes(x));
    }
    let groups: Vec<Vec<&str>> = match y {
        Some(y) => vec![vec![y]],
        None => PANEL_COLUMNS.iter().filter(|names| !names.contains(&x)).map(|names| names.to_vec()).collect(),
    };
    one_unit(traces, groups.iter().flatten().copied().chain([x]))?;
    let all = Scale::of(cells(traces, x)).ok_or(PlotError::Nothing)?;
    let across = Scale { log: all.log && x != "t", ..all };
    let axis = |names: &[&str], scale| Axis::new(&names.join(", "), &unit_in(traces, names[0]), scale);
    let mut panels = Vec::new();
    for names in groups {
        let has = |name: &&str| traces.iter().any(|trace| trace.column(name).is_some());
        let names: Vec<&str> = names.iter().copied().filter(has).collect();
        let Some(scale) = Scale::of(names.iter().flat_map(|name| cells(traces, name))) else { continue };
        let (x_axis, y) = (axis(&[x], across.with_room(0.03)), axis(&names, scale.with_room(0.06)));
        let bound = Layer::Level(1.0, Stroke { colour: "#888", width: 0.5, dashes: &[1.0, 1.5] });
        let has_bound = names[0] == "v" && (0.0..2.0).contains(&scale.low) && y.unit == UNIT_OF_BOUND;
        let layers = has_bound.then_some(bound).into_iter().collect();
        let fewer = |points| if x == "t" { thinned(points) } else { spaced(points, [&x_axis.scale, &y.scale]) };
        let curves_of = |of: &TraceFile| names.iter().filter_map(|name| of.points(x, name).map(fewer)).collect();
        let curves: Vec<Curves> = traces.iter().map(curves_of).collect();
        panels.push((Panel { title: String::new(), x: x_axis, y, layers }, curves));
    }
    let leaders = leaders(traces.len(), &panels);
    let common = common(traces);
    let title = match traces {
        [one] => format!("Protocol {}", one.name),
        _ => "Protocols".to_owned(),
    };
    let subtitle = equations(&common, &unit_in(traces, "t"));
    let has_control = panels.iter().any(|(_, curves)| curves.iter().any(|of_trace| of_trace.len() > 1));
    let legend = legend(traces, &leaders, &common, has_control);
    let panels = panels.into_iter().map(|(panel, curves)| draw(panel, curves, traces, &leaders));
    let panels: Vec<Panel> = panels.collect();
    let aspect = if panels.len() == 1 { ASPECT_OF_ONE } else { ASPECT };
    Ok(Figure { title, subtitle, panels, columns: 1, aspect, legend, ..Figure::default() })
}

/// The cells of a column in all traces.
fn cells(traces: &[TraceFile], name: &str) -> impl Iterator<Item = f64> {
    traces.iter().filter_map(|trace| trace.column(name)).flat_map(|column| column.cells.iter().copied())
}

/// The common unit of a column in all traces.
fn unit_in(traces: &[TraceFile], name: &str) -> String {
    traces.iter().find_map(|trace| Some(trace.column(name)?.unit.clone())).unwrap_or_default()
}

/// Checks that the traces agree in the units of these columns.
fn one_unit<'a>(traces: &[TraceFile], names: impl Iterator<Item = &'a str>) -> Result<(), PlotError> {
    for name in names {
        let first = unit_in(traces, name);
        let mut units = traces.iter().filter_map(|trace| Some(trace.column(name)?.unit.as_str()));
        if let Some(other) = units.find(|unit| *unit != first) {
            return Err(PlotError::Refused(format!(
                "the traces differ in the unit of `{name}`\n  found: {first} and {other}\n  expected: the same units\n  help: draw them one \
                 by one, or trace both in the same units"
            )));
        }
    }
    Ok(())
}

/// For each trace, the first trace with which it coincides in all panels.
fn leaders(count: usize, panels: &[(Panel, Vec<Curves>)]) -> Vec<usize> {
    coincide::leaders(count, |one, other| {
        panels.iter().all(|(panel, curves)| {
            let fraction = |(x, y): &(f64, f64)| (panel.x.scale.fraction(*x), panel.y.scale.fraction(*y));
            let [one, other] = [one, other].map(|trace| {
                curves[trace].iter().map(|curve| curve.iter().map(fraction).collect()).collect::<Curves>()
            });
            one.len() == other.len() && one.iter().zip(&other).all(|(one, other)| coincide::anywhere(one, other))
        })
    })
}

/// The panel with the curves of the leading traces.
fn draw(mut panel: Panel, curves: Vec<Curves>, traces: &[TraceFile], leaders: &[usize]) -> Panel {
    for (trace, curves) in curves.into_iter().enumerate().filter(|(trace, _)| leaders[*trace] == *trace) {
        for (rank, points) in curves.into_iter().enumerate() {
            let stroke = if rank == 0 { colour::series(trace) } else { control(trace) };
            panel.layers.push(Layer::Line(points.clone(), stroke));
            if traces[trace].is_marked() && rank == 0 {
                panel.layers.push(Layer::marks(points, trace));
            }
        }
    }
    panel
}

/// The common parameters of all traces with parameters, which are stated once.
fn common(traces: &[TraceFile]) -> Vec<&(String, f64)> {
    let mut known = traces.iter().map(|trace| &trace.parameters).filter(|parameters| !parameters.is_empty());
    let first = known.next().into_iter().flatten();
    let others: Vec<_> = known.collect();
    first.filter(|entry| others.iter().all(|parameters| parameters.contains(entry))).collect()
}

/// Parameters as equations, of a trace whose times are in `time`.
fn equations(parameters: &[&(String, f64)], time: &str) -> String {
    let equation = |(name, value): &&(String, f64)| label::equation(name, &label::number(*value), unit_of(name, time));
    parameters.iter().map(equation).collect::<Vec<_>>().join(", ")
}

/// The legend: differences between the traces, and the line of the control if it is drawn.
fn legend(traces: &[TraceFile], leaders: &[usize], common: &[&(String, f64)], has_control: bool) -> Vec<Entry> {
    let name = |trace: &TraceFile| {
        let own: Vec<_> = trace.parameters.iter().filter(|entry| !common.contains(entry)).collect();
        let name = trace.name.clone();
        if own.is_empty() { name } else { format!("{name}, {}", equations(&own, &unit_in(traces, "t"))) }
    };
    let names: Vec<String> = traces.iter().map(name).collect();
    let mut legend = Entry::of_series(&names, leaders, |place| Key::series(place, traces[place].is_marked()));
    if has_control {
        let (v, v_c) = (label::name("v"), label::name("v_c"));
        let thin = Key::Line(control(0));
        if traces.len() == 1 {
            legend.push(Entry { key: Key::series(0, false), text: v });
            legend.push(Entry { key: thin, text: v_c });
        } else {
            legend.push(Entry { key: thin, text: format!("thin: {v_c}") });
        }
    }
    legend
}

/// The line of the control velocity of a trace, thinner than that of the block.
fn control(place: usize) -> Stroke {
    Stroke { width: 0.5, ..colour::series(place) }
}

/// The unit of a parameter of a trace whose times are in `time`.
fn unit_of(parameter: &str, time: &str) -> &'static str {
    let of = Quantity::from_name(parameter).map_or("1", |quantity| quantity.unit(grid::Scale::Duration));
    // Names of SI units do not depend on the scales.
    let scales = Scales { mu_0: 1.0, l: 1.0, v_0: 1.0, normal_stress: 1.0 };
    if time == "s" { Units::Si(scales).name(of) } else { of }
}

/// The first, least, greatest and last point of each time interval, if there are more points than a picture shows.
fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= MAX_POINTS {
        return points;
    }
    let mut kept = Vec::with_capacity(MAX_POINTS + 4);
    for chunk in points.chunks(points.len().div_ceil(MAX_POINTS / 4)) {
        let by_value = |i: &usize, j: &usize| chunk[*i].1.total_cmp(&chunk[*j].1);
        let (least, greatest) = ((0..chunk.len()).min_by(by_value), (0..chunk.len()).max_by(by_value));
        let places: BTreeSet<usize> = [0, chunk.len() - 1].into_iter().chain(least).chain(greatest).collect();
        kept.extend(places.into_iter().map(|place| chunk[place]));
    }
    kept
}

/// Greatest number of points of a curve that may turn back. Chosen: a hundred loops stay smooth.
const MAX_TURNING_POINTS: usize = 5 * MAX_POINTS;

/// Least distance of the points of such a curve, as a fraction of the panel. Chosen: half a dot of a wide picture in print.
const MIN_DISTANCE: f64 = 5e-4;

/// Points at equal distances along a curve over these scales, at least, with the first and the last.
fn spaced(points: Vec<(f64, f64)>, [x, y]: [&Scale; 2]) -> Vec<(f64, f64)> {
    let distance = |from: (f64, f64), to: (f64, f64)| {
        (x.fraction(to.0) - x.fraction(from.0)).hypot(y.fraction(to.1) - y.fraction(from.1))
    };
    let length: f64 = points.windows(2).map(|pair| distance(pair[0], pair[1])).filter(|step| step.is_finite()).sum();
    let step = (length / MAX_TURNING_POINTS as f64).max(MIN_DISTANCE);
    let last = points.len().saturating_sub(1);
    let mut kept: Vec<(f64, f64)> = Vec::new();
    for (place, point) in points.into_iter().enumerate() {
        let is_near = kept.last().is_some_and(|before| distance(*before, point) < step);
        if !is_near || place == last {
            kept.push(point);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    //! Thinning preserves the visible curve.

    use super::*;

    /// A spiral of fifty turns keeps its radius.
    #[test]
    fn a_curve_that_turns_back_stays_smooth() {
        let angle = |i: u32| f64::from(i) * 1e-3;
        let points: Vec<(f64, f64)> = (0..314_160).map(|i| (angle(i).cos(), angle(i).sin())).collect();
        let scale = Scale { low: -1.0, high: 1.0, log: false };
        let kept = spaced(points.clone(), [&scale, &scale]);
        assert!(kept.len() <= MAX_TURNING_POINTS + 2, "{}", kept.len());
        assert!(kept.windows(2).all(|pair| (pair[0].0 - pair[1].0).hypot(pair[0].1 - pair[1].1) < 0.02));
        assert_eq!((kept.first(), kept.last()), (points.first(), points.last()));
    }

    #[test]
    fn thinning_keeps_every_extreme() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), f64::from(i % 7))).collect();
        points[54_321].1 = 1e6;
        points[67_890].1 = -1e6;
        let kept = thinned(points.clone());
        assert!(kept.len() <= MAX_POINTS + 4);
        assert!(kept.contains(&points[54_321]) && kept.contains(&points[67_890]));
        assert_eq!((kept.first(), kept.last()), (points.first(), points.last()));
    }
}
