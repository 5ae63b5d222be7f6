//! A figure: panels with axes and layers, a legend, a colour bar and a few words, set out on a sheet of given width.

use super::canvas::{Anchor, Area, Canvas, MILLIMETRE, Stroke};
use super::colour::{hex, viridis};
use super::label;
use super::scale::{Scale, Tick, Ticks};

/// Size of the words of a figure, in points: legible when it is printed as wide as it is.
const SIZE: f64 = 7.5;
const TICK_SIZE: f64 = 7.0;
const NOTE_SIZE: f64 = 6.2;
const TICK: f64 = 2.6;
const MARGIN: f64 = 5.0;
const FRAME: f64 = 0.6;
/// Space between the line of a title and the frame below: letters below the line keep clear of it.
const TITLE_SPACE: f64 = 5.0;
/// Room for the titles of rows.
const ROW_TITLE: f64 = SIZE + 6.0;
/// Radius of a star.
const STAR: f64 = 4.6;
/// Length of what leads from a vertical line to its words, and the space between words.
const LEADER: f64 = 5.0;
const MARK_SPACE: f64 = 5.0;
/// Height of both.
const WORDS_ABOVE: f64 = LEADER + 2.5 + NOTE_SIZE;

/// A figure.
#[derive(Debug, Clone, Default)]
pub struct Figure {
    /// What it shows, in markup.
    pub title: String,
    /// What is the same all over it, in markup.
    pub subtitle: String,
    /// The panels, row after row.
    pub panels: Vec<Panel>,
    /// Panels side by side.
    pub columns: usize,
    /// What is the same in each row of panels, in markup, where their titles are those of the columns; empty where panels have their own.
    pub rows: Vec<String>,
    /// Height of a panel relative to its width.
    pub aspect: f64,
    /// Whether all panels have the same axes, so that only the outer ones are labelled.
    pub shared: bool,
    /// What is explained.
    pub legend: Vec<Entry>,
    /// The colours of maps.
    pub colours: Option<Colours>,
    /// Remarks below, in markup.
    pub notes: Vec<String>,
    /// What its reader need not know but its maker: which panels are left out.
    pub remarks: Vec<String>,
}

/// Colours for numbers.
#[derive(Debug, Clone)]
pub struct Colours {
    /// What the numbers are, in markup.
    pub label: String,
    /// Their range; the darkest colour is at its start.
    pub scale: Scale,
}

/// A pair of axes and what is between them.
#[derive(Debug, Clone)]
pub struct Panel {
    /// What tells it from the others, in markup.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// From back to front.
    pub layers: Vec<Layer>,
}

/// An axis.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Name of its column.
    pub column: String,
    /// Unit of its column.
    pub unit: String,
    /// What it spans.
    pub scale: Scale,
}

/// What is drawn between axes; places are values of the axes unless they are said to be shares.
#[derive(Debug, Clone)]
pub enum Layer {
    /// The background where a map has no data: hatched.
    Hatch,
    /// Colours that fill the panel.
    Map(Map),
    /// Lines through points.
    Lines(Vec<Vec<(f64, f64)>>, Stroke),
    /// A line that is seen on any colour: dark, with a light rim.
    Contour(Vec<Vec<(f64, f64)>>, Stroke),
    /// Between two curves, each point with its least and greatest value: filled.
    Band(Vec<(f64, f64, f64)>, [u8; 3]),
    /// Bars from zero: where each begins and ends, and its height.
    Bars(Vec<(f64, f64, f64)>, [u8; 3]),
    /// Small marks, by series.
    Points(Vec<(f64, f64)>, Marker),
    /// Small marks of single rows.
    Dots(Vec<Dot>),
    /// Names of points, in markup, beside them.
    Names(Vec<((f64, f64), String)>),
    /// Stars.
    Stars(Vec<(f64, f64)>),
    /// A vertical line with words above its upper end, in markup.
    Mark(f64, String, Stroke),
    /// A horizontal line.
    Level(f64, Stroke),
}

/// An image over the panel, with what its pixels stand for.
#[derive(Debug, Clone)]
pub struct Map {
    /// As PNG, its first row at the top; it fills the panel.
    pub png: Vec<u8>,
    /// What is shown where the pointer is, if the picture is in a page.
    pub hover: Option<Hover>,
}

/// The values of a map.
#[derive(Debug, Clone)]
pub struct Hover {
    /// Values of the horizontal axis.
    pub x: Vec<f64>,
    /// Values of the vertical axis.
    pub y: Vec<f64>,
    /// The value of each cell, row after row from the least `y`; NaN where there is none.
    pub values: Vec<f64>,
    /// Words for some cells.
    pub words: Vec<String>,
    /// The word of each cell, if there is one.
    pub word: Vec<u8>,
    /// Name of the column.
    pub column: String,
}

impl Hover {
    /// Every `step`-th column and row.
    pub fn every(&self, step: usize) -> Hover {
        let thinned = |values: &[f64]| values.iter().copied().step_by(step).collect();
        let columns = self.x.len();
        let places: Vec<usize> = (0..self.y.len())
            .step_by(step)
            .flat_map(|row| (0..columns).step_by(step).map(move |column| row * columns + column))
            .collect();
        Hover {
            x: thinned(&self.x),
            y: thinned(&self.y),
            values: places.iter().map(|&place| self.values[place]).collect(),
            word: places.iter().map(|&place| self.word[place]).collect(),
            words: self.words.clone(),
            column: self.column.clone(),
        }
    }
}

/// A mark at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// Which shape and colour.
    pub series: usize,
}

/// Curves through fewer points show them.
pub const MARKED: usize = 50;

/// A row as a mark.
#[derive(Debug, Clone, PartialEq)]
pub struct Dot {
    /// Where it is.
    pub at: (f64, f64),
    /// Its colour; a row without a value is hollow.
    pub fill: Option<[u8; 3]>,
    /// Its shape.
    pub shape: usize,
}

/// An entry of a legend.
#[derive(Debug, Clone)]
pub struct Entry {
    /// What is drawn beside the words.
    pub key: Key,
    /// The words, in markup.
    pub text: String,
}

/// What a legend explains.
#[derive(Debug, Clone)]
pub enum Key {
    /// A line.
    Line(Stroke),
    /// A line with a light rim.
    Contour(Stroke),
    /// A mark.
    Point(Marker),
    /// A line with marks.
    Marked(Stroke, Marker),
    /// A star.
    Star,
    /// The hatched background.
    Hatch,
    /// A hollow dot.
    Hollow,
    /// A coloured mark of a row.
    Dot([u8; 3], usize),
    /// A colour.
    Fill([u8; 3]),
    /// Only words.
    None,
}

impl Key {
    /// The line of series number `series`, with its marks if they are drawn.
    pub fn series(series: usize, is_marked: bool) -> Key {
        let stroke = super::colour::series(series);
        if is_marked { Key::Marked(stroke, Marker { series }) } else { Key::Line(stroke) }
    }
}

impl Entry {
    /// Entries for several curves, one for each that is drawn in place of all that it leads.
    pub fn of_series(names: &[impl AsRef<str>], leaders: &[usize], key: impl Fn(usize) -> Key) -> Vec<Entry> {
        let drawn = (0..names.len()).filter(|&place| leaders[place] == place && names.len() > 1);
        let entry = |place| {
            let same = names.iter().zip(leaders).filter(|(_, leader)| **leader == place);
            Entry { key: key(place), text: same.map(|(name, _)| name.as_ref()).collect::<Vec<_>>().join("; ") }
        };
        drawn.map(entry).collect()
    }
}

/// A figure as SVG, and where its maps are.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// The picture.
    pub svg: String,
    /// Width and height in points.
    pub size: (f64, f64),
    /// Maps with values, and where they are in the picture.
    pub hovers: Vec<(Area, Axis, Axis, Hover)>,
}

/// The ticks of a panel, and whether its axes are labelled.
struct Plan {
    x: Ticks,
    y: Ticks,
    x_label: bool,
    y_label: bool,
}

/// Where panels of one size stand: the room around them in each column and row.
struct Layout {
    plans: Vec<Plan>,
    lefts: Vec<f64>,
    rights: Vec<f64>,
    aboves: Vec<f64>,
    belows: Vec<f64>,
    width: f64,
    height: f64,
}

/// Room around a panel for its labels.
#[derive(Debug, Clone, Copy)]
struct Room {
    left: f64,
    right: f64,
    below: f64,
}

impl Figure {
    /// Draws the figure, `width` millimetres wide.
    pub fn draw(&self, width: f64) -> Drawn {
        let width = width * MILLIMETRE;
        let mut canvas = Canvas::default();
        let mut y = MARGIN;
        let inner = width - 2.0 * MARGIN;
        for line in wrapped(&self.title, SIZE + 0.5, inner) {
            y += SIZE + 1.5;
            canvas.text((MARGIN, y), &line, SIZE + 0.5, Anchor::Start, false);
        }
        for line in wrapped(&self.subtitle, NOTE_SIZE, inner) {
            y += NOTE_SIZE + 2.2;
            canvas.coloured((MARGIN, y), &line, NOTE_SIZE, Anchor::Start, false, "#444");
        }
        y += 4.0;
        if !self.legend.is_empty() {
            y = self.legend(&mut canvas, y, inner);
        }
        let as_powers = self.as_powers();
        let bar = self.colours.as_ref().map_or(0.0, |colours| colours.width(as_powers));
        let rows = if self.rows.is_empty() { 0.0 } else { ROW_TITLE };
        let (bottom, hovers) = self.panels(&mut canvas, y, inner - bar - rows, as_powers);
        let mut foot = bottom;
        for note in &self.notes {
            for line in wrapped(note, NOTE_SIZE, inner) {
                foot += NOTE_SIZE + 2.0;
                canvas.coloured((MARGIN, foot), &line, NOTE_SIZE, Anchor::Start, false, "#444");
            }
        }
        let height = foot + MARGIN;
        Drawn { svg: canvas.svg(width, height, &label::plain(&self.title)), size: (width, height), hovers }
    }

    fn legend(&self, canvas: &mut Canvas, top: f64, inner: f64) -> f64 {
        let (mut x, mut y) = (MARGIN, top + SIZE);
        for entry in &self.legend {
            let key = if matches!(entry.key, Key::None) { 0.0 } else { 20.0 };
            let wide = key + SIZE * label::width(&entry.text) + 10.0;
            if x > MARGIN && x + wide - 8.0 > MARGIN + inner {
                x = MARGIN;
                y += SIZE + 3.0;
            }
            let middle = y - 0.35 * SIZE;
            let area = Area { x, y: middle - 3.5, width: 16.0, height: 7.0 };
            match &entry.key {
                Key::Line(stroke) => canvas.line((x, middle), (x + 16.0, middle), stroke),
                Key::Contour(stroke) => contour_line(canvas, &[vec![(x, middle), (x + 16.0, middle)]], stroke),
                Key::Point(marker) => marker.draw(canvas, (x + 8.0, middle)),
                Key::Marked(stroke, marker) => {
                    canvas.line((x, middle), (x + 16.0, middle), stroke);
                    marker.draw(canvas, (x + 8.0, middle));
                }
                Key::Star => star(canvas, (x + 8.0, middle)),
                Key::Hatch => {
                    canvas.hatch(area);
                    canvas.frame(area, &Stroke::solid("#777", 0.4));
                }
                Key::Hollow => symbol(canvas, (x + 8.0, middle), 0, "none", &Stroke::solid("#888", 0.4)),
                Key::Dot(colour, shape) => symbol(canvas, (x + 8.0, middle), *shape, &hex(*colour), &dot_rim()),
                Key::Fill(colour) => {
                    canvas.fill(area, &hex(*colour));
                    canvas.frame(area, &Stroke::solid("#777", 0.4));
                }
                Key::None => {}
            }
            canvas.text((x + key, y), &entry.text, SIZE, Anchor::Start, false);
            x += wide;
        }
        y + 4.0
    }

    /// Whether logarithmic ticks are powers of ten: in all panels if in one.
    fn as_powers(&self) -> bool {
        let axes = self.panels.iter().flat_map(|panel| [panel.x.scale, panel.y.scale]);
        axes.chain(self.colours.iter().map(|colours| colours.scale)).any(|scale| scale.needs_powers())
    }

    /// How panels are set out on `inner` points.
    fn layout(&self, inner: f64, as_powers: bool) -> Layout {
        let columns = self.columns.clamp(1, self.panels.len().max(1));
        let rows = self.panels.len().div_ceil(columns);
        // A first guess of a panel's width decides how many ticks it has, and so how much room their labels take.
        let guess = inner / columns as f64 - 40.0;
        let plan = |(place, panel): (usize, &Panel)| {
            let x_count = panel.x.fitting(guess, false);
            let y_count = panel.y.fitting(guess * self.aspect, true);
            let same_below = self.panels.get(place + columns).is_some_and(|below| below.x.same(&panel.x));
            Plan {
                x: panel.x.scale.ticks(x_count, as_powers),
                y: panel.y.scale.ticks(y_count, as_powers),
                x_label: !(self.shared && same_below),
                y_label: !self.shared || place.is_multiple_of(columns),
            }
        };
        let plans: Vec<Plan> = self.panels.iter().enumerate().map(plan).collect();
        let mut lefts = vec![0.0_f64; columns];
        let mut rights = vec![0.0_f64; columns];
        let mut belows = vec![0.0_f64; rows];
        for (place, (panel, plan)) in self.panels.iter().zip(&plans).enumerate() {
            let room = panel.room(plan, guess);
            let (row, column) = (place / columns, place % columns);
            lefts[column] = lefts[column].max(room.left);
            rights[column] = rights[column].max(room.right);
            belows[row] = belows[row].max(room.below);
        }
        let room: f64 = lefts.iter().sum::<f64>() + rights.iter().sum::<f64>();
        let width = ((inner - room) / columns as f64).max(20.0);
        let lines = self.panels.iter().map(|panel| wrapped(&panel.title, SIZE, width).len()).max().unwrap_or(0);
        let above = if lines > 0 { lines as f64 * (SIZE + 1.5) + TITLE_SPACE } else { 4.0 };
        // Titles of columns stand above the first row.
        let titled = |row: usize| if row == 0 || self.rows.is_empty() { above } else { 4.0 };
        let words = |row: &[Panel]| if row.iter().any(Panel::has_words_above) { WORDS_ABOVE } else { 0.0 };
        let aboves = self.panels.chunks(columns).enumerate().map(|(row, panels)| titled(row) + words(panels)).collect();
        Layout { plans, lefts, rights, aboves, belows, width, height: (width * self.aspect).max(20.0) }
    }

    /// Draws the panels and the colour bar; the place below them, and the maps.
    fn panels(
        &self,
        canvas: &mut Canvas,
        top: f64,
        inner: f64,
        as_powers: bool,
    ) -> (f64, Vec<(Area, Axis, Axis, Hover)>) {
        let layout = self.layout(inner, as_powers);
        let Layout { width, height, .. } = layout;
        let columns = layout.lefts.len();
        let mut y = top;
        let mut hovers = Vec::new();
        for (row, panels) in self.panels.chunks(columns).enumerate() {
            y += layout.aboves[row];
            let mut x = MARGIN;
            for (column, panel) in panels.iter().enumerate() {
                x += layout.lefts[column];
                let area = Area { x, y, width, height };
                panel.draw(canvas, area, &layout.plans[row * columns + column], layout.lefts[column]);
                for layer in &panel.layers {
                    if let Layer::Map(Map { hover: Some(hover), .. }) = layer {
                        hovers.push((area, panel.x.clone(), panel.y.clone(), hover.clone()));
                    }
                }
                x += width + layout.rights[column];
            }
            if let Some(title) = self.rows.get(row) {
                canvas.text((MARGIN + inner + SIZE, y + 0.5 * height), title, SIZE, Anchor::Middle, true);
            }
            y += height + layout.belows[row];
        }
        if let Some(colours) = &self.colours {
            let first = top + layout.aboves.first().copied().unwrap_or(0.0);
            let tall = y - layout.belows.last().copied().unwrap_or(0.0) - first;
            let beside = if self.rows.is_empty() { 0.0 } else { ROW_TITLE };
            let area = Area { x: MARGIN + inner + beside + 6.0, y: first, width: 8.0, height: tall };
            colours.draw(canvas, area, as_powers);
        }
        (y, hovers)
    }
}

fn wrapped(markup: &str, size: f64, width: f64) -> Vec<String> {
    if markup.is_empty() { Vec::new() } else { label::wrapped(markup, width / size) }
}

impl Axis {
    /// About how many labels fit on `length` points.
    fn fitting(&self, length: f64, is_vertical: bool) -> usize {
        let each = if is_vertical {
            17.0
        } else if self.scale.log {
            27.0
        } else {
            30.0
        };
        ((length / each) as usize).clamp(2, 9)
    }

    fn same(&self, other: &Axis) -> bool {
        self.column == other.column && self.scale == other.scale
    }

    fn label(&self, power: i32) -> String {
        label::axis(&self.column, &self.unit, power)
    }
}

fn widest(ticks: &Ticks) -> f64 {
    let widths = ticks.ticks.iter().filter_map(|tick| tick.label.as_deref()).map(label::width);
    TICK_SIZE * widths.fold(0.0, f64::max)
}

impl Panel {
    /// Room for the labels around a panel about `length` wide.
    fn room(&self, Plan { x, y, x_label, y_label }: &Plan, length: f64) -> Room {
        // The first and the last label of the horizontal axis may hang over.
        let over = |tick: &Tick, share: f64| {
            0.5 * TICK_SIZE * tick.label.as_deref().map_or(0.0, label::width) - share.max(0.0) * length
        };
        let before = x.ticks.iter().map(|tick| over(tick, self.x.scale.share(tick.value))).fold(0.0, f64::max);
        let after = x.ticks.iter().map(|tick| over(tick, 1.0 - self.x.scale.share(tick.value))).fold(0.0, f64::max);
        let labels = if *y_label { TICK + 2.0 + widest(y) + 3.0 + SIZE + 3.0 } else { 5.0 };
        let below = if *x_label { TICK + TICK_SIZE + 4.0 + SIZE + 6.0 } else { 2.0 };
        Room { left: labels.max(before + 3.0), right: after + 2.0, below }
    }

    fn draw(&self, canvas: &mut Canvas, area: Area, plan: &Plan, left: f64) {
        canvas.clipped(area, |canvas| self.layers.iter().for_each(|layer| self.fill(canvas, area, layer)));
        // Marks on the frame are not to be cut.
        canvas.frame(area, &Stroke::solid("#000", FRAME));
        self.layers.iter().for_each(|layer| self.mark(canvas, area, layer));
        self.marks(canvas, area);
        self.ticks(canvas, area, plan, left);
        for (line, title) in wrapped(&self.title, SIZE, area.width).iter().rev().enumerate() {
            let above = if self.has_words_above() { WORDS_ABOVE } else { 0.0 };
            let y = area.y - TITLE_SPACE - above - line as f64 * (SIZE + 1.5);
            canvas.text((area.x, y), title, SIZE, Anchor::Start, false);
        }
    }

    /// Where a point is on the sheet.
    fn place(&self, area: Area, (x, y): (f64, f64)) -> (f64, f64) {
        (area.x + area.width * self.x.scale.share(x), area.y + area.height * (1.0 - self.y.scale.share(y)))
    }

    /// Draws what is cut at the frame: areas and lines.
    fn fill(&self, canvas: &mut Canvas, area: Area, layer: &Layer) {
        let place = |point| self.place(area, point);
        let all = |lines: &[Vec<(f64, f64)>]| -> Vec<Vec<(f64, f64)>> {
            lines.iter().flat_map(|line| pieces(line.iter().map(|point| place(*point)))).collect()
        };
        match layer {
            Layer::Hatch => canvas.hatch(area),
            Layer::Map(map) => canvas.image(area, &map.png),
            Layer::Lines(lines, stroke) => canvas.lines(&all(lines), stroke),
            Layer::Contour(lines, stroke) => contour_line(canvas, &all(lines), stroke),
            Layer::Mark(x, _, stroke) => {
                let (x, _) = place((*x, self.y.scale.low));
                canvas.line((x, area.y), (x, area.y + area.height), stroke);
            }
            Layer::Level(y, stroke) => {
                let (_, y) = place((self.x.scale.low, *y));
                canvas.line((area.x, y), (area.x + area.width, y), stroke);
            }
            Layer::Band(points, colour) => {
                for run in points.split(|(_, low, high)| !(low.is_finite() && high.is_finite())) {
                    let lower = run.iter().map(|&(x, low, _)| place((x, low)));
                    let upper = run.iter().rev().map(|&(x, _, high)| place((x, high)));
                    canvas.shape(&lower.chain(upper).collect::<Vec<_>>(), &hex(*colour), None);
                }
            }
            Layer::Bars(bars, colour) => {
                for &(from, to, height) in bars.iter().filter(|(.., height)| *height > 0.0) {
                    let ((left, top), (right, bottom)) = (place((from, height)), place((to, 0.0)));
                    let bar = Area { x: left, y: top, width: right - left, height: bottom - top };
                    canvas.fill(bar, &hex(*colour));
                    canvas.frame(bar, &Stroke::solid("#000", 0.3));
                }
            }
            Layer::Points(..) | Layer::Dots(_) | Layer::Names(_) | Layer::Stars(_) => {}
        }
    }

    /// Draws the marks of points inside, whole.
    fn mark(&self, canvas: &mut Canvas, area: Area, layer: &Layer) {
        let inside = |&(x, y): &(f64, f64)| {
            let is_share = |share: f64| (-1e-9..=1.0 + 1e-9).contains(&share);
            (is_share(self.x.scale.share(x)) && is_share(self.y.scale.share(y))).then(|| self.place(area, (x, y)))
        };
        match layer {
            Layer::Points(points, marker) => {
                points.iter().filter_map(inside).for_each(|place| marker.draw(canvas, place));
            }
            Layer::Dots(dots) => {
                for (place, dot) in dots.iter().filter_map(|dot| Some((inside(&dot.at)?, dot))) {
                    match dot.fill {
                        Some(fill) => symbol(canvas, place, dot.shape, &hex(fill), &dot_rim()),
                        None => symbol(canvas, place, dot.shape, "none", &Stroke::solid("#888", 0.4)),
                    }
                }
            }
            Layer::Names(names) => {
                let names = names.iter().filter_map(|(at, name)| Some((inside(at)?, name)));
                names.for_each(|(place, name)| beside(canvas, area, place, name));
            }
            Layer::Stars(points) => points.iter().filter_map(inside).for_each(|place| clear(canvas, area, place)),
            _ => {}
        }
    }

    /// Whether vertical lines have words, which stand above the panel.
    fn has_words_above(&self) -> bool {
        let visible = |x: f64| (0.0..=1.0).contains(&self.x.scale.share(x));
        self.layers.iter().any(|layer| matches!(layer, Layer::Mark(x, words, _) if !words.is_empty() && visible(*x)))
    }

    /// The words at vertical lines: above the panel, as near to their lines as they do not run over each other.
    fn marks(&self, canvas: &mut Canvas, area: Area) {
        let mut marks: Vec<(f64, &str, &Stroke)> = Vec::new();
        for layer in &self.layers {
            let Layer::Mark(x, words, stroke) = layer else { continue };
            let share = self.x.scale.share(*x);
            if !words.is_empty() && (0.0..=1.0).contains(&share) {
                marks.push((area.x + area.width * share, words, stroke));
            }
        }
        marks.sort_by(|left, right| left.0.total_cmp(&right.0));
        let wishes: Vec<(f64, f64)> =
            marks.iter().map(|(line, words, _)| (*line, NOTE_SIZE * label::width(words) + MARK_SPACE)).collect();
        for ((line, words, stroke), place) in marks.iter().zip(apart(&wishes, area.x, area.x + area.width)) {
            let leader = Stroke::solid(&stroke.colour, stroke.width);
            canvas.line((*line, area.y), (place, area.y - LEADER), &leader);
            let foot = area.y - LEADER - 2.5;
            canvas.coloured((place, foot), words, NOTE_SIZE, Anchor::Middle, false, &stroke.colour);
        }
    }

    /// Ticks and labels; the label of the vertical axis is at the outer edge of the room to the left, `left` wide.
    fn ticks(&self, canvas: &mut Canvas, area: Area, Plan { x, y, x_label, y_label }: &Plan, left: f64) {
        let thin = Stroke::solid("#000", FRAME);
        let (bottom, right) = (area.y + area.height, area.x + area.width);
        let mut edge = f64::NEG_INFINITY;
        for tick in &x.ticks {
            let place = area.x + area.width * self.x.scale.share(tick.value);
            if place < area.x - 0.1 || place > right + 0.1 {
                continue;
            }
            let length = if tick.label.is_some() { TICK } else { 0.6 * TICK };
            canvas.line((place, bottom), (place, bottom + length), &thin);
            if let (true, Some(words)) = (*x_label, &tick.label) {
                let half = 0.5 * TICK_SIZE * label::width(words);
                if place - half > edge + 2.0 {
                    canvas.text((place, bottom + TICK + 1.0 + TICK_SIZE), words, TICK_SIZE, Anchor::Middle, false);
                    edge = place + half;
                }
            }
        }
        let mut edge = f64::INFINITY;
        for tick in &y.ticks {
            let place = area.y + area.height * (1.0 - self.y.scale.share(tick.value));
            if place < area.y - 0.1 || place > bottom + 0.1 {
                continue;
            }
            let length = if tick.label.is_some() { TICK } else { 0.6 * TICK };
            canvas.line((area.x - length, place), (area.x, place), &thin);
            if let (true, Some(words)) = (*y_label, &tick.label)
                && edge - place > TICK_SIZE + 0.5
            {
                let right = area.x - TICK - 2.0;
                canvas.text((right, place + 0.35 * TICK_SIZE), words, TICK_SIZE, Anchor::End, false);
                edge = place;
            }
        }
        if *x_label {
            let words = self.x.label(x.power);
            let place = (area.x + 0.5 * area.width, bottom + TICK + TICK_SIZE + 4.0 + SIZE);
            canvas.text(place, &words, SIZE, Anchor::Middle, false);
        }
        if *y_label {
            let words = self.y.label(y.power);
            canvas.text((area.x - left + SIZE + 1.0, area.y + 0.5 * area.height), &words, SIZE, Anchor::Middle, true);
        }
    }
}

/// Places for words of which each has a wish and a width, in the order of their wishes: such that they do not overlap, stay between
/// `low` and `high` if there is room, and are as near to their wishes as that allows.
fn apart(wishes: &[(f64, f64)], low: f64, high: f64) -> Vec<f64> {
    // Words that touch move as one block, whose place is the mean of what its words wish.
    struct Block {
        wish: f64,
        width: f64,
        words: usize,
    }
    let mut blocks: Vec<Block> = Vec::new();
    let centre = |block: &Block| {
        let half = 0.5 * block.width;
        (block.wish / block.words as f64).min(high - half).max(low + half)
    };
    for &(wish, width) in wishes {
        let mut last = Block { wish, width, words: 1 };
        while let Some(before) = blocks.pop() {
            if centre(&before) + 0.5 * before.width <= centre(&last) - 0.5 * last.width {
                blocks.push(before);
                break;
            }
            // The middle of a block that grows at its end is where its words wish it, shifted by what they are beside it.
            let shift = |block: &Block, by: f64| block.wish + by * block.words as f64;
            let wish = shift(&before, 0.5 * last.width) + shift(&last, -0.5 * before.width);
            last = Block { wish, width: before.width + last.width, words: before.words + last.words };
        }
        blocks.push(last);
    }
    let mut places = Vec::with_capacity(wishes.len());
    for block in &blocks {
        let mut edge = centre(block) - 0.5 * block.width;
        for _ in 0..block.words {
            let (_, width) = wishes[places.len()];
            places.push(edge + 0.5 * width);
            edge += width;
        }
    }
    places
}

/// A line in pieces, where points without a place cut it.
fn pieces(points: impl Iterator<Item = (f64, f64)>) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = vec![Vec::new()];
    for point in points {
        if point.0.is_nan() || point.1.is_nan() {
            pieces.push(Vec::new());
        } else if let Some(last) = pieces.last_mut() {
            last.push(point);
        }
    }
    pieces
}

fn contour_line(canvas: &mut Canvas, lines: &[Vec<(f64, f64)>], stroke: &Stroke) {
    canvas.lines(lines, &Stroke::solid("#fff", stroke.width + 1.2));
    canvas.lines(lines, stroke);
}

/// The rim of a mark of a row.
fn dot_rim() -> Stroke {
    Stroke::solid("#222", 0.3)
}

/// The name of a row beside its mark, on the side where it stays inside.
fn beside(canvas: &mut Canvas, area: Area, (x, y): (f64, f64), name: &str) {
    let wide = NOTE_SIZE * label::width(name) + 4.0;
    let (place, anchor) =
        if x + wide > area.x + area.width { (x - 3.5, Anchor::End) } else { (x + 3.5, Anchor::Start) };
    let line = (y + 0.35 * NOTE_SIZE).clamp(area.y + NOTE_SIZE, area.y + area.height - 2.0);
    canvas.coloured((place, line), name, NOTE_SIZE, anchor, false, "#333");
}

/// A star that is clear of the frame: near it, the star stands inside and a line leads to its place.
fn clear(canvas: &mut Canvas, area: Area, (x, y): (f64, f64)) {
    let room = STAR + 1.4;
    let inside = |value: f64, start: f64, length: f64| value.min(start + length - room).max(start + room);
    let place = (inside(x, area.x, area.width), inside(y, area.y, area.height));
    if place != (x, y) {
        let away = (place.0 - x).hypot(place.1 - y);
        // Farther in, so that the line is seen.
        let place = (place.0 + 1.5 * (place.0 - x) / away * STAR, place.1 + 1.5 * (place.1 - y) / away * STAR);
        canvas.line((x, y), place, &Stroke::solid("#fff", 1.6));
        canvas.line((x, y), place, &Stroke::solid("#000", 0.7));
        canvas.circle((x, y), 1.0, "#000", &Stroke::solid("#fff", 0.4));
        return star(canvas, place);
    }
    star(canvas, place);
}

/// A star with five points.
fn star(canvas: &mut Canvas, (x, y): (f64, f64)) {
    let corner = |i: usize| {
        let angle = std::f64::consts::PI * (i as f64 / 5.0 - 0.5);
        let radius = if i.is_multiple_of(2) { STAR } else { 1.9 };
        (x + radius * angle.cos(), y + radius * angle.sin())
    };
    let corners: Vec<(f64, f64)> = (0..10).map(corner).collect();
    canvas.shape(&corners, "#fff", Some(&Stroke::solid("#000", 0.8)));
}

impl Marker {
    fn draw(&self, canvas: &mut Canvas, place: (f64, f64)) {
        let colour = super::colour::series(self.series).colour;
        symbol(canvas, place, self.series, "#fff", &Stroke::solid(&colour, 0.8));
    }
}

/// A circle, a square, a triangle or a rhombus.
fn symbol(canvas: &mut Canvas, (x, y): (f64, f64), shape: usize, fill: &str, stroke: &Stroke) {
    let r = 2.0;
    let corners: &[(f64, f64)] = match shape % 4 {
        0 => return canvas.circle((x, y), r, fill, stroke),
        1 => &[(-r, -r), (r, -r), (r, r), (-r, r)],
        2 => &[(0.0, -r - 0.5), (r + 0.3, r), (-r - 0.3, r)],
        _ => &[(0.0, -r - 0.8), (r + 0.8, 0.0), (0.0, r + 0.8), (-r - 0.8, 0.0)],
    };
    let corners: Vec<(f64, f64)> = corners.iter().map(|(right, down)| (x + right, y + down)).collect();
    canvas.shape(&corners, fill, Some(stroke));
}

impl Colours {
    fn width(&self, as_powers: bool) -> f64 {
        6.0 + 8.0 + TICK + 2.0 + widest(&self.scale.ticks(6, as_powers)) + 4.0 + SIZE + 1.0
    }

    fn draw(&self, canvas: &mut Canvas, area: Area, as_powers: bool) {
        let steps = 128;
        let pixels: Vec<Option<[u8; 3]>> =
            (0..steps).map(|i| Some(viridis(1.0 - (i as f64 + 0.5) / steps as f64))).collect();
        if let Some(png) = super::export::image(1, &pixels) {
            canvas.image(area, &png);
        }
        canvas.frame(area, &Stroke::solid("#000", FRAME));
        let ticks = self.scale.ticks(6, as_powers);
        let right = area.x + area.width;
        let mut edge = f64::INFINITY;
        for tick in &ticks.ticks {
            let share = self.scale.share(tick.value);
            if !(-1e-9..=1.0 + 1e-9).contains(&share) {
                continue;
            }
            let y = area.y + area.height * (1.0 - share);
            let length = if tick.label.is_some() { TICK } else { 0.6 * TICK };
            canvas.line((right, y), (right + length, y), &Stroke::solid("#000", FRAME));
            if let Some(words) = &tick.label
                && edge - y > TICK_SIZE + 0.5
            {
                canvas.text((right + TICK + 2.0, y + 0.35 * TICK_SIZE), words, TICK_SIZE, Anchor::Start, false);
                edge = y;
            }
        }
        let mut words = self.label.clone();
        if ticks.power != 0 {
            words.push_str(&format!(" (10^{{{}}})", label::signed(ticks.power)));
        }
        let x = right + TICK + 2.0 + widest(&ticks) + 4.0 + SIZE - 1.0;
        canvas.text((x, area.y + 0.5 * area.height), &words, SIZE, Anchor::Middle, true);
    }
}

#[cfg(test)]
mod tests {
    //! Words beside each other; maps of fewer values.

    use super::{Hover, apart};

    #[test]
    fn words_do_not_overlap_and_stay_near_their_wishes() {
        assert_eq!(apart(&[(10.0, 4.0), (50.0, 4.0)], 0.0, 100.0), [10.0, 50.0]);
        assert_eq!(apart(&[(10.0, 4.0), (10.0, 4.0)], 0.0, 100.0), [8.0, 12.0]);
        assert_eq!(apart(&[(0.0, 4.0), (99.0, 4.0)], 0.0, 100.0), [2.0, 98.0]);
        // Three at the left edge push each other to the right; the widths differ.
        assert_eq!(apart(&[(1.0, 4.0), (1.0, 6.0), (2.0, 4.0)], 0.0, 100.0), [2.0, 7.0, 12.0]);
        // The mean displacement of a block is zero.
        let places = apart(&[(20.0, 10.0), (24.0, 6.0), (30.0, 10.0)], 0.0, 100.0);
        assert!((places.iter().sum::<f64>() - 74.0).abs() < 1e-12, "{places:?}");
    }

    #[test]
    fn a_coarser_map_has_the_values_of_its_cells() {
        let (x, y) = (vec![1.0, 2.0, 3.0, 4.0, 5.0], vec![10.0, 20.0, 30.0]);
        let values: Vec<f64> = y.iter().flat_map(|y| x.iter().map(move |x| x + y)).collect();
        let hover = Hover { x, y, word: vec![1; values.len()], values, words: Vec::new(), column: "gap".to_owned() };
        let coarser = hover.every(2);
        assert_eq!((coarser.x.as_slice(), coarser.y.as_slice()), (&[1.0, 3.0, 5.0][..], &[10.0, 30.0][..]));
        assert_eq!(coarser.values, [11.0, 13.0, 15.0, 31.0, 33.0, 35.0]);
        assert_eq!(coarser.word.len(), 6);
    }
}
