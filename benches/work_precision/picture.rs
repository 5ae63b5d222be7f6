//! Pictures of time against error: a panel for each kind of cases, a line with marks for each method.

use slipsweep::plot::{Axis, Entry, Figure, Key, Layer, PAGE, Panel, Scale, series};

use super::measure::Record;

/// Errors below are drawn here: they are rounding.
const LEAST_ERROR: f64 = 1e-16;

/// The picture of the records of one subject, as SVG; `None` without any that succeed.
pub fn draw(title: &str, error: &str, records: &[&Record]) -> Option<String> {
    let mut kinds: Vec<&str> = records.iter().map(|record| record.cases).collect();
    kinds.dedup();
    let mut methods: Vec<&str> = Vec::new();
    for record in records {
        if !methods.contains(&record.method.as_str()) {
            methods.push(&record.method);
        }
    }
    let place = |record: &Record| (record.errors[1].max(LEAST_ERROR), record.ns);
    let seen = |record: &&&Record| record.errors[1].is_finite() && 2 * record.failures <= record.count;
    let points: Vec<(f64, f64)> = records.iter().filter(seen).map(|record| place(record)).collect();
    let scale = |values: &mut dyn Iterator<Item = f64>| {
        Scale::of(values).map(|scale| Scale { log: true, ..scale }.with_room(0.05))
    };
    let x = scale(&mut points.iter().map(|point| point.0))?;
    let y = scale(&mut points.iter().map(|point| point.1))?;
    let panels = kinds.iter().map(|&kind| {
        let mut layers = Vec::new();
        for (series_place, method) in methods.iter().enumerate() {
            let of_line = |record: &&&Record| record.cases == kind && record.method == *method;
            let line: Vec<(f64, f64)> =
                records.iter().filter(of_line).filter(seen).map(|record| place(record)).collect();
            layers.push(Layer::Line(line.clone(), series(series_place)));
            layers.push(Layer::marks(line, series_place));
        }
        // What is ours is drawn last, on top.
        layers.rotate_left(2);
        Panel { title: kind.to_owned(), x: Axis::new("error", "1", x), y: Axis::new("time a case", "ns", y), layers }
    });
    let panels: Vec<Panel> = panels.collect();
    let mut notes = Vec::new();
    for &kind in &kinds {
        for &method in &methods {
            let own = records.iter().filter(|record| record.cases == kind && record.method == method);
            if own.clone().any(|record| seen(&record)) {
                continue;
            }
            if let Some(best) = own.min_by_key(|record| record.failures) {
                notes.push(format!("{method} fails on {} of {} cases at least: {kind}.", best.failures, best.count));
            }
        }
    }
    let entry = |(place, method): (usize, &&str)| Entry { key: Key::series(place, true), text: (*method).to_owned() };
    let figure = Figure {
        title: title.to_owned(),
        subtitle: format!(
            "Error: {error}, below which 95 % of the cases are; settings that fail on more than half are left out."
        ),
        columns: panels.len(),
        aspect: if panels.len() > 1 { 0.9 } else { 0.5 },
        legend: methods.iter().enumerate().map(entry).collect(),
        panels,
        notes,
        ..Figure::default()
    };
    Some(figure.draw(PAGE).svg)
}
