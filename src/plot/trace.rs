//! Traces as the paper has its protocols: velocity, contact lifetime and friction over time, several of them over each other.

use std::path::Path;

use super::canvas::Stroke;
use super::colour::{self, MOST_SERIES};
use super::error::PlotError;
use super::figure::{Axis, Entry, Figure, Key, Layer, Panel};
use super::label;
use super::scale::Scale;
use crate::dataset::frame::{self, Cells, Facts};
use crate::table::Kind;
use crate::trace::COLUMNS;

/// Points of a picture beyond which a line is thinned: four to a dot of a wide picture in print.
const MOST_POINTS: usize = 8000;

/// What a trace may hold besides the time, and what a picture shows of it.
const SHOWN: [&str; 4] = ["v", "theta", "tau", "v_c"];

/// A trace read back.
#[derive(Debug, Clone)]
pub struct Course {
    /// What it is called in a legend, in markup.
    pub name: String,
    /// Its parameters, by name.
    pub parameters: Vec<(String, f64)>,
    /// Its columns.
    pub columns: Vec<Column>,
}

/// A column of a trace.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its cells, NaN where there is none.
    pub cells: Vec<f64>,
}

/// Reads a trace that `slipsweep trace` wrote as CSV or Parquet.
pub fn read(path: &Path) -> Result<Course, PlotError> {
    let shown = path.display().to_string();
    let stem = path.file_stem().map_or_else(|| shown.clone(), |stem| stem.to_string_lossy().into_owned());
    let is_csv = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
    let (columns, facts) = if is_csv { (csv(path, &shown)?, Vec::new()) } else { parquet(path)? };
    let missing = ["t", "v"].into_iter().find(|name| !columns.iter().any(|column| column.name == *name));
    if let Some(missing) = missing {
        let found = columns.into_iter().map(|column| column.name).collect();
        return Err(PlotError::NoTrace { path: shown, missing, found });
    }
    let fact = |name: &str| facts.iter().find(|(key, _)| key == &format!("slipsweep.{name}")).map(|(_, value)| value);
    let number = |name: &&str| Some(((*name).to_owned(), fact(name)?.parse().ok()?));
    let parameters =
        ["t_f", "a", "b", "v_i", "v_f", "tau_max", "alpha_2", "alpha_3", "k", "m", "delta_t"].iter().filter_map(number);
    // In a name of the user's, signs of markup mean nothing.
    let plain = |letter: char| if letter.is_control() || "*_^{}".contains(letter) { ' ' } else { letter };
    let name = fact("protocol").map_or(stem, Clone::clone).chars().map(plain).collect();
    Ok(Course { name, parameters: parameters.collect(), columns })
}

fn parquet(path: &Path) -> Result<(Vec<Column>, Facts), PlotError> {
    let (headings, facts) = frame::headings(path).map_err(PlotError::Trace)?;
    let names: Vec<&str> = headings.iter().filter(|heading| heading.is_number).map(|h| h.name.as_str()).collect();
    let numbers =
        frame::read(path, &names).map_err(PlotError::Trace)?.columns.into_iter().map(|(_, cells)| match cells {
            Cells::Numbers(numbers) => numbers,
            Cells::Words(..) => Vec::new(),
        });
    let numeric = headings.iter().filter(|heading| heading.is_number);
    let column = |(heading, cells): (&frame::Heading, Vec<f64>)| Column {
        name: heading.name.clone(),
        unit: heading.unit.clone(),
        cells,
    };
    Ok((numeric.zip(numbers).map(column).collect(), facts))
}

/// A CSV says nothing of units: they are those of the model.
fn csv(path: &Path, shown: &str) -> Result<Vec<Column>, PlotError> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| PlotError::Read { path: shown.to_owned(), reason: error.to_string() })?;
    let mut lines = text.lines().enumerate();
    let names = lines.next().map_or("", |(_, line)| line);
    let column = |name: &str| Column { name: name.to_owned(), unit: unit(name).to_owned(), cells: Vec::new() };
    let mut columns: Vec<Column> = names.split(',').map(|name| column(name.trim())).collect();
    for (number, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let cells: Vec<&str> = line.split(',').collect();
        let wrong = |found: String, expected: String| PlotError::Cell {
            path: shown.to_owned(),
            line: number + 1,
            found,
            expected,
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
    Ok(columns)
}

/// The unit of a column of the model.
fn unit(name: &str) -> &'static str {
    match COLUMNS.iter().find(|column| column.name == name).map(|column| column.kind) {
        Some(Kind::Number(unit)) => unit,
        _ => "",
    }
}

/// The figure of traces: a panel for each column that any of them has.
pub fn figure(courses: &[Course]) -> Result<Figure, PlotError> {
    if courses.len() > MOST_SERIES {
        return Err(PlotError::TooManyTraces { found: courses.len(), most: MOST_SERIES });
    }
    fn column<'a>(course: &'a Course, name: &str) -> Option<&'a Column> {
        course.columns.iter().find(|column| column.name == name)
    }
    let all = |name: &str| {
        courses
            .iter()
            .filter_map(|course| column(course, name))
            .flat_map(|column| column.cells.clone())
            .collect::<Vec<_>>()
    };
    let unit =
        |name: &str| courses.iter().find_map(|course| Some(column(course, name)?.unit.clone())).unwrap_or_default();
    // The control velocity may be negative, so it has a panel of its own.
    let shown: Vec<&str> =
        SHOWN.into_iter().filter(|name| courses.iter().any(|course| column(course, name).is_some())).collect();
    let time = Scale { log: false, ..Scale::of(all("t")).ok_or(PlotError::Nothing)? };
    let mut panels = Vec::new();
    for name in &shown {
        let mut layers = Vec::new();
        let Some(scale) = Scale::of(all(name)) else { continue };
        if *name == "v" && scale.low < 2.0 {
            layers.push(Layer::Level(1.0, Stroke { colour: "#888".to_owned(), width: 0.5, dashes: &[1.0, 1.5] }));
        }
        for (place, course) in courses.iter().enumerate() {
            let (Some(t), Some(values)) = (column(course, "t"), column(course, name)) else { continue };
            let points: Vec<(f64, f64)> = t.cells.iter().copied().zip(values.cells.iter().copied()).collect();
            layers.push(Layer::Lines(vec![thinned(points)], colour::series(place)));
        }
        panels.push(Panel {
            title: String::new(),
            x: Axis { column: "t".to_owned(), unit: unit("t"), scale: time.with_room(0.03) },
            y: Axis { column: (*name).to_owned(), unit: unit(name), scale: scale.with_room(0.06) },
            layers,
        });
    }
    // What all of them have in common is said once, what tells them apart in the legend.
    let known: Vec<&Course> = courses.iter().filter(|course| !course.parameters.is_empty()).collect();
    let common: Vec<&(String, f64)> = known.first().map_or_else(Vec::new, |first| {
        first.parameters.iter().filter(|entry| known.iter().all(|course| course.parameters.contains(entry))).collect()
    });
    let list = |entries: &[&(String, f64)]| {
        let words = entries.iter().map(|(name, value)| format!("{} = {}", label::name(name), label::number(*value)));
        words.collect::<Vec<_>>().join(", ")
    };
    let legend = courses.iter().enumerate().map(|(place, course)| {
        let own: Vec<&(String, f64)> = course.parameters.iter().filter(|entry| !common.contains(entry)).collect();
        let text = if own.is_empty() { course.name.clone() } else { format!("{}, {}", course.name, list(&own)) };
        Entry { key: Key::Line(colour::series(place)), text }
    });
    let title = match courses {
        [one] => format!("Protocol {}", one.name),
        _ => "Protocols".to_owned(),
    };
    Ok(Figure {
        title,
        subtitle: list(&common),
        panels,
        columns: 1,
        aspect: 0.42,
        shared: true,
        legend: if courses.len() > 1 { legend.collect() } else { Vec::new() },
        ..Figure::default()
    })
}

/// The first, least, greatest and last point of each stretch of time, where there are more points than a picture shows.
fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= MOST_POINTS {
        return points;
    }
    let stretch = points.len().div_ceil(MOST_POINTS / 4);
    let mut kept = Vec::with_capacity(MOST_POINTS + 4);
    for chunk in points.chunks(stretch) {
        let by_value = |i: &usize, j: &usize| chunk[*i].1.total_cmp(&chunk[*j].1);
        let mut places =
            [Some(0), (0..chunk.len()).min_by(by_value), (0..chunk.len()).max_by(by_value), chunk.len().checked_sub(1)];
        places.sort_unstable();
        let mut last = None;
        for place in places.into_iter().flatten() {
            if last != Some(place) {
                kept.push(chunk[place]);
                last = Some(place);
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    //! Thinning keeps what is seen.

    use super::*;

    #[test]
    fn thinning_keeps_every_extreme() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), f64::from(i % 7))).collect();
        points[54_321].1 = 1e6;
        points[67_890].1 = -1e6;
        let kept = thinned(points.clone());
        assert!(kept.len() <= MOST_POINTS + 4);
        assert!(kept.contains(&points[54_321]) && kept.contains(&points[67_890]));
        assert_eq!((kept.first(), kept.last()), (points.first(), points.last()));
    }
}
