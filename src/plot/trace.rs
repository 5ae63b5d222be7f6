//! Traces as the paper has its protocols: velocity, contact lifetime and friction over time, several of them over each other.

use std::path::Path;

use super::canvas::Stroke;
use super::colour::{self, MOST_SERIES};
use super::error::PlotError;
use super::figure::{Axis, Entry, Figure, Key, Layer, Marker, Panel};
use super::scale::Scale;
use super::{coincide, label};
use crate::dataset::frame::{self, Cells, Facts};
use crate::file;
use crate::grid::{self, Quantity};
use crate::model::{Scales, Units};
use crate::table::Kind;
use crate::trace::COLUMNS;

/// Points of a picture beyond which a line is thinned: four to a dot of a wide picture in print.
const MOST_POINTS: usize = 8000;

/// What a trace may hold besides the time, and what a picture shows of it, a panel each: the velocity of the block and that of the control
/// are compared in one.
const SHOWN: [&[&str]; 3] = [&["v", "v_c"], &["theta"], &["tau"]];

/// Curves through fewer equally spaced points show them.
const MARKED: usize = 50;

/// A trace read back.
#[derive(Debug, Clone)]
pub struct Course {
    /// What it is called in a legend, in markup.
    pub name: String,
    /// Its parameters, by name.
    pub parameters: Vec<(String, f64)>,
    /// Its columns.
    pub columns: Vec<Column>,
    /// How many equally spaced points were requested, if any were.
    pub points: Option<usize>,
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
    let (columns, facts) = if is_csv { csv(path, &shown)? } else { parquet(path)? };
    let missing = ["t", "v"].into_iter().find(|name| !columns.iter().any(|column| column.name == *name));
    if let Some(missing) = missing {
        let found = columns.into_iter().map(|column| column.name).collect();
        return Err(PlotError::NoTrace { path: shown, missing, found });
    }
    let fact = |name: &str| facts.iter().find(|(key, _)| key == &format!("slipsweep.{name}")).map(|(_, value)| value);
    let number = |name: &&str| Some(((*name).to_owned(), fact(name)?.parse().ok()?));
    let parameters =
        ["t_f", "a", "b", "v_i", "v_f", "tau_max", "alpha_2", "alpha_3", "k", "m", "delta_t"].iter().filter_map(number);
    let name = label::literal(&fact("protocol").map_or(stem, Clone::clone));
    let points = fact("points").and_then(|points| points.parse().ok());
    Ok(Course { name, parameters: parameters.collect(), columns, points })
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

/// The columns of a CSV, and what its comments `# key = value` say; without a comment on units they are those of the
/// model.
fn csv(path: &Path, shown: &str) -> Result<(Vec<Column>, Facts), PlotError> {
    let text = file::open(path)
        .and_then(std::io::read_to_string)
        .map_err(|error| PlotError::Read { path: shown.to_owned(), reason: error.to_string() })?;
    let comments = text.lines().take_while(|line| line.starts_with('#'));
    let facts: Facts = comments
        .filter_map(|line| line.trim_start_matches('#').split_once('='))
        .map(|(key, value)| (format!("slipsweep.{}", key.trim()), value.trim().to_owned()))
        .collect();
    let units = facts.iter().find(|(key, _)| key == "slipsweep.units").map_or("", |(_, units)| units.as_str());
    let units: Vec<&str> = units.split(", ").collect();
    let mut lines = text.lines().enumerate().skip_while(|(_, line)| line.starts_with('#'));
    let names = lines.next().map_or("", |(_, line)| line);
    let column = |(place, name): (usize, &str)| {
        let unit = units.get(place).copied().filter(|known| !known.is_empty()).unwrap_or(unit(name));
        Column { name: name.to_owned(), unit: unit.to_owned(), cells: Vec::new() }
    };
    let mut columns: Vec<Column> = names.split(',').map(str::trim).enumerate().map(column).collect();
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
    Ok((columns, facts))
}

/// The unit of a column of the model.
fn unit(name: &str) -> &'static str {
    match COLUMNS.iter().find(|column| column.name == name).map(|column| column.kind) {
        Some(Kind::Number(unit)) => unit,
        _ => "",
    }
}

/// A curve of a panel: the number of its trace, that of its column, and its points.
type Curve = (usize, usize, Vec<(f64, f64)>);

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
    for name in SHOWN.iter().flat_map(|names| names.iter().copied()).chain(["t"]) {
        let mut units = courses.iter().filter_map(|course| Some(column(course, name)?.unit.as_str()));
        let first = units.next();
        if let (Some(first), Some(other)) = (first, units.find(|unit| Some(*unit) != first)) {
            let units = [first.to_owned(), other.to_owned()];
            return Err(PlotError::Units { column: name.to_owned(), units });
        }
    }
    let has = |name: &str| courses.iter().any(|course| column(course, name).is_some());
    let time = Scale { log: false, ..Scale::of(all("t")).ok_or(PlotError::Nothing)? };
    let x = time.with_room(0.03);
    let mut panels = Vec::new();
    // The curves of each panel.
    let mut curves: Vec<Vec<Curve>> = Vec::new();
    for names in SHOWN {
        let names: Vec<&str> = names.iter().copied().filter(|name| has(name)).collect();
        let Some(scale) = Scale::of(names.iter().flat_map(|name| all(name))) else { continue };
        let y = Axis { column: names.join(", "), unit: unit(names[0]), scale: scale.with_room(0.06) };
        let mut layers = Vec::new();
        if names[0] == "v" && (0.0..2.0).contains(&scale.low) && bound(&y.unit) {
            layers.push(Layer::Level(1.0, Stroke { colour: "#888".to_owned(), width: 0.5, dashes: &[1.0, 1.5] }));
        }
        let mut drawn = Vec::new();
        for (place, course) in courses.iter().enumerate() {
            for (rank, name) in names.iter().enumerate() {
                let (Some(t), Some(values)) = (column(course, "t"), column(course, name)) else { continue };
                drawn.push((place, rank, thinned(t.cells.iter().copied().zip(values.cells.iter().copied()).collect())));
            }
        }
        curves.push(drawn);
        panels.push(Panel {
            title: String::new(),
            x: Axis { column: "t".to_owned(), unit: unit("t"), scale: x },
            y,
            layers,
        });
    }
    // Courses that lie on each other in all panels are one.
    let shares: Vec<Vec<Curve>> = panels
        .iter()
        .zip(&curves)
        .map(|(panel, curves)| {
            let share = |(x, y): &(f64, f64)| (panel.x.scale.share(*x), panel.y.scale.share(*y));
            curves.iter().map(|(place, rank, points)| (*place, *rank, points.iter().map(share).collect())).collect()
        })
        .collect();
    let leaders = coincide::leaders(courses.len(), |one, other| {
        shares.iter().all(|curves| {
            let of = |course| curves.iter().filter(move |(place, ..)| *place == course);
            let same = |((_, rank, a), (_, other, b)): (&(usize, usize, _), &(usize, usize, _))| {
                rank == other && coincide::anywhere(a as &Vec<(f64, f64)>, b as &Vec<(f64, f64)>)
            };
            of(one).count() == of(other).count() && of(one).zip(of(other)).all(same)
        })
    });
    let is_marked = |place: usize| courses[place].points.is_some_and(|points| points < MARKED);
    for (panel, curves) in panels.iter_mut().zip(curves) {
        for (place, rank, points) in curves.into_iter().filter(|(place, ..)| leaders[*place] == *place) {
            let stroke = if rank == 0 { colour::series(place) } else { control(place) };
            panel.layers.push(Layer::Lines(vec![points.clone()], stroke));
            if is_marked(place) && rank == 0 {
                panel.layers.push(Layer::Points(points, Marker { series: place }));
            }
        }
    }
    // What all of them have in common is said once, what tells them apart in the legend.
    let known: Vec<&Course> = courses.iter().filter(|course| !course.parameters.is_empty()).collect();
    let common: Vec<&(String, f64)> = known.first().map_or_else(Vec::new, |first| {
        first.parameters.iter().filter(|entry| known.iter().all(|course| course.parameters.contains(entry))).collect()
    });
    let unit_of_time = unit("t");
    let list = |entries: &[&(String, f64)]| {
        let words = entries
            .iter()
            .map(|(name, value)| label::equation(name, &label::number(*value), unit_of(name, &unit_of_time)));
        words.collect::<Vec<_>>().join(", ")
    };
    let told = |course: &Course| {
        let own: Vec<&(String, f64)> = course.parameters.iter().filter(|entry| !common.contains(entry)).collect();
        if own.is_empty() { course.name.clone() } else { format!("{}, {}", course.name, list(&own)) }
    };
    let mut legend = Vec::new();
    for place in (0..courses.len()).filter(|&place| leaders[place] == place && courses.len() > 1) {
        let same = courses.iter().zip(&leaders).filter(|(_, leader)| **leader == place);
        let key = match is_marked(place) {
            true => Key::Marked(colour::series(place), Marker { series: place }),
            false => Key::Line(colour::series(place)),
        };
        legend.push(Entry { key, text: same.map(|(course, _)| told(course)).collect::<Vec<_>>().join("; ") });
    }
    if has("v_c") {
        if courses.len() == 1 {
            legend.push(Entry { key: Key::Line(colour::series(0)), text: label::name("v") });
        }
        let text = if courses.len() == 1 { label::name("v_c") } else { format!("thin: {}", label::name("v_c")) };
        legend.push(Entry { key: Key::Line(control(0)), text });
    }
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
        legend,
        ..Figure::default()
    })
}

/// The line of the control velocity of a course: thinner than that of the block.
fn control(place: usize) -> Stroke {
    Stroke { width: 0.5, ..colour::series(place) }
}

/// Whether the least velocity of the model, 1, is on an axis with this unit.
fn bound(unit: &str) -> bool {
    unit == "v_0"
}

/// The unit of a parameter of a trace whose times are in `time`.
fn unit_of(parameter: &str, time: &str) -> &'static str {
    let of = Quantity::from_name(parameter).map_or("1", |quantity| quantity.unit(grid::Scale::Duration));
    // Names of units in SI do not depend on the scales.
    let scales = Scales { mu_0: 1.0, l: 1.0, v_0: 1.0, normal_load: 1.0 };
    if time == "s" { Units::Si(scales).name(of) } else { of }
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
