//! Maps: a column as colours over two axes, a panel for each group of the further ones.

use super::cells::AxisCells;
use super::groups::{self, Groups};
use super::survey::{Survey, Values};
use crate::plot::colour::{class, viridis};
use crate::plot::export::image;
use crate::plot::figure::{Axis, Colours, Dot, Entry, Figure, Hover, Key, Layer, Map, Panel};
use crate::plot::scale::Scale;
use crate::plot::{PlotError, label};
use crate::protocol::Status;
use crate::table::STATUS;

/// Most panels of a map.
const MOST_PANELS: usize = 9;

/// Most cells of an axis, alone and in one of several panels: finer ones are not seen in print.
const MOST_CELLS: usize = 720;
const MOST_CELLS_SHARED: usize = 480;

/// A map of which rows fill a smaller fraction is sparse: half of what a condition such as `v_f > v_i` leaves of a grid.
const SPARSE: f64 = 0.25;

/// Rows that are so many times as many as the values of either axis, or fewer, are single points, such as materials of which each has
/// its own values of both axes: not a grid, and not half of one.
const SCATTERED: usize = 2;

/// Most rows whose names stand beside their dots.
const MOST_NAMED: u64 = 60;

/// Most dots of a panel.
const MOST_DOTS: f64 = 5000.0;

/// Room beyond the first and the last dot, as a fraction of the axis. Chosen by eye: no dot touches the frame in a panel of a third of a page.
const DOT_ROOM: f64 = 0.04;

/// Pixels of a panel whose cells are not equally wide.
const PIXELS: usize = 1024;

/// What a map shows.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Column of the horizontal axis.
    pub x: String,
    /// Column of the vertical axis.
    pub y: String,
    /// Column of the colours.
    pub value: String,
}

/// A map before it is drawn: its figure, and what further layers need to know.
#[derive(Debug)]
pub struct Mapped {
    /// The figure.
    pub figure: Figure,
    /// The group of each panel.
    pub groups: Groups,
    /// For each panel the cell of the least value with status `ok`.
    pub least: Vec<Option<(f64, f64, f64)>>,
    /// The cells of both axes.
    pub cells: [AxisCells; 2],
}

/// The cells of one panel.
struct Sheet {
    value: Vec<f64>,
    /// Place of the status plus one; 0 without a row.
    status: Vec<u8>,
    /// The places of single rows, where those are drawn instead of cells, and their names.
    dots: Vec<((f64, f64), String)>,
    least: Option<(f64, f64, f64)>,
}

/// Draws the map.
pub fn map(survey: &Survey, plan: &Plan) -> Result<Mapped, PlotError> {
    let Plan { x, y, value } = plan;
    let (further, along) = groups::further(survey, &[x, y])?;
    let groups = Groups::new(survey, &further, (MOST_PANELS, true), |_| {}, |_| false)?;
    let further: Vec<&str> = groups.axes.iter().map(String::as_str).collect();
    let most = if groups.shown.len() > 1 { MOST_CELLS_SHARED } else { MOST_CELLS };
    let (Some(x_axis), Some(y_axis)) = (survey.axis(x), survey.axis(y)) else { return Err(PlotError::Nothing) };
    if x_axis.values.is_empty() || y_axis.values.is_empty() {
        return Err(PlotError::Nothing);
    }
    // Rows at places of their own, such as those of a sampled design, are dots; of too many, several share a cell.
    let per_panel = survey.rows as f64 / groups.all as f64;
    let is_sparse = SPARSE * (x_axis.values.len() * y_axis.values.len()) as f64 > per_panel
        || is_scattered(survey.rows / groups.all as u64, [x_axis, y_axis]);
    let are_dots = is_sparse && per_panel <= MOST_DOTS;
    let most = if is_sparse && !are_dots { most.min((0.5 * per_panel.sqrt()) as usize) } else { most };
    let mut cells = [x_axis, y_axis].map(|axis| AxisCells::new(axis, most));
    if are_dots {
        // Room for the dots at the ends.
        for (cells, axis) in cells.iter_mut().zip([x_axis, y_axis]) {
            let (low, high) = (axis.values[0], axis.values[axis.values.len() - 1]);
            cells.scale = Scale { low, high, log: cells.scale.log }.with_room(DOT_ROOM);
        }
    }
    let (columns, rows) = (cells[0].len(), cells[1].len());
    let count = if are_dots { 0 } else { columns * rows };
    let empty = || Sheet { value: vec![f64::NAN; count], status: vec![0; count], dots: Vec::new(), least: None };
    let mut sheets: Vec<Sheet> = groups.shown.iter().map(|_| empty()).collect();
    let mut wanted = vec![x.as_str(), y.as_str(), value.as_str(), STATUS];
    let is_named = are_dots && survey.rows <= MOST_NAMED;
    let labels = wanted.len();
    wanted.extend(survey.label_columns().into_iter().filter(|_| is_named));
    let fixed = wanted.len();
    wanted.extend(&further);
    let ok = Status::ALL.iter().position(|status| *status == Status::Ok).unwrap_or(0) as f64;
    survey.each(&wanted, |row| {
        let Some(panel) = groups.place(&row[fixed..]) else { return };
        let (Some(column), Some(line)) = (cells[0].place(row[0]), cells[1].place(row[1])) else { return };
        let sheet = &mut sheets[panel];
        let mut cell = line * columns + column;
        let found = row[2];
        if are_dots {
            cell = sheet.dots.len();
            sheet.dots.push(((row[0], row[1]), survey.label(&row[labels..fixed])));
            sheet.value.push(f64::NAN);
            sheet.status.push(0);
        }
        // A cell of several rows shows the least of them; NaN is above any number.
        if sheet.status[cell] == 0 || found < sheet.value[cell] || sheet.value[cell].is_nan() {
            sheet.value[cell] = found;
            sheet.status[cell] = row[3].min((Status::ALL.len() - 1) as f64) as u8 + 1;
        }
        if row[3] == ok && !found.is_nan() && sheet.least.is_none_or(|(.., least)| found < least) {
            sheet.least = Some((row[0], row[1], found));
        }
    })?;
    // A group in which nothing has a value makes no panel.
    let is_empty = |sheet: &Sheet| sheet.value.iter().all(|value| value.is_nan());
    let mut groups = groups;
    let mut left_out = Vec::new();
    if groups.crossed.is_none() && sheets.iter().any(|sheet| !is_empty(sheet)) {
        let mut keep = sheets.iter().map(|sheet| !is_empty(sheet)).collect::<Vec<bool>>().into_iter();
        left_out = groups.retain(|| keep.next().unwrap_or(true));
        sheets.retain(|sheet| !is_empty(sheet));
    }
    let words = survey.words(value);
    let numbers = || sheets.iter().flat_map(|sheet| sheet.value.iter().copied());
    let colours = if words.is_empty() { colours(survey, value, numbers())? } else { None };
    let mut figure = Figure {
        columns: groups.crossed.as_ref().map_or_else(|| columns_of(groups.shown.len()), |[_, columns]| columns.len()),
        rows: groups.crossed.clone().map_or_else(Vec::new, |[rows, _]| rows),
        aspect: if groups.shown.len() > 1 { 0.9 } else { 0.8 },
        subtitle: groups.held.join(", "),
        shared: true,
        ..Figure::default()
    };
    let holes = sheets.iter().any(|sheet| sheet.value.iter().any(|value| value.is_nan()));
    for (place, (sheet, group)) in sheets.iter().zip(&groups.shown).enumerate() {
        let title = match &groups.crossed {
            Some([_, columns]) => columns.get(place).cloned().unwrap_or_default(),
            None => group.name.clone(),
        };
        let colour = |cell: usize| -> Option<[u8; 3]> {
            let value = sheet.value[cell];
            match &colours {
                _ if value.is_nan() => None,
                Some(colours) => {
                    Some(viridis(if value > 0.0 || !colours.scale.log { colours.scale.share(value) } else { 0.0 }))
                }
                None => Some(class(shade(plan, value as usize))),
            }
        };
        let layers = if are_dots {
            let dot = |(dot, (at, _)): (usize, &((f64, f64), String))| {
                let is_word = !words.is_empty() && !sheet.value[dot].is_nan();
                let shape = if is_word { shade(plan, sheet.value[dot] as usize) } else { 0 };
                Dot { at: *at, fill: colour(dot), shape }
            };
            let names = sheet.dots.iter().filter(|(_, name)| !name.is_empty()).cloned().collect();
            vec![Layer::Dots(sheet.dots.iter().enumerate().map(dot).collect()), Layer::Names(names)]
        } else {
            let image = pixels(&cells, colour);
            let filled = image.map(|png| Layer::Map(Map { png, hover: Some(hover(&cells, sheet, &words, value)) }));
            [Layer::Hatch].into_iter().chain(filled).collect()
        };
        figure.panels.push(Panel {
            title,
            x: Axis { column: x.clone(), unit: survey.unit(x), scale: cells[0].scale },
            y: Axis { column: y.clone(), unit: survey.unit(y), scale: cells[1].scale },
            layers,
        });
    }
    if words.is_empty() {
        figure.colours = colours;
    } else {
        for (place, word) in words.iter().enumerate() {
            if numbers().any(|value| value == place as f64) {
                let text = meaning(plan, word);
                let shade = shade(plan, place);
                let key = if are_dots { Key::Dot(class(shade), shade) } else { Key::Fill(class(shade)) };
                figure.legend.push(Entry { key, text });
            }
        }
    }
    if holes {
        let key = if are_dots { Key::Hollow } else { Key::Hatch };
        figure.legend.push(Entry { key, text: nothing(&sheets) });
    }
    figure.remarks.extend(groups.note("panels"));
    figure.notes.extend(along);
    if !left_out.is_empty() {
        figure.notes.push(format!("No value for {}.", left_out.join("; ")));
    }
    let binned: Vec<String> = [x, y]
        .iter()
        .zip(&cells)
        .filter(|(_, cells)| !cells.exact && !are_dots)
        .map(|(name, cells)| format!("{} cells of {}", cells.len(), label::name(name)))
        .collect();
    if !binned.is_empty() {
        figure.notes.push(format!("Rows share {}: each shows the least of its rows.", binned.join(" and ")));
    }
    let least = sheets.iter().map(|sheet| sheet.least).collect();
    Ok(Mapped { figure, groups, least, cells })
}

/// Whether rows are single points of a plane, of which a map would be mostly blank.
fn is_scattered(rows: u64, axes: [&Values; 2]) -> bool {
    let most = axes.map(|axis| axis.values.len()).into_iter().max().unwrap_or(0);
    let least = axes.map(|axis| axis.values.len()).into_iter().min().unwrap_or(0);
    // Rows of which each pair of values has one are a grid.
    rows <= (SCATTERED * most) as u64 && rows < (most * least) as u64
}

/// Whether the column is a flag of stability: stable is shown as light as what settles, and in words.
fn is_stability(plan: &Plan) -> bool {
    plan.value.starts_with("stable")
}

fn shade(plan: &Plan, place: usize) -> usize {
    if is_stability(plan) { 1 - place.min(1) } else { place }
}

fn meaning(plan: &Plan, word: &str) -> String {
    match word {
        "no" if is_stability(plan) => "unstable".to_owned(),
        "yes" if is_stability(plan) => "stable".to_owned(),
        "no" | "yes" => format!("{}: {word}", label::name(&plan.value)),
        word => word.replace('_', " "),
    }
}

/// Panels side by side.
pub fn columns_of(panels: usize) -> usize {
    match panels {
        0 | 1 => 1,
        2 | 4 => 2,
        _ => 3,
    }
}

fn colours(
    survey: &Survey,
    column: &str,
    values: impl Iterator<Item = f64> + Clone,
) -> Result<Option<Colours>, PlotError> {
    let all = Scale::of(values.clone()).ok_or(PlotError::Nothing)?;
    // A gap is never below zero but for rounding: its logarithm is what tells.
    let scale = match Scale::of(values.filter(|value| *value > 0.0)) {
        Some(positive) if column == "gap" && positive.high > positive.low => Scale { log: true, ..positive },
        _ if all.high > all.low => all,
        _ => all.with_room(0.05),
    };
    Ok(Some(Colours { label: label::axis(column, &survey.unit(column), 0), scale }))
}

/// What a hatched region is, from the status of its rows.
fn nothing(sheets: &[Sheet]) -> String {
    let mut seen = [false; Status::ALL.len() + 1];
    for sheet in sheets {
        for (value, &status) in sheet.value.iter().zip(&sheet.status) {
            if value.is_nan() {
                seen[usize::from(status)] = true;
            }
        }
    }
    let words = (1..seen.len()).filter(|&place| seen[place]).map(|place| match Status::ALL[place - 1] {
        Status::Ok | Status::BelowBound => "no value".to_owned(),
        status => status.name().replace('_', " "),
    });
    let mut words: Vec<String> = words.chain(seen[0].then(|| "no row".to_owned())).collect();
    words.dedup();
    words.join(", ")
}

/// The image of a panel: a pixel a cell where cells are equally wide, else as many as are seen.
fn pixels(cells: &[AxisCells; 2], colour: impl Fn(usize) -> Option<[u8; 3]>) -> Option<Vec<u8>> {
    let sizes = [0, 1].map(|axis| if cells[axis].even { cells[axis].len() } else { PIXELS });
    let place = |axis: usize, pixel: usize| {
        if cells[axis].even { pixel } else { cells[axis].nearest((pixel as f64 + 0.5) / sizes[axis] as f64) }
    };
    let mut pixels = Vec::with_capacity(sizes[0] * sizes[1]);
    for line in (0..sizes[1]).rev() {
        let start = place(1, line) * cells[0].len();
        pixels.extend((0..sizes[0]).map(|column| colour(start + place(0, column))));
    }
    image(sizes[0], &pixels)
}

fn hover(cells: &[AxisCells; 2], sheet: &Sheet, words: &[String], column: &str) -> Hover {
    let mut all: Vec<String> = vec!["no row".to_owned()];
    all.extend(Status::ALL.iter().map(|status| status.name().to_owned()));
    let mut word = sheet.status.clone();
    let mut numbers = sheet.value.clone();
    if !words.is_empty() {
        let offset = all.len() as u8;
        all.extend(words.iter().cloned());
        for (word, value) in word.iter_mut().zip(&mut numbers) {
            if !value.is_nan() {
                *word = offset + *value as u8;
                *value = f64::NAN;
            }
        }
    }
    let [x, y] = cells;
    Hover { x: x.middles.clone(), y: y.middles.clone(), values: numbers, words: all, word, column: column.to_owned() }
}
