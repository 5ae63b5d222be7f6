//! Times at equal error, interpolated.

use crate::case::{Case, Measured};

/// One integration.
#[derive(Debug, Clone)]
pub struct Point {
    pub method: String,
    pub seconds: f64,
    pub error: f64,
    /// Whether the number of peaks is right.
    pub right: bool,
}

impl Point {
    pub fn new(case: &Case, method: &str, measured: &Measured) -> Point {
        Point {
            method: method.into(),
            seconds: measured.seconds,
            error: case.error(&measured.end),
            right: measured.peaks.count == case.peaks,
        }
    }
}

/// Time in which a method gets below an error: linear in the logarithms between its best points. `None` if it does not.
fn time_to(points: &[Point], error: f64) -> Option<f64> {
    let mut points: Vec<&Point> = points.iter().filter(|point| point.right).collect();
    points.sort_by(|p, q| p.seconds.total_cmp(&q.seconds));
    let mut before: Option<&Point> = None;
    for point in points {
        if before.is_some_and(|before| before.error <= point.error) {
            continue;
        }
        if point.error <= error {
            return Some(before.map_or(point.seconds, |before| {
                let fraction = (before.error / error).ln() / (before.error / point.error).ln();
                before.seconds * (point.seconds / before.seconds).powf(fraction)
            }));
        }
        before = Some(point);
    }
    None
}

/// The fastest method at an error.
fn fastest(methods: &[Vec<Point>], error: f64) -> Option<(f64, &str)> {
    methods
        .iter()
        .filter_map(|points| Some((time_to(points, error)?, points.first()?.method.as_str())))
        .min_by(|p, q| p.0.total_cmp(&q.0))
}

fn smallest(points: &[Point]) -> f64 {
    points.iter().filter(|point| point.right).map(|point| point.error).fold(f64::INFINITY, f64::min)
}

pub fn print(case: &Case, ours: &[Vec<Point>], libraries: &[Vec<Point>]) {
    println!("\n### {}\n\nms to an error of the end:\n", case.name);
    println!("| error | ours | Radau IIA | best library | | ours is faster by |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let reached = libraries.iter().map(|points| smallest(points)).fold(f64::INFINITY, f64::min);
    let round = (2..=12).map(|digits| 10f64.powi(-digits));
    let mut errors: Vec<f64> = round.chain([reached]).collect();
    errors.sort_by(|p, q| q.total_cmp(p));
    for error in errors {
        let ms = |time: Option<f64>| time.map_or("-".into(), |time| format!("{:.3}", 1e3 * time));
        let own: Vec<Option<f64>> = ours.iter().map(|points| time_to(points, error)).collect();
        let best = fastest(libraries, error);
        let name = best.map_or("none gets there", |(_, name)| name);
        let ratio = own[0].zip(best).map_or("-".into(), |(own, (time, _))| format!("{:.1}", time / own));
        let own: Vec<String> = own.into_iter().map(ms).collect();
        println!("| {error:.1e} | {} | {} | {name} | {ratio} |", own.join(" | "), ms(best.map(|(time, _)| time)));
    }
    println!("\nsmallest errors:");
    for points in ours.iter().chain(libraries).filter(|points| !points.is_empty()) {
        println!("- {}: {:.1e}", points[0].method, smallest(points));
    }
}
