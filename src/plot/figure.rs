//! A figure of given width: panels with axes and layers, a legend, a colour bar and text.

use std::collections::HashSet;

use super::canvas::{Anchor, Area, Canvas, MILLIMETRE, Stroke, Text};
use super::colour::{hex, viridis};
use super::label;
use super::scale::{Scale, Tick, Ticks};
use super::symbol::{self, RADIUS, STAR_RADIUS, Symbol};

/// Height of letters, in points. Chosen: as in the captions of journals, readable in print.
const SIZE: f64 = 7.5;

/// Height of the numbers at ticks, in points. Chosen: a little below the labels of axes.
const TICK_SIZE: f64 = 7.0;

/// Height of the letters of notes, in points. Chosen: the smallest readable size in print.
const NOTE_SIZE: f64 = 6.2;

/// Length of a tick with a number, in points; others have 0.6 of it. Chosen: a third of its number.
const TICK_LENGTH: f64 = 2.6;

/// Space between the figure and the edge of the picture, in points. Chosen: it separates the figure from the surrounding text.
const MARGIN: f64 = 5.0;

/// Width of the lines of frames and ticks, in points. Chosen: half a curve's.
const FRAME_WIDTH: f64 = 0.6;

/// Space between the baseline of a title and the frame below, in points. Chosen: it holds descenders.
const TITLE_SPACE: f64 = 5.0;

/// Space of the titles of rows of panels, in points. Chosen: a line and its distance from the frame.
const ROW_TITLE_WIDTH: f64 = SIZE + 6.0;

/// Length of the leader from the end of a vertical line to its label, in points. Chosen: labels may move aside by several letters.
const LEADER_LENGTH: f64 = 5.0;

/// Space between labels of vertical lines, in points. Chosen: the width of two spaces.
const WORD_SPACE: f64 = 5.0;

/// Height of leaders and labels above a panel, in points. Derived: leader, gap and letters.
const WORDS_HEIGHT: f64 = LEADER_LENGTH + 2.5 + NOTE_SIZE;

/// Least width of a panel with its margins, in points; panels of a narrower figure stand in fewer columns. Chosen: three labels fit below a panel.
const MIN_PANEL_WIDTH: f64 = 100.0;

/// Space between a map and its colour bar, and width of the bar, in points. Chosen: the bar is as wide as a letter is high.
const BAR_SPACE: f64 = 6.0;
const BAR_WIDTH: f64 = 8.0;

/// Number of colours of a colour bar. Chosen: steps are invisible.
const BAR_STEPS: usize = 128;

/// Width of the sample of a legend entry, in points. Chosen: it shows a dash and a space.
const KEY_WIDTH: f64 = 20.0;

/// Number of points of a curve above which they have no marks. Chosen: more marks would touch.
pub const MAX_MARKED_POINTS: usize = 50;

/// Greatest number of places with a name in a panel; with more, there are no names. Chosen: more names overlap.
const MAX_NAMES: usize = 60;

/// Text styles of figures and of notes.
const LABEL: Text = Text { size: SIZE, anchor: Anchor::Start, upwards: false, colour: "#000" };
const NOTE: Text = Text { size: NOTE_SIZE, anchor: Anchor::Start, upwards: false, colour: "#444" };

/// A figure.
#[derive(Debug, Clone, Default)]
pub struct Figure {
    /// The title, in markup.
    pub title: String,
    /// The common values, in markup.
    pub subtitle: String,
    /// The panels, row after row.
    pub panels: Vec<Panel>,
    /// Number of panels side by side.
    pub columns: usize,
    /// The titles of the rows of panels, in markup, if panels are crossed; else empty.
    pub rows: Vec<String>,
    /// Height of a panel relative to its width.
    pub aspect: f64,
    /// The legend.
    pub legend: Vec<Entry>,
    /// The numbers that the colours of maps stand for; the darkest colour is at the start of their scale.
    pub colours: Option<Axis>,
    /// Notes below the panels, in markup.
    pub notes: Vec<String>,
    /// Notes for the terminal, such as omitted panels.
    pub remarks: Vec<String>,
}

/// A panel: a pair of axes and the layers between them.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Its distinguishing text, in markup.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The layers, from back to front.
    pub layers: Vec<Layer>,
}

/// An axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name of its column.
    pub column: String,
    /// Unit of its column.
    pub unit: String,
    /// The range.
    pub scale: Scale,
}

impl Axis {
    /// The axis of a column with a unit, over the range of `scale`.
    pub fn new(column: &str, unit: &str, scale: Scale) -> Axis {
        Axis { column: column.to_owned(), unit: unit.to_owned(), scale }
    }

    fn label(&self, power: i32) -> String {
        label::axis(&self.column, &self.unit, power)
    }
}

/// A layer between axes. Positions are axis values, unless stated as fractions.
#[derive(Debug, Clone)]
pub enum Layer {
    /// Colours that fill the panel, which is hatched where there are none: a PNG image, first row at the top, and the values under the pointer,
    /// for HTML pages.
    Map(Vec<u8>, Hover),
    /// A line through points.
    Line(Vec<(f64, f64)>, Stroke),
    /// Lines that are visible on any colour: dark, with a light rim.
    Contour(Vec<Vec<(f64, f64)>>, Stroke),
    /// A filled band between two curves: each point has a least and a greatest value.
    Band(Vec<(f64, f64, f64)>, [u8; 3]),
    /// Bars from zero: start, end and height of each.
    Bars(Vec<(f64, f64, f64)>, [u8; 3]),
    /// Small marks at points.
    Marks(Vec<((f64, f64), Symbol)>),
    /// Names of points, in markup.
    Names(Vec<((f64, f64), String)>),
    /// A star.
    Star((f64, f64)),
    /// A vertical line with a label above its upper end, in markup.
    Vertical(f64, String, Stroke),
    /// A horizontal line.
    Level(f64, Stroke),
}

impl Layer {
    /// The marks of the points of series number `series`.
    pub fn marks(points: Vec<(f64, f64)>, series: usize) -> Layer {
        Layer::Marks(points.into_iter().map(|at| (at, Symbol::of_series(series))).collect())
    }
}

/// The values of a map.
#[derive(Debug, Clone)]
pub struct Hover {
    /// Values of the horizontal axis.
    pub x: Vec<f64>,
    /// Values of the vertical axis.
    pub y: Vec<f64>,
    /// The value of each cell, row by row from the least `y`; NaN for a missing value.
    pub values: Vec<f64>,
    /// Words for some cells.
    pub words: Vec<String>,
    /// The index of the word of each cell, if any.
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

/// An entry of a legend.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Its sample.
    pub key: Key,
    /// The text, in markup.
    pub text: String,
}

/// The sample of an entry of a legend.
#[derive(Debug, Clone)]
pub enum Key {
    /// A line.
    Line(Stroke),
    /// A line with a light rim.
    Contour(Stroke),
    /// A mark.
    Mark(Symbol),
    /// A line with marks.
    Marked(Stroke, Symbol),
    /// A star.
    Star,
    /// The hatched background.
    Hatch,
    /// A colour.
    Fill([u8; 3]),
}

impl Key {
    /// The line of series number `series`, with its marks if they are drawn.
    pub fn series(series: usize, is_marked: bool) -> Key {
        let stroke = super::colour::series(series);
        if is_marked { Key::Marked(stroke, Symbol::of_series(series)) } else { Key::Line(stroke) }
    }
}

impl Entry {
    /// Entries for several curves: one for each group of coinciding curves.
    pub fn of_series(names: &[impl AsRef<str>], leaders: &[usize], key: impl Fn(usize) -> Key) -> Vec<Entry> {
        let drawn = (0..names.len()).filter(|&place| leaders[place] == place && names.len() > 1);
        let entry = |place| {
            let same = names.iter().zip(leaders).filter(|(_, leader)| **leader == place);
            Entry { key: key(place), text: label::few(&same.map(|(name, _)| name).collect::<Vec<_>>()) }
        };
        drawn.map(entry).collect()
    }
}

/// A figure as SVG, with the positions of its maps.
#[derive(Debug, Clone)]
pub struct SvgFigure<'a> {
    /// The picture.
    pub svg: String,
    /// The maps: position in the picture, panel and values.
    pub maps: Vec<(Area, &'a Panel, &'a Hover)>,
}

/// The ticks of a panel, and whether its axes are labelled.
struct PanelTicks {
    x: Ticks,
    y: Ticks,
    x_label: bool,
    y_label: bool,
}

/// The layout of panels of one size: margins of each column and row.
struct Layout {
    ticks: Vec<PanelTicks>,
    lefts: Vec<f64>,
    rights: Vec<f64>,
    aboves: Vec<f64>,
    belows: Vec<f64>,
    width: f64,
    height: f64,
}

impl Figure {
    /// Draws the figure, `width` millimetres wide.
    pub fn draw(&self, width: f64) -> SvgFigure<'_> {
        let width = width * MILLIMETRE;
        let mut canvas = Canvas::default();
        let inner = width - 2.0 * MARGIN;
        let title = Text { size: SIZE + 0.5, ..LABEL };
        let top = paragraph(&mut canvas, &self.title, &title, MARGIN, (inner, 1.0));
        let mut top = paragraph(&mut canvas, &self.subtitle, &NOTE, top, (inner, 2.2)) + 4.0;
        if !self.legend.is_empty() {
            top = self.draw_legend(&mut canvas, top, inner);
        }
        let bar = self.colours.as_ref().map_or(0.0, Axis::bar_width);
        let (mut foot, maps) = self.draw_panels(&mut canvas, top, inner - bar - self.row_title_width());
        for note in &self.notes {
            foot = paragraph(&mut canvas, note, &NOTE, foot, (inner, 2.0));
        }
        let height = foot + MARGIN;
        SvgFigure { svg: canvas.svg(width, height, &label::plain(&self.title)), maps }
    }

    /// Draws the legend below `top`; returns its lower edge.
    fn draw_legend(&self, canvas: &mut Canvas, top: f64, inner: f64) -> f64 {
        let (mut x, mut y) = (MARGIN, top + SIZE);
        for entry in &self.legend {
            let most = (inner - KEY_WIDTH) / SIZE;
            let lines: Vec<String> =
                label::wrapped(&entry.text, most).iter().map(|line| label::shortened(line, most)).collect();
            let widest = lines.iter().map(|line| label::width(line)).fold(0.0, f64::max);
            let wide = KEY_WIDTH + SIZE * widest + 10.0;
            if x > MARGIN && x + wide - 8.0 > MARGIN + inner {
                x = MARGIN;
                y += SIZE + 3.0;
            }
            entry.key.draw(canvas, (x, y - 0.35 * SIZE));
            for (place, line) in lines.iter().enumerate() {
                y += if place > 0 { SIZE + 1.5 } else { 0.0 };
                canvas.text((x + KEY_WIDTH, y), line, &LABEL);
            }
            x += wide;
        }
        y + 4.0
    }

    /// Width of the titles of rows of panels, in points.
    fn row_title_width(&self) -> f64 {
        if self.rows.is_empty() { 0.0 } else { ROW_TITLE_WIDTH }
    }

    /// The layout of the panels in a width of `inner` points.
    fn layout(&self, inner: f64) -> Layout {
        let most = if self.rows.is_empty() { (inner / MIN_PANEL_WIDTH) as usize } else { usize::MAX };
        let columns = self.columns.min(most).clamp(1, self.panels.len().max(1));
        // A first guess of a panel's width determines the number of ticks, and so the space for their labels.
        let guess = inner / columns as f64 - 40.0;
        let ticks = |(place, panel): (usize, &Panel)| PanelTicks {
            x: panel.x.scale.ticks(fitting(guess, if panel.x.scale.log { 27.0 } else { 30.0 })),
            y: panel.y.scale.ticks(fitting(guess * self.aspect, 17.0)),
            x_label: self.panels.get(place + columns).is_none_or(|below| below.x != panel.x),
            y_label: place.is_multiple_of(columns),
        };
        let ticks: Vec<PanelTicks> = self.panels.iter().enumerate().map(ticks).collect();
        let mut lefts = vec![0.0_f64; columns];
        let mut rights = vec![0.0_f64; columns];
        let mut belows = vec![0.0_f64; self.panels.len().div_ceil(columns)];
        for (place, ticks) in ticks.iter().enumerate() {
            let (row, column) = (place / columns, place % columns);
            // The first and the last label of the horizontal axis may extend beyond the panel.
            let before = ticks.x.beyond(guess, |fraction| fraction);
            let after = ticks.x.beyond(guess, |fraction| 1.0 - fraction);
            let left = if ticks.y_label { TICK_LENGTH + 2.0 + widest(&ticks.y) + 3.0 + SIZE + 3.0 } else { 5.0 };
            lefts[column] = lefts[column].max(left.max(before + 3.0));
            rights[column] = rights[column].max(after + 2.0);
            let below = if ticks.x_label { TICK_LENGTH + TICK_SIZE + 4.0 + SIZE + 6.0 } else { 0.5 * TICK_SIZE + 1.0 };
            belows[row] = belows[row].max(below);
        }
        let room: f64 = lefts.iter().sum::<f64>() + rights.iter().sum::<f64>();
        let width = ((inner - room) / columns as f64).max(20.0);
        let lines = self.panels.iter().map(|panel| wrapped(&panel.title, SIZE, width).len()).max().unwrap_or(0);
        let above = if lines > 0 { lines as f64 * (SIZE + 1.5) + TITLE_SPACE } else { 4.0 };
        // Titles of columns stand above the first row.
        let titled = |row: usize| if row == 0 || self.rows.is_empty() { above } else { 4.0 };
        let words = |row: &[Panel]| if row.iter().any(Panel::has_words_above) { WORDS_HEIGHT } else { 0.0 };
        let aboves = self.panels.chunks(columns).enumerate().map(|(row, panels)| titled(row) + words(panels)).collect();
        Layout { ticks, lefts, rights, aboves, belows, width, height: (width * self.aspect).max(20.0) }
    }

    /// Draws the panels and the colour bar; returns their lower edge, and the maps.
    fn draw_panels(&self, canvas: &mut Canvas, top: f64, inner: f64) -> (f64, Vec<(Area, &Panel, &Hover)>) {
        let layout = self.layout(inner);
        let Layout { width, height, .. } = layout;
        let columns = layout.lefts.len();
        let mut y = top;
        let mut maps = Vec::new();
        for (row, panels) in self.panels.chunks(columns).enumerate() {
            y += layout.aboves[row];
            let mut x = MARGIN;
            for (column, panel) in panels.iter().enumerate() {
                x += layout.lefts[column];
                let area = Area { x, y, width, height };
                panel.draw(canvas, area, &layout.ticks[row * columns + column], layout.lefts[column]);
                maps.extend(panel.layers.iter().filter_map(|layer| match layer {
                    Layer::Map(_, hover) => Some((area, panel, hover)),
                    _ => None,
                }));
                x += width + layout.rights[column];
            }
            if let Some(title) = self.rows.get(row) {
                let place = (MARGIN + inner + SIZE, y + 0.5 * height);
                canvas.text(place, title, &Text { anchor: Anchor::Middle, upwards: true, ..LABEL });
            }
            y += height + layout.belows[row];
        }
        if let Some(colours) = &self.colours {
            let first = top + layout.aboves.first().copied().unwrap_or(0.0);
            let tall = y - layout.belows.last().copied().unwrap_or(0.0) - first;
            let x = MARGIN + inner + self.row_title_width() + BAR_SPACE;
            colours.draw_bar(canvas, Area { x, y: first, width: BAR_WIDTH, height: tall });
        }
        (y, maps)
    }
}

/// Draws a paragraph below `top`, with lines of at most `width` points and `space` between them; returns its lower edge.
fn paragraph(canvas: &mut Canvas, markup: &str, style: &Text, top: f64, (width, space): (f64, f64)) -> f64 {
    let mut y = top;
    for line in wrapped(markup, style.size, width) {
        y += style.size + space;
        canvas.text((MARGIN, y), &line, style);
    }
    y
}

fn wrapped(markup: &str, size: f64, width: f64) -> Vec<String> {
    if markup.is_empty() { Vec::new() } else { label::wrapped(markup, width / size) }
}

/// The approximate number of labels of `each` points that fit on `length` points.
fn fitting(length: f64, each: f64) -> usize {
    ((length / each) as usize).clamp(2, 9)
}

fn widest(ticks: &Ticks) -> f64 {
    let widths = ticks.ticks.iter().filter_map(|tick| tick.label.as_deref()).map(label::width);
    TICK_SIZE * widths.fold(0.0, f64::max)
}

impl Ticks {
    /// The overhang of labels beyond an axis of about `length`, at the fraction `away` of it.
    fn beyond(&self, length: f64, away: impl Fn(f64) -> f64) -> f64 {
        let half = |label: &Option<String>| 0.5 * TICK_SIZE * label.as_deref().map_or(0.0, label::width);
        let over = self.ticks.iter().map(|tick| half(&tick.label) - away(tick.fraction).max(0.0) * length);
        over.fold(0.0, f64::max)
    }

    /// Draws the ticks and the numbers of a horizontal axis below a panel.
    fn draw_below(&self, canvas: &mut Canvas, area: Area, is_labelled: bool) {
        let bottom = area.y + area.height;
        let mut edge = f64::NEG_INFINITY;
        for tick in &self.ticks {
            let x = area.x + area.width * tick.fraction;
            canvas.line((x, bottom), (x, bottom + tick.length()), &Stroke::solid("#000", FRAME_WIDTH));
            let Some(words) = tick.label.as_deref().filter(|_| is_labelled) else { continue };
            let half = 0.5 * TICK_SIZE * label::width(words);
            if x - half > edge + 2.0 {
                let style = Text { size: TICK_SIZE, anchor: Anchor::Middle, ..LABEL };
                canvas.text((x, bottom + TICK_LENGTH + 1.0 + TICK_SIZE), words, &style);
                edge = x + half;
            }
        }
    }

    /// Draws the ticks and the numbers of a vertical axis to the right or to the left of `area`.
    fn draw_side_axis(&self, canvas: &mut Canvas, area: Area, is_right: bool, is_labelled: bool) {
        let x = if is_right { area.x + area.width } else { area.x };
        let mut edge = f64::INFINITY;
        for tick in &self.ticks {
            let y = area.y + area.height * (1.0 - tick.fraction);
            let (from, to) = if is_right { (x, x + tick.length()) } else { (x - tick.length(), x) };
            canvas.line((from, y), (to, y), &Stroke::solid("#000", FRAME_WIDTH));
            let Some(words) = tick.label.as_deref().filter(|_| is_labelled) else { continue };
            if edge - y > TICK_SIZE + 0.5 {
                let (x, anchor) = if is_right {
                    (x + TICK_LENGTH + 2.0, Anchor::Start)
                } else {
                    (x - TICK_LENGTH - 2.0, Anchor::End)
                };
                canvas.text((x, y + 0.35 * TICK_SIZE), words, &Text { size: TICK_SIZE, anchor, ..LABEL });
                edge = y;
            }
        }
    }
}

impl Tick {
    fn length(&self) -> f64 {
        if self.label.is_some() { TICK_LENGTH } else { 0.6 * TICK_LENGTH }
    }
}

impl Key {
    /// Draws it to the right of `(x, middle)`.
    fn draw(&self, canvas: &mut Canvas, (x, middle): (f64, f64)) {
        let (centre, end) = ((x + 8.0, middle), (x + 16.0, middle));
        let area = Area { x, y: middle - 3.5, width: 16.0, height: 7.0 };
        match self {
            Key::Line(stroke) => canvas.line((x, middle), end, stroke),
            Key::Contour(stroke) => draw_contour(canvas, &[vec![(x, middle), end]], stroke),
            Key::Mark(symbol) => symbol.draw(canvas, centre),
            Key::Marked(stroke, symbol) => {
                canvas.line((x, middle), end, stroke);
                symbol.draw(canvas, centre);
            }
            Key::Star => symbol::draw_star(canvas, centre),
            Key::Hatch => {
                canvas.hatch(area);
                canvas.frame(area, &Stroke::solid("#777", 0.4));
            }
            Key::Fill(colour) => {
                canvas.fill(area, &hex(*colour));
                canvas.frame(area, &Stroke::solid("#777", 0.4));
            }
        }
    }
}

impl Panel {
    /// Draws the panel. The label of its vertical axis is at the outer edge of the left margin, which is `left` wide.
    fn draw(&self, canvas: &mut Canvas, area: Area, ticks: &PanelTicks, left: f64) {
        canvas.clipped(area, |canvas| self.layers.iter().for_each(|layer| self.fill(canvas, area, layer)));
        // Marks on the frame are not clipped.
        canvas.frame(area, &Stroke::solid("#000", FRAME_WIDTH));
        self.layers.iter().for_each(|layer| self.mark(canvas, area, layer));
        self.draw_names(canvas, area);
        self.draw_words_above(canvas, area);
        ticks.x.draw_below(canvas, area, ticks.x_label);
        ticks.y.draw_side_axis(canvas, area, false, ticks.y_label);
        let middle = Text { anchor: Anchor::Middle, ..LABEL };
        if ticks.x_label {
            let place = (area.x + 0.5 * area.width, area.y + area.height + TICK_LENGTH + TICK_SIZE + 4.0 + SIZE);
            canvas.text(place, &self.x.label(ticks.x.power), &middle);
        }
        if ticks.y_label {
            let place = (area.x - left + SIZE + 1.0, area.y + 0.5 * area.height);
            canvas.text(place, &self.y.label(ticks.y.power), &Text { upwards: true, ..middle });
        }
        let above = if self.has_words_above() { WORDS_HEIGHT } else { 0.0 };
        for (line, title) in wrapped(&self.title, SIZE, area.width).iter().rev().enumerate() {
            let y = area.y - TITLE_SPACE - above - line as f64 * (SIZE + 1.5);
            canvas.text((area.x, y), title, &LABEL);
        }
    }

    /// The position of a point on the page.
    fn place(&self, area: Area, (x, y): (f64, f64)) -> (f64, f64) {
        (area.x + area.width * self.x.scale.fraction(x), area.y + area.height * (1.0 - self.y.scale.fraction(y)))
    }

    /// Draws areas and lines, which are clipped at the frame.
    fn fill(&self, canvas: &mut Canvas, area: Area, layer: &Layer) {
        let place = |point| self.place(area, point);
        let pieces = |line: &Vec<(f64, f64)>| pieces(line.iter().map(|point| place(*point)));
        match layer {
            Layer::Map(png, _) => {
                canvas.hatch(area);
                canvas.image(area, png);
            }
            Layer::Line(line, stroke) => canvas.lines(&pieces(line), stroke),
            Layer::Contour(lines, stroke) => {
                draw_contour(canvas, &lines.iter().flat_map(pieces).collect::<Vec<_>>(), stroke);
            }
            Layer::Vertical(x, _, stroke) => {
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
            Layer::Marks(_) | Layer::Names(_) | Layer::Star(_) => {}
        }
    }

    /// The position of a point on the page, if it is inside.
    fn inside(&self, area: Area, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let is_inside = |fraction: f64| (-1e-9..=1.0 + 1e-9).contains(&fraction);
        (is_inside(self.x.scale.fraction(x)) && is_inside(self.y.scale.fraction(y))).then(|| self.place(area, (x, y)))
    }

    /// Draws the name of each row near its mark, where it meets neither a mark nor another name; a name without space is left out. Rows of one name
    /// at one `x`, such as those of a material, have it once.
    fn draw_names(&self, canvas: &mut Canvas, area: Area) {
        let size = 2.0 * RADIUS;
        let around = |(x, y): (f64, f64)| Area { x: x - RADIUS, y: y - RADIUS, width: size, height: size };
        let (mut taken, mut names) = (Vec::new(), Vec::new());
        for layer in &self.layers {
            match layer {
                Layer::Marks(marks) => {
                    taken.extend(marks.iter().filter_map(|(at, _)| self.inside(area, *at)).map(around))
                }
                Layer::Names(of_layer) => names.extend(of_layer),
                _ => {}
            }
        }
        let key = |((x, _), name): &((f64, f64), String)| (name.clone(), x.to_bits());
        let places: HashSet<_> = names.iter().map(|named| key(named)).collect();
        let mut undrawn = if places.len() > MAX_NAMES { HashSet::new() } else { places };
        for named in names {
            let (at, name) = named;
            let Some((x, y)) = self.inside(area, *at).filter(|_| undrawn.contains(&key(named))) else { continue };
            let wide = NOTE_SIZE * label::width(name);
            let around_mark =
                [(x + 3.5, y), (x - 3.5 - wide, y), (x - 0.5 * wide, y - NOTE_SIZE), (x - 0.5 * wide, y + NOTE_SIZE)];
            let boxes = around_mark.map(|(x, y)| Area { x, y: y - 0.5 * NOTE_SIZE, width: wide, height: NOTE_SIZE });
            let is_free = |place: &&Area| area.holds(place) && !taken.iter().any(|other| place.meets(other));
            let Some(place) = boxes.iter().find(is_free).copied() else { continue };
            canvas.text((place.x, place.y + 0.85 * NOTE_SIZE), name, &Text { colour: "#333", ..NOTE });
            taken.push(place);
            undrawn.remove(&key(named));
        }
    }

    /// Draws the marks of points inside, without clipping.
    fn mark(&self, canvas: &mut Canvas, area: Area, layer: &Layer) {
        match layer {
            Layer::Marks(marks) => {
                let marks = marks.iter().filter_map(|(at, symbol)| Some((self.inside(area, *at)?, symbol)));
                marks.for_each(|(place, symbol)| symbol.draw(canvas, place));
            }
            Layer::Star(at) => {
                if let Some(place) = self.inside(area, *at) {
                    draw_clear_star(canvas, area, place);
                }
            }
            _ => {}
        }
    }

    /// The vertical lines inside with a label: position as a fraction of the panel, label and stroke.
    fn words(&self) -> impl Iterator<Item = (f64, &str, &Stroke)> {
        self.layers.iter().filter_map(|layer| {
            let Layer::Vertical(x, words, stroke) = layer else { return None };
            let fraction = self.x.scale.fraction(*x);
            (!words.is_empty() && (0.0..=1.0).contains(&fraction)).then_some((fraction, words.as_str(), stroke))
        })
    }

    fn has_words_above(&self) -> bool {
        self.words().next().is_some()
    }

    /// Draws the labels of vertical lines above the panel, as close to their lines as possible without overlap.
    fn draw_words_above(&self, canvas: &mut Canvas, area: Area) {
        let marks = self.words().map(|(fraction, words, stroke)| (area.x + area.width * fraction, words, stroke));
        let mut marks: Vec<(f64, &str, &Stroke)> = marks.collect();
        marks.sort_by(|left, right| left.0.total_cmp(&right.0));
        let wishes: Vec<(f64, f64)> =
            marks.iter().map(|(line, words, _)| (*line, NOTE_SIZE * label::width(words) + WORD_SPACE)).collect();
        for ((line, words, stroke), place) in marks.iter().zip(apart(&wishes, area.x, area.x + area.width)) {
            let leader = Stroke { dashes: &[], ..**stroke };
            canvas.line((*line, area.y), (place, area.y - LEADER_LENGTH), &leader);
            let style = Text { anchor: Anchor::Middle, colour: stroke.colour, ..NOTE };
            canvas.text((place, area.y - LEADER_LENGTH - 2.5), words, &style);
        }
    }
}

/// Positions of labels with a desired position and a width, in ascending order. Labels do not overlap, stay between `low` and `high` if there is
/// space, and are as close to their desired positions as possible.
fn apart(wishes: &[(f64, f64)], low: f64, high: f64) -> Vec<f64> {
    // Touching labels move as one block at the mean of their desired positions.
    struct LabelBlock {
        wish: f64,
        width: f64,
        words: usize,
    }
    let mut blocks: Vec<LabelBlock> = Vec::new();
    let centre = |block: &LabelBlock| {
        let half = 0.5 * block.width;
        (block.wish / block.words as f64).min(high - half).max(low + half)
    };
    for &(wish, width) in wishes {
        let mut last = LabelBlock { wish, width, words: 1 };
        while let Some(before) = blocks.pop() {
            if centre(&before) + 0.5 * before.width <= centre(&last) - 0.5 * last.width {
                blocks.push(before);
                break;
            }
            // A block that grows at its end keeps the offsets of its labels.
            let shift = |block: &LabelBlock, by: f64| block.wish + by * block.words as f64;
            let wish = shift(&before, 0.5 * last.width) + shift(&last, -0.5 * before.width);
            last = LabelBlock { wish, width: before.width + last.width, words: before.words + last.words };
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

/// The pieces of a line, cut at points with NaN.
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

/// Draws lines that are visible on any colour.
fn draw_contour(canvas: &mut Canvas, lines: &[Vec<(f64, f64)>], stroke: &Stroke) {
    canvas.lines(lines, &Stroke::solid("#fff", stroke.width + 1.2));
    canvas.lines(lines, stroke);
}

/// Draws a star clear of the frame: near the frame it is moved inside, and a line leads to its position.
fn draw_clear_star(canvas: &mut Canvas, area: Area, (x, y): (f64, f64)) {
    let room = STAR_RADIUS + 1.4;
    let inside = |value: f64, start: f64, length: f64| value.min(start + length - room).max(start + room);
    let mut place = (inside(x, area.x, area.width), inside(y, area.y, area.height));
    if place != (x, y) {
        // Farther inside, so that the line is visible.
        let away = (place.0 - x).hypot(place.1 - y);
        let farther = |here: f64, from: f64| here + 1.5 * (here - from) / away * STAR_RADIUS;
        place = (farther(place.0, x), farther(place.1, y));
        canvas.line((x, y), place, &Stroke::solid("#fff", 1.6));
        canvas.line((x, y), place, &Stroke::solid("#000", 0.7));
        canvas.circle((x, y), 1.0, "#000", &Stroke::solid("#fff", 0.4));
    }
    symbol::draw_star(canvas, place);
}

impl Axis {
    /// Width of its colour bar with the space before it.
    fn bar_width(&self) -> f64 {
        let ticks = self.scale.ticks(6);
        BAR_SPACE + BAR_WIDTH + TICK_LENGTH + 2.0 + widest(&ticks) + 4.0 + SIZE + 1.0
    }

    fn draw_bar(&self, canvas: &mut Canvas, area: Area) {
        let colour = |i| Some(viridis(1.0 - (i as f64 + 0.5) / BAR_STEPS as f64));
        if let Some(png) = super::export::image(1, &(0..BAR_STEPS).map(colour).collect::<Vec<_>>()) {
            canvas.image(area, &png);
        }
        canvas.frame(area, &Stroke::solid("#000", FRAME_WIDTH));
        let ticks = self.scale.ticks(6);
        ticks.draw_side_axis(canvas, area, true, true);
        let x = area.x + area.width + TICK_LENGTH + 2.0 + widest(&ticks) + 4.0 + SIZE - 1.0;
        let style = Text { anchor: Anchor::Middle, upwards: true, ..LABEL };
        canvas.text((x, area.y + 0.5 * area.height), &self.label(ticks.power), &style);
    }
}

#[cfg(test)]
mod tests {
    //! Layout of words; thinned maps.

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
