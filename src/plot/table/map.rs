//! Maps: a column as colours over two axes, with a panel for each group of the further axes.

use super::cells::AxisCells;
use super::filtered::{FilteredTable, Values};
use super::groups::Groups;
use crate::plot::canvas::Stroke;
use crate::plot::colour::{class, viridis};
use crate::plot::contour::contour;
use crate::plot::export::image;
use crate::plot::figure::{Axis, Entry, Figure, Hover, Key, Layer, Panel};
use crate::plot::scale::{CONSTANT_RTOL, Scale, range};
use crate::plot::symbol::Symbol;
use crate::plot::{PlotError, label};
use crate::protocol::Status;
use crate::table::STATUS;

/// Greatest number of cells along an axis of a single panel, and two thirds of it of one of several. Chosen: finer cells are invisible in print.
const MAX_CELLS: usize = 720;

/// Filled fraction below which a map is sparse. Chosen: half of the fraction that a condition such as `v_f > v_i` leaves of a grid.
const SPARSE_FILL: f64 = 0.25;

/// Ratio of rows to the values of the longer axis up to which rows are scattered points, such as materials. Chosen: no grid has fewer rows.
pub const MAX_SCATTERED_RATIO: usize = 2;

/// Greatest number of dots of a panel; with more rows, several fall in one cell. Chosen: more dots overlap.
const MAX_DOTS: f64 = 5000.0;

/// Space beyond the first and the last dot, as a fraction of the axis. Chosen: no dot touches the frame in a panel of a third of a page.
pub const DOT_ROOM: f64 = 0.04;

/// Pixels along an axis with cells of unequal width. Chosen: more than its cells.
const PIXELS: usize = 1024;

/// The colour of gaps below 0: none of the colours of the scale.
const BELOW_ZERO: [u8; 3] = [0xcc, 0x79, 0xa7];

/// The plan of a map.
#[derive(Debug, Clone)]
pub struct MapColumns {
    /// Column of the horizontal axis.
    pub x: String,
    /// Column of the vertical axis.
    pub y: String,
    /// Column of the colours.
    pub value: String,
}

/// A map before drawing: its figure, and the data for further layers.
#[derive(Debug)]
pub struct MapFigure {
    /// The figure.
    pub figure: Figure,
    /// The group of each panel.
    pub groups: Groups,
    /// For each panel, the cell of the least value with status `ok`.
    pub least: Vec<Option<(f64, f64)>>,
    /// The cells of both axes.
    pub cells: [AxisCells; 2],
    /// For each panel, the values of its cells, row after row from the least `y`, if they may have both signs.
    values: Vec<Vec<f64>>,
}

/// The cells of one panel.
struct PanelCells {
    value: Vec<f64>,
    /// Index of the status plus one; 0 without a row.
    status: Vec<u8>,
    /// The positions and names of scattered rows, which are drawn as dots instead of cells.
    dots: Vec<((f64, f64), String)>,
    least: Option<(f64, f64, f64)>,
    /// Whether a cell has several rows.
    has_several: bool,
}

/// The raster of a panel: positions of its rows.
struct Raster {
    cells: [AxisCells; 2],
    /// Whether rows are drawn as dots instead of cells.
    are_dots: bool,
}

/// The colours of a column: one for each word, or a scale for numbers.
struct Shading<'a> {
    column: &'a str,
    words: Vec<String>,
    colours: Option<Axis>,
    /// The size below which a gap is rounding.
    least_gap: f64,
}

/// Draws the map.
///
/// # Errors
///
/// No row with a value, or a part that cannot be read.
pub fn map(filtered: &FilteredTable, plan: &MapColumns) -> Result<MapFigure, PlotError> {
    let groups = Groups::of_panels(filtered, &[&plan.x, &plan.y], &[&plan.value])?;
    let raster = Raster::new(filtered, plan, &groups)?;
    let sheets = raster.read(filtered, plan, &groups)?;
    let shading = Shading::new(filtered, &plan.value, &sheets)?;
    let mut figure = groups.figure(0.8);
    let axis = |name: &str, cells: &AxisCells| Axis::new(name, &filtered.unit(name), cells.scale);
    for (place, sheet) in sheets.iter().enumerate() {
        figure.panels.push(Panel {
            title: groups.title(place),
            x: axis(&plan.x, &raster.cells[0]),
            y: axis(&plan.y, &raster.cells[1]),
            layers: raster.layers(sheet, &shading),
        });
    }
    figure.legend = shading.legend(&sheets, raster.are_dots);
    let is_rounding = |value: &f64| value.abs() < shading.least_gap;
    let has_rounding = shading.is_logarithmic_gap() && sheets.iter().any(|sheet| sheet.value.iter().any(is_rounding));
    let rounding = has_rounding.then(|| {
        let least = label::number(filtered.least_gap);
        format!("Gaps below rtol = {least}, which are rounding, have the darkest colour.")
    });
    let unbounded = |name: &&String| filtered.axis(name).is_some_and(|axis| axis.infinite);
    let unbounded = [&plan.x, &plan.y].into_iter().find(unbounded);
    let unbounded = unbounded.map(|name| format!("Rows with {} = ∞ have no place in the map.", label::name(name)));
    let blank = sheets.iter().any(|sheet| !sheet.has_rows()).then(|| "Blank panels have no rows.".to_owned());
    let several = raster.note(plan, &sheets, &shading);
    figure.notes.extend([unbounded, several, rounding, blank].into_iter().flatten());
    figure.colours = shading.colours;
    let least = sheets.iter().map(|sheet| sheet.least.map(|(x, y, _)| (x, y))).collect();
    let is_signed = figure.colours.is_some() && plan.value != "gap" && !raster.are_dots;
    let values = sheets.into_iter().filter(|_| is_signed).map(|sheet| sheet.value).collect();
    Ok(MapFigure { figure, groups, least, cells: raster.cells, values })
}

impl PanelCells {
    /// Whether it has rows; else the panel is blank.
    fn has_rows(&self) -> bool {
        self.status.iter().any(|status| *status != 0)
    }
}

impl MapFigure {
    /// Draws the lines on which `column` is 0, if it has both signs.
    pub fn zero_line(&mut self, column: &str) {
        let (low, high) = range(self.values.iter().flatten().copied());
        let rounding = CONSTANT_RTOL * low.abs().max(high.abs());
        let [x, y] = &self.cells;
        if low >= -rounding || high <= rounding || x.len() < 2 || y.len() < 2 {
            return;
        }
        let stroke = Stroke::solid("#000", 0.9);
        let mut is_drawn = false;
        for (panel, values) in self.figure.panels.iter_mut().zip(&self.values) {
            let clean = |value: &f64| if value.abs() < rounding { 0.0 } else { *value };
            let lines = contour(&values.iter().map(clean).collect::<Vec<_>>(), x.len());
            let at = |(column, row)| (x.value_at(column), y.value_at(row));
            let lines: Vec<Vec<_>> = lines.into_iter().map(|line| line.into_iter().map(at).collect()).collect();
            is_drawn |= !lines.is_empty();
            panel.layers.push(Layer::Contour(lines, stroke));
        }
        let text = format!("{} = 0", label::name(column));
        self.figure.legend.extend(is_drawn.then_some(Entry { key: Key::Contour(stroke), text }));
    }
}

impl Raster {
    fn new(filtered: &FilteredTable, plan: &MapColumns, groups: &Groups) -> Result<Raster, PlotError> {
        let axis = |name| filtered.axis(name).filter(|axis| !axis.values.is_empty()).ok_or(PlotError::Nothing);
        let axes = [axis(&plan.x)?, axis(&plan.y)?];
        let most = if groups.shown.len() > 1 { 2 * MAX_CELLS / 3 } else { MAX_CELLS };
        // Scattered rows, such as those of a sampled design, are dots; if there are too many, several fall in one cell.
        let per_panel = filtered.rows as f64 / groups.all as f64;
        let is_sparse = SPARSE_FILL * (axes[0].values.len() * axes[1].values.len()) as f64 > per_panel
            || is_scattered(filtered.rows / groups.all as u64, axes);
        let are_dots = is_sparse && per_panel <= MAX_DOTS;
        let most = if is_sparse && !are_dots { most.min((0.5 * per_panel.sqrt()) as usize) } else { most };
        let cells = axes.map(|axis| {
            let mut cells = AxisCells::new(axis, most);
            if are_dots {
                // Space for the dots at the ends.
                let (low, high) = (axis.values[0], axis.values[axis.values.len() - 1]);
                cells.scale = Scale { low, high, log: cells.scale.log }.with_room(DOT_ROOM);
            }
            cells
        });
        Ok(Raster { cells, are_dots })
    }

    /// The cells or dots of each panel.
    fn read(&self, filtered: &FilteredTable, plan: &MapColumns, groups: &Groups) -> Result<Vec<PanelCells>, PlotError> {
        let [columns, rows] = self.cells.each_ref().map(AxisCells::len);
        let count = if self.are_dots { 0 } else { columns * rows };
        let empty = |_| PanelCells {
            value: vec![f64::NAN; count],
            status: vec![0; count],
            dots: Vec::new(),
            least: None,
            has_several: false,
        };
        let mut sheets: Vec<PanelCells> = groups.shown.iter().map(empty).collect();
        let labels = if self.are_dots { filtered.names_of_dots(Some(&plan.value))? } else { Vec::new() };
        let wanted = [&[plan.x.as_str(), &plan.y, &plan.value, STATUS], &labels[..]].concat();
        groups.each(filtered, &wanted, |panel, row| {
            let &[x, y, found, status, ref named @ ..] = row else { return };
            let (Some(column), Some(line)) = (self.cells[0].place(x), self.cells[1].place(y)) else { return };
            let sheet = &mut sheets[panel];
            let mut cell = line * columns + column;
            if self.are_dots {
                cell = sheet.dots.len();
                sheet.dots.push(((x, y), filtered.label(&labels, named)));
                sheet.value.push(f64::NAN);
                sheet.status.push(0);
            }
            sheet.has_several |= sheet.status[cell] != 0;
            // A cell with several rows shows the least value; NaN is above any number.
            if sheet.status[cell] == 0 || found < sheet.value[cell] || sheet.value[cell].is_nan() {
                sheet.value[cell] = found;
                sheet.status[cell] = status as u8 + 1;
            }
            if status == f64::from(Status::Ok as u8)
                && !found.is_nan()
                && sheet.least.is_none_or(|(.., least)| found < least)
            {
                sheet.least = Some((x, y, found));
            }
        })?;
        Ok(sheets)
    }

    /// The dots of a panel and their names, or its cells; nothing without rows.
    fn layers(&self, sheet: &PanelCells, shading: &Shading<'_>) -> Vec<Layer> {
        if !sheet.has_rows() {
            return Vec::new();
        }
        if self.are_dots {
            let dot = |((at, _), &value): (&((f64, f64), String), &f64)| {
                let shape = if shading.words.is_empty() { 0 } else { shading.shade(value) };
                (*at, Symbol::of_row(shading.colour(value), shape))
            };
            let names = sheet.dots.iter().filter(|(_, name)| !name.is_empty()).cloned().collect();
            return vec![Layer::Marks(sheet.dots.iter().zip(&sheet.value).map(dot).collect()), Layer::Names(names)];
        }
        let image = pixels(&self.cells, |cell| shading.colour(sheet.value[cell]));
        image.map(|png| Layer::Map(png, hover(&self.cells, sheet, shading))).into_iter().collect()
    }

    /// A note about cells with several rows.
    fn note(&self, plan: &MapColumns, sheets: &[PanelCells], shading: &Shading<'_>) -> Option<String> {
        let shared = [&plan.x, &plan.y].into_iter().zip(&self.cells).filter(|(_, cells)| !cells.exact);
        let shared: Vec<String> =
            shared.map(|(name, cells)| format!("{} cells of {}", cells.len(), label::name(name))).collect();
        let of = if shared.is_empty() { String::new() } else { format!(" ({})", shared.join(" and ")) };
        let least = if shading.words.is_empty() { "the least value" } else { "the first word of the legend" };
        let has_several = sheets.iter().any(|sheet| sheet.has_several);
        has_several.then(|| format!("Several rows fall into one cell{of}; the cell shows {least}."))
    }
}

impl Shading<'_> {
    fn new<'a>(filtered: &FilteredTable, column: &'a str, sheets: &[PanelCells]) -> Result<Shading<'a>, PlotError> {
        let (words, least_gap) = (filtered.words(column), filtered.least_gap);
        if !words.is_empty() {
            return Ok(Shading { column, words, colours: None, least_gap });
        }
        let values = || sheets.iter().flat_map(|sheet| sheet.value.iter().copied());
        let all = Scale::of(values()).ok_or(PlotError::Nothing)?;
        // A gap has a logarithmic scale, without rounding; one below 0 has a colour of its own.
        let scale = match Scale::of(values().filter(|value| *value > least_gap)) {
            Some(positive) if column == "gap" && positive.high > positive.low => Scale { log: true, ..positive },
            _ => all.with_room(0.0),
        };
        Ok(Shading { column, words, colours: Some(Axis::new(column, &filtered.unit(column), scale)), least_gap })
    }

    /// Whether the column is a flag of stability: it has the colours of outcomes, and words.
    fn is_stability(&self) -> bool {
        self.column.starts_with("stable")
    }

    /// The class of a word, given by its index.
    fn shade(&self, word: f64) -> usize {
        if self.is_stability() { 1 - (word as usize).min(1) } else { word as usize }
    }

    /// Whether the colours are those of gaps on a logarithmic scale.
    fn is_logarithmic_gap(&self) -> bool {
        self.column == "gap" && self.colours.as_ref().is_some_and(|colours| colours.scale.log)
    }

    /// Whether a value is a gap below 0, beyond the accuracy of both works: of a shortcut above the velocity ceiling, or a step that has not arrived.
    fn is_below(&self, value: f64) -> bool {
        self.is_logarithmic_gap() && value < -self.least_gap
    }

    /// The colour of a value; `None` for NaN.
    fn colour(&self, value: f64) -> Option<[u8; 3]> {
        (!value.is_nan()).then(|| match &self.colours {
            _ if self.is_below(value) => BELOW_ZERO,
            Some(Axis { scale, .. }) => viridis(scale.fraction(value)),
            None => class(self.shade(value)),
        })
    }

    /// Entries for the words that occur, and for cells or dots without a value.
    fn legend(&self, sheets: &[PanelCells], are_dots: bool) -> Vec<Entry> {
        let sheets: Vec<&PanelCells> = sheets.iter().filter(|sheet| sheet.has_rows()).collect();
        let has =
            |wanted: &dyn Fn(f64) -> bool| sheets.iter().any(|sheet| sheet.value.iter().any(|value| wanted(*value)));
        let key = |colour: Option<[u8; 3]>, shape: usize| match colour {
            _ if are_dots => Key::Mark(Symbol::of_row(colour, shape)),
            Some(colour) => Key::Fill(colour),
            None => Key::Hatch,
        };
        let words = self.words.iter().enumerate().map(|(place, word)| (place as f64, word));
        let words = words.filter(|(place, _)| has(&|value| value == *place)).map(|(place, word)| {
            let shade = self.shade(place);
            Entry { key: key(Some(class(shade)), shade), text: self.meaning(word) }
        });
        let hole = || Entry { key: key(None, 0), text: nothing(&sheets) };
        let below = || Entry { key: key(Some(BELOW_ZERO), 0), text: "gap below 0".to_owned() };
        words.chain(has(&|value| self.is_below(value)).then(below)).chain(has(&f64::is_nan).then(hole)).collect()
    }

    fn meaning(&self, word: &str) -> String {
        match word {
            "false" if self.is_stability() => "unstable".to_owned(),
            "true" if self.is_stability() => "stable".to_owned(),
            "false" | "true" => format!("{}: {word}", label::name(self.column)),
            word => word.replace('_', " "),
        }
    }
}

/// Whether rows are scattered points, so that a map would be mostly blank.
fn is_scattered(rows: u64, axes: [&Values; 2]) -> bool {
    let mut sizes = axes.map(|axis| axis.values.len());
    sizes.sort_unstable();
    let [least, most] = sizes;
    // Rows for all pairs of values form a grid.
    rows <= (MAX_SCATTERED_RATIO * most) as u64 && rows < (most * least) as u64
}

/// The name of a hatched region, from the status of its rows.
fn nothing(sheets: &[&PanelCells]) -> String {
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

/// The image of a panel: one pixel for each cell if cells are equally wide, else [`PIXELS`] along the axis.
fn pixels(cells: &[AxisCells; 2], colour: impl Fn(usize) -> Option<[u8; 3]>) -> Option<Vec<u8>> {
    let [columns, rows] = cells.each_ref().map(|cells| match cells.even {
        true => (0..cells.len()).collect(),
        false => cells.nearest(PIXELS),
    });
    let cell = |row: &usize, column: &usize| row * cells[0].len() + column;
    let pixels = rows.iter().rev().flat_map(|row| columns.iter().map(|column| colour(cell(row, column))));
    image(columns.len(), &pixels.collect::<Vec<_>>())
}

/// The numbers and words of a panel under the pointer.
fn hover([x, y]: &[AxisCells; 2], sheet: &PanelCells, shading: &Shading<'_>) -> Hover {
    let mut all: Vec<String> = vec!["no row".to_owned()];
    all.extend(Status::ALL.iter().map(|status| status.name().to_owned()));
    let mut word = sheet.status.clone();
    let mut values = sheet.value.clone();
    if !shading.words.is_empty() {
        let offset = all.len() as u8;
        all.extend(shading.words.iter().cloned());
        for (word, value) in word.iter_mut().zip(&mut values) {
            if !value.is_nan() {
                *word = offset + *value as u8;
                *value = f64::NAN;
            }
        }
    }
    let column = shading.column.to_owned();
    Hover { x: x.middles.clone(), y: y.middles.clone(), values, words: all, word, column }
}
