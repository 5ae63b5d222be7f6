//! An SVG canvas: shapes and text, in points from the upper left corner.

use std::fmt::Write;

use super::label::{self, FAMILIES, SCRIPT_SIZE, SUBSCRIPT_DROP, SUPERSCRIPT_RISE};
use crate::names::trimmed;

/// Points per millimetre. Derived: 72 points and 25.4 mm to the inch.
pub const MILLIMETRE: f64 = 72.0 / 25.4;

/// Distance of the lines of a hatched area, along its edges, in points. Chosen: single lines are visible in print.
const HATCH_STEP: f64 = 3.2;

/// A line style.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Colour.
    pub colour: &'static str,
    /// Width, in points.
    pub width: f64,
    /// Lengths of dashes and spaces, in points; empty for a solid line.
    pub dashes: &'static [f64],
}

impl Stroke {
    /// A solid line.
    pub fn solid(colour: &'static str, width: f64) -> Stroke {
        Stroke { colour, width, dashes: &[] }
    }
}

/// The anchor of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The text starts at the position.
    Start,
    /// The text is centred at the position.
    Middle,
    /// The text ends at the position.
    End,
}

/// A rectangle: left, top, width, height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// Left edge.
    pub x: f64,
    /// Upper edge.
    pub y: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl Area {
    /// Whether it has points in common with another area.
    pub fn meets(&self, other: &Area) -> bool {
        self.x < other.x + other.width
            && other.x < self.x + self.width
            && self.y < other.y + other.height
            && other.y < self.y + self.height
    }

    /// Whether another area is within this one.
    pub fn holds(&self, other: &Area) -> bool {
        other.x >= self.x
            && other.x + other.width <= self.x + self.width
            && other.y >= self.y
            && other.y + other.height <= self.y + self.height
    }

    fn attributes(&self) -> String {
        let Area { x, y, width, height } = self;
        format!("x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"", at(*x), at(*y), at(*width), at(*height))
    }
}

/// A text style.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Text {
    /// Height of the letters, in points.
    pub size: f64,
    /// The anchor of the words.
    pub anchor: Anchor,
    /// Whether the text is rotated by a quarter turn to the left.
    pub upwards: bool,
    /// Colour.
    pub colour: &'static str,
}

/// The canvas.
#[derive(Debug, Default)]
pub struct Canvas {
    body: String,
    clips: usize,
}

/// A coordinate, to a hundredth of a point.
fn at(value: f64) -> String {
    let text = format!("{:.2}", if value.is_finite() { value.clamp(-1e5, 1e5) } else { 0.0 });
    match trimmed(&text) {
        "-0" => "0".to_owned(),
        text => text.to_owned(),
    }
}

/// The SVG path through points.
fn path(points: &[(f64, f64)]) -> String {
    let step =
        |(place, &(x, y)): (usize, &(f64, f64))| format!("{}{} {}", if place == 0 { 'M' } else { 'L' }, at(x), at(y));
    points.iter().enumerate().map(step).collect()
}

/// Text escaped for XML.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

impl Canvas {
    fn push(&mut self, arguments: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.body.write_fmt(arguments);
        self.body.push('\n');
    }

    fn style(fill: &str, stroke: &Stroke) -> String {
        let mut text = format!("fill=\"{fill}\" stroke=\"{}\" stroke-width=\"{}\"", stroke.colour, at(stroke.width));
        if !stroke.dashes.is_empty() {
            let dashes: Vec<String> = stroke.dashes.iter().map(|&dash| at(dash)).collect();
            text.push_str(&format!(" stroke-dasharray=\"{}\"", dashes.join(" ")));
        }
        text
    }

    /// A straight line.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), stroke: &Stroke) {
        self.push(format_args!("<path d=\"{}\" {}/>", path(&[from, to]), Self::style("none", stroke)));
    }

    /// Lines through points, one for each list.
    pub fn lines(&mut self, lines: &[Vec<(f64, f64)>], stroke: &Stroke) {
        let path: String = lines.iter().filter(|line| line.len() > 1).map(|line| path(line)).collect();
        if !path.is_empty() {
            let style = Self::style("none", stroke);
            self.push(format_args!("<path d=\"{path}\" stroke-linejoin=\"round\" {style}/>"));
        }
    }

    /// A closed shape.
    pub fn shape(&mut self, points: &[(f64, f64)], fill: &str, stroke: Option<&Stroke>) {
        let style = match stroke {
            Some(stroke) => format!("{} stroke-linejoin=\"round\"", Self::style(fill, stroke)),
            None => format!("fill=\"{fill}\""),
        };
        self.push(format_args!("<path d=\"{}Z\" {style}/>", path(points)));
    }

    /// A circle.
    pub fn circle(&mut self, (x, y): (f64, f64), radius: f64, fill: &str, stroke: &Stroke) {
        let place = format!("cx=\"{}\" cy=\"{}\" r=\"{}\"", at(x), at(y), at(radius));
        self.push(format_args!("<circle {place} {}/>", Self::style(fill, stroke)));
    }

    /// A filled rectangle.
    pub fn fill(&mut self, area: Area, colour: &str) {
        self.push(format_args!("<rect {} fill=\"{colour}\"/>", area.attributes()));
    }

    /// The frame of a rectangle.
    pub fn frame(&mut self, area: Area, stroke: &Stroke) {
        self.push(format_args!("<rect {} {}/>", area.attributes(), Self::style("none", stroke)));
    }

    /// A rectangle of grey diagonal lines: no data.
    pub fn hatch(&mut self, area: Area) {
        self.fill(area, "#efefef");
        self.clipped(area, |canvas| {
            let mut lines = Vec::new();
            let mut start = -area.height;
            while start < area.width {
                lines.push(vec![(area.x + start, area.y + area.height), (area.x + start + area.height, area.y)]);
                start += HATCH_STEP;
            }
            canvas.lines(&lines, &Stroke::solid("#a8a8a8", 0.4));
        });
    }

    /// An image, given as a PNG; its pixels stay sharp.
    pub fn image(&mut self, area: Area, png: &[u8]) {
        use base64::Engine;
        let data = base64::engine::general_purpose::STANDARD.encode(png);
        let place = area.attributes();
        self.push(format_args!(
            "<image {place} preserveAspectRatio=\"none\" style=\"image-rendering:pixelated\" \
             xlink:href=\"data:image/png;base64,{data}\"/>"
        ));
    }

    /// Draws `draw`, clipped to `area`.
    pub fn clipped(&mut self, area: Area, draw: impl FnOnce(&mut Canvas)) {
        self.clips += 1;
        let (id, rect) = (self.clips, area.attributes());
        self.push(format_args!("<clipPath id=\"clip{id}\"><rect {rect}/></clipPath><g clip-path=\"url(#clip{id})\">"));
        draw(self);
        self.push(format_args!("</g>"));
    }

    /// A text in markup with its baseline through `place`.
    pub fn text(&mut self, place: (f64, f64), markup: &str, style: &Text) {
        let Text { size, anchor, upwards, colour } = *style;
        // Anchors are computed from the metrics of the font, since viewers differ in how they anchor spans of several styles.
        let width = size * label::width(markup);
        let shift = match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -0.5 * width,
            Anchor::End => -width,
        };
        let mut spans = String::new();
        let mut level = 0;
        for span in label::spans(markup) {
            let height = |level: i8| match level {
                1 => -SUPERSCRIPT_RISE * size,
                -1 => SUBSCRIPT_DROP * size,
                _ => 0.0,
            };
            let mut style = String::new();
            if span.level != level {
                style.push_str(&format!(" dy=\"{}\"", at(height(span.level) - height(level))));
                level = span.level;
            }
            if span.level != 0 {
                style.push_str(&format!(" font-size=\"{}\"", at(SCRIPT_SIZE * size)));
            }
            if span.italic {
                style.push_str(" font-style=\"italic\"");
            }
            let text = escaped(&span.text);
            if style.is_empty() {
                spans.push_str(&text)
            } else {
                spans.push_str(&format!("<tspan{style}>{text}</tspan>"))
            }
        }
        let position = if upwards {
            format!("transform=\"translate({} {}) rotate(-90)\" x=\"{}\" y=\"0\"", at(place.0), at(place.1), at(shift))
        } else {
            format!("x=\"{}\" y=\"{}\"", at(place.0 + shift), at(place.1))
        };
        self.push(format_args!(
            "<text {position} font-size=\"{}\" fill=\"{colour}\" xml:space=\"preserve\">{spans}</text>",
            at(size)
        ));
    }

    /// The whole picture as SVG, with its size in points.
    pub fn svg(&self, width: f64, height: f64, title: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"{}mm\" height=\"{}mm\" \
             viewBox=\"0 0 {} {}\" font-family=\"{FAMILIES}\">\n<title>{}</title>\n<rect width=\"100%\" height=\"100%\" \
             fill=\"#fff\"/>\n{}</svg>\n",
            at(width / MILLIMETRE),
            at(height / MILLIMETRE),
            at(width),
            at(height),
            escaped(title),
            self.body
        )
    }
}
