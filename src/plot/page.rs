//! A self-contained HTML page: sections, pictures whose maps show their values, sortable tables.

use super::canvas::escaped;
use super::figure::{Axis, Hover, SvgFigure};

const STYLE: &str = include_str!("page/style.css");
const SCRIPT: &str = include_str!("page/script.js");

/// Greatest number of map values of a picture in the page; finer maps are thinned along both axes. Chosen: a few megabytes of text.
const MAX_CELLS: usize = 500_000;

/// A page under construction.
#[derive(Debug)]
pub struct Page {
    title: String,
    body: String,
    pictures: usize,
}

impl Page {
    /// An empty page.
    pub fn new(title: &str) -> Page {
        Page { title: escaped(title), body: String::new(), pictures: 0 }
    }

    /// Starts a section.
    pub fn heading(&mut self, text: &str) {
        self.body.push_str(&format!("<h2>{}</h2>\n", escaped(text)));
    }

    /// A paragraph.
    pub fn words(&mut self, text: &str) {
        self.body.push_str(&format!("<p>{}</p>\n", escaped(text)));
    }

    /// Preformatted text, such as a spec.
    pub fn verbatim(&mut self, text: &str) {
        self.body.push_str(&format!("<pre>{}</pre>\n", escaped(text)));
    }

    /// A table that sorts by a column when its name is clicked.
    pub fn table(&mut self, names: &[&str], rows: &[Vec<String>]) {
        let head = cells("th", names);
        let rows: String = rows.iter().map(|row| format!("<tr>{}</tr>\n", cells("td", row))).collect();
        self.body.push_str(&format!("<table><thead><tr>{head}</tr></thead><tbody>\n{rows}</tbody></table>\n"));
    }

    /// A picture; pointing at a map in it shows the value there.
    pub fn picture(&mut self, drawn: &SvgFigure<'_>) {
        self.pictures += 1;
        let place = self.pictures;
        // The names of clip paths must be unique in the page.
        let svg = drawn
            .svg
            .replace("id=\"clip", &format!("id=\"p{place}-clip"))
            .replace("url(#clip", &format!("url(#p{place}-clip"));
        self.body.push_str(&format!("<figure id=\"picture-{place}\">{svg}"));
        let cells: usize = drawn.maps.iter().map(|(.., hover)| hover.word.len()).sum();
        let step = (1..).find(|step| cells / (step * step) <= MAX_CELLS).unwrap_or(1);
        if !drawn.maps.is_empty() {
            let maps = drawn.maps.iter().map(|(area, panel, hover)| {
                let hover = hover.every(step);
                serde_json::json!({
                    "area": [area.x, area.y, area.width, area.height],
                    "x": axis(&panel.x, &hover.x),
                    "y": axis(&panel.y, &hover.y),
                    "column": hover.column,
                    "values": values(&hover),
                    "words": hover.words,
                    "word": hover.word,
                })
            });
            let data = serde_json::Value::Array(maps.collect()).to_string().replace("</", "<\\/");
            self.body.push_str(&format!("<script type=\"application/json\">{data}</script>"));
        }
        self.body.push_str("</figure>\n");
    }

    /// The page as a file.
    pub fn html(&self) -> String {
        let Page { title, body, .. } = self;
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n{body}<div id=\"tip\" hidden></div>\n\
             <script>\n{SCRIPT}</script>\n</body>\n</html>\n"
        )
    }
}

fn cells(tag: &str, cells: &[impl AsRef<str>]) -> String {
    cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell.as_ref()))).collect()
}

fn axis(axis: &Axis, middles: &[f64]) -> serde_json::Value {
    let scale = axis.scale;
    serde_json::json!({ "name": axis.column, "low": scale.low, "high": scale.high, "log": scale.log, "middles": middles })
}

/// Values to five digits.
fn values(hover: &Hover) -> Vec<Option<f64>> {
    let short = |value: &f64| format!("{value:.4e}").parse().ok().filter(|value: &f64| value.is_finite());
    hover.values.iter().map(short).collect()
}
